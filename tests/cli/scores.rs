//! Images against other images, and the names of scores: a name has one meaning in every command.

use crate::program::Scratch;
use serde_json::Value;

fn number(v: &Value, key: &str) -> f64 {
    v[key].as_f64().unwrap_or_else(|| panic!("{key} is not a number in {v}"))
}

/// A set of two sources around a phase centre that is `east` mas from a fixed place, and its dirty image with cells of 10 arcsec.
fn dirty(s: &Scratch, name: &str, east_mas: f64, size: usize) {
    s.write("s.csv", "ra_deg,dec_deg,flux_jy\n202.79,30.51,1.0\n202.75,30.49,0.5\n");
    let ra = 202.783_333 + east_mas / 3.6e6 / 30.5_f64.to_radians().cos();
    s.ok(&format!(
        "simulate --layout vla-d --scene s.csv --freq 1.4GHz --bandwidth 64MHz --phase-center {ra:.9}deg,30.509167deg \
         --start 2025-06-01T01:30:00 --duration 4min --integration 60s -o {name}.uvh5"
    ));
    s.ok(&format!("dirty {name}.uvh5 --size {size} --cell 10arcsec --weighting natural -o {name}.fits"));
}

/// Replace the outer pixels of a FITS image of `n` x `n` 32-bit values by NaN, as CASA does outside the primary beam.
fn blank_border(s: &Scratch, name: &str, n: usize, width: usize) {
    let mut bytes = std::fs::read(s.path(name)).unwrap();
    let header = bytes.chunks(80).position(|card| card.starts_with(b"END     ")).unwrap() * 80;
    let start = (header / 2880 + 1) * 2880;
    for (k, value) in bytes[start..start + 4 * n * n].chunks_mut(4).enumerate() {
        let (row, column) = (k / n, k % n);
        if row.min(column) < width || row.max(column) + width >= n {
            value.copy_from_slice(&f32::NAN.to_be_bytes());
        }
    }
    std::fs::write(s.path(name), bytes).unwrap();
}

#[test]
fn images_with_other_centres_sizes_and_blank_borders_are_compared() {
    let s = Scratch::new();
    dirty(&s, "a", 0.0, 64);
    // A thirtieth of a pixel, as the rounding of a phase centre in another program, and another number of pixels.
    dirty(&s, "b", 333.0, 80);
    blank_border(&s, "a.fits", 64, 5);
    let c = s.json("compare a.fits b.fits");
    assert!(number(&c, "error_over_grey_card") < 0.01, "{c}");
    assert_eq!(number(&c, "n_compared"), 54.0 * 54.0);
    assert_eq!(number(&c, "n_blank"), 64.0 * 64.0 - 54.0 * 54.0);
    assert_eq!(c["regridded_from"]["size"], serde_json::json!([80, 80]));
    let said = s.ok("compare a.fits b.fits");
    for words in ["regridded from 80 x 80 pixels of 10 arcsec to 64 x 64", "1180 of 4096 pixels were left out", "error over grey card"] {
        assert!(said.out.contains(words), "{words}: {}", said.out);
    }
    // As the truth, the blank border is not seen as zeros either.
    assert!(number(&s.json("compare b.fits a.fits"), "error_over_grey_card") < 0.01);
}

#[test]
fn the_difference_and_the_fidelity_are_written() {
    let s = Scratch::new();
    dirty(&s, "a", 0.0, 64);
    s.ok("clean a.uvh5 --size 64 --cell 10arcsec --niter 50 -o c");
    let c = s.json("compare c-image.fits a.fits --difference d.fits --fidelity f.fits");
    let info = s.json("info d.fits");
    let (rms, written) = (number(&c, "rms_difference"), number(&info, "rms"));
    // The file holds 32-bit values.
    assert!((rms / written - 1.0).abs() < 1e-5, "{rms} {written}");
    assert!(number(&s.json("info f.fits"), "n_not_finite") == 0.0);
    s.ok("compare c-image.fits a.fits --difference d.png");
    assert!(std::fs::read(s.path("d.png")).unwrap().starts_with(b"\x89PNG"));
    s.fails("compare c-image.fits a.fits --difference d.fits", 1, &["d.fits", "--overwrite"]);
    s.fails("compare c-image.fits a.fits --difference d.jpg", 2, &["--difference", ".png"]);
    s.fails("compare c-image.fits a.fits --fidelity f.png", 2, &["--fidelity", ".fits"]);
}

#[test]
fn images_without_a_common_sky_or_unit_are_refused_in_words() {
    let s = Scratch::new();
    dirty(&s, "a", 0.0, 64);
    s.write("p.csv", "l_rad,m_rad,flux_jy\n0.01,0.005,1.0\n");
    s.ok("simulate --layout mm-y --scene p.csv --freq 94GHz --bandwidth 1GHz -o v.uvh5");
    s.ok("dirty v.uvh5 --size 64 --cell 1mrad -o boresight.fits");
    let text = s.fails("compare a.fits boresight.fits", 1, &["RA 202.783333 deg", "boresight"]);
    assert!(!text.contains('{') && !text.contains("ra_rad"), "{text}");
}

/// Keys whose numbers depend on what a command does rather than on the data, or that a command counts for itself.
const NOT_OF_THE_DATA: [&str; 4] = ["iterations", "major_cycles", "seconds", "model_flux"];

/// The commands describe one set on one grid, so two of them that use the same name must print the same number.
#[test]
fn a_name_has_one_meaning_in_every_command() {
    let s = Scratch::new();
    let track = "--freq 1.4GHz --bandwidth 64MHz --channels 2 --phase-center 13h31m08s,+30d30m33s --start 2025-06-01T01:30:00 --duration 4min --integration 60s";
    let grid = "--size 64 --cell 20arcsec";
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0.0002,0.0001,1.0\n");
    s.ok(&format!("simulate --layout vla-d --scene s.csv {track} --noise -o v.uvh5"));
    let lines = [
        "info v.uvh5".to_owned(),
        format!("mask vla-d {track} {grid} -o m.fits"),
        format!("grid v.uvh5 {grid} -o g.fits"),
        format!("beam v.uvh5 {grid} -o b.fits"),
        format!("dirty v.uvh5 {grid} -o d.fits"),
        format!("clean v.uvh5 {grid} --niter 100 -o c"),
        format!("mem v.uvh5 {grid} -o e"),
        "compare c-image.fits e-image.fits".into(),
        "layout show vla-d --freq 1.4GHz".into(),
    ];
    // A deconvolution that misses its goals fails, but has images and numbers all the same.
    let numbers = |line: &String| serde_json::from_str(&s.run(&format!("--json {line}")).out).unwrap_or_else(|e| panic!("{line}: {e}"));
    let found: Vec<(String, Value)> = lines.iter().map(|line| (line.split(' ').next().unwrap().to_owned(), numbers(line))).collect();
    let mut shared = 0;
    for (k, (one, a)) in found.iter().enumerate() {
        for (other, b) in &found[k + 1..] {
            for (name, x) in a.as_object().unwrap() {
                let (Some(x), Some(y)) = (x.as_f64(), b[name].as_f64()) else { continue };
                // A layout has the beam of one look at the zenith. A deconvolution has its own residual.
                let own = other == "layout" && name.starts_with('b') || (one, other.as_str()) == (&"clean".to_owned(), "mem");
                if NOT_OF_THE_DATA.contains(&name.as_str()) || own && !name.ends_with("_rad") {
                    continue;
                }
                shared += 1;
                assert!((x - y).abs() <= 1e-5 * x.abs() || own, "{name} is {x} in {one} and {y} in {other}");
            }
        }
    }
    assert!(shared > 15, "only {shared} shared names");
    // The scores of two commands are those of the images that they write.
    for (command, prefix) in [("clean", "c"), ("mem", "e")] {
        let (_, said) = found.iter().find(|f| f.0 == command).unwrap();
        let (image, residual) = (s.json(&format!("info {prefix}-image.fits")), s.json(&format!("info {prefix}-residual.fits")));
        let range = image["range"][1].as_f64().unwrap() / number(&residual, "rms");
        assert!((number(said, "dynamic_range") / range - 1.0).abs() < 1e-5, "{command}: {range} {said}");
        assert!((number(said, "residual_rms") / number(&residual, "rms") - 1.0).abs() < 1e-5, "{command}");
    }
}
