//! Combinatorial geometry: regions made of bodies, and their intersections with rays.
//!
//! A region is a union of terms. A term is the space inside some bodies and outside others ([`Expression`]). A line meets a body in one
//! [`crate::space::Span`] and a term in a few stretches, so a region is evaluated on stretches of a ray and not on points. [`Geometry`] holds the terms
//! of all regions, with a [`Bvh`] over them.
//!
//! - [`read_text`], [`write_text`]: the text of bodies and regions in the style of MORSE and GIFT.
//! - [`Volumes`]: regions that rays pass through, such as clouds.
//! - [`probe`]: the first hits of given rays, and the regions of given points.

mod bvh;
mod error;
mod expression;
mod model;
pub mod probe;
mod term;
mod text_read;
mod text_write;
mod volumes;

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
pub use volumes::{Passage, Volumes};
