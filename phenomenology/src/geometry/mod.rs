//! Combinatorial geometry: regions of bodies, and the rays that meet them.
//!
//! A region is a union of terms; a term is what lies inside some bodies and outside others ([`Expression`]). A line meets a body in
//! one [`Span`], a term in a few, so a region is evaluated on the stretches of a ray and never on points. [`Geometry`] holds
//! everything flattened, with a [`Bvh`] over the terms.
//!
//! - [`read_text`], [`write_text`]: the MORSE/GIFT-style text of bodies and regions.
//! - [`probe`]: what rays hit and where points lie.

mod bvh;
mod error;
mod expression;
mod model;
pub mod probe;
mod term;
mod text_read;
mod text_write;

#[cfg(test)]
mod model_tests;
#[cfg(test)]
mod oracle_tests;

pub use bvh::Bvh;
pub(crate) use error::some_names;
pub use error::{At, GeometryError};
pub(crate) use expression::is_valid_name;
pub use expression::{Expression, Literal};
pub use model::{Geometry, Hit, NamedBody, Region, RegionSource};
pub(crate) use text_read::is_void;
pub use text_read::{TextModel, looks_like_bodies, read_text};
pub use text_write::write_text;
