//! Options of the atmosphere: profile, gas and rain model, weather at the surface, layers.

use super::table::Cell;
use super::values::{exact, read_text};
use crate::cli::failure::{Context as _, Failure, Result};
use cittert_arrays::quantity::{Density, Percent, Pressure, Temperature};
use cittert_phenomenology::atmosphere::{
    ATMOSPHERES, Atmosphere, Humidity, Layer, Profile, SurfaceWeather, gas_model, rain_model, reference_profile,
};
use clap::Args;
use std::path::Path;

/// Largest profile file that is read, bytes.
const MAX_FILE_BYTES: u64 = 64 << 20;

/// Options of the atmosphere.
#[derive(Debug, Args)]
pub(super) struct AirArgs {
    /// Built-in atmosphere, or CSV file with the columns z_km, p_hpa, t_k and one of e_hpa, rho_v_g_m3, rh_liquid_pct.
    #[arg(long, value_name = "NAME", value_delimiter = ',', default_value = "ussa")]
    atmosphere: Vec<String>,
    /// Gas model: mpm89 or mpm93.
    #[arg(long, value_name = "NAME", value_delimiter = ',', default_value = "mpm89")]
    model: Vec<String>,
    /// Rain model: p838 or olsen78.
    #[arg(long, value_name = "NAME", default_value = "p838")]
    rain_model: String,
    /// Layer of cloud, fog, haze, ice or rain, such as cloud:0.5km-1.5km:0.2g/m3 or rain:0km-2km:5mm/h.
    #[arg(long, value_name = "KIND:BASE-TOP:AMOUNT", value_delimiter = ',')]
    layer: Vec<Layer>,
    /// Pressure at the surface. The profile is scaled to meet it.
    #[arg(long, visible_alias = "pressure", value_name = "PRESSURE", allow_hyphen_values = true)]
    surface_pressure: Option<Pressure>,
    /// Temperature at the surface. The profile is shifted to meet it, by less and less up to a height of 10 km.
    #[arg(long, visible_alias = "temperature", value_name = "TEMP", allow_hyphen_values = true)]
    surface_temperature: Option<Temperature>,
    /// Relative humidity at the surface. The humidity of the profile is scaled to meet it.
    #[arg(long, visible_alias = "humidity", value_name = "PERCENT", allow_hyphen_values = true)]
    surface_humidity: Option<Percent>,
    /// Density of water vapour at the surface, in place of the relative humidity.
    #[arg(long, visible_alias = "vapour", value_name = "DENSITY", allow_hyphen_values = true, conflicts_with = "surface_humidity")]
    surface_vapour: Option<Density>,
}

/// One combination of an atmosphere and a gas model.
pub(super) struct Air {
    /// Name of the atmosphere, as typed.
    atmosphere: String,
    /// Name of the gas model.
    model: String,
    /// The atmosphere.
    pub(super) air: Atmosphere,
}

impl Air {
    /// The name of the atmosphere, as typed.
    pub(super) fn name(&self) -> String {
        format!("atmosphere {}", self.atmosphere)
    }

    /// The cells that name the atmosphere and its gas model in a table.
    pub(super) fn cells(&self) -> [(&'static str, Cell); 2] {
        [("atmosphere", self.atmosphere.as_str().into()), ("model", self.model.as_str().into())]
    }
}

impl AirArgs {
    /// Number of combinations of atmosphere and gas model.
    pub(super) fn count(&self) -> usize {
        self.atmosphere.len() * self.model.len()
    }

    /// Names of the atmospheres. Those that are not built in are files.
    pub(super) fn names(&self) -> &[String] {
        &self.atmosphere
    }

    /// Every combination of atmosphere and gas model.
    ///
    /// # Errors
    /// Unknown names, profiles that cannot be read, impossible weather or layers.
    pub(super) fn build(&self) -> Result<Vec<Air>> {
        let mut all = Vec::with_capacity(self.count());
        for name in &self.atmosphere {
            let profile = load(name).and_then(|p| Ok(p.with_surface_weather(&self.weather())?)).context(name)?;
            for model in &self.model {
                let air = Atmosphere::new(profile.clone(), gas_model(model)?)?
                    .with_rain_model(rain_model(&self.rain_model)?)
                    .with_layers(self.layer.clone())?;
                all.push(Air { atmosphere: name.clone(), model: model.clone(), air });
            }
        }
        Ok(all)
    }

    fn weather(&self) -> SurfaceWeather {
        let relative = self.surface_humidity.map(|h| Humidity::RelativePercent(exact(h.si())));
        SurfaceWeather {
            pressure_hpa: self.surface_pressure.map(|p| exact(p.si() / 1e2)),
            temperature_k: self.surface_temperature.map(Temperature::si),
            humidity: relative.or(self.surface_vapour.map(|v| Humidity::VapourDensity(exact(v.si() * 1e3)))),
        }
    }
}

/// A built-in profile, or the profile in a file.
pub(in crate::cli) fn load(name: &str) -> Result<Profile> {
    if ATMOSPHERES.iter().any(|a| a.name == name) {
        return Ok(reference_profile(name)?);
    }
    let path = Path::new(name);
    if !path.exists() {
        let known: Vec<&str> = ATMOSPHERES.iter().map(|a| a.name).collect();
        let known = known.join(", ");
        return Err(Failure::message(format!("this is neither a built-in atmosphere nor a file; the built-in atmospheres are {known}")));
    }
    Ok(Profile::from_csv(name, &read_text(path, "profile", MAX_FILE_BYTES)?)?)
}
