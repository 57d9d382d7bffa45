//! How far the data lie above their noise, from some of them. How many evaluations maximum entropy takes depends on this more than on all else.

use super::noise::{ASSUMED, HandsSum};
use super::options::{MemOptions, NoiseChoice};
use crate::Result;
use cittert_arrays::{Polarization, VisibilityBlock, VisibilitySource};
use ndarray::Axis;

/// Runs of neighbouring rows that are looked at, and the values in all of them.
const RUNS: usize = 32;
const VALUES: usize = 1 << 18;

/// Sums over the parallel hands, or over Stokes I.
#[derive(Default)]
struct Sums {
    /// Sum of |V|^2, and of weight x |V|^2.
    power: f64,
    weighed: f64,
    count: f64,
}

impl Sums {
    fn add(&mut self, block: &VisibilityBlock, hand: usize) {
        let axis = Axis(2);
        let (vis, weights, flags) =
            (block.vis.index_axis(axis, hand), block.weights.index_axis(axis, hand), block.flags.index_axis(axis, hand));
        for ((row, chan), v) in vis.indexed_iter() {
            let (w, power) = (f64::from(weights[(row, chan)]), f64::from(v.norm_sqr()));
            let is_used = w > 0.0 && !flags[(row, chan)] && block.coverage.ant1[row] != block.coverage.ant2[row];
            if is_used && (w * power).is_finite() {
                self.power += power;
                self.weighed += w * power;
                self.count += 1.0;
            }
        }
    }
}

/// Chi squared of an empty image, for each visibility of Stokes I, from runs of rows that are spread over the set: 1 is noise alone. `None` where no visibility
/// can be used.
///
/// # Errors
/// The source cannot be read, or a given noise has another unit than the data.
pub fn chi2_of_nothing(source: &mut dyn VisibilitySource, options: &MemOptions) -> Result<Option<f64>> {
    let header = source.header().clone();
    let is_hand = |p: &Polarization| *p == Polarization::I || p.is_parallel_hand();
    let hands: Vec<usize> = header.polarizations.iter().enumerate().filter(|(_, p)| is_hand(p)).map(|(k, _)| k).collect();
    let values = (header.spectrum.n_chan() * header.polarizations.len()).max(1);
    let (all, length) = (source.n_rows(), (VALUES / values / RUNS).max(1));
    let (mut sums, mut noise) = (Sums::default(), HandsSum::new(&header));
    let mut first = 0;
    while first < all {
        let block = source.read_rows(first..(first + length).min(all))?;
        hands.iter().for_each(|hand| sums.add(&block, *hand));
        noise.add(&block);
        first += length.max(all.div_ceil(RUNS));
    }
    let noise = noise.noise();
    let believes_weights = options.noise == Some(NoiseChoice::Weights) || (options.noise.is_none() && !noise.weights_are_counts);
    let chi2 = match (options.noise, noise.factor) {
        (Some(NoiseChoice::Sigma(flux)), _) => sums.power / (2.0 * flux.in_unit("noise", header.unit)?.powi(2)),
        _ if believes_weights => sums.weighed / 2.0,
        (_, Some(factor)) if factor > 0.0 => sums.weighed / (2.0 * factor),
        _ => sums.count / (2.0 * ASSUMED * ASSUMED),
    };
    // The mean of two hands has half of their noise.
    Ok((sums.count > 0.0).then(|| hands.len() as f64 * chi2 / sums.count))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::{positions, snapshot};
    use cittert_arrays::{VisUnit, VisibilitySet};

    /// A point of this flux in noise of 0.2 Jy.
    fn set(flux: f64, hands: &[Polarization]) -> VisibilitySet {
        let freq: Vec<f64> = (0..20).map(|c| 1e9 + 1e6 * f64::from(c)).collect();
        snapshot(&positions(40, 100.0, 0.0, 3), &freq, hands, &[(0.0, 0.0, flux)], (0.2, VisUnit::Jy))
    }

    #[test]
    fn noise_alone_is_one_and_a_point_adds_its_power() {
        let (one, two) = ([Polarization::I], [Polarization::XX, Polarization::YY]);
        let of = |mut set: VisibilitySet, noise: Option<NoiseChoice>| {
            chi2_of_nothing(&mut set, &MemOptions { noise, ..MemOptions::default() }).unwrap()
        };
        for (flux, hands, expected) in [(0.0, &one[..], 1.0), (1.0, &one, 1.0 + 0.5 * 25.0), (1.0, &two, 2.0 * (1.0 + 0.5 * 25.0))] {
            let found = of(set(flux, hands), None).unwrap();
            assert!((found / expected - 1.0).abs() < 0.03, "{flux} {hands:?} {found} {expected}");
        }
        let half = NoiseChoice::Sigma("0.4Jy".parse().unwrap());
        assert!((of(set(1.0, &one), Some(half)).unwrap() / (13.5 / 4.0) - 1.0).abs() < 0.03);
        // Counts of samples tell nothing; two hands do.
        let counted = |hands: &[Polarization]| {
            let mut set = set(1.0, hands);
            set.data.weights.assign(&set.data.nsamples);
            of(set, None).unwrap()
        };
        assert!((counted(&two) / 27.0 - 1.0).abs() < 0.03, "{}", counted(&two));
        assert_eq!(counted(&one), 5000.0);
        let mut flagged = set(1.0, &one);
        flagged.data.flags.fill(true);
        assert_eq!(of(flagged, None), None);
    }
}
