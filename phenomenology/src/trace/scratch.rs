//! The state of rays that are followed, and the memory they work in.

use super::cause::{Cause, Tally};
use super::face::Face;
use super::lattice::Points;
use super::weather::Cuts;

/// Working memory of a ray; one for each thread.
#[derive(Debug, Clone)]
pub(super) struct Scratch {
    /// Antenna rows of a ray, the rows before a branch, and those of the ray that branches off. // [branch][chan, pol]
    pub rows: Vec<Vec<[f64; 4]>>,
    /// Temperatures summed so far, RJ, K, with open sky in place of everything that surfaces scatter. // [chan, pol]
    pub sums: Vec<f64>,
    /// What must be added for everything but open sky, RJ, K. // [chan, pol]
    pub corrections: Vec<f64>,
    /// Emission (RJ, K) and transmission of the leg. // [chan]
    pub path: Vec<(f64, f64)>,
    /// The points that select facets.
    pub points: Points,
    /// Rms noise that the points leave, K.
    pub speckle_k: f64,
    /// Whether the ray, or its mirror ray, met a surface that scatters.
    pub scatters: bool,
    /// What the ray hits after its first reflection; `None` if too little is reflected to matter.
    pub mirrored: Option<Face>,
    /// Where the leg enters and leaves weather.
    pub cuts: Cuts,
    /// What the sums come from.
    pub tally: Tally,
}

impl Scratch {
    /// Credits a cause with what a ray has added to the sums since the last credit. Rays that branch off add to the corrections.
    #[inline]
    pub(super) fn credit(&mut self, cause: Cause, branch: usize) {
        if branch == 0 {
            self.tally.credit(cause, self.sums[0]);
        }
    }

    /// Copies rows to the next place.
    #[inline]
    pub(super) fn copy_rows(&mut self, from: usize) {
        if self.rows.len() < from + 2 {
            self.rows.resize(from + 2, self.rows[0].clone());
        }
        let (left, right) = self.rows.split_at_mut(from + 1);
        right[0].copy_from_slice(&left[from]);
    }
}

/// How far a ray has come: reflections, and rays that branched off on the way.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reach {
    pub bounces: usize,
    pub branch: usize,
    /// Weight of the whole bundle of rays per weight of this ray.
    pub bundle: f64,
}

impl Reach {
    /// One of a number of rays that branch off. The place between holds the rows before the branch.
    pub(super) fn next_branch(self, count: usize) -> Self {
        Self { bounces: self.bounces + 1, branch: self.branch + 2, bundle: self.bundle * count as f64 }
    }
}
