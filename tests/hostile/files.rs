//! Files that are not what they say.

use crate::program::Scratch;

const READERS: [&str; 3] = ["info", "dirty -o d.fits", "clean -o c"];

fn each_reader(s: &Scratch, file: &str, words: &[&str]) {
    let before = s.names();
    for reader in READERS {
        s.fails(&format!("{reader} {file}"), 1, words);
    }
    assert_eq!(s.names(), before, "something was left behind");
}

#[test]
fn a_missing_file_a_directory_and_an_empty_file_are_named() {
    let s = Scratch::new();
    each_reader(&s, "none.uvh5", &["none.uvh5"]);
    std::fs::create_dir(s.path("folder.uvh5")).unwrap();
    each_reader(&s, "folder.uvh5", &["folder.uvh5"]);
    s.write("empty.uvfits", "");
    each_reader(&s, "empty.uvfits", &["empty.uvfits", "empty"]);
}

#[test]
fn a_picture_with_the_name_of_a_uvfits_is_found_out() {
    let s = Scratch::new();
    let mut png = Vec::new();
    let pixels = vec![7_u8; 64 * 64];
    image::ImageEncoder::write_image(image::codecs::png::PngEncoder::new(&mut png), &pixels, 64, 64, image::ExtendedColorType::L8).unwrap();
    s.write("x.uvfits", png);
    for reader in ["dirty -o d.fits", "clean -o c"] {
        s.fails(&format!("{reader} x.uvfits"), 1, &["x.uvfits", "PNG"]);
    }
}

#[test]
fn truncated_sets_are_refused() {
    let s = Scratch::new();
    s.write("s.csv", "ra_deg,dec_deg,flux_jy\n202.8,30.5,1\n");
    s.ok("simulate --layout vla-d --scene s.csv --freq 1.4GHz --bandwidth 64MHz --channels 2 --phase-center 13h31m08s,+30d30m33s \
          --start 2025-06-01T01:30:00 --duration 4min --integration 60s -o whole.uvh5");
    s.ok("convert whole.uvh5 whole.uvfits");
    for name in ["whole.uvfits", "whole.uvh5"] {
        let bytes = std::fs::read(s.path(name)).unwrap();
        for part in [100, bytes.len() / 3, bytes.len() / 2] {
            s.write(name, &bytes[..part]);
            s.fails(&format!("dirty {name} -o d.fits"), 1, &[name]);
        }
    }
}

#[test]
fn scenes_that_are_no_scenes_are_refused() {
    let s = Scratch::new();
    let simulate = "simulate --layout mm-y --freq 94GHz --bandwidth 1GHz -o v.uvh5 --scene";
    s.write("column.csv", "l_rad,m_rad,flux_jy,colour\n0,0,1,red\n");
    s.fails(&format!("{simulate} column.csv"), 1, &["column.csv", "colour"]);
    s.write("nan.csv", "l_rad,m_rad,flux_jy\n0,nan,1\n");
    s.fails(&format!("{simulate} nan.csv"), 1, &["nan.csv"]);
    s.write("key.toml", "kind = \"analytic\"\nname = \"x\"\nbackgrund = 3\n");
    s.fails(&format!("{simulate} key.toml --scene-size 64 --scene-cell 1mrad"), 1, &["key.toml", "backgrund", "line 3"]);
}

#[test]
fn layouts_that_cannot_be_are_refused() {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0,0,1\n");
    let antenna = |name: &str, position: &str| format!("[[antenna]]\nname = \"{name}\"\nposition_m = {position}\n");
    let head = "name = \"x\"\nframe = \"boresight\"\n";
    let simulate = |file: &str| format!("simulate --layout {file} --scene s.csv --freq 94GHz --bandwidth 1GHz -o v.uvh5");
    s.write("nan.toml", format!("{head}{}{}", antenna("A", "[0.0, nan, 0.0]"), antenna("B", "[1.0, 0.0, 0.0]")));
    s.fails(&simulate("nan.toml"), 1, &["nan.toml", "\"A\""]);
    s.write("same.toml", format!("{head}{}{}", antenna("A", "[0.0, 1.0, 0.0]"), antenna("B", "[0.0, 1.0, 0.0]")));
    s.fails(&simulate("same.toml"), 1, &["same.toml", "\"A\"", "\"B\""]);
    s.write("key.toml", format!("{head}{}diametre_m = 3.0\n", antenna("A", "[0.0, 1.0, 0.0]")));
    s.fails(&simulate("key.toml"), 1, &["key.toml", "diametre_m", "line 6"]);
}

/// A FITS image of 8 x 8 pixels with these cards and values.
fn fits(cards: &[&str], values: &[f32]) -> Vec<u8> {
    let fixed = ["SIMPLE  =                    T", "BITPIX  =                  -32", "NAXIS   =                    2"];
    let sides = ["NAXIS1  =                    8", "NAXIS2  =                    8"];
    let mut bytes: Vec<u8> = Vec::new();
    for card in fixed.iter().chain(&sides).chain(cards).chain(&["END"]) {
        bytes.extend(format!("{card:80}").bytes());
    }
    bytes.resize(bytes.len().next_multiple_of(2880), b' ');
    values.iter().for_each(|v| bytes.extend(v.to_be_bytes()));
    bytes.resize(bytes.len().next_multiple_of(2880), 0);
    bytes
}

#[test]
fn fits_scenes_without_a_cell_or_with_blank_pixels_are_refused() {
    let s = Scratch::new();
    let simulate = "simulate --layout mm-y --freq 94GHz --bandwidth 1GHz -o v.uvh5 --scene";
    let axes = [
        "CTYPE1  = 'RA---SIN'",
        "CTYPE2  = 'DEC--SIN'",
        "CDELT1  =                -0.05",
        "CDELT2  =                 0.05",
        "CRVAL1  =                 10.0",
        "CRVAL2  =                 20.0",
        "CRPIX1  =                  5.0",
        "CRPIX2  =                  5.0",
        "BUNIT   = 'K'",
    ];
    let mut values = vec![250.0; 64];
    s.write("good.fits", fits(&axes, &values));
    s.ok(&format!("{simulate} good.fits"));
    s.write("cell.fits", fits(&["BUNIT   = 'K'"], &values));
    s.fails(&format!("{simulate} cell.fits --overwrite"), 1, &["cell.fits", "CDELT"]);
    values[19] = f32::NAN;
    s.write("nan.fits", fits(&axes, &values));
    s.fails(&format!("{simulate} nan.fits --overwrite"), 1, &["nan.fits", "NaN", "column 3, row 2"]);
    let whole = fits(&axes, &values);
    s.write("short.fits", &whole[..2880 + 100]);
    s.fails(&format!("{simulate} short.fits --overwrite"), 1, &["short.fits"]);
    s.fails("dirty good.fits -o d.fits", 1, &["good.fits", "FITS", "expected visibilities"]);
}

/// A run that is killed leaves nothing under the name of its output, and an earlier output stays whole.
#[test]
fn a_killed_run_leaves_the_old_output_or_none() {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0.01,0.005,1.0\n");
    let words =
        "simulate --layout mm-u --scene s.csv --freq 94GHz --bandwidth 8GHz --channels 64 --duration 400s --method dft -q -o v.uvh5";
    let program = env!("CARGO_BIN_EXE_cittert");
    for old in [None, Some(&b"an older file"[..])] {
        if let Some(bytes) = old {
            s.write("v.uvh5", bytes);
        }
        for wait_ms in [20, 60, 150] {
            let mut command = std::process::Command::new(program);
            command.current_dir(s.path("")).args(words.split_whitespace()).arg("--overwrite");
            let mut child = command.stdout(std::process::Stdio::null()).spawn().unwrap();
            std::thread::sleep(std::time::Duration::from_millis(wait_ms));
            let finished = child.try_wait().unwrap().is_some();
            child.kill().unwrap();
            child.wait().unwrap();
            assert!(!finished, "the run was over before it could be killed");
            assert_eq!(std::fs::read(s.path("v.uvh5")).ok().as_deref(), old);
        }
    }
}
