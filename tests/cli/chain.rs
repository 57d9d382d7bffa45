//! From layout to image: the positions of sources, and the reproducibility of results.

use crate::program::Scratch;
use serde_json::Value;

fn number(v: &Value, key: &str) -> f64 {
    v[key].as_f64().unwrap_or_else(|| panic!("{key} is not a number in {v}"))
}

/// Sources come out where they were put, not mirrored: in the boresight frame and on the sky.
#[test]
fn sources_come_out_where_they_were_put() {
    let s = Scratch::new();
    for (name, put, line) in [
        ("bore", [(0.012, 0.005), (-0.004, 0.009)], "--layout mm-ring --freq 94GHz --bandwidth 2GHz --channels 4".to_owned()),
        (
            "sky",
            [(0.012, 0.005), (-0.004, 0.009)],
            "--layout vla-d --freq 1.4GHz --bandwidth 64MHz --channels 4 --phase-center 13h31m08s,+30d30m33s --start 2025-06-01T01:30:00 --duration 30min --integration 5min"
                .to_owned(),
        ),
    ] {
        s.write("s.csv", format!("l_rad,m_rad,flux_jy\n{},{},1.0\n{},{},0.5\n", put[0].0, put[0].1, put[1].0, put[1].1));
        s.ok(&format!("simulate {line} --scene s.csv --method dft -o {name}.uvh5"));
        s.ok(&format!("clean {name}.uvh5 --size 256 --cell 0.15mrad --niter 2000 --gain 0.05 -o {name}"));
        let components = std::fs::read_to_string(s.path(&format!("{name}-components.csv"))).unwrap();
        for (l, m) in put {
            // The flux-weighted mean position of the components within a few cells of the true position of a source.
            let (mut f, mut fl, mut fm) = (0.0, 0.0, 0.0);
            for row in components.lines().skip(1) {
                let v: Vec<f64> = row.split(',').take(3).map(|x| x.parse().unwrap()).collect();
                if (v[0] - l).hypot(v[1] - m) < 4.0 * 1.5e-4 {
                    f += v[2];
                    fl += v[2] * v[0];
                    fm += v[2] * v[1];
                }
            }
            assert!(f > 0.4, "{name}: nothing at {l}, {m}");
            let off = (fl / f - l).hypot(fm / f - m) / 1.5e-4;
            assert!(off < 0.1, "{name}: source at {l}, {m} is off by {off} cells");
        }
    }
}

#[test]
fn same_seed_same_bytes_and_another_seed_other_noise() {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0.01,0.005,1.0\n");
    let simulate = "simulate --layout mm-y --scene s.csv --freq 94GHz --bandwidth 1GHz --channels 2 --noise --threads 1";
    for (name, seed) in [("a", 7), ("b", 7), ("c", 8)] {
        s.ok(&format!("{simulate} --seed {seed} -o {name}.uvh5"));
        s.ok(&format!("dirty {name}.uvh5 --size 64 --cell 1mrad --threads 1 -o {name}.fits"));
    }
    let data = |name: &str| {
        let bytes = std::fs::read(s.path(name)).unwrap();
        bytes[bytes.len() - 64 * 64 * 4 - 2880..].to_vec()
    };
    assert_eq!(data("a.fits"), data("b.fits"));
    assert_ne!(data("a.fits"), data("c.fits"));
}

#[test]
fn the_mask_of_more_channels_covers_more() {
    let s = Scratch::new();
    let mask = |channels, name: &str| {
        s.json(&format!("mask mm-y --freq 94GHz --bandwidth 8GHz --channels {channels} --size 256 --cell 0.6mrad -o {name}"))
    };
    let one = mask(1, "one.fits");
    let many = mask(32, "many.fits");
    assert!(number(&many, "cells_hit") > number(&one, "cells_hit"), "{one} {many}");
    assert!(number(&one, "disc_fraction") > 0.0 && number(&many, "disc_fraction") <= 1.0);
}

#[test]
fn an_image_compared_with_itself_is_perfect() {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0.01,0.005,1.0\n");
    s.ok("simulate --layout mm-y --scene s.csv --freq 94GHz --bandwidth 1GHz -o v.uvh5");
    s.ok("dirty v.uvh5 --size 64 --cell 1mrad -o d.fits");
    let c = s.json("compare d.fits d.fits");
    assert_eq!(number(&c, "nrmse"), 0.0);
    assert!((number(&c, "ssim") - 1.0).abs() < 1e-12 && number(&c, "flux_ratio") == 1.0);
}
