//! A pixel of a real-time frame with its neighbours, whose temperatures its looks take.

use super::blocks::Blocks;
use super::edges::{larger, smaller};
use super::face::{Face, Shown};
use super::scatter_mesh::Corrections;
use super::vertex::Vertex;
use crate::camera::View;

/// A frame whose edges are not smooth yet.
pub(super) struct Rough<'a> {
    pub view: &'a View,
    pub blocks: &'a Blocks,
    /// // [m, l]
    pub shown: &'a [Shown],
    pub corrections: &'a Corrections,
    /// With the corrections, RJ, K. // [m, l]
    pub rj_k: &'a [f64],
}

/// A pixel and its neighbours.
pub(super) struct Around<'a> {
    /// Their number, and what each shows, its temperature in K, its place in the picture, and how far away it is, pixels.
    count: usize,
    near: [(Shown, f64, usize, [f64; 2]); 9],
    /// What the pixel itself shows, and its temperature, K.
    pub here: Shown,
    pub rj_k: f64,
    /// Whether all show one face, and one in the mirror.
    pub one_face: bool,
    pub one_mirrored: bool,
    corrections: &'a Corrections,
    pub column: usize,
    pub row: usize,
    /// Largest difference between pixels that show one face for which a look takes the temperature of a pixel, K.
    pub alike_k: f64,
}

impl<'a> Around<'a> {
    pub(super) fn new(frame: &Rough<'a>, columns: usize, (column, row): (usize, usize), alike_k: f64) -> Self {
        let Rough { shown, rj_k, corrections, .. } = *frame;
        let at = row * columns + column;
        let here = shown[at];
        let mut around = Self {
            count: 0,
            near: [Default::default(); 9],
            here,
            rj_k: rj_k[at],
            one_face: true,
            one_mirrored: true,
            corrections,
            column,
            row,
            alike_k,
        };
        let last = shown.len() / columns - 1;
        for r in row.saturating_sub(1)..=(row + 1).min(last) {
            for c in column.saturating_sub(1)..=(column + 1).min(columns - 1) {
                let (at, away) = (r * columns + c, [c as f64 - column as f64, r as f64 - row as f64]);
                around.near[around.count] = (shown[at], rj_k[at], at, away);
                around.count += 1;
                around.one_face &= shown[at].face == here.face;
                around.one_mirrored &= shown[at].mirrored == here.mirrored;
            }
        }
        around
    }

    /// The nearest to an offset in this pixel of the nine pixels that show a face, and another one in the mirror if that is given: its number and its temperature, and
    /// the lowest and highest of the temperatures of all of them, K.
    #[inline]
    fn nearest(&self, face: Face, mirrored: Option<Face>, (dx, dy): (f64, f64)) -> Option<(usize, f64, [f64; 2])> {
        let (mut best, mut nearest) = (None, f64::INFINITY);
        let mut span = [f64::INFINITY, f64::NEG_INFINITY];
        for (shown, rj_k, at, away) in &self.near[..self.count] {
            if shown.face != face || mirrored.is_some_and(|m| shown.mirrored.is_some_and(|other| other != m)) {
                continue;
            }
            span = [smaller(span[0], *rj_k), larger(span[1], *rj_k)];
            let far = (away[0] - dx).powi(2) + (away[1] - dy).powi(2);
            if far < nearest {
                (best, nearest) = (Some((*at, *rj_k)), far);
            }
        }
        best.map(|(at, rj_k)| (at, rj_k, span))
    }

    /// What surfaces scatter to a look besides open sky: the correction of the nearest pixel that shows the same face. `None` if there is none.
    pub(super) fn correction(&self, look: &Vertex, offset: (f64, f64)) -> Option<f64> {
        if !look.scatters {
            return Some(0.0);
        }
        let (pixel, ..) = self.nearest(look.face, None, offset)?;
        self.corrections.of(pixel).map(|c| c[0])
    }

    /// Temperature of the nearest of the nine pixels that show a face, and another one in the mirror if that is given. `None` if no pixel does, or
    /// if the pixels that do differ too much.
    pub(super) fn near(&self, face: Face, mirrored: Option<Face>, offset: (f64, f64)) -> Option<f64> {
        let (_, rj_k, [low, high]) = self.nearest(face, mirrored, offset)?;
        (high - low <= self.alike_k).then_some(rj_k)
    }
}
