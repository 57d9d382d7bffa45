//! The transform of one output channel. It is kept from the first beam to the last major cycle.
//!
//! If the data are in memory, their rows are sorted once and every pass uses the sorted rows.

use super::reduction::ReducedBlock;
use crate::fourier::{GridOptions, Real, SortedRows, Transform, UvwExtent};
use crate::memory::MemoryBudget;
use crate::{ChainError, Result, ensure};
use cittert_arrays::{Ranks, SkyGrid};
use ndarray::{ArrayView2, Axis};
use num_complex::{Complex, Complex32};
use std::ops::{AddAssign, Range};

/// The oversampling of the grid depends on the number of visibilities up to this number. Longer sets do not need more memory.
pub(super) const LONG: u64 = 100_000_000;

/// The transform of one output channel.
#[derive(Debug)]
pub(super) struct Session<T: Real> {
    pub(super) transform: Transform<T>,
    /// Weights are divided by this number before they are rounded to `T`, so that a large unit cannot overflow it.
    pub(super) scale: f64,
    channels: Range<usize>,
    /// Sorted rows of the first blocks.
    rows: Vec<SortedRows>,
    memory: MemoryBudget,
}

/// What is gridded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Gridded {
    /// The visibilities.
    Visibilities,
    /// 1 in place of each visibility: the result is the beam.
    Beam,
}

/// The weights with which residuals are gridded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ResidualWeights {
    /// The imaging weights.
    Imaging,
    /// The weights of the data, 1/sigma^2: the sum is then the slope of chi squared.
    Data,
}

/// Chi squared and the number of visibilities in it.
#[derive(Debug, Default, Clone, Copy)]
pub(super) struct Residue {
    pub(super) chi2: f64,
    pub(super) used: u64,
}

/// Writes the weighted visibilities of a row into a slice \[chan\].
pub(super) type Values<'v, T> = dyn Fn(usize, &mut [Complex<T>]) + Sync + 'v;

/// What is gridded of the sorted rows of a block.
pub(super) struct Weighed<'v, T> {
    /// The weighted visibilities of each row.
    pub(super) values: &'v Values<'v, T>,
    /// The same of every row \[chan\], where the rows are known not to differ.
    pub(super) equal: Option<Vec<Complex<T>>>,
}

/// Replaces the predicted visibilities of a row \[chan\] by weighted residuals, and says what they leave of chi squared.
pub(super) type Subtract<'v, T> = dyn Fn(usize, &mut [Complex<T>]) -> Residue + Sync + 'v;

impl AddAssign for Residue {
    fn add_assign(&mut self, other: Self) {
        self.chi2 += other.chi2;
        self.used += other.used;
    }
}

impl Residue {
    /// Replace both numbers by their sums over all processes.
    pub(super) fn share(&mut self, ranks: &dyn Ranks) {
        let mut sums = [self.chi2, self.used as f64];
        ranks.sum(&mut sums);
        (self.chi2, self.used) = (sums[0], sums[1] as u64);
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
        Ok(Self { transform, scale, channels, rows: Vec::new(), memory: opts.memory })
    }

    /// The sorted rows of a block that are not kept. `None` if the kept rows have them; new rows are kept while the memory budget allows it.
    fn sorted(&mut self, (number, keep): (usize, bool), block: &ReducedBlock) -> Result<Option<SortedRows>> {
        if !keep || number > self.rows.len() {
            return self.transform.sort(block.uvw_m.view()).map(Some);
        }
        if number < self.rows.len() {
            return Ok(None);
        }
        let rows = self.transform.sort(block.uvw_m.view())?;
        let held: usize = self.rows.iter().map(SortedRows::bytes).sum();
        if held + rows.bytes() > self.memory.sorted_rows() {
            return Ok(Some(rows));
        }
        self.rows.push(rows);
        Ok(None)
    }

    /// True if the order of the rows of so many blocks is kept.
    pub(super) fn keeps(&self, blocks: usize) -> bool {
        self.rows.len() >= blocks
    }

    /// The kept rows of a block.
    fn kept(&self, number: usize) -> Result<&SortedRows> {
        self.rows.get(number).ok_or_else(|| ChainError::Internal(format!("the rows of block {number} were not kept")))
    }

    /// The visibilities of a block, in the channels of this transform.
    fn visibilities<'b>(&self, block: &'b ReducedBlock) -> Result<Rows<'b, Complex32>> {
        ensure!(block.has_visibilities(), ChainError::Internal("visibilities are asked for that were not kept".into()));
        Rows::of(block.vis.view(), &self.channels)
    }

    /// Grid a block with its imaging weights: `add` is given its sorted rows, and their weighted visibilities.
    pub(super) fn grid(
        &mut self,
        (number, keep): (usize, bool),
        block: &ReducedBlock,
        what: Gridded,
        add: impl FnOnce(&SortedRows, &Weighed<'_, T>) -> Result<()>,
    ) -> Result<()> {
        let new = self.sorted((number, keep), block)?;
        let rows = new.as_ref().map_or_else(|| self.kept(number), Ok)?;
        let inverse = self.scale.recip();
        let imaging = Rows::of(block.imaging(), &self.channels)?;
        let weight = |w: f32| if w > 0.0 { T::of(f64::from(w) * inverse) } else { T::default() };
        if what == Gridded::Beam {
            let values = |r: usize, out: &mut [Complex<T>]| {
                out.iter_mut().zip(imaging.row(r)).for_each(|(out, w)| *out = Complex::new(weight(*w), T::default()));
            };
            let equal = || imaging.row(0).iter().map(|w| Complex::new(weight(*w), T::default())).collect();
            return add(rows, &Weighed { values: &values, equal: imaging.are_equal().then(equal) });
        }
        let vis = self.visibilities(block)?;
        let values = |r: usize, out: &mut [Complex<T>]| {
            for ((out, v), w) in out.iter_mut().zip(vis.row(r)).zip(imaging.row(r)) {
                let whole = Complex::new(T::of(f64::from(v.re)), T::of(f64::from(v.im)));
                *out = if *w > 0.0 { whole.scale(weight(*w)) } else { Complex::default() };
            }
        };
        add(rows, &Weighed { values: &values, equal: None })
    }

    /// Give `work` the sorted rows of a block.
    pub(super) fn with_sorted<R>(
        &mut self,
        (number, keep): (usize, bool),
        block: &ReducedBlock,
        work: impl FnOnce(&SortedRows) -> Result<R>,
    ) -> Result<R> {
        let new = self.sorted((number, keep), block)?;
        work(new.as_ref().map_or_else(|| self.kept(number), Ok)?)
    }

    /// The residual of a block, weighted with `weights` over `scale`: `make` is given its sorted rows, and what subtracts predicted visibilities of a row
    /// from those of the data.
    pub(super) fn residual(
        &mut self,
        (number, keep): (usize, bool),
        block: &ReducedBlock,
        (weights, scale): (ResidualWeights, f64),
        make: impl FnOnce(&SortedRows, &Subtract<'_, T>) -> Result<Residue>,
    ) -> Result<Residue> {
        let new = self.sorted((number, keep), block)?;
        let inverse = scale.recip();
        let gridded = if weights == ResidualWeights::Imaging { block.imaging() } else { block.weight.view() };
        let (vis, weight, gridded) =
            (self.visibilities(block)?, Rows::of(block.weight.view(), &self.channels)?, Rows::of(gridded, &self.channels)?);
        let subtract = |r: usize, out: &mut [Complex<T>]| {
            let mut left = Residue::default();
            for (((out, v), weight), gridded) in out.iter_mut().zip(vis.row(r)).zip(weight.row(r)).zip(gridded.row(r)) {
                let d = Complex::new(T::of(f64::from(v.re)) - out.re, T::of(f64::from(v.im)) - out.im);
                if *weight > 0.0 {
                    left.chi2 += f64::from(*weight) * d.norm_sqr().to64();
                    left.used += 1;
                }
                *out = if *gridded > 0.0 { d.scale(T::of(f64::from(*gridded) * inverse)) } else { Complex::default() };
            }
            left
        };
        make(new.as_ref().map_or_else(|| self.kept(number), Ok)?, &subtract)
    }
}

/// The channels of one output channel in the rows of an array \[row, chan\].
struct Rows<'a, V> {
    values: &'a [V],
    /// From the start of a row to that of the next; 0 where all rows are the same.
    step: usize,
    channels: Range<usize>,
}

impl<'a, V> Rows<'a, V> {
    fn of(array: ArrayView2<'a, V>, channels: &Range<usize>) -> Result<Self> {
        let n_chan = array.ncols();
        let common = array.nrows() > 1 && array.strides()[0] == 0;
        let (values, step) = if common { (array.index_axis_move(Axis(0), 0).to_slice(), 0) } else { (array.to_slice(), n_chan) };
        match values {
            Some(values) if channels.end <= n_chan => Ok(Self { values, step, channels: channels.clone() }),
            _ => Err(ChainError::Internal(format!("a block of {n_chan} channels has no channels {channels:?}, or is not in row order"))),
        }
    }

    /// True where the rows lie at one place.
    fn are_equal(&self) -> bool {
        self.step == 0
    }

    fn row(&self, row: usize) -> &'a [V] {
        &self.values[row * self.step + self.channels.start..row * self.step + self.channels.end]
    }
}
