//! A point where a ray meets the ground.

use crate::space::Vec3;

/// A point where a ray meets the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GroundHit {
    /// Distance, m.
    pub t: f64,
    /// Upward unit normal.
    pub normal: Vec3,
}
