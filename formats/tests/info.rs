//! Real files against what pyuvdata says of them (tests/golden/make_info.py), and the refusals of the tables of formats.

mod common;

use cittert_formats::info::VisibilityInfo;
use cittert_formats::{create_visibilities, open_image, open_visibilities};
use serde_json::Value;
use std::path::{Path, PathBuf};

fn shared() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/visibilities")
}

fn close(a: f64, b: &Value, relative: f64, what: &str) {
    let b = b.as_f64().unwrap();
    assert!((a - b).abs() <= relative * b.abs().max(1e-9), "{what}: {a} {b}");
}

#[test]
fn every_field_agrees_with_pyuvdata_on_real_files() {
    let golden: Value = serde_json::from_str(include_str!("golden/info.json")).unwrap();
    for (name, g) in golden.as_object().unwrap() {
        let mut source = open_visibilities(&shared().join(name)).unwrap();
        let info = VisibilityInfo::of(source.as_mut()).unwrap();
        assert_eq!(info.telescope, g["telescope"].as_str().unwrap(), "{name}");
        assert_eq!(serde_json::to_value(&info.antenna_names).unwrap(), g["antenna_names"], "{name}");
        assert_eq!(serde_json::to_value(&info.polarizations).unwrap(), g["polarizations"], "{name}");
        assert_eq!(serde_json::to_value(&info.n_unflagged).unwrap(), g["n_unflagged"], "{name}");
        for (key, value) in [
            ("n_antennas_data", info.n_antennas_data),
            ("n_blts", info.n_blts),
            ("n_bls", info.n_bls),
            ("n_times", info.n_times),
            ("n_freqs", info.n_freqs),
        ] {
            assert_eq!(value as u64, g[key].as_u64().unwrap(), "{name} {key}");
        }
        assert!(info.unit.eq_ignore_ascii_case(g["unit"].as_str().unwrap()), "{name}");
        close(info.freq_hz[0], &g["freq_hz"][0], 1e-12, name);
        close(info.freq_hz[info.n_freqs - 1], &g["freq_hz"][1], 1e-12, name);
        close(info.channel_width_hz[0], &g["channel_width_hz"], 1e-7, name);
        close(info.integration_s, &g["integration_s"], 1e-7, name);
        close(info.flagged_fraction, &g["flagged_fraction"], 1e-12, name);
        for (pol, mean) in g["mean_abs_unflagged"].as_object().unwrap() {
            close(info.mean_abs_unflagged[pol], mean, 1e-6, &format!("{name} {pol}"));
        }
        let (pc, gpc) = (&info.phase_centers[0], &g["phase_center"]);
        assert_eq!((pc.name.as_str(), pc.kind), (gpc[0].as_str().unwrap(), gpc[1].as_str().unwrap()), "{name}");
        if let (Some(ra), Some(dec)) = (pc.ra_rad, pc.dec_rad) {
            assert_eq!(pc.frame, gpc[2].as_str().unwrap());
            close(ra, &gpc[3], 1e-14, name);
            close(dec, &gpc[4], 1e-14, name);
        }
    }
}

#[test]
fn rows_sites_and_positions_agree_with_pyuvdata_on_real_files() {
    let golden: Value = serde_json::from_str(include_str!("golden/info.json")).unwrap();
    for (name, g) in golden.as_object().unwrap() {
        let mut source = open_visibilities(&shared().join(name)).unwrap();
        let layout = source.header().layout.clone();
        let site = layout.site().unwrap();
        close(site.latitude_rad, &g["site"][0], 1e-10, name);
        close(site.longitude_rad, &g["site"][1], 1e-10, name);
        let last = layout.antennas().last().unwrap();
        for k in 0..3 {
            let expected = g["last_antenna_enu"][k].as_f64().unwrap();
            assert!((last.position_m[k] - expected).abs() < 1e-4, "{name}: {} {expected}", last.position_m[k]);
        }
        let n = source.n_rows();
        for (row, expected) in [0, n / 2, n - 1].into_iter().zip(g["rows"].as_array().unwrap()) {
            let block = source.read_rows(row..row + 1).unwrap();
            let number = |a: u32| f64::from(layout.antennas()[a as usize].number);
            let c = &block.coverage;
            let v = block.vis[(0, 0, 0)];
            let found = [
                number(c.ant1[0]),
                number(c.ant2[0]),
                c.time_jd[0],
                c.uvw_m[(0, 0)],
                c.uvw_m[(0, 1)],
                c.uvw_m[(0, 2)],
                f64::from(v.re),
                f64::from(v.im),
                f64::from(block.nsamples[(0, 0, 0)]),
            ];
            for (k, value) in found.iter().enumerate() {
                close(*value, &expected[k], 1e-7, &format!("{name} row {row} item {k}"));
            }
        }
    }
}

#[test]
fn weights_that_are_not_finite_are_counted_and_never_usable() {
    let mut source = open_visibilities(&shared().join("eht_m87_2017_096_lo.uvfits")).unwrap();
    let info = VisibilityInfo::of(source.as_mut()).unwrap();
    assert_eq!(info.n_not_finite, 6514 * 2);
    let block = source.read_rows(0..10).unwrap();
    assert_eq!((block.usable_weight(0, 0, 2), block.usable_weight(0, 0, 0)), (0.0, 34_237.828));
}

#[test]
fn what_is_no_visibility_set_is_refused_by_what_it_is() {
    let dir = tempfile::tempdir().unwrap();
    let refused = |name: &str, bytes: &[u8], words: &[&str]| {
        let path = dir.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        let text = open_visibilities(&path).map(|_| ()).unwrap_err().to_string();
        for word in words.iter().chain(&[name]) {
            assert!(text.contains(word), "{word:?} is not in {text:?}");
        }
    };
    refused("a.uvfits", b"\x89PNG\r\n\x1a\n and more", &["PNG picture", "UVFITS"]);
    refused("b.uvh5", b"", &["empty"]);
    refused("c.uvh5", b"name = 'x'\n", &["a text", "name = "]);
    refused("d.uvh5", b"\x89HDF\r\n\x1a\n", &["HDF5"]);
    assert!(open_visibilities(dir.path()).map(|_| ()).unwrap_err().to_string().contains("directory"));
    assert!(open_visibilities(&dir.path().join("none.uvh5")).map(|_| ()).unwrap_err().to_string().contains("none.uvh5"));
    std::fs::create_dir(dir.path().join("e.ms")).unwrap();
    std::fs::write(dir.path().join("e.ms/table.dat"), b"x").unwrap();
    assert!(open_visibilities(&dir.path().join("e.ms")).map(|_| ()).unwrap_err().to_string().contains("Measurement Set"));
    let uvfits = shared().join("paper_redundant.uvfits");
    assert!(open_image(&uvfits).map(|_| ()).unwrap_err().to_string().contains("UVFITS"));
    let header = common::earth().header;
    assert!(create_visibilities(&dir.path().join("x.jpg"), &header, false).map(|_| ()).unwrap_err().to_string().contains(".jpg"));
}

#[test]
fn truncated_uvfits_says_how_much_is_missing() {
    let dir = tempfile::tempdir().unwrap();
    let good = std::fs::read(shared().join("paper_redundant.uvfits")).unwrap();
    let path = dir.path().join("t.uvfits");
    for (len, word) in [(100_000, "truncated"), (2000, "truncated"), (good.len() - 12 * 2880, "truncated")] {
        std::fs::write(&path, &good[..len]).unwrap();
        let text = open_visibilities(&path).map(|_| ()).unwrap_err().to_string();
        assert!(text.contains(word) && text.contains("t.uvfits"), "{len}: {text}");
    }
}
