//! Numbers that describe the data of an output channel, from passes over them: what there is, a median, the flux of the shortest baselines.

use crate::imaging::Imager;
use crate::progress::{Observer, Quiet};
use crate::{ChainError, Result, ensure};
use cittert_arrays::{Ranks, SPEED_OF_LIGHT_M_S};
use num_complex::Complex32;
use std::collections::BTreeMap;

/// Upper and lower half of the bits of a single.
const HALF: usize = 1 << 16;

/// A visibility that counts.
struct Datum {
    vis: Complex32,
    weight: f32,
    /// Length of its baseline on the u-v plane, wavelengths.
    length: f32,
    /// The baseline on the u-v plane, wavelengths.
    uv: (f64, f64),
}

/// Sums over the data of an output channel.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct DataSums {
    /// Visibilities with a weight above 0.
    pub used: u64,
    /// Sum of weight x |V|^2.
    pub power: f64,
}

/// The mean power of the visibilities whose baselines have about the same length.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct PowerBin {
    /// Mean length, wavelengths.
    pub(super) length: f64,
    /// Number of visibilities.
    pub(super) count: f64,
    /// Mean of |V|^2.
    pub(super) power: f64,
    /// Mean of 2 / weight: with weights of 1/sigma^2 the part of the noise.
    pub(super) noise: f64,
    /// Mean of the power that is known before.
    pub(super) known: f64,
}

/// Bins for a factor of two in length.
const BINS_AN_OCTAVE: f64 = 8.0;

/// The power of an output channel against the length of the baselines, from short to long. The weights times `factor` are 1/sigma^2, and `known` is the power that
/// is known at a place (u, v).
///
/// # Errors
/// The source cannot be read.
pub(super) fn powers_by_length(
    at: (&mut Imager<'_>, usize),
    factor: f64,
    known: impl Fn(f64, f64) -> f64 + Sync,
    observer: &dyn Observer,
) -> Result<Vec<PowerBin>> {
    let mut bins = BTreeMap::<i32, PowerBin>::new();
    let ranks = at.0.ranks();
    for_each_datum(at, observer, |d| {
        let length = f64::from(d.length);
        let bin = bins.entry((BINS_AN_OCTAVE * length.max(1e-9).log2()).floor() as i32).or_default();
        bin.length += length;
        bin.count += 1.0;
        bin.power += f64::from(d.vis.norm_sqr());
        bin.noise += 2.0 / (factor * f64::from(d.weight));
        bin.known += known(d.uv.0, d.uv.1);
    })?;
    let bins = share_bins(&*ranks, bins);
    let mean = |b: PowerBin| {
        let [length, power, noise, known] = [b.length, b.power, b.noise, b.known].map(|sum| sum / b.count);
        PowerBin { length, count: b.count, power, noise, known }
    };
    Ok(bins.into_values().map(mean).collect())
}

fn for_each_datum((imager, channel): (&mut Imager<'_>, usize), observer: &dyn Observer, mut work: impl FnMut(Datum) + Send) -> Result<()> {
    let range = imager.channels()[channel].clone();
    let per_m: Vec<f64> = imager.header().spectrum.freq_hz().iter().map(|f| f / SPEED_OF_LIGHT_M_S).collect();
    imager.for_each_weighed(&Quiet(observer), |block| {
        let weights = block.weight.view();
        for (row, uvw) in block.uvw_m.rows().into_iter().enumerate() {
            let length = uvw[0].hypot(uvw[1]);
            for chan in range.clone() {
                let weight = weights[(row, chan)];
                if weight > 0.0 {
                    let uv = (uvw[0] * per_m[chan], uvw[1] * per_m[chan]);
                    work(Datum { vis: block.vis[(row, chan)], weight, length: (length * per_m[chan]) as f32, uv });
                }
            }
        }
        Ok(())
    })
}

/// The sums in the bins of all processes, from those of this one.
fn share_bins(ranks: &dyn Ranks, own: BTreeMap<i32, PowerBin>) -> BTreeMap<i32, PowerBin> {
    let end = |bin: Option<(&i32, &PowerBin)>, sign: f64| bin.map_or(f64::NEG_INFINITY, |(k, _)| sign * f64::from(*k));
    let mut ends = [end(own.first_key_value(), -1.0), end(own.last_key_value(), 1.0)];
    ranks.largest(&mut ends);
    if ranks.size() == 1 || ends[1].is_infinite() {
        return own;
    }
    let keys = -ends[0] as i32..=ends[1] as i32;
    let sums = |b: PowerBin| [b.length, b.count, b.power, b.noise, b.known];
    let mut all: Vec<f64> = keys.clone().flat_map(|k| sums(own.get(&k).copied().unwrap_or_default())).collect();
    ranks.sum(&mut all);
    let bin = |s: &[f64]| PowerBin { length: s[0], count: s[1], power: s[2], noise: s[3], known: s[4] };
    keys.zip(all.chunks_exact(5).map(bin)).filter(|(_, b)| b.count > 0.0).collect()
}

/// Replace counts by their sums over all processes.
fn share(ranks: &dyn Ranks, counts: &mut [u64]) {
    let mut sums: Vec<f64> = counts.iter().map(|n| *n as f64).collect();
    ranks.sum(&mut sums);
    counts.iter_mut().zip(sums).for_each(|(n, sum)| *n = sum as u64);
}

impl DataSums {
    /// The sums of an output channel.
    ///
    /// # Errors
    /// No visibility counts, or the source cannot be read.
    pub fn new(at: (&mut Imager<'_>, usize), observer: &dyn Observer) -> Result<Self> {
        let mut sums = Self::default();
        let ranks = at.0.ranks();
        for_each_datum(at, observer, |d| {
            sums.used += 1;
            sums.power += f64::from(d.weight) * f64::from(d.vis.norm_sqr());
        })?;
        let mut all = [sums.used as f64, sums.power];
        ranks.sum(&mut all);
        (sums.used, sums.power) = (all[0] as u64, all[1]);
        ensure!(sums.used > 0, ChainError::NoData("no visibility has a weight above 0".into()));
        Ok(sums)
    }

    /// Mean of weight x |V|^2.
    #[must_use]
    pub fn mean_power(&self) -> f64 {
        self.power / self.used as f64
    }

    /// The value at this place, from 0, in the sorted list of a number that is not negative. Its upper bits are counted in a first pass and
    /// its lower bits in a second: singles that are not negative have the order of their bits.
    fn sorted_at(
        &self,
        place: u64,
        (imager, channel): (&mut Imager<'_>, usize),
        observer: &dyn Observer,
        of: fn(&Datum) -> f32,
    ) -> Result<f32> {
        let (mut upper, mut left) = (0, place);
        for pass in 0..2 {
            let mut counts = vec![0_u64; HALF];
            for_each_datum((&mut *imager, channel), observer, |d| {
                let bits = of(&d).to_bits() as usize;
                if pass == 0 {
                    counts[bits / HALF] += 1;
                } else if bits / HALF == upper {
                    counts[bits % HALF] += 1;
                }
            })?;
            share(&*imager.ranks(), &mut counts);
            let found = counts.iter().position(|n| {
                let here = left < *n;
                left -= if here { 0 } else { *n };
                here
            });
            let found = found.ok_or_else(|| ChainError::Internal(format!("there is no datum {place} of {}", self.used)))?;
            if pass == 1 {
                return Ok(f32::from_bits((upper * HALF + found) as u32));
            }
            upper = found;
        }
        Err(ChainError::Internal("a value was not found in two passes".into()))
    }

    /// Median of the weights that are not 0.
    ///
    /// # Errors
    /// The source cannot be read.
    pub fn median_weight(&self, at: (&mut Imager<'_>, usize), observer: &dyn Observer) -> Result<f64> {
        self.sorted_at(self.used / 2, at, observer, |d| d.weight).map(f64::from)
    }

    /// The flux that the shortest baselines measure: the root mean square amplitude on the shortest hundredth of all data, corrected for
    /// noise. It is at least the noise of the mean of these data. The weights times `factor` are 1/sigma^2.
    ///
    /// # Errors
    /// The source cannot be read.
    pub fn flux_seen(&self, (imager, channel): (&mut Imager<'_>, usize), factor: f64, observer: &dyn Observer) -> Result<f64> {
        let short = self.sorted_at(self.used.div_ceil(100) - 1, (&mut *imager, channel), observer, |d| d.length)?;
        let (mut signal, mut noise, mut count) = (0.0, 0.0, 0.0);
        let ranks = imager.ranks();
        for_each_datum((imager, channel), observer, |d| {
            if d.length <= short {
                signal += f64::from(d.vis.norm_sqr());
                noise += 2.0 / (factor * f64::from(d.weight));
                count += 1.0;
            }
        })?;
        let mut all = [signal, noise, count];
        ranks.sum(&mut all);
        let [signal, noise, count] = all;
        Ok(((signal - noise) / count).max(noise / count / count).sqrt())
    }
}
