//! The noise of the data, which gives chi squared its expected value. It comes from the weights, from an option, or from the difference of
//! two parallel hands that measure the same sky.

use super::statistics::DataSums;
use crate::Result;
use crate::imaging::Imager;
use crate::memory::MemoryBudget;
use crate::progress::Observer;
use crate::values::need;
use cittert_arrays::{Polarization, Ranks, VisibilityBlock, VisibilityHeader, VisibilitySource, for_each_block};
use ndarray::Axis;
use rayon::prelude::*;

/// Where the noise of the data is known from.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Noise {
    /// The weights are 1/sigma^2.
    #[default]
    Weights,
    /// The variance is this many times 1/weight.
    Factor(f64),
    /// The standard deviation of the real part of a visibility of the median weight, in the unit of the data.
    Sigma(f64),
    /// Nothing tells the noise. It is taken as this fraction of the rms amplitude of the data.
    Assumed(f64),
}

/// The fraction of the rms amplitude that is assumed where nothing tells the noise, as in a simulation without noise. An image then explains all
/// but a ten-thousandth of the power of the data.
pub(super) const ASSUMED: f64 = 0.01;

impl Noise {
    /// 1/sigma^2 of the data of an output channel over their weights.
    ///
    /// # Errors
    /// A noise that is not positive and finite, or a source that cannot be read.
    pub fn factor(self, at: (&mut Imager<'_>, usize), sums: &DataSums, observer: &dyn Observer) -> Result<f64> {
        let (value, variance) = match self {
            Self::Weights => return Ok(1.0),
            Self::Factor(factor) => (factor, factor),
            Self::Sigma(sigma) => (sigma, sigma * sigma * sums.median_weight(at, observer)?),
            Self::Assumed(fraction) => (fraction, fraction * fraction * sums.mean_power()),
        };
        let expected = "a positive noise: without noise chi squared has no expected value";
        need("noise", value, value > 0.0 && variance > 0.0 && variance.is_finite(), expected)?;
        Ok(1.0 / variance)
    }
}

/// The noise estimated from the differences of two parallel hands.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct HandsNoise {
    /// The variance of the data over that of the weights; `None` where no datum has both hands.
    pub factor: Option<f64>,
    /// True where every weight is the number of samples: the file does not hold the noise.
    pub weights_are_counts: bool,
}

/// Rows that one thread sums.
const ROWS: usize = 256;

/// Sums over the differences of two parallel hands, RR - LL or XX - YY, block by block.
#[derive(Debug, Clone, Copy)]
pub struct HandsSum {
    hands: Option<(usize, usize)>,
    sum: f64,
    count: u64,
    counts: bool,
}

impl HandsSum {
    /// No sums yet, for a set with this header.
    #[must_use]
    pub fn new(header: &VisibilityHeader) -> Self {
        use Polarization::{LL, RR, XX, YY};
        let find = |p: Polarization| header.polarizations.iter().position(|a| *a == p);
        Self { hands: [(RR, LL), (XX, YY)].into_iter().find_map(|(a, b)| Some((find(a)?, find(b)?))), sum: 0.0, count: 0, counts: true }
    }

    /// Add the rows of a block.
    pub fn add(&mut self, block: &VisibilityBlock) {
        let empty = Self { sum: 0.0, count: 0, counts: true, ..*self };
        let starts: Vec<usize> = (0..block.n_rows()).step_by(ROWS).collect();
        let of_rows = |first: &usize| {
            let mut sums = empty;
            (*first..(first + ROWS).min(block.n_rows())).for_each(|row| sums.add_row(block, row));
            sums
        };
        // The sums of all parts are added in their order, so that they do not depend on the number of threads.
        let parts: Vec<Self> = starts.par_iter().map(of_rows).collect();
        parts.iter().for_each(|part| self.include(part));
    }

    fn add_row(&mut self, block: &VisibilityBlock, row: usize) {
        let (vis, weights) = (block.vis.index_axis(Axis(0), row), block.weights.index_axis(Axis(0), row));
        let (flags, nsamples) = (block.flags.index_axis(Axis(0), row), block.nsamples.index_axis(Axis(0), row));
        self.counts &= weights.iter().zip(nsamples).zip(flags).all(|((w, n), f)| *f || w == n);
        let Some((a, b)) = self.hands else { return };
        // In an autocorrelation the two hands differ by the noise temperatures of their receivers.
        if block.coverage.ant1[row] == block.coverage.ant2[row] {
            return;
        }
        for ((vis, weights), flags) in vis.rows().into_iter().zip(weights.rows()).zip(flags.rows()) {
            let (wa, wb) = (f64::from(weights[a]), f64::from(weights[b]));
            let good = wa > 0.0 && wb > 0.0 && wa.is_finite() && wb.is_finite();
            let d = f64::from((vis[a] - vis[b]).norm_sqr());
            if good && d.is_finite() && !flags[a] && !flags[b] {
                self.sum += d / (2.0 * (1.0 / wa + 1.0 / wb));
                self.count += 1;
            }
        }
    }

    /// Add the sums of further rows.
    pub fn include(&mut self, other: &Self) {
        self.sum += other.sum;
        self.count += other.count;
        self.counts &= other.counts;
    }

    /// Replace the sums by those over all processes.
    pub(crate) fn share(&mut self, ranks: &dyn Ranks) {
        let mut all = [self.sum, self.count as f64, f64::from(u8::from(!self.counts))];
        ranks.sum(&mut all);
        (self.sum, self.count, self.counts) = (all[0], all[1] as u64, all[2] == 0.0);
    }

    /// The noise that the sums tell.
    #[must_use]
    pub fn noise(&self) -> HandsNoise {
        HandsNoise { factor: (self.count > 0).then(|| self.sum / self.count as f64), weights_are_counts: self.counts }
    }
}

/// Estimate the noise from RR - LL or XX - YY: an unpolarised sky is the same in both, so only noise is left.
///
/// # Errors
/// The source cannot be read.
pub fn noise_from_hands(source: &mut dyn VisibilitySource) -> Result<HandsNoise> {
    let mut sums = HandsSum::new(source.header());
    for_each_block(source, MemoryBudget::default().block(), |_, block: VisibilityBlock| -> Result<()> {
        sums.add(&block);
        Ok(())
    })?;
    sums.share(&*source.ranks());
    Ok(sums.noise())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::{positions, snapshot};
    use crate::imaging::ImagingOptions;
    use crate::progress::Silent;
    use cittert_arrays::VisUnit;
    use num_complex::Complex32;

    #[test]
    fn two_hands_tell_the_noise() {
        let places = positions(20, 100.0, 0.0, 3);
        let freq: Vec<f64> = (0..20).map(|c| 1e9 + 1e6 * f64::from(c)).collect();
        let hands = [Polarization::XX, Polarization::YY];
        let mut set = snapshot(&places, &freq, &hands, &[(1e-3, 0.0, 5.0)], (0.2, VisUnit::Jy));
        let known = noise_from_hands(&mut set).unwrap();
        assert!((known.factor.unwrap() - 1.0).abs() < 0.05 && !known.weights_are_counts, "{known:?}");
        let mut powers = set.data.clone();
        powers.coverage.ant2.clone_from(&powers.coverage.ant1);
        powers.vis.indexed_iter_mut().for_each(|((_, _, p), v)| *v = Complex32::new(100.0 + 50.0 * p as f32, 0.0));
        set.data.append(&powers).unwrap();
        assert_eq!(noise_from_hands(&mut set).unwrap(), known, "autocorrelations do not count");
        set.data.weights.fill(1.0);
        let unknown = noise_from_hands(&mut set).unwrap();
        assert!((unknown.factor.unwrap() - 0.04).abs() < 0.002 && unknown.weights_are_counts, "{unknown:?}");
        let mut one = snapshot(&places, &freq, &[Polarization::I], &[], (0.2, VisUnit::Jy));
        assert_eq!(noise_from_hands(&mut one).unwrap().factor, None);
    }

    #[test]
    fn weights_follow_the_noise_and_no_noise_is_refused() {
        let places = positions(4, 100.0, 0.0, 3);
        let mut set = snapshot(&places, &[1e9], &[Polarization::I], &[], (0.2, VisUnit::Jy));
        set.data.vis.fill(Complex32::default());
        set.data.vis[(5, 0, 0)] = Complex32::new(3.0, 4.0);
        // Six baselines; the one with the smallest weight does not count.
        for (k, weight) in [2.0, 1.0, 4.0, 0.0, 8.0, 4.0].into_iter().enumerate() {
            set.data.weights[(k, 0, 0)] = weight;
        }
        let options = ImagingOptions { size: Some("16".parse().unwrap()), ..ImagingOptions::default() };
        let mut imager = Imager::new(&mut set, options, &Silent).unwrap();
        let sums = DataSums::new((&mut imager, 0), &Silent).unwrap();
        // The sum of w |V|^2 is 4 x 25.
        assert_eq!(sums, DataSums { used: 5, power: 100.0 });
        let mut factor = |noise: Noise| noise.factor((&mut imager, 0), &sums, &Silent);
        assert_eq!(factor(Noise::Weights).unwrap(), 1.0);
        assert_eq!(factor(Noise::Sigma(0.5)).unwrap(), 1.0, "the median weight is 4");
        assert_eq!(factor(Noise::Factor(2.0)).unwrap(), 0.5);
        assert!((factor(Noise::Assumed(0.1)).unwrap() - 5.0).abs() < 1e-12);
        for bad in [Noise::Sigma(0.0), Noise::Sigma(f64::NAN), Noise::Factor(0.0), Noise::Sigma(-1.0)] {
            assert!(factor(bad).unwrap_err().to_string().contains("noise"));
        }
    }

    #[test]
    fn the_shortest_baselines_tell_the_flux() {
        let places = positions(40, 100.0, 0.0, 3);
        let freq: Vec<f64> = (0..4).map(|c| 1e9 + 1e6 * f64::from(c)).collect();
        let mut set = snapshot(&places, &freq, &[Polarization::I], &[(0.0, 0.0, 5.0)], (0.2, VisUnit::Jy));
        let n = set.data.vis.len();
        let mut order: Vec<(f64, usize)> =
            (0..n / 4).map(|r| (set.data.coverage.uvw_m[(r, 0)].hypot(set.data.coverage.uvw_m[(r, 1)]), r)).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        // Only the shortest hundredth measures 20 Jy.
        for (_, row) in &order[..order.len().div_ceil(100)] {
            set.data.vis.index_axis_mut(ndarray::Axis(0), *row).mapv_inplace(|v| v * 4.0);
        }
        let mut imager =
            Imager::new(&mut set, ImagingOptions { size: Some("16".parse().unwrap()), ..ImagingOptions::default() }, &Silent).unwrap();
        let sums = DataSums::new((&mut imager, 0), &Silent).unwrap();
        let flux = sums.flux_seen((&mut imager, 0), 1.0, &Silent).unwrap();
        assert!((flux - 20.0).abs() < 1.0, "{flux}");
    }
}
