//! Self-calibration end to end with the imager's CLEAN.

use super::*;
use crate::closure::testdata::{Scene, cis, random_phases};
use crate::deconvolve::by_name;
use crate::imaging::major::CleanOptions;
use crate::imaging::{ImageSize, ImagingOptions, Weighting};
use crate::progress::Silent;
use cittert_arrays::quantity::Angle;
use cittert_arrays::{Polarization, VisibilitySource};
use ndarray::Axis;
use num_complex::Complex64;

const CELL: f64 = 4e-5;

fn scene() -> Scene {
    Scene {
        n_chan: 3,
        pols: vec![Polarization::RR, Polarization::LL, Polarization::RL],
        sources: vec![(4.0 * CELL, -6.0 * CELL, 1.0), (-9.0 * CELL, 3.0 * CELL, 0.3), (12.0 * CELL, 11.0 * CELL, 0.05)],
        sigma: 0.05,
        integration_s: 300.0,
        ..Scene::point(18, 6)
    }
}

fn maker() -> CleanMaker {
    let imaging = ImagingOptions {
        size: Some(ImageSize::square(64)),
        cell: Some(Angle(CELL)),
        weighting: Weighting::Natural,
        ..ImagingOptions::default()
    };
    let clean = CleanOptions { algorithm: by_name("hogbom").unwrap().into(), niter: 1500, nsigma: 3.0, ..CleanOptions::default() };
    CleanMaker::new(imaging, clean)
}

#[test]
fn half_a_radian_of_phase_is_calibrated_away() {
    let phase = random_phases(108, 0.5 * 3.0_f64.sqrt(), 11);
    let mut data = scene().set(|t, a, _, _| cis(phase[t * 18 + a]));
    let mut o = SelfcalOptions::new(GainMode::Phase, SolutionInterval::Integration, 5);
    o.solve.feeds = FeedGroups::Joined;
    let mut m = maker();
    let out = selfcal(&mut data, &mut m, Start::Data, &o, None, &Silent).unwrap();
    let plan = RoundPlan { last: true, ..o.schedule[4] };
    let (before, best) = (out.before.unwrap(), out.final_metrics());
    let ideal = maker().update(&mut scene().set(|_, _, _, _| cis(0.0)), &plan, &Silent).unwrap();
    assert!(best.residual_rms < 1.5 * ideal.residual_rms, "{best:?} {ideal:?}");
    assert!(best.dynamic_range() > 0.7 * ideal.dynamic_range() && best.dynamic_range() > 5.0 * before.dynamic_range());
    assert!(out.warnings.is_empty(), "{:?}", out.warnings);
    let mut truth = out.best().gains.clone();
    truth.gains.indexed_iter_mut().for_each(|((t, a, _, _), g)| *g = cis(phase[t * 18 + a]));
    let c = compare_gains(&out.best().gains, &truth, CompareOptions { gradient: true, flux_scale: false }).unwrap();
    // Six parallel-hand samples a baseline: sigma/S sqrt(N - 1)/N / sqrt(6) is 0.005 rad, and a little more for the model.
    assert!(c.rms_phase_rad < 0.01, "{c:?}");
    assert!(m.products().unwrap().components.len() > 2);
    // Some rows are predicted as they are among all, from kept predictions and from new ones.
    let (header, coverage) = (data.header().clone(), data.read_coverage(0..40).unwrap());
    let all = m.predict(&header, 0, &coverage).unwrap();
    let some = [3, 4, 17, 39];
    assert_eq!(m.predict_some(&header, (0, &coverage), &some).unwrap(), all.select(Axis(0), &some));
    let later = data.read_coverage(7..40).unwrap();
    assert_eq!(m.predict_some(&header, (7, &later), &[0, 32]).unwrap(), all.select(Axis(0), &[7, 39]));
    assert_eq!(m.predict_some(&header, (0, &coverage), &[]).unwrap().dim(), (0, 3, 3));
}

#[test]
fn the_prediction_is_the_direct_sum_of_the_model() {
    let scene = Scene { sources: vec![(4.0 * CELL, -6.0 * CELL, 1.0)], sigma: 0.0, ..scene() };
    let mut data = scene.set(|_, _, _, _| Complex64::new(1.0, 0.0));
    let mut m = maker();
    let plan = RoundPlan { mode: GainMode::Phase, solint: SolutionInterval::Infinite, depth: 0.0, last: true };
    assert!(m.predict(&data.header, 0, &data.data.coverage).unwrap_err().to_string().contains("no model yet"));
    m.update(&mut data, &plan, &Silent).unwrap();
    let mut block = data.read_rows(0..200).unwrap();
    block.coverage.uvw_m[(7, 1)] = f64::NAN;
    let vis = m.predict(&data.header, 0, &block.coverage).unwrap();
    let p = m.products().unwrap();
    let mut expected = Complex64::new(0.0, 0.0);
    let k = std::f64::consts::TAU * data.header.spectrum.freq_hz()[2] / cittert_arrays::SPEED_OF_LIGHT_M_S;
    for ((j, i), v) in p.model.data.index_axis(Axis(0), 0).index_axis(Axis(0), 0).indexed_iter().filter(|(_, v)| **v != 0.0) {
        let (l, mm) = (p.model.grid.l_at(i as f64), p.model.grid.m_at(j as f64));
        expected += Complex64::from_polar(*v, k * (block.coverage.uvw_m[(50, 0)] * l + block.coverage.uvw_m[(50, 1)] * mm));
    }
    for pol in 0..2 {
        let found = Complex64::new(vis[(50, 2, pol)].re.into(), vis[(50, 2, pol)].im.into());
        assert!((found - expected).norm() < 1e-4 * expected.norm(), "{found} {expected}");
    }
    assert_eq!(vis[(50, 2, 2)].norm(), 0.0, "cross hands of an unpolarised model are empty");
    assert!(vis[(7, 0, 0)].re.is_nan(), "a row without a place has no model");
}

#[test]
fn the_best_images_come_back() {
    let mut data = scene().set(|_, _, _, _| cis(0.0));
    let mut m = maker();
    let plan = |depth, last| RoundPlan { mode: GainMode::Phase, solint: SolutionInterval::Infinite, depth, last };
    m.update(&mut data, &plan(0.2, false), &Silent).unwrap();
    let kept = m.products().unwrap().statistics.model_flux;
    m.remember();
    m.update(&mut data, &plan(0.0, true), &Silent).unwrap();
    assert!(m.products().unwrap().statistics.model_flux > kept * 1.02);
    m.recall();
    assert_eq!(m.products().unwrap().statistics.model_flux, kept);
}
