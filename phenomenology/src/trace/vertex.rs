//! The result of one ray of the real-time mode.

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
    /// What it shows if that needs a correction.
    pub(super) fn scattering_face(&self) -> Face {
        self.face.filter(|_| self.scatters)
    }
}

impl Tracer<'_> {
    /// Follows a full ray along a direction of a view. The points decide whether the temperature is corrected for what surfaces scatter.
    #[inline]
    pub(super) fn vertex(&self, view: &View, direction: Vec3, points: Points, scratch: &mut Scratch) -> Result<Vertex> {
        let seen = self.follow(view.position, direction, view.reference(direction), points, scratch)?;
        let rj_k = scratch.sums[0] + scratch.corrections[0];
        Ok(Vertex { face: seen.map(|s| s.identity()), mirrored: scratch.mirrored, rj_k, scatters: scratch.scatters })
    }

    /// The first hit along a direction of a view, without radiometry.
    #[inline]
    pub(super) fn face(&self, view: &View, direction: Vec3) -> Result<Face> {
        Ok(self.spot(&Ray::from_unit(view.position, direction))?.as_ref().map(Spot::identity))
    }

    /// Whether a ray along a direction of a view hits what a vertex shows, and its mirrored ray too, without radiometry.
    #[inline]
    pub(super) fn shows(&self, view: &View, direction: Vec3, vertex: &Vertex) -> Result<bool> {
        let ray = Ray::from_unit(view.position, direction);
        let spot = self.spot(&ray)?;
        if spot.as_ref().map(Spot::identity) != vertex.face {
            return Ok(false);
        }
        Ok(match (&spot, vertex.mirrored) {
            (Some(spot), Some(mirrored)) => self.spot(&self.mirror_ray(&ray, spot))?.as_ref().map(Spot::identity) == mirrored,
            _ => true,
        })
    }
}

impl Seen {
    /// Region, body and face, and surface.
    pub(super) fn identity(&self) -> (Option<u32>, (u32, u8), u32) {
        (self.region, self.face, self.cover)
    }
}
