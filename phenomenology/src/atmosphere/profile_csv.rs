//! Reads profiles from CSV text.

use super::air::{AirState, Humidity};
use super::csv_table::CsvTable;
use super::error::PhysicsError;
use super::profile::{Level, Profile, TOP_OF_ATMOSPHERE_KM};

/// Largest number of levels accepted.
const MAX_LEVELS: usize = 100_000;

/// A measure of humidity made from a number.
type ToHumidity = fn(f64) -> Humidity;

/// The columns of humidity accepted, in order of preference.
const HUMIDITY_COLUMNS: [(&str, ToHumidity); 3] =
    [("e_hpa", Humidity::VapourPressure), ("rho_v_g_m3", Humidity::VapourDensity), ("rh_liquid_pct", Humidity::RelativePercent)];

impl Profile {
    /// Reads a profile from CSV text with a header line.
    ///
    /// Columns: `z_km`, `p_hpa`, `t_k` and one of `e_hpa`, `rho_v_g_m3`,
    /// `rh_liquid_pct` (the first present is used). Other columns and lines beginning
    /// with `#` are ignored.
    ///
    /// # Errors
    /// [`PhysicsError::Table`] with the line at fault, or as [`Profile::new`].
    pub fn from_csv(name: impl Into<String>, text: &str) -> Result<Self, PhysicsError> {
        let name = name.into();
        let levels = read_levels(&name, text)?;
        Self::new(name, levels)
    }
}

fn read_levels(name: &str, text: &str) -> Result<Vec<Level>, PhysicsError> {
    let table = CsvTable::read(name, text)?;
    let find = |column: &str| table.header.fields.iter().position(|h| h == column);
    let missing = |column: &str| {
        table.fault(
            table.header.line,
            format!("no column {column}; needed are z_km, p_hpa, t_k and one of e_hpa, rho_v_g_m3, rh_liquid_pct"),
        )
    };
    let need = |column: &str| find(column).ok_or_else(|| missing(column));
    let (z, p, t) = (need("z_km")?, need("p_hpa")?, need("t_k")?);
    let (humidity_column, humidity) =
        HUMIDITY_COLUMNS.iter().find_map(|(column, kind)| find(column).map(|at| (at, *kind))).ok_or_else(|| {
            table.fault(table.header.line, "no humidity; give one of the columns e_hpa, rho_v_g_m3, rh_liquid_pct".to_owned())
        })?;
    if table.rows.len() > MAX_LEVELS {
        return Err(table.fault(0, format!("{} levels, expected at most {MAX_LEVELS}", table.rows.len())));
    }

    let mut levels: Vec<Level> = Vec::new();
    // Nothing above the top of the atmosphere is used. The lines above it are only checked for their order, so that profiles to
    // 100 km can be read although the absorption models end at 3 hPa.
    let mut last_above: Option<f64> = None;
    for row in &table.rows {
        let z_km = table.number(row, z)?;
        if let Some(previous) = last_above {
            if z_km.is_nan() || z_km <= previous {
                return Err(table.fault(row.line, format!("height {z_km} km follows {previous} km")));
            }
            last_above = Some(z_km);
            continue;
        }
        if z_km >= TOP_OF_ATMOSPHERE_KM {
            last_above = Some(z_km);
        }
        let humidity = humidity(table.number(row, humidity_column)?);
        let air = AirState::with_humidity(table.number(row, p)?, table.number(row, t)?, humidity)
            .map_err(|e| table.fault(row.line, e.to_string()))?;
        levels.push(Level { z_km, air });
    }
    Ok(levels)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_humidity_column_gives_the_same_air() {
        let air = AirState::new(1000.0, 290.0, 10.0).unwrap();
        let texts = [
            "t_k,z_km,p_hpa,e_hpa\n290,0,1000,10\n".to_owned(),
            format!("z_km,p_hpa,t_k,rho_v_g_m3\n0,1000,290,{}\n", air.vapour_density_g_m3()),
            format!("z_km,p_hpa,t_k,rh_liquid_pct\n0,1000,290,{}\n", air.relative_humidity_percent()),
        ];
        for text in texts {
            let levels = read_levels("x", &text).unwrap();
            assert!((levels[0].air.vapour_pressure_hpa() - 10.0).abs() < 1e-12);
        }
    }

    #[test]
    fn levels_above_the_top_need_only_be_in_order() {
        let text = "z_km,p_hpa,t_k,e_hpa\n0,1000,290,1\n35,6,240,0\n50,0.8,270,0\n";
        assert_eq!(read_levels("x", text).unwrap().len(), 2);
        let message = read_levels("x", &format!("{text}40,3,250,0\n")).unwrap_err().to_string();
        assert!(message.contains("line 5: height 40 km follows 50 km"), "{message}");
    }

    #[test]
    fn faults_name_table_line_and_value() {
        let cases = [
            ("z_km,p_hpa,t_k\n0,1000,290\n", "line 1: no humidity"),
            ("z_km,t_k,e_hpa\n0,290,1\n", "no column p_hpa"),
            ("# c\nz_km,p_hpa,t_k,e_hpa\n0,1000,warm,1\n", "line 3: 'warm' is not a number"),
            ("z_km,p_hpa,t_k,e_hpa\n0,1000,0,1\n", "line 2: temperature 0 K"),
            ("z_km,p_hpa,t_k,rh_liquid_pct\n0,1000,290,-5\n", "relative humidity -5 %"),
            ("z_km,p_hpa,t_k,e_hpa\n0,1000,290\n", "line"),
            ("", "no column z_km"),
        ];
        for (text, expected) in cases {
            let message = read_levels("mine.csv", text).unwrap_err().to_string();
            assert!(message.contains(expected) && message.contains("mine.csv"), "{message}");
        }
    }
}
