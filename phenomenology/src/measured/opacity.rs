//! Zenith opacity in the windows at 350 and 677 GHz, given that at 225 GHz.
//!
//! The profile is sub-tropical winter from the height of the summit. For each opacity at 225 GHz its vapour is scaled to give it. A filter
//! passes 30 GHz about its centre evenly, and its opacity is that of the mean transmission.

use super::comparison::{MeasuredError, Point, rows};
use super::sky::{moistened, vapour_factor};
use crate::atmosphere::Geometry;
use serde::Deserialize;

/// Height of the summit, km.
const SUMMIT_KM: f64 = 4.092;
/// Opacities at 225 GHz, from dry to ordinary nights.
const AT_225: [f64; 4] = [0.04, 0.06, 0.08, 0.1];

#[derive(Deserialize)]
struct Row {
    filters: String,
    freq_ghz: f64,
    a: f64,
    sigma_a: f64,
    b: f64,
    sigma_b: f64,
}

fn opacity(factor: f64, freqs_ghz: &[f64]) -> Result<f64, MeasuredError> {
    let rows = moistened("stw", factor)?.sky_from(SUMMIT_KM, freqs_ghz, &[0.0], Geometry::Plane)?;
    Ok(-(rows.iter().map(|r| (-r.tau_np).exp()).sum::<f64>() / rows.len() as f64).ln())
}

pub(super) fn compare() -> Result<Vec<Point>, MeasuredError> {
    let rows: Vec<Row> = rows(include_str!("../../tables/measured/opacity.csv"))?;
    let mut points = Vec::new();
    for tau in AT_225 {
        let factor = vapour_factor(tau, |x| opacity(x, &[225.0]))?;
        for row in &rows {
            let band: Vec<f64> = (-7..=7).map(|k| row.freq_ghz + 2.0 * f64::from(k)).collect();
            points.push(Point {
                name: format!("{}, {tau} at 225 GHz", row.filters),
                measured: row.a * (tau - row.b),
                sigma: Some((row.sigma_a * (tau - row.b)).hypot(row.a * row.sigma_b)),
                model: opacity(factor, &band)?,
                fitted: false,
            });
        }
    }
    Ok(points)
}
