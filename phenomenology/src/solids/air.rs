//! The air of a scene, from its table `[atmosphere]`.

use super::file::AtmosphereRow;
use super::scene::Air;
use crate::atmosphere::{
    Atmosphere, Humidity, Layer, PhysicsError, Profile, SurfaceWeather, check_range, gas_model, rain_model, reference_profile,
};

/// The air that the table `[atmosphere]` describes.
pub(super) fn atmosphere(row: &AtmosphereRow) -> Result<Air, PhysicsError> {
    let geometry = row.geometry.parse()?;
    let background_k = check_range("background temperature", row.background_k, "K", 0.1, 1e3)?;
    let altitude_km = check_range("altitude of the scene", row.altitude_m * 1e-3, "km", 0.0, 20.0)?;
    if row.vacuum {
        return Ok(Air { atmosphere: None, geometry, altitude_km, background_k });
    }
    let weather = SurfaceWeather {
        pressure_hpa: row.surface_pressure_hpa,
        temperature_k: row.surface_temperature_k,
        humidity: row.relative_humidity_percent.map(Humidity::RelativePercent),
    };
    let (profile, background_k) = match row.isothermal_k {
        // Space has the same temperature as the air.
        Some(t) => {
            let (pressure, humidity) = (row.surface_pressure_hpa.unwrap_or(1013.25), row.relative_humidity_percent.unwrap_or(50.0));
            (Profile::isothermal(t, pressure, humidity)?, t)
        }
        None => (reference_profile(&row.profile)?.with_surface_weather(&weather)?, background_k),
    };
    let layers = row.layers.iter().map(|l| l.parse::<Layer>()).collect::<Result<Vec<_>, _>>()?;
    let atmosphere = Atmosphere::new(profile, gas_model(&row.gas)?)?
        .with_rain_model(rain_model(&row.rain)?)
        .with_background(background_k)?
        .with_layers(layers)?;
    Ok(Air { atmosphere: Some(atmosphere), geometry, altitude_km, background_k })
}
