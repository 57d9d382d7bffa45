//! The feeds of antennas: which fields they receive, and how they turn on the sky while an antenna follows a source.
//!
//! | file | what it holds |
//! |---|---|
//! | `mount` | kinds of mounts by name |
//! | `angles` | position angles of the feeds of every antenna at a time |
//! | `four` | the four products of two feeds as one matrix |
//! | `jones` | 2 x 2 matrices of feeds, and products of Stokes parameters |
//!
//! # Conventions
//! Stokes parameters are those of the IAU: x to the north, y to the east, position angles from north through east, and V positive for right
//! circular polarisation, in which the position angle of the electric vector grows with time (IEEE). Visibilities with uvw = r2 - r1 and
//! exp(+2 pi i (u l + ...)) are the complex conjugates of those of the usual equations (Hamaker & Bregman 1996, A&AS 117, 161), so in memory
//! and in UVH5 XY = U - iV and RL = Q - iU; in Measurement Sets and UVFITS they are XY = U + iV and RL = Q + iU.

mod angles;
mod four;
mod jones;
mod mount;

pub use angles::{Feeds, sky_angle_rad};
pub use four::{FourProducts, leakage_matrix};
pub use jones::{Jones, StokesTerm, adjoint, coherency, feed_matrix, inverse, products, stokes_terms, times};
pub use mount::Mount;
