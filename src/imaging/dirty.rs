//! Dirty images and residuals, block after block.

use super::ImagingOptions;
use super::data::{Data, ReducedBlock, Survey};
use super::pol::PolSelector;
use super::session::{Residue, Session};
use super::size::choose_grid;
use super::weights::ImageWeights;
use crate::fourier::Real;
use crate::progress::{Event, Observer};
use crate::{ChainError, Result};
use cittert_arrays::{SkyGrid, VisibilityHeader, VisibilitySource};
use ndarray::{Array2, ArrayView2, Axis, s};
use num_complex::Complex;
use rayon::prelude::*;
use std::any::Any;
use std::ops::Range;

/// The grid gets finer with the number of visibilities up to this one: the memory of longer sets is the same.
const LONG: u64 = 100_000_000;

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
    /// The transform of the output channel that was imaged last, a [`Session`] of either precision.
    session: Option<(usize, Box<dyn Any + Send + Sync>)>,
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
            option: "channels-out",
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
        options.check()?;
        let spectrum = source.header().spectrum.clone();
        let channels = share(spectrum.n_chan(), options.channels_out)?;
        let selector = PolSelector::new(options.pol, &source.header().polarizations)?;
        let mut data = Data::open(source, selector, (options.unit_weights, options.cache_bytes), observer)?;
        let grid = choose_grid(data.survey(), data.header(), &options, observer)?;
        let freq_hz = spectrum.freq_hz().to_vec();
        let all = 0..freq_hz.len();
        let own = !options.joint_weights;
        let density_of = |range: &Range<usize>| if own { range.clone() } else { all.clone() };
        let mut weights: Vec<ImageWeights> = channels.iter().map(|_| ImageWeights::new(&grid, &options)).collect();
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
        if weights.iter().all(ImageWeights::are_those_of_the_data) {
            // The survey has summed them, and blocks come with them.
            let channel_weight = &data.survey().channel_weight;
            channels.iter().zip(&mut sums).for_each(|(range, sum)| *sum = channel_weight[range.clone()].iter().sum());
        } else {
            data.for_each(
                observer,
                |_| (),
                |block| {
                    weigh(block, &channels, &weights, &freq_hz);
                    for (range, sum) in channels.iter().zip(&mut sums) {
                        let part = block.imaging.slice(s![.., range.clone()]);
                        let of_row = |r: ndarray::ArrayView1<'_, f32>| r.iter().map(|w| f64::from(*w)).sum();
                        let rows: Vec<f64> = part.axis_iter(Axis(0)).into_par_iter().map(of_row).collect();
                        *sum += rows.iter().sum::<f64>();
                    }
                    Ok(())
                },
            )?;
        }
        Ok(Self { data, options, grid, channels, weights, sums, freq_hz, session: None })
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
        if self.options.grid_options().single_precision_suffices() {
            self.whole::<f32>(channel, observer, "gridding", |v, w| v.scale(w))
        } else {
            self.whole::<f64>(channel, observer, "gridding", |v, w| v.scale(w))
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

    /// Take the transform of an output channel to the whole image, or make it.
    fn session<T: Real>(&mut self, channel: usize) -> Result<Session<T>> {
        if let Some((of, any)) = self.session.take()
            && of == channel
            && let Ok(session) = any.downcast::<Session<T>>()
        {
            return Ok(*session);
        }
        self.session_on(&self.grid, channel)
    }

    fn session_on<T: Real>(&self, grid: &SkyGrid, channel: usize) -> Result<Session<T>> {
        let range = self.channels[channel].clone();
        let n_vis = (self.survey().counts.used * range.len() as u64 / self.freq_hz.len().max(1) as u64).min(LONG);
        Session::new(grid, (range, &self.freq_hz), self.survey().extent, (&self.options.grid_options(), n_vis), self.mean_weight(channel))
    }

    /// Sum over all blocks of the values that `value` makes of (visibility, image weight), transformed to the whole image and divided by
    /// the sum of weights.
    pub(super) fn whole<T: Real>(
        &mut self,
        channel: usize,
        observer: &dyn Observer,
        name: &'static str,
        value: impl Fn(Complex<T>, T) -> Complex<T> + Sync,
    ) -> Result<Array2<f64>> {
        let mut session = self.session::<T>(channel)?;
        let image = self.pass((&mut session, channel), observer, name, value)?;
        self.session = Some((channel, Box::new(session)));
        Ok(image)
    }

    /// [`Imager::whole`] on a field of another size.
    pub(super) fn field<T: Real>(
        &mut self,
        (grid, channel): (&SkyGrid, usize),
        observer: &dyn Observer,
        name: &'static str,
        value: impl Fn(Complex<T>, T) -> Complex<T> + Sync,
    ) -> Result<Array2<f64>> {
        let mut session = self.session_on(grid, channel)?;
        self.pass((&mut session, channel), observer, name, value)
    }

    fn pass<T: Real>(
        &mut self,
        (session, channel): (&mut Session<T>, usize),
        observer: &dyn Observer,
        name: &'static str,
        value: impl Fn(Complex<T>, T) -> Complex<T> + Sync,
    ) -> Result<Array2<f64>> {
        observer.event(Event::Phase { name, total: Some(self.data.survey().counts.total), unit: "vis" });
        let (channels, weights, all) = (&self.channels, &self.weights, &self.freq_hz);
        let mut gridder = session.transform.gridder();
        let cached = self.data.is_cached();
        let mut number = 0;
        self.data.for_each(
            observer,
            |b| weigh(b, channels, weights, all),
            |block| {
                session.grid((number, cached), block, &mut gridder, &value)?;
                number += 1;
                Ok(())
            },
        )?;
        let image = gridder.finish() * (session.scale / self.sums[channel].max(f64::MIN_POSITIVE));
        observer.event(Event::Done);
        Ok(image)
    }

    fn residual_in<T: Real>(&mut self, channel: usize, model: ArrayView2<'_, f64>, observer: &dyn Observer) -> Result<Residual> {
        observer.event(Event::Phase { name: "residual", total: Some(self.data.survey().counts.total), unit: "vis" });
        let mut session = self.session::<T>(channel)?;
        let degridder = session.transform.degridder(model)?;
        let mut gridder = session.transform.gridder();
        let (channels, weights, all) = (&self.channels, &self.weights, &self.freq_hz);
        let cached = self.data.is_cached();
        let (mut left, mut number) = (Residue::default(), 0);
        self.data.for_each(
            observer,
            |b| weigh(b, channels, weights, all),
            |block| {
                left += session.residual((number, cached), block, &degridder, &mut gridder)?;
                number += 1;
                Ok(())
            },
        )?;
        drop(degridder);
        let image = gridder.finish() * (session.scale / self.sums[channel].max(f64::MIN_POSITIVE));
        self.session = Some((channel, Box::new(session)));
        observer.event(Event::Done);
        Ok(Residual { image, chi2_per_datum: left.chi2 / (2.0 * left.used.max(1) as f64) })
    }

    /// Weights are divided by this before they meet single precision, so that their unit cannot overflow it.
    fn mean_weight(&self, channel: usize) -> f64 {
        let used = self.data.survey().counts.used.max(1) as f64;
        let mean = self.sums[channel] / used;
        if mean > 0.0 && mean.is_finite() { mean } else { 1.0 }
    }
}
