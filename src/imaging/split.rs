//! Whether a uniform background is taken out of the data, and which.

use crate::values::word_or_quantity;
use cittert_arrays::quantity::Temperature;
use ndarray::Array2;

/// Which background is taken out of the data before an image is made, and put back into the image.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum BackgroundChoice {
    /// The one that total power tells, or that fits the visibilities best.
    #[default]
    Auto,
    /// None.
    None,
    /// This temperature.
    Kelvin(Temperature),
}
word_or_quantity!(
    BackgroundChoice,
    "auto" => Auto,
    "none" => None,
    Kelvin(Temperature),
    "auto, none, or a temperature such as \"265K\"."
);

/// The backgrounds of the output channels of an imager.
#[derive(Debug, Default)]
pub(super) enum Split {
    /// Not looked at yet.
    #[default]
    Pending,
    /// The visibilities stay as they are.
    Off,
    /// Flux a pixel \[m, l\] of each output channel that has a background.
    Out(Vec<Option<Array2<f64>>>),
}
