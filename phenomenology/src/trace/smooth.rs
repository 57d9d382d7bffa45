//! Smooth edges for the real-time mode: a few looks for a pixel on an edge, and temperatures of its neighbours.
//!
//! Weak edges stay as they are, strong ones get nine looks. A look finds the first hit without radiometry. Most looks of a pixel on an edge show what one of the nine pixels around
//! it shows, and take its temperature; only what none of them shows is followed in full.

use super::follow::Scratch;
use super::realtime::{Face, Vertex};
use super::tracer::Tracer;
use crate::atmosphere::PhysicsError;
use crate::camera::View;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Looks of a pixel, as four rooks: one in each quarter of the columns and of the rows.
const ROOKS: [(f64, f64); 4] = [(-0.375, -0.125), (-0.125, 0.375), (0.125, -0.375), (0.375, 0.125)];
/// Spread of the neighbours below which an edge is left alone, K.
const WEAK_K: f64 = 6.0;
/// Spread above which it gets a grid of looks, K.
const STRONG_K: f64 = 80.0;
/// Spread of pixels that show one face up to which a look takes the temperature of the nearest, K.
const ALIKE_K: f64 = 30.0;
/// Side of that grid.
const SIDE: usize = 3;

impl Tracer<'_> {
    /// Replaces every pixel on an edge by the mean of its looks; returns how many were followed in full.
    pub(super) fn smooth_edges(&self, view: &View, pixels: &[Vertex], rj_k: &mut [f64]) -> Result<usize, PhysicsError> {
        let columns = view.grid().n_l;
        let rays = AtomicUsize::new(0);
        rj_k.par_chunks_mut(columns).enumerate().try_for_each_init(
            || self.scratch(),
            |scratch, (row, out)| {
                let mut followed = 0;
                for (column, value) in out.iter_mut().enumerate() {
                    let around = Around::new(pixels, columns, column, row);
                    let spread_k = around.spread_k();
                    if spread_k > STRONG_K {
                        let offset = |k: usize| (k as f64 + 0.5) / SIDE as f64 - 0.5;
                        let looks = (0..SIDE * SIDE).map(|k| (offset(k % SIDE), offset(k / SIDE)));
                        *value = self.mean_look(view, &around, looks, scratch, &mut followed)?;
                    } else if spread_k > WEAK_K {
                        *value = self.mean_look(view, &around, ROOKS.into_iter(), scratch, &mut followed)?;
                    }
                }
                rays.fetch_add(followed, Ordering::Relaxed);
                Ok(())
            },
        )?;
        Ok(rays.into_inner())
    }

    fn mean_look(
        &self,
        view: &View,
        around: &Around<'_>,
        looks: impl Iterator<Item = (f64, f64)>,
        scratch: &mut Scratch,
        followed: &mut usize,
    ) -> Result<f64, PhysicsError> {
        let one_face = around.is_one_face();
        let (mut sum, mut count) = (0.0, 0_u32);
        for (dx, dy) in looks {
            let Some(direction) = view.direction(around.column as f64 + dx, around.row as f64 + dy) else { continue };
            // Where only a mirrored edge runs through the pixel, a first hit tells nothing.
            let known = if one_face { None } else { around.near(self.face(view, direction), dx, dy) };
            sum += match known {
                Some(rj_k) => rj_k,
                None => {
                    *followed += 1;
                    self.vertex(view, direction, scratch)?.rj_k
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
    columns: usize,
    column: usize,
    row: usize,
}

impl<'a> Around<'a> {
    fn new(pixels: &'a [Vertex], columns: usize, column: usize, row: usize) -> Self {
        Self { pixels, columns, column, row }
    }

    fn here(&self) -> &Vertex {
        &self.pixels[self.row * self.columns + self.column]
    }

    /// The pixel so many columns and rows away, in the picture.
    fn at(&self, dx: isize, dy: isize) -> Option<&Vertex> {
        let column = self.column.checked_add_signed(dx).filter(|c| *c < self.columns)?;
        let row = self.row.checked_add_signed(dy)?;
        self.pixels.get(row * self.columns + column)
    }

    fn neighbours(&self) -> impl Iterator<Item = &Vertex> {
        (-1..=1).flat_map(move |dy| (-1..=1).filter_map(move |dx| self.at(dx, dy)))
    }

    /// Between the warmest and the coldest, K.
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

    /// Temperature of a face in the nearest of the nine pixels to a place in this one; `None` where none shows the face, or
    /// where they disagree, as on the round edge of a metal body.
    fn near(&self, face: Face, dx: f64, dy: f64) -> Option<f64> {
        let mut best: Option<(f64, f64)> = None;
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for j in -1..=1_i32 {
            for i in -1..=1_i32 {
                let Some(v) = self.at(i as isize, j as isize).filter(|v| v.face == face) else { continue };
                (low, high) = (low.min(v.rj_k), high.max(v.rj_k));
                let away = (f64::from(i) - dx).powi(2) + (f64::from(j) - dy).powi(2);
                if best.is_none_or(|b| away < b.0) {
                    best = Some((away, v.rj_k));
                }
            }
        }
        best.filter(|_| high - low <= ALIKE_K).map(|b| b.1)
    }
}
