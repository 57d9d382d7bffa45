//! The table of rain models.

use super::itu_p838::ItuP838;
use super::model::RainModel;
use super::olsen78::Olsen78;
use crate::atmosphere::error::{PhysicsError, find_by_name};
use std::sync::Arc;

/// A row of the table of rain models.
#[derive(Debug, Clone, Copy)]
pub struct RainModelEntry {
    /// Name of the model.
    pub name: &'static str,
    /// One line for help texts and the book.
    pub summary: &'static str,
    /// Publication.
    pub reference: &'static str,
    /// Reads the coefficients of the model.
    pub build: fn() -> Result<Arc<dyn RainModel>, PhysicsError>,
}

/// Every rain model; the first is the default.
pub const RAIN_MODELS: &[RainModelEntry] = &[
    RainModelEntry {
        name: "p838",
        summary: "ITU-R power law for both polarisations, up to 300 mm/h (default)",
        reference: "Recommendation ITU-R P.838-3 (2005)",
        build: || Ok(Arc::new(ItuP838::new()?)),
    },
    RainModelEntry {
        name: "olsen78",
        summary: "period power law of frequency bands, up to 25 mm/h",
        reference: "Olsen, Rogers & Hodge 1978, IEEE Trans. AP 26, 318",
        build: || Ok(Arc::new(Olsen78)),
    },
];

/// The rain model of a name.
///
/// # Errors
/// [`PhysicsError::UnknownName`] with the known names.
pub fn rain_model(name: &str) -> Result<Arc<dyn RainModel>, PhysicsError> {
    (find_by_name("rain model", name, RAIN_MODELS, |e| e.name)?.build)()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::atmosphere::rain::rain_attenuation;

    #[test]
    fn unknown_model_lists_the_known() {
        assert!(rain_model("p837").unwrap_err().to_string().contains("p838, olsen78"));
    }

    #[test]
    fn no_rain_is_no_attenuation_and_negative_rain_an_error() {
        for entry in RAIN_MODELS {
            let model = (entry.build)().unwrap();
            let none = rain_attenuation(model.as_ref(), 35.0, 0.0).unwrap();
            assert_eq!(none.mean_db_per_km(), 0.0);
            let message = rain_attenuation(model.as_ref(), 35.0, -1.0).unwrap_err().to_string();
            assert!(message.starts_with("rain rate -1 mm/h is outside"), "{message}");
        }
    }
}
