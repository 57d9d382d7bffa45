//! `sensor`: scenes through a filled aperture from the command line and from files.

use crate::program::Scratch;
use serde_json::Value;

const CONFIG: &str = "[pupil]\naperture = \"circle=1m\"\nblockage = \"circle=20cm\"\n[band]\nfreq = \"94GHz\"\nbandwidth = \"4GHz\"\n\
                      [scan]\nscan = \"raster\"\nbeams = 4\nframe-time = \"2s\"\n[noise]\ntsys = \"1000K\"\nseed = 3\n";

/// A scene in kelvin with a warm disc, and the file of a sensor.
fn scratch() -> Scratch {
    let s = Scratch::new();
    let scene = "name = \"disc\"\nkind = \"analytic\"\n[background]\ntemperature_k = 280.0\n[[shape]]\ntype = \"ellipse\"\n\
                 center_deg = [0.3, -0.2]\nsize_deg = [1.2, 1.2]\ntemperature_k = 310.0\n";
    s.write("scene.toml", scene);
    s.ok("scene render scene.toml --scene-size 64 --scene-cell 1mrad --freq 94GHz --bandwidth 1GHz -o scene.fits");
    s.write("s.toml", CONFIG);
    s
}

fn number(v: &Value, key: &str) -> f64 {
    v[key].as_f64().unwrap_or_else(|| panic!("{key} is not a number in {v}"))
}

fn data(s: &Scratch, name: &str, pixels: usize) -> Vec<u8> {
    let bytes = std::fs::read(s.path(name)).unwrap();
    let header = bytes.chunks(80).position(|card| card.starts_with(b"END     ")).unwrap() * 80;
    let start = (header / 2880 + 1) * 2880;
    bytes[start..start + 4 * pixels].to_vec()
}

#[test]
fn a_scene_becomes_an_image_with_its_figures_and_enhance_reads_the_psf() {
    let s = scratch();
    let c = s.json("sensor scene.fits --config s.toml -o o");
    // 1.03 wavelengths over the diameter, a little less with a blockage.
    let airy = 299_792_458.0 / 94e9;
    assert!((number(&c, "optics_fwhm_l_rad") / airy - 1.01).abs() < 0.03, "{c}");
    assert!((number(&c, "strehl") - 1.0).abs() < 1e-9 && (number(&c, "aperture_m2") - 0.7540).abs() < 1e-3, "{c}");
    assert!((number(&c, "dwell_s") - 2.0 / 1024.0).abs() < 1e-12, "{c}");
    let nedt = 1000.0 / (4e9_f64 * 2.0 / 1024.0).sqrt();
    assert!((number(&c, "nedt_k") / nedt - 1.0).abs() < 1e-6, "{c}");
    assert!((number(&c["noise_parts_k"], "thermal") / nedt - 1.0).abs() < 1e-6, "{c}");
    assert!(number(&c["truth"], "rms_difference") < 5.0 && number(&c["truth"], "ssim") > 0.7, "{c}");
    for name in ["o-image.png", "o-psf.png", "o-nedt.png", "o-mtf.png"] {
        assert!(std::fs::read(s.path(name)).unwrap().starts_with(b"\x89PNG"), "{name}");
    }
    assert!(std::fs::read_to_string(s.path("o-report.html")).unwrap().contains("Filled-aperture sensor"));
    let table = std::fs::read_to_string(s.path("o-mtf.csv")).unwrap();
    assert!(table.lines().nth(1).unwrap().starts_with("0.000000000,1.000000000,1.000000000"), "{table}");
    let energy = std::fs::read_to_string(s.path("o-ensquared.csv")).unwrap();
    let last: Vec<f64> = energy.lines().last().unwrap().split(',').map(|v| v.parse().unwrap()).collect();
    assert!(last[1] > 0.85 && last[1] < 1.0 && last[2] <= last[1] + 1e-9, "{last:?}");
    assert_eq!((s.json("info o-image.fits")["unit"].as_str(), s.json("info o-psf.fits")["unit"].as_str()), (Some("K"), Some("")));
    let e = s.json("enhance o-image.fits --steps wiener-deconvolution=0.003 --psf o-psf.fits --truth scene.fits --no-png -o e.fits");
    assert!(number(&e["after"], "rms_difference") < number(&e["before"], "rms_difference"), "{e}");
    let e = s.json("enhance o-image.fits --steps richardson-lucy=20 --psf o-psf.fits --truth scene.fits --no-png -o f.fits");
    assert!(number(&e["after"], "rms_difference") < number(&e["before"], "rms_difference"), "{e}");
}

#[test]
fn the_command_line_replaces_what_it_names_and_nothing_else() {
    let s = scratch();
    let c = s.json("sensor scene.fits --config s.toml --frame-time 8s --pitch 2mrad --no-png -o o");
    assert_eq!(c["size"], serde_json::json!([32, 32]));
    assert!((number(&c, "dwell_s") - 8.0 * 4.0 / 1024.0).abs() < 1e-12, "{c}");
    // The default of an option that was not typed does not replace the file.
    assert_eq!(c["n_detectors"], 4);
    assert!(!s.path("o-image.png").exists());
    s.write("bad.toml", "[pupil]\naperture = \"circle=1m\"\nshape = 3\n");
    s.fails("sensor scene.fits --config bad.toml -o p", 1, &["bad.toml", "line 3", "shape"]);
    s.write("bad.toml", "[pupil]\naperture = \"disc=1m\"\n");
    s.fails("sensor scene.fits --config bad.toml -o p", 1, &["bad.toml", "line 2", "circle=DIAMETER"]);
    s.write("bad.toml", "[scan]\nefficiency = inf\n");
    s.fails("sensor scene.fits --config bad.toml -o p", 1, &["bad.toml", "scan.efficiency is inf"]);
    std::fs::create_dir(s.path("sub")).unwrap();
    std::fs::copy(s.path("o-psf.fits"), s.path("sub/mask.fits")).unwrap();
    s.write("sub/m.toml", "[pupil]\naperture = \"rectangle=1m:1m\"\naperture-mask = \"mask.fits\"\n");
    // The weights of a PSF lie between 0 and 1.
    s.ok("sensor scene.fits --config sub/m.toml --no-png -o m");
    s.fails("sensor scene.fits --config s.toml --aperture-mask mask.fits --no-png -o n", 1, &["mask.fits"]);
}

#[test]
fn two_instruments_stand_side_by_side() {
    let s = scratch();
    s.ok("sensor scene.fits --config s.toml --aperture circle=0.5m --seed 9 --no-png -o small");
    let said = s.ok("sensor scene.fits --config s.toml --beside small-image.fits --truth scene.fits -o o");
    assert!(said.out.contains("beside") && said.out.contains("SSIM"), "{}", said.out);
    let page = std::fs::read_to_string(s.path("o-report.html")).unwrap();
    assert!(page.contains("small-image.fits differs from it by") && page.contains("the sensor is nearer to the truth"));
    let c = s.json("sensor scene.fits --config s.toml --beside small-image.fits --no-png -o p");
    assert!(number(&c["beside"], "rms_difference") > number(&c["truth"], "rms_difference"), "{c}");
}

#[test]
fn the_bytes_of_the_data_depend_on_the_seed_and_not_on_the_threads() {
    let s = scratch();
    let image = |name: &str, options: &str| {
        s.ok(&format!(
            "sensor scene.fits --config s.toml --knee 10Hz --gain-drift 1e-4 --offset-pattern 0.2K {options} --no-png -o {name}"
        ));
        data(&s, &format!("{name}-image.fits"), 64 * 64)
    };
    let one = image("a", "--threads 1");
    assert!(one == image("b", "--threads 3") && one != image("c", "--seed 4"));
}

#[test]
fn wrong_calls_have_one_clear_message_each() {
    let s = scratch();
    s.fails("sensor scene.fits -o o", 2, &["--aperture", "circle=1.2m"]);
    s.fails("sensor scene.fits --aperture circle=1 -o o", 2, &["no unit", "m, km"]);
    s.fails("sensor scene.fits --aperture circle=1m --taper cosine -o o", 2, &["cosine", "gaussian=EDGE_DB"]);
    s.fails("sensor scene.fits --aperture circle=1m --scan spiral -o o", 2, &["spiral", "conical=RADIUS"]);
    s.fails("sensor scene.fits --aperture circle=1m --scan conical=1deg -o o", 2, &["--scan", "half of the width"]);
    s.fails("sensor scene.fits --aperture circle=1m --zernike 4 -o o", 2, &["INDEX:WAVES"]);
    s.fails("sensor scene.fits --aperture circle=1m --struts 3 -o o", 2, &["--struts", "--strut-width"]);
    s.fails("sensor scene.fits --aperture circle=1m --motion 3mrad -o o", 2, &["/s"]);
    s.fails("sensor scene.fits --aperture circle=1m --tsys 300K --receiver 800K -o o", 2, &["--tsys", "--receiver"]);
    s.fails("sensor scene.fits --aperture circle=1m --knee 3Hz -o o", 2, &["--knee", "--tsys"]);
    s.fails("sensor scene.fits --aperture circle=1m --efficiency 2 -o o", 2, &["--efficiency", "at most 1"]);
    s.fails("sensor scene.fits --aperture circle=1m --efficiency nan -o o", 2, &["finite"]);
    s.fails("sensor scene.fits --aperture circle=1m --pitch 1rad -o o", 2, &["--pitch", "across the image"]);
    s.fails("sensor scene.fits --aperture circle=1m --pitch 1e-9rad -o o", 2, &["--pitch", "across the image"]);
    s.fails("sensor scene.fits --aperture circle=1km -o o", 1, &["finer image"]);
    s.fails("sensor scene.fits --aperture circle=1m --blockage circle=2m -o o", 1, &["nothing of the aperture is open"]);
    s.fails("sensor scene.fits --aperture circle=1m --range 1mm -o o", 1, &["--focus"]);
    s.fails("sensor scene.toml --aperture circle=1m -o o", 1, &["scene.toml"]);
    s.fails("sensor nowhere.fits --aperture circle=1m -o o", 1, &["nowhere.fits"]);
    s.fails("sensor scene.fits --aperture circle=1m --beside nowhere.fits -o o", 1, &["nowhere.fits"]);
    s.ok("sensor scene.fits --aperture circle=1m --no-png -o psf");
    s.fails("sensor psf-psf.fits --aperture circle=1m -o o", 1, &["psf-psf.fits", "needs a scene in K"]);
    s.fails("sensor scene.fits --aperture circle=1m --no-png -o psf", 1, &["psf-image.fits", "--overwrite"]);
    let left: Vec<String> = s.names().into_iter().filter(|n| n.starts_with("o-") || n.starts_with("o.")).collect();
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn the_help_lists_every_shape_taper_pattern_and_radiometer() {
    use cittert::sensor::{RADIOMETERS, SCANS, SHAPES, TAPERS};
    let said = Scratch::new().ok("sensor --help");
    let names = SHAPES.iter().map(|s| s.about).chain(TAPERS.iter().map(|t| t.about));
    for about in names.chain(SCANS.iter().map(|s| s.about)).chain(RADIOMETERS.iter().map(|r| r.about)) {
        let words = about.split_whitespace().collect::<Vec<_>>().join(" ");
        let help = said.out.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(help.contains(&words), "{about}");
    }
}
