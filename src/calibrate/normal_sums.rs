//! What the normal equations sum up.

use crate::closure::TimeSpan;
use num_complex::Complex64;

/// Sums over the samples of a baseline (or of one row of it) in an interval. V is taken as antenna p to q with p < q.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Cell {
    /// sum w V conj(M).
    pub(crate) vm: Complex64,
    /// sum w |M|^2.
    pub(crate) mm: f64,
    /// sum w |V|^2.
    pub(crate) vv: f64,
    /// Samples.
    pub(crate) n: u32,
    /// The parts of `vm` and `mm` that come from every second sample.
    pub(crate) half_vm: Complex64,
    pub(crate) half_mm: f64,
}

impl Cell {
    pub(super) fn add(&mut self, w: f64, v: Complex64, m: Complex64) {
        let (vm, mm) = (w * v * m.conj(), w * m.norm_sqr());
        self.vm += vm;
        self.mm += mm;
        self.vv += w * v.norm_sqr();
        if self.n % 2 == 1 {
            self.half_vm += vm;
            self.half_mm += mm;
        }
        self.n += 1;
    }

    /// Add the sums over samples that follow. Every second sample is counted over both.
    pub(super) fn follow(&mut self, next: &Self) {
        let odd = self.n % 2 == 1;
        self.half_vm += if odd { next.vm - next.half_vm } else { next.half_vm };
        self.half_mm += if odd { next.mm - next.half_mm } else { next.half_mm };
        self.vm += next.vm;
        self.mm += next.mm;
        self.vv += next.vv;
        self.n += next.n;
    }

    /// sum w |V - G M|^2 for a gain product G.
    pub(crate) fn chi2(&self, product: Complex64) -> f64 {
        (self.vv - 2.0 * (product.conj() * self.vm).re + product.norm_sqr() * self.mm).max(0.0)
    }
}

/// The sums of one interval.
#[derive(Debug, Clone)]
pub(crate) struct IntervalSums {
    pub(crate) span: TimeSpan,
    /// \[group, feed, pair\].
    pub(crate) cells: Vec<Cell>,
    /// With robust weights: index into `cells` and the sums of one row.
    pub(crate) rows: Vec<(u32, Cell)>,
}

/// Counts of the samples that were used and left out.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SampleCounts {
    /// Samples that entered the solution.
    pub used: u64,
    /// Flagged, or of a weight that is not positive.
    pub flagged: u64,
    /// Not flagged, but NaN or infinite in value or weight.
    pub not_finite: u64,
    /// Where the model is NaN or infinite.
    pub bad_model: u64,
}

impl SampleCounts {
    pub(super) fn add(&mut self, other: Self) {
        self.used += other.used;
        self.flagged += other.flagged;
        self.not_finite += other.not_finite;
        self.bad_model += other.bad_model;
    }
}
