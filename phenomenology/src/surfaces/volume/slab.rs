//! One scattering layer: its reflection and transmission, by doubling.
//!
//! A layer so thin that radiation hardly changes in it obeys `mu dI/dz = -(K - F) I + B I'` with the mean of the radiances at its two
//! faces, where `F` and `B` couple a stream to those of the same and of the opposite sense. Two equal layers on each other have
//! `R2 = R + T (1 - R R)^-1 R T` and `T2 = T (1 - R R)^-1 T`. Extinction `K` is the absorption and the sum of the coupling of a stream, so that
//! no power is lost by the finite number of streams: what a layer neither reflects nor transmits, it absorbs. By Kirchhoff's law it emits as
//! much.
//!
//! Reference: van de Hulst 1963; Hansen & Travis 1974, Space Sci. Rev. 16, 527, section 3.2; the thin layer is that of Wiscombe 1976, J.
//! Quant. Spectrosc. Radiat. Transfer 16, 637.

use super::matrix::Matrix;
use super::scatterer::Scatterer;
use super::streams::MediumStreams;

/// Slant optical depth of the thin layer. The mean of two faces is wrong by `x^3/12` of the radiance, which is 1e-6 of the optical depth.
const THIN: f64 = 4e-3;
/// A layer that transmits no more than this is opaque.
const OPAQUE: f64 = 1e-12;
/// Most doublings. A layer without absorption never becomes opaque; at this number it is 1e15 thin layers thick.
const MOST_DOUBLINGS: usize = 50;

/// A layer between its two faces, without the interfaces there.
#[derive(Debug, Clone)]
pub(super) struct Slab {
    /// // [stream pol, stream pol]
    pub reflect: Matrix,
    /// // [stream pol, stream pol]
    pub transmit: Matrix,
    /// Mean coefficient of extinction, 1/m.
    pub extinction_per_m: f64,
}

impl Slab {
    /// A scattering layer of some thickness in m, which may be infinite.
    pub(super) fn scattering(scatterer: &Scatterer, streams: &MediumStreams, thickness_m: f64) -> Self {
        let coupling = scatterer.coupling(streams);
        let lost: Vec<f64> =
            coupling.forward.row_sums().iter().zip(coupling.backward.row_sums()).map(|(f, b)| scatterer.absorption_per_m + f + b).collect();
        let n = lost.len();
        let extinction_per_m = lost.iter().sum::<f64>() / n as f64;
        let slant: Vec<f64> = streams.mu.iter().flat_map(|mu| [1.0 / mu; 2]).collect();
        let steepest = lost.iter().zip(&slant).map(|(k, s)| k * s).fold(0.0, f64::max);
        if steepest == 0.0 || thickness_m == 0.0 {
            return Self { reflect: Matrix::zeros(n, n), transmit: Matrix::identity(n), extinction_per_m };
        }
        let infinite = thickness_m.is_infinite();
        let doublings = if infinite {
            MOST_DOUBLINGS
        } else {
            (steepest * thickness_m / THIN).log2().ceil().clamp(0.0, MOST_DOUBLINGS as f64) as usize
        };
        let step = if infinite { THIN / steepest } else { thickness_m / 2f64.powi(doublings as i32) };
        let half: Vec<f64> = slant.iter().map(|s| 0.5 * step * s).collect();
        let a = (Matrix::diagonal(&lost) - &coupling.forward).scale_rows(&half);
        let b = coupling.backward.scale_rows(&half);
        let one = Matrix::identity(n);
        // Sum and difference of the radiances of the two senses do not mix.
        let even = (one.clone() + &a - &b).solve(one.clone() - &a + &b);
        let odd = (one.clone() + &a + &b).solve(one.clone() - &a - &b);
        let mut transmit = (even.clone() + &odd).times(0.5);
        let mut reflect = (even - &odd).times(0.5);
        for _ in 0..doublings {
            if transmit.largest() < OPAQUE {
                break;
            }
            let between = (one.clone() - &(&reflect * &reflect)).solve(transmit.clone());
            let back = &transmit * &(&reflect * &between);
            transmit = &transmit * &between;
            reflect = reflect + &back;
        }
        Self { reflect, transmit, extinction_per_m }
    }

    /// A layer that only absorbs, given the share of power that each stream keeps.
    pub(super) fn absorbing(kept: &[f64]) -> Self {
        let n = kept.len();
        Self { reflect: Matrix::zeros(n, n), transmit: Matrix::diagonal(kept), extinction_per_m: 0.0 }
    }

    /// Share of the power of a black body that the layer emits through one face, for each stream and polarisation.
    pub(super) fn emissivity(&self) -> Vec<f64> {
        let sums = self.reflect.row_sums().into_iter().zip(self.transmit.row_sums());
        sums.map(|(r, t)| (1.0 - r - t).max(0.0)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::scatterer::Phase;
    use super::super::streams::{StreamOptions, Streams};
    use super::*;

    fn streams() -> MediumStreams {
        Streams::new(&[], StreamOptions::default()).of(1.0)
    }

    /// Emissivity of a half-space of isotropic scatterers: `sqrt(1 - w) H(mu)` with `H` by iteration of
    /// `1/H = sqrt(1 - w) + w/2 int mu' H(mu')/(mu + mu') dmu'` (Chandrasekhar 1960, section 38, eq. 12).
    #[test]
    fn isotropic_scatterers_have_the_function_of_chandrasekhar() {
        let s = streams();
        for albedo in [0.3_f64, 0.9, 0.99] {
            let mut h = vec![1.0; s.mu.len()];
            for _ in 0..2000 {
                let next: Vec<f64> =
                    s.mu.iter()
                        .map(|mu| {
                            let sum: f64 = (0..h.len()).map(|j| s.weight[j] * s.mu[j] * h[j] / (mu + s.mu[j])).sum();
                            1.0 / ((1.0 - albedo).sqrt() + 0.5 * albedo * sum)
                        })
                        .collect();
                h = h.iter().zip(next).map(|(a, b)| 0.5 * (a + b)).collect();
            }
            let scatterer = Scatterer { absorption_per_m: 1.0 - albedo, phase: Phase::Isotropic { scattering_per_m: albedo } };
            let slab = Slab::scattering(&scatterer, &s, f64::INFINITY);
            for (i, e) in slab.emissivity().iter().enumerate() {
                let exact = (1.0 - albedo).sqrt() * h[i / 2];
                assert!((e - exact).abs() < 2e-6, "{albedo}, mu {}: {e} {exact}", s.mu[i / 2]);
            }
        }
    }

    /// Chandrasekhar 1960, section 68: a half-space of dipoles that absorb nothing. Radiation that comes from deep inside leaves it with
    /// the degree of polarisation 0.11713 at the horizon and 0 at the zenith (table XXIV).
    #[test]
    fn light_from_deep_inside_dipoles_is_polarised() {
        let s = streams();
        let scatterer = Scatterer { absorption_per_m: 1e-8, phase: Phase::Rayleigh { scattering_per_m: 1.0 } };
        let slab = Slab::scattering(&scatterer, &s, f64::INFINITY);
        let e = slab.emissivity();
        let degree = |i: usize| (e[2 * i] - e[2 * i + 1]).abs() / (e[2 * i] + e[2 * i + 1]);
        assert!(degree(0) < 1e-3, "{}", degree(0));
        // The polynomial through all streams, at the horizon. The slope is infinite there, so it is right to about 1 per cent only.
        let n = s.mu.len();
        let share = |i: usize| (0..n).filter(|j| *j != i).map(|j| s.mu[j] / (s.mu[j] - s.mu[i])).product::<f64>();
        let horizon: f64 = (0..n).map(|i| degree(i) * share(i)).sum();
        assert!((horizon - 0.11713).abs() < 2e-3, "{horizon}");
    }

    #[test]
    fn without_scattering_it_is_the_law_of_beer() {
        let s = streams();
        let scatterer = Scatterer { absorption_per_m: 2.0, phase: Phase::Isotropic { scattering_per_m: 0.0 } };
        let slab = Slab::scattering(&scatterer, &s, 0.4);
        assert_eq!(slab.reflect.largest(), 0.0);
        for (i, mu) in s.mu.iter().enumerate() {
            let exact = (-0.8 / mu).exp();
            assert!((slab.transmit[(2 * i, 2 * i)] - exact).abs() < 2e-6, "{mu}");
        }
    }
}
