//! The residual in tiles. A tile is updated only when it could contain the peak.
//!
//! CLEAN needs only the peak of the residual in each iteration. Each tile stores its peak at the time of its last update, and an upper bound of
//! what later components can have added to it. The bound of a component is its flux times the largest value of the beam over the tile, from a
//! coarse map of the beam. A tile whose bound is below the true peak is not updated. When a tile must be updated, all its pending components
//! are subtracted together while the tile is in cache. The components are those of the plain algorithm.
//! If nearly all tiles must be updated, one convolution with all pending components is faster than the update of the tiles.
//!
//! All is in single precision. Each component adds an error of at most 3e-8 of a pixel. These errors have random signs: those of 10,000 components
//! reach 3e-6 of the first peak, as does the convolution, and a minor cycle lowers the peak by a factor of 20 at most. The next major cycle does
//! not inherit them.

use super::crew::Crew;
use super::minor::{Component, Peak};
use super::tile_loops::{AREA, Beam, Pixels, SIDE, apply, largest, raise, tile_peak};
use super::tiled_beam::TiledBeam;
use crate::fourier::Spectrum;
use ndarray::{ArcArray2, Array2, ArrayBase, Axis, Data, Ix2, s};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

/// Time of an update of the whole residual by convolution, in multiply-adds per pixel.
const CONVOLUTION: usize = 1000;

/// Tiles whose bound exceeds this part of the last peak will soon have to be updated.
const SOON: f64 = 0.9;
/// Number of components in tiles, about 0.1 ms of work, from which on several tiles are updated together.
const ENOUGH: usize = 1000;
/// Parts of the work of one thread, without the tiles that are parts by themselves. A thread that is done takes parts of the others.
const PARTS: usize = 4;

/// The state of the residual between components.
pub(super) struct TiledResidual<'a> {
    beam: &'a TiledBeam,
    t_m: usize,
    t_l: usize,
    /// Values \[tile, row, column\]. Pixels outside the image or the mask are never a peak. Most tiles of a large image are never updated, and
    /// take no memory.
    tiles: Vec<Tile>,
    /// Number of components that were subtracted from each tile.
    applied: Vec<usize>,
    allowed: Option<Arc<[bool]>>,
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
    crew: Crew,
}

#[derive(Default)]
struct Tile {
    /// Its pixels; `None` until a component is subtracted from it: they are then those of the residual before the components.
    values: Option<Box<Pixels>>,
    /// Index of the peak at the last update.
    peak_at: usize,
}

impl Tile {
    /// Subtract components from the tile with this first pixel. Gives its peak among the pixels that are allowed.
    fn update(
        &mut self,
        first: (usize, usize),
        beam: Beam<'_>,
        components: &[Component],
        (allowed, negative): (Option<&[bool]>, bool),
    ) -> f64 {
        let Some(values) = self.values.as_mut() else { return 0.0 };
        apply(beam, values, first, components);
        let peak;
        (peak, self.peak_at) = tile_peak(values, allowed, negative);
        peak
    }
}

/// The pixels of the tile with this number that may be a peak; `None` if all may.
fn of_tile(allowed: Option<&[bool]>, tile: usize) -> Option<&[bool]> {
    allowed.map(|a| &a[tile * AREA..(tile + 1) * AREA])
}

/// What the update of several tiles needs on any thread.
struct Update {
    psf: ArcArray2<f32>,
    /// The last components; all that some tile does not have yet.
    components: Vec<Component>,
    allowed: Option<Arc<[bool]>>,
    negative: bool,
}

impl Update {
    /// Subtract the last `missing` components from a tile with this number and first pixel. Gives its peak.
    fn of(&self, (k, first): (usize, (usize, usize)), missing: usize, tile: &mut Tile) -> f64 {
        let components = &self.components[self.components.len() - missing..];
        tile.update(first, Beam::of(&self.psf), components, (of_tile(self.allowed.as_deref(), k), self.negative))
    }
}

impl<'a> TiledResidual<'a> {
    pub(super) fn new(beam: &'a TiledBeam, residual: Array2<f32>, mask: Option<&Array2<bool>>, negative: bool) -> Self {
        let (n_m, n_l) = beam.shape();
        let (t_m, t_l) = (n_m.div_ceil(SIDE), n_l.div_ceil(SIDE));
        let outside = !n_m.is_multiple_of(SIDE) || !n_l.is_multiple_of(SIDE);
        let allowed = (mask.is_some() || outside).then(|| {
            let at = |k: usize| (k / AREA / t_l * SIDE + k % AREA / SIDE, k / AREA % t_l * SIDE + k % SIDE);
            (0..t_m * t_l * AREA).map(|k| residual.get(at(k)).is_some() && mask.is_none_or(|m| m[at(k)])).collect()
        });
        let tiles = (0..t_m * t_l).map(|_| Tile::default()).collect();
        let mut state = Self {
            beam,
            t_m,
            t_l,
            tiles,
            applied: vec![0; t_m * t_l],
            allowed,
            negative,
            upper: vec![0.0; t_m * t_l],
            row_upper: vec![0.0; t_m],
            components: Vec::new(),
            base: residual,
            spectrum: None,
            work: 0,
            last: f64::INFINITY,
            crew: Crew::new(),
        };
        state.load();
        state
    }

    /// Begin with the residual before the components.
    fn load(&mut self) {
        let (image, t_l, allowed, negative) = (&self.base, self.t_l, self.allowed.as_deref(), self.negative);
        self.tiles.par_iter_mut().zip(&mut self.upper).enumerate().for_each(|(t, (tile, upper))| {
            tile.values = None;
            let values = pixels(image, corner(t, t_l));
            (*upper, tile.peak_at) = tile_peak(&values, of_tile(allowed, t), negative);
        });
        self.applied.fill(0);
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
            if self.applied[t] == self.components.len() {
                if self.upper[t] == f64::MIN_POSITIVE {
                    return None;
                }
                let (at, first) = (self.tiles[t].peak_at, corner(t, self.t_l));
                let (row, column) = (first.0 + at / SIDE, first.1 + at % SIDE);
                let value = self.tiles[t].values.as_ref().map_or_else(|| self.base[(row, column)].into(), |values| values.0[at].into());
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
        raise((&mut self.upper, &mut self.row_upper), &self.beam.bounds_for(&component), component.flux.abs());
    }

    /// Update a tile, and with it, on all threads, those that come next, where there is enough to do. The choice does not depend on the number of threads.
    fn refresh_soon(&mut self, t: usize) {
        let (t_l, n) = (self.t_l, self.components.len());
        let level = SOON * self.last;
        let rows = || (0..self.t_m).filter(|i| self.row_upper[*i] >= level).map(|i| i * t_l..(i + 1) * t_l);
        let of_row = |row: Range<usize>| {
            let pending = |(upper, applied): (&f64, &usize)| if *upper >= level { n - applied } else { 0 };
            self.upper[row.clone()].iter().zip(&self.applied[row]).map(pending).sum::<usize>()
        };
        let soon: Vec<usize> = if self.upper[t] >= level && rows().map(of_row).sum::<usize>() >= ENOUGH {
            rows().flatten().filter(|k| self.upper[*k] >= level && self.applied[*k] < n).collect()
        } else {
            vec![t]
        };
        for k in &soon {
            let base = &self.base;
            self.tiles[*k].values.get_or_insert_with(|| Box::new(pixels(base, corner(*k, t_l))));
        }
        if let [k] = soon[..] {
            let allowed = (of_tile(self.allowed.as_deref(), k), self.negative);
            self.upper[k] = self.tiles[k].update(corner(k, t_l), self.beam.values(), &self.components[self.applied[k]..], allowed);
        } else {
            self.refresh_together(&soon);
        }
        for k in &soon {
            self.work += (n - self.applied[*k]) * AREA;
            self.applied[*k] = n;
        }
        for i in soon.iter().map(|k| k / t_l) {
            self.row_upper[i] = largest(&self.upper[i * t_l..(i + 1) * t_l]);
        }
    }

    /// Update some tiles on all threads. Each tile is lent to the thread that updates it.
    fn refresh_together(&mut self, soon: &[usize]) {
        let (t_l, n, members) = (self.t_l, self.components.len(), self.crew.members());
        let most = soon.iter().map(|k| n - self.applied[*k]).max().unwrap_or(0);
        let update = Update {
            psf: self.beam.shared(),
            components: self.components[n - most..].to_vec(),
            allowed: self.allowed.clone(),
            negative: self.negative,
        };
        // A tile that was not updated for long may have a third of the work. Such tiles come first, each by itself, so that nobody waits for one at the end.
        let total: usize = soon.iter().map(|k| n - self.applied[*k]).sum();
        let each = 2 * PARTS;
        let mut parts: Vec<Vec<_>> = (0..members * each).map(|_| Vec::new()).collect();
        let mut heavy = 0;
        for k in soon {
            let missing = n - self.applied[*k];
            let (member, slot) = if missing * members * PARTS >= total && heavy < members * PARTS {
                heavy += 1;
                ((heavy - 1) % members, (heavy - 1) / members)
            } else {
                (k % members, PARTS + k / members % PARTS)
            };
            parts[member * each + slot].push((*k, missing, std::mem::take(&mut self.tiles[*k]), 0.0));
        }
        let lent: Arc<Vec<_>> = Arc::new(parts.into_iter().map(Mutex::new).collect());
        let own = Arc::clone(&lent);
        self.crew.each(each, move |part| {
            for (k, missing, tile, peak) in own[part].lock().unwrap_or_else(PoisonError::into_inner).iter_mut() {
                *peak = update.of((*k, corner(*k, t_l)), *missing, tile);
            }
        });
        for (k, _, tile, peak) in lent.iter().flat_map(|part| std::mem::take(&mut *part.lock().unwrap_or_else(PoisonError::into_inner))) {
            (self.tiles[k], self.upper[k]) = (tile, peak);
        }
    }

    /// Subtract all components from the residual before them.
    fn by_convolution(&mut self) {
        self.beam.subtract(&self.components, &mut self.spectrum, &mut self.base);
        self.components.clear();
    }

    /// The residual after the subtraction of all components.
    pub(super) fn finish(mut self) -> Array2<f32> {
        let pending: usize = self.applied.iter().map(|n| self.components.len() - n).sum();
        if pending * AREA > CONVOLUTION * self.base.len() {
            self.by_convolution();
            return self.base;
        }
        let (beam, t_l, components, applied) = (self.beam, self.t_l, &self.components, &self.applied);
        let bands = self.base.axis_chunks_iter_mut(Axis(0), SIDE).into_par_iter().zip(self.tiles.par_chunks(t_l)).enumerate();
        bands.for_each(|(i, (mut band, tiles))| {
            for (j, tile) in tiles.iter().enumerate() {
                let mut values = tile.values.as_ref().map_or_else(|| pixels(&band, (0, j * SIDE)), |values| **values);
                apply(beam.values(), &mut values, (i * SIDE, j * SIDE), &components[applied[i * t_l + j]..]);
                let columns = j * SIDE..((j + 1) * SIDE).min(band.ncols());
                for (mut row, line) in band.slice_mut(s![.., columns]).rows_mut().into_iter().zip(values.0.chunks_exact(SIDE)) {
                    row.iter_mut().zip(line).for_each(|(v, new)| *v = *new);
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
    Pixels(std::array::from_fn(|k| image.get((row + k / SIDE, column + k % SIDE)).copied().unwrap_or(0.0)))
}

/// Index of the first largest value, or `None` for an empty list.
fn position(values: &[f64]) -> Option<usize> {
    let top = largest(values);
    values.iter().position(|v| *v == top)
}
