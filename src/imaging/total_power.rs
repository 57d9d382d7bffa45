//! The zero spacing, as autocorrelations measure it where the set states what the receivers add.
//!
//! An autocorrelation is the zero spacing Z of what an antenna sees plus the power R of its receiver, both times the power of its gain. With
//! gains of 1, the mean over the antennas of V - R is Z, with the noise of their weights. Gains that are not 1 are seen in the differences between
//! the antennas: these set the uncertainty where they exceed the noise.

use super::pol::PolSelector;
use cittert_arrays::{Polarization, Ranks, VisibilityBlock, VisibilityHeader};
use ndarray::Array2;
use num_complex::Complex32;
use std::ops::Range;

/// Antennas that differ by more than this many standard deviations of their noise have amplitudes that are not calibrated.
const ODD: f64 = 5.0;
/// A zero spacing whose relative uncertainty is above this does not constrain an image.
const SURE: f64 = 0.01;

/// The zero spacing of an output channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ZeroSpacing {
    /// Value, in the unit of the set.
    pub value: f64,
    /// Its standard deviation: from the weights, or from the differences between the antennas if these are larger.
    pub sigma: f64,
    /// Rms difference between the antennas over that of their noise; 1 for calibrated amplitudes.
    pub scatter: f64,
    /// Number of antennas.
    pub antennas: usize,
}

impl ZeroSpacing {
    /// True if it is certain enough to constrain an image.
    #[must_use]
    pub fn is_sure(&self) -> bool {
        self.is_calibrated() && self.value > 0.0 && self.sigma <= SURE * self.value
    }

    /// True if the antennas agree within their noise: their amplitudes are calibrated.
    #[must_use]
    pub fn is_calibrated(&self) -> bool {
        self.scatter <= ODD
    }
}

/// Sums over the autocorrelations of the antennas whose receivers are stated.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TotalPower {
    /// Power of each receiver \[ant, chan\]; NaN where it is not stated. Empty where no antenna states one.
    receivers: Array2<f64>,
    /// Sum of the weights \[ant, chan\].
    weight: Array2<f64>,
    /// Sum of weight times power beyond the receiver \[ant, chan\].
    power: Array2<f64>,
    /// Number of autocorrelations used.
    pub used: u64,
}

impl TotalPower {
    /// No sums yet. Only Stokes I and products of two equal feeds hold the power of a receiver.
    pub(super) fn new(header: &VisibilityHeader, target: Polarization) -> Self {
        let stated = header.layout.antennas().iter().any(|a| a.receiver.is_some());
        if !(stated && (target == Polarization::I || target.is_parallel_hand())) {
            return Self::default();
        }
        let freq = header.spectrum.freq_hz();
        let shape = (header.layout.n_ant(), freq.len());
        let power = |(a, c): (usize, usize)| header.layout.receiver_power(a, header.unit, freq[c]).unwrap_or(f64::NAN);
        Self { receivers: Array2::from_shape_fn(shape, power), weight: Array2::zeros(shape), power: Array2::zeros(shape), used: 0 }
    }

    /// True if no autocorrelation can add to the sums.
    pub(super) fn is_empty(&self) -> bool {
        self.receivers.is_empty()
    }

    /// Add the autocorrelations of a block.
    pub(super) fn add(&mut self, block: &VisibilityBlock, selector: &PolSelector, unit_weights: bool) {
        if self.receivers.is_empty() {
            return;
        }
        let n_chan = self.receivers.ncols();
        let (mut vis, mut weight) = (vec![Complex32::default(); n_chan], vec![0.0_f32; n_chan]);
        let same = block.coverage.ant1.iter().zip(&block.coverage.ant2).enumerate().filter(|(_, (a, b))| a == b);
        for (row, (antenna, _)) in same {
            let antenna = *antenna as usize;
            selector.combine(block, (row, None), unit_weights, (&mut vis, &mut weight));
            for (chan, (v, w)) in vis.iter().zip(&weight).enumerate().filter(|(_, (_, w))| **w > 0.0) {
                let receiver = self.receivers[(antenna, chan)];
                if receiver.is_finite() {
                    self.weight[(antenna, chan)] += f64::from(*w);
                    self.power[(antenna, chan)] += f64::from(*w) * (f64::from(v.re) - receiver);
                    self.used += 1;
                }
            }
        }
    }

    /// Replace the sums by those over all processes.
    pub(super) fn share(&mut self, ranks: &dyn Ranks) {
        let mut used = [self.used as f64];
        [&mut self.weight, &mut self.power].into_iter().filter_map(|a| a.as_slice_mut()).for_each(|sums| ranks.sum(sums));
        ranks.sum(&mut used);
        self.used = used[0] as u64;
    }

    /// The zero spacing of a range of channels; `None` without autocorrelations.
    #[must_use]
    pub fn zero_spacing(&self, channels: Range<usize>) -> Option<ZeroSpacing> {
        let of_row = |sums: &Array2<f64>, a: usize| sums.row(a).iter().skip(channels.start).take(channels.len()).sum::<f64>();
        let each: Vec<[f64; 2]> = (0..self.weight.nrows()).map(|a| [of_row(&self.weight, a), of_row(&self.power, a)]).collect();
        let seen: Vec<[f64; 2]> = each.into_iter().filter(|[w, _]| *w > 0.0).map(|[w, p]| [w, p / w]).collect();
        let weight: f64 = seen.iter().map(|s| s[0]).sum();
        if !(weight > 0.0) {
            return None;
        }
        let value = seen.iter().map(|[w, z]| w * z).sum::<f64>() / weight;
        let chi2: f64 = seen.iter().map(|[w, z]| w * (z - value).powi(2)).sum();
        let scatter = if seen.len() > 1 { (chi2 / (seen.len() - 1) as f64).sqrt() } else { 1.0 };
        Some(ZeroSpacing { value, sigma: scatter.max(1.0) / weight.sqrt(), scatter, antennas: seen.len() })
    }
}
