//! Which pixels of a real-time frame lie on an edge, and how many looks they get.

use super::mesh_options::EdgeOptions;
use rayon::prelude::*;

/// Number of differences of whole kelvins that are counted.
const SPREADS: usize = 512;

/// Mean squared error of a pixel with no look, with four, and with the grid, as a fraction of the square of its difference: a quarter and an eighth of
/// the difference, and what is measured with the grid. For the scenes that ship, where the error is more than 1 K with limits that do not rise, the
/// estimate is 1.0 to 1.7 times the error.
const ERRORS: [f64; 3] = [1.0 / 16.0, 1.0 / 64.0, 1.0 / 300.0];

/// What four looks in place of the grid add to the squared error, as such a fraction: over five scenes at two sizes 1/540 to 1/199.
const FOUR: f64 = 1.0 / 199.0;

/// What looks that share the temperature of one followed ray add: at most 1/775 (T-72 at 256 x 256).
const SHARED: f64 = 1.0 / 775.0;

/// Steps by which the limit for the grid rises, K.
const STEP_K: f64 = 8.0;

/// How pixels are smoothed, by the differences of the nine pixels around them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Limits {
    /// Difference up to which no look is followed as a ray, K.
    pub follow_k: f64,
    /// Difference up to which a pixel gets four looks in place of the grid, K.
    pub strong_k: f64,
    /// Whether looks of a quarter of a pixel share a followed ray where the quarters show nearly the same.
    pub share: bool,
}

/// The limits of a picture.
///
/// While the estimate of the error of the picture stays within the budget, looks share rays, then the limit for the grid rises, which saves the most time, and then that for
/// followed looks.
pub(super) fn limits(values: &[f64], columns: usize, options: &EdgeOptions) -> Limits {
    let none = || vec![0_u32; SPREADS];
    let counts = (0..values.len() / columns)
        .into_par_iter()
        .fold(
            || (none(), Spreads::default()),
            |(mut counts, mut spreads), row| {
                spreads.of_row(values, columns, row).iter().for_each(|spread_k| counts[(*spread_k as usize).min(SPREADS - 1)] += 1);
                (counts, spreads)
            },
        )
        .map(|(counts, _)| counts)
        .reduce(none, |a, b| a.iter().zip(&b).map(|(a, b)| a + b).collect());
    // Sum of the squares of the differences below each kelvin.
    let mut below = vec![0.0; SPREADS + 1];
    for (k, count) in counts.iter().enumerate() {
        below[k + 1] = below[k] + f64::from(*count) * (k as f64 + 0.5).powi(2);
    }
    let at = |limit_k: f64| below[(limit_k as usize).min(SPREADS)];
    let all = below[SPREADS];
    let estimate = |limits: &Limits| {
        let [no_look, weak, four] = [limits.follow_k, options.strong_k, limits.strong_k].map(at);
        let grid = ERRORS[2] * (all - weak) + FOUR * (four - weak) + if limits.share { SHARED * (all - four) } else { 0.0 };
        ERRORS[0] * no_look + ERRORS[1] * (weak - no_look) + grid
    };
    let bound = options.budget_k.powi(2) * values.len() as f64;
    let mut limits = Limits { follow_k: options.weak_k, strong_k: options.strong_k, share: false };
    let mut take = |next: &dyn Fn(&Limits) -> Limits, last: &dyn Fn(&Limits) -> bool| {
        while !last(&limits) && estimate(&next(&limits)) <= bound {
            limits = next(&limits);
        }
        limits
    };
    take(&|l| Limits { share: true, ..*l }, &|l| l.share);
    take(&|l| Limits { strong_k: l.strong_k + STEP_K, ..*l }, &|l| l.strong_k >= SPREADS as f64);
    take(&|l| Limits { follow_k: l.follow_k + 1.0, ..*l }, &|l| l.follow_k + 1.0 > options.most_k.min(options.strong_k))
}

/// The largest difference between a pixel and the mean of two opposite neighbours.
pub(super) fn bend_k(values: &[f64], columns: usize, (column, row): (usize, usize)) -> f64 {
    let at = |dx: isize, dy: isize| {
        let column = column.checked_add_signed(dx).filter(|c| *c < columns)?;
        values.get(row.checked_add_signed(dy)? * columns + column)
    };
    let here = values[row * columns + column];
    let bend = |(dx, dy): (isize, isize)| Some((0.5 * (at(dx, dy)? + at(-dx, -dy)?) - here).abs());
    [(1, 0), (0, 1), (1, 1), (1, -1)].into_iter().filter_map(bend).fold(0.0, f64::max)
}

/// Differences between the highest and the lowest of the nine pixels around each pixel of a row.
#[derive(Debug, Default)]
pub(super) struct Spreads {
    /// The lowest and the highest of the values of each column in the row and the two rows beside it.
    low: Vec<f64>,
    high: Vec<f64>,
    spread_k: Vec<f64>,
}

impl Spreads {
    /// Those of a row.
    pub(super) fn of_row(&mut self, values: &[f64], columns: usize, row: usize) -> &[f64] {
        let line = |r: usize| &values[r * columns..(r + 1) * columns];
        let last = values.len() / columns - 1;
        let (below, here, above) = (line(row.saturating_sub(1)), line(row), line((row + 1).min(last)));
        for extremes in [&mut self.low, &mut self.high, &mut self.spread_k] {
            extremes.resize(columns, 0.0);
        }
        for ((((low, high), a), b), c) in self.low.iter_mut().zip(&mut self.high).zip(below).zip(here).zip(above) {
            *low = smaller(smaller(*a, *b), *c);
            *high = larger(larger(*a, *b), *c);
        }
        if let [first, .., end] = self.spread_k.as_mut_slice() {
            *first = larger(self.high[0], self.high[1]) - smaller(self.low[0], self.low[1]);
            *end = larger(self.high[columns - 2], self.high[columns - 1]) - smaller(self.low[columns - 2], self.low[columns - 1]);
            for ((spread, low), high) in self.spread_k[1..].iter_mut().zip(self.low.windows(3)).zip(self.high.windows(3)) {
                *spread = larger(larger(high[0], high[1]), high[2]) - smaller(smaller(low[0], low[1]), low[2]);
            }
        } else {
            self.spread_k[0] = self.high[0] - self.low[0];
        }
        &self.spread_k
    }
}

/// One instruction, where `f64::min` looks for NaN.
#[inline]
pub(super) fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// As [`smaller`].
#[inline]
pub(super) fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A step of a height in K between two halves of a picture.
    fn step(side: usize, height_k: f64) -> Vec<f64> {
        (0..side * side).map(|k| if k % side < side / 2 { 200.0 } else { 200.0 + height_k }).collect()
    }

    #[test]
    fn limits_rise_where_few_pixels_lie_on_edges() {
        let options = EdgeOptions::default();
        let at = |side: usize, height_k: f64, options: &EdgeOptions| limits(&step(side, height_k), side, options);
        // Nothing differs by more than 100 K, so the grid is not needed.
        let high_k = 516.0;
        let found = |follow_k: f64, strong_k: f64, share: bool| Limits { follow_k, strong_k, share };
        // Two columns of pixels see the step: without looks, the error is a quarter of it on 2 / side of the picture.
        let error_k = |side: f64| 40.5 / 4.0 * (2.0 / side).sqrt();
        assert!(error_k(32.0) > options.budget_k && error_k(64.0) < options.budget_k);
        assert_eq!(at(32, 40.0, &options), found(40.0, high_k, true));
        assert_eq!(at(64, 40.0, &options), found(50.0, high_k, true));
        assert_eq!(at(16, 400.0, &options), found(8.0, 100.0, false));
        assert_eq!(at(64, 40.0, &EdgeOptions { budget_k: 0.0, ..options }), found(8.0, 100.0, false));
    }
}
