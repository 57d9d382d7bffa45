//! Values of a plane between its pixels: a sinc with a Kaiser window.

use super::response::sinc;
use ndarray::{Array2, ArrayView2, Axis};
use rayon::prelude::*;

/// Pixels on each side.
const REACH: isize = 10;
/// Shape of the window. Side lobes of the passband are below 1e-6 with it.
const BETA: f64 = 15.6;

/// Modified Bessel function of order 0 by its series.
fn bessel_i0(x: f64) -> f64 {
    let (mut sum, mut term) = (1.0, 1.0);
    let mut k = 1.0;
    while term > 1e-17 * sum {
        term *= (x / (2.0 * k)).powi(2);
        sum += term;
        k += 1.0;
    }
    sum
}

/// The pixels around a place and their weights, whose sum is 1. Beyond its edge a line of `n` pixels goes on as its reflection.
fn taps(place: f64, n: usize) -> Vec<(usize, f64)> {
    let near = place.round();
    let reflected = |k: isize| {
        let k = k.rem_euclid(2 * n as isize) as usize;
        if k < n { k } else { 2 * n - 1 - k }
    };
    if (place - near).abs() < 1e-9 {
        return vec![(reflected(near as isize), 1.0)];
    }
    let first = place.floor() as isize - REACH + 1;
    let top = bessel_i0(BETA);
    let weight = |k: isize| {
        let x = k as f64 - place;
        let inside = 1.0 - (x / REACH as f64).powi(2);
        if inside > 0.0 { sinc(x) * bessel_i0(BETA * inside.sqrt()) / top } else { 0.0 }
    };
    let all: Vec<(usize, f64)> = (first..first + 2 * REACH).map(|k| (reflected(k), weight(k))).collect();
    let sum: f64 = all.iter().map(|t| t.1).sum();
    all.into_iter().map(|(k, w)| (k, w / sum)).collect()
}

/// Weights of the pixels of a plane for samples on lines that may be bent.
#[derive(Debug)]
pub(super) struct Resampler {
    /// Of each column of samples.
    across: Vec<Vec<(usize, f64)>>,
    /// Of each row, in each column if lines are bent \[row\] or \[row, column\].
    down: Vec<Vec<(usize, f64)>>,
    bent: bool,
}

impl Resampler {
    /// Samples of planes of a size. `column` and `row` give the place of samples in pixels; `row` depends on the column if lines are bent.
    pub(super) fn new(
        (n_m, n_l): (usize, usize),
        (rows, columns): (usize, usize),
        column: impl Fn(usize) -> f64,
        row: impl Fn(usize, usize) -> f64,
        bent: bool,
    ) -> Self {
        let across = (0..columns).map(|c| taps(column(c), n_l)).collect();
        let columns = if bent { columns } else { 1 };
        let down = (0..rows).flat_map(|r| (0..columns).map(move |c| (r, c))).map(|(r, c)| taps(row(r, c), n_m)).collect();
        Self { across, down, bent }
    }

    /// The samples \[row, column\] of a plane.
    pub(super) fn apply(&self, plane: ArrayView2<'_, f64>) -> Array2<f64> {
        let columns = self.across.len();
        let mut lines = Array2::zeros((plane.nrows(), columns));
        lines.axis_iter_mut(Axis(0)).into_par_iter().zip(plane.axis_iter(Axis(0))).for_each(|(mut out, line)| {
            for (o, taps) in out.iter_mut().zip(&self.across) {
                *o = taps.iter().map(|&(k, w)| w * line[k]).sum();
            }
        });
        let each = if self.bent { columns } else { 1 };
        let mut out = Array2::zeros((self.down.len() / each, columns));
        out.axis_iter_mut(Axis(0)).into_par_iter().enumerate().for_each(|(r, mut row)| {
            if self.bent {
                for (c, o) in row.iter_mut().enumerate() {
                    *o = self.down[r * columns + c].iter().map(|&(k, w)| w * lines[[k, c]]).sum();
                }
            } else {
                self.down[r].iter().for_each(|&(k, w)| row.scaled_add(w, &lines.row(k)));
            }
        });
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waves_to_four_pixels_are_met_to_1e_6_and_flat_planes_stay_flat() {
        let (n_m, n_l) = (90, 80);
        let wave = |y: f64, x: f64| 200.0 + (1.4 * x + 0.3).sin() * (1.5 * y).cos();
        let plane = Array2::from_shape_fn((n_m, n_l), |(r, c)| wave(r as f64, c as f64));
        for bent in [false, true] {
            let sag = move |c: usize| if bent { 0.01 * c as f64 } else { 0.0 };
            let sampler = Resampler::new((n_m, n_l), (60, 50), |c| 12.3 + c as f64 * 1.1, |r, c| 12.9 + r as f64 * 1.05 + sag(c), bent);
            let out = sampler.apply(plane.view());
            for ((r, c), v) in out.indexed_iter() {
                let exact = wave(12.9 + r as f64 * 1.05 + sag(c), 12.3 + c as f64 * 1.1);
                assert!((v - exact).abs() < 1e-6, "{r} {c}: {v} {exact}");
            }
            let flat = sampler.apply(Array2::from_elem((n_m, n_l), 280.0).view());
            assert!(flat.iter().all(|v| (v - 280.0).abs() < 1e-10));
        }
        let same = Resampler::new((n_m, n_l), (n_m, n_l), |c| c as f64, |r, _| r as f64, false);
        assert_eq!(same.apply(plane.view()), plane);
    }
}
