//! Smooth edges for the real-time mode.
//!
//! A pixel keeps its value if it differs little from its neighbours. Otherwise it becomes the mean of four looks, or of a grid of looks on
//! a strong edge. A look finds the first hit without radiometry. Most looks hit a face that one of the nine pixels around shows, and take
//! the temperature of that pixel. Where all nine show one face, a look must also agree with a pixel in the mirror. Only the others are followed as
//! full rays.

use super::blocks::Blocks;
use super::face::Face;
use super::lattice::{Points, Use};
use super::mesh_options::{EdgeOptions, MeshOptions};
use super::scatter_mesh::Corrections;
use super::scratch::Scratch;
use super::tracer::Tracer;
use super::vertex::{Shown, Vertex};
use crate::camera::View;
use crate::error::Result;
use rayon::prelude::*;

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
    /// Writes the temperatures of a frame to `out`, with every pixel on an edge replaced by the mean of its looks. Returns the number of looks that were followed as
    /// full rays.
    #[allow(clippy::too_many_arguments)] // the parts of a frame
    pub(super) fn smooth_edges(
        &self,
        view: &View,
        blocks: &Blocks,
        mesh: &MeshOptions,
        shown: &[Shown],
        corrections: &Corrections,
        rj_k: &[f64],
        out: &mut [f64],
    ) -> Result<usize> {
        let options = &mesh.edges;
        let side = options.strong_side;
        let columns = view.grid().n_l;
        let [weak_k, strong_k] = if mesh.antialias { limits(rj_k, columns, options) } else { [f64::INFINITY; 2] };
        out.par_chunks_mut(columns)
            .zip(rj_k.par_chunks(columns))
            .enumerate()
            .map_init(
                || (self.scratch(), Spreads::default()),
                |(scratch, spreads), (row, (out, line))| {
                    let mut followed = 0;
                    out.copy_from_slice(line);
                    let spreads_k = if mesh.antialias { spreads.of_row(rj_k, columns, row) } else { &[] };
                    for (column, &spread_k) in spreads_k.iter().enumerate().filter(|(_, spread_k)| **spread_k > weak_k) {
                        let around = Around::new(shown, rj_k, corrections, columns, (column, row), options.alike_k);
                        // A face that is curved or lit unevenly has no edge: its mean is the value in its middle.
                        if around.one_face && around.one_mirrored && bend_k(rj_k, columns, (column, row)) <= options.weak_k {
                            continue;
                        }
                        out[column] = if spread_k > strong_k {
                            let offset = |k: usize| (k as f64 + 0.5) / side as f64 - 0.5;
                            let looks = (0..side * side).map(|k| (offset(k % side), offset(k / side)));
                            self.mean_look(view, blocks, &around, looks, scratch, &mut followed)?
                        } else {
                            self.mean_look(view, blocks, &around, ROOKS.into_iter(), scratch, &mut followed)?
                        };
                    }
                    out.iter_mut().for_each(|t| *t = self.scaled(0, 0, *t));
                    Ok(followed)
                },
            )
            .sum()
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
        let (one_face, one_mirrored) = (around.one_face, around.one_mirrored);
        let on_ground = around.here.face.is_ground();
        let block = blocks.at(around.column, around.row);
        let (mut sum, mut count) = (0.0, 0_u32);
        for (dx, dy) in looks {
            let (x, y) = (around.column as f64 + dx, around.row as f64 + dy);
            let Some(along) = view.along(x, y) else { continue };
            let known = if one_face && (one_mirrored || !on_ground) {
                None
            } else {
                let look = self.look(view, along, block)?;
                let mirrored = if one_face { Some(self.mirrored(&look)?) } else { None };
                around.near(look.face, mirrored, (dx, dy))
            };
            sum += match known {
                Some(rj_k) => rj_k,
                None => {
                    *followed += 1;
                    let direction = view.unit(along);
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
            || (none(), Spreads::default()),
            |(mut counts, mut spreads), row| {
                spreads.of_row(values, columns, row).iter().for_each(|spread_k| counts[(*spread_k as usize).min(SPREADS - 1)] += 1);
                (counts, spreads)
            },
        )
        .map(|(counts, _)| counts)
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

/// Differences between the highest and the lowest of the nine pixels around each pixel of a row.
#[derive(Debug, Default)]
struct Spreads {
    /// The lowest and the highest of the values of each column in the row and the two rows beside it.
    low: Vec<f64>,
    high: Vec<f64>,
    spread_k: Vec<f64>,
}

impl Spreads {
    /// Those of a row.
    fn of_row(&mut self, values: &[f64], columns: usize, row: usize) -> &[f64] {
        let line = |r: usize| &values[r * columns..(r + 1) * columns];
        let last = values.len() / columns - 1;
        let (below, here, above) = (line(row.saturating_sub(1)), line(row), line((row + 1).min(last)));
        for extremes in [&mut self.low, &mut self.high, &mut self.spread_k] {
            extremes.resize(columns, 0.0);
        }
        for ((((low, high), a), b), c) in self.low.iter_mut().zip(&mut self.high).zip(below).zip(here).zip(above) {
            *low = smaller(smaller(*a, *b), *c);
            *high = larger(larger(*a, *b), *c);
        }
        if let [first, .., end] = self.spread_k.as_mut_slice() {
            *first = larger(self.high[0], self.high[1]) - smaller(self.low[0], self.low[1]);
            *end = larger(self.high[columns - 2], self.high[columns - 1]) - smaller(self.low[columns - 2], self.low[columns - 1]);
            for ((spread, low), high) in self.spread_k[1..].iter_mut().zip(self.low.windows(3)).zip(self.high.windows(3)) {
                *spread = larger(larger(high[0], high[1]), high[2]) - smaller(smaller(low[0], low[1]), low[2]);
            }
        } else {
            self.spread_k[0] = self.high[0] - self.low[0];
        }
        &self.spread_k
    }
}

/// One instruction, where `f64::min` looks for NaN.
#[inline]
fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// As [`smaller`].
#[inline]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// A pixel and its neighbours.
struct Around<'a> {
    /// Their number, and what each shows, its temperature in K, its place in the picture, and how far away it is, pixels.
    count: usize,
    near: [(Shown, f64, usize, [f64; 2]); 9],
    here: Shown,
    /// Whether all show one face, and one in the mirror.
    one_face: bool,
    one_mirrored: bool,
    corrections: &'a Corrections,
    column: usize,
    row: usize,
    /// Largest difference between pixels that show one face for which a look takes the temperature of a pixel, K.
    alike_k: f64,
}

impl<'a> Around<'a> {
    fn new(
        shown: &[Shown],
        rj_k: &[f64],
        corrections: &'a Corrections,
        columns: usize,
        (column, row): (usize, usize),
        alike_k: f64,
    ) -> Self {
        let here = shown[row * columns + column];
        let mut around =
            Self { count: 0, near: [Default::default(); 9], here, one_face: true, one_mirrored: true, corrections, column, row, alike_k };
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
    fn correction(&self, look: &Vertex, offset: (f64, f64)) -> Option<f64> {
        if !look.scatters {
            return Some(0.0);
        }
        let (pixel, ..) = self.nearest(look.face, None, offset)?;
        self.corrections.of(pixel).map(|c| c[0])
    }

    /// Temperature of the nearest of the nine pixels that show a face, and another one in the mirror if that is given. `None` if no pixel does, or
    /// if the pixels that do differ too much.
    fn near(&self, face: Face, mirrored: Option<Face>, offset: (f64, f64)) -> Option<f64> {
        let (_, rj_k, [low, high]) = self.nearest(face, mirrored, offset)?;
        (high - low <= self.alike_k).then_some(rj_k)
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
