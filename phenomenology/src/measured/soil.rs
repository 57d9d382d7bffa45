//! Bare soil against moisture.
//!
//! The soil is a smooth sandy loam at 300 K, seen at 20 degrees as the mean of h and v, under a sky of 5 K. Texture and temperature were
//! not published with the numbers. Emissivities are times 300 K.

use super::comparison::{MeasuredError, Point, rows};
use crate::dielectrics::{Extrapolation, Material};
use crate::surfaces::{Roughness, Sky, StackDescription, SurfaceError, SurfaceModel};
use serde::Deserialize;

const TEMPERATURE_K: f64 = 300.0;
const SKY_K: f64 = 5.0;
const ANGLE_RAD: f64 = 20.0 * std::f64::consts::PI / 180.0;

#[derive(Deserialize)]
struct Row {
    kind: String,
    freq_ghz: f64,
    moisture_from: Option<f64>,
    moisture: f64,
    measured: f64,
}

/// Emissivity and brightness in K.
fn soil(freq_ghz: f64, moisture: f64) -> Result<[f64; 2], SurfaceError> {
    let material = Material::by_name("soil")?;
    let mut state = material.state();
    material.set_texture(&mut state, "sandy-loam")?;
    material.set(&mut state, "moisture", moisture)?;
    material.set(&mut state, "temperature", TEMPERATURE_K)?;
    let stack = StackDescription::of_material(material, state, None).resolve(freq_ghz * 1e9, Extrapolation::Documented)?;
    let r = SurfaceModel::new(stack, Roughness::Smooth).response(ANGLE_RAD, 0.0, Sky::Symmetric(&|_| SKY_K))?;
    let mean = |x: [f64; 2]| 0.5 * (x[0] + x[1]);
    Ok([mean(r.emissivity), mean(r.brightness_k())])
}

pub(super) fn compare() -> Result<Vec<Point>, MeasuredError> {
    let rows: Vec<Row> = rows(include_str!("../../tables/measured/soil.csv"))?;
    rows.iter()
        .map(|row| {
            let wet = soil(row.freq_ghz, row.moisture)?;
            let (measured, model) = match row.moisture_from {
                Some(dry) => (row.measured, soil(row.freq_ghz, dry)?[1] - wet[1]),
                None => (row.measured * TEMPERATURE_K, wet[0] * TEMPERATURE_K),
            };
            let name = format!("{}, {} GHz, moisture {}", row.kind, row.freq_ghz, row.moisture);
            Ok(Point { name, measured, sigma: None, model, fitted: false })
        })
        .collect()
}
