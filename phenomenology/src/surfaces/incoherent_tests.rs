//! Incoherent stacks against numerical phase averages of the exact coherent stack.

use super::fresnel::{interface, medium};
use super::*;
use crate::oracle_tests::Table;
use num_complex::Complex64;
use proptest::prelude::*;
use std::f64::consts::TAU;

const STEPS: u32 = 512;

fn wavenumber(freq_hz: f64) -> f64 {
    TAU * freq_hz / crate::constants::SPEED_OF_LIGHT_M_S
}

fn layer(re: f64, loss: f64, thickness_m: f64) -> Layer {
    Layer { eps: Complex64::new(re, -loss), thickness_m, temperature_k: 280.0 }
}

/// Amplitudes of the interface on top of medium `n + 1`.
fn amplitudes(layers: &[Layer], n: usize, cos: f64) -> [Complex64; 2] {
    let ((eps1, q1), (eps2, q2)) = (medium(layers, n, cos), medium(layers, n + 1, cos));
    interface(eps1, q1, eps2, q2)
}

/// Round trip through layer `n` from the top with the phase advanced.
fn round_trip(layers: &[Layer], n: usize, cos: f64, k0: f64, phase: f64) -> Complex64 {
    let (_, q) = medium(layers, n + 1, cos);
    (Complex64::new(0.0, -2.0 * k0 * layers[n].thickness_m) * q + Complex64::new(0.0, phase)).exp()
}

fn phases() -> impl Iterator<Item = f64> {
    (0..STEPS).map(|i| TAU * f64::from(i) / f64::from(STEPS))
}

// What lies below a layer reflects the mean power with any phase. Every row of the oracle, bottom up, by a sum over phases of the exact
// amplitude.
#[test]
fn reflectivity_is_the_phase_average_of_the_coherent_stack() {
    let t = Table::open("multilayer_tmm.csv");
    let mut worst = 0.0f64;
    for row in &t.rows {
        let list = super::oracle_tests::layers(t.text(row, "layers(eps_re;eps_loss;thickness_mm|...)"));
        let freq_hz = t.number(row, "f_ghz") * 1e9;
        let theta = t.number(row, "theta_deg").to_radians();
        let (k0, cos) = (wavenumber(freq_hz), theta.cos());
        let exact = Stack::new(list.clone(), true, freq_hz).unwrap().reflection(theta).unwrap();
        let got = Stack::new(list.clone(), false, freq_hz).unwrap().reflection(theta).unwrap();
        for p in 0..2 {
            let (mut power, mut coherent) = (0.0, Complex64::new(0.0, 0.0));
            for n in (0..list.len()).rev() {
                let a = amplitudes(&list, n, cos)[p];
                if n + 1 == list.len() {
                    (power, coherent) = (a.norm_sqr(), a);
                    continue;
                }
                let reflected = |z: Complex64| (a + z) / (1.0 + a * z);
                power = phases()
                    .map(|phase| reflected(power.sqrt() * round_trip(&list, n, cos, k0, phase)).norm_sqr() / f64::from(STEPS))
                    .sum::<f64>();
                coherent = reflected(coherent * round_trip(&list, n, cos, k0, 0.0));
            }
            // The same amplitudes with the phases as they are give the coherent stack.
            assert!((coherent.norm_sqr() - exact.powers()[p]).abs() < 1e-12);
            worst = worst.max((power - got.powers()[p]).abs());
        }
    }
    println!("incoherent against phase averages: {worst:e}");
    assert!(worst < 1e-8);
}

// Air, slab, half-space: the power in the half-space from the exact field, the rest in the slab.
#[test]
fn absorption_is_the_phase_average_of_the_coherent_stack() {
    let freq_hz = 94e9;
    let k0 = wavenumber(freq_hz);
    let mut worst = 0.0f64;
    for slab in [layer(3.17, 0.01, 0.02), layer(3.0, 0.6, 2e-3), layer(8.2, 13.9, 2e-4), layer(5.0, 2.0, 5e-4)] {
        for bottom in [layer(8.2, 13.9, f64::INFINITY), layer(2.0, 0.0, f64::INFINITY), layer(5.2, 0.35, f64::INFINITY)] {
            let list = vec![slab, bottom];
            let stack = Stack::new(list.clone(), false, freq_hz).unwrap();
            for degrees in [0.0f64, 30.0, 60.0, 80.0, 89.0] {
                let theta = degrees.to_radians();
                let cos = theta.cos();
                let (r, w) = (stack.reflection(theta).unwrap().powers(), stack.absorption(theta).unwrap());
                let (_, q2) = medium(&list, 2, cos);
                for p in 0..2 {
                    let (a, b) = (amplitudes(&list, 0, cos)[p], amplitudes(&list, 1, cos)[p]);
                    let admittance = if p == 0 { q2 } else { q2 / bottom.eps };
                    let (mut through, mut back) = (0.0, 0.0);
                    for phase in phases() {
                        let trip = round_trip(&list, 0, cos, k0, phase);
                        let field = (1.0 + a) * (1.0 + b) / (1.0 + a * b * trip);
                        through += field.norm_sqr() * trip.norm() * admittance.re / cos / f64::from(STEPS);
                        back += ((a + b * trip) / (1.0 + a * b * trip)).norm_sqr() / f64::from(STEPS);
                    }
                    worst = worst.max((w[1][p] - through).abs()).max((r[p] - back).abs());
                    worst = worst.max((w[0][p] - (1.0 - through - back)).abs());
                }
            }
        }
    }
    println!("absorption against phase averages: {worst:e}");
    assert!(worst < 1e-8);
}

// A border inside one medium changes nothing, and the parts absorb what the whole absorbs.
#[test]
fn a_layer_may_be_cut_in_two() {
    let (film, bottom) = (layer(4.0, 1.5, 1e-3), layer(8.2, 13.9, f64::INFINITY));
    let top = layer(2.0, 0.3, 3e-3);
    let whole = Stack::new(vec![top, film, bottom], false, 94e9).unwrap();
    let parts = [3e-4, 7e-4].map(|d| Layer { thickness_m: d, ..film });
    let cut = Stack::new(vec![top, parts[0], parts[1], bottom], false, 94e9).unwrap();
    for theta in [0.0, 0.6, 1.2, 1.5] {
        let (a, b) = (whole.reflection(theta).unwrap(), cut.reflection(theta).unwrap());
        let (w, c) = (whole.absorption(theta).unwrap(), cut.absorption(theta).unwrap());
        for p in 0..2 {
            assert!((a.powers()[p] - b.powers()[p]).abs() < 1e-12);
            assert!((w[0][p] - c[0][p]).abs() < 1e-12 && (w[1][p] - c[1][p] - c[2][p]).abs() < 1e-12 && (w[2][p] - c[3][p]).abs() < 1e-12);
        }
    }
}

// Two layers of independent phases also interfere with themselves along paths of the same passages in another order, which a sum of powers
// leaves out.
#[test]
fn sum_of_powers_against_two_free_phases() {
    let (freq_hz, theta) = (94e9, 0.9f64);
    let (k0, cos) = (wavenumber(freq_hz), theta.cos());
    let list = [layer(1.5, 0.001, 5e-2), layer(3.17, 0.02, 1.3e-2), layer(9.0, 12.0, f64::INFINITY)];
    let got = Stack::new(list.to_vec(), false, freq_hz).unwrap().reflection(theta).unwrap().powers();
    for (p, power) in got.into_iter().enumerate() {
        let [a, b, c] = [0, 1, 2].map(|n| amplitudes(&list, n, cos)[p]);
        let mut mean = 0.0;
        for inner in phases() {
            let z = c * round_trip(&list, 1, cos, k0, inner);
            let lower = (b + z) / (1.0 + b * z);
            for outer in phases() {
                let z = lower * round_trip(&list, 0, cos, k0, outer);
                mean += ((a + z) / (1.0 + a * z)).norm_sqr() / f64::from(STEPS).powi(2);
            }
        }
        println!("two free phases {mean}, powers {power}");
        assert!((mean - power).abs() < 5e-4);
    }
}

proptest! {
    // Thin films of high loss on metal, where no phase is free, too.
    #[test]
    fn no_layer_absorbs_less_than_nothing(
        depths in proptest::collection::vec((0.3..12.0f64, 0.0..20.0f64, 0.0..0.003f64), 0..5),
        bottom in prop_oneof![(1.0..80.0f64, 0.0..80.0f64), Just((1.0, 5e6))],
        theta in 0.0..89.99f64,
    ) {
        let mut layers: Vec<Layer> = depths.iter().map(|&(re, loss, d)| layer(re, loss, d)).collect();
        layers.push(layer(bottom.0, bottom.1, f64::INFINITY));
        let stack = Stack::new(layers, false, 94e9).unwrap();
        let r = stack.reflection(theta.to_radians()).unwrap();
        let weights = stack.absorption(theta.to_radians()).unwrap();
        for p in 0..2 {
            let sum: f64 = weights.iter().map(|w| w[p]).sum();
            prop_assert!((sum + r.powers()[p] - 1.0).abs() < 1e-12, "{sum} {r:?}");
            prop_assert!(weights.iter().all(|w| w[p] >= 0.0), "{weights:?}");
            prop_assert!((0.0..=1.0).contains(&r.powers()[p]) && r.cross.norm().is_finite());
        }
    }
}
