//! Files with bytes changed or cut off: an error or a value, never a panic.

use super::common;
use cittert_arrays::VisibilitySource;
use cittert_formats::calh5::write_gains;
use cittert_formats::fits::{ImageOptions, read_image, write_image};
use cittert_formats::uvfits::{UvfitsOptions, UvfitsReader, UvfitsWriter};
use cittert_formats::{Contents, open_visibilities};
use proptest::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Small good files of every kind, written once.
fn good() -> &'static [(&'static str, Vec<u8>)] {
    static FILES: OnceLock<Vec<(&str, Vec<u8>)>> = OnceLock::new();
    FILES.get_or_init(|| {
        let dir = tempfile::tempdir().unwrap();
        let path = |name: &str| dir.path().join(name);
        let set = common::boresight();
        let mut writer = UvfitsWriter::create(&path("a.uvfits"), &set.header, UvfitsOptions::default()).unwrap();
        writer.write(&set.data).unwrap();
        writer.complete().unwrap();
        let grid = cittert_arrays::SkyGrid::new(8, 8, 1e-3, cittert_arrays::SkyFrame::Boresight).unwrap();
        let spectrum = cittert_arrays::SpectralWindow::new(vec![1e9, 3e9], vec![1e6, 2e6]).unwrap();
        let data = ndarray::Array4::<f64>::ones((2, 1, 8, 8));
        let unit = cittert_arrays::BrightnessUnit::Kelvin;
        let image = cittert_arrays::Image::new(grid, spectrum.clone(), vec![cittert_arrays::Polarization::I], data, unit).unwrap();
        write_image(&path("b.fits"), &image, ImageOptions::default()).unwrap();
        let gains = cittert_arrays::GainTable::unity(set.header.layout, spectrum, vec!["R".into()], vec![2_460_000.5], vec![1.0]).unwrap();
        write_gains(&path("c.calh5"), &gains, false).unwrap();
        let read = |name: &'static str| (name, std::fs::read(path(name)).unwrap());
        vec![read("a.uvfits"), read("b.fits"), read("c.calh5")]
    })
}

/// Open whatever it is and read a little of it.
fn open(path: &Path) {
    let _ = Contents::of(path);
    if let Ok(mut source) = UvfitsReader::open(path) {
        let _ = source.read_rows(0..1);
    }
    let _ = read_image(path);
    let _ = open_visibilities(path).map(|s| s.n_rows());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 150, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn changed_fits_bytes_never_panic(
        which in 0usize..2,
        changes in prop::collection::vec((0usize..9000, any::<u8>()), 1..12),
        digits in prop::collection::vec((0usize..9000, b'0'..=b'9'), 0..6),
        cut in prop::option::of(0usize..60_000),
    ) {
        let (name, bytes) = &good()[which];
        let mut bytes = bytes.clone();
        for (at, value) in changes.into_iter().chain(digits) {
            if let Some(b) = bytes.get_mut(at) {
                *b = value;
            }
        }
        if let Some(cut) = cut {
            bytes.truncate(cut);
        }
        let dir = tempfile::tempdir().unwrap();
        let path: PathBuf = dir.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        open(&path);
    }

    #[test]
    fn header_cards_of_any_content_never_panic(cards in prop::collection::vec("[A-Z0-9]{1,8} {0,4}= [ -~]{0,40}", 0..40)) {
        let mut bytes = format!("{:<80}", "SIMPLE  =                    T").into_bytes();
        for card in cards.iter().map(String::as_str).chain(["END"]) {
            bytes.extend(format!("{card:<80}").bytes().take(80));
        }
        bytes.resize(bytes.len().div_ceil(2880) * 2880 + 2880, b' ');
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("cards.fits");
        std::fs::write(&path, bytes).unwrap();
        open(&path);
    }

    #[test]
    fn source_lists_of_any_text_never_panic(text in "[ -~\n,]{0,200}") {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("s.csv");
        std::fs::write(&path, format!("l_rad,m_rad,flux_jy\n{text}")).unwrap();
        let _ = cittert_formats::read_sources(&path);
    }
}

#[test]
fn hdf5_files_cut_anywhere_are_refused() {
    let (_, bytes) = &good()[2];
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("cut.calh5");
    for k in 0..40 {
        std::fs::write(&path, &bytes[..bytes.len() * k / 40]).unwrap();
        assert!(Contents::of(&path).is_err(), "{k}");
    }
}

/// Headers that claim a million million rows: refused before memory or time is spent on them.
#[test]
fn a_claim_of_a_million_million_rows_is_refused_at_once() {
    const ROWS: &str = "1000000000000";
    let dir = tempfile::tempdir().unwrap();
    for (which, key) in [(0, "GCOUNT  "), (1, "NAXIS1  "), (1, "NAXIS2  ")] {
        let (name, bytes) = &good()[which];
        let mut bytes = bytes.clone();
        let at = bytes.chunks(80).position(|c| c.starts_with(key.as_bytes())).unwrap() * 80;
        bytes[at..at + 80].copy_from_slice(format!("{:<80}", format!("{key}= {ROWS:>20}")).as_bytes());
        let path = dir.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        refused(&path, "expected");
    }
}

/// As above: the chunks of an HDF5 file need not be there for its shape to claim them.
#[test]
fn a_uvh5_that_claims_a_million_million_rows_is_refused_at_once() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("claim.uvh5");
    let set = common::boresight();
    let mut writer = cittert_formats::uvh5::Uvh5Writer::create(&path, &set.header, &cittert_formats::CreateOptions::default()).unwrap();
    writer.write(&set.data).unwrap();
    writer.complete().unwrap();
    {
        let file = hdf5::File::append(&path).unwrap();
        let rows = 1_000_000_000_000_usize;
        for (name, shape) in [("Data/visdata", vec![rows, 4, 1]), ("Header/time_array", vec![rows])] {
            let dtype = file.dataset(name).unwrap().dtype().unwrap().to_descriptor().unwrap();
            file.unlink(name).unwrap();
            let chunk: Vec<usize> = shape.iter().map(|n| (*n).min(1000)).collect();
            file.new_dataset_builder().empty_as(dtype).shape(shape).chunk(chunk).create(name).unwrap();
        }
        file.unlink("Header/Nblts").unwrap();
        file.new_dataset::<i64>().create("Header/Nblts").unwrap().write_scalar(&(rows as i64)).unwrap();
    }
    refused(&path, "1000000000000");
}

fn refused(path: &Path, word: &str) {
    let begun = std::time::Instant::now();
    let Err(e) = Contents::of(path) else { panic!("{} was read", path.display()) };
    let text = e.to_string();
    assert!(begun.elapsed().as_secs_f64() < 0.5, "{text}");
    assert!(text.contains(&path.file_name().unwrap().to_string_lossy().into_owned()) && text.contains(word), "{text}");
}
