//! Self-calibration by held-out baselines: what it accepts and what it leaves alone.

use super::*;
use crate::closure::testdata::{Scene, cis, random_phases};
use crate::deconvolve::{CleanOptions, by_name};
use crate::imaging::{ImageSize, ImagingOptions, Weighting};
use crate::progress::Silent;
use cittert_arrays::quantity::Angle;
use cittert_arrays::{VisUnit, VisibilitySet, VisibilitySource};

const CELL: f64 = 4e-5;
const ANTENNAS: usize = 18;

fn scene(sigma: f64, seed: u64) -> Scene {
    Scene {
        n_chan: 2,
        sources: vec![(4.0 * CELL, -6.0 * CELL, 1.0), (-9.0 * CELL, 3.0 * CELL, 0.5), (12.0 * CELL, 11.0 * CELL, 0.2)],
        sigma,
        seed,
        integration_s: 300.0,
        ..Scene::point(ANTENNAS, 6)
    }
}

fn options() -> CandidateOptions {
    let imaging = ImagingOptions {
        size: Some(ImageSize::square(64)),
        cell: Some(Angle(CELL)),
        weighting: Weighting::Natural,
        ..ImagingOptions::default()
    };
    let clean = CleanOptions { algorithm: by_name("hogbom").unwrap().into(), niter: 1500, nsigma: 3.0, ..CleanOptions::default() };
    let solve = SolveOptions { solint: SolutionInterval::Infinite, ..SolveOptions::default() };
    CandidateOptions::new(imaging, clean, solve, RoundOptions { rounds: 5, ..RoundOptions::default() }, VisUnit::Jy)
}

/// Calibrate; returns the result with the rms phase errors before and after.
fn judged(data: &mut VisibilitySet, phase: &[f64], of: &CandidateOptions, judging: &JudgeOptions) -> (Calibrated, f64, f64) {
    let (out, maker) = calibrate(data, &candidates(of).unwrap(), Beginning::Data, judging, &Silent).unwrap();
    assert!(maker.products().is_some());
    let mut truth = out.gains.clone();
    truth.gains.indexed_iter_mut().for_each(|((_, a, _, _), g)| *g = cis(phase[a]));
    let mut unity = truth.clone();
    unity.gains.fill(1.0.into());
    let free = CompareOptions { gradient: true, flux_scale: false };
    let rms = |table| compare_gains(table, &truth, free).unwrap().rms_phase_rad;
    let (before, after) = (rms(&unity), rms(&out.gains));
    (out, before, after)
}

fn phases(rms: f64, seed: u64) -> Vec<f64> {
    random_phases(ANTENNAS, rms * 3.0_f64.sqrt(), seed)
}

#[test]
fn errors_that_a_good_model_shows_are_calibrated_away() {
    for (rms, seed) in [(0.1, 1), (0.5, 2), (1.0, 3)] {
        let phase = phases(rms, seed);
        let mut data = scene(0.05, seed).set(|_, a, _, _| cis(phase[a]));
        let (out, before, after) = judged(&mut data, &phase, &options(), &JudgeOptions::default());
        assert_eq!(out.verdict, Verdict::Accepted, "{rms}: {:?}", out.evidence);
        assert!(after < 0.05 * before + 0.005, "{rms}: {before} to {after}");
        let e = out.evidence.unwrap();
        assert!(e.after < 0.1 * e.before && e.gain_sigma < 0.2 * e.gain_rms, "{e:?}");
    }
}

#[test]
fn data_without_errors_are_left_as_they_are() {
    for seed in 0..5 {
        let mut data = scene(0.3, seed).set(|_, _, _, _| cis(0.0));
        let (out, _, after) = judged(&mut data, &[0.0; ANTENNAS], &options(), &JudgeOptions::default());
        assert!(matches!(out.verdict, Verdict::Rejected(_)) && after == 0.0, "{seed}: {after} {:?}", out.evidence);
        assert!(out.gains.gains.iter().all(|g| *g == 1.0.into()) && !out.gains.flags.iter().any(|f| *f));
        assert!(out.rounds.warnings.iter().any(|w| w.contains("not accepted")), "{:?}", out.rounds.warnings);
    }
}

#[test]
fn noise_is_left_as_it_is_unless_it_is_forced() {
    let phase = phases(0.5, 9);
    let mut noise = Scene { sources: Vec::new(), ..scene(1.0, 4) }.set(|_, a, _, _| cis(phase[a]));
    let (out, before, after) = judged(&mut noise, &phase, &options(), &JudgeOptions::default());
    assert!(matches!(out.verdict, Verdict::Rejected(_)), "{:?}", out.evidence);
    assert_eq!(before, after);
    let forced = judged(&mut noise, &phase, &options(), &JudgeOptions { force: true, ..JudgeOptions::default() }).0;
    assert!(matches!(forced.verdict, Verdict::Forced(_)) && forced.gains.gains.iter().any(|g| *g != 1.0.into()));
}

#[test]
fn a_smooth_thermal_scene_chooses_the_joint_solution() {
    let mut of = options();
    of.clean.algorithm = crate::deconvolve::Algorithm::Auto;
    of.unit = VisUnit::KelvinSr;
    let names: Vec<&str> = candidates(&of).unwrap().iter().map(|c| c.name).collect();
    assert_eq!(names, ["mem", "multiscale", "hogbom"]);
    of.unit = VisUnit::Jy;
    of.solve.mode = GainMode::Delay;
    let names: Vec<&str> = candidates(&of).unwrap().iter().map(|c| c.name).collect();
    assert_eq!(names, ["hogbom", "multiscale"]);
}

#[test]
fn three_antennas_are_not_judged() {
    let mut data = Scene { sigma: 0.01, ..Scene::point(3, 1) }.set(|_, a, _, _| cis(0.2 * a as f64));
    let (out, _) = calibrate(&mut data, &candidates(&options()).unwrap(), Beginning::Point, &JudgeOptions::default(), &Silent).unwrap();
    assert_eq!(out.verdict, Verdict::NotJudged);
    assert!(out.evidence.is_none() && out.rounds.warnings.iter().any(|w| w.contains("too few baselines")));
}

#[test]
fn without_held_out_baselines_the_best_round_is_applied() {
    let phase = phases(0.5, 6);
    let mut data = scene(0.05, 6).set(|_, a, _, _| cis(phase[a]));
    let (out, _, after) = judged(&mut data, &phase, &options(), &JudgeOptions { fraction: 0.0, ..JudgeOptions::default() });
    assert_eq!((&out.verdict, out.evidence), (&Verdict::NotJudged, None));
    assert!(after < 0.02 && out.rounds.rounds.iter().all(|r| r.prediction.is_none()), "{after}");
}

#[test]
fn held_out_baselines_are_flagged_and_every_antenna_keeps_most_of_its_own() {
    let mut data = scene(0.1, 1).set(|_, _, _, _| cis(0.0));
    let options = JudgeOptions::default();
    let held = HeldOut::draw(&mut data, &options, 4).unwrap().unwrap();
    assert_eq!(held.n_baselines(), (0.15_f64 * 153.0).ceil() as usize);
    let rows = data.n_rows();
    let block = Without::new(&mut data, Some(&held)).read_rows(0..rows).unwrap();
    let flagged: Vec<usize> = (0..rows).filter(|r| block.flags.index_axis(ndarray::Axis(0), *r).iter().all(|f| *f)).collect();
    assert_eq!(flagged.len(), held.n_baselines() * 6);
    for ant in 0..ANTENNAS as u32 {
        let lost = flagged.iter().filter(|r| block.coverage.ant1[**r] == ant || block.coverage.ant2[**r] == ant).count() / 6;
        assert!(lost <= 5, "antenna {ant} lost {lost} of 17 baselines");
    }
    assert_eq!(held, HeldOut::draw(&mut data, &options, 4).unwrap().unwrap(), "the same seed");
    assert_ne!(held, HeldOut::draw(&mut data, &JudgeOptions { seed: 2, ..options }, 4).unwrap().unwrap());
}

#[test]
fn the_true_model_and_gains_leave_only_noise() {
    let phase = phases(0.5, 3);
    let clean = scene(0.0, 1).set(|_, _, _, _| cis(0.0));
    let mut data = scene(0.1, 1).set(|_, a, _, _| cis(phase[a]));
    let held = HeldOut::draw(&mut data, &JudgeOptions::default(), 4).unwrap().unwrap();
    let h = data.header.clone();
    let (mid, length) = (data.data.coverage.time_jd[0], 1e6);
    let mut gains = cittert_arrays::GainTable::unity(h.layout, h.spectrum, vec!["I".into()], vec![mid], vec![length]).unwrap();
    gains.gains.indexed_iter_mut().for_each(|((_, a, _, _), g)| *g = cis(phase[a]));
    let mut model = clean.clone();
    let mut predict = |gains| Prediction::of(&mut data, &held, &mut SetModel(&mut model), gains, ApplyOptions::default(), 1.0).unwrap();
    let (right, wrong) = (predict(Some(&gains)), predict(None));
    assert!((right.over_noise() - 1.0).abs() < 0.15 && right.misfit() < 0.01, "{} {}", right.over_noise(), right.misfit());
    // Two antennas of 0.5 rad rms each: 2 (1 - exp(-0.25)) of the power.
    assert!((wrong.misfit() - 0.44).abs() < 0.15, "{}", wrong.misfit());
    assert!(right.better_than(&wrong) > 3.0 && wrong.better_than(&right) < -3.0);
}
