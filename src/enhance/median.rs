//! Median filter.

use super::border::{by_rows_with, line, padded};
use super::step::{Given, Step};
use crate::Result;
use ndarray::{Array2, ArrayView2};
use rayon::prelude::*;

/// The windows up to this width are sorted in part; wider ones are counted.
const SORTED: usize = 7;
/// Number of counters that one counter of the level above sums.
const BRANCH: usize = 64;

#[derive(Debug)]
struct Median {
    window: usize,
}

impl Step for Median {
    fn apply(&self, frame: Array2<f64>) -> Result<Array2<f64>> {
        Ok(median(frame.view(), self.window))
    }
}

pub(super) fn make(given: &Given<'_>) -> Result<Box<dyn Step>> {
    Ok(Box::new(Median { window: given.whole(0) }))
}

/// The median over a square window of odd width around each pixel. It removes single bright or dark pixels and keeps straight edges.
///
/// # Reference
/// Tukey 1977, Exploratory Data Analysis. Wide windows: Huang, Yang & Tang 1979, IEEE Trans. ASSP 27, 13, on the ranks of the pixels in place of
/// grey levels, so that the result is exact.
#[must_use]
pub fn median(plane: ArrayView2<'_, f64>, window: usize) -> Array2<f64> {
    let half = window / 2;
    let wide = padded(plane, half, half);
    if window <= SORTED { sorted(&wide, plane.dim(), window) } else { counted(plane, &wide, window) }
}

fn sorted(wide: &Array2<f64>, dim: (usize, usize), window: usize) -> Array2<f64> {
    let memory = || vec![0.0; window * window];
    by_rows_with(dim, memory, |values, r, out| {
        for (c, o) in out.iter_mut().enumerate() {
            for (k, part) in values.chunks_exact_mut(window).enumerate() {
                part.copy_from_slice(&line(wide, r + k)[c..c + window]);
            }
            *o = *values.select_nth_unstable_by(window * window / 2, f64::total_cmp).1;
        }
    })
}

/// How often each rank is in the window, and the sums of 64 and of 64 x 64 such numbers.
struct Counts([Vec<u32>; 3]);

impl Counts {
    fn new(ranks: usize) -> Self {
        let level = |n: usize| vec![0; n.div_ceil(BRANCH).max(1) * BRANCH];
        Self([level(ranks), level(ranks.div_ceil(BRANCH)), level(ranks.div_ceil(BRANCH * BRANCH))])
    }

    fn add(&mut self, rank: u32) {
        let rank = rank as usize;
        self.0[0][rank] += 1;
        self.0[1][rank / BRANCH] += 1;
        self.0[2][rank / (BRANCH * BRANCH)] += 1;
    }

    fn remove(&mut self, rank: u32) {
        let rank = rank as usize;
        self.0[0][rank] -= 1;
        self.0[1][rank / BRANCH] -= 1;
        self.0[2][rank / (BRANCH * BRANCH)] -= 1;
    }

    /// The rank with `below` ranks of the window below it.
    fn find(&self, mut below: u32) -> usize {
        let mut at = 0;
        for level in self.0.iter().rev() {
            at *= BRANCH;
            while level[at] <= below {
                below -= level[at];
                at += 1;
            }
        }
        at
    }
}

fn counted(plane: ArrayView2<'_, f64>, wide: &Array2<f64>, window: usize) -> Array2<f64> {
    // Equal pixels have one rank each, in any order: the pixel of each rank has the same value.
    let mut values: Vec<f64> = plane.iter().copied().collect();
    values.par_sort_unstable_by(f64::total_cmp);
    let rank = |v: &f64| values.partition_point(|x| x.total_cmp(v).is_lt()) as u32;
    let ranks: Vec<u32> = wide.as_slice().map_or_else(Vec::new, |all| all.par_iter().map(rank).collect());
    let across = wide.ncols();
    let middle = (window * window / 2) as u32;
    by_rows_with(
        plane.dim(),
        || Counts::new(values.len()),
        |counts, r, out| {
            let column = |c: usize| (r..r + window).map(move |k| k * across + c);
            (0..window - 1).flat_map(column).for_each(|k| counts.add(ranks[k]));
            for (c, o) in out.iter_mut().enumerate() {
                column(c + window - 1).for_each(|k| counts.add(ranks[k]));
                *o = values[counts.find(middle)];
                column(c).for_each(|k| counts.remove(ranks[k]));
            }
            // The next row starts with empty counters.
            (out.len()..out.len() + window - 1).flat_map(column).for_each(|k| counts.remove(ranks[k]));
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::enhance::samples::noise;

    #[test]
    fn counting_gives_the_medians_of_sorting() {
        // Some values are equal, as in pictures.
        let plane = noise(37, 70, 3).mapv(|v| (v * 20.0).round() / 20.0);
        for window in [3, 7, 9, 21] {
            let wide = padded(plane.view(), window / 2, window / 2);
            assert_eq!(sorted(&wide, plane.dim(), window), counted(plane.view(), &wide, window), "{window}");
        }
    }

    #[test]
    fn single_pixels_go_and_an_edge_stays() {
        let mut plane = Array2::from_shape_fn((20, 20), |(_, c)| if c < 10 { 250.0 } else { 300.0 });
        let edge = plane.clone();
        plane[[5, 5]] = 1000.0;
        plane[[12, 15]] = 0.0;
        assert_eq!(median(plane.view(), 3), edge);
    }
}
