//! The transform of one output channel, kept from the beam to the last major cycle.
//!
//! Where the data are in memory, the order of their rows on the grid is found once and used by every pass.

use super::data::ReducedBlock;
use crate::Result;
use crate::fourier::{Degridder, GridOptions, Gridder, Real, SortedRows, Transform, UvwExtent};
use cittert_arrays::SkyGrid;
use num_complex::Complex;
use std::ops::{AddAssign, Range};

/// Bytes of sorted rows that are kept in memory.
const KEEP_BYTES: usize = 192 << 20;

/// The transform of one output channel.
#[derive(Debug)]
pub(super) struct Session<T: Real> {
    pub(super) transform: Transform<T>,
    /// Weights are divided by this before they meet single precision, so that their unit cannot overflow it.
    pub(super) scale: f64,
    channels: Range<usize>,
    /// Of the first blocks.
    rows: Vec<SortedRows>,
}

/// Chi squared and the number of data.
#[derive(Debug, Default, Clone, Copy)]
pub(super) struct Residue {
    pub(super) chi2: f64,
    pub(super) used: u64,
}

impl AddAssign for Residue {
    fn add_assign(&mut self, other: Self) {
        self.chi2 += other.chi2;
        self.used += other.used;
    }
}

impl<T: Real> Session<T> {
    pub(super) fn new(
        grid: &SkyGrid,
        (channels, freq_hz): (Range<usize>, &[f64]),
        extent: UvwExtent,
        (opts, n_vis): (&GridOptions, u64),
        scale: f64,
    ) -> Result<Self> {
        let transform = Transform::new(grid, &freq_hz[channels.clone()], extent, opts, n_vis)?;
        Ok(Self { transform, scale, channels, rows: Vec::new() })
    }

    /// The order of the rows of a block: the one that is kept, or a new one, which is kept where it may be.
    fn sorted(&mut self, (number, keep): (usize, bool), block: &ReducedBlock) -> Result<Option<SortedRows>> {
        if !keep || number > self.rows.len() {
            return self.transform.sort(block.uvw_m.view()).map(Some);
        }
        if number < self.rows.len() {
            return Ok(None);
        }
        let rows = self.transform.sort(block.uvw_m.view())?;
        let held: usize = self.rows.iter().map(SortedRows::bytes).sum();
        if held + rows.bytes() > KEEP_BYTES {
            return Ok(Some(rows));
        }
        self.rows.push(rows);
        Ok(None)
    }

    /// Add to `gridder` what `value` makes of (visibility, image weight).
    pub(super) fn grid(
        &mut self,
        (number, keep): (usize, bool),
        block: &ReducedBlock,
        gridder: &mut Gridder<T>,
        value: &(impl Fn(Complex<T>, T) -> Complex<T> + Sync),
    ) -> Result<()> {
        let new = self.sorted((number, keep), block)?;
        let inverse = self.scale.recip();
        let (vis, imaging) = (&block.vis, &block.imaging);
        let values = |r: usize, out: &mut [Complex<T>]| {
            let (Some(v), Some(w)) = (row(vis, r, &self.channels), row(imaging, r, &self.channels)) else {
                return out.fill(Complex::default());
            };
            for c in 0..out.len().min(v.len()).min(w.len()) {
                let seen = Complex::new(T::of(f64::from(v[c].re)), T::of(f64::from(v[c].im)));
                out[c] = if w[c] > 0.0 { value(seen, T::of(f64::from(w[c]) * inverse)) } else { Complex::default() };
            }
        };
        match new.as_ref().or_else(|| self.rows.get(number)) {
            Some(rows) => gridder.add_sorted(rows, values),
            None => Ok(()),
        }
    }

    /// Add to `gridder` the weighted rest of the visibilities without the model.
    pub(super) fn residual(
        &mut self,
        (number, keep): (usize, bool),
        block: &ReducedBlock,
        model: &Degridder<T>,
        gridder: &mut Gridder<T>,
    ) -> Result<Residue> {
        let new = self.sorted((number, keep), block)?;
        let inverse = self.scale.recip();
        let subtract = |r: usize, out: &mut [Complex<T>]| {
            let mut left = Residue::default();
            let (vis, weight, imaging) =
                (row(&block.vis, r, &self.channels), row(&block.weight, r, &self.channels), row(&block.imaging, r, &self.channels));
            let (Some(vis), Some(weight), Some(imaging)) = (vis, weight, imaging) else {
                out.fill(Complex::default());
                return left;
            };
            for c in 0..out.len().min(vis.len()).min(weight.len()).min(imaging.len()) {
                let d = Complex::new(T::of(f64::from(vis[c].re)) - out[c].re, T::of(f64::from(vis[c].im)) - out[c].im);
                if weight[c] > 0.0 {
                    left.chi2 += f64::from(weight[c]) * d.norm_sqr().to64();
                    left.used += 1;
                }
                out[c] = if imaging[c] > 0.0 { d.scale(T::of(f64::from(imaging[c]) * inverse)) } else { Complex::default() };
            }
            left
        };
        match new.as_ref().or_else(|| self.rows.get(number)) {
            Some(rows) => gridder.add_residual(rows, model, subtract),
            None => Ok(Residue::default()),
        }
    }
}

/// Some channels of a row.
fn row<'a, V>(array: &'a ndarray::Array2<V>, row: usize, channels: &Range<usize>) -> Option<&'a [V]> {
    let n = array.ncols();
    array.as_slice()?.get(row * n + channels.start..row * n + channels.end)
}
