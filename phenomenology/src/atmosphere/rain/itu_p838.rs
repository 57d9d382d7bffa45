//! The ITU-R rain power law with polarisation and path elevation.
//!
//! # Reference
//! Recommendation ITU-R P.838-3 (2005), equations (1) to (5).

use super::model::{PowerLaw, RainModel};
use crate::atmosphere::csv_table::CsvTable;
use crate::atmosphere::error::{PhysicsError, check_frequency, check_range};

const COEFFICIENTS: &str = include_str!("../../../tables/rain/itu_p838_3.csv");

/// One curve: a sum of Gaussians in log10 f and a straight line.
#[derive(Debug, Clone, Default)]
struct Curve {
    gaussians: Vec<[f64; 3]>,
    slope: f64,
    constant: f64,
}

impl Curve {
    fn at(&self, log10_f: f64) -> f64 {
        let bumps: f64 = self.gaussians.iter().map(|&[a, b, c]| a * (-((log10_f - b) / c).powi(2)).exp()).sum();
        bumps + self.slope * log10_f + self.constant
    }
}

/// The P.838-3 model with its coefficients.
#[derive(Debug, Clone)]
pub struct ItuP838 {
    log_k: [Curve; 2],
    alpha: [Curve; 2],
}

impl ItuP838 {
    /// Reads the coefficients that come with the crate.
    ///
    /// # Errors
    /// [`PhysicsError::Table`] if the table is damaged.
    pub fn new() -> Result<Self, PhysicsError> {
        let table = CsvTable::read("itu_p838_3", COEFFICIENTS)?;
        let curve = |name, gaussians| read_curve(&table, name, gaussians);
        Ok(Self { log_k: [curve("kH", 4)?, curve("kV", 4)?], alpha: [curve("alphaH", 5)?, curve("alphaV", 5)?] })
    }

    /// Power law for a path of any elevation and any linear polarisation.
    ///
    /// `tilt_deg` is the polarisation tilt from the horizontal: 0 horizontal,
    /// 90 vertical, 45 also for circular polarisation.
    ///
    /// # Errors
    /// [`PhysicsError::OutOfRange`] outside 1-1000 GHz, elevation 0-90 deg or tilt 0-180 deg.
    ///
    /// # Reference
    /// ITU-R P.838-3, equations (4) and (5).
    pub fn power_law(&self, freq_ghz: f64, elevation_deg: f64, tilt_deg: f64) -> Result<PowerLaw, PhysicsError> {
        check_frequency(freq_ghz)?;
        check_range("path elevation", elevation_deg, "deg", 0.0, 90.0)?;
        check_range("polarisation tilt", tilt_deg, "deg", 0.0, 180.0)?;
        let [h, v] = self.power_laws(freq_ghz);
        let turn = elevation_deg.to_radians().cos().powi(2) * (2.0 * tilt_deg.to_radians()).cos();
        let k = 0.5 * (h.k + v.k + (h.k - v.k) * turn);
        let (kah, kav) = (h.k * h.alpha, v.k * v.alpha);
        Ok(PowerLaw { k, alpha: (kah + kav + (kah - kav) * turn) / (2.0 * k) })
    }
}

impl RainModel for ItuP838 {
    fn max_rate_mm_h(&self) -> f64 {
        300.0
    }

    fn power_laws(&self, freq_ghz: f64) -> [PowerLaw; 2] {
        let log10_f = freq_ghz.log10();
        [0, 1].map(|pol| PowerLaw { k: 10f64.powf(self.log_k[pol].at(log10_f)), alpha: self.alpha[pol].at(log10_f) })
    }
}

fn read_curve(table: &CsvTable, name: &str, gaussians: usize) -> Result<Curve, PhysicsError> {
    let mut curve = Curve::default();
    let mut has_line = false;
    for row in table.rows.iter().filter(|row| row.fields.get(0) == Some(name)) {
        let number = |column| table.number(row, column);
        if row.fields.get(1) == Some("m_and_c") {
            (curve.slope, curve.constant) = (number(2)?, number(3)?);
            has_line = true;
        } else {
            curve.gaussians.push([number(2)?, number(3)?, number(4)?]);
        }
    }
    if curve.gaussians.len() != gaussians || !has_line {
        return Err(table.fault(0, format!("curve {name} is incomplete")));
    }
    Ok(curve)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tilt_and_elevation_reduce_to_the_pure_polarisations() {
        let model = ItuP838::new().unwrap();
        let [h, v] = model.power_laws(35.0);
        let horizontal = model.power_law(35.0, 0.0, 0.0).unwrap();
        let vertical = model.power_law(35.0, 0.0, 90.0).unwrap();
        assert!((horizontal.k / h.k - 1.0).abs() < 1e-12);
        assert!((vertical.alpha / v.alpha - 1.0).abs() < 1e-12);
    }

    #[test]
    fn straight_up_both_polarisations_are_equal() {
        let model = ItuP838::new().unwrap();
        let a = model.power_law(94.0, 90.0, 0.0).unwrap();
        let b = model.power_law(94.0, 90.0, 90.0).unwrap();
        assert!((a.k / b.k - 1.0).abs() < 1e-12 && (a.alpha - b.alpha).abs() < 1e-12);
    }
}
