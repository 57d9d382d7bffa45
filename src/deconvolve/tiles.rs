//! The residual in tiles. A tile is updated only when it could contain the peak.
//!
//! CLEAN needs only the peak of the residual in each iteration. Each tile stores its peak at the time of its last update, and an upper bound of
//! what later components can have added to it. The bound of a component is its flux times the largest value of the beam over the tile, from a
//! coarse map of the beam. A tile whose bound is below the true peak is not updated. When a tile must be updated, all its pending components
//! are subtracted together while the tile is in cache. The components are those of the plain algorithm.
//! If nearly all tiles must be updated, one convolution with all pending components is faster than the update of the tiles.

use super::minor::{Component, Peak};
use crate::fourier::{Convolver, Spectrum};
use ndarray::{Array2, ArrayView2, s};
use rayon::prelude::*;

/// Side of a tile in pixels: 8 kB, so that a tile and the part of the beam over it fit into the first cache.
const SIDE: usize = 32;
/// Pixels of a tile.
const AREA: usize = SIDE * SIDE;
/// Time of an update of the whole residual by convolution, in multiply-adds per pixel.
const CONVOLUTION: usize = 500;

/// A dirty beam, prepared for subtraction.
pub(super) struct TiledBeam {
    psf: Vec<f32>,
    n_m: usize,
    n_l: usize,
    /// Largest |beam| over the square of two by two blocks that starts at block (i - 1, j - 1) \[i, j\].
    bounds: Array2<f64>,
    convolver: Convolver<f64>,
    spectrum: Spectrum<f64>,
}

impl TiledBeam {
    pub(super) fn new(psf: ArrayView2<'_, f64>) -> Self {
        let (n_m, n_l) = psf.dim();
        // Single precision halves the memory traffic. It changes the beam by 6e-8, and every path uses the same rounded beam.
        let rounded: Vec<f32> = psf.iter().map(|v| *v as f32).collect();
        let (b_m, b_l) = (n_m.div_ceil(SIDE), n_l.div_ceil(SIDE));
        let mut blocks = Array2::<f64>::zeros((b_m + 2, b_l + 2));
        for (k, v) in rounded.iter().enumerate() {
            let b = &mut blocks[(k / n_l / SIDE + 1, k % n_l / SIDE + 1)];
            *b = b.max(f64::from(v.abs()));
        }
        let bounds = Array2::from_shape_fn((b_m + 1, b_l + 1), |(i, j)| {
            blocks[(i, j)].max(blocks[(i + 1, j)]).max(blocks[(i, j + 1)]).max(blocks[(i + 1, j + 1)])
        });
        let convolver = Convolver::new((n_m, n_l), n_m.max(n_l) / 2 + 1);
        let as64 = Array2::from_shape_fn((n_m, n_l), |(i, j)| f64::from(rounded[i * n_l + j]));
        let spectrum = convolver.kernel(as64.view());
        Self { psf: rounded, n_m, n_l, bounds, convolver, spectrum }
    }

    pub(super) fn shape(&self) -> (usize, usize) {
        (self.n_m, self.n_l)
    }

    /// A model in flux per pixel, convolved with the beam.
    pub(super) fn convolve(&self, flux: ArrayView2<'_, f64>) -> Array2<f64> {
        self.convolver.convolve(flux, &self.spectrum)
    }
}

/// The state of the residual between components.
pub(super) struct TiledResidual<'a> {
    beam: &'a TiledBeam,
    t_m: usize,
    t_l: usize,
    /// Values \[tile, row, column\]. Pixels outside the image or the mask are never a peak.
    tiles: Vec<Tile>,
    allowed: Option<Vec<bool>>,
    negative: bool,
    /// Upper bound of the peak of each tile, and the largest bound of each row of tiles.
    upper: Vec<f64>,
    row_upper: Vec<f64>,
    components: Vec<Component>,
    /// The residual before `components`, for the convolution.
    base: Array2<f64>,
    work: usize,
}

struct Tile {
    values: Box<[f64; AREA]>,
    /// Number of components that were subtracted from the tile.
    applied: usize,
    /// Index of the peak at the last update.
    peak_at: usize,
}

impl<'a> TiledResidual<'a> {
    pub(super) fn new(beam: &'a TiledBeam, residual: &Array2<f64>, mask: Option<&Array2<bool>>, negative: bool) -> Self {
        let (t_m, t_l) = (beam.n_m.div_ceil(SIDE), beam.n_l.div_ceil(SIDE));
        let outside = !beam.n_m.is_multiple_of(SIDE) || !beam.n_l.is_multiple_of(SIDE);
        let allowed = (mask.is_some() || outside).then(|| {
            let at = |k: usize| (k / AREA / t_l * SIDE + k % AREA / SIDE, k / AREA % t_l * SIDE + k % SIDE);
            (0..t_m * t_l * AREA).map(|k| residual.get(at(k)).is_some() && mask.is_none_or(|m| m[at(k)])).collect()
        });
        let tiles = (0..t_m * t_l).map(|_| Tile { values: Box::new([0.0; AREA]), applied: 0, peak_at: 0 }).collect();
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
            base: residual.clone(),
            work: 0,
        };
        state.load(residual);
        state
    }

    /// Load an exact residual. Pixels of a tile beyond the edge of the image are 0.
    fn load(&mut self, image: &Array2<f64>) {
        let (t_l, allowed, negative) = (self.t_l, self.allowed.as_deref(), self.negative);
        self.tiles.par_iter_mut().zip(&mut self.upper).enumerate().for_each(|(t, (tile, upper))| {
            for (k, v) in tile.values.iter_mut().enumerate() {
                *v = image.get((t / t_l * SIDE + k / SIDE, t % t_l * SIDE + k % SIDE)).copied().unwrap_or(0.0);
            }
            tile.applied = 0;
            (*upper, tile.peak_at) = tile_peak(&tile.values, allowed.map(|a| &a[t * AREA..(t + 1) * AREA]), negative);
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
                let at = self.tiles[t].peak_at;
                let (row, column) = (t / self.t_l * SIDE + at / SIDE, t % self.t_l * SIDE + at % SIDE);
                return Some(Peak { value: self.tiles[t].values[at], row, column });
            }
            if self.work > CONVOLUTION * self.base.len() {
                let image = self.by_convolution();
                self.base.clone_from(&image);
                self.components.clear();
                self.load(&image);
                self.work = 0;
            } else {
                self.refresh(t);
                self.row_upper[i] = largest(&self.upper[i * self.t_l..(i + 1) * self.t_l]);
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
        let (b_m, b_l) = self.beam.bounds.dim();
        // A block before the first one overlaps the beam with its second half. Index 0 is block -1.
        for i in 0..self.t_m {
            let b = i as i64 + s_m;
            if !(0..b_m as i64).contains(&b) {
                continue;
            }
            let lo = (-s_l).clamp(0, self.t_l as i64) as usize;
            let hi = (b_l as i64 - s_l).clamp(lo as i64, self.t_l as i64) as usize;
            let uppers = &mut self.upper[i * self.t_l..(i + 1) * self.t_l];
            // Without a tile in the reach of the beam, `lo` is `hi` and the columns of the bounds are empty.
            let first = ((lo as i64 + s_l) as usize).min(b_l);
            let bounds = self.beam.bounds.slice(s![b as usize, first..first + hi - lo]);
            for (u, bound) in uppers[lo..hi].iter_mut().zip(&bounds) {
                // Tiles without an allowed pixel stay at 0.
                *u += if *u > 0.0 { size * bound } else { 0.0 };
            }
            self.row_upper[i] = largest(uppers);
        }
    }

    fn refresh(&mut self, t: usize) {
        let pending = self.components.len() - self.tiles[t].applied;
        self.work += pending * AREA;
        let tile = &mut self.tiles[t];
        apply(self.beam, &mut tile.values, (t / self.t_l * SIDE, t % self.t_l * SIDE), &self.components[tile.applied..]);
        tile.applied = self.components.len();
        let allowed = self.allowed.as_deref().map(|a| &a[t * AREA..(t + 1) * AREA]);
        (self.upper[t], tile.peak_at) = tile_peak(&tile.values, allowed, self.negative);
    }

    fn by_convolution(&self) -> Array2<f64> {
        let mut flux = Array2::zeros(self.base.dim());
        for c in &self.components {
            flux[(c.row, c.column)] += c.flux;
        }
        &self.base - &self.beam.convolve(flux.view())
    }

    /// The residual after the subtraction of all components.
    pub(super) fn finish(mut self) -> Array2<f64> {
        let pending: usize = self.tiles.iter().map(|t| self.components.len() - t.applied).sum();
        if pending * AREA > CONVOLUTION * self.base.len() {
            return self.by_convolution();
        }
        let (beam, t_l, components) = (self.beam, self.t_l, &self.components);
        self.tiles.par_iter_mut().enumerate().for_each(|(t, tile)| {
            apply(beam, &mut tile.values, (t / t_l * SIDE, t % t_l * SIDE), &components[tile.applied..]);
        });
        Array2::from_shape_fn(self.base.dim(), |(i, j)| self.tiles[i / SIDE * t_l + j / SIDE].values[i % SIDE * SIDE + j % SIDE])
    }
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |a, b| if *b > a { *b } else { a })
}

/// Index of the first largest value, or `None` for an empty list.
fn position(values: &[f64]) -> Option<usize> {
    let top = largest(values);
    values.iter().position(|v| *v == top)
}

#[inline(always)]
fn peak_lanes(values: &[f64; AREA], negative: bool) -> f64 {
    let mut lanes = [0.0_f64; 8];
    for v in values.chunks_exact(8) {
        for (l, v) in lanes.iter_mut().zip(v) {
            let size = if negative { v.abs() } else { *v };
            *l = if size > *l { size } else { *l };
        }
    }
    largest(&lanes)
}

/// Largest value of a tile and its index. The value is 0 if no pixel is allowed. A tile whose allowed pixels are not above 0 may have a peak
/// later: it gets the smallest positive number, so that its bound can grow.
fn tile_peak(values: &[f64; AREA], allowed: Option<&[bool]>, negative: bool) -> (f64, usize) {
    let size = |v: f64| if negative { v.abs() } else { v };
    if let Some(allowed) = allowed {
        let inside = values.iter().zip(allowed).enumerate().filter(|(_, (_, a))| **a);
        let start = if allowed.contains(&true) { f64::MIN_POSITIVE } else { 0.0 };
        return inside.fold((start, 0), |best, (k, (v, _))| if size(*v) > best.0 { (size(*v), k) } else { best });
    }
    let top = peak_lanes(values, negative).max(f64::MIN_POSITIVE);
    (top, values.iter().position(|v| size(*v) == top).unwrap_or(0))
}

/// Subtract components from a tile whose first pixel is `corner`.
#[inline(always)]
fn apply_lanes(beam: &TiledBeam, values: &mut [f64; AREA], (row, column): (usize, usize), components: &[Component]) {
    let (n_m, n_l) = (beam.n_m as i64, beam.n_l as i64);
    for c in components {
        let flux = c.flux;
        // Pixel of the beam at the first pixel of the tile.
        let m0 = row as i64 - c.row as i64 + n_m / 2;
        let l0 = column as i64 - c.column as i64 + n_l / 2;
        let rows = (-m0).clamp(0, SIDE as i64) as usize..(n_m - m0).clamp(0, SIDE as i64) as usize;
        if l0 >= 0 && l0 + SIDE as i64 <= n_l {
            for i in rows {
                let from = ((m0 + i as i64) * n_l + l0) as usize;
                let line = &mut values[i * SIDE..(i + 1) * SIDE];
                for (v, p) in line.iter_mut().zip(&beam.psf[from..from + SIDE]) {
                    *v -= flux * f64::from(*p);
                }
            }
        } else {
            let columns = (-l0).clamp(0, SIDE as i64) as usize..(n_l - l0).clamp(0, SIDE as i64) as usize;
            for i in rows {
                for j in columns.clone() {
                    let from = ((m0 + i as i64) * n_l + l0 + j as i64) as usize;
                    values[i * SIDE + j] -= flux * f64::from(beam.psf[from]);
                }
            }
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn apply_avx2(beam: &TiledBeam, values: &mut [f64; AREA], corner: (usize, usize), components: &[Component]) {
    apply_lanes(beam, values, corner, components);
}

fn apply(beam: &TiledBeam, values: &mut [f64; AREA], corner: (usize, usize), components: &[Component]) {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the machine has just been found to have AVX2.
        unsafe { apply_avx2(beam, values, corner, components) };
        return;
    }
    apply_lanes(beam, values, corner, components);
}
