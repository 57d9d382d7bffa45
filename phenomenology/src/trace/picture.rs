//! A picture: one ray for every pixel, more rays on edges, and maps of range, incidence and material.

use super::cause::{CAUSES, Cause};
use super::face::Face;
use super::lattice::{Points, Use};
use super::scatter_mesh::Corrections;
use super::scratch::Scratch;
use super::tracer::{Seen, Tracer};
use crate::camera::View;
use crate::error::{Result, SceneError};
use cittert_arrays::{BrightnessUnit, Image, SpectralWindow};
use ndarray::{Array2, Array3, Array4, ShapeError};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Columns or rows up to which a pixel of a matt face takes the correction of another.
const NEAR: usize = 4;

/// Largest number of values of a picture (1 GB).
const MAX_VALUES: usize = 1 << 27;

/// A function that is called from any thread with the number of rows done and the number of all rows.
pub type ProgressFn<'a> = &'a (dyn Fn(usize, usize) + Sync);

/// A rendered scene.
#[derive(Debug, Clone)]
pub struct Picture {
    /// Brightness temperature, K \[chan, pol, m, l\]. It is zero for pixels outside the hemisphere of the projection.
    pub temperature: Image,
    /// Distance of the point at the centre of each pixel, m; NaN for the sky. // [m, l]
    pub range_m: Array2<f64>,
    /// Angle of incidence there, deg; NaN for the sky. // [m, l]
    pub incidence_deg: Array2<f64>,
    /// Number of the surface there from 1, 0 for the sky. // [m, l]
    pub material: Array2<u32>,
    /// Names of the surfaces; number 1 is the first.
    pub material_names: Vec<String>,
    /// What the temperatures of the first plane and channel come from, Rayleigh-Jeans temperature in K, in the order of
    /// [`super::CAUSES`]. The causes add up to the temperature. `None` without [`super::RenderOptions::causes`]. // [cause, m, l]
    pub causes_k: Option<Array3<f64>>,
    /// Number of rays sent from the camera.
    pub rays: usize,
}

/// What the ray through the middle of a pixel saw.
#[derive(Clone, Copy)]
struct Middle {
    range_m: f64,
    incidence_deg: f64,
    /// Cover and region, each counted from 1; 0 where there is none.
    identity: (u32, u32),
    /// Surface, counted from 1; 0 where the ray met nothing.
    material: u32,
    /// First channel and plane, K.
    first_k: f64,
    /// What the ray met first.
    face: Face,
    /// Whether a surface scatters on the way.
    scatters: bool,
}

impl Tracer<'_> {
    /// The picture of a view. `band` holds the channels of the tracer.
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
        let width = self.values();
        self.check_values(view)?;
        let done = AtomicUsize::new(0);
        let passes = if self.options.antialias > 1 { 2 } else { 1 };
        let tell = || {
            if let Some(progress) = progress {
                progress(done.fetch_add(1, Ordering::Relaxed) + 1, passes * rows);
            }
        };
        // First pass: one ray through the middle of every pixel. // [m, l][chan and pol, then cause]
        let mut sums = vec![0.0; rows * columns * width];
        let nothing = Middle {
            range_m: f64::NAN,
            incidence_deg: f64::NAN,
            identity: (0, 0),
            material: 0,
            first_k: 0.0,
            face: Face::SKY,
            scatters: false,
        };
        let mut middles = vec![nothing; rows * columns];
        sums.par_chunks_mut(columns * width).zip(middles.par_chunks_mut(columns)).enumerate().try_for_each_init(
            || self.scratch(),
            |scratch, (row, (sums, middles))| {
                for (column, (out, middle)) in sums.chunks_exact_mut(width).zip(middles).enumerate() {
                    let points = Points::of_pixel(column as f64, row as f64).using(Use::Nothing);
                    let shot = self.shoot(view, column as f64, row as f64, points, scratch)?;
                    if shot.is_some() {
                        out.iter_mut().zip(scratch.sums.iter().chain(&scratch.tally.parts)).for_each(|(o, v)| *o = *v);
                        (middle.first_k, middle.scatters) = (out[0], scratch.scatters);
                    }
                    if let Some(seen) = shot.flatten() {
                        (middle.range_m, middle.incidence_deg) = (seen.range_m, seen.cos_incidence.acos().to_degrees());
                        middle.face = seen.identity();
                        middle.identity = (seen.cover + 1, seen.region.map_or(0, |r| r + 1));
                        middle.material = self.scene.covers.list()[seen.cover as usize].surface as u32 + 1;
                    }
                }
                tell();
                Ok::<(), SceneError>(())
            },
        )?;
        let faces: Vec<Face> = middles.iter().map(|m| if m.scatters { m.face } else { Face::SKY }).collect();
        let corrections = self.corrections(view, &faces, self.options.speckle_k, NEAR, Vec::new(), None)?;
        for (pixel, (out, middle)) in sums.chunks_exact_mut(width).zip(&mut middles).enumerate() {
            if let Some(correction) = corrections.of(pixel) {
                out.iter_mut().zip(correction).for_each(|(o, c)| *o += c);
                // What facets meet counts as surroundings.
                out[states..].iter_mut().skip(Cause::Surroundings as usize).take(1).for_each(|o| *o += correction[0]);
                middle.first_k = out[0];
            }
        }
        // Second pass: pixels on an edge get a grid of rays.
        let extra = if passes == 2 { self.refine(view, &middles, &corrections, &mut sums, &tell)? } else { 0 };

        let planes = self.antenna.len();
        let plane = |k: usize, row: usize| sums[row * columns * width..].iter().skip(k).step_by(width);
        let mut data = vec![0.0; rows * columns * states];
        data.par_chunks_mut(columns).enumerate().for_each(|(line, out)| {
            let (state, row) = (line / rows, line % rows);
            out.iter_mut().zip(plane(state, row)).for_each(|(o, k)| *o = self.scaled(state / planes, state % planes, *k));
        });
        let causes_k = self.options.causes.then(|| {
            let mut causes = Array3::zeros((CAUSES.len(), rows, columns));
            for ((cause, row), mut out) in ndarray::indices((CAUSES.len(), rows)).into_iter().zip(causes.rows_mut()) {
                out.iter_mut().zip(plane(states + cause, row)).for_each(|(o, v)| *o = *v);
            }
            causes
        });
        let data = Array4::from_shape_vec((self.freqs_ghz.len(), planes, rows, columns), data).map_err(shape)?;
        let map =
            |value: fn(&Middle) -> f64| Array2::from_shape_fn((rows, columns), |(row, column)| value(&middles[row * columns + column]));
        let temperature = Image::new(grid.clone(), band.clone(), self.options.polarizations.clone(), data, BrightnessUnit::Kelvin)?;
        Ok(Picture {
            temperature,
            range_m: map(|m| m.range_m),
            incidence_deg: map(|m| m.incidence_deg),
            material: Array2::from_shape_fn((rows, columns), |(row, column)| middles[row * columns + column].material),
            material_names: self.scene.covers.surface_names().to_vec(),
            causes_k,
            rays: rows * columns + corrections.rays + extra,
        })
    }

    /// Bytes of all arrays of a picture of a view while it is made, with its maps.
    ///
    /// # Errors
    /// More values than a picture may have.
    pub fn picture_bytes(&self, view: &View) -> Result<usize> {
        const MAPS: usize = 2 * size_of::<f64>() + size_of::<u32>();
        self.check_values(view)?;
        // The values, their corrections for what surfaces scatter, and the image.
        let doubles = 2 * self.values() + self.freqs_ghz.len() * self.antenna.len();
        let of_pixel = doubles * size_of::<f64>() + size_of::<Middle>() + size_of::<Face>() + MAPS;
        Ok(view.grid().n_l * view.grid().n_m * of_pixel)
    }

    fn check_values(&self, view: &View) -> Result<()> {
        let (columns, rows, width) = (view.grid().n_l, view.grid().n_m, self.values());
        if rows * columns > MAX_VALUES / width {
            return Err(SceneError::bad_value(
                "picture",
                format_args!("{columns} x {rows} pixels of {width} planes and channels"),
                "at most 134217728 values (1 GB); render fewer pixels or channels at a time",
            ));
        }
        Ok(())
    }

    /// Number of values of a pixel: those of all channels and planes, and the causes if they are asked for.
    fn values(&self) -> usize {
        self.freqs_ghz.len() * self.antenna.len() + if self.options.causes { CAUSES.len() } else { 0 }
    }

    /// A ray through a fractional pixel; `None` outside the hemisphere.
    #[inline]
    fn shoot(&self, view: &View, column: f64, row: f64, points: Points, scratch: &mut Scratch) -> Result<Option<Option<Seen>>> {
        let Some(direction) = view.direction(column, row) else { return Ok(None) };
        self.follow(view.position, direction, view.reference(direction), points, scratch).map(Some)
    }

    /// Replaces every pixel that lies on an edge by the mean of a grid of rays.
    fn refine(
        &self,
        view: &View,
        middles: &[Middle],
        corrections: &Corrections,
        sums: &mut [f64],
        tell: &(impl Fn() + Sync),
    ) -> Result<usize> {
        let (columns, rows) = (view.grid().n_l, view.grid().n_m);
        let width = self.values();
        let side = self.options.antialias;
        let offset = |k: usize| (k as f64 + 0.5) / side as f64 - 0.5;
        let shot = AtomicUsize::new(0);
        sums.par_chunks_mut(columns * width).enumerate().try_for_each_init(
            || (self.scratch(), vec![0.0; width]),
            |(scratch, mean), (row, sums)| {
                for (column, out) in sums.chunks_exact_mut(width).enumerate() {
                    if !self.is_edge(middles, columns, rows, column, row) {
                        continue;
                    }
                    mean.fill(0.0);
                    let mut count = 0_usize;
                    for look in 0..side * side {
                        let (x, y) = (column as f64 + offset(look % side), row as f64 + offset(look / side));
                        let points = Points::of_pixel(column as f64, row as f64).share(look, side * side);
                        let Some(seen) = self.shoot(view, x, y, points.using(Use::Nothing), scratch)? else { continue };
                        let face = seen.map_or(Face::SKY, |s| s.identity());
                        if scratch.scatters {
                            // The correction of the nearest pixel that shows the same face.
                            match nearest(middles, columns, (x, y), (column, row), face).and_then(|pixel| corrections.of(pixel)) {
                                Some(correction) => scratch.corrections.copy_from_slice(correction),
                                None => {
                                    self.shoot(view, x, y, points, scratch)?;
                                }
                            }
                        }
                        for (m, (s, c)) in mean.iter_mut().zip(scratch.sums.iter().zip(&scratch.corrections)) {
                            *m += s + c;
                        }
                        scratch.tally.credit(Cause::Surroundings, scratch.sums[0] + scratch.corrections[0]);
                        mean[scratch.sums.len()..].iter_mut().zip(&scratch.tally.parts).for_each(|(m, part)| *m += part);
                        count += 1;
                    }
                    if count > 0 {
                        out.iter_mut().zip(&*mean).for_each(|(o, m)| *o = m / count as f64);
                    }
                    shot.fetch_add(count, Ordering::Relaxed);
                }
                tell();
                Ok::<(), SceneError>(())
            },
        )?;
        Ok(shot.into_inner())
    }

    fn is_edge(&self, middles: &[Middle], columns: usize, rows: usize, column: usize, row: usize) -> bool {
        let here = &middles[row * columns + column];
        for r in row.saturating_sub(1)..=(row + 1).min(rows - 1) {
            for c in column.saturating_sub(1)..=(column + 1).min(columns - 1) {
                let there = &middles[r * columns + c];
                // Four standard deviations of the difference of two pixels with noise.
                let noise_k = if here.scatters { 4.0 * std::f64::consts::SQRT_2 * self.options.speckle_k } else { 0.0 };
                if there.identity != here.identity || (there.first_k - here.first_k).abs() > self.options.edge_k + noise_k {
                    return true;
                }
            }
        }
        false
    }
}

/// The nearest to a place of the nine pixels around one that show a face that scatters.
fn nearest(middles: &[Middle], columns: usize, (x, y): (f64, f64), (column, row): (usize, usize), face: Face) -> Option<usize> {
    let around =
        (row.saturating_sub(1)..=row + 1).flat_map(|r| (column.saturating_sub(1)..=(column + 1).min(columns - 1)).map(move |c| (c, r)));
    let showing = around.filter(|&(c, r)| middles.get(r * columns + c).is_some_and(|m| m.scatters && m.face == face));
    let away = |&(c, r): &(usize, usize)| (c as f64 - x).powi(2) + (r as f64 - y).powi(2);
    showing.min_by(|a, b| away(a).total_cmp(&away(b))).map(|(c, r)| r * columns + c)
}

/// The error for values that do not fill their array.
fn shape(e: ShapeError) -> SceneError {
    SceneError::bad_value("shape of the picture", e, "one value for every pixel")
}
