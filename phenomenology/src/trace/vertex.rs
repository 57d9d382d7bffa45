//! The result of one ray of the real-time mode.

use super::lattice::Points;
use super::scratch::Scratch;
use super::tracer::{Seen, Tracer};
use crate::camera::View;
use crate::error::Result;
use crate::space::{Ray, Vec3};

/// What a ray hits first: region, body and face, and surface. `None` is the sky.
pub(super) type Face = Option<(Option<u32>, (u32, u8), u32)>;

/// A vertex or pixel: what it shows, and its temperature. Outside the hemisphere it shows the sky at 0 K.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Vertex {
    /// What the ray hits first.
    pub face: Face,
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
        Ok(Vertex { face: seen.map(|s| s.identity()), rj_k, scatters: scratch.scatters })
    }

    /// The first hit along a direction of a view, without radiometry.
    #[inline]
    pub(super) fn face(&self, view: &View, direction: Vec3) -> Result<Face> {
        Ok(self.spot(&Ray::from_unit(view.position, direction))?.map(|s| (s.region, s.face, s.cover)))
    }
}

impl Seen {
    /// Region, body and face, and surface.
    pub(super) fn identity(&self) -> (Option<u32>, (u32, u8), u32) {
        (self.region, self.face, self.cover)
    }
}
