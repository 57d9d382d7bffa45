//! A dirty beam, prepared for the subtraction of components: its largest values under tiles, and its convolution with whole images.

use super::minor::Component;
use super::tile_loops::{Beam, Bounds, SIDE};
use crate::fourier::{Convolver, Spectrum};
use crate::{ChainError, Result, ensure};
use ndarray::{ArcArray2, Array2, Array4, ArrayView2, Axis, s};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::OnceLock;

/// Side of the squares in which the largest |beam| is known.
const STEP: usize = 8;
/// Squares along a tile.
const STEPS: usize = SIDE / STEP;
/// Most bright pixels whose beams are subtracted one by one from a whole image. The beam comes from memory for each, which takes a few times as
/// long as its multiply-adds.
const FEW: usize = 64;

/// A dirty beam, prepared for subtraction.
pub(super) struct TiledBeam {
    psf: ArcArray2<f32>,
    n_m: usize,
    n_l: usize,
    /// Largest |beam| over the squares that a tile can cover which begins in square ((i - 1) STEPS + p, (j - 1) STEPS + q) \[p, q, i, j\]. They are made
    /// where they are first needed.
    bounds: OnceLock<Array4<f64>>,
    convolver: Convolver<f32>,
}

impl TiledBeam {
    /// The beam keeps the array, which is in row order.
    pub(super) fn new(psf: &ArcArray2<f32>) -> Result<Self> {
        let (n_m, n_l) = psf.dim();
        ensure!(psf.is_standard_layout(), ChainError::Incompatible("a dirty beam must lie in memory row after row".into()));
        let convolver = Convolver::new((n_m, n_l), n_m.max(n_l) / 2);
        Ok(Self { psf: psf.clone(), n_m, n_l, bounds: OnceLock::new(), convolver })
    }

    /// One row of the beam.
    pub(super) fn line(&self, row: usize) -> &[f32] {
        &self.psf.as_slice().unwrap_or_default()[row * self.n_l..(row + 1) * self.n_l]
    }

    /// The beam as the loops over a tile read it.
    pub(super) fn values(&self) -> Beam<'_> {
        Beam::of(&self.psf)
    }

    /// The array of the beam, which is not copied.
    pub(super) fn shared(&self) -> ArcArray2<f32> {
        self.psf.clone()
    }

    /// The largest |beam| over each tile of the residual for a component.
    pub(super) fn bounds_for(&self, component: &Component) -> Bounds<'_> {
        // First pixel of the beam over tile (0, 0), in tiles and, within one, in squares. A tile that begins before the beam overlaps it with its
        // second half. Index 0 is such a tile.
        let shift = |center: usize, at: usize| {
            let first = center as i64 - at as i64;
            (first.div_euclid(SIDE as i64) + 1, first.rem_euclid(SIDE as i64) as usize / STEP)
        };
        let ((s_m, p), (s_l, q)) = (shift(self.n_m / 2, component.row), shift(self.n_l / 2, component.column));
        let own = self.bounds.get_or_init(|| bounds(&self.psf)).slice(s![p, q, .., ..]);
        Bounds { columns: own.ncols(), values: own.to_slice().unwrap_or_default(), shift: (s_m, s_l) }
    }

    /// The spectrum of the beam, for [`TiledBeam::subtract`]. It takes more memory than two images.
    pub(super) fn spectrum(&self) -> Spectrum<f32> {
        self.convolver.kernel(self.psf.view())
    }

    pub(super) fn shape(&self) -> (usize, usize) {
        (self.n_m, self.n_l)
    }

    /// A model in flux per pixel, convolved with the beam.
    pub(super) fn convolve(&self, flux: ArrayView2<'_, f32>, spectrum: &Spectrum<f32>) -> Array2<f32> {
        self.convolver.convolve(flux, spectrum)
    }

    /// Subtract point components, convolved with the beam, from an image. The spectrum is made where it is needed, and kept.
    pub(super) fn subtract(&self, components: &[Component], spectrum: &mut Option<Spectrum<f32>>, image: &mut Array2<f32>) {
        let mut sums = BTreeMap::<(usize, usize), f64>::new();
        components.iter().for_each(|c| *sums.entry((c.row, c.column)).or_default() += c.flux);
        let points: Vec<(usize, usize, f64)> = sums.into_iter().map(|((row, column), flux)| (row, column, flux)).collect();
        if points.len() <= FEW {
            return self.subtract_few(&points, image);
        }
        self.convolver.subtract_points(&points, spectrum.get_or_insert_with(|| self.spectrum()), image);
    }

    /// Subtract the beams of some points (row, column, flux), row after row.
    fn subtract_few(&self, points: &[(usize, usize, f64)], image: &mut Array2<f32>) {
        let (n_m, n_l) = (self.n_m, self.n_l);
        image.axis_iter_mut(Axis(0)).into_par_iter().enumerate().for_each(|(i, mut line)| {
            for (row, column, flux) in points {
                let Some(of_beam) = (i + n_m / 2).checked_sub(*row).filter(|r| *r < n_m) else { continue };
                // Pixel j of the line has pixel j + n_l / 2 - column of the beam.
                let (first, from) = (column.saturating_sub(n_l / 2), (n_l / 2).saturating_sub(*column));
                let n = (n_l - first).min(n_l - from);
                let (flux, beam) = (*flux as f32, &self.line(of_beam)[from..from + n]);
                line.slice_mut(s![first..first + n]).iter_mut().zip(beam).for_each(|(v, b)| *v -= flux * b);
            }
        });
    }
}

/// The bounds of a beam, for tiles that begin anywhere.
fn bounds(psf: &ArcArray2<f32>) -> Array4<f64> {
    let (n_m, n_l) = psf.dim();
    let (s_m, s_l) = (n_m.div_ceil(STEP), n_l.div_ceil(STEP));
    let mut squares = Array2::<f64>::zeros((s_m, s_l));
    let bands = squares.axis_iter_mut(Axis(0)).into_par_iter().zip(psf.axis_chunks_iter(Axis(0), STEP));
    bands.for_each(|(mut squares, rows)| {
        for row in rows.rows() {
            for (b, part) in squares.iter_mut().zip(row.axis_chunks_iter(Axis(0), STEP)) {
                *b = b.max(part.iter().fold(0.0_f32, |a, v| a.max(v.abs())).into());
            }
        }
    });
    // A tile that begins in square `at` - STEPS ends in square `at`.
    let covered = |at: usize, n: usize| at.saturating_sub(STEPS).min(n)..(at + 1).min(n);
    let tiles = |n: usize| n.div_ceil(SIDE) + 1;
    let rows = Array2::from_shape_fn((s_m, tiles(n_l) * STEPS), |(i, at)| covered(at, s_l).map(|j| squares[(i, j)]).fold(0.0, f64::max));
    Array4::from_shape_fn((STEPS, STEPS, tiles(n_m), tiles(n_l)), |(p, q, i, j)| {
        covered(i * STEPS + p, s_m).map(|at| rows[(at, j * STEPS + q)]).fold(0.0, f64::max)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The largest |beam| over a tile that begins anywhere is at most its bound, and equal to it where the tile begins and ends with a square.
    #[test]
    fn bounds_hold_wherever_a_tile_begins() {
        let (n_m, n_l) = (72, 100);
        let psf = Array2::from_shape_fn((n_m, n_l), |(i, j)| ((i * 7919 + j * 104_729) % 1013) as f32 * 1e-3 - 0.4).into_shared();
        let all = bounds(&psf);
        let side = SIDE as i64;
        let mut equal = 0;
        for m in 1 - side..n_m as i64 {
            for l in 1 - side..n_l as i64 {
                let inside = |first: i64, n: usize| first.max(0) as usize..((first + side) as usize).min(n);
                let true_one = psf.slice(s![inside(m, n_m), inside(l, n_l)]).iter().fold(0.0_f32, |a, v| a.max(v.abs()));
                let of = |first: i64| (first.rem_euclid(side) as usize / STEP, (first.div_euclid(side) + 1) as usize);
                let ((p, i), (q, j)) = (of(m), of(l));
                let bound = all[(p, q, i, j)];
                assert!(f64::from(true_one) <= bound, "{m} {l}");
                equal += usize::from(f64::from(true_one) == bound);
            }
        }
        assert!(equal > 100);
    }
}
