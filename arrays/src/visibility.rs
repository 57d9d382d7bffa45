//! Visibilities with their header: array, channels, polarisations, phase centres and unit.

use crate::coverage::append_rows;
use crate::{Annotations, ArrayError, ArrayLayout, NearField, PhaseCenter, Polarization, Result, SpectralWindow, UvCoverage};
use ndarray::{Array3, s};
use num_complex::Complex;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Runs of so many samples (1 MiB) or more are copied by all threads. To hand a part of a shorter run over takes longer than to copy it.
const LARGE: usize = 1 << 16;
/// Values that a thread copies at once.
const PART: usize = 1 << 14;
/// Most values that a thread lists at once.
const LISTED: usize = 1 << 12;

/// Unit of a visibility.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum VisUnit {
    /// Jansky.
    Jy,
    /// Kelvin steradian (`K str`): the integral of brightness temperature over solid angle.
    KelvinSr,
    /// Not calibrated: units of the correlator.
    Uncalibrated,
}

impl VisUnit {
    /// Name as in UVH5: `Jy`, `K str`, `uncalib`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Jy => "Jy",
            Self::KelvinSr => "K str",
            Self::Uncalibrated => "uncalib",
        }
    }

    /// The unit with this name in UVH5. An unknown name means uncalibrated.
    #[must_use]
    pub fn from_name(name: &str) -> Self {
        match name.trim().to_ascii_lowercase().as_str() {
            "jy" => Self::Jy,
            "k str" | "k sr" => Self::KelvinSr,
            _ => Self::Uncalibrated,
        }
    }
}

/// The properties that all rows of a set share.
#[derive(Debug, Clone, PartialEq)]
pub struct VisibilityHeader {
    /// The array. The rows hold indices of its antennas.
    pub layout: ArrayLayout,
    /// Channels.
    pub spectrum: SpectralWindow,
    /// Polarisation products \[pol\].
    pub polarizations: Vec<Polarization>,
    /// Phase centres, at least one. The rows hold indices of them.
    pub phase_centers: Vec<PhaseCenter>,
    /// Unit of the visibilities.
    pub unit: VisUnit,
    /// Telescope name, as it is written for other programs.
    pub telescope: String,
    /// Instrument name.
    pub instrument: String,
    /// Constant brightness temperature removed from the scene before the transform, K; images add it back.
    pub pedestal_k: Option<f64>,
    /// Pedestal that suits the scene, K, where the scene is known: its mean if it is warm up to its edges, otherwise 0.
    pub scene_pedestal_k: Option<f64>,
    /// Width of the square about the phase centre that holds the simulated scene, as a difference of direction cosines. Images cover it by default.
    pub scene_width_rad: Option<f64>,
    /// Mean temperature of what one element sees, weighted with its pattern over the half space, K: a measurement of total power. It is the zero
    /// spacing over the solid angle of the pattern.
    pub antenna_temperature_k: Option<f64>,
    /// Where the scene lies, and the point to which the visibilities are phased. The uvw are differences of positions in any case.
    pub near_field: NearField,
    /// What is only carried from file to file.
    pub annotations: Annotations,
    /// History of the data, oldest first, one entry per line.
    pub history: Vec<String>,
}

impl VisibilityHeader {
    /// Shape of the data of `rows` rows: \[blt, chan, pol\].
    #[must_use]
    pub fn shape(&self, rows: usize) -> (usize, usize, usize) {
        (rows, self.spectrum.n_chan(), self.polarizations.len())
    }

    /// Check that a block belongs to this header.
    ///
    /// # Errors
    /// Channel or polarisation counts that differ from the header's, antennas or phase centres that the header does not have.
    pub fn check_block(&self, block: &VisibilityBlock) -> Result<()> {
        check_block(self, block)
    }

    /// True where the uvw are baselines of an aperture plane and not phased to the sky.
    #[must_use]
    pub fn is_boresight(&self) -> bool {
        matches!(self.layout.frame, crate::LayoutFrame::Boresight)
    }
}

/// A run of rows: coverage, visibilities, weights and flags.
#[derive(Debug, Clone, PartialEq)]
pub struct VisibilityBlock {
    /// Baselines and times of the rows.
    pub coverage: UvCoverage,
    /// Visibilities \[blt, chan, pol\] in the unit of the header. A point source S at (l, m) gives
    /// S exp(+2 pi i (u l + v m + w (n - 1))).
    pub vis: Array3<Complex<f32>>,
    /// Weights 1/sigma^2 of the real part \[blt, chan, pol\]; non-positive or non-finite ones count as flagged.
    pub weights: Array3<f32>,
    /// True where the visibility must not be used \[blt, chan, pol\].
    pub flags: Array3<bool>,
    /// Number of samples averaged into the visibility \[blt, chan, pol\].
    pub nsamples: Array3<f32>,
}

impl VisibilityBlock {
    /// A block from its parts.
    ///
    /// # Errors
    /// Any array that is not \[blt, chan, pol\] with the rows of `coverage`.
    pub fn new(
        coverage: UvCoverage,
        vis: Array3<Complex<f32>>,
        weights: Array3<f32>,
        flags: Array3<bool>,
        nsamples: Array3<f32>,
    ) -> Result<Self> {
        let expected = [coverage.n_rows(), vis.shape()[1], vis.shape()[2]];
        for (what, shape) in
            [("visibilities", vis.shape()), ("weights", weights.shape()), ("flags", flags.shape()), ("nsamples", nsamples.shape())]
        {
            ArrayError::unless_shape(what, shape, &expected)?;
        }
        Ok(Self { coverage, vis, weights, flags, nsamples })
    }

    /// Unflagged zeros of unit weight for the rows of `coverage`.
    #[must_use]
    pub fn zeros(coverage: UvCoverage, n_chan: usize, n_pol: usize) -> Self {
        let shape = (coverage.n_rows(), n_chan, n_pol);
        Self {
            coverage,
            vis: Array3::zeros(shape),
            weights: Array3::ones(shape),
            flags: Array3::from_elem(shape, false),
            nsamples: Array3::ones(shape),
        }
    }

    /// Number of rows.
    #[must_use]
    pub fn n_rows(&self) -> usize {
        self.coverage.n_rows()
    }

    /// The weight with which a visibility may be used. It is 0 where the visibility is flagged, the weight is not positive, or the weight or
    /// the visibility is not finite, or so large that its square is not (above 1e19).
    #[must_use]
    pub fn usable_weight(&self, row: usize, chan: usize, pol: usize) -> f32 {
        let i = (row, chan, pol);
        let w = self.weights[i];
        let v = self.vis[i];
        if !self.flags[i] && w > 0.0 && w.is_finite() && v.norm_sqr().is_finite() { w } else { 0.0 }
    }

    /// Append the rows of `other`.
    ///
    /// # Errors
    /// Another number of channels or polarisations.
    pub fn append(&mut self, other: &Self) -> Result<()> {
        append_rows("visibilities", &mut self.vis, &other.vis)?;
        append_rows("weights", &mut self.weights, &other.weights)?;
        append_rows("flags", &mut self.flags, &other.flags)?;
        append_rows("nsamples", &mut self.nsamples, &other.nsamples)?;
        self.coverage.append(&other.coverage)
    }

    /// A run of rows, copied. Two threads copy a large run.
    ///
    /// # Errors
    /// A range past the last row.
    pub fn rows(&self, range: Range<usize>) -> Result<Self> {
        ArrayError::unless_rows(&range, self.n_rows())?;
        if range.len() * self.vis.shape()[1] * self.vis.shape()[2] >= LARGE {
            let others = || (copied(&self.weights, &range), copied(&self.flags, &range), copied(&self.nsamples, &range));
            let visibilities = || (copied(&self.vis, &range), self.coverage.rows(range.clone()));
            let ((vis, coverage), (weights, flags, nsamples)) = rayon::join(visibilities, others);
            return Ok(Self { coverage: coverage?, vis, weights, flags, nsamples });
        }
        let part = s![range.clone(), .., ..];
        Ok(Self {
            coverage: self.coverage.rows(range)?,
            vis: self.vis.slice(part).to_owned(),
            weights: self.weights.slice(part).to_owned(),
            flags: self.flags.slice(part).to_owned(),
            nsamples: self.nsamples.slice(part).to_owned(),
        })
    }
}

/// Some rows of an array, copied by all threads.
fn copied<T: Copy + Send + Sync>(all: &Array3<T>, rows: &Range<usize>) -> Array3<T> {
    let part = all.slice(s![rows.clone(), .., ..]);
    let mut copy = Vec::new();
    append_shared(&mut copy, part.as_slice().unwrap_or_default());
    Array3::from_shape_vec(part.raw_dim(), copy).unwrap_or_else(|_| part.to_owned())
}

/// Append values to a list. All threads copy, because the first touch of new memory takes longer than the copy.
pub fn append_shared<T: Copy + Send + Sync>(list: &mut Vec<T>, values: &[T]) {
    list.reserve(values.len());
    let room = &mut list.spare_capacity_mut()[..values.len()];
    room.par_chunks_mut(PART).zip(values.par_chunks(PART)).for_each(|(to, from)| {
        to.iter_mut().zip(from).for_each(|(to, from)| {
            to.write(*from);
        });
    });
    let n = list.len() + values.len();
    // SAFETY: the values after the old ones were written above.
    unsafe { list.set_len(n) };
}

/// What `of` finds in some rows, in their order. All threads look, each at a part of the rows, and each list has room for `most` values of every row:
/// threads whose lists grow bit by bit wait for each other.
pub fn found_shared<T: Send>(rows: Range<usize>, most: usize, of: impl Fn(Range<usize>, &mut Vec<T>) + Sync) -> Vec<T> {
    let step = (LISTED / most.max(1)).max(1);
    let starts: Vec<usize> = rows.clone().step_by(step).collect();
    let part = |start: usize| {
        let part = start..(start + step).min(rows.end);
        let mut list = Vec::with_capacity(part.len() * most);
        of(part, &mut list);
        list
    };
    let parts: Vec<Vec<T>> = starts.into_par_iter().map(part).collect();
    let mut all = Vec::with_capacity(parts.iter().map(Vec::len).sum());
    parts.into_iter().for_each(|part| all.extend(part));
    all
}

/// A whole set in memory: the one-block case of a stream.
#[derive(Debug, Clone, PartialEq)]
pub struct VisibilitySet {
    /// What all rows share.
    pub header: VisibilityHeader,
    /// All rows.
    pub data: VisibilityBlock,
}

impl VisibilitySet {
    /// A set whose block fits its header.
    ///
    /// # Errors
    /// Channel or polarisation counts that differ from the header's, antennas or phase centres that the header does not have.
    pub fn new(header: VisibilityHeader, data: VisibilityBlock) -> Result<Self> {
        check_block(&header, &data)?;
        Ok(Self { header, data })
    }
}

/// Check that a block belongs to a header.
///
/// # Errors
/// See [`VisibilitySet::new`].
pub(crate) fn check_block(header: &VisibilityHeader, data: &VisibilityBlock) -> Result<()> {
    let (rows, chan, pol) = header.shape(data.n_rows());
    ArrayError::unless_shape("visibilities", data.vis.shape(), &[rows, chan, pol])?;
    let n_ant = header.layout.n_ant();
    for ant in [&data.coverage.ant1, &data.coverage.ant2] {
        if let Some(a) = ant.iter().find(|a| **a as usize >= n_ant) {
            return Err(ArrayError::OutOfRange { what: "antenna", index: *a as usize, len: n_ant });
        }
    }
    let n_pc = header.phase_centers.len();
    if let Some(p) = data.coverage.phase_center.iter().find(|p| usize::from(**p) >= n_pc) {
        return Err(ArrayError::OutOfRange { what: "phase centre", index: usize::from(*p), len: n_pc });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::Array2;

    #[test]
    fn rows_that_all_threads_copy_are_those_of_the_block() {
        let n = LARGE / 4;
        let (uvw, numbers) = (Array2::from_shape_fn((n, 3), |(r, k)| (3 * r + k) as f64), (0..n).map(|r| r as f64));
        let coverage = UvCoverage::new(uvw, vec![0; n], vec![1; n], numbers.collect(), vec![1.0; n], vec![0; n]).unwrap();
        let block = VisibilityBlock {
            coverage,
            vis: Array3::from_shape_fn((n, 4, 2), |(r, c, p)| Complex::new(r as f32, (2 * c + p) as f32)),
            weights: Array3::from_shape_fn((n, 4, 2), |(r, c, p)| (r * 8 + c * 2 + p) as f32),
            flags: Array3::from_shape_fn((n, 4, 2), |(r, c, p)| (r + c + p).is_multiple_of(3)),
            nsamples: Array3::from_shape_fn((n, 4, 2), |(r, c, p)| (r % 7 + c + p) as f32),
        };
        // All threads copy the first run, and one thread the second.
        for range in [37..n - 5, 100..103] {
            let (rows, part) = (block.rows(range.clone()).unwrap(), s![range.clone(), .., ..]);
            assert_eq!(rows.coverage, block.coverage.rows(range).unwrap());
            assert_eq!(rows.vis, block.vis.slice(part));
            assert_eq!(rows.weights, block.weights.slice(part));
            assert_eq!(rows.flags, block.flags.slice(part));
            assert_eq!(rows.nsamples, block.nsamples.slice(part));
        }
        assert!(block.rows(0..n + 1).is_err() && block.rows(n..n).unwrap().n_rows() == 0);
    }

    #[test]
    fn appended_values_follow_those_of_before() {
        let values: Vec<u32> = (2..3 * PART as u32 + 7).collect();
        let mut list = vec![0, 1];
        append_shared(&mut list, &values);
        append_shared(&mut list, &[]);
        assert!(list.len() == values.len() + 2 && list.iter().enumerate().all(|(k, v)| *v == k as u32));
    }
}
