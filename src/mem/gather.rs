//! The visibilities of one output channel as lists, and the flux that the shortest baselines measure.

use crate::imaging::Imager;
use crate::progress::Observer;
use crate::{ChainError, Result, ensure};
use cittert_arrays::SPEED_OF_LIGHT_M_S;
use ndarray::{Array2, Axis, s};
use num_complex::Complex32;

/// Rows that hold any datum, with the data of some channels.
#[derive(Debug, Clone)]
pub struct Gathered {
    /// m \[row, 3\].
    pub uvw_m: Array2<f64>,
    /// Channel centres, Hz.
    pub freq_hz: Vec<f64>,
    /// Visibilities \[row x chan\].
    pub vis: Vec<Complex32>,
    /// Weights of the data, 1/sigma^2; 0 for data that do not count \[row x chan\].
    pub weight: Vec<f32>,
}

/// Power of a visibility on a baseline of this length in wavelengths, and the power of its noise.
struct Power {
    length: f64,
    signal: f64,
    noise: f64,
}

impl Gathered {
    /// The data of an output channel of an imager.
    ///
    /// # Errors
    /// The source cannot be read.
    pub fn new(imager: &mut Imager<'_>, channel: usize, observer: &dyn Observer) -> Result<Self> {
        let range = imager.channels()[channel].clone();
        let freq_hz = imager.header().spectrum.freq_hz()[range.clone()].to_vec();
        let (mut places, mut vis, mut weight) = (Vec::new(), Vec::new(), Vec::new());
        imager.for_each_weighed(observer, |block| {
            let part = s![.., range.clone()];
            let (v, w) = (block.vis.slice(part), block.weight.slice(part));
            for ((uvw, v), w) in block.uvw_m.axis_iter(Axis(0)).zip(v.axis_iter(Axis(0))).zip(w.axis_iter(Axis(0))) {
                if w.iter().any(|w| *w > 0.0) {
                    places.extend(uvw.iter().copied());
                    vis.extend(v.iter().copied());
                    weight.extend(w.iter().copied());
                }
            }
            Ok(())
        })?;
        let rows = places.len() / 3;
        let uvw_m = Array2::from_shape_fn((rows, 3), |(r, k)| places[3 * r + k]);
        Ok(Self { uvw_m, freq_hz, vis, weight })
    }

    /// Multiply all weights.
    pub fn scale_weights(&mut self, factor: f64) {
        self.weight.iter_mut().for_each(|w| *w = (f64::from(*w) * factor) as f32);
    }

    /// Median of the weights that are not 0.
    ///
    /// # Errors
    /// No weight above 0.
    pub fn median_weight(&self) -> Result<f64> {
        let mut used: Vec<f32> = self.weight.iter().copied().filter(|w| *w > 0.0).collect();
        ensure!(!used.is_empty(), ChainError::NoData("no visibility has a weight above 0".into()));
        let middle = used.len() / 2;
        Ok(f64::from(*used.select_nth_unstable_by(middle, f32::total_cmp).1))
    }

    /// Mean of weight x |V|^2 over the data that count.
    ///
    /// # Errors
    /// No weight above 0.
    pub fn mean_power(&self) -> Result<f64> {
        let (mut sum, mut count) = (0.0, 0_usize);
        for (v, w) in self.vis.iter().zip(&self.weight).filter(|(_, w)| **w > 0.0) {
            sum += f64::from(*w) * f64::from(v.norm_sqr());
            count += 1;
        }
        ensure!(count > 0, ChainError::NoData("no visibility has a weight above 0".into()));
        Ok(sum / count as f64)
    }

    /// The flux that the shortest baselines measure: the root mean square amplitude on the shortest hundredth of all data, corrected for
    /// noise. It is at least the noise of the mean of these data.
    ///
    /// # Errors
    /// No weight above 0.
    pub fn flux_seen(&self) -> Result<f64> {
        let n_chan = self.freq_hz.len();
        let mut data: Vec<Power> = Vec::with_capacity(self.vis.len());
        for (k, (v, w)) in self.vis.iter().zip(&self.weight).enumerate() {
            if *w > 0.0 {
                let length = self.uvw_m[(k / n_chan, 0)].hypot(self.uvw_m[(k / n_chan, 1)]) * self.freq_hz[k % n_chan] / SPEED_OF_LIGHT_M_S;
                data.push(Power { length, signal: f64::from(v.norm_sqr()), noise: 2.0 / f64::from(*w) });
            }
        }
        ensure!(!data.is_empty(), ChainError::NoData("no visibility has a weight above 0".into()));
        let n = data.len().div_ceil(100);
        if n < data.len() {
            data.select_nth_unstable_by(n, |a, b| a.length.total_cmp(&b.length));
        }
        let (power, noise) = data[..n].iter().fold((0.0, 0.0), |(p, q), d| (p + d.signal, q + d.noise));
        let count = n as f64;
        Ok(((power - noise) / count).max(noise / count / count).sqrt())
    }
}
