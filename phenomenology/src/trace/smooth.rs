//! Smooth edges for the real-time mode.
//!
//! A pixel keeps its value if it differs little from its neighbours. Otherwise it becomes the mean of four looks, or of a grid of looks on
//! a strong edge. A look finds the first hit without radiometry. Most looks hit a face that one of the nine pixels around shows, and take
//! the temperature of that pixel. Only the others are followed as full rays.

use super::face::Face;
use super::lattice::{Points, Use};
use super::mesh_options::EdgeOptions;
use super::scatter_mesh::Corrections;
use super::scratch::Scratch;
use super::tracer::Tracer;
use super::vertex::Vertex;
use crate::camera::View;
use crate::error::{Result, SceneError};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Positions of four looks in a pixel: one in each quarter of the columns and of the rows, as four rooks on a chess board.
const ROOKS: [(f64, f64); 4] = [(-0.375, -0.125), (-0.125, 0.375), (0.125, -0.375), (0.375, 0.125)];

/// A look at a face that no pixel around shows sends one of this many shares of the rays of a pixel.
const LOOK_SHARES: usize = 16;

impl Tracer<'_> {
    /// Replaces every pixel on an edge by the mean of its looks. Returns the number of looks that were followed as full rays.
    pub(super) fn smooth_edges(
        &self,
        view: &View,
        options: &EdgeOptions,
        pixels: &[Vertex],
        corrections: &Corrections,
        rj_k: &mut [f64],
    ) -> Result<usize> {
        let side = options.strong_side;
        let columns = view.grid().n_l;
        let rays = AtomicUsize::new(0);
        rj_k.par_chunks_mut(columns).enumerate().try_for_each_init(
            || self.scratch(),
            |scratch, (row, out)| {
                let mut followed = 0;
                for (column, value) in out.iter_mut().enumerate() {
                    let around = Around { pixels, corrections, columns, column, row, alike_k: options.alike_k };
                    let spread_k = around.spread_k();
                    if spread_k > options.strong_k {
                        let offset = |k: usize| (k as f64 + 0.5) / side as f64 - 0.5;
                        let looks = (0..side * side).map(|k| (offset(k % side), offset(k / side)));
                        *value = self.mean_look(view, &around, looks, scratch, &mut followed)?;
                    } else if spread_k > options.weak_k {
                        *value = self.mean_look(view, &around, ROOKS.into_iter(), scratch, &mut followed)?;
                    }
                }
                rays.fetch_add(followed, Ordering::Relaxed);
                Ok::<(), SceneError>(())
            },
        )?;
        Ok(rays.into_inner())
    }

    /// The mean of the looks at offsets from the centre of a pixel. A pixel with no look inside the hemisphere is 0 K.
    fn mean_look(
        &self,
        view: &View,
        around: &Around<'_>,
        looks: impl Iterator<Item = (f64, f64)>,
        scratch: &mut Scratch,
        followed: &mut usize,
    ) -> Result<f64> {
        let one_face = around.is_one_face();
        let (mut sum, mut count) = (0.0, 0_u32);
        for (dx, dy) in looks {
            let (x, y) = (around.column as f64 + dx, around.row as f64 + dy);
            let Some(direction) = view.direction(x, y) else { continue };
            // If all nine pixels show one face, the edge is a mirrored one, and the first hit does not show it.
            let known = if one_face { None } else { around.near(self.face(view, direction)?, (dx, dy)) };
            sum += match known {
                Some(rj_k) => rj_k,
                None => {
                    *followed += 1;
                    let points = Points::of_pixel(x, y);
                    let bare = self.vertex(view, direction, points.using(Use::Nothing), scratch)?;
                    match around.correction(&bare, (dx, dy)) {
                        Some(correction_k) => bare.rj_k + correction_k,
                        None => self.vertex(view, direction, points.share(0, LOOK_SHARES), scratch)?.rj_k,
                    }
                }
            };
            count += 1;
        }
        Ok(if count == 0 { 0.0 } else { sum / f64::from(count) })
    }
}

/// A pixel and its neighbours.
struct Around<'a> {
    pixels: &'a [Vertex],
    corrections: &'a Corrections,
    columns: usize,
    column: usize,
    row: usize,
    /// Largest difference between pixels that show one face for which a look takes the temperature of a pixel, K.
    alike_k: f64,
}

impl Around<'_> {
    fn here(&self) -> &Vertex {
        &self.pixels[self.row * self.columns + self.column]
    }

    /// The pixel `dx` columns and `dy` rows away; `None` outside the picture.
    fn at(&self, dx: isize, dy: isize) -> Option<&Vertex> {
        let column = self.column.checked_add_signed(dx).filter(|c| *c < self.columns)?;
        let row = self.row.checked_add_signed(dy)?;
        self.pixels.get(row * self.columns + column)
    }

    fn neighbours(&self) -> impl Iterator<Item = &Vertex> {
        (-1..=1).flat_map(move |dy| (-1..=1).filter_map(move |dx| self.at(dx, dy)))
    }

    /// Difference between the warmest and the coldest pixel, K.
    fn spread_k(&self) -> f64 {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for v in self.neighbours() {
            (low, high) = (low.min(v.rj_k), high.max(v.rj_k));
        }
        high - low
    }

    fn is_one_face(&self) -> bool {
        self.neighbours().all(|v| v.face == self.here().face)
    }

    /// The nearest to an offset in this pixel of the nine pixels that show a face: its number, and the lowest and highest of their
    /// temperatures, K.
    fn nearest(&self, face: Face, (dx, dy): (f64, f64)) -> Option<(usize, [f64; 2])> {
        let mut best: Option<(f64, usize)> = None;
        let mut span = [f64::INFINITY, f64::NEG_INFINITY];
        for j in -1..=1_i32 {
            for i in -1..=1_i32 {
                let Some(v) = self.at(i as isize, j as isize).filter(|v| v.face == face) else { continue };
                span = [span[0].min(v.rj_k), span[1].max(v.rj_k)];
                let away = (f64::from(i) - dx).powi(2) + (f64::from(j) - dy).powi(2);
                if best.is_none_or(|b| away < b.0) {
                    let row = self.row.checked_add_signed(j as isize)?;
                    best = Some((away, row * self.columns + self.column.checked_add_signed(i as isize)?));
                }
            }
        }
        best.map(|(_, pixel)| (pixel, span))
    }

    /// What surfaces scatter to a look besides open sky: the correction of the nearest pixel that shows the same face. `None` if there is none.
    fn correction(&self, look: &Vertex, offset: (f64, f64)) -> Option<f64> {
        if !look.scatters {
            return Some(0.0);
        }
        let (pixel, _) = self.nearest(look.face, offset)?;
        self.corrections.of(pixel).map(|c| c[0])
    }

    /// Temperature of the nearest of the nine pixels that show a face. `None` if no pixel shows the face, or if the pixels that show it differ
    /// too much.
    fn near(&self, face: Face, offset: (f64, f64)) -> Option<f64> {
        let (pixel, [low, high]) = self.nearest(face, offset)?;
        (high - low <= self.alike_k).then(|| self.pixels[pixel].rj_k)
    }
}
