//! A few visibilities of one tile, whose places in the tile and whose phases are computed together.
//!
//! A run has about five visibilities, too few for vector instructions. A batch collects those of many runs.

use super::plan::Plan;
use super::plane_rows::TILE;
use super::real::{Real, cis_turns};
use super::sort::{Row, TilePlace};
use super::wplanes::{SLAB, WBasis};
use num_complex::Complex;

/// Most visibilities of a batch.
pub(super) const BATCH: usize = 64;
/// Visibilities whose places are computed at the same time.
const LANES: usize = 8;
/// A kernel starts up to a cell below the origin of its tile, and rounding adds a little. What lies farther below belongs to another period of the grid.
const EDGE_CELLS: f64 = 1.01;

/// Visibilities \[visibility\] of one tile, with lines of `D` numbers.
pub(super) struct Batch<T, const D: usize> {
    /// Number of visibilities.
    pub(super) n: usize,
    /// Cells along u and v and wavelengths along w.
    uvw: [[f64; BATCH]; 3],
    pub(super) re: [T; BATCH],
    pub(super) im: [T; BATCH],
    /// exp(2 pi i w n), with n at the middle of the range of n - 1.
    cos: [T; BATCH],
    sin: [T; BATCH],
    /// Index in the tile of the first number that a visibility reaches.
    pub(super) at: [i32; BATCH],
    /// Distance of a visibility above the lower end of the kernel along u and v, in cells.
    pub(super) z: [[T; BATCH]; 2],
    /// w as a part of its largest value, or the distance above the lower end of the kernel along w, in planes.
    pub(super) t: [T; BATCH],
    /// Number of planes that a visibility reaches.
    pub(super) planes: [i32; BATCH],
    /// In prediction: the lines whose sums are the visibilities.
    pub(super) line: [[T; D]; BATCH],
}

/// Where one tile lies, and how its numbers are ordered.
#[derive(Clone, Copy)]
pub(super) struct Frame {
    /// The positions along u and v whose kernel starts at the first cell of the tile, in cells, and the periods of the grid.
    origin: [f64; 2],
    period: [f64; 2],
    /// The same along w, in planes.
    origin_w: f64,
    /// Numbers of a line of the tile and of all planes of a line.
    pub(super) stride: usize,
    pub(super) row_len: usize,
}

impl Frame {
    /// Of a tile whose lines have `lanes` cells more than starting cells.
    pub(super) fn of<T: Real>(plan: &Plan<T>, tile: TilePlace, lanes: usize) -> Self {
        let half = plan.table.support as f64 / 2.0;
        let origin = [(tile.u * TILE) as f64 - plan.columns.left as f64 + half, (tile.v * TILE) as f64 - plan.below() as f64 + half];
        let origin_w = match &plan.w.basis {
            WBasis::Powers { .. } => 0.0,
            WBasis::Planes { table, .. } => (tile.slab * SLAB) as f64 + table.support as f64 / 2.0,
        };
        let stride = 2 * (TILE + lanes);
        Self { origin, period: [plan.nu as f64, plan.nv as f64], origin_w, stride, row_len: plan.slab_depth() * stride }
    }
}

impl<T: Real, const D: usize> Batch<T, D> {
    pub(super) fn new() -> Self {
        let zero = [T::default(); BATCH];
        Self {
            n: 0,
            uvw: [[0.0; BATCH]; 3],
            re: zero,
            im: zero,
            cos: zero,
            sin: zero,
            at: [0; BATCH],
            z: [zero; 2],
            t: zero,
            planes: [0; BATCH],
            line: [[T::default(); D]; BATCH],
        }
    }

    /// Add visibilities of a row until the batch is full. Visibilities that are 0 are left out. Returns how many were taken.
    #[inline(always)]
    pub(super) fn take(&mut self, row: &Row, freq_hz: &[f64], nodes: &[Complex<T>]) -> usize {
        let sign = if row.conjugate { -T::one() } else { T::one() };
        let mut n = self.n;
        for (k, (f, v)) in freq_hz.iter().zip(nodes).enumerate() {
            if n >= BATCH {
                self.n = n;
                return k;
            }
            for (own, x) in self.uvw.iter_mut().zip(row.uvw) {
                own[n] = x * f;
            }
            (self.re[n], self.im[n]) = (v.re, v.im * sign);
            n += usize::from(v.re != T::default() || v.im != T::default());
        }
        self.n = n;
        freq_hz.len().min(nodes.len())
    }

    /// Add the places of visibilities of a row until the batch is full. Returns how many were taken.
    #[inline(always)]
    pub(super) fn take_places(&mut self, row: &Row, freq_hz: &[f64]) -> usize {
        let n = freq_hz.len().min(BATCH - self.n);
        for (own, x) in self.uvw.iter_mut().zip(row.uvw) {
            for (own, f) in own[self.n..].iter_mut().zip(&freq_hz[..n]) {
                *own = x * f;
            }
        }
        self.n += n;
        n
    }

    /// The visibilities: the sums over their lines. `values` has room for all.
    #[inline(always)]
    pub(super) fn sums(&mut self, values: &mut [Complex<T>; BATCH]) {
        // Each step stores what it has, so that the compiler adds whole halves of lines.
        let mut half = D / 2;
        while half >= 2 {
            for line in &mut self.line[..self.n] {
                let (low, high) = line.split_at_mut(half);
                for j in 0..half {
                    low[j] += high[j];
                }
            }
            half /= 2;
        }
        for k in 0..self.n {
            (self.re[k], self.im[k]) = (self.line[k][0], self.line[k][1]);
        }
        self.turn(false);
        for (k, value) in values.iter_mut().enumerate().take(self.n) {
            *value = Complex::new(self.re[k], self.im[k]);
        }
    }

    /// Compute the places of all visibilities in their tile.
    #[inline(always)]
    pub(super) fn place(&mut self, plan: &Plan<T>, frame: &Frame) {
        for at in (0..self.n).step_by(LANES) {
            let (mut u, mut v, mut w) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
            for k in 0..LANES {
                (u[k], v[k], w[k]) = (self.uvw[0][at + k], self.uvw[1][at + k], self.uvw[2][at + k]);
            }
            let mut first = [0.0; LANES];
            for k in 0..LANES {
                let (cell_u, z_u) = cell(within(u[k] - frame.origin[0], frame.period[0]), TILE);
                let (cell_v, z_v) = cell(within(v[k] - frame.origin[1], frame.period[1]), TILE);
                first[k] = cell_v * frame.row_len as f64 + cell_u * 2.0;
                (self.z[0][at + k], self.z[1][at + k]) = (T::of(z_u), T::of(z_v));
            }
            match &plan.w.basis {
                WBasis::Powers { inverse_w, enough, .. } => {
                    let mut planes = [1; LANES];
                    for e in enough {
                        for k in 0..LANES {
                            planes[k] += i32::from((w[k] * inverse_w).abs() > *e);
                        }
                    }
                    for k in 0..LANES {
                        (self.t[at + k], self.planes[at + k]) = (T::of(w[k] * inverse_w), planes[k]);
                    }
                }
                WBasis::Planes { first: first_w, step, table, .. } => {
                    for k in 0..LANES {
                        let (plane, z) = cell((w[k] - first_w) / step - frame.origin_w, SLAB);
                        first[k] += plane * frame.stride as f64;
                        (self.t[at + k], self.planes[at + k]) = (T::of(z), table.support as i32);
                    }
                }
            }
            for k in 0..LANES {
                self.at[at + k] = first[k] as i32;
                let phase: Complex<T> = cis_turns(w[k] * plan.w.nu_mid);
                (self.cos[at + k], self.sin[at + k]) = (phase.re, phase.im);
            }
        }
    }

    /// Multiply the values by the phase of w, or by its conjugate.
    #[inline(always)]
    pub(super) fn turn(&mut self, conjugate: bool) {
        for k in 0..self.n.next_multiple_of(LANES).min(BATCH) {
            let (re, im, cos) = (self.re[k], self.im[k], self.cos[k]);
            let sin = if conjugate { -self.sin[k] } else { self.sin[k] };
            (self.re[k], self.im[k]) = (re * cos - im * sin, im * cos + re * sin);
        }
    }
}

/// A position relative to the origin of its tile, in the period of the grid where it lies in the tile.
#[inline(always)]
fn within(a: f64, period: f64) -> f64 {
    a - period * ((a + EDGE_CELLS) / period).floor()
}

/// The first cell of a position in its tile, and the distance of the position above the lower end of its kernel.
///
/// The runs were cut so that every visibility lies in its tile to within rounding (`cut` in `sort.rs` checks this). The bounds handle that
/// rounding, and they make the index safe.
#[inline(always)]
fn cell(a: f64, side: usize) -> (f64, f64) {
    // At an exact cell this takes the next cell, where z is 1 instead of 0. The kernel is equally accurate there.
    let i = (a + 1.0).floor();
    let most = (side - 1) as f64;
    let i = if i < most { i } else { most };
    let i = if i > 0.0 { i } else { 0.0 };
    (i, i - a)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_of_all_periods_come_to_the_same_cell() {
        for period in [20.0, 96.0] {
            for a in [-0.999, -0.5, 0.0, 7.25, 15.0] {
                for turns in -2..=2 {
                    let (i, z) = cell(within(a + period * f64::from(turns), period), TILE);
                    assert!((i - a - z).abs() < 1e-12 && (0.0..=1.0).contains(&z), "{a} {turns}: {i} {z}");
                }
            }
        }
    }

    #[test]
    fn a_batch_leaves_out_what_is_zero_and_says_when_it_is_full() {
        let row = Row { uvw: [1.0, 2.0, 3.0], class: 0, offset: 0, conjugate: true };
        let nodes: Vec<Complex<f32>> = (0..BATCH + 10).map(|k| Complex::new(if k % 5 == 0 { 0.0 } else { k as f32 }, 0.0)).collect();
        let freq_hz: Vec<f64> = (0..nodes.len()).map(|k| k as f64).collect();
        let mut batch = Batch::<f32, 8>::new();
        let taken = batch.take(&row, &freq_hz, &nodes);
        assert_eq!((batch.n, taken), (59, BATCH + 10));
        assert!(batch.re[..batch.n].iter().zip(&batch.uvw[1]).all(|(v, y)| *v != 0.0 && f64::from(*v) * 2.0 == *y));
        assert_eq!((batch.take(&row, &freq_hz, &nodes), batch.n), (7, BATCH));
        assert_eq!(batch.take_places(&row, &freq_hz), 0);
    }
}
