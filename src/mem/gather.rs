//! The visibilities of one output channel as lists, and a prior from what they show.

use crate::Result;
use crate::imaging::Imager;
use crate::progress::Observer;
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
    /// Weights of the data, 1/sigma^2; 0 for what must not count \[row x chan\].
    pub weight: Vec<f32>,
}

impl Gathered {
    /// The data of an output channel of an imager.
    ///
    /// # Errors
    /// Whatever the source says.
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

    /// Middle of the weights that count.
    #[must_use]
    pub fn median_weight(&self) -> f64 {
        let mut used: Vec<f32> = self.weight.iter().copied().filter(|w| *w > 0.0).collect();
        if used.is_empty() {
            return 0.0;
        }
        let middle = used.len() / 2;
        f64::from(*used.select_nth_unstable_by(middle, f32::total_cmp).1)
    }

    /// The flux that the shortest baselines see: the root mean square amplitude on the shortest hundredth of them, less the noise, and
    /// at least that of the noise of a mean.
    #[must_use]
    pub fn flux_seen(&self) -> f64 {
        let n_chan = self.freq_hz.len();
        let mut data: Vec<(f64, f64, f64)> = Vec::with_capacity(self.vis.len());
        for (k, (v, w)) in self.vis.iter().zip(&self.weight).enumerate() {
            if *w > 0.0 {
                let length = self.uvw_m[(k / n_chan, 0)].hypot(self.uvw_m[(k / n_chan, 1)]) * self.freq_hz[k % n_chan] / SPEED_OF_LIGHT_M_S;
                data.push((length, f64::from(v.norm_sqr()), 2.0 / f64::from(*w)));
            }
        }
        let n = data.len().div_ceil(100);
        if n < data.len() {
            data.select_nth_unstable_by(n, |a, b| a.0.total_cmp(&b.0));
        }
        let (power, noise) = data[..n.min(data.len())].iter().fold((0.0, 0.0), |(p, q), (_, a, b)| (p + a, q + b));
        let count = n.max(1) as f64;
        ((power - noise) / count).max(noise / count / count).max(0.0).sqrt()
    }
}
