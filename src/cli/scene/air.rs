//! The air above a scene, as options: profile, gas and rain model, weather at the surface, layers.

use super::values::exact;
use crate::cli::failure::{Context as _, Failure, Result};
use cittert_arrays::quantity::{Density, Percent, Pressure, Temperature};
use cittert_phenomenology::atmosphere::{
    ATMOSPHERES, Atmosphere, Humidity, Layer, Profile, SurfaceWeather, gas_model, rain_model, reference_profile,
};
use clap::Args;
use std::path::Path;

/// Largest profile file that is read.
const MAX_FILE_BYTES: u64 = 64 << 20;

/// Options that describe the air.
#[derive(Debug, Args)]
pub(super) struct AirArgs {
    /// Built-in atmosphere, or CSV file with z_km, p_hpa, t_k and one of e_hpa, rho_v_g_m3, rh_liquid_pct.
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
    /// Pressure at the surface: the profile is multiplied to meet it.
    #[arg(long, visible_alias = "pressure", value_name = "PRESSURE", allow_hyphen_values = true)]
    surface_pressure: Option<Pressure>,
    /// Temperature at the surface: the difference fades out 10 km up.
    #[arg(long, visible_alias = "temperature", value_name = "TEMP", allow_hyphen_values = true)]
    surface_temperature: Option<Temperature>,
    /// Relative humidity at the surface: that of the profile is multiplied to meet it.
    #[arg(long, visible_alias = "humidity", value_name = "PERCENT", allow_hyphen_values = true)]
    surface_humidity: Option<Percent>,
    /// Vapour density at the surface, in place of the relative humidity.
    #[arg(long, visible_alias = "vapour", value_name = "DENSITY", allow_hyphen_values = true, conflicts_with = "surface_humidity")]
    surface_vapour: Option<Density>,
}

/// One of the atmospheres asked for.
pub(super) struct Air {
    /// Its name, as typed.
    pub(super) atmosphere: String,
    /// Name of its gas model.
    pub(super) model: String,
    /// The air.
    pub(super) air: Atmosphere,
}

impl AirArgs {
    /// How many atmospheres there are.
    pub(super) fn count(&self) -> usize {
        self.atmosphere.len() * self.model.len()
    }

    /// Every combination of atmosphere and gas model.
    ///
    /// # Errors
    /// Unknown names, profiles that cannot be read, impossible weather or layers.
    pub(super) fn build(&self) -> Result<Vec<Air>> {
        let mut all = Vec::with_capacity(self.count());
        for name in &self.atmosphere {
            let profile = load(name)?.with_surface_weather(&self.weather())?;
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

/// A built-in profile, or one in a file.
fn load(name: &str) -> Result<Profile> {
    if ATMOSPHERES.iter().any(|a| a.name == name) {
        return Ok(reference_profile(name)?);
    }
    let path = Path::new(name);
    let Ok(facts) = path.metadata() else {
        let known: Vec<&str> = ATMOSPHERES.iter().map(|a| a.name).collect();
        return Err(Failure::message(format!("{name}: neither a built-in atmosphere nor a file; built in are {}", known.join(", "))));
    };
    if !facts.is_file() || facts.len() > MAX_FILE_BYTES {
        return Err(Failure::message(format!("{name}: no profile; give a CSV file of at most {} MiB", MAX_FILE_BYTES >> 20)));
    }
    let text = std::fs::read_to_string(path).context(name)?;
    Ok(Profile::from_csv(name, &text)?)
}
