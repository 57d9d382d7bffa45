//! Tests of the whole solver with small images and known results.

use super::regulariser::{Entropy, Regulariser, WeightedSum};
use super::{BeamHessian, ChiSquared, MemGoals, MemImager, MemState, Method, Objective};
use crate::ChainError;
use crate::fourier::GridOptions;
use crate::fourier::fixtures::image_to_vis;
use crate::misfit::{Visibilities, VisibilityTerm};
use crate::progress::Silent;
use cittert_arrays::{SkyFrame, SkyGrid};
use ndarray::{ArcArray2, Array2};
use num_complex::{Complex32, Complex64};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

pub(super) const SIDE: usize = 32;

/// A disc with a hole and a bright corner, 0 at the edges of the frame.
pub(super) fn scene() -> Array2<f64> {
    Array2::from_shape_fn((SIDE, SIDE), |(i, j)| {
        let (x, y) = (j as f64 - 15.5, i as f64 - 15.5);
        let r = x.hypot(y);
        let t = if r < 11.0 { 1.0 } else { 0.0 };
        t * if r < 3.0 { 0.3 } else { 1.0 } + if (x - 5.0).hypot(y + 4.0) < 2.0 { 2.0 } else { 0.0 }
    })
}

/// Uvw of all pairs of a disc of antennas that fills the transform of the field.
pub(super) fn rows() -> Array2<f64> {
    let place: Vec<(f64, f64)> = (0..40)
        .map(|k| {
            let (r, a) = (0.20 * (k as f64 + 0.5) / 40.0, 2.399_963 * k as f64);
            (r * a.cos(), r * a.sin())
        })
        .collect();
    let pairs: Vec<(usize, usize)> = (0..40).flat_map(|a| (a + 1..40).map(move |b| (a, b))).collect();
    Array2::from_shape_fn((pairs.len(), 3), |(r, k)| match k {
        0 => place[pairs[r].1].0 - place[pairs[r].0].0,
        1 => place[pairs[r].1].1 - place[pairs[r].0].1,
        _ => 0.0,
    })
}

pub(super) fn grid() -> SkyGrid {
    SkyGrid::new(SIDE, SIDE, 4e-3, SkyFrame::Boresight).unwrap()
}

/// Noisy data of the scene and their weights.
pub(super) fn observe(sigma: f64) -> (Vec<Complex32>, Vec<f32>) {
    let opts = GridOptions { epsilon: 1e-9, ..GridOptions::default() };
    let vis = image_to_vis(&grid(), scene().view(), rows().view(), &[94e9], &opts).unwrap();
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(5);
    let mut noise = || -> f64 { StandardNormal.sample(&mut rng) };
    let noisy = vis.iter().map(|v| {
        let z = v + Complex64::new(sigma * noise(), sigma * noise());
        Complex32::new(z.re as f32, z.im as f32)
    });
    let data: Vec<Complex32> = noisy.collect();
    let weights = vec![(1.0 / (sigma * sigma)) as f32; data.len()];
    (data, weights)
}

pub(super) fn imager(prior: f64, flux: Option<f64>, beam: bool) -> MemImager<'static> {
    imager_with(prior, flux, beam, GridOptions::default())
}

fn imager_with(prior: f64, flux: Option<f64>, beam: bool, options: GridOptions) -> MemImager<'static> {
    let (vis, weights) = observe(0.3);
    let hessian = beam.then(|| BeamHessian::of_list(&grid(), &[94e9], rows().view(), &weights).unwrap());
    let term: Box<dyn VisibilityTerm> = Box::new(Visibilities::new(vis, weights).unwrap());
    let chi2 = ChiSquared::new(&grid(), &[94e9], rows().view(), &options, term).unwrap();
    let unit = prior;
    let prior = ArcArray2::from_elem((SIDE, SIDE), prior as f32);
    let penalty = WeightedSum(vec![(1.0, Box::new(Entropy::Relative.of(prior.clone())))]);
    MemImager::new(Objective { chi2, penalty, smoothness: None, inside: None, offset: None, flux, beam: hessian, unit }, prior).unwrap()
}

pub(super) fn nrmse(image: &Array2<f64>) -> f64 {
    let truth = scene();
    ((image - &truth).mapv(|v| v * v).sum() / truth.mapv(|v| v * v).sum()).sqrt()
}

fn solved(imager: &mut MemImager<'_>, mut state: MemState) -> MemState {
    let progress = imager.solve(&mut state, &MemGoals::default(), Method::QuasiNewton, &Silent).unwrap();
    assert!(progress.met, "{progress:?} chi2 {} kkt {}", state.chi2_per_datum, state.kkt);
    state
}

#[test]
fn the_target_is_met_and_the_scene_comes_back() {
    for prior in [0.3, 1.0, 3.0] {
        let mut imager = imager(prior, None, true);
        let start = imager.start();
        let state = solved(&mut imager, start);
        let flux = state.image.sum() / scene().sum();
        assert!(state.evaluations <= 60, "{} evaluations", state.evaluations);
        assert!(nrmse(&state.image) < 0.2 && (flux - 1.0).abs() < 0.02, "{prior}: {} {flux}", nrmse(&state.image));
    }
}

#[test]
fn three_starts_lead_to_one_image() {
    let mut imager = imager(1.0, None, true);
    let starts = [imager.start(), imager.start_at(scene()), imager.start_at(Array2::from_shape_fn((SIDE, SIDE), |(i, _)| 0.1 * i as f64))];
    // All starts use the same multiplier, because the tolerance of chi squared allows a range of multipliers.
    let lambda = solved(&mut imager, starts[0].clone()).lambda;
    let images: Vec<Array2<f64>> = starts
        .into_iter()
        .map(|mut s| {
            imager.improve(&mut s, lambda, 60, &Silent).unwrap();
            s.image
        })
        .collect();
    let size = images[0].mapv(|v| v * v).sum().sqrt();
    for other in &images[1..] {
        let apart = (other - &images[0]).mapv(|v| v * v).sum().sqrt() / size;
        assert!(apart < 0.01, "{apart}");
    }
}

#[test]
fn a_known_flux_is_kept_whatever_the_prior() {
    let truth = scene().sum();
    for prior in [0.2, 2.0] {
        let mut imager = imager(prior, Some(truth), true);
        let start = imager.start();
        let state = solved(&mut imager, start);
        assert!((state.image.sum() / truth - 1.0).abs() < 1e-3);
    }
}

#[test]
fn without_a_beam_l_bfgs_reaches_the_target() {
    let mut imager = imager(1.0, None, false);
    let mut state = imager.start();
    // L-BFGS knows the curvature of only a few directions. It reaches the target of chi squared long before the gradient is small.
    let goals = MemGoals { kkt: 0.1, ..MemGoals::default() };
    let progress = imager.solve(&mut state, &goals, Method::QuasiNewton, &Silent).unwrap();
    assert!(progress.met && state.evaluations <= 150, "{progress:?} {} {}", state.chi2_per_datum, state.kkt);
    assert!(nrmse(&state.image) < 0.2, "{}", nrmse(&state.image));
}

#[test]
fn steps_at_a_fixed_multiplier_go_on_where_the_last_ended() {
    for beam in [true, false] {
        let mut imager = imager(1.0, None, beam);
        let mut state = imager.start();
        let value = |imager: &mut MemImager<'_>, state: &MemState| {
            let o = imager.objective_mut();
            let point = o.evaluate(o.variable(&state.image)).unwrap();
            0.5 * state.lambda * point.chi2 + point.penalty
        };
        let mut last = f64::INFINITY;
        for round in 0..5 {
            let progress = imager.improve(&mut state, 1e-2, 3, &Silent).unwrap();
            assert!(progress.iterations <= 3 && progress.evaluations <= 12, "{progress:?}");
            let now = value(&mut imager, &state);
            assert!(now <= last, "{beam} {round}: {now} {last}");
            last = now;
        }
        assert!(state.chi2_per_datum < 50.0, "{beam}: {}", state.chi2_per_datum);
        assert!(matches!(imager.improve(&mut state, 0.0, 1, &Silent), Err(ChainError::BadOption { .. })));
    }
}

#[test]
fn nothing_is_bright_outside_the_mask() {
    let mut imager = imager(1.0, None, true);
    let inside = scene().mapv(|v| v > 0.0);
    imager.objective_mut().inside = Some(inside.clone());
    let start = imager.start();
    let state = solved(&mut imager, start);
    assert!(state.image.iter().zip(&inside).all(|(v, inside)| *inside || *v == 0.0));
    assert!(nrmse(&state.image) < 0.15, "{}", nrmse(&state.image));
}

#[test]
fn the_gradient_in_s_agrees_with_finite_differences() {
    let mut imager = imager_with(1.0, Some(500.0), true, GridOptions { epsilon: 1e-11, ..GridOptions::default() });
    let m = super::Multipliers { lambda: 0.02, beta: 0.3, rho: imager.objective().rho() };
    let o = imager.objective_mut();
    // Numbers that single precision holds exactly.
    let s = Array2::from_shape_fn((SIDE, SIDE), |(i, j)| 1.0 + 0.0625 * ((i * 3 + j) % 9) as f32);
    let point = o.evaluate(s.clone()).unwrap();
    let gradient = o.gradient(&point, &m);
    let top = gradient.iter().fold(0.0_f32, |a, g| a.max(g.abs()));
    for at in [(0, 0), (12, 20), (31, 5)] {
        let mut value = |x: f32| {
            let mut moved = s.clone();
            moved[at] += x;
            let p = o.evaluate(moved).unwrap();
            o.value(&p, &m)
        };
        let h = 1.0 / 128.0;
        let numeric = (8.0 * (value(h) - value(-h)) - (value(2.0 * h) - value(-2.0 * h))) / f64::from(12.0 * h);
        assert!((numeric - f64::from(gradient[at])).abs() < 1e-6 * f64::from(top), "{at:?}: {numeric} {} of {top}", gradient[at]);
    }
}

#[test]
fn bad_priors_fluxes_and_masks_are_refused() {
    let parts = |prior: f32, flux: Option<f64>, mask: bool| {
        let good = imager(1.0, None, false);
        let mut objective = good.into_objective();
        objective.flux = flux;
        objective.inside = mask.then(|| Array2::from_elem((SIDE, SIDE), false));
        MemImager::new(objective, ArcArray2::from_elem((SIDE, SIDE), prior)).map(|_| ()).map_err(|e| e.to_string())
    };
    assert!(parts(0.0, None, false).unwrap_err().contains("prior"));
    assert!(parts(-1.0, None, false).unwrap_err().contains("prior"));
    assert!(parts(1.0, Some(0.0), false).unwrap_err().contains("flux"));
    assert!(parts(1.0, None, true).unwrap_err().contains("mask"));
}

#[test]
fn gull_and_skilling_lead_to_the_same_image() {
    let prior = ArcArray2::from_elem((SIDE, SIDE), 1.0_f32);
    let one = Entropy::Relative.of(prior.clone());
    let two = Entropy::GullSkilling.of(prior.clone());
    let (mut g1, mut g2, mut c) = (Array2::zeros(prior.dim()), Array2::zeros(prior.dim()), Array2::zeros(prior.dim()));
    let image = scene() + 0.1;
    let (a, b) = (one.add(&image, 1.0, &mut g1, &mut c), two.add(&image, 1.0, &mut g2, &mut c));
    assert_eq!(g1, g2);
    assert!((b - a - f64::from(prior.sum())).abs() < 1e-9);
}

#[test]
fn cornwell_and_evans_meet_all_constraints_in_sixty_evaluations() {
    let truth = scene().sum();
    for flux in [None, Some(truth)] {
        let mut imager = imager(1.0, flux, true);
        let mut state = imager.start();
        let goals = MemGoals { evaluations: 60, ..MemGoals::default() };
        let progress = imager.solve(&mut state, &goals, Method::Vtess, &Silent).unwrap();
        assert!(progress.met, "{flux:?}: {progress:?} chi2 {} kkt {}", state.chi2_per_datum, state.kkt);
        assert_eq!(progress.evaluations, progress.iterations + 1, "an iteration is one evaluation");
        assert!(nrmse(&state.image) < 0.2, "{}", nrmse(&state.image));
        let same = {
            let mut other = imager.start();
            imager.solve(&mut other, &MemGoals::default(), Method::QuasiNewton, &Silent).unwrap();
            (&other.image - &state.image).mapv(|v| v * v).sum().sqrt() / state.image.mapv(|v| v * v).sum().sqrt()
        };
        assert!(same < 0.03, "the two solvers differ by {same}");
    }
    let mut without = imager(1.0, None, false);
    let mut state = without.start();
    assert!(without.solve(&mut state, &MemGoals::default(), Method::Vtess, &Silent).is_err());
}

#[test]
fn the_uncertainty_covers_the_errors_of_the_image() {
    use super::{Multipliers, Uncertainty, uncertainty};
    let mut imager = imager(1.0, None, true);
    let start = imager.start();
    let state = solved(&mut imager, start);
    let m = Multipliers { lambda: state.lambda * imager.objective().unit, beta: state.beta, rho: 0.0 };
    let o = imager.objective_mut();
    let point = o.evaluate(o.variable(&state.image)).unwrap();
    let fast = uncertainty(o, &point, &m, (Uncertainty::Beam, 1)).unwrap().unwrap();
    let probed = uncertainty(o, &point, &m, (Uncertainty::Probes(200), 3)).unwrap().unwrap();
    assert!(uncertainty(o, &point, &m, (Uncertainty::None, 1)).unwrap().is_none());
    let flat = Array2::zeros((SIDE, SIDE));
    let system = super::newton::NewtonSystem::new((o.beam.as_ref().unwrap(), o.chi2.response(), None), &point, flat, &m).unwrap();
    for at in [(16, 8), (22, 16), (11, 20), (8, 14)] {
        let mut unit = Array2::zeros((SIDE, SIDE));
        unit[at] = 1.0;
        let (x, _) = system.solve(unit, super::control::Effort { tolerance: 1e-4, steps: 400 }).unwrap();
        let exact = (m.lambda * state.image[at] * f64::from(x[at])).sqrt();
        let (a, b) = (fast[at] / exact, probed[at] / exact);
        assert!((0.6..1.6).contains(&a) && (0.7..1.4).contains(&b), "{at:?}: {exact}, {a} and {b} of it");
    }
}
