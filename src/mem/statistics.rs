//! Numbers that describe the data of an output channel, from passes over them: what there is, a median, the flux of the shortest baselines.

use crate::imaging::Imager;
use crate::progress::{Observer, Quiet};
use crate::{ChainError, Result, ensure};
use cittert_arrays::SPEED_OF_LIGHT_M_S;
use num_complex::Complex32;

/// Upper and lower half of the bits of a single.
const HALF: usize = 1 << 16;

/// A visibility that counts.
struct Datum {
    vis: Complex32,
    weight: f32,
    /// Length of its baseline on the u-v plane, wavelengths.
    length: f32,
}

/// Sums over the data of an output channel.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct DataSums {
    /// Visibilities with a weight above 0.
    pub used: u64,
    /// Sum of weight x |V|^2.
    pub power: f64,
}

fn for_each_datum((imager, channel): (&mut Imager<'_>, usize), observer: &dyn Observer, mut work: impl FnMut(Datum)) -> Result<()> {
    let range = imager.channels()[channel].clone();
    let per_m: Vec<f64> = imager.header().spectrum.freq_hz().iter().map(|f| f / SPEED_OF_LIGHT_M_S).collect();
    imager.for_each_weighed(&Quiet(observer), |block| {
        for (row, uvw) in block.uvw_m.rows().into_iter().enumerate() {
            let length = uvw[0].hypot(uvw[1]);
            for chan in range.clone() {
                let weight = block.weight[(row, chan)];
                if weight > 0.0 {
                    work(Datum { vis: block.vis[(row, chan)], weight, length: (length * per_m[chan]) as f32 });
                }
            }
        }
        Ok(())
    })
}

impl DataSums {
    /// The sums of an output channel.
    ///
    /// # Errors
    /// No visibility counts, or the source cannot be read.
    pub fn new(at: (&mut Imager<'_>, usize), observer: &dyn Observer) -> Result<Self> {
        let mut sums = Self::default();
        for_each_datum(at, observer, |d| {
            sums.used += 1;
            sums.power += f64::from(d.weight) * f64::from(d.vis.norm_sqr());
        })?;
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
        for_each_datum((imager, channel), observer, |d| {
            if d.length <= short {
                signal += f64::from(d.vis.norm_sqr());
                noise += 2.0 / (factor * f64::from(d.weight));
                count += 1.0;
            }
        })?;
        Ok(((signal - noise) / count).max(noise / count / count).sqrt())
    }
}
