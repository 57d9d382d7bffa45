//! The sea under strong wind.
//!
//! The model has facets of slopes by Cox and Munk, and foam. The sky is that of a mid-latitude winter, the water has 280 K and 35 psu.

use super::comparison::{MeasuredError, Point, rows};
use crate::atmosphere::{Atmosphere, Geometry};
use crate::dielectrics::{Extrapolation, Material};
use crate::surfaces::{Sky, StackDescription, SurfaceModel};
use serde::Deserialize;

#[derive(Deserialize)]
struct Row {
    freq_ghz: f64,
    wind_from: f64,
    wind_to: f64,
    measured_k_per_m_s: f64,
}

pub(super) fn compare() -> Result<Vec<Point>, MeasuredError> {
    let rows: Vec<Row> = rows(include_str!("../../tables/measured/sea.csv"))?;
    let air = Atmosphere::reference("mlw", "mpm89")?;
    let material = Material::by_name("sea-water").map_err(crate::surfaces::SurfaceError::from)?;
    rows.iter()
        .map(|row| {
            let tau = air.sky(&[row.freq_ghz], &[0.0], Geometry::Plane)?[0].tau_np;
            let sky = |zenith: f64| 2.7 + 265.0 * (1.0 - (-tau / zenith.cos().max(1e-3)).exp());
            let mut state = material.state();
            material.set(&mut state, "temperature", 280.0).map_err(crate::surfaces::SurfaceError::from)?;
            let stack = StackDescription::of_material(material, state, None).resolve(row.freq_ghz * 1e9, Extrapolation::Refuse)?;
            let brightness = |wind: f64| -> Result<f64, MeasuredError> {
                let model = SurfaceModel::new(stack.clone(), format!("sea:{wind},foam").parse()?);
                let [h, v] = model.brightness_k(0.0, 0.0, Sky::Symmetric(&sky))?;
                Ok(0.5 * (h + v))
            };
            let model = (brightness(row.wind_to)? - brightness(row.wind_from)?) / (row.wind_to - row.wind_from);
            let name = format!("{} GHz, {} to {} m/s", row.freq_ghz, row.wind_from, row.wind_to);
            Ok(Point { name, measured: row.measured_k_per_m_s, sigma: None, model, fitted: false })
        })
        .collect()
}
