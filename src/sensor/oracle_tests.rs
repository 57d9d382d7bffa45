//! PSFs against prysm: `tests/oracle/sensor_psf.csv`, which `sensor_psf.py` beside it writes.

use super::*;
use cittert_arrays::quantity::{Angle, Frequency, Length};
use cittert_arrays::{SPEED_OF_LIGHT_M_S, SpectralWindow};
use std::path::Path;

const SAMPLES: usize = 40;

fn column(name: &str) -> Vec<f64> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/oracle/sensor_psf.csv");
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    let k = lines.next().unwrap().split(',').position(|n| n == name).unwrap();
    lines.map(|line| line.split(',').nth(k).unwrap().parse().unwrap()).collect()
}

/// Largest difference from prysm, over the peak of its PSF.
fn difference(name: &str, zernike: &str, change: impl Fn(&mut PupilOptions)) -> f64 {
    let wavelength = SPEED_OF_LIGHT_M_S / 94e9;
    let mut options = SensorOptions::default();
    change(&mut options.pupil);
    options.band.bandwidth = Some(Frequency(0.0));
    let psf = |zernike: Option<&str>| {
        let mut options = options.clone();
        options.aberrations.zernike = zernike.map(|z| z.parse().unwrap());
        let optics = Optics::new(&options, &SpectralWindow::band(94e9, 1e9, 1).unwrap()).unwrap();
        optics.psf((0.0, 0.0), 0.25 * wavelength, SAMPLES)
    };
    let (aberrated, ideal) = (psf(Some(zernike)), psf(None)[[SAMPLES / 2, SAMPLES / 2]]);
    let theirs = column(name);
    assert_eq!(theirs.len(), SAMPLES * SAMPLES);
    let peak = theirs.iter().fold(0.0_f64, |a, v| a.max(*v));
    aberrated.iter().zip(&theirs).fold(0.0_f64, |a, (v, t)| a.max((v / ideal - t).abs())) / peak
}

#[test]
fn psfs_of_five_aberrated_pupils_agree_with_prysm_within_1e_4_of_the_peak() {
    let aperture = |text: &str| Some(text.parse().unwrap());
    let all = [
        ("circle", difference("circle", "4:0.1", |p| p.aperture = aperture("circle=1m"))),
        ("ring", difference("ring", "8:0.12,5:0.05", |p| (p.aperture, p.blockage) = (aperture("circle=1m"), aperture("circle=0.3m")))),
        (
            "struts",
            difference("struts", "5:0.15,7:0.05", |p| {
                (p.aperture, p.blockage) = (aperture("circle=1m"), aperture("circle=0.3m"));
                (p.struts, p.strut_width, p.strut_angle) = (3, Some(Length(0.031_25)), Some(Angle(30.0_f64.to_radians())));
            }),
        ),
        ("hexagon", difference("hexagon", "11:0.1,3:0.2", |p| p.aperture = aperture("hexagon=999.650417259mm"))),
        (
            "taper",
            difference("taper", "4:0.05,6:0.1,9:0.08,12:-0.06", |p| {
                (p.aperture, p.taper) = (aperture("circle=1m"), "gaussian=10".parse().unwrap());
            }),
        ),
    ];
    assert!(all.iter().all(|(_, difference)| *difference < 1e-4), "{all:?}");
}
