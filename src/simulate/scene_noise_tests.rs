//! Tests of noise that depends on the scene, against the moments of Gaussian fields.

use super::*;
use crate::progress::Silent;
use cittert_arrays::quantity::{Duration, Temperature};
use cittert_arrays::{
    Antenna, ArrayLayout, BrightnessUnit, Image, LayoutFrame, PhaseCenter, Polarization, SkyFrame, SkyGrid, SpectralWindow, VisUnit,
    VisibilitySet,
};
use ndarray::{Array2, Array4};
use num_complex::Complex64;

const DRAWS: usize = 2000;
const ELEMENTS: u32 = 7;

/// 290 K with a body of 900 K.
fn scene() -> SkyModel {
    let grid = SkyGrid::new(64, 64, 7e-3, SkyFrame::Boresight).unwrap();
    let band = SpectralWindow::band(94e9, 2e9, 1).unwrap();
    let data =
        Array4::from_shape_fn((1, 1, 64, 64), |(_, _, r, c)| if (28..36).contains(&r) && (38..44).contains(&c) { 900.0 } else { 290.0 });
    SkyModel::of_image(Image::new(grid, band, vec![Polarization::I], data, BrightnessUnit::Kelvin).unwrap())
}

/// Seven elements side by side through a pattern of 12 degrees, again and again.
fn observed(options: &SimulateOptions, times: usize) -> VisibilitySet {
    let antennas = (0..ELEMENTS).map(|k| Antenna::new(format!("A{k}"), k, [6e-3 * f64::from(k), 5e-3 * f64::from(k % 3), 0.0]));
    let mut layout = ArrayLayout::new("t", LayoutFrame::Boresight, antennas.collect()).unwrap();
    layout.pattern = "gaussian fwhm_deg=12".parse().unwrap();
    let track = TrackOptions { integration: Duration(1e-3), duration: Some(Duration(1e-3 * times as f64)), ..TrackOptions::default() };
    let rows = track.plan(&layout).unwrap().plan.with_autocorrelations(true).coverage().unwrap();
    let spectrum = SpectralWindow::band(94e9, 2e9, 2).unwrap();
    let header = options.header(layout, spectrum, PhaseCenter::unprojected("b"), VisUnit::KelvinSr);
    simulate_set(header, &rows, &scene(), options, &Silent).unwrap()
}

fn wide(v: num_complex::Complex32) -> Complex64 {
    Complex64::new(v.re.into(), v.im.into())
}

/// The fields of channel `chan` of a set without noise and with ideal receivers, to which these receivers are added.
fn fields(quiet: &VisibilitySet, chan: usize, tsys: f64) -> Fields {
    let freq = quiet.header.spectrum.freq_hz()[chan];
    let receiver = tsys * quiet.header.layout.pattern.solid_angle_sr(freq).unwrap();
    let n = ELEMENTS as usize;
    let mut c = Array2::<Complex64>::zeros((n, n));
    let coverage = &quiet.data.coverage;
    for (row, (a, b)) in coverage.ant1.iter().zip(&coverage.ant2).enumerate() {
        let (a, b, v) = (*a as usize, *b as usize, wide(quiet.data.vis[(row, chan, 0)]));
        c[(a, b)] = v;
        c[(b, a)] = v.conj();
    }
    for k in 0..n {
        c[(k, k)] += receiver;
    }
    Fields::new(c, 1e9 * 1e-3).unwrap()
}

#[test]
fn two_thousand_draws_have_the_predicted_variances_and_covariances() {
    let tsys = 150.0;
    let quiet = observed(&SimulateOptions { autos: true, ..SimulateOptions::default() }, 1);
    let options = SimulateOptions { autos: true, scene_noise: true, tsys: Some(Temperature(tsys)), seed: 5, ..SimulateOptions::default() };
    let set = observed(&options, DRAWS);
    let rows = quiet.data.n_rows();
    assert_eq!(set.data.n_rows(), rows * DRAWS);
    let coverage = quiet.data.coverage.clone();
    let pair = |row: usize| (coverage.ant1[row] as usize, coverage.ant2[row] as usize);
    for chan in 0..2 {
        let f = fields(&quiet, chan, tsys);
        let freq = set.header.spectrum.freq_hz()[chan];
        let off = |row: usize, draw: usize| {
            let receiver =
                if pair(row).0 == pair(row).1 { set.header.layout.receiver_power(0, VisUnit::KelvinSr, freq).unwrap() } else { 0.0 };
            wide(set.data.vis[(draw * rows + row, chan, 0)]) - wide(quiet.data.vis[(row, chan, 0)]) - receiver
        };
        let n = DRAWS as f64;
        let mut ratios = Vec::new();
        for row in 0..rows {
            let (p, q) = pair(row);
            let reals = if p == q { 1.0 } else { 2.0 };
            let measured = (0..DRAWS).map(|d| off(row, d).norm_sqr()).sum::<f64>() / n / reals;
            ratios.push(measured / f.variance(p, q));
            let weight = f64::from(set.data.weights[(row, chan, 0)]);
            assert!((weight * f.variance(p, q) - 1.0).abs() < 1e-5, "the weight states the variance");
            // Five standard errors of the variance of 2,000 draws.
            assert!((ratios[row] - 1.0).abs() < 5.0 * (2.0 / n).sqrt(), "{p}-{q}: {}", ratios[row]);
        }
        let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
        assert!((mean - 1.0).abs() < 0.03, "{mean}");
        // Scene and receivers together are far from receivers alone.
        let alone = (tsys * set.header.layout.pattern.solid_angle_sr(freq).unwrap()).powi(2) / 2.0 / 1e6;
        assert!(f.variance(0, 1) > 5.0 * alone);
        let scale = f.covariance((0, 1), (0, 1)).re;
        let mut largest = 0.0_f64;
        for a in (0..rows).step_by(2) {
            for b in (0..a).step_by(3) {
                let both = |g: &dyn Fn(Complex64) -> Complex64| (0..DRAWS).map(|d| off(a, d) * g(off(b, d))).sum::<Complex64>() / n;
                let (cov, rel) = (both(&|v| v.conj()), both(&|v| v));
                let limit = 5.5 * 2.0 * scale / n.sqrt();
                assert!((cov - f.covariance(pair(a), pair(b))).norm() < limit, "{:?} {:?}: {cov}", pair(a), pair(b));
                assert!((rel - f.relation(pair(a), pair(b))).norm() < limit, "{:?} {:?}: {rel}", pair(a), pair(b));
                largest = largest.max(f.covariance(pair(a), pair(b)).norm());
            }
        }
        assert!(largest > 5.0 * 2.0 * scale / n.sqrt(), "the covariances are large enough to be seen: {largest:e} {scale:e}");
    }
}

#[test]
fn a_faint_scene_has_the_noise_of_the_receivers() {
    let options = |scene_noise| SimulateOptions { scene_noise, tsys: Some(Temperature(1e5)), ..SimulateOptions::default() };
    let (with, without) = (observed(&options(true), 1), observed(&options(false), 1));
    for (a, b) in with.data.weights.iter().zip(&without.data.weights) {
        // 300 K in 100,000 K change the variance by 0.6 %.
        assert!((a / b - 1.0).abs() < 0.01, "{a} {b}");
    }
}

#[test]
fn the_draw_does_not_depend_on_threads_and_all_baselines_are_needed() {
    let options = SimulateOptions { scene_noise: true, tsys: Some(Temperature(300.0)), ..SimulateOptions::default() };
    let run = |threads: usize| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| observed(&options, 3));
    assert_eq!(run(1).data, run(3).data);
    let layout = observed(&options, 1).header.layout;
    let rows = TrackOptions { integration: Duration(1e-3), ..TrackOptions::default() }.plan(&layout).unwrap().plan.rows(0..5).unwrap();
    let header = options.header(layout, SpectralWindow::band(94e9, 2e9, 1).unwrap(), PhaseCenter::unprojected("b"), VisUnit::KelvinSr);
    let said = simulate_set(header, &rows, &scene(), &options, &Silent).unwrap_err().to_string();
    assert!(said.contains("every baseline"), "{said}");
}
