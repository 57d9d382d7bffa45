//! Draws and reflections of single facets of a rough surface.

use super::angle_table::AngleTable;
use super::options::TableOptions;
use super::response::{KELVIN, MIRROR_ANGLES, Response};
use crate::space::Vec3;
use crate::surfaces::{FacetPath, GeometricOptics, SurfaceError, SurfaceModel, VisibleFacets};

/// The facets of one surface in one channel.
#[derive(Debug, Clone)]
pub struct FacetTable {
    facets: VisibleFacets,
    /// Powers and cross term of a facet against the local cosine of incidence.
    local: AngleTable<4>,
    /// The fraction of the surface between patches of foam.
    open: f64,
    /// Optical depth of a canopy over the facets, Np.
    canopy_np: f64,
}

impl FacetTable {
    /// Tabulates the facets of a surface with these slopes. `axis` is the unit vector along the first slope axis, in the plane of the surface.
    ///
    /// # Errors
    /// As [`crate::surfaces::Stack::reflection`].
    pub fn new(model: &SurfaceModel, go: &GeometricOptics, axis: [f64; 2], options: &TableOptions) -> Result<Self, SurfaceError> {
        let local = AngleTable::new(options.mirror_k, [KELVIN; 4], MIRROR_ANGLES, |cos| {
            let r = model.stack.reflection(cos.min(1.0).acos())?;
            Ok::<_, SurfaceError>([r.power_h, r.power_v, r.cross.re, r.cross.im])
        })?;
        let open = go.foam.map_or(1.0, |foam| 1.0 - foam.cover);
        Ok(Self { facets: VisibleFacets::new(go, axis), local, open, canopy_np: model.canopy.map_or(0.0, |c| c.tau_np) })
    }

    /// Rays through one and two facets, as [`VisibleFacets::draw`].
    #[must_use]
    #[inline]
    pub fn draw(&self, to_observer: Vec3, draw: [f64; 5]) -> [Option<FacetPath>; 2] {
        self.facets.draw(to_observer, draw)
    }

    /// Reflection of a facet at its own cosine of incidence.
    #[must_use]
    #[inline]
    pub fn reflection(&self, cos: f64) -> Response {
        let [h, v, re, im] = self.local.at(cos);
        Response { power: [h, v], cross: [re, im], emitted_k: [0.0; 2] }
    }

    /// The fraction of the radiation of the facets that is not lost to foam among them and to a canopy over them, on both ways, at the cosine of
    /// the observer.
    #[must_use]
    #[inline]
    pub fn seen(&self, cos: f64) -> f64 {
        if self.canopy_np == 0.0 { self.open } else { self.open * libm::exp(-2.0 * self.canopy_np / cos.max(1e-9)) }
    }
}
