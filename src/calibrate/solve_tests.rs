//! Tests of whole solutions on synthetic sets.

use super::*;
use crate::closure::testdata::{Scene, T0_JD, cis, random_phases, worst_phase};
use crate::fixtures::Recorder;
use crate::progress::Silent;
use cittert_arrays::{Polarization, VisibilitySet};
use num_complex::{Complex, Complex64};

const POINT: PointModel = PointModel { flux: 1.0, l: 0.0, m: 0.0 };

fn loose() -> SolveOptions {
    SolveOptions { min_snr: 0.0, solint: SolutionInterval::Infinite, ..SolveOptions::default() }
}

fn gains_at(s: &Solution, t: usize, chan: usize, feed: usize) -> Vec<Complex64> {
    (0..s.gains.layout.n_ant()).map(|a| s.gains.gains[(t, a, chan, feed)]).collect()
}

#[test]
fn noiseless_phases_come_back_from_4_to_200_antennas() {
    for n in [4, 7, 27, 96, 200] {
        let truth: Vec<Complex64> = random_phases(n, 3.1, n as u64).into_iter().map(cis).collect();
        let scene = Scene { sources: vec![(0.0, 0.0, 1.0), (2e-4, -1e-4, 0.6)], ..Scene::point(n, 1) };
        let mut data = scene.set(|_, a, _, _| truth[a]);
        let mut model = scene.set(|_, _, _, _| Complex64::new(1.0, 0.0));
        let s = solve(&mut data, &mut SetModel(&mut model), &loose(), &Silent).unwrap();
        let error = worst_phase(&gains_at(&s, 0, 0, 0), &truth);
        assert!(error < 1e-6, "{n}: {error}");
        assert_eq!((s.report.solved, s.report.not_converged()), (n, 0));
    }
}

#[test]
fn noiseless_amplitudes_come_back_for_each_feed_channel_and_interval() {
    let scene = Scene { n_chan: 3, pols: vec![Polarization::RR, Polarization::LL, Polarization::RL], ..Scene::point(6, 4) };
    let phase = random_phases(1000, 2.0, 3);
    let truth = |t: usize, a: usize, c: usize, f: usize| {
        let i = (((t / 2) * 6 + a) * 3 + c) * 2 + f;
        Complex64::from_polar(1.0 + 0.3 * phase[i + 500].sin(), phase[i])
    };
    let options = SolveOptions {
        mode: GainMode::AmpPhase,
        solint: SolutionInterval::Seconds(20.0),
        channels: ChannelGroups::Channel,
        refant: Some("A2".parse().unwrap()),
        ..loose()
    };
    let s = solve(&mut scene.set(truth), &mut POINT.clone(), &options, &Silent).unwrap();
    assert_eq!(s.gains.gains.dim(), (2, 6, 3, 2));
    assert_eq!(s.gains.feeds, ["R", "L"]);
    for t in 0..2 {
        for c in 0..3 {
            for f in 0..2 {
                let want: Vec<Complex64> = (0..6).map(|a| truth(2 * t, a, c, f)).collect();
                let got = gains_at(&s, t, c, f);
                assert!(worst_phase(&got, &want) < 1e-6);
                assert!(got.iter().zip(&want).all(|(g, w)| (g.norm() / w.norm() - 1.0).abs() < 1e-6));
                assert!(got[2].arg().abs() < 1e-12, "the reference antenna has phase 0");
            }
        }
    }
    assert!((s.gains.time_jd[0] - (T0_JD + 5.0 / 86_400.0)).abs() < 1e-8 && (s.gains.interval_s[1] - 20.0).abs() < 1e-3);
}

#[test]
fn gain_phase_noise_is_sigma_over_s_root_n_minus_1_over_n() {
    let (n, sigma) = (10, 0.2);
    let mut sum = 0.0;
    for seed in 0..500 {
        let mut data = Scene { sigma, seed, ..Scene::point(n, 1) }.set(|_, _, _, _| Complex64::new(1.0, 0.0));
        let s = solve(&mut data, &mut POINT.clone(), &loose(), &Silent).unwrap();
        let g = gains_at(&s, 0, 0, 0);
        let mean: Complex64 = g.iter().sum();
        sum += g.iter().map(|g| (g * mean.conj()).arg().powi(2)).sum::<f64>();
    }
    let rms = (sum / (500.0 * n as f64)).sqrt();
    let expected = sigma * ((n - 1) as f64).sqrt() / n as f64;
    assert!((rms / expected - 1.0).abs() < 0.1, "{rms} against {expected}");
}

#[test]
fn delays_come_back_over_the_band() {
    let scene = Scene { n_chan: 16, sigma: 1e-3, ..Scene::point(8, 2) };
    let (phase, delay) = (random_phases(8, 3.0, 5), random_phases(8, 100e-9, 6));
    let gain = |a: usize, c: usize| cis(phase[a] + std::f64::consts::TAU * delay[a] * 2e6 * c as f64);
    let s = solve(
        &mut scene.set(|_, a, c, _| gain(a, c)),
        &mut POINT.clone(),
        &SolveOptions { mode: GainMode::Delay, solint: SolutionInterval::Infinite, ..SolveOptions::default() },
        &Silent,
    )
    .unwrap();
    assert_eq!(s.gains.gains.dim(), (1, 8, 16, 1));
    for c in 0..16 {
        let want: Vec<Complex64> = (0..8).map(|a| gain(a, c)).collect();
        assert!(worst_phase(&gains_at(&s, 0, c, 0), &want) < 2e-3, "{c}");
    }
    assert!(
        solve(
            &mut Scene::point(8, 1).set(|_, _, _, _| cis(0.0)),
            &mut POINT.clone(),
            &SolveOptions { mode: GainMode::Delay, ..loose() },
            &Silent
        )
        .is_err()
    );
}

#[test]
fn robust_weights_resist_bad_samples() {
    let scene = Scene { sigma: 0.05, ..Scene::point(8, 12) };
    let truth: Vec<Complex64> = random_phases(8, 3.0, 8).into_iter().map(cis).collect();
    let mut data = scene.set(|_, a, _, _| truth[a]);
    // Interference in one twentieth of the samples.
    for row in (0..data.data.n_rows()).step_by(20) {
        data.data.vis[(row, 0, 0)] = Complex::new(30.0, -20.0);
    }
    let run = |outliers, outlier_scale| {
        let s = solve(&mut data.clone(), &mut POINT.clone(), &SolveOptions { outliers, outlier_scale, ..loose() }, &Silent).unwrap();
        worst_phase(&gains_at(&s, 0, 0, 0), &truth)
    };
    let plain = run(Outliers::None, 3.0);
    for (robust, scale) in [(Outliers::Student, 3.0), (Outliers::Huber, 2.0)] {
        let error = run(robust, scale);
        assert!(error < 0.05 && plain > 3.0 * error, "{robust:?}: {error} against {plain}");
    }
}

fn flagged(mut set: VisibilitySet, bad: impl Fn(usize, usize, usize) -> bool) -> VisibilitySet {
    for row in 0..set.data.n_rows() {
        let c = &set.data.coverage;
        if bad(row, c.ant1[row] as usize, c.ant2[row] as usize) {
            set.data.flags.index_axis_mut(ndarray::Axis(0), row).fill(true);
        }
    }
    set
}

#[test]
fn an_antenna_without_data_is_flagged_and_counted() {
    let mut data = flagged(Scene::point(7, 2).set(|_, _, _, _| cis(0.3)), |_, p, q| p == 3 || q == 3);
    let s = solve(&mut data, &mut POINT.clone(), &loose(), &Silent).unwrap();
    assert!(s.gains.flags[(0, 3, 0, 0)] && !s.gains.flags[(0, 2, 0, 0)]);
    assert_eq!(s.report.flagged[&FlagReason::NoData], 1);
    assert_eq!(s.report.samples.flagged, 12);
}

#[test]
fn separate_subarrays_leave_the_larger() {
    let mut data = flagged(Scene::point(12, 1).set(|_, _, _, _| cis(0.0)), |_, p, q| (p < 5) != (q < 5));
    let s = solve(&mut data, &mut POINT.clone(), &loose(), &Silent).unwrap();
    assert_eq!(s.report.flagged[&FlagReason::Disconnected], 5);
    assert_eq!(s.report.solved, 7);
}

#[test]
fn another_reference_takes_over_without_a_jump() {
    let scene = Scene::point(8, 3);
    let phase = random_phases(24, 0.4, 4);
    let mut data =
        flagged(scene.set(|t, a, _, _| cis(phase[a] + 0.01 * t as f64 * a as f64)), |row, p, q| row / 28 == 1 && (p == 0 || q == 0));
    let options = SolveOptions { solint: SolutionInterval::Integration, refant: Some("A0".parse().unwrap()), ..loose() };
    let s = solve(&mut data, &mut POINT.clone(), &options, &Silent).unwrap();
    assert_eq!((s.gains.refant, s.report.refant_fallbacks), (Some(0), 1));
    assert!(s.gains.flags[(1, 0, 0, 0)]);
    for a in 1..8 {
        let jump = (s.gains.gains[(1, a, 0, 0)] * s.gains.gains[(0, a, 0, 0)].conj()).arg();
        assert!(jump.abs() < 0.08, "{a}: {jump}");
    }
    // A reference antenna that never has data is replaced in all intervals, with a warning.
    let mut data = flagged(scene.set(|_, _, _, _| cis(0.0)), |_, p, q| p == 0 || q == 0);
    let told = Recorder::default();
    let s = solve(&mut data, &mut POINT.clone(), &options, &told).unwrap();
    assert_ne!(s.gains.refant, Some(0));
    assert!(told.messages().iter().any(|m| m.contains("A0")), "{:?}", told.messages());
}

#[test]
fn weak_antennas_are_flagged_by_their_signal_to_noise() {
    let scene = Scene { sigma: 0.3, ..Scene::point(9, 1) };
    let mut data = scene.set(|_, a, _, _| Complex64::new(if a == 4 { 0.01 } else { 1.0 }, 0.0));
    let s = solve(
        &mut data,
        &mut POINT.clone(),
        &SolveOptions { min_snr: 5.0, solint: SolutionInterval::Infinite, ..SolveOptions::default() },
        &Silent,
    )
    .unwrap();
    assert!(s.gains.flags[(0, 4, 0, 0)], "{:?}", s.gains.quality);
    assert_eq!(s.report.solved, 8);
    let snr = s.gains.quality.as_ref().unwrap()[(0, 0, 0, 0)];
    // Seven good baselines of S/sigma 3.3 give 8.8 on average.
    assert!((5.0..13.0).contains(&snr), "{snr}");
}

#[test]
fn hopeless_inputs_give_one_clear_error() {
    let scene = Scene::point(6, 2);
    let good = || scene.set(|_, _, _, _| cis(0.0));
    let message = |mut d: VisibilitySet, mut m: PointModel, o: SolveOptions| solve(&mut d, &mut m, &o, &Silent).unwrap_err().to_string();
    assert!(message(Scene::point(1, 1).set(|_, _, _, _| cis(0.0)), POINT, loose()).contains("at least 2 antennas"));
    assert!(message(flagged(good(), |_, _, _| true), POINT, loose()).contains("30 samples are flagged"));
    assert!(message(good(), PointModel { flux: 0.0, ..POINT }, loose()).contains("zero on every baseline"));
    assert!(message(good(), PointModel { flux: f64::NAN, ..POINT }, loose()).contains("point model"));
    let short = SolveOptions { solint: SolutionInterval::Seconds(1.0), ..loose() };
    assert!(message(good(), POINT, short).contains("solint"));
    let mut nan = good();
    nan.data.vis.fill(Complex::new(f32::NAN, 0.0));
    assert!(message(nan, POINT, loose()).contains("30 not finite"));
    let noise = Scene { sigma: 50.0, ..Scene::point(6, 1) }.set(|_, _, _, _| cis(0.0));
    assert!(message(noise, POINT, SolveOptions { min_snr: 30.0, ..loose() }).contains("low signal to noise"));
}

#[test]
fn samples_that_are_not_numbers_are_counted_and_left_out() {
    let mut data = Scene::point(6, 2).set(|_, a, _, _| cis(0.1 * a as f64));
    data.data.vis[(0, 0, 0)].re = f32::NAN;
    data.data.weights[(1, 0, 0)] = f32::INFINITY;
    let s = solve(&mut data, &mut POINT.clone(), &loose(), &Silent).unwrap();
    assert_eq!((s.report.samples.not_finite, s.report.samples.used), (2, 28));
    assert_eq!(s.report.solved, 6);
}

#[test]
fn rows_in_the_other_antenna_order_mean_the_same() {
    let truth: Vec<Complex64> = random_phases(6, 3.0, 2).into_iter().map(cis).collect();
    let mut data = Scene { sources: vec![(3e-4, 1e-4, 1.0)], ..Scene::point(6, 1) }.set(|_, a, _, _| truth[a]);
    let c = &mut data.data.coverage;
    for row in 0..15 {
        if row % 2 == 0 {
            (c.ant1[row], c.ant2[row]) = (c.ant2[row], c.ant1[row]);
            c.uvw_m.row_mut(row).mapv_inplace(|x| -x);
            data.data.vis[(row, 0, 0)] = data.data.vis[(row, 0, 0)].conj();
        }
    }
    let s = solve(&mut data, &mut PointModel { flux: 1.0, l: 3e-4, m: 1e-4 }, &loose(), &Silent).unwrap();
    assert!(worst_phase(&gains_at(&s, 0, 0, 0), &truth) < 1e-6);
}
