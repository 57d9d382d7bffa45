//! Options of the real-time mode.

use crate::error::{Result, SceneError};

/// Largest side of a square of the mesh, pixels; a power of two. One thread works on a tile of this side.
pub(super) const TILE: usize = 32;

/// How the real-time mode builds its mesh.
///
/// The defaults are a compromise between time and error: at 256 x 256 pixels a frame takes a quarter of the time of the full picture, and
/// differs from it by less than 2.6 K rms. Half or twice any of these values changes the error of the scenes that ship by less than 1 K rms
/// (test `half_or_twice_an_option_of_the_mesh_changes_its_error_little`), except half the `strong_side` (3.7 K at 64 x 64 pixels).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeshOptions {
    /// Side of the largest squares, pixels: 1, 2, 4, 8, 16 or 32.
    pub step: usize,
    /// Difference between the corners of a square above which the square is split, K.
    pub spread_k: f64,
    /// Largest difference between the centre of a square and the mean of its corners, as a fraction of `spread_k`. A mirrored object may be
    /// smaller than a square; most of these objects change the centre.
    pub center_fraction: f64,
    /// Noise of what surfaces scatter, as a multiple of that of a full picture. The number of rays falls with its power 4/3.
    pub speckle: f64,
    /// Columns or rows up to which a pixel of a matt face takes what it scatters from another; 4 in a full picture.
    pub near: usize,
    /// Whether pixels on an edge are smoothed.
    pub antialias: bool,
    /// How pixels on an edge are smoothed.
    pub edges: EdgeOptions,
}

/// How the real-time mode smooths pixels on an edge. A look is a ray that is followed to its first hit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeOptions {
    /// Difference between a pixel and its neighbours up to which the pixel keeps its value, K. Below 8 K the error of an edge, about a
    /// quarter of the difference, is smaller than that of the mesh.
    pub weak_k: f64,
    /// Difference above which a pixel gets a grid of looks instead of four, K. Four looks leave an error of about an eighth of the
    /// difference, and 10 K is visible.
    pub strong_k: f64,
    /// Rms error of a picture up to which it follows fewer looks as full rays and `strong_k` rises, estimated from the differences of its pixels, K. The smaller
    /// the part of a picture that lies on edges, the fewer rays it needs.
    pub budget_k: f64,
    /// Greatest difference up to which looks are not followed as full rays but keep the value of the pixel, except at the ground, K. Larger steps are visible.
    pub most_k: f64,
    /// Side of that grid. That of the full picture, whose rays lie at the same places, leaves the least difference.
    pub strong_side: usize,
    /// Largest difference between the pixels that show one face for which a look takes the temperature of the nearest pixel, K. The
    /// temperature changes faster on the round edge of a metal body, and a full ray is followed there.
    pub alike_k: f64,
}

impl Default for MeshOptions {
    fn default() -> Self {
        Self { step: 8, spread_k: 6.0, center_fraction: 0.5, speckle: 4.0, near: 8, antialias: true, edges: EdgeOptions::default() }
    }
}

impl Default for EdgeOptions {
    fn default() -> Self {
        Self { weak_k: 8.0, strong_k: 100.0, budget_k: 2.4, most_k: 50.0, strong_side: 4, alike_k: 30.0 }
    }
}

impl MeshOptions {
    /// Checks the ranges.
    pub(super) fn check(&self) -> Result<()> {
        let (step, side) = (self.step, self.edges.strong_side);
        SceneError::unless(step.is_power_of_two() && step <= TILE, "step of the mesh", step, "1, 2, 4, 8, 16 or 32 pixels")?;
        SceneError::unless((1..=16).contains(&side), "edges.strong_side", side, "1 to 16 looks")?;
        SceneError::unless(self.near <= TILE, "near of the mesh", self.near, "at most 32 pixels")?;
        let spreads = [
            ("spread_k of the mesh", self.spread_k),
            ("center_fraction of the mesh", self.center_fraction),
            ("edges.weak_k", self.edges.weak_k),
            ("edges.strong_k", self.edges.strong_k),
            ("edges.budget_k", self.edges.budget_k),
            ("edges.most_k", self.edges.most_k),
            ("edges.alike_k", self.edges.alike_k),
        ];
        SceneError::unless((0.1..=100.0).contains(&self.speckle), "speckle of the mesh", self.speckle, "0.1 to 100")?;
        spreads.into_iter().try_for_each(|(what, value)| SceneError::unless(value >= 0.0, what, value, "0 or more"))
    }
}
