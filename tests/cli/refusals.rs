//! Requests that cannot be met are refused, and doubtful results are told.

use crate::program::Scratch;
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixDatagram;
use std::process::Command;

const BAND: &str = "--freq 1.4GHz --bandwidth 64MHz";

#[test]
fn a_source_that_never_rises_is_refused_and_one_that_sets_is_told() {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0,0,1\n");
    let simulate = |place: &str, name: &str| {
        format!(
            "simulate --layout vla-d --scene s.csv {BAND} --phase-center {place} --start 2025-06-01T00:00:00 --duration 24h --integration 1h -o {name}"
        )
    };
    let words = ["-89.00 deg", "34.08 deg", "limit of 0 deg", "never rises"];
    s.fails(&simulate("10deg,-89deg", "a.uvh5"), 1, &words);
    s.fails(&format!("{} --elevation-limit 5deg", simulate("10deg,-52deg", "a.uvh5")), 1, &["limit of 5 deg", "-52.00 deg"]);
    let said = s.ok(&simulate("10deg,10deg", "b.uvh5"));
    assert!(said.err.contains("below the horizon for") && said.err.contains("--elevation-limit"), "{}", said.err);
    let said = s.ok(&format!("{} --elevation-limit 0deg", simulate("10deg,10deg", "c.uvh5")));
    assert!(!said.err.contains("horizon"), "{}", said.err);
}

#[test]
fn the_image_of_a_world_wide_array_covers_what_it_resolves() {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0,0,1\n");
    s.ok("simulate --layout eht-2017 --scene s.csv --freq 230GHz --bandwidth 2GHz --phase-center 187.7deg,12.39deg --hour-angle -2h,2h \
          --integration 10min --elevation-limit 10deg -o v.uvh5");
    let d = s.json("dirty v.uvh5 -o d.fits");
    let side = d["size"][0].as_u64().unwrap();
    let field_uas = d["cell_rad"].as_f64().unwrap() * side as f64 * 206_264.806e6;
    // The shortest baseline between sites is a few hundred km: its fringe at 1.3 mm is about a milliarcsecond.
    assert!(side <= 1024 && field_uas > 200.0, "{d}");
    let said = s.ok("dirty v.uvh5 -o d.fits --overwrite");
    assert!(said.err.contains("antennas of one site"), "{}", said.err);
}

#[test]
fn pictures_have_the_format_of_their_ending() {
    let s = Scratch::new();
    s.ok("plot vla-d -o a.svg");
    let svg = std::fs::read_to_string(s.path("a.svg")).unwrap();
    assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>") && svg.matches("<circle").count() >= 27, "{}", &svg[..200]);
    s.ok("plot vla-d -o a.png");
    assert!(std::fs::read(s.path("a.png")).unwrap().starts_with(b"\x89PNG"));
    s.ok("plot vla-d -o a.pdf");
    assert!(std::fs::read(s.path("a.pdf")).unwrap().starts_with(b"%PDF-"));
    for name in ["a.eps", "a.jpg", "a"] {
        s.fails(&format!("plot vla-d -o {name}"), 2, &["--output", name, ".svg"]);
    }
    // 351 baselines and their conjugates, without the antennas.
    s.ok("plot vla-d --what uv --freq 1.4GHz -o uv.svg");
    let svg = std::fs::read_to_string(s.path("uv.svg")).unwrap();
    assert_eq!(svg.matches("<circle").count(), 2 * 351);
    s.fails("plot vla-d --what uv -o uv2.svg", 2, &["--freq"]);
    s.fails("plot vla-d --what visibilities -o uv2.svg", 2, &["no visibilities"]);
}

#[test]
fn a_scene_is_rendered_at_its_own_frequency() {
    let s = Scratch::new();
    let ship = concat!(env!("CARGO_MANIFEST_DIR"), "/phenomenology/scenes/ship.toml");
    s.ok(&format!("scene render {ship} --scene-size 24 -o own.fits"));
    assert_eq!(s.json("info own.fits")["freq_hz"][0].as_f64(), Some(37e9));
    let said = s.ok(&format!("scene render {ship} --scene-size 24 --freq 94GHz -o other.fits"));
    assert!(said.err.contains("described for 37GHz"), "{}", said.err);
    let tank = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/phenomenology/scenes/t-72.toml")).unwrap();
    s.write("tank.toml", tank.replace("freq_hz = 94e9\n", ""));
    assert!(s.ok("scene render tank.toml --scene-size 24 -o tank.fits").err.contains("states no frequency: 94GHz"));
}

#[test]
fn weights_that_do_not_fit_the_data_are_told() {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0.0003,0,1\n");
    let simulate =
        format!("simulate --layout vla-d --scene s.csv {BAND} --phase-center 10deg,40deg --hour-angle 0h,1h --integration 10min");
    // Without noise the weights are 1, which is the noise of 1 Jy a visibility.
    s.ok(&format!("{simulate} -o v.uvh5"));
    let said = s.ok("clean v.uvh5 --size 64 --cell 20arcsec --niter 500 --gain 0.05 -o c");
    assert!(said.out.contains("chi2/datum") && said.out.contains("the weights do not fit the data"), "{}", said.out);
    s.ok(&format!("{simulate} --noise -o n.uvh5"));
    let said = s.ok("clean n.uvh5 --size 64 --cell 20arcsec --niter 2000 --gain 0.05 --nsigma 4 -o d");
    assert!(!said.out.contains("weights"), "{}", said.out);
}

#[test]
fn maximum_entropy_that_comes_no_closer_stops_and_says_so() {
    let s = Scratch::new();
    // Points between the pixels of coarse cells: no image of 32 x 32 pixels fits these data to their noise.
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0.00021,0.00013,1.0\n-0.00034,0.00041,0.7\n");
    s.ok(&format!(
        "simulate --layout vla-d --scene s.csv {BAND} --phase-center 13h31m08s,+30d30m33s --start 2025-06-01T01:30:00 --duration 4min --integration 60s --noise -o v.uvh5"
    ));
    let said = s.run("mem v.uvh5 --size 32 --cell 20arcsec --niter 100000 -o m");
    assert_eq!(said.code, 1, "{}{}", said.out, said.err);
    assert!(said.out.contains("stalled") && said.err.contains("More steps do not help"), "{}{}", said.out, said.err);
}

#[test]
fn the_numbers_of_a_run_name_the_files_that_it_leaves() {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0.01,0.005,1.0\n");
    s.write(
        "r.toml",
        "title = \"t\"\nlayout = { name = \"mm-y\" }\nscene = { file = \"s.csv\" }\n\
         simulate = { freq = \"94GHz\", bandwidth = \"1GHz\" }\nimage = { size = 64, cell = \"1mrad\" }\nclean = [{ niter = 20 }]\n",
    );
    s.ok("run r.toml -o out");
    let text = std::fs::read_to_string(s.path("out/metrics.json")).unwrap();
    assert!(!text.contains("partial") && text.contains("out/clean"), "{text}");
}

#[test]
fn options_without_effect_and_numbers_beyond_all_bounds_are_refused() {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0,0,1\n");
    let look = format!("--layout vla-d --scene s.csv {BAND} --phase-center 0deg,34deg --start 2025-06-01T19:00:00");
    s.ok(&format!("simulate {look} -o v.uvh5"));
    let clean = "clean v.uvh5 --size 64 --cell 20arcsec -o c";
    for (command, code, words) in [
        (format!("{clean} --scales 0,4"), 1, ["--scales", "multiscale"]),
        (format!("{clean} --scale-bias 0.3"), 1, ["--scale-bias", "multiscale"]),
        (format!("{clean} --algorithm clark --scales 0,4"), 1, ["--scales", "multiscale"]),
        (format!("{clean} --hold-out 0.6"), 2, ["--hold-out", "0 (no judgement) to 0.5"]),
        (format!("{clean} --weighting natural --super-uniform 2"), 1, ["--super-uniform", "uniform"]),
        (format!("simulate {look} --element-diameter 25m -o w.uvh5"), 2, ["--element-diameter", "airy"]),
        (format!("simulate {look} --element airy --element-width 1deg -o w.uvh5"), 2, ["--element-width", "gaussian"]),
        ("corrupt v.uvh5 --phase-rms 5deg --wind 5m/s -o w.uvh5".into(), 1, ["troposphere", "turns this error on"]),
        ("corrupt v.uvh5 --phase-rms 5deg --dropout-noticed -o w.uvh5".into(), 1, ["dropout", "turns this error on"]),
        ("corrupt v.uvh5 --phase-rms 1e300deg -o w.uvh5".into(), 2, ["--phase-rms", "no angle of that size"]),
        ("corrupt v.uvh5 --troposphere 1rad --outer-scale 1e300m -o w.uvh5".into(), 2, ["--outer-scale", "no length of that size"]),
    ] {
        s.fails(&command, code, &words);
    }
    assert!(!s.path("w.uvh5").exists() && !s.path("c-image.fits").exists());
    s.ok("corrupt v.uvh5 --troposphere 1rad --wind 5m/s -o w.uvh5");
}

#[test]
fn gains_of_another_band_or_another_month_are_refused() {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0,0,1\n");
    for (name, freq, day) in [("v", "8.4GHz", "2025-06-01"), ("k", "22GHz", "2025-06-01"), ("later", "8.4GHz", "2025-07-01")] {
        s.ok(&format!(
            "simulate --layout vla-d --scene s.csv --freq {freq} --bandwidth 64MHz --phase-center 0deg,34deg --start {day}T18:00:00 -o {name}.uvh5"
        ));
    }
    s.ok("corrupt v.uvh5 --phase-rms 20deg -o c.uvh5 --gains t.calh5");
    s.ok("applycal c.uvh5 t.calh5 -o good.uvh5");
    for name in ["k", "later"] {
        s.fails(&format!("applycal {name}.uvh5 t.calh5 -o {name}-out.uvh5"), 1, &["t.calh5", "not solved for these data", "--force"]);
        assert!(!s.path(&format!("{name}-out.uvh5")).exists());
        s.ok(&format!("applycal {name}.uvh5 t.calh5 --force -o {name}-out.uvh5"));
    }
}

/// A socket of datagrams keeps each write apart. What mpirun prints at the same moment must not come between the parts of a line.
#[test]
fn an_error_is_one_write() {
    let (ours, theirs) = UnixDatagram::pair().unwrap();
    let s = Scratch::new();
    let program = assert_cmd::cargo::cargo_bin("cittert");
    let ended = Command::new(program).current_dir(s.path("")).args(["info", "none.uvh5"]).stderr(OwnedFd::from(theirs)).status().unwrap();
    assert_eq!(ended.code(), Some(1));
    ours.set_nonblocking(true).unwrap();
    let mut line = [0; 4096];
    let n = ours.recv(&mut line).unwrap();
    let line = String::from_utf8_lossy(&line[..n]);
    assert!(line.starts_with("error: ") && line.contains("none.uvh5") && line.ends_with('\n'), "{line}");
    assert!(ours.recv(&mut [0; 16]).is_err());
}
