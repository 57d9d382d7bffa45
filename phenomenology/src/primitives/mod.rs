//! The eight bodies of combinatorial geometry, one in each file.
//!
//! Every body is convex, closed and finite, so a line meets it in one [`crate::space::Span`]. A body computes its intersection with a
//! ray, its outward normals, its bounds and whether it contains a point. [`PRIMITIVES`] lists the bodies. To add one, write its file and
//! its row in `solid.rs`.
//!
//! # Reference
//! Guber et al. 1967, A geometric description technique (MAGIC), and Emmett 1975, ORNL-4972 (MORSE): bodies and parameter order.

mod axis;
mod body;
mod box_body;
mod ell;
mod entry;
mod fault;
mod frame;
mod rcc;
mod rec;
mod rpp;
mod solid;
mod sph;
mod trc;
mod wed;

#[cfg(test)]
mod law_tests;

pub use body::Body;
pub use box_body::BoxBody;
pub use ell::Ell;
pub use entry::{Group, PrimitiveEntry};
pub use fault::PrimitiveFault;
pub use rcc::Rcc;
pub use rec::Rec;
pub use rpp::Rpp;
pub use solid::{PRIMITIVES, Primitive, Solid};
pub use sph::Sph;
pub use trc::Trc;
pub use wed::Wed;
