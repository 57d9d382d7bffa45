//! The power pattern of an antenna or a receiving element. The layout states one pattern for all
//! elements; [`Pointings`] tell how those of the antennas differ from it.
//!
//! One kind is one file with a struct that implements the trait `Shape`, a variant of [`ElementPattern`] and a row of [`PATTERN_KINDS`].

pub(crate) mod airy;
mod antennas;
mod cos_power;
mod element;
mod gaussian;
pub(crate) mod in_toml;
mod kinds;
mod sampled;
mod shape;

pub use airy::Airy;
pub use antennas::{Pointing, Pointings};
pub use cos_power::CosPower;
pub use element::ElementPattern;
pub use gaussian::Gaussian;
pub use kinds::{PATTERN_KINDS, Parameter, PatternKind};
pub use sampled::{PatternSample, SampledPattern};
