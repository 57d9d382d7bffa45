//! The result of one ray of the real-time mode.

use super::blocks::Block;
use super::face::Face;
use super::lattice::Points;
use super::scratch::Scratch;
use super::tracer::{Seen, Spot, Tracer};
use crate::camera::View;
use crate::error::Result;
use crate::space::{Ray, Vec3};

/// A vertex or pixel: what it shows, and its temperature. Outside the hemisphere it shows the sky at 0 K.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Vertex {
    /// What the ray hits first.
    pub face: Face,
    /// What the mirrored ray hits; `None` if too little is mirrored to matter.
    pub mirrored: Option<Face>,
    /// First plane and channel, RJ, K.
    pub rj_k: f64,
    /// Whether a surface scatters on the way, so that the temperature needs a correction.
    pub scatters: bool,
}

impl Vertex {
    /// Whether it shows the ground.
    pub(super) fn is_ground(&self) -> bool {
        self.face.is_some_and(|(region, ..)| region.is_none())
    }

    /// What it shows if that needs a correction.
    pub(super) fn scattering_face(&self) -> Face {
        self.face.filter(|_| self.scatters)
    }
}

/// What a ray hits first, and what it would hit in the mirror.
pub(super) struct Look {
    ray: Ray,
    /// The first hit, where the mirror matters.
    spot: Option<Spot>,
    /// What the first hit is.
    pub face: Face,
    mirrors_sky: bool,
}

impl Tracer<'_> {
    /// Follows a full ray along a direction of a view. The points decide whether the temperature is corrected for what surfaces scatter.
    #[inline]
    pub(super) fn vertex(&self, view: &View, direction: Vec3, points: Points, block: &Block, scratch: &mut Scratch) -> Result<Vertex> {
        let ray = Ray::from_unit(view.position, direction);
        let first = self.spot_in(&ray, block)?;
        scratch.mirrors_sky = block.mirrors_sky && first.is_some_and(|s| s.region.is_none());
        let seen = self.follow_from(ray, first, view.reference(direction), points, scratch)?;
        scratch.mirrors_sky = false;
        let rj_k = scratch.sums[0] + scratch.corrections[0];
        Ok(Vertex { face: seen.map(|s| s.identity()), mirrored: scratch.mirrored, rj_k, scatters: scratch.scatters })
    }

    /// The first hit along a direction of a view, without radiometry.
    #[inline]
    pub(super) fn look(&self, view: &View, direction: Vec3, block: &Block) -> Result<Look> {
        let ray = Ray::from_unit(view.position, direction);
        if block.is_open()
            && let Some(terrain) = &self.scene.terrain
            && let Some(level_m) = terrain.level_m()
        {
            let point = ray.at((level_m - ray.origin.z) * ray.inverse.z);
            return Ok(Look { ray, spot: None, face: Some((None, (0, 0), terrain.cover(point.x, point.y))), mirrors_sky: true });
        }
        let spot = self.spot_in(&ray, block)?;
        Ok(Look { ray, spot, face: spot.as_ref().map(Spot::identity), mirrors_sky: block.mirrors_sky })
    }

    /// What a look would hit after a mirror at its first hit.
    #[inline]
    pub(super) fn mirrored(&self, look: &Look) -> Result<Face> {
        match &look.spot {
            Some(spot) if !(look.mirrors_sky && spot.region.is_none()) => {
                Ok(self.spot(&self.mirror_ray(&look.ray, spot))?.as_ref().map(Spot::identity))
            }
            _ => Ok(None),
        }
    }

    /// Whether a look hits what a vertex shows, and in the mirror too.
    #[inline]
    pub(super) fn agrees(&self, look: &Look, vertex: &Vertex) -> Result<bool> {
        if look.face != vertex.face {
            return Ok(false);
        }
        vertex.mirrored.map_or(Ok(true), |mirrored| Ok(look.face.is_none() || self.mirrored(look)? == mirrored))
    }
}

impl Seen {
    /// Region, body and face, and surface.
    pub(super) fn identity(&self) -> (Option<u32>, (u32, u8), u32) {
        (self.region, self.face, self.cover)
    }
}
