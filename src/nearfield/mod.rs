//! The near field: scenes so close that their waves are spheres across the array.
//!
//! An array of extent D sees a scene at the distance R in the far field only beyond 2 D^2 / lambda, which is hundreds of metres for an aperture of a metre at
//! millimetre waves. Nearer, the phase of a pair of antennas is that of two spherical waves, exp(-i k (d_q - d_p)), and its amplitude falls with both
//! distances. Antenna positions and pairs tell them; the uvw do not.
//!
//! | file | what |
//! |---|---|
//! | `surface` | where the points of a scene lie: a plane, a sphere, a map of distances |
//! | `paths` | path, amplitude and voltage of every element towards a point, without loss of digits up to infinity |
//! | `transform` | the exact transform between points and pairs of antennas, and its adjoint |
//! | `focus` | phasing a set to a point |
//! | `validity` | where the Fourier image of a focused set is good enough |
//! | `autofocus` | the range at which the image is sharpest |
//!
//! # Reference
//! Born & Wolf 1999, sect. 8.3 (spherical waves and their Fresnel approximation); Thompson, Moran & Swenson 2017, sect. 15.1.3 (near field).

mod autofocus;
mod focus;
mod focus_options;
mod options;
mod pairs;
mod paths;
mod phasors;
mod surface;
mod transform;
mod validity;

pub use autofocus::{FoundRange, find_range};
pub use focus::{Focusing, boresight_turn};
pub use focus_options::{FocusDirection, FocusOptions, FocusRange, focus_grid};
pub use options::RangeChoice;
pub use pairs::Pairs;
pub use paths::{Elements, Point, path};
pub use surface::{RangeMap, Surface};
pub use transform::PathTransform;
pub use validity::{Validity, bending_rad};
