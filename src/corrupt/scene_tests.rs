//! Tests of the errors that need the scene.

use super::*;
use crate::progress::Silent;
use crate::simulate::{SimulateOptions, SkyModel, simulate_set};
use cittert_arrays::{
    Antenna, ArrayLayout, BrightnessUnit, Image, LayoutFrame, PhaseCenter, Polarization, SkyFrame, SkyGrid, SpectralWindow, UvCoverage,
    VisUnit, VisibilitySet,
};
use ndarray::{Array2, Array4};

fn scene() -> SkyModel {
    let grid = SkyGrid::new(24, 24, 0.01, SkyFrame::Boresight).unwrap();
    let band = SpectralWindow::band(94e9, 6e9, 1).unwrap();
    let data = Array4::from_shape_fn((1, 1, 24, 24), |(_, _, r, c)| 200.0 + ((r * 31 + c * 17) % 100) as f64);
    SkyModel::of_image(Image::new(grid, band, vec![Polarization::I], data, BrightnessUnit::Kelvin).unwrap())
}

fn set() -> VisibilitySet {
    let at = |k: u32| [0.02 * f64::from(k * k), 0.03 * f64::from(k), 0.0];
    let antennas = (0..5).map(|k| Antenna::new(format!("A{k}"), k, at(k)));
    let mut layout = ArrayLayout::new("t", LayoutFrame::Boresight, antennas.collect()).unwrap();
    layout.pattern = "gaussian fwhm_deg=9".parse().unwrap();
    let pairs: Vec<(u32, u32)> = (0..5).flat_map(|a| (a + 1..5).map(move |b| (a, b))).collect();
    let n = pairs.len();
    let uvw = Array2::from_shape_fn((2 * n, 3), |(r, k)| at(pairs[r % n].1)[k] - at(pairs[r % n].0)[k]);
    let (a, b) = (0..2 * n).map(|r| pairs[r % n]).unzip();
    let time = |r: usize| 2_460_000.5 + (r / n) as f64 * 60.0 / 86_400.0;
    let rows = UvCoverage::new(uvw, a, b, (0..2 * n).map(time).collect(), vec![60.0; 2 * n], vec![0; 2 * n]).unwrap();
    let spectrum = SpectralWindow::band(94e9, 6e9, 2).unwrap();
    let header = SimulateOptions::default().header(layout, spectrum, PhaseCenter::unprojected("b"), VisUnit::KelvinSr);
    simulate_set(header, &rows, &scene(), &SimulateOptions::default(), &Silent).unwrap()
}

fn put(set: &VisibilitySet, errors: Vec<Error>, scene: Option<&SkyModel>) -> crate::Result<(VisibilitySet, Truth)> {
    let mut out = VisibilitySet::new(set.header.clone(), set.data.rows(0..0).unwrap()).unwrap();
    let options = CorruptOptions { seed: 4, errors, per_feed: false };
    let truth = corrupt_with(&mut set.clone(), &mut out, &options, scene, &Silent)?;
    Ok((out, truth))
}

fn pointing(rms_rad: f64, variation: Variation) -> Error {
    Error::Pointing(PointingError { rms_rad, variation })
}

#[test]
fn corrupted_data_are_those_that_a_simulation_with_the_errors_makes() {
    let (set, sky) = (set(), scene());
    let all = vec![
        pointing(0.02, Variation::Integration),
        Error::Width(WidthError { rms: 0.1 }),
        Error::Band(BandError { shape: "gaussian".parse().unwrap(), offset_rms_hz: 2e8, width_rms: 0.1 }),
    ];
    let (out, truth) = put(&set, all, Some(&sky)).unwrap();
    let mut header = set.header.clone();
    header.history.clear();
    let simulator = crate::simulate::Simulator::new(header, &sky, &SimulateOptions::default(), &Silent).unwrap();
    let direct = truth.scene.put_into(simulator).unwrap().block(set.data.coverage.clone(), 0, &Silent).unwrap();
    let top = set.data.vis.iter().map(|v| v.norm()).fold(0.0, f32::max);
    let change = out.data.vis.iter().zip(&set.data.vis).map(|(a, b)| (a - b).norm()).fold(0.0, f32::max);
    assert!(change > 0.02 * top, "{change} of {top}");
    let worst = out.data.vis.iter().zip(&direct.vis).map(|(a, b)| (a - b).norm()).fold(0.0, f32::max);
    assert!(worst < 1e-6 * top, "{worst} of {top}");
    assert!(truth.gains.gains.iter().all(|g| *g == 1.0.into()), "these errors are no gains");
    let p = truth.scene.pointings.unwrap();
    assert_ne!(p.antennas[[0, 1]].l, p.antennas[[1, 1]].l, "a draw for each integration");
    assert_eq!(p.antennas[[0, 1]].width, p.antennas[[1, 1]].width, "widths do not change in time");
    assert!(truth.scene.receivers.unwrap().of.iter().all(|r| r.offset_hz != 0.0 && r.width != 1.0));
}

#[test]
fn errors_of_no_size_change_nothing_and_the_scene_must_be_given() {
    let (set, sky) = (set(), scene());
    let (out, truth) = put(&set, vec![pointing(0.0, Variation::Constant)], Some(&sky)).unwrap();
    assert_eq!((out.data.vis, truth.scene), (set.data.vis.clone(), SceneErrors::default()));
    let e = put(&set, vec![pointing(0.01, Variation::Constant)], None).unwrap_err().to_string();
    assert!(e.contains("scene") && e.contains("pointing"), "{e}");
    let mut bare = set.clone();
    bare.header.layout.pattern = "none".parse().unwrap();
    let e = put(&bare, vec![pointing(0.01, Variation::Constant)], Some(&sky)).unwrap_err().to_string();
    assert!(e.contains("need a pattern"), "{e}");
}

#[test]
fn pointings_have_the_stated_rms_along_each_axis_and_drift_with_their_variation() {
    let set = set();
    let (mut sum, mut cross) = (0.0, 0.0);
    let n = 400;
    for seed in 0..n {
        let options = CorruptOptions { seed, errors: vec![pointing(0.01, Variation::Constant)], per_feed: false };
        let rows = set.data.coverage.clone();
        let p = true_scene_errors(&set.header, &mut std::iter::once(Ok(rows)), &options).unwrap().pointings.unwrap();
        assert_eq!(p.antennas.row(0), p.antennas.row(1));
        sum += p.antennas.row(0).iter().map(|p| p.l * p.l + p.m * p.m).sum::<f64>();
        cross += p.antennas.row(0).iter().map(|p| p.l * p.m).sum::<f64>();
    }
    // 4000 normal numbers: the variance has an error of 2.2 % (one sigma).
    let draws = 10.0 * n as f64;
    assert!((sum / draws / 1e-4 - 1.0).abs() < 0.09, "{}", sum / draws);
    assert!((cross / draws / 1e-4).abs() < 0.09);
}

#[test]
fn jitter_is_a_gain_of_every_antenna() {
    let (out, truth) = put(&set(), vec![Error::Jitter(JitterError { rms_s: 3e-13, sampler_hz: None })], None).unwrap();
    let f = set().header.spectrum.freq_hz()[1];
    let loss = (-(std::f64::consts::TAU * f * 3e-13).powi(2)).exp();
    assert!((truth.gains.gains[[0, 0, 1, 0]].norm_sqr() - loss).abs() < 1e-12);
    let (a, b) = (out.data.vis[[0, 1, 0]].norm(), set().data.vis[[0, 1, 0]].norm());
    assert!((f64::from(a / b) - loss).abs() < 1e-6);
}

#[test]
fn jitter_leaves_the_power_of_an_autocorrelation() {
    let mut with_auto = set();
    with_auto.data.coverage.ant2[0] = with_auto.data.coverage.ant1[0];
    let out = put(&with_auto, vec![Error::Jitter(JitterError { rms_s: 3e-13, sampler_hz: None })], None).unwrap().0;
    for chan in 0..2 {
        let change = out.data.vis[[0, chan, 0]] - with_auto.data.vis[[0, chan, 0]];
        assert!(change.norm() < 1e-6 * with_auto.data.vis[[0, chan, 0]].norm());
        assert!((out.data.weights[[0, chan, 0]] / with_auto.data.weights[[0, chan, 0]] - 1.0).abs() < 1e-6);
        assert!(out.data.vis[[1, chan, 0]].norm() < 0.99 * with_auto.data.vis[[1, chan, 0]].norm());
    }
}
