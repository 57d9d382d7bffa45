//! Many files as one set: cut, joined, read by every command, and refused where they are not one set.

use crate::program::Scratch;

const SIMULATE: &str = "simulate --layout vla-d --freq 1.4GHz --bandwidth 64MHz --channels 4 --phase-center 13h31m08s,+30d30m33s \
     --start 2025-06-01T01:30:00 --duration 20min --integration 60s --noise --seed 5 --scene s.csv";
const IMAGE: &str = "--size 64 --cell 20arcsec";

/// A set `v.uvh5` of 20 times and 4 channels.
fn scratch() -> Scratch {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0.002,-0.001,1.0\n-0.001,0.0015,0.4\n");
    s.ok(&format!("{SIMULATE} -o v.uvh5"));
    s
}

/// The pixels of a FITS image.
fn pixels(s: &Scratch, name: &str) -> Vec<u8> {
    let bytes = std::fs::read(s.path(name)).unwrap();
    let data = 64 * 64 * 4;
    let padded = data_block(data);
    bytes[bytes.len() - padded..][..data].to_vec()
}

fn data_block(bytes: usize) -> usize {
    bytes.div_ceil(2880) * 2880
}

#[test]
fn images_of_1_file_and_of_20_are_the_same_bytes() {
    let s = scratch();
    s.ok(&format!("dirty v.uvh5 {IMAGE} -o whole.fits"));
    s.ok(&format!("clean v.uvh5 {IMAGE} --niter 200 -o whole"));
    for (k, split) in ["time=20", "time=5,channel=4", "channel=2,baseline=10", "baseline=20"].iter().enumerate() {
        let json = s.json(&format!("convert v.uvh5 p{k}.uvh5 --split {split}"));
        assert_eq!(json["outputs"].as_array().unwrap().len(), 20, "{json}");
        let said = s.ok(&format!("dirty p{k}-*.uvh5 {IMAGE} -o p{k}.fits"));
        assert!(said.err.contains("20 files are one set: 7020 rows, 4 channels, 1 products"), "{}", said.err);
        assert!(pixels(&s, &format!("p{k}.fits")) == pixels(&s, "whole.fits"), "{split}");
    }
    // Blocks of a small budget of memory begin elsewhere in the files.
    s.ok(&format!("--memory 16MiB dirty v.uvh5 {IMAGE} -o whole-small.fits"));
    s.ok(&format!("--memory 16MiB dirty p1-*.uvh5 {IMAGE} -o small.fits"));
    assert!(pixels(&s, "small.fits") == pixels(&s, "whole-small.fits"));
    s.ok(&format!("clean p1-*.uvh5 {IMAGE} --niter 200 -o parts"));
    for suffix in ["model", "residual", "image"] {
        assert!(pixels(&s, &format!("parts-{suffix}.fits")) == pixels(&s, &format!("whole-{suffix}.fits")), "{suffix}");
    }
    assert_eq!(std::fs::read(s.path("parts-components.csv")).unwrap(), std::fs::read(s.path("whole-components.csv")).unwrap());
}

#[test]
fn every_command_takes_files_patterns_and_lists() {
    let s = scratch();
    s.ok("convert v.uvh5 p.uvh5 --split time=3");
    s.write("list.txt", "# parts\n\np-time0.uvh5\n  p-time[12].uvh5\r\n");
    let files = ["p-time0.uvh5 p-time1.uvh5 p-time2.uvh5", "p-*.uvh5", "@list.txt", "p-time2.uvh5 p-time0.uvh5 p-time1.uvh5"];
    let whole = s.json("info v.uvh5");
    for of in files {
        let json = s.json(&format!("info {of}"));
        for key in ["n_blts", "n_times", "n_bls", "freq_hz", "mean_abs_unflagged", "n_unflagged", "phase_centers", "antenna_names"] {
            assert_eq!(json[key], whole[key], "{of}: {key}");
        }
    }
    s.ok("convert @list.txt joined.uvh5");
    s.ok(&format!("dirty v.uvh5 {IMAGE} -o whole.fits"));
    s.ok(&format!("dirty joined.uvh5 {IMAGE} -o joined.fits"));
    assert!(pixels(&s, "joined.fits") == pixels(&s, "whole.fits"));
    s.ok(&format!("beam p-*.uvh5 {IMAGE} -o psf.fits"));
    s.ok(&format!("grid p-*.uvh5 {IMAGE} -o grid.h5"));
    s.ok("plot p-*.uvh5 -o p.png");
    s.ok("plot p-*.uvh5 --what uv -o uv.png");
    s.ok("plot v.uvh5 --what uv -o uv-whole.png");
    assert_eq!(s.json("closure p-*.uvh5")["phases"], s.json("closure v.uvh5")["phases"]);
    for (command, whole, parts) in [
        ("corrupt", "v.uvh5 -o c1.uvh5", "p-*.uvh5 -o c2.uvh5"),
        ("applycal", "c1.uvh5 c1.calh5 -o a1.uvh5", "c1.uvh5 c2.calh5 -o a2.uvh5"),
        ("predict", "v.uvh5 --model s.csv --residual -o r1.uvh5", "p-*.uvh5 --model s.csv --residual -o r2.uvh5"),
    ] {
        let options = if command == "corrupt" { "--phase-rms 20deg --seed 2" } else { "" };
        s.ok(&format!("{command} {whole} {options}"));
        s.ok(&format!("{command} {parts} {options}"));
    }
    s.ok("applycal p-*.uvh5 c1.calh5 --invert -o a3.uvh5");
    for (a, b) in [("c1", "c2"), ("a1", "a2"), ("r1", "r2"), ("c1", "a3")] {
        let mean = |name: &str| s.json(&format!("info {name}.uvh5"))["mean_abs_unflagged"]["I"].as_f64().unwrap();
        assert!((mean(a) - mean(b)).abs() < 1e-7 * mean(a), "{a} {b}");
    }
    s.ok(&format!("selfcal c1.uvh5 {IMAGE} --deconvolver clark --rounds 1 --solint inf -o s1"));
    s.ok("convert c1.uvh5 q.uvh5 --split time=2,channel=2");
    s.ok(&format!("selfcal q-*.uvh5 {IMAGE} --deconvolver clark --rounds 1 --solint inf -o s2"));
    assert!(pixels(&s, "s1-image.fits") == pixels(&s, "s2-image.fits"));
    for (of, name) in [("v.uvh5", "m1"), ("p-*.uvh5", "m2")] {
        let said = s.run(&format!("mem {of} {IMAGE} --niter 20 --hold-out 0 -o {name}"));
        assert!(said.code <= 1 && s.path(&format!("{name}-model.fits")).exists(), "{}", said.err);
    }
    assert!(pixels(&s, "m1-model.fits") == pixels(&s, "m2-model.fits"));
}

#[test]
fn formats_are_mixed_and_columns_kept() {
    let s = scratch();
    s.ok("predict v.uvh5 --model s.csv --into model,residual -o full.uvh5");
    s.ok("convert full.uvh5 p.uvh5 --split channel=2");
    s.ok("convert p-channel0.uvh5 p-channel1.uvh5 back.uvh5");
    for column in ["data", "model", "residual"] {
        s.ok(&format!("dirty full.uvh5 --column {column} {IMAGE} -o {column}1.fits"));
        s.ok(&format!("dirty back.uvh5 --column {column} {IMAGE} -o {column}2.fits"));
        s.ok(&format!("dirty p-*.uvh5 --column {column} {IMAGE} -o {column}3.fits"));
        assert!(pixels(&s, &format!("{column}1.fits")) == pixels(&s, &format!("{column}2.fits")), "{column}");
        assert!(pixels(&s, &format!("{column}1.fits")) == pixels(&s, &format!("{column}3.fits")), "{column}");
    }
    s.ok("convert v.uvh5 q.uvh5 --split time=4");
    s.ok("convert q-time2.uvh5 q-time2.uvfits");
    std::fs::remove_file(s.path("q-time2.uvh5")).unwrap();
    let json = s.json("info q-time*");
    assert_eq!((json["n_times"].as_u64(), json["n_blts"].as_u64(), json["n_bls"].as_u64()), (Some(20), Some(7020), Some(351)), "{json}");
    // Channels of one time in two formats are one row, although UVFITS rounds times and uvw.
    s.ok("convert p-channel1.uvh5 p-channel1.uvfits");
    let json = s.json("info p-channel0.uvh5 p-channel1.uvfits");
    assert_eq!((json["n_freqs"].as_u64(), json["n_blts"].as_u64()), (Some(4), Some(7020)), "{json}");
}

#[test]
fn what_is_no_set_is_refused() {
    let s = scratch();
    s.ok("convert v.uvh5 p.uvh5 --split time=3");
    let dirty = |files: &str| format!("dirty {files} {IMAGE} -o d.fits");
    s.fails(&dirty("p-time0.uvh5 none.uvh5 p-time2.uvh5"), 1, &["none.uvh5"]);
    s.fails(&dirty("none*.uvh5"), 1, &["none*.uvh5", "no file has such a name"]);
    s.fails(&dirty("p-time0.uvh5 ./p-time0.uvh5"), 1, &["p-time0.uvh5", "named twice"]);
    s.fails(&dirty("p-time0.uvh5 v.uvh5"), 1, &["p-time0.uvh5 and v.uvh5", "leave one of them out"]);
    s.fails(&dirty("@none.txt"), 1, &["none.txt"]);
    s.write("empty.txt", "\n# none\n");
    s.fails(&dirty("@empty.txt"), 1, &["empty.txt", "names no file"]);
    s.write("list.txt", "p-time0.uvh5\nlost.uvh5\n");
    s.fails(&dirty("@list.txt"), 1, &["list.txt, line 2", "lost.uvh5"]);
    s.ok(&format!("{} -o other.uvh5", SIMULATE.replace("vla-d", "vla-c").replace("01:30:00", "03:30:00")));
    s.fails(&dirty("p-time0.uvh5 other.uvh5"), 1, &["other.uvh5 and p-time0.uvh5", "in the first"]);
    s.fails(&dirty("p-time0.uvh5 s.csv"), 1, &["s.csv", "visibilities"]);
    let bytes = std::fs::read(s.path("p-time1.uvh5")).unwrap();
    s.write("p-time1.uvh5", &bytes[..bytes.len() / 2]);
    s.fails(&dirty("p-time0.uvh5 p-time1.uvh5 p-time2.uvh5"), 1, &["p-time1.uvh5"]);
    // One file of three is missing: the gap is told.
    let said = s.ok(&dirty("p-time0.uvh5 p-time2.uvh5"));
    assert!(said.err.contains("1 gaps in time between files"), "{}", said.err);
    // Outputs are not inputs, and several files are not changed in place.
    s.fails("convert p-time0.uvh5 p-time2.uvh5 p-time2.uvh5 --overwrite", 2, &["p-time2.uvh5", "input"]);
    s.ok("corrupt v.uvh5 --phase-rms 5deg -o c.uvh5");
    s.fails("applycal p-time0.uvh5 p-time2.uvh5 c.calh5 -o p-time2.uvh5 --overwrite", 2, &["p-time2.uvh5", "input"]);
    s.fails("convert d.fits d.fits x.fits", 2, &["several files are for visibilities"]);
    for wrong in ["hour", "time=0", "time=21", "pol=2"] {
        s.fails(&format!("convert v.uvh5 x.uvh5 --split {wrong}"), 2, &["--split"]);
    }
    s.fails("convert v.uvh5 x.uvh5 --split time,time=3", 2, &["twice"]);
    s.fails("convert d.fits x.fits --split time", 2, &["for visibilities"]);
    s.write("x-time1.uvh5", "mine");
    s.fails("convert v.uvh5 x.uvh5 --split time=2", 1, &["x-time1.uvh5", "exists already"]);
    assert!(!s.path("x-time0.uvh5").exists());
}

#[test]
fn polarisations_are_split_and_joined() {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0.002,-0.001,1.0\n");
    s.ok(&format!("{SIMULATE} --pols RR,LL,RL,LR -o v.uvh5"));
    let json = s.json("convert v.uvh5 p.uvh5 --split pol,time=2");
    assert_eq!(json["outputs"][1]["output"], "p-time0-polLL.uvh5", "{json}");
    assert_eq!(s.json("info p-*.uvh5")["polarizations"], s.json("info v.uvh5")["polarizations"]);
    s.ok(&format!("dirty v.uvh5 {IMAGE} -o whole.fits"));
    s.ok(&format!("dirty p-*.uvh5 {IMAGE} -o parts.fits"));
    assert!(pixels(&s, "parts.fits") == pixels(&s, "whole.fits"));
    // With one product missing at half of the times, its data are flagged.
    std::fs::remove_file(s.path("p-time1-polRL.uvh5")).unwrap();
    let said = s.ok("info p-*.uvh5");
    assert!(said.err.contains("12.500 % of the joined set is in no file"), "{}", said.err);
}
