//! First-year and multi-year sea ice.
//!
//! Both lie under 0.1 m of snow (300 kg/m3, 0.1 mm of correlation length). First-year ice is 1.5 m thick, at 260 K, with 6 psu and brine pockets of 0.15 mm of correlation length. Multi-year ice has 0.3 m of ice with 0.7 psu
//! and 20 per cent of air bubbles of 0.3 mm above 2 m of ice with 2 psu. Snow, thickness, salt and bubbles were not published with the numbers.

use super::comparison::{MeasuredError, Point, rows};
use crate::constants::SPEED_OF_LIGHT_M_S;
use crate::dielectrics::Extrapolation;
use crate::surfaces::{Roughness, Sky, StackDescription, SurfaceModel};
use serde::Deserialize;

const SNOW: &str = "coherent = false
[[layer]]
material = \"dry-snow\"
thickness_m = 0.1
density_kg_m3 = 300
temperature_k = 252
scatter = \"iba:0.1mm\"
";

const FIRST_YEAR: &str = "[[layer]]
material = \"sea-ice\"
thickness_m = 1.5
temperature_k = 260
salinity_psu = 6
scatter = \"iba:0.15mm\"
[[layer]]
material = \"sea-water\"
temperature_k = 271.3
";

const MULTI_YEAR: &str = "[[layer]]
material = \"sea-ice\"
thickness_m = 0.3
temperature_k = 255
salinity_psu = 0.7
porosity = 0.2
scatter = \"iba:0.3mm\"
[[layer]]
material = \"sea-ice\"
thickness_m = 2
temperature_k = 260
salinity_psu = 2
scatter = \"iba:0.15mm\"
[[layer]]
material = \"sea-water\"
temperature_k = 271.3
";

#[derive(Deserialize)]
struct Row {
    ice: String,
    wavelength_cm: f64,
    measured: f64,
}

pub(super) fn compare() -> Result<Vec<Point>, MeasuredError> {
    let rows: Vec<Row> = rows(include_str!("../../tables/measured/sea_ice.csv"))?;
    rows.iter()
        .map(|row| {
            let text = SNOW.to_owned() + if row.ice == "first-year" { FIRST_YEAR } else { MULTI_YEAR };
            let freq_hz = SPEED_OF_LIGHT_M_S / (1e-2 * row.wavelength_cm);
            let stack = StackDescription::from_toml(&text)?.resolve(freq_hz, Extrapolation::Documented)?;
            let r = SurfaceModel::new(stack, Roughness::Smooth).response(0.0, 0.0, Sky::Symmetric(&|_| 0.0))?;
            Ok(Point {
                name: format!("{} ice, {} cm", row.ice, row.wavelength_cm),
                measured: row.measured,
                sigma: None,
                model: 0.5 * (r.emissivity[0] + r.emissivity[1]),
                fitted: false,
            })
        })
        .collect()
}
