//! Pictures: rays for every pixel, more of them on edges, and the maps.

use super::follow::Scratch;
use super::tracer::{Seen, Tracer};
use crate::atmosphere::PhysicsError;
use crate::camera::View;
use crate::error::{Result, SceneError};
use crate::geometry::At;
use cittert_arrays::{BrightnessUnit, Image, SpectralWindow};
use ndarray::{Array2, Array4};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Most values of a picture.
const MAX_VALUES: usize = 1 << 27;

/// Told how many of how many rows are done, from any thread.
pub type ProgressFn<'a> = &'a (dyn Fn(usize, usize) + Sync);

/// A rendered scene.
#[derive(Debug, Clone)]
pub struct Picture {
    /// Brightness temperature, K \[chan, pol, m, l\]; zero beyond the edge of a hemisphere.
    pub temperature: Image,
    /// Distance to what the middle of each pixel shows, m; NaN for the sky. // [m, l]
    pub range_m: Array2<f64>,
    /// Angle of incidence there, deg; NaN for the sky. // [m, l]
    pub incidence_deg: Array2<f64>,
    /// Number of the surface there from 1, 0 for the sky. // [m, l]
    pub material: Array2<u32>,
    /// Names of the surfaces; number 1 is the first.
    pub material_names: Vec<String>,
    /// Rays sent from the sensor.
    pub rays: usize,
}

/// The ray through the middle of a pixel.
#[derive(Debug, Clone, Copy)]
struct Middle {
    seen: Option<Seen>,
    /// First plane and channel, RJ, K.
    first_k: f64,
}

impl Middle {
    /// What is on view: sky, region or piece of ground.
    fn identity(&self) -> (u32, u32) {
        self.seen.map_or((0, 0), |s| (s.cover + 1, s.region.map_or(0, |r| r + 1)))
    }
}

impl Tracer<'_> {
    /// The picture of a view. `band` holds the channels the tracer was made for.
    ///
    /// Every pixel is the mean of its own rays in a fixed order, so the result does not depend on the number of threads.
    ///
    /// # Errors
    /// A leg of a ray that leaves the tables of the air, or a band of another number of channels.
    pub fn picture(&self, view: &View, band: &SpectralWindow, progress: Option<ProgressFn<'_>>) -> Result<Picture> {
        self.check_height(view.position)?;
        let grid = view.grid();
        let (columns, rows) = (grid.n_l, grid.n_m);
        let states = self.freqs_ghz.len() * self.antenna.len();
        if rows * columns > MAX_VALUES / states {
            return Err(SceneError::BadValue {
                what: "picture".into(),
                value: format!("{columns} x {rows} pixels of {states} planes and channels"),
                expected: "at most 134217728 values (1 GB); render fewer pixels or channels at a time",
            });
        }
        let done = AtomicUsize::new(0);
        let passes = if self.options.antialias > 1 { 2 } else { 1 };
        let tell = || {
            if let Some(progress) = progress {
                progress(done.fetch_add(1, Ordering::Relaxed) + 1, passes * rows);
            }
        };
        // First pass: one ray through the middle of every pixel. // [m, l][chan, pol]
        let mut sums = vec![0.0; rows * columns * states];
        let mut middles = vec![Middle { seen: None, first_k: 0.0 }; rows * columns];
        sums.par_chunks_mut(columns * states)
            .zip(middles.par_chunks_mut(columns))
            .enumerate()
            .try_for_each_init(
                || self.scratch(),
                |scratch, (row, (sums, middles))| {
                    for (column, (out, middle)) in sums.chunks_exact_mut(states).zip(middles).enumerate() {
                        let Some(seen) = self.shoot(view, column as f64, row as f64, scratch)? else { continue };
                        out.copy_from_slice(&scratch.sums);
                        *middle = Middle { seen, first_k: out[0] };
                    }
                    tell();
                    Ok::<(), PhysicsError>(())
                },
            )
            .map_err(in_air)?;
        // Second pass: pixels on an edge get a grid of rays.
        let extra = if passes == 2 { self.refine(view, &middles, &mut sums, &tell)? } else { 0 };

        let planes = self.antenna.len();
        sums.par_chunks_mut(columns * states).for_each(|row| {
            for (k, value) in row.iter_mut().enumerate() {
                let state = k % states;
                *value = self.scaled(state / planes, state % planes, *value);
            }
        });
        let data = Array4::from_shape_fn((self.freqs_ghz.len(), planes, rows, columns), |(channel, pol, row, column)| {
            sums[(row * columns + column) * states + channel * planes + pol]
        });
        let temperature = Image::new(grid.clone(), band.clone(), self.options.polarizations.clone(), data, BrightnessUnit::Kelvin)?;
        let map = |f: &dyn Fn(&Seen) -> f64| {
            Array2::from_shape_fn((rows, columns), |(r, c)| middles[r * columns + c].seen.as_ref().map_or(f64::NAN, f))
        };
        let covers = &self.scene.covers;
        let number = |s: Seen| covers.list().get(s.cover as usize).map_or(0, |c| c.surface as u32 + 1);
        Ok(Picture {
            temperature,
            range_m: map(&|s| s.range_m),
            incidence_deg: map(&|s| s.cos_incidence.acos().to_degrees()),
            material: Array2::from_shape_fn((rows, columns), |(r, c)| middles[r * columns + c].seen.map_or(0, number)),
            material_names: covers.surface_names().to_vec(),
            rays: rows * columns + extra,
        })
    }

    /// A ray through a fractional pixel; `None` outside the hemisphere.
    #[inline]
    fn shoot(&self, view: &View, column: f64, row: f64, scratch: &mut Scratch) -> Result<Option<Option<Seen>>, PhysicsError> {
        let Some(direction) = view.direction(column, row) else { return Ok(None) };
        self.follow(view.position, direction, view.reference(direction), scratch).map(Some)
    }

    /// Averages a grid of rays over every pixel that differs from a neighbour.
    fn refine(&self, view: &View, middles: &[Middle], sums: &mut [f64], tell: &(impl Fn() + Sync)) -> Result<usize> {
        let (columns, rows) = (view.grid().n_l, view.grid().n_m);
        let states = self.freqs_ghz.len() * self.antenna.len();
        let side = self.options.antialias;
        let offset = |k: usize| (k as f64 + 0.5) / side as f64 - 0.5;
        let shot = AtomicUsize::new(0);
        sums.par_chunks_mut(columns * states)
            .enumerate()
            .try_for_each_init(
                || (self.scratch(), vec![0.0; states]),
                |(scratch, mean), (row, sums)| {
                    for (column, out) in sums.chunks_exact_mut(states).enumerate() {
                        if !self.is_edge(middles, columns, rows, column, row) {
                            continue;
                        }
                        mean.fill(0.0);
                        let mut count = 0_usize;
                        for i in 0..side {
                            for j in 0..side {
                                if self.shoot(view, column as f64 + offset(j), row as f64 + offset(i), scratch)?.is_some() {
                                    mean.iter_mut().zip(&scratch.sums).for_each(|(m, s)| *m += s);
                                    count += 1;
                                }
                            }
                        }
                        if count > 0 {
                            out.iter_mut().zip(&*mean).for_each(|(o, m)| *o = m / count as f64);
                        }
                        shot.fetch_add(count, Ordering::Relaxed);
                    }
                    tell();
                    Ok::<(), PhysicsError>(())
                },
            )
            .map_err(in_air)?;
        Ok(shot.into_inner())
    }

    fn is_edge(&self, middles: &[Middle], columns: usize, rows: usize, column: usize, row: usize) -> bool {
        let here = &middles[row * columns + column];
        for r in row.saturating_sub(1)..=(row + 1).min(rows - 1) {
            for c in column.saturating_sub(1)..=(column + 1).min(columns - 1) {
                let there = &middles[r * columns + c];
                if there.identity() != here.identity() || (there.first_k - here.first_k).abs() > self.options.edge_k {
                    return true;
                }
            }
        }
        false
    }
}

fn in_air(source: PhysicsError) -> SceneError {
    SceneError::air(At(0), source)
}
