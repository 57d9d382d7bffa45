//! Line shape and continua shared by the Liebe models.

use super::nitrogen::nitrogen_refractivity_ppm;

/// Power absorption in Np/km of one dB/km: `ln(10)/10`.
pub const NEPER_PER_DECIBEL: f64 = std::f64::consts::LN_10 / 10.0;

/// One line of a gas at one state of air.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpectralLine {
    /// Centre frequency, GHz.
    pub centre_ghz: f64,
    /// Strength `S`; in the unit that makes the refractivity ppm.
    pub strength: f64,
    /// Pressure-broadened half width `g`, GHz.
    pub width_ghz: f64,
    /// Line mixing `d`, dimensionless; zero for water vapour.
    pub mixing: f64,
}

impl SpectralLine {
    /// Imaginary refractivity `N''` of the line in ppm.
    ///
    /// # Reference
    /// Van Vleck & Weisskopf 1945, Rev. Mod. Phys. 17, 227; mixing after Rosenkranz 1975,
    /// IEEE Trans. AP 23, 498.
    #[must_use]
    #[inline]
    pub fn refractivity_ppm(&self, freq_ghz: f64) -> f64 {
        let (f, f0, g, d) = (freq_ghz, self.centre_ghz, self.width_ghz, self.mixing);
        let (below, above) = (f0 - f, f0 + f);
        let g2 = g * g;
        self.strength * (f / f0) * ((g - d * below) / (below * below + g2) + (g - d * above) / (above * above + g2))
    }
}

/// Non-resonant (Debye) absorption of oxygen at one state of air.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DebyeOxygen {
    /// `S0 p_d theta^2`, ppm.
    pub strength: f64,
    /// Relaxation frequency `G`, GHz.
    pub width_ghz: f64,
}

impl DebyeOxygen {
    /// Imaginary refractivity in ppm: `S f G / (f^2 + G^2)`.
    #[must_use]
    pub fn refractivity_ppm(&self, freq_ghz: f64) -> f64 {
        self.strength * freq_ghz * self.width_ghz / (freq_ghz * freq_ghz + self.width_ghz * self.width_ghz)
    }
}

/// A gas model at one state of air, ready to be evaluated at any frequency.
#[derive(Debug, Clone, PartialEq)]
pub struct GasSpectrum {
    /// Water vapour lines.
    pub water_lines: Vec<SpectralLine>,
    /// Water vapour continuum.
    pub water_continuum_ppm_per_ghz: f64,
    /// Oxygen lines.
    pub oxygen_lines: Vec<SpectralLine>,
    /// Factor of `f^2.05` in the real refractivity of the water continuum, ppm.
    pub water_continuum_dispersion_ppm: f64,
    /// Oxygen Debye continuum.
    pub oxygen_debye: DebyeOxygen,
    /// Pressure of dry air, hPa, for nitrogen and the static refractivity.
    pub dry_pressure_hpa: f64,
    /// Pressure of water vapour, hPa, for the static refractivity.
    pub vapour_pressure_hpa: f64,
    /// `300 K / T`.
    pub theta: f64,
}

/// Specific attenuation by each gas, dB/km.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GasAbsorption {
    /// Water vapour, lines and continuum.
    pub water_db_per_km: f64,
    /// Oxygen, lines and Debye continuum.
    pub oxygen_db_per_km: f64,
    /// Pressure-induced nitrogen.
    pub nitrogen_db_per_km: f64,
}

impl GasAbsorption {
    /// Sum of the gases, dB/km.
    #[must_use]
    pub fn total_db_per_km(&self) -> f64 {
        self.water_db_per_km + self.oxygen_db_per_km + self.nitrogen_db_per_km
    }

    /// Sum of the gases as power absorption, Np/km.
    #[must_use]
    pub fn total_np_per_km(&self) -> f64 {
        self.total_db_per_km() * NEPER_PER_DECIBEL
    }
}

impl GasSpectrum {
    /// Specific attenuation at a frequency: `0.1820 f N''` dB/km.
    ///
    /// The frequency is not checked, because this is the inner loop.
    #[must_use]
    pub fn absorption(&self, freq_ghz: f64) -> GasAbsorption {
        let sum = |lines: &[SpectralLine]| -> f64 { lines.iter().map(|line| line.refractivity_ppm(freq_ghz)).sum() };
        let water = sum(&self.water_lines) + self.water_continuum_ppm_per_ghz * freq_ghz;
        // With first-order mixing the far wing of the band can become negative.
        let oxygen_lines = sum(&self.oxygen_lines).max(0.0);
        let oxygen = oxygen_lines + self.oxygen_debye.refractivity_ppm(freq_ghz);
        let nitrogen = nitrogen_refractivity_ppm(freq_ghz, self.dry_pressure_hpa, self.theta);
        let to_db = 0.1820 * freq_ghz;
        GasAbsorption { water_db_per_km: to_db * water, oxygen_db_per_km: to_db * oxygen, nitrogen_db_per_km: to_db * nitrogen }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn line_peaks_at_strength_over_width() {
        let line = SpectralLine { centre_ghz: 183.31, strength: 2.0, width_ghz: 3.0, mixing: 0.0 };
        let peak = line.refractivity_ppm(183.31);
        let far_wing = 3.0 / ((2.0 * 183.31f64).powi(2) + 9.0);
        assert!((peak - 2.0 * (1.0 / 3.0 + far_wing)).abs() < 1e-12);
    }

    #[test]
    fn mixing_moves_strength_across_the_line() {
        let line = SpectralLine { centre_ghz: 60.0, strength: 1.0, width_ghz: 1.0, mixing: 0.1 };
        assert!(line.refractivity_ppm(61.0) > line.refractivity_ppm(59.0));
    }

    #[test]
    fn debye_peaks_at_its_width() {
        let debye = DebyeOxygen { strength: 4.0, width_ghz: 0.5 };
        assert!((debye.refractivity_ppm(0.5) - 2.0).abs() < 1e-12);
    }
}
