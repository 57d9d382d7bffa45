//! FITS images: images that cittert writes are read back unchanged, images of other programs are read, and damaged files are refused with a
//! message.

use cittert_arrays::{BrightnessUnit, Image, Polarization, RestoringBeam, SkyFrame, SkyGrid, SpectralWindow};
use cittert_formats::fits::{ImageOptions, read_image, write_image};
use ndarray::Array4;
use std::io::Write;
use std::path::{Path, PathBuf};

fn sky() -> SkyFrame {
    SkyFrame::Sky { ra_rad: 1.0, dec_rad: 0.5, frame: "icrs".into() }
}

fn image(frame: SkyFrame, n_l: usize, n_m: usize, spectrum: SpectralWindow, pols: Vec<Polarization>) -> Image {
    let grid = SkyGrid::new(n_l, n_m, 1e-4, frame).unwrap();
    let shape = (spectrum.n_chan(), pols.len(), n_m, n_l);
    let data = Array4::from_shape_fn(shape, |(c, p, m, l)| (1000 * c + 100 * p + 10 * m + l) as f64 + 0.25);
    let mut image = Image::new(grid, spectrum, pols, data, BrightnessUnit::JyPerBeam).unwrap();
    image.object = "3C 48".into();
    image.telescope = "VLA".into();
    image.time_jd = Some(2_451_545.25);
    image.history = vec!["one".into(), "two".into()];
    image
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

fn close(a: &Image, b: &Image) {
    assert_eq!(a.data, b.data);
    assert_eq!((a.unit, &a.object, &a.telescope, &a.history), (b.unit, &b.object, &b.telescope, &b.history));
    assert!((a.time_jd.unwrap() - b.time_jd.unwrap()).abs() < 1e-8);
    assert!((a.grid.cell_rad / b.grid.cell_rad - 1.0).abs() < 1e-14);
    assert_eq!((a.grid.n_l, a.grid.n_m), (b.grid.n_l, b.grid.n_m));
    assert_eq!(a.polarizations, b.polarizations);
    assert_eq!(a.spectrum, b.spectrum);
}

#[test]
fn a_cube_on_the_sky_comes_back() {
    let dir = folder();
    let path = dir.path().join("cube.fits");
    let spectrum = SpectralWindow::band(94e9, 8e9, 4).unwrap();
    let mut a = image(sky(), 8, 6, spectrum, vec![Polarization::XX, Polarization::YY]);
    a.beams = (1..5).map(|k| RestoringBeam { bmaj_rad: 1e-3 * f64::from(k), bmin_rad: 5e-4, bpa_rad: 0.3 }).collect();
    write_image(&path, &a, ImageOptions::default()).unwrap();
    let b = read_image(&path).unwrap();
    close(&a, &b);
    let SkyFrame::Sky { ra_rad, dec_rad, ref frame } = b.grid.frame else { panic!("{:?}", b.grid.frame) };
    assert!((ra_rad - 1.0).abs() < 1e-15 && (dec_rad - 0.5).abs() < 1e-15 && frame == "icrs");
    for (x, y) in a.beams.iter().zip(&b.beams) {
        assert!((x.bmaj_rad - y.bmaj_rad).abs() < 1e-9 && (x.bpa_rad - y.bpa_rad).abs() < 1e-7, "{x:?} {y:?}");
    }
    assert!(write_image(&path, &a, ImageOptions::default()).unwrap_err().to_string().contains("exists already"));
    // A name that ends in .gz makes a compressed file of the same content, the same at every writing.
    let packed = dir.path().join("cube.fits.gz");
    write_image(&packed, &a, ImageOptions::default()).unwrap();
    close(&a, &read_image(&packed).unwrap());
    let bytes = std::fs::read(&packed).unwrap();
    assert_eq!(bytes[..2], [0x1f, 0x8b]);
    assert_eq!(cittert_formats::format_of(&packed).unwrap().name(), "FITS image");
    write_image(&packed, &a, ImageOptions { overwrite: true, ..ImageOptions::default() }).unwrap();
    assert_eq!(std::fs::read(&packed).unwrap(), bytes);
}

#[test]
fn a_boresight_image_stays_one_and_uneven_channels_survive() {
    let dir = folder();
    let path = dir.path().join("bore.fits");
    let spectrum = SpectralWindow::new(vec![90e9, 91e9, 95e9], vec![1e9, 2e9, 1e8]).unwrap();
    let mut a = image(SkyFrame::Boresight, 7, 5, spectrum, vec![Polarization::I]);
    a.unit = BrightnessUnit::Kelvin;
    a.pedestal_k = Some(290.0);
    a.pattern = "airy diameter_m=0.01 blockage=0.25".parse().unwrap();
    a.seen_through = "gaussian fwhm_deg=9".parse().unwrap();
    write_image(&path, &a, ImageOptions { double: true, ..Default::default() }).unwrap();
    let b = read_image(&path).unwrap();
    close(&a, &b);
    assert_eq!((b.grid.frame, b.pedestal_k), (SkyFrame::Boresight, Some(290.0)));
    assert_eq!((b.pattern, b.seen_through), (a.pattern, a.seen_through));
}

/// A FITS file of given cards and data bytes.
fn fits(cards: &[&str], data: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for card in cards.iter().chain(&["END"]) {
        bytes.extend(format!("{card:<80}").bytes());
    }
    bytes.resize(bytes.len().div_ceil(2880) * 2880, b' ');
    bytes.extend(data);
    bytes.resize(bytes.len().div_ceil(2880) * 2880, 0);
    bytes
}

const PLANE: [&str; 9] = [
    "SIMPLE  =                    T",
    "BITPIX  =                   16",
    "NAXIS   =                    2",
    "NAXIS1  =                    3",
    "NAXIS2  =                    2",
    "CDELT1  =                 -0.0001",
    "CDELT2  =               0.0001",
    "BUNIT   = 'mK'",
    "BLANK   =                   -1",
];

fn save(dir: &Path, name: &str, bytes: &[u8]) -> PathBuf {
    let path = dir.join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

fn refused(dir: &Path, bytes: &[u8], words: &[&str]) {
    let path = save(dir, "bad.fits", bytes);
    let text = read_image(&path).unwrap_err().to_string();
    assert!(text.contains("bad.fits"), "{text}");
    for word in words {
        assert!(text.contains(word), "{word:?} is not in {text:?}");
    }
}

#[test]
fn integers_are_scaled_and_blanks_are_nan() {
    let dir = folder();
    let data: Vec<u8> = [0i16, 1, 2, 3, -1, 5].iter().flat_map(|v| v.to_be_bytes()).collect();
    let mut cards = PLANE.to_vec();
    cards.extend(["BSCALE  =                  2.0", "BZERO   =                 10.0"]);
    let path = save(dir.path(), "i16.fits", &fits(&cards, &data));
    let image = read_image(&path).unwrap();
    assert_eq!(image.unit, BrightnessUnit::Kelvin);
    // CDELT1 < 0 on a linear axis: columns are turned so that l grows to the right.
    let row: Vec<f64> = image.plane(0, 0).row(0).to_vec();
    assert!(row.iter().zip([0.014, 0.012, 0.010]).all(|(a, b)| (a - b).abs() < 1e-12), "{row:?}");
    assert!(image.plane(0, 0)[(1, 1)].is_nan());
    let mut gz = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    gz.write_all(&fits(&cards, &data)).unwrap();
    let zipped = read_image(&save(dir.path(), "i16.fits.gz", &gz.finish().unwrap())).unwrap();
    assert_eq!(zipped.plane(0, 0).row(0), image.plane(0, 0).row(0));
}

#[test]
fn every_bitpix_and_an_image_in_an_extension_are_read() {
    let dir = folder();
    type Encode = fn(f64) -> Vec<u8>;
    let kinds: [(i32, Encode); 6] = [
        (8, |v| vec![v as u8]),
        (16, |v| (v as i16).to_be_bytes().into()),
        (32, |v| (v as i32).to_be_bytes().into()),
        (64, |v| (v as i64).to_be_bytes().into()),
        (-32, |v| (v as f32).to_be_bytes().into()),
        (-64, |v| v.to_be_bytes().into()),
    ];
    for (bitpix, encode) in kinds {
        let data: Vec<u8> = (0..6).flat_map(|k| encode(f64::from(k) * 20.0)).collect();
        let card = format!("BITPIX  = {bitpix:>20}");
        let mut cards = PLANE.to_vec();
        cards[1] = &card;
        cards[5] = "CDELT1  =               0.0001";
        let values = |bytes: &[u8]| read_image(&save(dir.path(), "x.fits", bytes)).unwrap().data.into_raw_vec_and_offset().0;
        let expected: Vec<f64> = (0..6).map(|k| f64::from(k) * 20.0 * 1e-3).collect();
        assert_eq!(values(&fits(&cards, &data)), expected, "BITPIX {bitpix}");
        let mut bytes = fits(&["SIMPLE  =                    T", "BITPIX  =                    8", "NAXIS   =                    0"], &[]);
        cards[0] = "XTENSION= 'IMAGE   '";
        bytes.extend(fits(&cards, &data));
        assert_eq!(values(&bytes), expected, "BITPIX {bitpix} in an extension");
    }
}

#[test]
fn degenerate_axes_in_any_order_are_read() {
    let dir = folder();
    let mut cards = PLANE.to_vec();
    cards[1] = "BITPIX  =                  -32";
    cards[2] = "NAXIS   =                    5";
    cards[5] = "CDELT1  =               0.0001";
    cards.extend(["NAXIS3  = 1", "NAXIS4  = 2", "NAXIS5  = 2", "CTYPE4  = 'STOKES'", "CRVAL4  = -1.0", "CDELT4  = -1.0"]);
    cards.extend(["CTYPE5  = 'FREQ'", "CRVAL5  = 1E9", "CDELT5  = 1E6"]);
    let data: Vec<u8> = (0..24).flat_map(|k| (k as f32).to_be_bytes()).collect();
    let image = read_image(&save(dir.path(), "x.fits", &fits(&cards, &data))).unwrap();
    assert_eq!(image.polarizations, [Polarization::RR, Polarization::LL]);
    assert_eq!(image.spectrum.freq_hz(), [1e9, 1.001e9]);
    // File order: STOKES runs before FREQ.
    assert!((image.data[(1, 0, 0, 0)] - 12e-3).abs() < 1e-9 && (image.data[(0, 1, 0, 0)] - 6e-3).abs() < 1e-9);
}

#[test]
fn broken_files_are_refused_with_what_was_expected_and_found() {
    let dir = folder();
    let d = dir.path();
    let good = fits(&PLANE, &[0; 12]);
    refused(d, &good[..2880 + 5], &["image data", "expected 12 bytes", "found 5 bytes", "truncated"]);
    refused(d, &good[..100], &["header block 0", "truncated"]);
    refused(d, b"", &["empty"]);
    refused(d, b"\x89PNG\r\n\x1a\n0000", &["expected a FITS file", "\\x89PNG"]);
    let with = |k: usize, card: &'static str| {
        let mut cards = PLANE.to_vec();
        cards[k] = card;
        fits(&cards, &[0; 12])
    };
    refused(d, &with(5, "OBJECT  = 'no cell'"), &["CDELT1", "size of a cell"]);
    refused(d, &with(5, "CDELT1  =                  0.0"), &["step of axis 1"]);
    refused(d, &with(5, "CDELT1  =                  0.2"), &["not square"]);
    refused(d, &with(2, "NAXIS   =                  999"), &["NAXIS", "0 to 99"]);
    refused(d, &with(3, "NAXIS1  =  9000000000000000000"), &["NAXIS"]);
    refused(d, &with(3, "NAXIS1  =                60000"), &["expected 240000 bytes"]);
    refused(d, &with(3, "NAXIS1  =                   -3"), &["NAXIS1"]);
    refused(d, &with(1, "BITPIX  =                   17"), &["BITPIX"]);
    assert!(read_image(d).unwrap_err().to_string().contains("directory"));
    assert!(read_image(&d.join("missing.fits")).unwrap_err().to_string().contains("missing.fits"));
}

#[test]
fn a_compressed_file_that_claims_too_much_is_refused_before_it_is_inflated() {
    let dir = folder();
    let mut cards = PLANE.to_vec();
    cards[3] = "NAXIS1  =                30000";
    cards[4] = "NAXIS2  =                30000";
    let mut gz = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    gz.write_all(&fits(&cards, &[0; 12])).unwrap();
    refused(dir.path(), &gz.finish().unwrap(), &["1800000000 bytes", "compressed"]);
}
