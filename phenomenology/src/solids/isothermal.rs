//! A scene of one temperature, for tests of the tracer: every pixel must show that temperature.

use super::air::atmosphere;
use super::file::AtmosphereRow;
use super::scene::SolidScene;
use crate::error::{Result, SceneError};
use crate::geometry::At;
use toml::Spanned;

impl SolidScene {
    /// The same scene with all materials, the air and space at one temperature in K. The permittivities stay those at the temperatures of
    /// the scene, so the reflections do not change.
    ///
    /// # Errors
    /// A temperature outside the range of the air.
    pub fn isothermal(mut self, temperature_k: f64) -> Result<Self> {
        let mut row = self.file.atmosphere.take().map_or_else(AtmosphereRow::default, Spanned::into_inner);
        row.isothermal_k = (!row.vacuum).then_some(temperature_k);
        row.background_k = temperature_k;
        (row.surface_temperature_k, row.surface_pressure_hpa) = (None, None);
        self.air = atmosphere(&row).map_err(|e| SceneError::air(At(0), e))?;
        self.file.atmosphere = Some(Spanned::new(0..0, row));
        for surface in &mut self.surfaces {
            surface.stack.layers.iter_mut().for_each(|l| l.temperature_k = temperature_k);
            if let Some(canopy) = &mut surface.canopy {
                canopy.temperature_k = temperature_k;
            }
        }
        if let Some(weather) = &mut self.weather {
            weather.emit_at(temperature_k);
        }
        self.covers.forget_temperatures();
        Ok(self)
    }
}
