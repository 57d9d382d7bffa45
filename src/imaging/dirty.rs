//! Dirty images and residuals, block after block.

use super::ImagingOptions;
use super::data::{Data, ReducedBlock, Survey};
use super::pol::PolSelector;
use super::size::choose_grid;
use super::weights::ImageWeights;
use crate::fourier::{Degridder, Gridder, Real};
use crate::progress::{Event, Observer};
use crate::{ChainError, Result};
use cittert_arrays::{SkyGrid, VisibilityHeader, VisibilitySource};
use ndarray::{Array2, ArrayView2, Axis, s};
use num_complex::Complex;
use rayon::prelude::*;
use std::ops::Range;

/// Makes beams, dirty images and residuals of one product of a set.
#[derive(Debug)]
pub struct Imager<'a> {
    data: Data<'a>,
    options: ImagingOptions,
    grid: SkyGrid,
    channels: Vec<Range<usize>>,
    weights: Vec<ImageWeights>,
    /// Sum of the weights of the image over each output channel.
    sums: Vec<f64>,
    freq_hz: Vec<f64>,
}

/// What a model leaves of the data.
#[derive(Debug, Clone)]
pub struct Residual {
    /// Residual image, flux a beam \[m, l\].
    pub image: Array2<f64>,
    /// Sum of weight |V - model|^2 over two real numbers for each used visibility: 1 where the model explains all but the noise.
    pub chi2_per_datum: f64,
}

/// Weights of the image of all output channels put into a block.
fn weigh(block: &mut ReducedBlock, channels: &[Range<usize>], weights: &[ImageWeights], freq_hz: &[f64]) {
    for (range, w) in channels.iter().zip(weights) {
        w.apply(block, range, freq_hz);
    }
}

/// Channels shared out evenly.
fn share(n_chan: usize, parts: usize) -> Result<Vec<Range<usize>>> {
    if parts == 0 || parts > n_chan {
        return Err(ChainError::BadOption {
            option: "--channels-out",
            value: parts.to_string(),
            expected: format!("1 to the {n_chan} channels of the set"),
        });
    }
    Ok((0..parts).map(|k| n_chan * k / parts..n_chan * (k + 1) / parts).collect())
}

impl<'a> Imager<'a> {
    /// Read the source once, choose the grid, and make the weights.
    ///
    /// # Errors
    /// Options out of range, a product that the file cannot give, nothing usable in the file, whatever the source says.
    pub fn new(source: &'a mut dyn VisibilitySource, options: ImagingOptions, observer: &dyn Observer) -> Result<Self> {
        options.weights.check()?;
        let spectrum = source.header().spectrum.clone();
        let channels = share(spectrum.n_chan(), options.channels_out)?;
        let selector = PolSelector::new(options.polarization, &source.header().polarizations)?;
        let mut data = Data::open(source, selector, (options.unit_weights, options.cache_bytes), observer)?;
        let grid = choose_grid(data.survey(), data.header(), &options, observer)?;
        let freq_hz = spectrum.freq_hz().to_vec();
        let all = 0..freq_hz.len();
        let own = options.weights_per_channel_out;
        let density_of = |range: &Range<usize>| if own { range.clone() } else { all.clone() };
        let mut weights: Vec<ImageWeights> = channels.iter().map(|_| ImageWeights::new(&grid, options.weights)).collect();
        if weights.iter().any(ImageWeights::needs_density) {
            observer.event(Event::Phase { name: "weights", total: Some(data.survey().counts.total), unit: "vis" });
            let shared = if own { weights.len() } else { 1 };
            data.for_each(
                observer,
                |_| (),
                |block| {
                    let block = &*block;
                    weights[..shared].par_iter_mut().zip(&channels).for_each(|(w, range)| w.add(block, &density_of(range), &freq_hz));
                    Ok(())
                },
            )?;
            weights.iter_mut().take(shared).for_each(ImageWeights::finish);
            if !own {
                let first = weights[0].clone();
                weights.fill(first);
            }
            observer.event(Event::Done);
        }
        let mut sums = vec![0.0; channels.len()];
        data.for_each(
            observer,
            |_| (),
            |block| {
                weigh(block, &channels, &weights, &freq_hz);
                for (range, sum) in channels.iter().zip(&mut sums) {
                    let part = block.imaging.slice(s![.., range.clone()]);
                    let rows: Vec<f64> = part.axis_iter(Axis(0)).into_par_iter().map(|r| r.iter().map(|w| f64::from(*w)).sum()).collect();
                    *sum += rows.iter().sum::<f64>();
                }
                Ok(())
            },
        )?;
        Ok(Self { data, options, grid, channels, weights, sums, freq_hz })
    }

    /// Where the pixels are.
    #[must_use]
    pub fn grid(&self) -> &SkyGrid {
        &self.grid
    }

    /// What the first pass found.
    #[must_use]
    pub fn survey(&self) -> &Survey {
        self.data.survey()
    }

    /// What all rows share.
    #[must_use]
    pub fn header(&self) -> &VisibilityHeader {
        self.data.header()
    }

    /// The options it was made with.
    #[must_use]
    pub fn options(&self) -> &ImagingOptions {
        &self.options
    }

    /// Channels of each output channel.
    #[must_use]
    pub fn channels(&self) -> &[Range<usize>] {
        &self.channels
    }

    /// Sum of the weights of the image in an output channel; 0 where it has no usable datum.
    #[must_use]
    pub fn sum_of_weights(&self, channel: usize) -> f64 {
        self.sums[channel]
    }

    /// Dirty image of an output channel, flux a beam \[m, l\]: the weighted mean of the visibilities turned to each pixel.
    /// An output channel without data is 0.
    ///
    /// # Errors
    /// Whatever the source says.
    pub fn dirty(&mut self, channel: usize, observer: &dyn Observer) -> Result<Array2<f64>> {
        let grid = self.grid.clone();
        if self.options.grid_options().single_precision_suffices() {
            self.pass::<f32>((&grid, channel), observer, "gridding", |v, w| v.scale(w))
        } else {
            self.pass::<f64>((&grid, channel), observer, "gridding", |v, w| v.scale(w))
        }
    }

    /// What is left of the data when the visibilities of `model` \[m, l\], flux a pixel, are taken away.
    ///
    /// # Errors
    /// Whatever the source says; a model of another shape or with values that are not finite.
    pub fn residual(&mut self, channel: usize, model: ArrayView2<'_, f64>, observer: &dyn Observer) -> Result<Residual> {
        if self.options.grid_options().single_precision_suffices() {
            self.residual_in::<f32>(channel, model, observer)
        } else {
            self.residual_in::<f64>(channel, model, observer)
        }
    }

    /// Hand every block with its image weights to `work`, in order.
    pub(crate) fn for_each_weighed(&mut self, observer: &dyn Observer, mut work: impl FnMut(&ReducedBlock) -> Result<()>) -> Result<()> {
        let (channels, weights, freq_hz) = (&self.channels, &self.weights, &self.freq_hz);
        self.data.for_each(observer, |b| weigh(b, channels, weights, freq_hz), |block| work(block))
    }

    /// Sum over all blocks of the values that `value` makes of (visibility, image weight), transformed and divided by
    /// the sum of weights.
    pub(super) fn pass<T: Real>(
        &mut self,
        (grid, channel): (&SkyGrid, usize),
        observer: &dyn Observer,
        name: &'static str,
        value: impl Fn(Complex<T>, T) -> Complex<T> + Sync,
    ) -> Result<Array2<f64>> {
        let range = self.channels[channel].clone();
        let scale = self.mean_weight(channel);
        let freq = &self.freq_hz[range.clone()];
        let mut gridder = Gridder::<T>::new(grid, freq, self.data.survey().extent, &self.options.grid_options())?;
        observer.event(Event::Phase { name, total: Some(self.data.survey().counts.total), unit: "vis" });
        let (channels, weights, all) = (&self.channels, &self.weights, &self.freq_hz);
        self.data.for_each(
            observer,
            |b| weigh(b, channels, weights, all),
            |block| {
                let values = weighted::<T>(block, &range, scale, &value);
                gridder.add(block.uvw_m.view(), values.view())
            },
        )?;
        let image = gridder.finish() * (scale / self.sums[channel].max(f64::MIN_POSITIVE));
        observer.event(Event::Done);
        Ok(image)
    }

    fn residual_in<T: Real>(&mut self, channel: usize, model: ArrayView2<'_, f64>, observer: &dyn Observer) -> Result<Residual> {
        let range = self.channels[channel].clone();
        let scale = self.mean_weight(channel);
        let (freq, extent, opts) = (self.freq_hz[range.clone()].to_vec(), self.data.survey().extent, self.options.grid_options());
        observer.event(Event::Phase { name: "residual", total: Some(self.data.survey().counts.total), unit: "vis" });
        let degridder = Degridder::<T>::new(&self.grid, model, &freq, extent, &opts)?;
        let mut gridder = Gridder::<T>::new(&self.grid, &freq, extent, &opts)?;
        let (channels, weights, all) = (&self.channels, &self.weights, &self.freq_hz);
        let (mut chi2, mut used) = (0.0, 0_u64);
        self.data.for_each(
            observer,
            |b| weigh(b, channels, weights, all),
            |block| {
                let mut values = Array2::from_elem((block.vis.nrows(), freq.len()), Complex::new(T::default(), T::default()));
                degridder.predict(block.uvw_m.view(), values.view_mut())?;
                let part = |(r, mut row): (usize, ndarray::ArrayViewMut1<'_, Complex<T>>)| {
                    let (mut chi2, mut used) = (0.0, 0_u64);
                    for (c, value) in range.clone().zip(row.iter_mut()) {
                        let (v, w, i) = (block.vis[(r, c)], block.weight[(r, c)], block.imaging[(r, c)]);
                        let d = Complex::new(T::of(f64::from(v.re)) - value.re, T::of(f64::from(v.im)) - value.im);
                        if w > 0.0 {
                            chi2 += f64::from(w) * d.norm_sqr().to64();
                            used += 1;
                        }
                        *value = if i > 0.0 { d.scale(T::of(f64::from(i) / scale)) } else { Complex::default() };
                    }
                    (chi2, used)
                };
                let sums: Vec<(f64, u64)> = values.axis_iter_mut(Axis(0)).into_par_iter().enumerate().map(part).collect();
                for (x, n) in sums {
                    chi2 += x;
                    used += n;
                }
                gridder.add(block.uvw_m.view(), values.view())
            },
        )?;
        let image = gridder.finish() * (scale / self.sums[channel].max(f64::MIN_POSITIVE));
        observer.event(Event::Done);
        Ok(Residual { image, chi2_per_datum: chi2 / (2.0 * used.max(1) as f64) })
    }

    /// Weights are divided by this before they meet single precision, so that their unit cannot overflow it.
    fn mean_weight(&self, channel: usize) -> f64 {
        let used = self.data.survey().counts.used.max(1) as f64;
        let mean = self.sums[channel] / used;
        if mean > 0.0 && mean.is_finite() { mean } else { 1.0 }
    }
}

/// Values of the channels of a block to grid.
fn weighted<T: Real>(
    block: &ReducedBlock,
    range: &Range<usize>,
    scale: f64,
    value: &(impl Fn(Complex<T>, T) -> Complex<T> + Sync),
) -> Array2<Complex<T>> {
    let mut out = Array2::from_elem((block.vis.nrows(), range.len()), Complex::new(T::default(), T::default()));
    let part = s![.., range.clone()];
    let (vis, imaging) = (block.vis.slice(part), block.imaging.slice(part));
    out.axis_iter_mut(Axis(0)).into_par_iter().zip(vis.axis_iter(Axis(0))).zip(imaging.axis_iter(Axis(0))).for_each(|((mut o, v), w)| {
        for ((o, v), w) in o.iter_mut().zip(v).zip(w) {
            if *w > 0.0 {
                let v = Complex::new(T::of(f64::from(v.re)), T::of(f64::from(v.im)));
                *o = value(v, T::of(f64::from(*w) / scale));
            }
        }
    });
    out
}
