//! Rows of a set, reduced to one polarisation product.

use super::places_of_rows::finite_uvw;
use super::pol::{DataCounts, PolSelector, RowValues};
use super::row_weights::{Common, PlaceOfWeights, RowWeights};
use crate::nearfield::boresight_turn;
use crate::pages::zeroed;
use crate::{ChainError, Result, ensure};
use cittert_arrays::{FocusPoint, PartSource, RowPart, UvCoverage, VisibilityBlock};
use ndarray::{Array1, Array2, ArrayView1, ArrayView2};
use num_complex::{Complex32, Complex64};
use rayon::prelude::*;
use std::mem::MaybeUninit;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

/// Size in bytes of the products of the rows that are combined together: with their sources they fit into the first cache of a core.
const PART_BYTES: usize = 1 << 15;

/// Rows that are reduced to one polarisation product.
#[derive(Debug, Clone)]
pub struct ReducedBlock {
    /// Antennas of the rows; empty unless they were asked for.
    pub antennas: Vec<[u32; 2]>,
    /// uvw, m \[row, 3\]. A uvw that is not finite is replaced by 0; the weights of its row are 0.
    pub uvw_m: Array2<f64>,
    /// Visibilities \[row, chan\]; 0 if they must not count. There are none in blocks of which only the weights are kept or
    /// read.
    pub vis: Array2<Complex32>,
    /// Weights of the data, 1/sigma^2 \[row, chan\]; 0 if they must not count.
    pub weight: RowWeights,
    /// Imaging weights \[row, chan\]; see [`super::weights`]. `None` where they are the weights of the data.
    pub imaging: Option<Array2<f32>>,
}

impl ReducedBlock {
    /// Number of values \[row, chan\], whether or not the visibilities are kept.
    #[must_use]
    pub fn n_values(&self) -> usize {
        self.uvw_m.nrows() * self.vis.ncols()
    }

    /// True if the visibilities of the rows are kept.
    pub(super) fn has_visibilities(&self) -> bool {
        self.vis.nrows() == self.uvw_m.nrows()
    }

    /// Imaging weights \[row, chan\].
    #[must_use]
    pub fn imaging(&self) -> ArrayView2<'_, f32> {
        self.imaging.as_ref().map_or_else(|| self.weight.view(), |own| own.view())
    }
}

/// Takes the visibilities and weights \[row, chan\] of those rows of a block that lie between two multiples of the step in which they are read.
pub(super) type Take<'t> = dyn Fn(Range<usize>, &[Complex32], &[f32]) + Sync + 't;

/// How rows are reduced to one polarisation product.
#[derive(Debug)]
pub(super) struct Reduction {
    pub(super) selector: PolSelector,
    pub(super) unit_weights: bool,
    /// Keep the antennas of the rows.
    pub(super) antennas: bool,
    /// The focus from which visibilities are turned back to the boresight, for Fourier images, and the channels, Hz.
    pub(super) focus: Option<(FocusPoint, Vec<f64>)>,
}

impl Reduction {
    /// Combine the polarisation products of a block.
    pub(super) fn reduce(&self, block: &VisibilityBlock) -> Result<(ReducedBlock, DataCounts)> {
        let (rows, chans) = (block.vis.shape()[0], block.vis.shape()[1]);
        let (mut vis, mut weight) = (zeroed(rows * chans), zeroed(rows * chans));
        let own = self.selector.by_row(&block.coverage)?;
        let counts = vis
            .par_chunks_exact_mut(chans.max(1))
            .zip(weight.par_chunks_exact_mut(chans.max(1)))
            .enumerate()
            .map(|(r, (v, w))| {
                let counts = self.selector.row(block, (r, own.as_ref().map(|own| &own[r])), self.unit_weights, (v, w));
                self.turn(block.coverage.uvw_m.row(r), v);
                counts
            })
            .reduce(DataCounts::default, DataCounts::plus);
        let weight = RowWeights::Each(Array2::from_shape_vec((rows, chans), weight).map_err(wrong)?);
        Ok((self.shaped(&block.coverage, chans, (vis, weight))?, counts))
    }

    /// Number of rows with `chans` channels that are read and combined together.
    pub(super) fn step(&self, chans: usize) -> usize {
        (PART_BYTES / (size_of::<Complex32>() * chans.max(1) * self.selector.terms().max(1))).max(1)
    }

    /// Combine the polarisation products of rows with this coverage and `chans` channels while the source reads them. The block has their visibilities,
    /// unless they are taken.
    pub(super) fn reduce_parts(
        &self,
        (coverage, chans): (&UvCoverage, usize),
        (source, range): (&mut dyn PartSource, Range<usize>),
        taken: Option<&Take<'_>>,
    ) -> Result<(ReducedBlock, DataCounts)> {
        let rows = coverage.n_rows();
        let step = self.step(chans);
        let kept = if taken.is_some() { 0 } else { rows * chans };
        let (mut vis, mut weight) = (Vec::with_capacity(kept), Vec::with_capacity(rows * chans));
        let own = self.selector.by_row(coverage)?;
        let of_part = step * chans.max(1);
        let memory = (&mut vis.spare_capacity_mut()[..kept], &mut weight.spare_capacity_mut()[..rows * chans]);
        let mut of_vis = memory.0.chunks_mut(of_part);
        let place = |weight| Place { vis: of_vis.next().unwrap_or_default(), weight: PlaceOfWeights::new(weight), cleared: false };
        let places = memory.1.chunks_mut(of_part).map(place).map(Mutex::new);
        let (mut places, common): (Vec<_>, _) = (places.collect(), Common::new());
        let counts = Mutex::new(DataCounts::default());
        // Working memory of the threads.
        let spare: Mutex<Vec<(Vec<Complex32>, Vec<f32>)>> = Mutex::default();
        let take = |part: RowPart<'_>| {
            let Some(place) = places.get(part.rows.start / step) else { return };
            let mut place = place.lock().unwrap_or_else(PoisonError::into_inner);
            let first = part.rows.start % step;
            let n = part.vis.len() / part.rows.len().max(1);
            let (memory, weights) = place.get();
            // Values that are taken stay in the cache until then.
            let (mut own_vis, mut own_weights) = spare.lock().unwrap_or_else(PoisonError::into_inner).pop().unwrap_or_default();
            let of_taken = if taken.is_some() { part.rows.len() * chans } else { 0 };
            own_vis.resize(of_taken, Complex32::default());
            own_weights.resize(of_taken.max(chans), 0.0);
            let vis = if taken.is_some() { &mut own_vis[..] } else { &mut memory[first * chans..] };
            let mut sum = DataCounts::default();
            for ((k, r), vis) in part.rows.clone().enumerate().zip(vis.chunks_exact_mut(chans.max(1))) {
                let at = k * n..(k + 1) * n;
                let values = RowValues { vis: &part.vis[at.clone()], weights: &part.weights[at.clone()], flags: &part.flags[at] };
                let own = own.as_ref().map(|own| &own[r]);
                let row = if taken.is_some() { &mut own_weights[k * chans..(k + 1) * chans] } else { &mut own_weights[..] };
                sum = sum.plus(self.selector.row_of((coverage, r), (values, own), self.unit_weights, (vis, row)));
                self.turn(coverage.uvw_m.row(r), vis);
                weights.set(first + k, row, &common);
            }
            drop(place);
            if let Some(take) = taken {
                take(part.rows, &own_vis, &own_weights);
            }
            spare.lock().unwrap_or_else(PoisonError::into_inner).push((own_vis, own_weights));
            let mut counts = counts.lock().unwrap_or_else(PoisonError::into_inner);
            *counts = counts.plus(sum);
        };
        source.read_parts(range, step, &take)?;
        let counts = counts.into_inner().unwrap_or_else(PoisonError::into_inner);
        ensure!(counts.total == (rows * chans) as u64, ChainError::Internal(format!("{} values in parts of {rows} rows", counts.total)));
        let mut places: Vec<Place<'_>> = places.drain(..).map(|p| p.into_inner().unwrap_or_else(PoisonError::into_inner)).collect();
        for place in &mut places {
            place.get();
        }
        let differ = common.get().is_none() || places.iter().any(|p| p.weight.differs());
        if differ {
            places.par_iter_mut().for_each(|p| {
                p.weight.written(&common);
            });
        }
        drop(places);
        // SAFETY: the places are all of the memory, and each was cleared.
        unsafe { vis.set_len(kept) };
        let weight = match common.into_inner() {
            Some(row) if !differ => RowWeights::Same(Array1::from_vec(row), rows),
            _ => {
                // SAFETY: the places are all of the memory, and each was written.
                unsafe { weight.set_len(rows * chans) };
                RowWeights::Each(Array2::from_shape_vec((rows, chans), weight).map_err(wrong)?)
            }
        };
        Ok((self.shaped(coverage, chans, (vis, weight))?, counts))
    }

    /// Rows with this coverage and the same weights \[chan\], without their visibilities.
    pub(super) fn weights_only(&self, coverage: &UvCoverage, row: &Array1<f32>) -> Result<ReducedBlock> {
        self.shaped(coverage, row.len(), (Vec::new(), RowWeights::Same(row.clone(), coverage.n_rows())))
    }

    /// Rows as a block.
    fn shaped(&self, coverage: &UvCoverage, chans: usize, (vis, weight): (Vec<Complex32>, RowWeights)) -> Result<ReducedBlock> {
        let uvw_m = finite_uvw(coverage)?;
        let vis = Array2::from_shape_vec((vis.len() / chans.max(1), chans), vis).map_err(wrong)?;
        let pair = |(a, b): (&u32, &u32)| [*a, *b];
        let antennas = if self.antennas { coverage.ant1.iter().zip(&coverage.ant2).map(pair).collect() } else { Vec::new() };
        Ok(ReducedBlock { antennas, uvw_m, vis, weight, imaging: None })
    }

    /// Turn the visibilities of a row from the focus to the boresight.
    fn turn(&self, uvw: ArrayView1<'_, f64>, vis: &mut [Complex32]) {
        let Some((focus, freq_hz)) = &self.focus else { return };
        for (v, freq) in vis.iter_mut().zip(freq_hz) {
            let turn = boresight_turn(*focus, [uvw[0], uvw[1], uvw[2]], *freq);
            let turned = Complex64::new(v.re.into(), v.im.into()) * turn;
            *v = if *v == Complex32::default() { *v } else { Complex32::new(turned.re as f32, turned.im as f32) };
        }
    }
}

fn wrong(e: ndarray::ShapeError) -> ChainError {
    ChainError::Internal(e.to_string())
}

/// Memory of the visibilities and weights of some rows. The thread that first needs that of the visibilities clears it, so that the system gives
/// new pages to all threads, and what was cleared is in the cache when it is written.
struct Place<'a> {
    vis: &'a mut [MaybeUninit<Complex32>],
    weight: PlaceOfWeights<'a>,
    cleared: bool,
}

impl<'a> Place<'a> {
    fn get(&mut self) -> (&mut [Complex32], &mut PlaceOfWeights<'a>) {
        if !self.cleared {
            self.vis.iter_mut().for_each(|v| *v = MaybeUninit::new(Complex32::default()));
            self.cleared = true;
        }
        // SAFETY: all elements were written above, now or before, and the slice is borrowed as long as this place.
        let vis = unsafe { std::slice::from_raw_parts_mut(self.vis.as_mut_ptr().cast(), self.vis.len()) };
        (vis, &mut self.weight)
    }
}
