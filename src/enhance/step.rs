//! What a step of a chain is: a row of the table, its parameters, and the work on a frame.

use super::psf::Psf;
use crate::{ChainError, Result};
use cittert_arrays::BrightnessUnit;
use ndarray::Array2;
use std::fmt;

/// Work on frames. A step is made for one image: levels are numbers in its unit.
pub trait Step: fmt::Debug + Send + Sync {
    /// The frame \[m, l\] after the step. All pixels are finite.
    ///
    /// # Errors
    /// A frame that the step cannot work on, with the reason.
    fn apply(&self, frame: Array2<f64>) -> Result<Array2<f64>>;

    /// All frames after the step.
    ///
    /// # Errors
    /// As [`Step::apply`].
    fn frames(&self, frames: Vec<Array2<f64>>) -> Result<Vec<Array2<f64>>> {
        frames.into_iter().map(|frame| self.apply(frame)).collect()
    }

    /// The number of pixels after the step for each pixel before it, along each axis.
    fn factor(&self) -> usize {
        1
    }
}

/// One row of the table of steps.
#[derive(Debug, Clone, Copy)]
pub struct StepKind {
    /// Its name in a chain.
    pub name: &'static str,
    /// Its parameters, in the order in which a text gives them.
    pub parameters: &'static [Parameter],
    /// What it does, in a sentence without a full stop.
    pub about: &'static str,
    /// Author and year of its definition.
    pub source: &'static str,
    /// True if it needs the PSF of the sensor.
    pub needs_psf: bool,
    /// Function that makes it.
    pub make: fn(&Given<'_>) -> Result<Box<dyn Step>>,
}

/// A parameter of a step.
#[derive(Debug, Clone, Copy)]
pub struct Parameter {
    /// Its name.
    pub name: &'static str,
    /// The values that it takes.
    pub range: Range,
    /// Its value where none is given, as text. `None`: it must be given. Empty: it is chosen from the image.
    pub default: Option<&'static str>,
    /// What it is, with its unit.
    pub about: &'static str,
}

/// The values that a parameter takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Range {
    /// An odd whole number between two limits.
    Odd(u16, u16),
    /// A whole number between two limits.
    Whole(u16, u16),
    /// A number between two limits.
    Real(f64, f64),
    /// A brightness in the unit of the image.
    Level,
    /// A brightness above 0 in the unit of the image.
    PositiveLevel,
}

impl Range {
    /// True for a number that the parameter takes.
    pub(super) fn holds(self, value: f64) -> bool {
        let whole = |low: u16, high: u16| value.fract() == 0.0 && value >= f64::from(low) && value <= f64::from(high);
        match self {
            Self::Odd(low, high) => whole(low, high) && value % 2.0 == 1.0,
            Self::Whole(low, high) => whole(low, high),
            Self::Real(low, high) => value >= low && value <= high,
            Self::Level => value.is_finite(),
            Self::PositiveLevel => value.is_finite() && value > 0.0,
        }
    }

    /// True for a brightness.
    #[must_use]
    pub fn is_level(self) -> bool {
        matches!(self, Self::Level | Self::PositiveLevel)
    }
}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Odd(low, high) => write!(f, "an odd number from {low} to {high}"),
            Self::Whole(low, high) => write!(f, "a whole number from {low} to {high}"),
            Self::Real(low, high) => write!(f, "a number from {low} to {high}"),
            Self::Level => f.write_str("a brightness in the unit of the image, such as 280K"),
            Self::PositiveLevel => f.write_str("a brightness above 0 in the unit of the image, such as 0.5K"),
        }
    }
}

impl StepKind {
    /// How a text writes the step, such as `median=WINDOW` or `unsharp=SIGMA[:AMOUNT]`.
    #[must_use]
    pub fn syntax(&self) -> String {
        let mut text = self.name.to_owned();
        let mut brackets = 0;
        for (k, parameter) in self.parameters.iter().enumerate() {
            if parameter.default.is_some() {
                text.push('[');
                brackets += 1;
            }
            text.push(if k == 0 { '=' } else { ':' });
            text += &parameter.name.to_uppercase();
        }
        text + &"]".repeat(brackets)
    }
}

/// The image that a chain is made for.
#[derive(Debug, Clone)]
pub struct Setting<'a> {
    /// Unit of its pixels.
    pub unit: BrightnessUnit,
    /// Size of a pixel, rad. It falls with each upsampling before the step.
    pub cell_rad: f64,
    /// PSF of the sensor.
    pub psf: Option<&'a Psf>,
}

/// The values of the parameters of a step, levels in the unit of the image. `None` is a parameter that is chosen from the image.
#[derive(Debug)]
pub struct Given<'a> {
    /// A value for each parameter.
    pub values: Vec<Option<f64>>,
    /// The image.
    pub setting: Setting<'a>,
}

impl Given<'_> {
    /// A parameter without unit.
    pub(super) fn number(&self, k: usize) -> f64 {
        self.values.get(k).copied().flatten().unwrap_or(f64::NAN)
    }

    /// A whole number.
    pub(super) fn whole(&self, k: usize) -> usize {
        self.number(k) as usize
    }

    /// A parameter that may be chosen from the image.
    pub(super) fn optional(&self, k: usize) -> Option<f64> {
        self.values.get(k).copied().flatten()
    }

    /// The PSF, on the grid of the image at this step.
    ///
    /// # Errors
    /// There is none, or its cell is another one.
    pub(super) fn psf(&self) -> Result<Psf> {
        let Some(psf) = self.setting.psf else {
            return Err(ChainError::Incompatible("a deconvolution needs the PSF of the sensor, and none was given".into()));
        };
        psf.check_cell(self.setting.cell_rad)?;
        Ok(psf.clone())
    }
}
