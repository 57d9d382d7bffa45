//! Tests of autocorrelations: the zero spacing of the scene plus the power of the receiver, for every kind of pattern.

use super::*;
use crate::corrupt::{CorruptOptions, Error, corrupt, corrupted_header};
use crate::progress::Silent;
use cittert_arrays::pattern::{PatternSample, SampledPattern};
use cittert_arrays::quantity::{Duration, Temperature};
use cittert_arrays::{
    Antenna, ArrayLayout, BrightnessUnit, Image, LayoutFrame, PhaseCenter, Polarization, Sensitivity, SkyFrame, SkyGrid, SpectralWindow,
    VisUnit, VisibilityBlock, VisibilityHeader, VisibilitySet,
};
use ndarray::Array4;
use std::f64::consts::{LN_2, TAU};

const PIXELS: usize = 222;
const CELL: f64 = 9e-3;

/// Each kind that has fallen to nothing at the horizon, with its power at an angle from the boresight.
type Power = fn(f64, f64) -> f64;

fn kinds() -> Vec<(ElementPattern, Power)> {
    let table = |theta: f64| (-30.0 * theta * theta).exp();
    let angles = (0..1200).flat_map(|t| (0..4).map(move |p| (0.001 * f64::from(t), TAU * f64::from(p) / 4.0)));
    let samples: Vec<PatternSample> =
        angles.map(|(theta_rad, phi_rad)| PatternSample { freq_hz: 1e9, theta_rad, phi_rad, power: table(theta_rad) }).collect();
    vec![
        ("gaussian fwhm_deg=9".parse().unwrap(), |t, _| (-4.0 * LN_2 * (t / 9f64.to_radians()).powi(2)).exp()),
        ("gaussian fwhm_rad=0.2 ref_freq_ghz=90".parse().unwrap(), |t, f| (-4.0 * LN_2 * (t * f / 90e9 / 0.2).powi(2)).exp()),
        ("cos exponent=20".parse().unwrap(), |t, _| t.cos().powi(20)),
        (ElementPattern::Sampled(SampledPattern::of_samples(&samples).unwrap().into()), |t, _| (-30.0 * t * t).exp()),
    ]
}

fn uniform(kelvin: f64) -> SkyModel {
    let grid = SkyGrid::new(PIXELS, PIXELS, CELL, SkyFrame::Boresight).unwrap();
    let band = SpectralWindow::band(94e9, 6e9, 1).unwrap();
    let data = Array4::from_elem((1, 1, PIXELS, PIXELS), kelvin);
    SkyModel::of_image(Image::new(grid, band, vec![Polarization::I], data, BrightnessUnit::Kelvin).unwrap())
}

/// Eight elements as close as 1 mm, all in one plane, at three frequencies.
fn observed(pattern: &ElementPattern, options: &SimulateOptions, unit: VisUnit) -> VisibilitySet {
    let antennas = (0..8_u32).map(|k| Antenna::new(format!("A{k}"), k, [1e-3 * f64::from(k * k), 1e-3 * f64::from(k % 3), 0.0]));
    let mut layout = ArrayLayout::new("t", LayoutFrame::Boresight, antennas.collect()).unwrap();
    layout.pattern.clone_from(pattern);
    let track = TrackOptions { integration: Duration(0.01), ..TrackOptions::default() }.plan(&layout).unwrap();
    let rows = track.plan.with_autocorrelations(options.autos).coverage().unwrap();
    let spectrum = SpectralWindow::band(94e9, 6e9, 3).unwrap();
    let header: VisibilityHeader = options.header(layout, spectrum, PhaseCenter::unprojected("b"), unit);
    simulate_set(header, &rows, &uniform(300.0), options, &Silent).unwrap()
}

/// 2 pi T integral A(s) J0(2 pi u s) s / n ds, with s = sin(theta): 2 pi T integral A(theta) J0(2 pi u sin theta) sin theta dtheta.
fn integral(power: fn(f64, f64) -> f64, u_wl: f64, freq: f64) -> f64 {
    // Simpson's rule.
    let (n, h) = (4000, std::f64::consts::FRAC_PI_2 / 4000.0);
    let term = |k: i32| {
        let t = h * f64::from(k);
        let weight = if k == 0 || k == n { 1.0 } else { 2.0 + 2.0 * f64::from(k % 2) };
        weight * power(t, freq) * libm::j0(TAU * u_wl * t.sin()) * t.sin()
    };
    300.0 * TAU * h / 3.0 * (0..=n).map(term).sum::<f64>()
}

#[test]
fn a_uniform_scene_of_300_k_is_on_every_baseline_and_in_every_autocorrelation() {
    let ideal = SimulateOptions { autos: true, ..SimulateOptions::default() };
    for (pattern, power) in kinds() {
        let set = observed(&pattern, &ideal, VisUnit::KelvinSr);
        let coverage = &set.data.coverage;
        assert_eq!(coverage.n_rows(), 8 * 9 / 2);
        let mut worst = 0.0_f64;
        for ((row, chan, _), v) in set.data.vis.indexed_iter() {
            let f = set.header.spectrum.freq_hz()[chan];
            let u = coverage.uvw_m[(row, 0)].hypot(coverage.uvw_m[(row, 1)]) * f / 299_792_458.0;
            assert_eq!(coverage.ant1[row] == coverage.ant2[row], u == 0.0);
            let off = (f64::from(v.re) - integral(power, u, f)).abs().max(f64::from(v.im).abs());
            worst = worst.max(off / integral(power, 0.0, f));
        }
        assert!(worst < 1e-6, "{pattern}: {worst:e}");
        assert!(set.header.layout.states_receivers() && set.header.antenna_temperature_k.is_some());
        let alone = SimulateOptions { no_antenna_temperature: true, ..ideal.clone() };
        assert_eq!(observed(&pattern, &alone, VisUnit::KelvinSr).header.antenna_temperature_k, None);
        assert!(set.header.layout.antennas().iter().all(|a| a.receiver == Some(Sensitivity::SefdJy(0.0))), "receivers without noise");
    }
}

#[test]
fn the_receivers_are_in_the_autocorrelations_and_stated() {
    let pattern: ElementPattern = "gaussian fwhm_deg=9".parse().unwrap();
    let omega = pattern.solid_angle_sr(94e9).unwrap();
    for unit in [VisUnit::KelvinSr, VisUnit::Jy] {
        let options = SimulateOptions { autos: true, tsys: Some(Temperature(600.0)), ..SimulateOptions::default() };
        let quiet = observed(&pattern, &SimulateOptions { autos: true, ..SimulateOptions::default() }, unit);
        let set = observed(&pattern, &options, unit);
        let (mut sum, mut count, mut squares) = (0.0, 0.0, 0.0);
        for (row, (a, b)) in set.data.coverage.ant1.iter().zip(&set.data.coverage.ant2).enumerate().filter(|(_, (a, b))| a == b) {
            assert_eq!(a, b);
            for chan in 0..3 {
                let f = set.header.spectrum.freq_hz()[chan];
                let receiver = set.header.layout.receiver_power(*a as usize, unit, f).unwrap();
                let kelvin = if unit == VisUnit::Jy { receiver / jy_per_kelvin_sr(f) } else { receiver };
                assert!((kelvin / (600.0 * omega) - 1.0).abs() < 1e-9, "{kelvin}");
                let (v, z) = (set.data.vis[(row, chan, 0)], quiet.data.vis[(row, chan, 0)]);
                assert_eq!(v.im, 0.0);
                let off = (f64::from(v.re - z.re) - receiver) * f64::from(set.data.weights[(row, chan, 0)]).sqrt();
                // The noise of a total-power radiometer: Tsys / sqrt(B t).
                let sigma = 1.0 / f64::from(set.data.weights[(row, chan, 0)]).sqrt();
                assert!((sigma / (receiver / (2e9_f64 * 0.01).sqrt()) - 1.0).abs() < 1e-5, "{sigma}");
                (sum, squares, count) = (sum + off, squares + off * off, count + 1.0);
            }
        }
        assert_eq!(count, 24.0);
        // 24 deviates of variance 1.
        assert!((sum / 24f64.sqrt()).abs() < 4.0 && (5.0..60.0).contains(&squares), "{sum} {squares}");
    }
}

#[test]
fn gains_multiply_autocorrelations_by_their_power() {
    let pattern: ElementPattern = "gaussian fwhm_deg=9".parse().unwrap();
    let options = SimulateOptions { autos: true, tsys: Some(Temperature(600.0)), ..SimulateOptions::default() };
    let mut set = observed(&pattern, &options, VisUnit::KelvinSr);
    let errors = CorruptOptions {
        seed: 3,
        errors: vec![Error::Amplitude(crate::corrupt::AmplitudeError { rms: 0.3, variation: crate::corrupt::Variation::Constant })],
        per_feed: false,
    };
    let empty = VisibilityBlock::zeros(cittert_arrays::UvCoverage::empty(), 3, 1);
    let mut out = VisibilitySet::new(corrupted_header(&set.header, &errors), empty).unwrap();
    let table = corrupt(&mut set, &mut out, &errors, &Silent).unwrap();
    for (row, a) in out.data.coverage.ant1.iter().enumerate().filter(|(r, a)| **a == out.data.coverage.ant2[*r]) {
        let power = table.gains[(0, *a as usize, 0, 0)].norm_sqr();
        let ratio = f64::from(out.data.vis[(row, 0, 0)].re / set.data.vis[(row, 0, 0)].re);
        assert!((ratio / power - 1.0).abs() < 1e-5, "{ratio} {power}");
        let weights = f64::from(out.data.weights[(row, 0, 0)] / set.data.weights[(row, 0, 0)]);
        assert!((weights * power * power - 1.0).abs() < 1e-4);
    }
    assert_eq!(out.header.layout, set.header.layout, "the statement of the receivers is kept");
}

#[test]
fn what_does_not_go_with_autocorrelations_is_refused() {
    let pattern = ElementPattern::None;
    let go = |options: &SimulateOptions| {
        let antennas = (0..2_u32).map(|k| Antenna::new(format!("A{k}"), k, [f64::from(k), 0.0, 0.0])).collect();
        let layout = ArrayLayout::new("t", LayoutFrame::Boresight, antennas).unwrap();
        let header = options.header(layout, SpectralWindow::band(94e9, 6e9, 1).unwrap(), PhaseCenter::unprojected("b"), VisUnit::KelvinSr);
        Simulator::new(header, &uniform(300.0), options, &Silent).map(|s| s.header().clone()).map_err(|e| e.to_string())
    };
    assert!(pattern.is_none());
    let autos = SimulateOptions { autos: true, ..SimulateOptions::default() };
    let said = go(&SimulateOptions { pedestal: Pedestal::Kelvin(Temperature(290.0)), ..autos.clone() }).unwrap_err();
    assert!(said.contains("pedestal") && said.contains("autos"), "{said}");
    let header = go(&autos).unwrap();
    assert_eq!((header.pedestal_k, header.scene_pedestal_k), (None, Some(0.0)), "total power sees the whole scene");
    assert_eq!(header.antenna_temperature_k, None, "without a pattern no solid angle is known");
}
