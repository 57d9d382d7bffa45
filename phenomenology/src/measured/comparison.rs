//! Measurements and models side by side.

use crate::atmosphere::PhysicsError;
use crate::surfaces::SurfaceError;
use serde::de::DeserializeOwned;
use thiserror::Error;

/// An error of a comparison.
#[derive(Debug, Error)]
pub enum MeasuredError {
    /// A model of a surface.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// A model of the air.
    #[error(transparent)]
    Air(#[from] PhysicsError),
    /// A table that cannot be read.
    #[error("table of measurements: {0}")]
    Table(#[from] csv::Error),
    /// Anything else; the message says what.
    #[error("{0}")]
    Refused(String),
}

/// One measured value.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// What it is, such as `Berkeley, 10 GHz`.
    pub name: String,
    /// The measured value.
    pub measured: f64,
    /// Its stated uncertainty, one standard deviation.
    pub sigma: Option<f64>,
    /// The value of the models.
    pub model: f64,
    /// Whether the model was fitted to this value. Such points do not count in bias and rms.
    pub fitted: bool,
}

/// A set of measurements with the values of the models.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// Name of the set.
    pub name: &'static str,
    /// Unit of the values.
    pub unit: &'static str,
    /// Its points.
    pub points: Vec<Point>,
}

impl Comparison {
    /// Model minus measurement of the points that were not fitted.
    pub fn differences(&self) -> impl Iterator<Item = f64> + '_ {
        self.points.iter().filter(|p| !p.fitted).map(|p| p.model - p.measured)
    }

    /// Mean of model minus measurement.
    #[must_use]
    pub fn bias(&self) -> f64 {
        self.differences().sum::<f64>() / self.differences().count() as f64
    }

    /// Root of the mean square of model minus measurement.
    #[must_use]
    pub fn rms(&self) -> f64 {
        (self.differences().map(|d| d * d).sum::<f64>() / self.differences().count() as f64).sqrt()
    }
}

/// Rows of a table with `#` comments.
pub(super) fn rows<T: DeserializeOwned>(text: &str) -> Result<Vec<T>, MeasuredError> {
    Ok(csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(text.as_bytes()).deserialize().collect::<Result<_, _>>()?)
}
