//! Surfaces: emission, reflection and scattering of a boundary.
//!
//! A [`StackDescription`] gives a [`Stack`] of layers at one frequency. A [`SurfaceModel`] adds [`Roughness`] and a canopy. Pairs are
//! `[h, v]`. Angles are in radians from the normal. The electric field of `h` is perpendicular to the plane of incidence.
//!
//! ```
//! use cittert_phenomenology::dielectrics::{Extrapolation, Material};
//! use cittert_phenomenology::surfaces::{Sky, StackDescription, SurfaceModel};
//! let sea = Material::by_name("sea-water")?;
//! let stack = StackDescription::of_material(sea, sea.state(), None)
//!     .resolve(37e9, Extrapolation::Refuse)?;
//! let surface = SurfaceModel::new(stack, "go:0.15,0.12".parse()?);
//! let sky = |zenith: f64| 20.0 / zenith.cos().max(0.05);
//! let [h, v] = surface.brightness_k(0.9, 0.0, Sky::Symmetric(&sky))?;
//! assert!(h < v && v < 288.15);
//! # Ok::<(), cittert_phenomenology::surfaces::SurfaceError>(())
//! ```

mod bistatic;
mod choudhury79;
mod coherent;
#[cfg(test)]
mod convergence_tests;
mod diffuse;
mod error;
mod foam;
mod fresnel;
mod geometric_optics;
mod incoherent;
#[cfg(test)]
mod incoherent_tests;
#[cfg(test)]
mod law_tests;
mod layer;
mod model;
#[cfg(test)]
mod oracle_tests;
mod quadrature;
mod roughness;
mod second_bounce;
mod shadowing;
mod slopes;
mod stack;
mod stack_file;
#[cfg(test)]
pub(crate) mod stokes_tests;
mod tau_omega;
mod visible_facets;
pub mod volume;
mod volume_response;
mod wagner_lynch;
mod wegmuller_matzler99;

pub use bistatic::{Bistatic, BistaticGeometry, bistatic_coefficient};
pub use choudhury79::QhRoughness;
pub use diffuse::DiffuseLobe;
pub use error::SurfaceError;
pub use foam::Foam;
pub use fresnel::{Reflection, fresnel};
pub use geometric_optics::{Closure, GeometricOptics, SurfaceResponse};
pub use layer::Layer;
pub use model::SurfaceModel;
pub use roughness::{ROUGHNESS_KINDS, Roughness, RoughnessKind};
pub use shadowing::{Shadowing, shadow_lambda, shadow_lambda_v};
pub use slopes::Slopes;
pub use stack::Stack;
pub use stack_file::{DEFAULT_TEMPERATURE_K, LayerDescription, RawLayer, StackDescription, Substance};
pub use tau_omega::{Canopy, CanopyBudget};
pub use visible_facets::{FacetPath, VisibleFacets};
pub use volume::{SCATTER_KINDS, Scatter};
pub use wagner_lynch::{FacetIntegrals, Sky};
pub use wegmuller_matzler99::wegmuller_matzler99;
