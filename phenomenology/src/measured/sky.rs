//! The zenith sky at 1.4 to 90 GHz.
//!
//! The profile is mid-latitude summer from the height of the site. Its vapour is scaled by one factor for each site, so that the
//! value at one frequency is the measured one; the others are predicted.

use super::comparison::{MeasuredError, Point, rows};
use crate::atmosphere::planck::{COSMIC_BACKGROUND_K, black_body_radiance, rayleigh_jeans_temperature_k};
use crate::atmosphere::{AirState, Atmosphere, Geometry, Level, Profile, gas_model, reference_profile};
use serde::Deserialize;

#[derive(Deserialize)]
struct Row {
    site: String,
    altitude_km: f64,
    freq_ghz: f64,
    measured_k: f64,
    sigma_k: f64,
    vapour_from_ghz: Option<f64>,
}

/// A reference atmosphere with its vapour times a factor. Vapour above saturation is not refused.
pub(super) fn moistened(profile: &str, factor: f64) -> Result<Atmosphere, MeasuredError> {
    let reference = reference_profile(profile)?;
    let levels = reference
        .levels()
        .iter()
        .map(|l| Ok(Level { air: AirState::new(l.air.pressure_hpa(), l.air.temperature_k(), factor * l.air.vapour_pressure_hpa())?, ..*l }))
        .collect::<Result<Vec<_>, MeasuredError>>()?;
    Ok(Atmosphere::new(Profile::new(format!("{profile} with vapour x {factor}"), levels)?, gas_model("mpm89")?)?)
}

/// The factor at which a growing function of the vapour has a value.
pub(super) fn vapour_factor(wanted: f64, value: impl Fn(f64) -> Result<f64, MeasuredError>) -> Result<f64, MeasuredError> {
    let (mut low, mut high) = (0.0, 4.0);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if value(middle)? < wanted {
            low = middle;
        } else {
            high = middle;
        }
    }
    Ok(0.5 * (low + high))
}

/// Emission of the air at the zenith, RJ, K.
fn emission_k(factor: f64, altitude_km: f64, freq_ghz: f64) -> Result<f64, MeasuredError> {
    let row = moistened("mls", factor)?.sky_from(altitude_km, &[freq_ghz], &[0.0], Geometry::Plane)?[0];
    let background = rayleigh_jeans_temperature_k(freq_ghz, black_body_radiance(freq_ghz, COSMIC_BACKGROUND_K));
    Ok(row.tb_rj_k - background * (-row.tau_np).exp())
}

pub(super) fn compare() -> Result<Vec<Point>, MeasuredError> {
    let rows: Vec<Row> = rows(include_str!("../../tables/measured/sky.csv"))?;
    rows.iter()
        .map(|row| {
            let source = row.vapour_from_ghz.and_then(|f| rows.iter().find(|r| r.site == row.site && r.freq_ghz == f));
            let factor = match source {
                Some(s) => vapour_factor(s.measured_k, |x| emission_k(x, s.altitude_km, s.freq_ghz))?,
                None => 1.0,
            };
            Ok(Point {
                name: format!("{}, {} GHz", row.site, row.freq_ghz),
                measured: row.measured_k,
                sigma: Some(row.sigma_k),
                model: emission_k(factor, row.altitude_km, row.freq_ghz)?,
                fitted: row.vapour_from_ghz == Some(row.freq_ghz),
            })
        })
        .collect()
}
