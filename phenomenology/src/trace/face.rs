//! What a ray hits, as one number: pictures hold two of them for each pixel, and compare them often.

use crate::error::{Result, SceneError};
use crate::solids::Covers;
use std::num::NonZeroU64;

/// Bits of the number of a face and of a body. The region has the bits above them, but the highest bit, which tells solids from all else.
const FACE_BITS: u32 = 8;
const BODY_BITS: u32 = 28;
const REGION_BITS: u32 = 63 - BODY_BITS - FACE_BITS;
const SOLID: u64 = 1 << 63;
/// Above the cover of the ground.
const GROUND: u64 = 1 << 32;

/// What a ray hits first: a face of a body of a region, the ground with one cover, or the sky.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Face(NonZeroU64);

impl Face {
    /// The sky.
    pub(super) const SKY: Self = Self(NonZeroU64::MIN);

    /// The ground with a cover.
    #[inline]
    pub(super) fn of_ground(cover: u32) -> Self {
        Self(NonZeroU64::MIN | (GROUND | u64::from(cover)) << 1)
    }

    /// A face of a body that bounds a region.
    #[inline]
    pub(super) fn of_solid(region: u32, body: u32, face: u8) -> Self {
        let number = (u64::from(region) << (BODY_BITS + FACE_BITS)) | (u64::from(body) << FACE_BITS) | u64::from(face);
        NonZeroU64::new(SOLID | number).map_or(Self::SKY, Self)
    }

    #[inline]
    pub(super) fn is_sky(self) -> bool {
        self == Self::SKY
    }

    #[inline]
    pub(super) fn is_ground(self) -> bool {
        self.0.get() & SOLID == 0 && !self.is_sky()
    }

    /// Its cover; `None` for the sky.
    pub(super) fn cover(self, covers: &Covers) -> Option<u32> {
        let number = self.0.get();
        if self.is_sky() {
            None
        } else if self.is_ground() {
            Some((number >> 1) as u32)
        } else {
            let part = |shift: u32, bits: u32| ((number >> shift) & ((1 << bits) - 1)) as u32;
            let (region, body) = (part(BODY_BITS + FACE_BITS, REGION_BITS), part(FACE_BITS, BODY_BITS));
            covers.of_face(region, body, part(0, FACE_BITS) as u8)
        }
    }

    /// Refuses a scene with more regions or bodies than a face can number.
    pub(super) fn check(regions: usize, bodies: usize) -> Result<()> {
        SceneError::unless(regions < 1 << REGION_BITS, "regions", regions, "fewer than 134217728")?;
        SceneError::unless(bodies < 1 << BODY_BITS, "bodies", bodies, "fewer than 268435456")
    }
}

impl Default for Face {
    fn default() -> Self {
        Self::SKY
    }
}

/// What a pixel shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Shown {
    /// What its ray hits first.
    pub face: Face,
    /// What the mirrored ray hits; `None` if too little is mirrored to matter.
    pub mirrored: Option<Face>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn different_faces_have_different_numbers() {
        let mut all = vec![Face::SKY];
        all.extend([0, 1, u32::MAX].map(Face::of_ground));
        let solids =
            [(0, 0, 0), (0, 0, 1), (0, 0, u8::MAX), (0, 1, 0), (1, 0, 0), (0, (1 << BODY_BITS) - 1, 0), ((1 << REGION_BITS) - 1, 0, 0)];
        all.extend(solids.map(|(region, body, face)| Face::of_solid(region, body, face)));
        for (k, a) in all.iter().enumerate() {
            assert_eq!(all.iter().filter(|b| *b == a).count(), 1, "{a:?}");
            assert_eq!((a.is_sky(), a.is_ground()), (k == 0, (1..4).contains(&k)), "{a:?}");
        }
        assert!(Face::check(1 << REGION_BITS, 1).is_err() && Face::check(1, 1 << BODY_BITS).is_err() && Face::check(1, 1).is_ok());
    }
}
