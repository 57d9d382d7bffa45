//! The residual in tiles. A tile is updated only when it could contain the peak.
//!
//! CLEAN needs only the peak of the residual in each iteration. Each tile stores its peak at the time of its last update, and an upper bound of
//! what later components can have added to it. The bound of a component is its flux times the largest value of the beam over the tile, from a
//! coarse map of the beam. A tile whose bound is below the true peak is not updated. When a tile must be updated, all its pending components
//! are subtracted together while the tile is in cache. The components are those of the plain algorithm.
//! If nearly all tiles must be updated, one convolution with all pending components is faster than the update of the tiles.
//!
//! Images and the beam are in single precision, the sums of a tile in double precision. A minor cycle lowers the peak by a factor of 20 at most,
//! so that the rounding of the residual, 6e-8 of the peak, is far below what the cycle leaves. The next major cycle does not inherit it.

use super::minor::{Component, Peak};
use super::tile_loops::{AREA, Beam, Bounds, Pixels, SIDE, apply, largest, raise, tile_peak};
use crate::fourier::{Convolver, Spectrum};
use crate::{ChainError, Result, ensure};
use ndarray::{ArcArray2, Array2, ArrayBase, ArrayView2, Axis, Data, Ix2, s};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Time of an update of the whole residual by convolution, in multiply-adds per pixel.
const CONVOLUTION: usize = 500;
/// Most bright pixels whose beams are subtracted one by one from a whole image. The beam comes from memory for each, which takes a few times as
/// long as its multiply-adds.
const FEW: usize = 64;

/// Tiles whose bound exceeds this part of the last peak will soon have to be updated.
const SOON: f64 = 0.95;
/// Number of components in tiles, about 0.1 ms of work, from which on several tiles are updated together.
const ENOUGH: usize = 300;

/// A dirty beam, prepared for subtraction.
pub(super) struct TiledBeam {
    psf: ArcArray2<f32>,
    n_m: usize,
    n_l: usize,
    /// Largest |beam| over the square of two by two blocks that starts at block (i - 1, j - 1) \[i, j\].
    bounds: Array2<f64>,
    convolver: Convolver<f32>,
}

impl TiledBeam {
    /// The beam keeps the array, which is in row order.
    pub(super) fn new(psf: &ArcArray2<f32>) -> Result<Self> {
        let (n_m, n_l) = psf.dim();
        ensure!(psf.is_standard_layout(), ChainError::Incompatible("a dirty beam must lie in memory row after row".into()));
        let (b_m, b_l) = (n_m.div_ceil(SIDE), n_l.div_ceil(SIDE));
        let mut blocks = Array2::<f64>::zeros((b_m + 2, b_l + 2));
        for (i, row) in psf.rows().into_iter().enumerate() {
            for (j, part) in row.axis_chunks_iter(Axis(0), SIDE).enumerate() {
                let b = &mut blocks[(i / SIDE + 1, j + 1)];
                *b = b.max(part.iter().fold(0.0_f32, |a, v| a.max(v.abs())).into());
            }
        }
        let bounds = Array2::from_shape_fn((b_m + 1, b_l + 1), |(i, j)| {
            blocks[(i, j)].max(blocks[(i + 1, j)]).max(blocks[(i, j + 1)]).max(blocks[(i + 1, j + 1)])
        });
        let convolver = Convolver::new((n_m, n_l), n_m.max(n_l) / 2);
        Ok(Self { psf: psf.clone(), n_m, n_l, bounds, convolver })
    }

    /// One row of the beam.
    pub(super) fn line(&self, row: usize) -> &[f32] {
        &self.psf.as_slice().unwrap_or_default()[row * self.n_l..(row + 1) * self.n_l]
    }

    /// The beam as the loops over a tile read it.
    fn values(&self) -> Beam<'_> {
        Beam { values: self.psf.as_slice().unwrap_or_default(), n_m: self.n_m, n_l: self.n_l }
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

/// The state of the residual between components.
pub(super) struct TiledResidual<'a> {
    beam: &'a TiledBeam,
    t_m: usize,
    t_l: usize,
    /// Values \[tile, row, column\]. Pixels outside the image or the mask are never a peak. Most tiles of a large image are never updated, and
    /// take no memory.
    tiles: Vec<Tile>,
    allowed: Option<Vec<bool>>,
    negative: bool,
    /// Upper bound of the peak of each tile, and the largest bound of each row of tiles.
    upper: Vec<f64>,
    row_upper: Vec<f64>,
    components: Vec<Component>,
    /// The residual before `components`, for the convolution.
    base: Array2<f32>,
    /// The spectrum of the beam, once a convolution has been needed.
    spectrum: Option<Spectrum<f32>>,
    work: usize,
    /// The last peak.
    last: f64,
}

struct Tile {
    /// Its pixels; `None` until a component is subtracted from it: they are then those of the residual before the components.
    values: Option<Box<Pixels>>,
    /// Number of components that were subtracted from the tile.
    applied: usize,
    /// Index of the peak at the last update.
    peak_at: usize,
}

impl<'a> TiledResidual<'a> {
    pub(super) fn new(beam: &'a TiledBeam, residual: Array2<f32>, mask: Option<&Array2<bool>>, negative: bool) -> Self {
        let (t_m, t_l) = (beam.n_m.div_ceil(SIDE), beam.n_l.div_ceil(SIDE));
        let outside = !beam.n_m.is_multiple_of(SIDE) || !beam.n_l.is_multiple_of(SIDE);
        let allowed = (mask.is_some() || outside).then(|| {
            let at = |k: usize| (k / AREA / t_l * SIDE + k % AREA / SIDE, k / AREA % t_l * SIDE + k % SIDE);
            (0..t_m * t_l * AREA).map(|k| residual.get(at(k)).is_some() && mask.is_none_or(|m| m[at(k)])).collect()
        });
        let tiles = (0..t_m * t_l).map(|_| Tile { values: None, applied: 0, peak_at: 0 }).collect();
        let mut state = Self {
            beam,
            t_m,
            t_l,
            tiles,
            allowed,
            negative,
            upper: vec![0.0; t_m * t_l],
            row_upper: vec![0.0; t_m],
            components: Vec::new(),
            base: residual,
            spectrum: None,
            work: 0,
            last: f64::INFINITY,
        };
        state.load();
        state
    }

    /// Begin with the residual before the components.
    fn load(&mut self) {
        let (image, t_l, allowed, negative) = (&self.base, self.t_l, self.allowed.as_deref(), self.negative);
        self.tiles.par_iter_mut().zip(&mut self.upper).enumerate().for_each(|(t, (tile, upper))| {
            (tile.values, tile.applied) = (None, 0);
            let values = pixels(image, corner(t, t_l));
            (*upper, tile.peak_at) = tile_peak(&values, allowed.map(|a| &a[t * AREA..(t + 1) * AREA]), negative);
        });
        for i in 0..self.t_m {
            self.row_upper[i] = largest(&self.upper[i * self.t_l..(i + 1) * self.t_l]);
        }
    }

    /// The exact peak, or `None` if no allowed pixel is above 0.
    pub(super) fn peak(&mut self) -> Option<Peak> {
        loop {
            let i = position(&self.row_upper)?;
            let t = i * self.t_l + position(&self.upper[i * self.t_l..(i + 1) * self.t_l])?;
            if !(self.upper[t] > 0.0) {
                return None;
            }
            if self.tiles[t].applied == self.components.len() {
                if self.upper[t] == f64::MIN_POSITIVE {
                    return None;
                }
                let (at, first) = (self.tiles[t].peak_at, corner(t, self.t_l));
                let (row, column) = (first.0 + at / SIDE, first.1 + at % SIDE);
                let value = self.tiles[t].values.as_ref().map_or_else(|| self.base[(row, column)].into(), |values| values.0[at]);
                self.last = self.upper[t];
                return Some(Peak { value, row, column });
            }
            if self.work > CONVOLUTION * self.base.len() {
                self.by_convolution();
                self.load();
                self.work = 0;
            } else {
                self.refresh_soon(t);
            }
        }
    }

    /// Subtract a component. Only the bounds change until a tile is updated.
    pub(super) fn subtract(&mut self, component: Component) {
        self.components.push(component);
        let size = component.flux.abs();
        // First pixel of tile (i, j) minus the component, in blocks of the beam.
        let shift = |center: usize, at: usize| (center as i64 - at as i64).div_euclid(SIDE as i64) + 1;
        let (s_m, s_l) = (shift(self.beam.n_m / 2, component.row), shift(self.beam.n_l / 2, component.column));
        let of_beam = &self.beam.bounds;
        let bounds = Bounds { values: of_beam.as_slice().unwrap_or_default(), columns: of_beam.ncols(), shift: (s_m, s_l) };
        // A block before the first one overlaps the beam with its second half. Index 0 is block -1.
        raise((&mut self.upper, &mut self.row_upper), &bounds, size);
    }

    /// Update a tile, and with it, on all threads, those that come next, where there is enough to do. The choice does not depend on the number of threads.
    fn refresh_soon(&mut self, t: usize) {
        let (t_l, n) = (self.t_l, self.components.len());
        let level = SOON * self.last;
        let rows = (0..self.t_m).filter(|i| self.row_upper[*i] >= level);
        let mut soon: Vec<usize> =
            rows.flat_map(|i| i * t_l..(i + 1) * t_l).filter(|k| self.upper[*k] >= level && self.tiles[*k].applied < n).collect();
        let pending = |tiles: &[Tile], list: &[usize]| list.iter().map(|k| n - tiles[*k].applied).sum::<usize>();
        if soon.binary_search(&t).is_err() || pending(&self.tiles, &soon) < ENOUGH {
            soon = vec![t];
        }
        self.work += pending(&self.tiles, &soon) * AREA;
        let Self { beam, tiles, allowed, negative, upper, components, base, .. } = self;
        let refresh = |(k, (tile, upper)): (usize, (&mut Tile, &mut f64))| {
            let first = corner(k, t_l);
            let values = tile.values.get_or_insert_with(|| Box::new(pixels(base, first)));
            apply(beam.values(), values, first, &components[tile.applied..]);
            tile.applied = n;
            (*upper, tile.peak_at) = tile_peak(values, allowed.as_deref().map(|a| &a[k * AREA..(k + 1) * AREA]), *negative);
        };
        if let [k] = soon[..] {
            refresh((k, (&mut tiles[k], &mut upper[k])));
        } else {
            let mut next = soon.iter().copied().peekable();
            let all = tiles.iter_mut().zip(upper.iter_mut()).enumerate();
            let chosen: Vec<_> = all.filter(|(k, _)| next.next_if_eq(k).is_some()).collect();
            chosen.into_par_iter().for_each(refresh);
        }
        for i in soon.iter().map(|k| k / t_l) {
            self.row_upper[i] = largest(&self.upper[i * t_l..(i + 1) * t_l]);
        }
    }

    /// Subtract all components from the residual before them.
    fn by_convolution(&mut self) {
        self.beam.subtract(&self.components, &mut self.spectrum, &mut self.base);
        self.components.clear();
    }

    /// The residual after the subtraction of all components.
    pub(super) fn finish(mut self) -> Array2<f32> {
        let pending: usize = self.tiles.iter().map(|t| self.components.len() - t.applied).sum();
        if pending * AREA > CONVOLUTION * self.base.len() {
            self.by_convolution();
            return self.base;
        }
        let (beam, t_l, components) = (self.beam, self.t_l, &self.components);
        let bands = self.base.axis_chunks_iter_mut(Axis(0), SIDE).into_par_iter().zip(self.tiles.par_chunks(t_l)).enumerate();
        bands.for_each(|(i, (mut band, tiles))| {
            for (j, tile) in tiles.iter().enumerate() {
                let mut values = tile.values.as_ref().map_or_else(|| pixels(&band, (0, j * SIDE)), |values| **values);
                apply(beam.values(), &mut values, (i * SIDE, j * SIDE), &components[tile.applied..]);
                let columns = j * SIDE..((j + 1) * SIDE).min(band.ncols());
                for (mut row, line) in band.slice_mut(s![.., columns]).rows_mut().into_iter().zip(values.0.chunks_exact(SIDE)) {
                    row.iter_mut().zip(line).for_each(|(v, new)| *v = *new as f32);
                }
            }
        });
        self.base
    }
}

/// First pixel of a tile.
fn corner(tile: usize, t_l: usize) -> (usize, usize) {
    (tile / t_l * SIDE, tile % t_l * SIDE)
}

/// The pixels of the tile with this first pixel. Those beyond the edge of the image are 0.
fn pixels<S: Data<Elem = f32>>(image: &ArrayBase<S, Ix2>, (row, column): (usize, usize)) -> Pixels {
    Pixels(std::array::from_fn(|k| image.get((row + k / SIDE, column + k % SIDE)).copied().unwrap_or(0.0).into()))
}

/// Index of the first largest value, or `None` for an empty list.
fn position(values: &[f64]) -> Option<usize> {
    let top = largest(values);
    values.iter().position(|v| *v == top)
}
