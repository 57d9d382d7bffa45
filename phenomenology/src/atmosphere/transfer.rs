//! The transfer integral along a ray, in radiance.
//!
//! Along each step absorption is exponential and the source `B` is nearly linear in
//! optical depth. With `dt` the optical depth of a step the observer receives
//! `(B_near + B_far e^-dt)/(1 + e^-dt) (1 - e^-dt)` from it, which is exact for an
//! isothermal step and tends to `B_near` when the step is opaque.

use super::air_grid::{Column, logarithmic_mean};
use super::planck::{black_body_radiance, planck_temperature_k, rayleigh_jeans_temperature_k};
use super::ray::Ray;

/// Absorption and emission of the air on a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathRadiation {
    /// Frequency, GHz.
    pub freq_ghz: f64,
    /// Optical depth, Np.
    pub tau_np: f64,
    /// Radiance emitted by the path towards the observer (photon occupation number).
    pub emission: f64,
}

impl PathRadiation {
    /// Fraction of radiance that passes, `exp(-tau)`.
    #[must_use]
    pub fn transmission(&self) -> f64 {
        (-self.tau_np).exp()
    }

    /// Emission of the path as a Rayleigh-Jeans temperature, K. These temperatures add up along paths.
    #[must_use]
    pub fn emission_rj_k(&self) -> f64 {
        rayleigh_jeans_temperature_k(self.freq_ghz, self.emission)
    }

    /// Emission of the path as a Planck temperature, K. It is for display only, because it does not add up.
    #[must_use]
    pub fn emission_planck_k(&self) -> f64 {
        planck_temperature_k(self.freq_ghz, self.emission)
    }

    /// Radiance seen through the path with `background` radiance behind it.
    #[must_use]
    pub fn seen_before(&self, background: f64) -> f64 {
        self.emission + background * self.transmission()
    }

    /// This path with `beyond` joined to its far end.
    #[must_use]
    pub fn then(&self, beyond: &Self) -> Self {
        Self {
            freq_ghz: self.freq_ghz,
            tau_np: self.tau_np + beyond.tau_np,
            emission: self.emission + self.transmission() * beyond.emission,
        }
    }

    /// Planck temperature of an isothermal path of the same depth and emission, K.
    ///
    /// Zero for a path without absorption.
    #[must_use]
    pub fn mean_radiating_k(&self) -> f64 {
        let absorbed = -(-self.tau_np).exp_m1();
        if absorbed > 0.0 { planck_temperature_k(self.freq_ghz, self.emission / absorbed) } else { 0.0 }
    }

    /// A path of constant temperature: `T_m (1 - exp(-tau))` in radiance.
    #[must_use]
    pub fn isothermal(freq_ghz: f64, tau_np: f64, temperature_k: f64) -> Self {
        let emission = black_body_radiance(freq_ghz, temperature_k) * -(-tau_np).exp_m1();
        Self { freq_ghz, tau_np, emission }
    }
}

impl Column {
    /// Integrates emission and optical depth along a ray of this grid.
    pub(super) fn along(&self, ray: &Ray) -> PathRadiation {
        let (mut tau_np, mut transmission, mut emission) = (0.0, 1.0, 0.0);
        for step in &ray.steps {
            let i = step.segment;
            let whole = (step.near - step.far).abs() == 1.0;
            let mean =
                if whole { self.mean[i] } else { logarithmic_mean(self.gas_at(i, step.near), self.gas_at(i, step.far)) + self.hydrosol[i] };
            let depth = mean * step.length_km;
            let (near, far) = (self.radiance_at(i, step.near), self.radiance_at(i, step.far));
            let lost = (-depth).exp_m1();
            let passed = 1.0 + lost;
            emission -= transmission * lost * (near + far * passed) / (1.0 + passed);
            transmission *= passed;
            tau_np += depth;
        }
        PathRadiation { freq_ghz: self.freq_ghz, tau_np, emission }
    }

    /// Black-body radiance at a fraction of the height between levels i and i + 1.
    fn radiance_at(&self, i: usize, fraction: f64) -> f64 {
        if fraction == 0.0 {
            self.radiance[i]
        } else if fraction == 1.0 {
            self.radiance[i + 1]
        } else {
            self.radiance[i] + fraction * (self.radiance[i + 1] - self.radiance[i])
        }
    }

    fn gas_at(&self, i: usize, fraction: f64) -> f64 {
        let (low, high) = (self.gas[i], self.gas[i + 1]);
        if low > 0.0 && high > 0.0 { low * (high / low).powf(fraction) } else { low + fraction * (high - low) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joined_paths_add_depth_and_dim_what_is_beyond() {
        let near = PathRadiation::isothermal(94.0, 0.3, 280.0);
        let far = PathRadiation::isothermal(94.0, 0.5, 280.0);
        let both = near.then(&far);
        let once = PathRadiation::isothermal(94.0, 0.8, 280.0);
        assert!((both.tau_np - 0.8).abs() < 1e-15);
        assert!((both.emission / once.emission - 1.0).abs() < 1e-14);
        assert!((both.mean_radiating_k() - 280.0).abs() < 1e-9);
    }

    #[test]
    fn clear_path_shows_the_background() {
        let clear = PathRadiation { freq_ghz: 35.0, tau_np: 0.0, emission: 0.0 };
        assert_eq!(clear.seen_before(123.0), 123.0);
        assert_eq!(clear.mean_radiating_k(), 0.0);
    }
}
