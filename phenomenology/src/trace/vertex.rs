//! The result of one ray of the real-time mode.

use super::blocks::Block;
use super::face::{Face, Shown};
use super::lattice::Points;
use super::scratch::Scratch;
use super::tracer::{First, Seen, Tracer};
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
    /// What it shows.
    pub(super) fn shown(&self) -> Shown {
        Shown { face: self.face, mirrored: self.mirrored }
    }

    /// Whether it shows the ground.
    pub(super) fn is_ground(&self) -> bool {
        self.face.is_ground()
    }

    /// What it shows if that needs a correction, else the sky.
    pub(super) fn scattering_face(&self) -> Face {
        if self.scatters { self.face } else { Face::SKY }
    }
}

/// What a ray hits first, and what it would hit in the mirror.
pub(super) struct Look<'a> {
    block: &'a Block,
    /// The ray and its first hit, where the mirror matters.
    first: Option<(Ray, First)>,
    /// What the first hit is.
    pub face: Face,
}

impl Tracer<'_> {
    /// Follows a full ray along a direction of a view. The points decide whether the temperature is corrected for what surfaces scatter.
    #[inline]
    pub(super) fn vertex(&self, view: &View, direction: Vec3, points: Points, block: &Block, scratch: &mut Scratch) -> Result<Vertex> {
        let ray = Ray::from_unit(view.position, direction);
        let first = self.spot_in(&ray, block)?;
        let mirrored = first.as_ref().and_then(|spot| block.mirrored_at(spot));
        let seen = self.follow_from(ray, first, mirrored, view.reference(direction), points, scratch)?;
        let rj_k = scratch.sums[0] + scratch.corrections[0];
        Ok(Vertex { face: seen.map_or(Face::SKY, |s| s.identity()), mirrored: scratch.mirrored, rj_k, scatters: scratch.scatters })
    }

    /// The first hit along a vector of a view, without radiometry.
    #[inline]
    pub(super) fn look<'a>(&self, view: &View, along: Vec3, block: &'a Block) -> Look<'a> {
        if block.open
            && let Some(terrain) = &self.scene.terrain
            && let Some(level_m) = terrain.level_m()
        {
            let (from, share) = (view.position, (level_m - view.position.z) / along.z);
            let face = Face::of_ground(block.cover(terrain, from.x + along.x * share, from.y + along.y * share));
            return Look { block, first: None, face };
        }
        let ray = Ray::from_unit(view.position, view.unit(along));
        let first = self.first_in(&ray, block);
        Look { block, face: first.identity(), first: Some((ray, first)) }
    }

    /// What a look would hit after a mirror at its first hit.
    #[inline]
    pub(super) fn mirrored(&self, look: &Look<'_>) -> Result<Face> {
        let Some((ray, first)) = &look.first else { return Ok(Face::SKY) };
        if matches!(first, First::Ground(..)) && look.block.mirrors_sky() {
            return Ok(Face::SKY);
        }
        let Some(spot) = self.spot_at(ray, first)? else { return Ok(Face::SKY) };
        Ok(self.first_of(&self.mirror_ray(ray, &spot), look.block.mirrored_at(&spot)).identity())
    }

    /// Whether a look hits what a vertex shows, and in the mirror too.
    #[inline]
    pub(super) fn agrees(&self, look: &Look<'_>, vertex: &Vertex) -> Result<bool> {
        if look.face != vertex.face {
            return Ok(false);
        }
        vertex.mirrored.map_or(Ok(true), |mirrored| Ok(look.face.is_sky() || self.mirrored(look)? == mirrored))
    }
}

impl Seen {
    /// What was hit.
    pub(super) fn identity(&self) -> Face {
        match self.region {
            Some(region) => Face::of_solid(region, self.face.0, self.face.1),
            None => Face::of_ground(self.cover),
        }
    }
}
