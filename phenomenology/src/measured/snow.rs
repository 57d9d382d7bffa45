//! Dry snow on land.
//!
//! Each type is one layer on frozen soil. Its thickness and density are assumed. Its correlation length is the one number that was fitted, to the
//! emissivity at 50.3 GHz; the nine other frequencies are predicted.

use super::comparison::{MeasuredError, Point};
use crate::dielectrics::Extrapolation;
use crate::surfaces::{Roughness, Sky, StackDescription, SurfaceModel};

/// Name in the table, thickness m, density kg/m3.
const TYPES: [(&str, f64, f64); 4] = [("powder", 0.3, 150.0), ("shallow", 0.3, 250.0), ("medium", 0.6, 280.0), ("deep", 1.0, 300.0)];

/// Frequency to which the correlation length is fitted, GHz.
const FITTED_GHZ: f64 = 50.3;

/// Mean of the emissivities h and v at 50 degrees.
fn emissivity(thickness_m: f64, density: f64, length_mm: f64, freq_ghz: f64) -> Result<f64, MeasuredError> {
    let text = format!(
        "coherent = false\n[[layer]]\nmaterial = \"dry-snow\"\nthickness_m = {thickness_m}\ndensity_kg_m3 = {density}\ntemperature_k = 260\n\
         scatter = \"iba:{length_mm}mm\"\n[[layer]]\nmaterial = \"frozen-soil\"\ntemperature_k = 268\n"
    );
    let stack = StackDescription::from_toml(&text)?.resolve(freq_ghz * 1e9, Extrapolation::Documented)?;
    let r = SurfaceModel::new(stack, Roughness::Smooth).response(50f64.to_radians(), 0.0, Sky::Symmetric(&|_| 0.0))?;
    Ok(0.5 * (r.emissivity[0] + r.emissivity[1]))
}

/// The correlation length in mm at which the emissivity at 50.3 GHz has a value.
fn correlation_length_mm(thickness_m: f64, density: f64, wanted: f64) -> Result<f64, MeasuredError> {
    let (mut low, mut high) = (0.01, 0.4);
    for _ in 0..10 {
        let middle = 0.5 * (low + high);
        if emissivity(thickness_m, density, middle, FITTED_GHZ)? > wanted {
            low = middle;
        } else {
            high = middle;
        }
    }
    Ok(0.5 * (low + high))
}

pub(super) fn compare() -> Result<Vec<Point>, MeasuredError> {
    let text = include_str!("../../tables/measured/snow.csv");
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(text.as_bytes());
    let freqs: Vec<String> = reader.headers()?.iter().skip(1).map(str::to_owned).collect();
    let number = |text: &str| text.parse::<f64>().map_err(|_| MeasuredError::Refused(format!("`{text}` in snow.csv is no number")));
    let mut points = Vec::new();
    for row in reader.records() {
        let row = row?;
        let name = &row[0];
        let Some(&(_, thickness, density)) = TYPES.iter().find(|t| t.0 == name) else {
            return Err(MeasuredError::Refused(format!("snow.csv has a type `{name}` without a layer")));
        };
        let values = row.iter().skip(1).map(number).collect::<Result<Vec<_>, _>>()?;
        let Some(fitted) = freqs.iter().position(|f| f.parse() == Ok(FITTED_GHZ)) else {
            return Err(MeasuredError::Refused(format!("snow.csv has no column of {FITTED_GHZ} GHz")));
        };
        let length = correlation_length_mm(thickness, density, values[fitted])?;
        for (freq, value) in freqs.iter().zip(values) {
            let freq_ghz = number(freq)?;
            points.push(Point {
                name: format!("{name} snow of {length:.2} mm, {freq} GHz"),
                measured: value,
                sigma: None,
                model: emissivity(thickness, density, length, freq_ghz)?,
                fitted: freq_ghz == FITTED_GHZ,
            });
        }
    }
    Ok(points)
}
