//! What `info` says of files, and the errors of the table of formats.

use super::common;
use cittert_formats::info::VisibilityInfo;
use cittert_formats::{Contents, Holds, create_visibilities, format_of, open_image, open_visibilities};
use std::path::{Path, PathBuf};

/// A small UVFITS file.
fn uvfits(folder: &Path) -> PathBuf {
    let (path, set) = (folder.join("good.uvfits"), common::earth());
    let mut out = create_visibilities(&path, &set.header, false).unwrap().sink;
    out.write_block(&set.data).unwrap();
    out.finish().unwrap();
    path
}

#[test]
fn every_field_of_a_set_is_summed_up() {
    let dir = tempfile::tempdir().unwrap();
    let mut set = common::earth();
    // A weight and a value that are not finite.
    set.data.weights[(1, 0, 0)] = f32::INFINITY;
    set.data.vis[(2, 1, 1)].re = f32::NAN;
    let path = dir.path().join("x.uvh5");
    let mut out = create_visibilities(&path, &set.header, false).unwrap().sink;
    out.write_block(&set.data).unwrap();
    out.finish().unwrap();
    let mut source = open_visibilities(&path).unwrap();
    let info = VisibilityInfo::of(source.as_mut()).unwrap();
    assert_eq!((info.telescope.as_str(), info.unit.as_str(), info.frame), ("SPIRAL", "Jy", "earth"));
    assert_eq!((info.n_antennas, info.n_antennas_data, info.n_blts, info.n_bls, info.n_times), (10, 10, 270, 45, 6));
    assert_eq!((info.n_freqs, info.n_pols, info.integration_s), (4, 2, 60.0));
    assert_eq!(info.polarizations, ["XX", "YY"]);
    assert_eq!(info.freq_hz, set.header.spectrum.freq_hz());
    assert_eq!(info.time_jd, [2_460_000.75, 2_460_000.75 + 5.0 * 60.0 / 86_400.0]);
    let flagged = set.data.flags.iter().filter(|f| **f).count();
    assert!((info.flagged_fraction - flagged as f64 / set.data.flags.len() as f64).abs() < 1e-12);
    assert_eq!(info.n_unflagged.values().sum::<u64>(), (set.data.flags.len() - flagged) as u64);
    assert!(info.mean_abs_unflagged.values().all(|mean| (mean - common::FLUX).abs() < 1e-6));
    assert_eq!(info.n_not_finite, 2);
    let (ra, dec) = set.header.phase_centers[0].ra_dec_rad().unwrap();
    assert_eq!((info.phase_centers[0].ra_rad, info.phase_centers[0].dec_rad), (Some(ra), Some(dec)));
    let block = source.read_rows(0..3).unwrap();
    assert_eq!((block.usable_weight(1, 0, 0), block.usable_weight(1, 0, 1)), (0.0, 2.0));
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
    let uvfits = uvfits(dir.path());
    assert!(open_image(&uvfits).map(|_| ()).unwrap_err().to_string().contains("UVFITS"));
    let header = common::earth().header;
    assert!(create_visibilities(&dir.path().join("x.jpg"), &header, false).map(|_| ()).unwrap_err().to_string().contains(".jpg"));
}

#[test]
fn truncated_uvfits_says_how_much_is_missing() {
    let dir = tempfile::tempdir().unwrap();
    let good = std::fs::read(uvfits(dir.path())).unwrap();
    let path = dir.path().join("t.uvfits");
    for (len, word) in [(good.len() / 2, "truncated"), (2000, "truncated"), (good.len() - 2880, "truncated")] {
        std::fs::write(&path, &good[..len]).unwrap();
        let text = open_visibilities(&path).map(|_| ()).unwrap_err().to_string();
        assert!(text.contains(word) && text.contains("t.uvfits"), "{len}: {text}");
    }
}

#[test]
fn every_kind_of_file_is_told_apart_by_content() {
    let dir = tempfile::tempdir().unwrap();
    let file = |name: &str, text: &str| {
        let path = dir.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    };
    let kind = |path: &Path| serde_json::to_value(Contents::of(path).unwrap()).unwrap()["kind"].as_str().unwrap().to_string();
    assert_eq!(kind(&uvfits(dir.path())), "visibilities");
    assert_eq!(kind(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/layouts/vla.d.cfg")), "layout");
    assert_eq!(kind(&file("a.txt", "l_rad,m_rad,flux_jy\n0,0,1\n")), "sources");
    let gains = dir.path().join("g.h5");
    let header = common::earth().header;
    let table = cittert_arrays::GainTable::unity(header.layout, header.spectrum, vec!["X".into()], vec![2_460_000.5], vec![1.0]).unwrap();
    cittert_formats::calh5::write_gains(&gains, &table, false).unwrap();
    assert_eq!(kind(&gains), "gains");
    let text = Contents::of(&file("b.txt", "nothing to see\n")).unwrap_err().to_string();
    assert!(text.contains("b.txt") && text.contains("a text"), "{text}");
}

/// A source list, an image or a gain table is never taken for another kind of file; the error says what the file seems to be.
#[test]
fn a_file_of_another_kind_is_refused_by_what_it_is() {
    let dir = tempfile::tempdir().unwrap();
    let list = dir.path().join("layout.csv");
    std::fs::write(&list, "l_rad,m_rad,flux_jy\n0,0,1\n").unwrap();
    assert!(matches!(format_of(&list).unwrap().holds(), Holds::Sources(_)));
    let text = cittert_formats::layouts::read_layout(&list, None).unwrap_err();
    let cause = std::error::Error::source(&text).unwrap().to_string();
    assert!(cause.contains("a text"), "{cause}");
    for text in [open_visibilities(&list).map(drop).unwrap_err(), open_image(&list).map(drop).unwrap_err()].map(|e| e.to_string()) {
        assert!(text.contains("layout.csv") && text.contains("source list"), "{text}");
    }
    let text = open_image(&uvfits(dir.path())).map(drop).unwrap_err().to_string();
    assert!(text.contains("expected an image: FITS image (.fits)") && text.contains("it is UVFITS (visibilities)"), "{text}");
    let damaged = dir.path().join("damaged.h5");
    std::fs::write(&damaged, b"\x89HDF\r\n\x1a\n and nothing else").unwrap();
    let text = format_of(&damaged).map(|f| f.name()).unwrap_err().to_string();
    assert!(text.contains("truncated or damaged") || text.contains("sound HDF5 file"), "{text}");
}
