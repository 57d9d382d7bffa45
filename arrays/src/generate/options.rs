//! Options of generated layouts: one type for the library, the command line and files.

use crate::quantity::{Angle, FluxDensity, Length, Temperature};
use serde::{Deserialize, Serialize};

/// What a generated layout is made of. Options that a kind of layout does not take must be absent.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args, schemars::JsonSchema))]
pub struct GenerateOptions {
    /// Number of elements.
    #[cfg_attr(feature = "cli", arg(long, value_name = "N"))]
    pub elements: usize,
    /// Longest distance between two elements.
    #[cfg_attr(feature = "cli", arg(long, value_name = "LENGTH"))]
    pub aperture: Length,
    /// Seed of the kinds that draw random numbers.
    #[serde(default = "first_seed")]
    #[cfg_attr(feature = "cli", arg(long, value_name = "N", default_value_t = first_seed()))]
    pub seed: u64,
    /// Least distance between two elements [default: the diameter].
    #[cfg_attr(feature = "cli", arg(long, value_name = "LENGTH"))]
    pub spacing: Option<Length>,
    /// Number of arms, or of branches of a fractal [default: by the kind].
    #[cfg_attr(feature = "cli", arg(long, value_name = "N"))]
    pub arms: Option<usize>,
    /// Power by which distances from the centre grow along an arm or a spiral [default: by the kind].
    #[cfg_attr(feature = "cli", arg(long, value_name = "X"))]
    pub exponent: Option<f64>,
    /// Number of concentric rings [default: by the kind].
    #[cfg_attr(feature = "cli", arg(long, value_name = "N"))]
    pub rings: Option<usize>,
    /// Number of columns of a rectangular grid, or of its places where only some hold an element [default: chosen from the elements].
    #[cfg_attr(feature = "cli", arg(long, value_name = "N"))]
    pub columns: Option<usize>,
    /// Turns of each arm of a spiral from its first to its last element [default: by the kind].
    #[cfg_attr(feature = "cli", arg(long, value_name = "X", allow_negative_numbers = true))]
    pub turns: Option<f64>,
    /// Distance of the first element of a spiral arm from the centre, over that of the last [default: by the kind].
    #[cfg_attr(feature = "cli", arg(long, value_name = "X"))]
    pub inner: Option<f64>,
    /// Turn the layout clockwise, from +y towards +x [default: 0deg].
    #[cfg_attr(feature = "cli", arg(long, value_name = "ANGLE", allow_hyphen_values = true))]
    pub rotation: Option<Angle>,
    /// Diameter of the elements, written into the layout.
    #[cfg_attr(feature = "cli", arg(long, value_name = "LENGTH"))]
    pub diameter: Option<Length>,
    /// System temperature of the elements, written into the layout.
    #[cfg_attr(feature = "cli", arg(long, value_name = "TEMP", conflicts_with = "sefd"))]
    pub tsys: Option<Temperature>,
    /// System equivalent flux density of the elements, written into the layout.
    #[cfg_attr(feature = "cli", arg(long, value_name = "FLUX"))]
    pub sefd: Option<FluxDensity>,
}

fn first_seed() -> u64 {
    1
}

impl GenerateOptions {
    /// So many elements over so long an aperture, everything else by default.
    #[must_use]
    pub fn new(elements: usize, aperture: Length) -> Self {
        Self {
            elements,
            aperture,
            seed: first_seed(),
            spacing: None,
            arms: None,
            exponent: None,
            rings: None,
            columns: None,
            turns: None,
            inner: None,
            rotation: None,
            diameter: None,
            tsys: None,
            sefd: None,
        }
    }
}
