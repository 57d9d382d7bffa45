//! Layers that scatter inside: snow, ice with brine pockets or air bubbles, vegetation.
//!
//! A [`Scatterer`] says what a layer absorbs and scatters at one frequency; `iba.rs` computes it from grains. [`VolumeReflection`] solves the
//! equation of transfer in a stack of such layers in many streams, with refraction and Fresnel reflection between the layers. [`Scatter`] is
//! what a file says of a layer.

mod column;
mod iba;
#[cfg(test)]
mod law_tests;
mod matrix;
mod microstructure;
#[cfg(test)]
mod oracle_tests;
mod phase;
mod reflection;
mod scatter;
mod scatterer;
mod slab;
mod streams;

pub use iba::{Mixture, dense_medium_tsang01, improved_born_maetzler98};
pub use microstructure::Microstructure;
pub use reflection::{VolumeBudget, VolumeReflection};
pub(super) use scatter::Described;
pub use scatter::{GrainShape, SCATTER_KINDS, Scatter, ScatterKind};
pub use scatterer::{Phase, Scatterer};
pub use streams::StreamOptions;
