//! Complex refractivity of gases: the real part beside the absorption.
//!
//! Refractivities are `N' - j N''` in ppm. The static part of the real refractivity is that of the whole spectrum at zero frequency; lines
//! and continua add what depends on the frequency and vanishes at 0.

use num_complex::Complex64;

use super::lines::{DebyeOxygen, GasSpectrum, SpectralLine};
use super::nitrogen::nitrogen_refractivity_ppm;

/// Refractivity of air at one frequency and one state, ppm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GasRefractivity {
    /// Static refractivity of dry air.
    pub dry_static: f64,
    /// Static refractivity of water vapour.
    pub wet_static: f64,
    /// Dispersion and loss of oxygen, and loss of nitrogen.
    pub dry: Complex64,
    /// Dispersion and loss of water vapour.
    pub wet: Complex64,
}

/// Static refractivity of dry air and of water vapour, ppm, from the pressures of both in hPa and `theta = 300 K / T`.
///
/// # Reference
/// Liebe 1989, Int. J. IR & MM Waves 10, 631: `N0 = [2.588 p_d + (41.63 theta + 2.39) e] theta` (kPa).
#[must_use]
pub fn static_refractivity_liebe89(dry_pressure_hpa: f64, vapour_pressure_hpa: f64, theta: f64) -> [f64; 2] {
    [0.2588 * dry_pressure_hpa * theta, (4.163 * theta + 0.239) * vapour_pressure_hpa * theta]
}

impl SpectralLine {
    /// Complex refractivity `N' - j N''` of the line in ppm; 0 at zero frequency.
    ///
    /// # Reference
    /// Liebe, Hufford & Cotton 1993: `S (f/f0) [(1 - j d)/(f0 - f - j g) - (1 + j d)/(f0 + f + j g)]`, here with the other sign of `j`.
    #[must_use]
    pub fn complex_refractivity_ppm(&self, freq_ghz: f64) -> Complex64 {
        let (f, f0, g, d) = (freq_ghz, self.centre_ghz, self.width_ghz, self.mixing);
        let shape = Complex64::new(1.0, d) / Complex64::new(f0 - f, g) - Complex64::new(1.0, -d) / Complex64::new(f0 + f, -g);
        self.strength * (f / f0) * shape
    }
}

impl DebyeOxygen {
    /// Complex refractivity `N' - j N''` in ppm: `-S f/(f - j G)`; 0 at zero frequency.
    #[must_use]
    pub fn complex_refractivity_ppm(&self, freq_ghz: f64) -> Complex64 {
        if freq_ghz == 0.0 {
            return Complex64::new(0.0, 0.0);
        }
        -self.strength * freq_ghz / Complex64::new(freq_ghz, -self.width_ghz)
    }
}

impl GasSpectrum {
    /// Complex refractivity at a frequency of 0 to 1000 GHz, which is not checked.
    ///
    /// The models have no real part for nitrogen, whose loss at 1000 GHz belongs to a dispersion below 0.01 ppm.
    ///
    /// # Reference
    /// Liebe 1989, Int. J. IR & MM Waves 10, 631; Liebe, Hufford & Cotton 1993, AGARD CP-542. The real part of the continuum of MPM89 is
    /// the power law `6.47e-6 f^2.05 e theta^2.4` (kPa).
    #[must_use]
    pub fn refractivity(&self, freq_ghz: f64) -> GasRefractivity {
        let sum = |lines: &[SpectralLine]| lines.iter().map(|line| line.complex_refractivity_ppm(freq_ghz)).sum::<Complex64>();
        let mut oxygen = sum(&self.oxygen_lines);
        // As in the absorption: with first-order mixing the far wing of the band can become negative.
        oxygen.im = oxygen.im.min(0.0);
        let nitrogen = nitrogen_refractivity_ppm(freq_ghz, self.dry_pressure_hpa, self.theta);
        let continuum =
            Complex64::new(self.water_continuum_dispersion_ppm * freq_ghz.powf(2.05), -self.water_continuum_ppm_per_ghz * freq_ghz);
        let [dry_static, wet_static] = static_refractivity_liebe89(self.dry_pressure_hpa, self.vapour_pressure_hpa, self.theta);
        GasRefractivity {
            dry_static,
            wet_static,
            dry: oxygen + self.oxygen_debye.complex_refractivity_ppm(freq_ghz) - Complex64::new(0.0, nitrogen),
            wet: sum(&self.water_lines) + continuum,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::atmosphere::{AirState, GAS_MODELS, gas_model, refractivity_thayer74};
    use std::f64::consts::PI;

    fn air(t: f64, e: f64) -> AirState {
        AirState::new(1000.0, t, e).unwrap()
    }

    /// The real part from the loss: `(2 f^2/pi) P int N''(x)/(x (x^2 - f^2)) dx`, once subtracted at zero frequency.
    fn kramers_kronig(loss: impl Fn(f64) -> f64, freq: f64, scale: f64) -> f64 {
        let at = loss(freq) / freq;
        let steps = 400_000;
        let sum: f64 = (0..steps)
            .map(|i| {
                let t = (f64::from(i) + 0.5) / f64::from(steps);
                let x = scale * t / (1.0 - t);
                // P int dx/(x^2 - f^2) is 0, so the value at the pole may be subtracted.
                let gap = x * x - freq * freq;
                if gap.abs() < 1e-9 * freq * freq { 0.0 } else { (loss(x) / x - at) / gap * scale / (1.0 - t).powi(2) }
            })
            .sum();
        2.0 * freq * freq / PI * sum / f64::from(steps)
    }

    #[test]
    fn real_parts_follow_from_the_losses_by_kramers_and_kronig() {
        let line = SpectralLine { centre_ghz: 118.75, strength: 2.0, width_ghz: 3.0, mixing: 0.15 };
        let debye = DebyeOxygen { strength: 4.0, width_ghz: 2.5 };
        for freq in [5.0, 60.0, 117.0, 118.75, 121.0, 300.0, 900.0] {
            let n = line.complex_refractivity_ppm(freq);
            let from_loss = kramers_kronig(|x| line.refractivity_ppm(x), freq, 120.0);
            assert!((n.im + line.refractivity_ppm(freq)).abs() < 1e-14);
            assert!((n.re - from_loss).abs() < 2e-5 * 2.0 / 3.0, "{freq}: {n} {from_loss}");
            let n = debye.complex_refractivity_ppm(freq);
            let from_loss = kramers_kronig(|x| debye.refractivity_ppm(x), freq, 10.0);
            assert!((n.im + debye.refractivity_ppm(freq)).abs() < 1e-14);
            assert!((n.re - from_loss).abs() < 2e-4, "{freq}: {n} {from_loss}");
        }
    }

    // The whole spectrum: loss and attenuation are one number at every frequency.
    #[test]
    fn losses_are_the_absorption() {
        for model in GAS_MODELS {
            let spectrum = gas_model(model.name).unwrap().spectrum(&air(285.0, 12.0));
            for freq in [1.0, 22.2, 60.0, 94.0, 183.31, 340.0, 557.0, 1000.0] {
                let (n, a) = (spectrum.refractivity(freq), spectrum.absorption(freq));
                assert!((0.1820 * freq * -n.wet.im / a.water_db_per_km - 1.0).abs() < 1e-12);
                assert!((0.1820 * freq * -n.dry.im / (a.oxygen_db_per_km + a.nitrogen_db_per_km) - 1.0).abs() < 1e-12);
            }
        }
    }

    // Smith & Weintraub 1953 and Thayer 1974 at low frequency.
    #[test]
    fn radio_refractivity_is_that_of_smith_weintraub_and_thayer() {
        for (t, e) in [(250.0, 0.0), (250.0, 0.5), (273.0, 5.0), (288.0, 12.0), (303.0, 35.0)] {
            let state = air(t, e);
            for model in GAS_MODELS {
                let n = gas_model(model.name).unwrap().spectrum(&state).refractivity(0.0);
                assert_eq!((n.dry, n.wet), (Complex64::new(0.0, 0.0), Complex64::new(0.0, 0.0)));
                let total = n.dry_static + n.wet_static;
                let smith_weintraub = 77.6 / t * (1000.0 + 4810.0 * e / t);
                assert!((total / smith_weintraub - 1.0).abs() < 2e-3, "{t} {e}: {total} {smith_weintraub}");
                assert!((total / refractivity_thayer74(&state) - 1.0).abs() < 1.5e-3, "{t} {e}: {total}");
            }
        }
    }

    // The two editions describe one continuum: a power law, and the wing of a line at 1780 GHz.
    #[test]
    fn editions_agree_on_the_dispersion_of_vapour() {
        let at = |name: &str, freq: f64| gas_model(name).unwrap().spectrum(&air(290.0, 12.0)).refractivity(freq).wet.re;
        for freq in [50.0, 94.0, 140.0, 220.0, 340.0, 410.0] {
            let (a, b) = (at("mpm89", freq), at("mpm93", freq));
            println!("{freq} GHz: MPM89 {a:.4} ppm, MPM93 {b:.4} ppm");
            assert!((a - b).abs() < 0.05 * a.abs().max(b.abs()) + 0.01, "{freq}: {a} {b}");
        }
    }
}
