//! Smooth edges for the real-time mode.
//!
//! A pixel keeps its value if it differs little from its neighbours. Otherwise it becomes the mean of four looks, or of a grid of looks on
//! a strong edge. A look finds the first hit without radiometry. Most looks hit a face that one of the nine pixels around shows, and take
//! the temperature of that pixel. Where all nine show one face, a look must also agree with a pixel in the mirror. Only the others are followed as
//! full rays.

use super::blocks::Blocks;
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

/// Number of differences of whole kelvins that are counted.
const SPREADS: usize = 512;

/// Limit for four looks, as a multiple of that for none. Near three, the last look that is left out at either limit adds the same squared error.
const RATIO: f64 = 3.0;

/// Mean squared error of a pixel with no look, with four, and with the grid, as a fraction of the square of its difference: a quarter and an eighth of
/// the difference, and what is measured with the grid. For the scenes that ship, where the error is more than 1 K with limits that do not rise, the
/// estimate is 1.0 to 1.7 times the error.
const ERRORS: [f64; 3] = [1.0 / 16.0, 1.0 / 64.0, 1.0 / 300.0];

/// A look at a face that no pixel around shows sends one of this many shares of the rays of a pixel.
const LOOK_SHARES: usize = 16;

impl Tracer<'_> {
    /// Replaces every pixel on an edge by the mean of its looks. Returns the number of looks that were followed as full rays.
    pub(super) fn smooth_edges(
        &self,
        view: &View,
        blocks: &Blocks,
        options: &EdgeOptions,
        pixels: &[Vertex],
        corrections: &Corrections,
        rj_k: &mut [f64],
    ) -> Result<usize> {
        let side = options.strong_side;
        let columns = view.grid().n_l;
        let rays = AtomicUsize::new(0);
        let before = rj_k.to_vec();
        let [weak_k, strong_k] = limits(&before, columns, options);
        rj_k.par_chunks_mut(columns).enumerate().try_for_each_init(
            || (self.scratch(), Vec::new(), Vec::new()),
            |(scratch, low, high), (row, out)| {
                let mut followed = 0;
                spans(&before, columns, row, low, high);
                for (column, value) in out.iter_mut().enumerate() {
                    let spread_k = spread_k(low, high, column);
                    if !(spread_k > weak_k) {
                        continue;
                    }
                    // A face that is curved or lit unevenly has no edge: its mean is the value in its middle.
                    let around = Around { pixels, corrections, columns, column, row, alike_k: options.alike_k };
                    if around.is_one_face() && around.is_one_mirrored() && bend_k(&before, columns, (column, row)) <= options.weak_k {
                        continue;
                    }
                    *value = if spread_k > strong_k {
                        let offset = |k: usize| (k as f64 + 0.5) / side as f64 - 0.5;
                        let looks = (0..side * side).map(|k| (offset(k % side), offset(k / side)));
                        self.mean_look(view, blocks, &around, looks, scratch, &mut followed)?
                    } else {
                        self.mean_look(view, blocks, &around, ROOKS.into_iter(), scratch, &mut followed)?
                    };
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
        blocks: &Blocks,
        around: &Around<'_>,
        looks: impl Iterator<Item = (f64, f64)>,
        scratch: &mut Scratch,
        followed: &mut usize,
    ) -> Result<f64> {
        // If all nine pixels show one face, the edge is a mirrored one, and the first hit does not show it. On level ground the mirrored hit does;
        // on bodies, which may be curved, temperatures change too fast along one face in the mirror.
        let (one_face, one_mirrored) = (around.is_one_face(), around.is_one_mirrored());
        let on_ground = around.here().is_ground();
        let block = blocks.at(around.column as f64, around.row as f64);
        let (mut sum, mut count) = (0.0, 0_u32);
        for (dx, dy) in looks {
            let (x, y) = (around.column as f64 + dx, around.row as f64 + dy);
            let Some(direction) = view.direction(x, y) else { continue };
            let known = if one_face && (one_mirrored || !on_ground) {
                None
            } else {
                let look = self.look(view, direction, block)?;
                let mirrored = if one_face { Some(self.mirrored(&look)?) } else { None };
                around.near(look.face, mirrored, (dx, dy))
            };
            sum += match known {
                Some(rj_k) => rj_k,
                None => {
                    *followed += 1;
                    let points = Points::of_pixel(x, y);
                    let bare = self.vertex(view, direction, points.using(Use::Nothing), block, scratch)?;
                    match around.correction(&bare, (dx, dy)) {
                        Some(correction_k) => bare.rj_k + correction_k,
                        None => self.vertex(view, direction, points.share(0, LOOK_SHARES), block, scratch)?.rj_k,
                    }
                }
            };
            count += 1;
        }
        Ok(if count == 0 { 0.0 } else { sum / f64::from(count) })
    }
}

/// The differences of the nine pixels around one up to which it gets no look, and up to which it gets four, K.
///
/// Both rise together from those of the options while the estimate of the error of the picture stays within the budget.
fn limits(values: &[f64], columns: usize, options: &EdgeOptions) -> [f64; 2] {
    let none = || vec![0_u32; SPREADS];
    let counts = (0..values.len() / columns)
        .into_par_iter()
        .fold(
            || (none(), Vec::new(), Vec::new()),
            |(mut counts, mut low, mut high), row| {
                spans(values, columns, row, &mut low, &mut high);
                (0..columns).for_each(|column| counts[(spread_k(&low, &high, column) as usize).min(SPREADS - 1)] += 1);
                (counts, low, high)
            },
        )
        .map(|(counts, ..)| counts)
        .reduce(none, |a, b| a.iter().zip(&b).map(|(a, b)| a + b).collect());
    // Sum of the squares of the differences below each kelvin.
    let mut below = vec![0.0; SPREADS + 1];
    for (k, count) in counts.iter().enumerate() {
        below[k + 1] = below[k] + f64::from(*count) * (k as f64 + 0.5).powi(2);
    }
    let at = |limit_k: f64| below[(limit_k as usize).min(SPREADS)];
    let strong = |weak_k: f64| options.strong_k.max(RATIO * weak_k);
    let estimate = |weak_k: f64| {
        let [no_look, four, all] = [at(weak_k), at(strong(weak_k)), below[SPREADS]];
        ERRORS[0] * no_look + ERRORS[1] * (four - no_look) + ERRORS[2] * (all - four)
    };
    let bound = options.budget_k.powi(2) * values.len() as f64;
    let mut weak_k = options.weak_k;
    while weak_k + 1.0 <= options.most_k && estimate(weak_k + 1.0) <= bound {
        weak_k += 1.0;
    }
    [weak_k, strong(weak_k)]
}

/// The largest difference between a pixel and the mean of two opposite neighbours.
fn bend_k(values: &[f64], columns: usize, (column, row): (usize, usize)) -> f64 {
    let at = |dx: isize, dy: isize| {
        let column = column.checked_add_signed(dx).filter(|c| *c < columns)?;
        values.get(row.checked_add_signed(dy)? * columns + column)
    };
    let here = values[row * columns + column];
    let bend = |(dx, dy): (isize, isize)| Some((0.5 * (at(dx, dy)? + at(-dx, -dy)?) - here).abs());
    [(1, 0), (0, 1), (1, 1), (1, -1)].into_iter().filter_map(bend).fold(0.0, f64::max)
}

/// The difference between the highest and the lowest of the nine pixels around one.
#[inline]
fn spread_k(low: &[f64], high: &[f64], column: usize) -> f64 {
    let near = column.saturating_sub(1)..(column + 2).min(low.len());
    let lowest = low[near.clone()].iter().fold(f64::INFINITY, |a, t| a.min(*t));
    high[near].iter().fold(f64::NEG_INFINITY, |a, t| a.max(*t)) - lowest
}

/// The lowest and the highest of the values of each column in a row and the two rows beside it.
fn spans(values: &[f64], columns: usize, row: usize, low: &mut Vec<f64>, high: &mut Vec<f64>) {
    let line = |r: usize| &values[r * columns..(r + 1) * columns];
    low.clear();
    low.extend_from_slice(line(row));
    high.clone_from(low);
    let last = values.len() / columns - 1;
    for other in [row.checked_sub(1), Some(row + 1).filter(|r| *r <= last)].into_iter().flatten() {
        for ((low, high), v) in low.iter_mut().zip(high.iter_mut()).zip(line(other)) {
            (*low, *high) = (low.min(*v), high.max(*v));
        }
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

    fn is_one_face(&self) -> bool {
        self.neighbours().all(|v| v.face == self.here().face)
    }

    fn is_one_mirrored(&self) -> bool {
        self.neighbours().all(|v| v.mirrored == self.here().mirrored)
    }

    /// The nearest to an offset in this pixel of the nine pixels that show a face, and another one in the mirror if that is given: its number, and the lowest and highest of their
    /// temperatures, K.
    fn nearest(&self, face: Face, mirrored: Option<Face>, (dx, dy): (f64, f64)) -> Option<(usize, [f64; 2])> {
        let mut best: Option<(f64, usize)> = None;
        let mut span = [f64::INFINITY, f64::NEG_INFINITY];
        for j in -1..=1_i32 {
            for i in -1..=1_i32 {
                let Some(v) = self.at(i as isize, j as isize) else { continue };
                if v.face != face || mirrored.is_some_and(|m| v.mirrored.is_some_and(|other| other != m)) {
                    continue;
                }
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
        let (pixel, _) = self.nearest(look.face, None, offset)?;
        self.corrections.of(pixel).map(|c| c[0])
    }

    /// Temperature of the nearest of the nine pixels that show a face, and another one in the mirror if that is given. `None` if no pixel does, or
    /// if the pixels that do differ too much.
    fn near(&self, face: Face, mirrored: Option<Face>, offset: (f64, f64)) -> Option<f64> {
        let (pixel, [low, high]) = self.nearest(face, mirrored, offset)?;
        (high - low <= self.alike_k).then(|| self.pixels[pixel].rj_k)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A step of a height in K between two halves of a picture.
    fn step(side: usize, height_k: f64) -> Vec<f64> {
        (0..side * side).map(|k| if k % side < side / 2 { 200.0 } else { 200.0 + height_k }).collect()
    }

    #[test]
    fn limits_rise_where_few_pixels_lie_on_edges() {
        let options = EdgeOptions::default();
        let at = |side: usize, height_k: f64, options: &EdgeOptions| limits(&step(side, height_k), side, options);
        // Two columns of pixels see the step: without looks, the error is a quarter of it on 2 / side of the picture.
        let error_k = |side: f64| 40.5 / 4.0 * (2.0 / side).sqrt();
        assert!(error_k(32.0) > options.budget_k && error_k(64.0) < options.budget_k);
        assert_eq!(at(32, 40.0, &options), [40.0, 120.0]);
        assert_eq!(at(64, 40.0, &options), [50.0, 150.0]);
        assert_eq!(at(16, 400.0, &options), [8.0, 100.0]);
        assert_eq!(at(64, 40.0, &EdgeOptions { budget_k: 0.0, ..options }), [8.0, 100.0]);
    }
}
