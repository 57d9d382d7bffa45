//! Non-local means.

use super::border::{line, padded};
use super::smooth::gaussian_taps;
use super::step::{Given, Step};
use crate::Result;
use ndarray::{Array2, ArrayView2};
use rayon::prelude::*;

/// A patch whose distance is above this gets no weight (it would be below 0.7 %), as in scikit-image: many unlike patches would add up.
const FARTHEST: f64 = 5.0;
/// Rows that a thread works on together. The distances of one shift stay in cache.
const BAND: usize = 16;

#[derive(Debug)]
struct NlMeans {
    strength: f64,
    patch: usize,
    reach: usize,
    noise: f64,
}

impl Step for NlMeans {
    fn apply(&self, frame: Array2<f64>) -> Result<Array2<f64>> {
        Ok(nl_means(frame.view(), self.strength, self.patch, self.reach, self.noise))
    }
}

pub(super) fn make(given: &Given<'_>) -> Result<Box<dyn Step>> {
    let noise = given.optional(3).unwrap_or(0.0);
    Ok(Box::new(NlMeans { strength: given.number(0), patch: given.whole(1), reach: given.whole(2), noise }))
}

/// The mean over all pixels within `reach` rows and columns, with weights exp(-d / strength^2). d is the mean squared difference of the patches
/// around both pixels, less twice the variance of the noise (at least 0). A patch is a square of odd width `patch` with Gaussian weights of standard
/// deviation (patch - 1) / 4. `strength` and `noise` (a standard deviation) are in the unit of the plane.
///
/// # Reference
/// Buades, Coll & Morel 2005, CVPR 2, 60; the noise term of Buades, Coll & Morel 2011, IPOL 1, 208; weights as in scikit-image.
#[must_use]
pub fn nl_means(plane: ArrayView2<'_, f64>, strength: f64, patch: usize, reach: usize, noise: f64) -> Array2<f64> {
    let (half, n_l) = (patch / 2, plane.ncols());
    let taps = patch_taps(patch);
    let wide = padded(plane, half + reach, half + reach);
    let scale = 1.0 / (strength * strength);
    let offset = 2.0 * noise * noise * scale;
    let mut out = Array2::zeros(plane.dim());
    let Some(all) = out.as_slice_mut() else { return out };
    all.par_chunks_mut(BAND * n_l).enumerate().for_each_init(Work::default, |work, (band, sums)| {
        let (first, rows) = (band * BAND, sums.len() / n_l);
        let mut weights = vec![0.0; sums.len()];
        for dy in 0..=2 * reach {
            for dx in 0..=2 * reach {
                work.distances(&wide, (first, rows, n_l), (dy, dx, reach), &taps);
                for (k, (d, (sum, weight))) in work.down.iter().zip(sums.iter_mut().zip(&mut weights)).enumerate() {
                    let distance = (d * scale - offset).max(0.0);
                    if distance <= FARTHEST {
                        let (r, c) = (first + k / n_l + half, k % n_l + half);
                        let w = (-distance).exp();
                        *sum += w * (line(&wide, r + dy)[c + dx] - line(&wide, r + reach)[c + reach]);
                        *weight += w;
                    }
                }
            }
        }
        for (k, (sum, weight)) in sums.iter_mut().zip(&weights).enumerate() {
            *sum = line(&wide, first + k / n_l + half + reach)[k % n_l + half + reach] + *sum / weight;
        }
    });
    out
}

/// Weights of a patch along one axis. Their sum is 1.
fn patch_taps(patch: usize) -> Vec<f64> {
    let sigma = (patch as f64 - 1.0) / 4.0;
    let long = gaussian_taps(sigma);
    let middle = long.len() / 2;
    let half = patch / 2;
    let short: Vec<f64> = (0..patch).map(|k| long.get((middle + k).wrapping_sub(half)).copied().unwrap_or(0.0)).collect();
    let sum: f64 = short.iter().sum();
    short.into_iter().map(|w| w / sum).collect()
}

/// Distances between the patches of a band of rows and those of one shift.
#[derive(Default)]
struct Work {
    squares: Vec<f64>,
    across: Vec<f64>,
    down: Vec<f64>,
}

impl Work {
    /// Mean squared differences \[row, column\] into `down`.
    fn distances(
        &mut self,
        wide: &Array2<f64>,
        (first, rows, n_l): (usize, usize, usize),
        (dy, dx, reach): (usize, usize, usize),
        taps: &[f64],
    ) {
        let patch = taps.len();
        let long = n_l + patch - 1;
        self.squares.resize(long, 0.0);
        self.across.clear();
        self.across.resize((rows + patch - 1) * n_l, 0.0);
        self.down.clear();
        self.down.resize(rows * n_l, 0.0);
        for (r, across) in self.across.chunks_exact_mut(n_l).enumerate() {
            let (own, other) = (&line(wide, first + r + reach)[reach..], &line(wide, first + r + dy)[dx..]);
            self.squares.iter_mut().zip(own.iter().zip(other)).for_each(|(s, (a, b))| *s = (a - b) * (a - b));
            for (k, tap) in taps.iter().enumerate() {
                across.iter_mut().zip(&self.squares[k..]).for_each(|(o, s)| *o += tap * s);
            }
        }
        for (r, down) in self.down.chunks_exact_mut(n_l).enumerate() {
            for (k, tap) in taps.iter().enumerate() {
                down.iter_mut().zip(&self.across[(r + k) * n_l..]).for_each(|(o, s)| *o += tap * s);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::enhance::border::reflect;
    use crate::enhance::samples::{noise, rms};

    #[test]
    fn it_is_the_double_sum_of_its_definition() {
        let plane = noise(21, 18, 4) + 280.0;
        let (strength, patch, reach, sigma) = (1.3, 5, 3, 0.4);
        let out = nl_means(plane.view(), strength, patch, reach, sigma);
        let at = |r: isize, c: isize| plane[[reflect(r, 21), reflect(c, 18)]];
        for ((r, c), found) in out.indexed_iter() {
            let (r, c, n, half) = (r as isize, c as isize, reach as isize, (patch / 2) as isize);
            let (mut sum, mut weight) = (0.0, 0.0);
            for (dy, dx) in (-n..=n).flat_map(|dy| (-n..=n).map(move |dx| (dy, dx))) {
                let (mut d, mut total) = (0.0, 0.0);
                for (y, x) in (-half..=half).flat_map(|y| (-half..=half).map(move |x| (y, x))) {
                    let w = (-((y * y + x * x) as f64) / 2.0).exp();
                    d += w * (at(r + y, c + x) - at(r + dy + y, c + dx + x)).powi(2);
                    total += w;
                }
                let d = ((d / total - 2.0 * sigma * sigma) / (strength * strength)).max(0.0);
                let w = if d <= 5.0 { (-d).exp() } else { 0.0 };
                sum += w * at(r + dy, c + dx);
                weight += w;
            }
            assert!((found - sum / weight).abs() < 1e-10, "{r} {c}");
        }
    }

    #[test]
    fn a_pattern_that_repeats_loses_its_noise_and_not_itself() {
        let pattern = Array2::from_shape_fn((48, 48), |(r, c)| if (r / 4 + c / 4) % 2 == 0 { 0.0 } else { 10.0 });
        let out = nl_means((&pattern + &noise(48, 48, 5)).view(), 0.9, 5, 8, 1.0);
        assert!(rms(&out - &pattern) < 0.6, "{}", rms(&out - &pattern));
    }
}
