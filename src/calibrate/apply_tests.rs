//! Gains applied to sets, and files of gains spread over the channels of the data.

use super::*;
use crate::closure::testdata::{Scene, T0_JD, cis, random_phases};
use crate::progress::Silent;
use cittert_arrays::{Polarization, VisibilitySet};

fn table(scene: &Scene, feeds: &[&str], intervals: usize, step_s: f64) -> GainTable {
    let h = scene.header();
    let times = (0..intervals).map(|i| T0_JD + i as f64 * step_s / 86_400.0).collect();
    GainTable::unity(h.layout, h.spectrum, feeds.iter().map(|f| (*f).into()).collect(), times, vec![step_s; intervals]).unwrap()
}

fn run(set: &VisibilitySet, table: &GainTable, options: ApplyOptions) -> (VisibilitySet, ApplyCounts) {
    let mut out = VisibilitySet::new(set.header.clone(), set.data.rows(0..0).unwrap()).unwrap();
    let counts = apply(&mut set.clone(), table, options, &mut out, &Silent).unwrap();
    (out, counts)
}

#[test]
fn data_of_four_times_the_model_are_brought_to_it_by_gains_of_two() {
    let scene = Scene { pols: vec![Polarization::XX, Polarization::YY, Polarization::XY], ..Scene::point(4, 2) };
    let set = scene.set(|_, _, _, _| Complex64::new(2.0, 0.0));
    let mut gains = table(&scene, &["X", "Y"], 1, 20.0);
    gains.gains.fill(Complex64::new(2.0, 0.0));
    let (out, counts) = run(&set, &gains, ApplyOptions::default());
    assert_eq!(counts, ApplyCounts { applied: 36, flagged: 0 });
    assert!((out.data.vis[(0, 0, 0)].re - 1.0).abs() < 1e-7 && out.data.weights[(0, 0, 0)] == 16.0);
}

#[test]
fn corrupting_and_calibrating_undo_each_other() {
    let scene = Scene { n_chan: 2, pols: vec![Polarization::RR, Polarization::LL, Polarization::LR], ..Scene::point(5, 3) };
    let set = scene.set(|_, a, _, f| cis(0.3 * a as f64 + f as f64));
    let mut gains = table(&scene, &["R", "L"], 3, 10.0);
    let phase = random_phases(gains.gains.len(), 3.0, 1);
    gains.gains.iter_mut().zip(&phase).for_each(|(g, p)| *g = Complex64::from_polar(1.0 + 0.5 * p.sin(), *p));
    let corrupt = ApplyOptions { direction: Direction::Corrupt, ..ApplyOptions::default() };
    let (there, _) = run(&set, &gains, corrupt);
    let (back, _) = run(&there, &gains, ApplyOptions::default());
    let expected = gains.gains[(1, 0, 1, 1)] * gains.gains[(1, 3, 1, 0)].conj();
    let row = 12; // antennas 0-3 at the second time
    assert_eq!((set.data.coverage.ant1[row], set.data.coverage.ant2[row]), (0, 3));
    let ratio = there.data.weights[(row, 1, 2)] * expected.norm_sqr() as f32;
    assert!((ratio - 1.0).abs() < 1e-6, "cross hand LR takes feed L of the first and R of the second antenna");
    assert!(back.data.vis.iter().zip(&set.data.vis).all(|(b, s)| (b - s).norm() < 1e-6));
    assert!(back.data.weights.iter().all(|w| (w - 1.0).abs() < 1e-6));
}

#[test]
fn linear_interpolation_goes_the_shorter_way_round_and_over_gaps() {
    let scene = Scene::point(4, 5);
    let mut gains = table(&scene, &["R+L"], 3, 20.0);
    for (t, phase) in [3.0, 0.0, -3.0].into_iter().enumerate() {
        gains.gains[(t, 1, 0, 0)] = cis(phase);
    }
    gains.flags[(1, 1, 0, 0)] = true;
    let linear = ApplyOptions { interpolation: Interpolation::Linear, ..ApplyOptions::default() };
    let applier = GainApplier::new(&gains, &scene.header(), linear).unwrap();
    let phase_after = |s: f64| applier.gains_at(T0_JD + s / 86_400.0)[gains.gains.dim().2].unwrap().arg();
    let phase = phase_after(20.0);
    assert!((phase.abs() - std::f64::consts::PI).abs() < 1e-4, "halfway from 3 to -3 rad lies at pi: {phase}");
    assert!((phase_after(300.0) + 3.0).abs() < 1e-12);
}

#[test]
fn missing_gains_flag_the_data() {
    let scene = Scene::point(5, 2);
    let set = scene.set(|_, _, _, _| cis(0.0));
    let mut gains = table(&scene, &["R+L"], 2, 10.0);
    gains.flags[(0, 1, 0, 0)] = true;
    gains.gains[(1, 2, 0, 0)] = Complex64::new(0.0, 0.0);
    let (out, counts) = run(&set, &gains, ApplyOptions::default());
    assert_eq!(counts, ApplyCounts { applied: 12, flagged: 8 });
    assert_eq!(out.data.flags.iter().filter(|f| **f).count(), 8);
    assert!(out.data.vis.iter().all(|v| v.re.is_finite()));
}

#[test]
fn a_channel_of_the_data_takes_the_gains_of_the_nearest_channel() {
    let scene = Scene { n_chan: 5, ..Scene::point(4, 2) };
    let h = scene.header();
    let (low, high) = h.spectrum.range_hz();
    let half = SpectralWindow::new(vec![0.75 * low + 0.25 * high, 0.25 * low + 0.75 * high], vec![0.5 * (high - low); 2]).unwrap();
    let of = |n_time: usize| {
        let (times, widths) = ((0..n_time).map(|t| T0_JD + t as f64).collect(), vec![20.0; n_time]);
        GainTable::unity(h.layout.clone(), half.clone(), vec!["R+L".into()], times, widths).unwrap()
    };
    let (spectrum, from) = spread_channels(&of(1), &h.spectrum);
    assert_eq!(spectrum, h.spectrum);
    assert!(from[0] == 0 && from[4] == 1 && from.is_sorted(), "{from:?}");
    let own = spread_channels(&of(MOST_SPREAD / 20 + 1), &h.spectrum);
    assert_eq!(own, (half.clone(), vec![0, 1]), "too large");
}

#[test]
fn tables_that_do_not_belong_are_refused() {
    let scene = Scene { pols: vec![Polarization::RR], ..Scene::point(4, 1) };
    let e = GainApplier::new(&table(&scene, &["X", "Y"], 1, 10.0), &scene.header(), ApplyOptions::default()).unwrap_err();
    assert!(e.to_string().contains("polarisation RR"), "{e}");
    let mut other = scene.header();
    let renamed = other.layout.antennas().iter().map(|a| cittert_arrays::Antenna { name: format!("Z{}", a.name), ..a.clone() });
    other.layout = cittert_arrays::ArrayLayout::new("z", other.layout.frame, renamed.collect()).unwrap();
    let e = GainApplier::new(&table(&scene, &["R+L"], 1, 10.0), &other, ApplyOptions::default()).unwrap_err();
    assert!(e.to_string().contains("no antenna"), "{e}");
}
