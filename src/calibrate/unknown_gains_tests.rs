use super::options::{FeedGroups, GainMode, SolveOptions};
use super::unknown_gains::UnknownGains;
use super::unknown_gains_builder::UnknownGainsBuilder;
use crate::ChainError;
use crate::closure::SolutionInterval;
use crate::closure::testdata::{Scene, cis, random_phases};
use crate::fixtures::in_processes;
use crate::misfit::VisibilityTerm;
use crate::misfit::check::gradient_error;
use cittert_arrays::{Polarization, SPEED_OF_LIGHT_M_S, VisibilitySet, VisibilitySource};
use num_complex::{Complex32, Complex64};
use std::f64::consts::TAU;

fn scene() -> Scene {
    Scene {
        n_ant: 7,
        n_time: 3,
        n_chan: 2,
        pols: vec![Polarization::RR, Polarization::LL],
        integration_s: 10.0,
        sources: vec![(0.0, 0.0, 1.0), (3e-5, -2e-5, 0.6)],
        sigma: 0.02,
        seed: 3,
    }
}

fn term(set: &VisibilitySet, options: &SolveOptions) -> UnknownGains {
    let mut builder = UnknownGainsBuilder::new(&set.header, options).unwrap();
    let taken = builder.add(&set.data).unwrap();
    assert_eq!(taken.len(), set.data.n_rows());
    builder.finish().unwrap()
}

/// The model of the scene, with its sources moved, and u, v in wavelengths \[n\].
fn model(set: &VisibilitySet, sources: &[(f64, f64, f64)]) -> (Vec<Complex64>, Vec<f64>, Vec<f64>) {
    let mut out = (Vec::new(), Vec::new(), Vec::new());
    for uvw in set.data.coverage.uvw_m.rows() {
        for f in set.header.spectrum.freq_hz() {
            let (u, v) = (uvw[0] * f / SPEED_OF_LIGHT_M_S, uvw[1] * f / SPEED_OF_LIGHT_M_S);
            out.0.push(sources.iter().map(|(l, m, s)| Complex64::from_polar(*s, TAU * (u * l + v * m))).sum());
            out.1.push(u);
            out.2.push(v);
        }
    }
    out
}

#[test]
fn the_gradient_is_that_of_chi_squared_at_the_best_gains() {
    let phases = random_phases(7 * 2, 3.0, 5);
    let set = scene().set(|_, p, _, f| cis(phases[2 * p + f]));
    let (mut wrong, ..) = model(&set, &[(0.0, 0.0, 0.8), (1e-5, 0.0, 0.3)]);
    wrong.iter_mut().enumerate().for_each(|(i, m)| *m += Complex64::from_polar(0.1, i as f64));
    for mode in [GainMode::Phase, GainMode::AmpPhase] {
        for feeds in [FeedGroups::PerFeed, FeedGroups::Joined] {
            let t = term(&set, &SolveOptions { mode, feeds, solint: SolutionInterval::Seconds(20.0), ..SolveOptions::default() });
            let error = gradient_error(&t, &wrong);
            assert!(error < 1e-6, "{mode:?} {feeds:?} {error}");
        }
    }
}

#[test]
fn the_gradient_holds_with_gains_that_are_expected_near_unity() {
    let phases = random_phases(7 * 2, 0.6, 8);
    let set = scene().set(|_, p, _, f| cis(phases[2 * p + f]));
    let (wrong, ..) = model(&set, &[(0.0, 0.0, 0.8), (1e-5, 0.0, 0.3)]);
    for mode in [GainMode::Phase, GainMode::AmpPhase] {
        let t = term(&set, &SolveOptions { mode, solint: SolutionInterval::Seconds(20.0), ..SolveOptions::default() });
        for weight in [3.0, 300.0, 3e5] {
            t.restart();
            t.expect_unity(weight);
            let error = gradient_error(&t, &wrong);
            assert!(error < 1e-5, "{mode:?} {weight} {error}");
        }
    }
}

#[test]
fn gains_stay_at_unity_as_far_as_they_are_expected_there() {
    let phases = random_phases(7, 0.6, 9);
    let set = scene().set(|_, p, _, _| cis(phases[p]));
    let (truth, ..) = model(&set, &scene().sources);
    let options = SolveOptions { feeds: FeedGroups::Joined, solint: SolutionInterval::Infinite, ..SolveOptions::default() };
    let rms = |weight| {
        let t = term(&set, &options);
        t.expect_unity(weight);
        t.fit(&truth);
        t.rms_from_unity()
    };
    let mean = phases.iter().sum::<f64>() / 7.0;
    let true_rms = (phases.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / 7.0).sqrt();
    assert!((rms(1e-3) / true_rms - 1.0).abs() < 0.05, "{} {true_rms}", rms(1e-3));
    assert!(rms(1e12) < 1e-6, "{}", rms(1e12));
    let between = rms(1e5);
    assert!(between > 1e-3 && between < 0.9 * true_rms, "{between} {true_rms}");
}

#[test]
fn with_the_true_model_chi_squared_is_the_number_of_data_and_the_gains_are_taken_out() {
    let phases = random_phases(7 * 2, 3.0, 6);
    let mut s = scene();
    s.n_time = 40;
    let set = s.set(|_, p, _, f| cis(phases[2 * p + f]) * (1.0 + 0.05 * p as f64));
    let (truth, ..) = model(&set, &s.sources);
    let t = term(&set, &SolveOptions { mode: GainMode::AmpPhase, solint: SolutionInterval::Infinite, ..SolveOptions::default() });
    let mut gradient = vec![Complex64::default(); truth.len()];
    let chi2 = t.add(&truth, 1.0, &mut gradient);
    let n = t.data() as f64;
    assert!((chi2 / n - 1.0).abs() < 4.0 * (2.0 / n).sqrt(), "{chi2} {n}");
    let seen = t.calibrated(&truth);
    let error: f64 = seen.iter().zip(&truth).map(|(s, t)| (Complex64::new(s.re.into(), s.im.into()) - t).norm_sqr()).sum::<f64>();
    // Two hands are averaged, and gains above 1 reduce the noise of the calibrated data.
    let rms = (error / truth.len() as f64).sqrt();
    assert!(rms < 0.02 && rms > 0.01, "{rms}");
}

#[test]
fn a_shift_is_seen_through_unknown_gains_where_the_band_or_the_rotation_tells() {
    let phases = random_phases(7, 3.0, 7);
    let mut s = scene();
    (s.sigma, s.n_time, s.integration_s) = (1e-4, 6, 1200.0);
    let set = s.set(|_, p, _, _| cis(phases[p]));
    let moved: Vec<_> = s.sources.iter().map(|(l, m, f)| (l - 2e-7, m + 1e-7, *f)).collect();
    let (wrong, u, v) = model(&set, &moved);
    let t = term(&set, &SolveOptions { solint: SolutionInterval::Infinite, ..SolveOptions::default() });
    let (shift, sigma) = t.shift(&wrong, &u, &v).unwrap().unwrap();
    assert!((shift[0] - 2e-7).abs() < 1e-8 && (shift[1] + 1e-7).abs() < 1e-8, "{shift:?}");
    assert!(sigma.iter().all(|s| *s < 1e-8), "{sigma:?}");
    // With one channel and one solution for each integration, the gains absorb the shift.
    (s.n_chan, s.pols) = (1, vec![Polarization::I]);
    let set = s.set(|_, p, _, _| cis(phases[p]));
    let (wrong, u, v) = model(&set, &moved);
    let t = term(&set, &SolveOptions { solint: SolutionInterval::Integration, ..SolveOptions::default() });
    assert!(t.shift(&wrong, &u, &v).unwrap().is_none());
}

#[test]
fn data_can_be_looked_at_from_another_place_of_the_sky() {
    let phases = random_phases(7, 3.0, 7);
    let mut s = scene();
    (s.sigma, s.n_time, s.integration_s) = (1e-4, 6, 1200.0);
    let set = s.set(|_, p, _, _| cis(phases[p]));
    let t = term(&set, &SolveOptions { solint: SolutionInterval::Infinite, ..SolveOptions::default() });
    let (sources, place) = (s.sources.clone(), [2e-7, -1e-7]);
    let (here, u, v) = model(&set, &sources);
    let moved: Vec<_> = sources.iter().map(|(l, m, flux)| (l - place[0], m - place[1], *flux)).collect();
    let (there, _, _) = model(&set, &moved);
    let chi2 = |model: &[Complex64]| {
        t.restart();
        let mut gradient = vec![Complex64::default(); model.len()];
        t.add(model, 1.0, &mut gradient)
    };
    let expected = chi2(&here);
    t.look_at(place, &u, &v);
    let found = chi2(&there);
    assert!((found / expected - 1.0).abs() < 1e-5, "{found} {expected}");
    assert!((chi2(&here) / expected - 1.0).abs() > 1e-3);
    t.look_at([0.0; 2], &u, &v);
    assert!((chi2(&here) / expected - 1.0).abs() < 1e-9);
}

#[test]
fn flagged_data_and_antennas_that_cannot_be_solved_take_no_part() {
    let set = scene().set(|_, _, _, _| cis(0.0));
    let mut worse = set.clone();
    for row in 0..worse.data.n_rows() {
        let (p, q) = (worse.data.coverage.ant1[row], worse.data.coverage.ant2[row]);
        // Antenna 6 keeps two baselines with wrong data. The test fails if these data are used.
        if q == 6 && p > 1 {
            worse.data.flags.slice_mut(ndarray::s![row, .., ..]).fill(true);
        } else if q == 6 {
            worse.data.vis.slice_mut(ndarray::s![row, .., ..]).fill(Complex32::new(100.0, 0.0));
        }
    }
    worse.data.vis[(0, 0, 0)] = Complex32::new(f32::NAN, 0.0);
    let (truth, ..) = model(&set, &scene().sources);
    let mut builder =
        UnknownGainsBuilder::new(&worse.header, &SolveOptions { solint: SolutionInterval::Infinite, ..SolveOptions::default() }).unwrap();
    let taken = builder.add(&worse.data).unwrap();
    let t = builder.finish().unwrap();
    let kept: Vec<Complex64> = taken.iter().flat_map(|r| truth[2 * r..2 * r + 2].to_vec()).collect();
    let chi2 = t.add(&kept, 0.0, &mut vec![Complex64::default(); kept.len()]);
    let n = t.data() as f64;
    assert!((chi2 / n - 1.0).abs() < 4.0 * (2.0 / n).sqrt(), "{chi2} {n}");
}

#[test]
fn what_cannot_be_solved_is_refused() {
    let set = scene().set(|_, _, _, _| cis(0.0));
    let delay = SolveOptions { mode: GainMode::Delay, solint: SolutionInterval::Infinite, ..SolveOptions::default() };
    assert!(matches!(UnknownGainsBuilder::new(&set.header, &delay), Err(ChainError::BadOption { option: "mode", .. })));
    let empty = UnknownGainsBuilder::new(&set.header, &SolveOptions { solint: SolutionInterval::Infinite, ..SolveOptions::default() })
        .unwrap()
        .finish();
    assert!(matches!(empty, Err(ChainError::NoData(_))));
    let mut flagged = set.clone();
    flagged.data.flags.fill(true);
    let mut builder =
        UnknownGainsBuilder::new(&set.header, &SolveOptions { solint: SolutionInterval::Infinite, ..SolveOptions::default() }).unwrap();
    assert!(builder.add(&flagged.data).unwrap().is_empty());
    assert!(matches!(builder.finish(), Err(ChainError::NoData(_))));
}

/// Intervals of two integrations, in files whose rows follow the time or the baselines: in one process, in two, and in all.
#[test]
fn processes_find_the_sums_of_one() {
    let phases = random_phases(7, 0.2, 6);
    let mut set = Scene { n_time: 6, ..scene() }.set(|_, p, _, _| cis(phases[p]) * (1.0 + 0.01 * p as f64));
    set.data.flags[(0, 0, 0)] = true;
    let mut by_baseline: Vec<usize> = (0..set.data.n_rows()).collect();
    by_baseline.sort_by_key(|r| (set.data.coverage.ant1[*r], set.data.coverage.ant2[*r]));
    let mut turned = VisibilitySet { data: set.data.rows(0..0).unwrap(), ..set.clone() };
    by_baseline.iter().for_each(|r| turned.data.append(&set.data.rows(*r..r + 1).unwrap()).unwrap());
    let interval = 2.0 * set.data.coverage.integration_s[0];
    for set in [set, turned] {
        let run = |source: &mut dyn VisibilitySource| {
            let options = SolveOptions { mode: GainMode::AmpPhase, solint: SolutionInterval::Seconds(interval), ..SolveOptions::default() };
            let (header, data) = (source.header().clone(), source.read_rows(0..source.n_rows()).unwrap());
            let mut builder = UnknownGainsBuilder::new(&header, &options).unwrap().shared_by(source.ranks());
            builder.add(&data).unwrap();
            let t = builder.finish().unwrap();
            let own = VisibilitySet { header, data };
            let (sky, u, v) = model(&own, &[(1e-4, 2e-4, 3.0), (-3e-4, 1e-4, 1.0)]);
            let mut slope = vec![Complex64::default(); sky.len()];
            let mut all = vec![t.data() as f64, t.weight_of_all()];
            for expectation in [0.0, 100.0] {
                t.expect_unity(expectation);
                all.extend([t.add(&sky, 1.0, &mut slope), t.rms_from_unity(), t.noise_factor(&sky).unwrap()]);
            }
            if let Some((shift, sigma)) = t.shift(&sky, &u, &v).unwrap() {
                all.extend(shift.into_iter().chain(sigma));
            }
            (all, slope)
        };
        let one = in_processes(1, &set, run).remove(0);
        assert_eq!(one.0.len(), 12);
        for size in [2, 3, 5] {
            let parts = in_processes(size, &set, run);
            for (all, _) in &parts {
                let worst = one.0.iter().zip(all).fold(0.0_f64, |d, (a, b)| d.max((a - b).abs() / a.abs().max(1e-12)));
                assert!(worst < 1e-7, "{size} processes: {worst:e} {:?} {all:?}", one.0);
            }
            let slopes = parts.iter().flat_map(|p| &p.1);
            let top = one.1.iter().fold(0.0_f64, |t, s| t.max(s.norm()));
            assert!(one.1.iter().zip(slopes).all(|(a, b)| (a - b).norm() < 1e-7 * top), "{size} processes");
        }
    }
}
