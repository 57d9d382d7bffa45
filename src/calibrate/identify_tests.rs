//! Tests of the counts of unknowns and degeneracies.

use super::identify::RowStack;
use super::*;
use crate::closure::pairs_of;
use crate::linalg::{Matrix, singular_values};
use cittert_arrays::{Antenna, ArrayLayout, LayoutFrame};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn layout(places: &[[f64; 3]]) -> ArrayLayout {
    let antennas = places.iter().enumerate().map(|(i, p)| Antenna::new(format!("A{i}"), i as u32, *p)).collect();
    ArrayLayout::new("t", LayoutFrame::Boresight, antennas).unwrap()
}

fn random(n: usize, seed: u64, depth: f64) -> ArrayLayout {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let places: Vec<[f64; 3]> =
        (0..n).map(|_| [rng.random_range(-50.0..50.0), rng.random_range(-50.0..50.0), depth * rng.random_range(-1.0..1.0)]).collect();
    layout(&places)
}

fn run(l: &ArrayLayout, mode: GainMode, model: ModelKnowledge) -> Identifiability {
    identify(l, &IdentifyOptions { mode, model, ..IdentifyOptions::default() }).unwrap()
}

fn names(i: &Identifiability) -> Vec<(&str, usize)> {
    i.modes.iter().map(|m| (m.name.as_str(), m.dimensions)).collect()
}

#[test]
fn closure_counts_follow_the_formulas_on_twenty_layouts() {
    for k in 0..20 {
        let n = 4 + 3 * k;
        let i = run(&random(n, k as u64, if k % 2 == 0 { 0.0 } else { 5.0 }), GainMode::AmpPhase, ModelKnowledge::FreeImage);
        assert_eq!(i.closure_phases, (n - 1) * (n - 2) / 2, "{n}");
        assert_eq!(i.closure_amplitudes, n * (n - 3) / 2, "{n}");
        assert_eq!(i.modes.iter().map(|m| m.dimensions).sum::<usize>(), i.null_dimensions);
        assert_eq!(i.gain_unknowns + i.sky_unknowns - i.rank, i.null_dimensions);
    }
}

#[test]
fn a_known_model_leaves_only_the_common_phase() {
    let l = random(12, 1, 3.0);
    let i = run(&l, GainMode::Phase, ModelKnowledge::Known);
    assert_eq!((i.gain_unknowns, i.sky_unknowns, i.rank), (12, 0, 11));
    assert_eq!(names(&i), [("common phase", 1)]);
    let i = run(&l, GainMode::AmpPhase, ModelKnowledge::Known);
    assert_eq!((i.gain_unknowns, i.rank, i.observables), (24, 23, 132));
    let i = run(&l, GainMode::Delay, ModelKnowledge::Known);
    assert_eq!(names(&i), [("common phase", 1), ("common delay", 1)]);
}

#[test]
fn an_unknown_point_adds_shift_and_flux() {
    let l = random(10, 2, 0.0);
    let shifts = [("common phase", 1), ("image shift along l", 1), ("image shift along m", 1)];
    assert_eq!(names(&run(&l, GainMode::Phase, ModelKnowledge::UnknownPoint)), shifts);
    let i = run(&l, GainMode::AmpPhase, ModelKnowledge::UnknownPoint);
    assert_eq!(names(&i), [&shifts[..], &[("flux scale", 1)]].concat());
    assert_eq!((i.sky_unknowns, i.null_dimensions), (3, 4));
    let i = run(&l, GainMode::Delay, ModelKnowledge::UnknownPoint);
    assert_eq!(names(&i), [&shifts[..1], &[("common delay", 1)], &shifts[1..]].concat());
}

#[test]
fn a_free_image_absorbs_every_antenna_unless_baselines_repeat() {
    let i = run(&random(9, 3, 0.0), GainMode::AmpPhase, ModelKnowledge::FreeImage);
    assert_eq!(i.null_dimensions, 18);
    assert_eq!(i.unique_baselines, 36);
    assert_eq!(i.rank, 72);
    let named = names(&i);
    assert!(named.contains(&("antenna phases that the free image absorbs", 6)), "{named:?}");
    assert!(named.contains(&("antenna amplitudes that the free image absorbs", 8)), "{named:?}");
    // A regular grid determines all gains except the classic degeneracies (Liu et al. 2010).
    let grid: Vec<[f64; 3]> = (0..16).map(|i| [f64::from(i % 4) * 10.0, f64::from(i / 4) * 7.0, 0.0]).collect();
    let i = run(&layout(&grid), GainMode::AmpPhase, ModelKnowledge::FreeImage);
    assert_eq!(names(&i), [("common phase", 1), ("image shift along l", 1), ("image shift along m", 1), ("flux scale", 1)]);
    assert_eq!(i.unique_baselines, 24);
}

#[test]
fn a_regular_line_has_one_shift_whatever_the_order_of_its_antennas() {
    for order in [[0, 1, 2, 3, 4, 5], [3, 0, 5, 1, 4, 2]] {
        let line: Vec<[f64; 3]> = order.iter().map(|i| [f64::from(*i) * 10.0, 0.0, 0.0]).collect();
        let i = run(&layout(&line), GainMode::AmpPhase, ModelKnowledge::FreeImage);
        assert_eq!(names(&i), [("common phase", 1), ("image shift along l", 1), ("flux scale", 1)], "{order:?}");
        assert_eq!(i.unique_baselines, 5);
    }
}

#[test]
fn short_rows_have_the_singular_values_of_all_pairs() {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let (n, columns) = (7, 5);
    let parts: Vec<Vec<f64>> = (0..n).map(|_| (0..columns).map(|_| rng.random_range(-1.0..1.0)).collect()).collect();
    for sign in [-1.0, 1.0] {
        let mut full = Matrix::zeros(n * (n - 1) / 2, columns);
        for (i, (p, q)) in pairs_of(n).enumerate() {
            (0..columns).for_each(|c| full[(i, c)] = parts[p][c] + sign * parts[q][c]);
        }
        let mut short = RowStack::new(columns);
        if sign < 0.0 {
            short.add_differences(&parts)
        } else {
            short.add_sums(&parts)
        }
        let (a, b) = (singular_values(full).0, short.singular_values());
        assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-12), "{a:?} {b:?}");
    }
}

#[test]
fn arrays_that_are_too_small_or_too_large_are_refused() {
    let one = layout(&[[0.0; 3]]);
    assert!(identify(&one, &IdentifyOptions::default()).is_err());
    let two = run(&layout(&[[0.0; 3], [10.0, 0.0, 0.0]]), GainMode::Phase, ModelKnowledge::Known);
    assert_eq!((two.rank, two.closure_phases), (1, 0));
}
