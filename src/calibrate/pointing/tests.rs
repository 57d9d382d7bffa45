//! The offsets of antennas come back from simulated data.

use super::*;
use crate::calibrate::{JudgeOptions, SolutionInterval};
use crate::progress::Silent;
use crate::random::stream;
use crate::simulate::{SimulateOptions, Simulator, SkyModel};
use cittert_arrays::pattern::{Pointing, Pointings};
use cittert_arrays::quantity::Temperature;
use cittert_arrays::{
    Antenna, ArrayLayout, BrightnessUnit, Image, LayoutFrame, PhaseCenter, Polarization, SkyFrame, SkyGrid, SpectralWindow, UvCoverage,
    VisUnit, VisibilitySet,
};
use ndarray::{Array2, Array4};
use num_complex::Complex;
use rand::RngExt;

const N: u32 = 10;

/// A scene with structure over the pattern.
fn scene() -> SkyModel {
    let grid = SkyGrid::new(40, 40, 0.008, SkyFrame::Boresight).unwrap();
    let band = SpectralWindow::band(94e9, 2e9, 1).unwrap();
    let mut rng = stream(5, "scene of a pointing test", 0);
    let data = Array4::from_shape_fn((1, 1, 40, 40), |_| if rng.random_range(0.0..1.0) < 0.1 { 320.0 } else { 80.0 });
    SkyModel::of_image(Image::new(grid, band, vec![Polarization::I], data, BrightnessUnit::Kelvin).unwrap())
}

/// Data of ten antennas at two times, with noise of a system temperature and with gains.
fn observed(pattern: &str, offset_rad: f64, tsys: f64, gains: bool) -> (VisibilitySet, Pointings) {
    let at = |k: u32| {
        let a = 2.399_963 * f64::from(k);
        [0.045 * f64::from(k + 1).sqrt() * a.cos(), 0.045 * f64::from(k + 1).sqrt() * a.sin(), 0.0]
    };
    let mut layout =
        ArrayLayout::new("t", LayoutFrame::Boresight, (0..N).map(|k| Antenna::new(format!("A{k}"), k, at(k))).collect()).unwrap();
    layout.pattern = pattern.parse().unwrap();
    let pairs: Vec<(u32, u32)> = (0..N).flat_map(|a| (a + 1..N).map(move |b| (a, b))).collect();
    let n = pairs.len();
    let uvw = Array2::from_shape_fn((2 * n, 3), |(r, k)| at(pairs[r % n].1)[k] - at(pairs[r % n].0)[k]);
    let (a, b) = (0..2 * n).map(|r| pairs[r % n]).unzip();
    let times: Vec<f64> = (0..2 * n).map(|r| 2_460_000.5 + (r / n) as f64 / 1440.0).collect();
    let rows = UvCoverage::new(uvw, a, b, times, vec![1.0; 2 * n], vec![0; 2 * n]).unwrap();
    let options = SimulateOptions { tsys: Some(Temperature(tsys)), ..SimulateOptions::default() };
    let header = options.header(layout, SpectralWindow::band(94e9, 2e9, 3).unwrap(), PhaseCenter::unprojected("b"), VisUnit::KelvinSr);
    let mut rng = stream(9, "offsets of a pointing test", 0);
    let mut p = Pointings::nominal(vec![2_460_000.5, 2_460_000.5 + 1.0 / 1440.0], N as usize);
    p.antennas.mapv_inplace(|_| Pointing {
        l: rng.random_range(-offset_rad..=offset_rad),
        m: rng.random_range(-offset_rad..=offset_rad),
        width: 1.0,
    });
    let sky = scene();
    let mut simulator = Simulator::new(header, &sky, &options, &Silent).unwrap().with_pointings(p.clone()).unwrap();
    let mut block = simulator.block(rows, 0, &Silent).unwrap();
    if gains {
        for ((row, _, _), v) in block.vis.indexed_iter_mut() {
            let g = |ant: u32| Complex::from_polar(1.0 + 0.03 * (ant as f32).sin(), 0.1 * (2.0 * ant as f32).cos());
            *v *= g(block.coverage.ant1[row]) * g(block.coverage.ant2[row]).conj();
        }
    }
    (VisibilitySet::new(simulator.header().clone(), block).unwrap(), p)
}

fn solved(set: &VisibilitySet) -> PointingReport {
    solve_pointings(&mut set.clone(), &scene(), SolutionInterval::Integration, &JudgeOptions::default(), &Silent).unwrap()
}

/// Rms of the errors of the offsets, and of the errors over their standard deviations.
fn errors(found: &Pointings, truth: &Pointings) -> (f64, f64) {
    let sigma = found.sigma_rad.as_ref().unwrap();
    let mut sums = (0.0, 0.0);
    for (at, f) in found.antennas.indexed_iter() {
        for (d, s) in [(f.l - truth.antennas[at].l, sigma[at][0]), (f.m - truth.antennas[at].m, sigma[at][1])] {
            sums = (sums.0 + d * d, sums.1 + (d / s).powi(2));
        }
    }
    let n = 2.0 * found.antennas.len() as f64;
    ((sums.0 / n).sqrt(), (sums.1 / n).sqrt())
}

#[test]
fn offsets_come_back_without_noise_whatever_the_gains() {
    for pattern in ["gaussian fwhm_deg=9", "airy diameter_m=0.022"] {
        let (set, truth) = observed(pattern, 0.012, 1e-6, true);
        let report = solved(&set);
        let (rms, _) = errors(&report.pointings, &truth);
        // 0.012 rad is 0.7 degrees; the polynomials of the offsets leave some 1e-5 of a voltage.
        assert!(rms < 2e-5, "{pattern}: {rms}");
        assert_eq!(report.supported, Some(true));
        assert!(report.misfit.unwrap()[1] < 1e-6, "{:?}", report.misfit);
    }
}

#[test]
fn the_stated_uncertainty_is_that_of_the_offsets() {
    let (set, truth) = observed("gaussian fwhm_deg=9", 0.01, 600.0, false);
    let report = solved(&set);
    let (rms, over_sigma) = errors(&report.pointings, &truth);
    // 40 numbers: their rms over sigma is 1 within 0.11 (one sigma).
    assert!((0.65..1.4).contains(&over_sigma), "{rms} rad, {over_sigma} sigma");
    assert!(rms < 0.004, "{rms}");
}

#[test]
fn offsets_that_are_not_there_are_not_supported() {
    let (set, truth) = observed("gaussian fwhm_deg=9", 0.0, 600.0, false);
    let report = solved(&set);
    assert_eq!(report.supported, Some(false), "{report:?}");
    assert!(errors(&report.pointings, &truth).1 < 1.5);
}

#[test]
fn a_set_without_a_pattern_is_refused() {
    let (mut set, _) = observed("gaussian fwhm_deg=9", 0.0, 600.0, false);
    set.header.layout.pattern = "none".parse().unwrap();
    let e = solve_pointings(&mut set, &scene(), SolutionInterval::Infinite, &JudgeOptions::default(), &Silent).unwrap_err();
    assert!(e.to_string().contains("states no pattern"), "{e}");
}
