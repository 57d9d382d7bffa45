//! The imager: dirty images and residuals of a set, block by block.

use super::ImagingOptions;
use super::data::Data;
use super::near::Near;
use super::one_pass::OnePass;
use super::opened::Opened;
use super::reduction::ReducedBlock;
use super::session::{Gridded, LONG, ResidualWeights, Residue, Session};
use super::split::Split;
use super::survey::Survey;
use super::weights::ImageWeights;
use crate::fourier::{Real, Transform, in_precision};
use crate::progress::{Event, Observer};
use crate::{ChainError, Result, ensure};
use cittert_arrays::{Ranks, SkyGrid, VisibilityHeader, VisibilitySource};
use ndarray::{Array2, ArrayView2, Axis, CowArray, Ix2, Zip, s};
use rayon::prelude::*;
use std::any::Any;
use std::ops::Range;
use std::sync::Arc;

/// Pixels that one thread changes at once.
const PART: usize = 1 << 16;
/// Smallest error of transforms that is of use: visibilities are held in single precision.
const FINEST: f64 = 1e-8;

/// Makes beams, dirty images and residuals of one polarisation product of a set.
#[derive(Debug)]
pub struct Imager<'a> {
    data: Data<'a>,
    options: ImagingOptions,
    grid: SkyGrid,
    channels: Vec<Range<usize>>,
    /// Those of each output channel; none where the blocks stay in memory with their imaging weights.
    weights: Vec<ImageWeights>,
    /// Sum of the imaging weights in each output channel.
    sums: Vec<f64>,
    freq_hz: Vec<f64>,
    /// The transform of the output channel that was imaged last, a [`Session`] of either precision.
    session: Option<(usize, Box<dyn Any + Send + Sync>)>,
    /// Whether the user knows that planes are made again and again.
    told_of_groups: bool,
    /// The background that is taken out of the data.
    pub(super) split: Split,
    /// The exact transform of a scene near the array, in place of the Fourier transform.
    pub(super) near: Option<Near>,
    /// The sum of the images of all visibilities, and the scale of their weights, where it was made while the set was read.
    made: Option<(f64, Array2<f32>)>,
}

/// The residual of the data after the subtraction of a model.
#[derive(Debug, Clone)]
pub struct Residual<P = f64> {
    /// Residual image, flux per beam \[m, l\].
    pub image: Array2<P>,
    /// Sum of weight |V - model|^2, divided by twice the number of used visibilities. It is 1 if the residual is only noise.
    pub chi2_per_datum: f64,
}

/// Chi squared of an image with its gradient.
#[derive(Debug, Clone)]
pub struct ImageMisfit {
    /// Sum of weight |V - model|^2.
    pub chi2: f64,
    /// d chi2 / d I for each pixel \[m, l\], 1 / flux.
    pub gradient: Array2<f64>,
}

/// Set the imaging weights of all output channels in a block.
fn weigh(block: &mut ReducedBlock, channels: &[Range<usize>], weights: &[ImageWeights], freq_hz: &[f64]) {
    if weights.iter().all(ImageWeights::are_those_of_the_data) {
        return;
    }
    let mut imaging = block.imaging.take().unwrap_or_else(|| Zip::from(block.weight.view()).par_map_collect(|_| 0.0));
    for (range, w) in channels.iter().zip(weights) {
        w.apply(block, (range, freq_hz), &mut imaging);
    }
    block.imaging = Some(imaging);
}

impl<'a> Imager<'a> {
    /// Read the source once, choose the grid, and make the weights.
    ///
    /// # Errors
    /// An option is out of range, the set does not contain the polarisation product, no visibility can be used, or the source fails.
    pub fn new(source: &'a mut dyn VisibilitySource, options: ImagingOptions, observer: &dyn Observer) -> Result<Self> {
        let opened = Opened::new(source, &options, None, observer)?;
        Self::of(opened, options, observer)
    }

    /// As [`Imager::new`], for one dirty image. It is made while the source is read, if it can be, and the visibilities are not kept.
    ///
    /// # Errors
    /// As [`Imager::new`].
    pub fn of_one_image(source: &'a mut dyn VisibilitySource, options: ImagingOptions, observer: &dyn Observer) -> Result<Self> {
        options.check()?;
        let mut image = OnePass::of(source, &options)?;
        let opened = Opened::new(source, &options, image.as_mut(), observer)?;
        if let Some(image) = &image {
            ensure!(image.grid == opened.grid, ChainError::Internal("an image was made on another grid than that of its set".into()));
        }
        let made = image.map(OnePass::finish).transpose()?.flatten();
        Ok(Self { made, ..Self::of(opened, options, observer)? })
    }

    fn of(Opened { mut data, grid, channels, near }: Opened<'a>, options: ImagingOptions, observer: &dyn Observer) -> Result<Self> {
        let (ranks, freq_hz) = (data.ranks(), data.header().spectrum.freq_hz().to_vec());
        let all = 0..freq_hz.len();
        let own = !options.joint_weights;
        let density_of = |range: &Range<usize>| if own { range.clone() } else { all.clone() };
        let mut weights: Vec<ImageWeights> = channels.iter().map(|_| ImageWeights::new(&grid, &options)).collect();
        if weights.iter().any(ImageWeights::needs_density) {
            observer.event(Event::Phase { name: "weights", total: Some(data.survey().counts.total), unit: "vis" });
            let shared = if own { weights.len() } else { 1 };
            data.for_each_weight(
                observer,
                |_| (),
                |block| {
                    let block = &*block;
                    weights[..shared].par_iter_mut().zip(&channels).for_each(|(w, range)| w.add(block, &density_of(range), &freq_hz));
                    Ok(())
                },
            )?;
            for weights in &mut weights[..shared] {
                weights.share(&*ranks);
                weights.finish();
            }
            if !own {
                let first = weights[0].clone();
                weights.fill(first);
            }
            observer.event(Event::Done);
        }
        let mut sums = vec![0.0; channels.len()];
        if weights.iter().all(ImageWeights::are_those_of_the_data) {
            // The survey has summed these weights, and every block contains them.
            let channel_weight = &data.survey().channel_weight;
            channels.iter().zip(&mut sums).for_each(|(range, sum)| *sum = channel_weight[range.clone()].iter().sum());
        } else {
            data.for_each_weight(
                observer,
                |_| (),
                |block| {
                    weigh(block, &channels, &weights, &freq_hz);
                    for (range, sum) in channels.iter().zip(&mut sums) {
                        let imaging = block.imaging();
                        let part = imaging.slice(s![.., range.clone()]);
                        let of_row = |r: ndarray::ArrayView1<'_, f32>| r.iter().map(|w| f64::from(*w)).sum();
                        let rows: Vec<f64> = part.axis_iter(Axis(0)).into_par_iter().map(of_row).collect();
                        *sum += rows.iter().sum::<f64>();
                    }
                    Ok(())
                },
            )?;
            ranks.sum(&mut sums);
        }
        // Blocks in memory keep their imaging weights. The density grid of a large image would take as much memory as four planes.
        let weights = if data.is_cached() { Vec::new() } else { weights };
        Ok(Self {
            data,
            options,
            grid,
            channels,
            weights,
            sums,
            freq_hz,
            session: None,
            told_of_groups: false,
            split: Split::Pending,
            near,
            made: None,
        })
    }

    /// The grid that an imager with these options would choose, with the notes that it would give. This reads the source once, and makes no weights.
    ///
    /// # Errors
    /// As [`Imager::new`].
    pub fn grid_of(source: &'a mut dyn VisibilitySource, options: &ImagingOptions, observer: &dyn Observer) -> Result<SkyGrid> {
        Opened::new(source, options, None, observer).map(|opened| opened.grid)
    }

    /// The grid of the image.
    #[must_use]
    pub fn grid(&self) -> &SkyGrid {
        &self.grid
    }

    /// The results of the first pass over the data.
    #[must_use]
    pub fn survey(&self) -> &Survey {
        self.data.survey()
    }

    /// The header of the set.
    #[must_use]
    pub fn header(&self) -> &VisibilityHeader {
        self.data.header()
    }

    /// The options of the imager.
    #[must_use]
    pub fn options(&self) -> &ImagingOptions {
        &self.options
    }

    /// Let the error of the transforms be at most this part of the flux, where it was larger.
    pub(crate) fn refine(&mut self, epsilon: f64) {
        self.options.epsilon = self.options.epsilon.min(epsilon.max(FINEST));
    }

    /// Channels of each output channel.
    #[must_use]
    pub fn channels(&self) -> &[Range<usize>] {
        &self.channels
    }

    /// Sum of the imaging weights in an output channel; 0 if it has no usable visibility.
    #[must_use]
    pub fn sum_of_weights(&self, channel: usize) -> f64 {
        self.sums[channel]
    }

    /// Dirty image of an output channel, flux per beam \[m, l\]: the weighted mean of the visibilities, each multiplied by its phase at the
    /// pixel. The image of an output channel without usable visibilities is 0.
    ///
    /// # Errors
    /// The source fails.
    pub fn dirty(&mut self, channel: usize, observer: &dyn Observer) -> Result<Array2<f64>> {
        self.dirty_in(channel, observer)
    }

    /// [`Imager::dirty`] in this precision.
    pub(super) fn dirty_in<P: Real>(&mut self, channel: usize, observer: &dyn Observer) -> Result<Array2<P>> {
        self.find_backgrounds(observer)?;
        if let Some(background) = self.background_of(channel).cloned() {
            return Ok(self.residual_of(channel, background.into(), observer)?.image);
        }
        if let Some((scale, sum)) = self.made.take() {
            return Ok(self.mean(channel, scale, in_precision(sum)));
        }
        self.gridded((None, channel), Gridded::Visibilities, observer)
    }

    /// The residual of the data after the subtraction of the visibilities of `model` \[m, l\], flux per pixel.
    ///
    /// # Errors
    /// The output channel has no usable visibility, the model has another shape than the image or a pixel that is not finite, or the source
    /// fails.
    pub fn residual(&mut self, channel: usize, model: ArrayView2<'_, f64>, observer: &dyn Observer) -> Result<Residual> {
        self.residual_in(channel, model.into(), observer)
    }

    /// [`Imager::residual`] in this precision. A model that is given away is dropped as soon as it is transformed.
    pub(super) fn residual_in<P: Real>(
        &mut self,
        channel: usize,
        model: CowArray<'_, f64, Ix2>,
        observer: &dyn Observer,
    ) -> Result<Residual<P>> {
        self.find_backgrounds(observer)?;
        match self.background_of(channel).map(|background| &model + background) {
            Some(all) => self.residual_of(channel, all.into(), observer),
            None => self.residual_of(channel, model, observer),
        }
    }

    /// The residual of the data, the background included.
    fn residual_of<P: Real>(&mut self, channel: usize, model: CowArray<'_, f64, Ix2>, observer: &dyn Observer) -> Result<Residual<P>> {
        let scale = self.mean_weight(channel);
        let (left, sum) = self.residual_sum((channel, ResidualWeights::Imaging, scale), model, observer)?;
        let image = self.mean(channel, scale, sum);
        Ok(Residual { image, chi2_per_datum: left.chi2 / (2.0 * left.used as f64) })
    }

    /// Chi squared of `model` \[m, l\], flux per pixel, and its gradient, from one pass over the data of an output channel. Imaging weights have
    /// no part in it. The memory does not depend on the number of visibilities if they are read anew in every pass. A model that is given away
    /// is dropped as soon as it is transformed.
    ///
    /// # Errors
    /// As [`Imager::residual`].
    pub fn chi_squared(&mut self, channel: usize, model: CowArray<'_, f64, Ix2>, observer: &dyn Observer) -> Result<ImageMisfit> {
        let scale = self.over_used(self.survey().channel_weight[self.channels[channel].clone()].iter().sum());
        let (left, sum) = self.residual_sum::<f64>((channel, ResidualWeights::Data, scale), model, observer)?;
        Ok(ImageMisfit { chi2: left.chi2, gradient: sum * (-2.0 * scale) })
    }

    /// True if the data are in memory.
    pub(super) fn is_cached(&self) -> bool {
        self.data.is_cached()
    }

    /// The processes that share the data.
    pub(crate) fn ranks(&self) -> Arc<dyn Ranks> {
        self.data.ranks()
    }

    /// Call `work` for every block of this process with its imaging weights, in order.
    pub(crate) fn for_each_weighed(
        &mut self,
        observer: &dyn Observer,
        mut work: impl FnMut(&ReducedBlock) -> Result<()> + Send,
    ) -> Result<()> {
        let (channels, weights, freq_hz) = (&self.channels, &self.weights, &self.freq_hz);
        self.data.for_each(observer, |b| weigh(b, channels, weights, freq_hz), |block| work(block))
    }

    /// [`Imager::for_each_weighed`] without a look at the visibilities, which the blocks need not have.
    pub(super) fn for_each_weight(
        &mut self,
        observer: &dyn Observer,
        mut work: impl FnMut(&ReducedBlock) -> Result<()> + Send,
    ) -> Result<()> {
        let (channels, weights, freq_hz) = (&self.channels, &self.weights, &self.freq_hz);
        self.data.for_each_weight(observer, |b| weigh(b, channels, weights, freq_hz), |block| work(block))
    }

    /// The kept session of an output channel on the grid of the image, or a new one.
    pub(super) fn session<T: Real>(&mut self, channel: usize) -> Result<Session<T>> {
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
        let options = (&self.options.grid_options(), self.n_transformed(channel));
        Session::new(grid, (range, &self.freq_hz), self.survey().extent, options, self.mean_weight(channel))
    }

    /// The number of visibilities of an output channel that the choice of a transform counts with.
    pub(crate) fn n_transformed(&self, channel: usize) -> u64 {
        let share = self.channels[channel].len() as u64;
        (self.survey().counts.used * share / self.freq_hz.len().max(1) as u64).min(LONG)
    }

    /// Grid the visibilities, or 1 in place of each, with their imaging weights, transform them to an image, and divide it by the sum of
    /// weights. Without a field the image has the grid of the imager, and the session is kept for the next pass.
    pub(super) fn gridded<P: Real>(&mut self, at: (Option<&SkyGrid>, usize), what: Gridded, observer: &dyn Observer) -> Result<Array2<P>> {
        if self.near.is_some() {
            return self.near_gridded(at, what, observer);
        }
        if self.options.grid_options().single_precision_suffices() {
            self.gridded_in::<f32, P>(at, what, observer)
        } else {
            self.gridded_in::<f64, P>(at, what, observer)
        }
    }

    fn gridded_in<T: Real, P: Real>(
        &mut self,
        (field, channel): (Option<&SkyGrid>, usize),
        what: Gridded,
        observer: &dyn Observer,
    ) -> Result<Array2<P>> {
        let mut session = match field {
            Some(grid) => self.session_on(grid, channel)?,
            None => self.session::<T>(channel)?,
        };
        let name = if what == Gridded::Beam { "beam" } else { "gridding" };
        observer.event(Event::Phase { name, total: Some(self.data.survey().counts.total), unit: "vis" });
        let sum = match self.bands(&mut session, field)? {
            Some(bands) => self.gridded_by_bands(&mut session, &bands, what, observer)?,
            None => {
                if field.is_none() {
                    self.tell_of_groups(&session.transform, observer);
                }
                self.gridded_at_once(&mut session, what, observer)?
            }
        };
        let image = self.mean(channel, session.scale, sum);
        if field.is_none() {
            self.session = Some((channel, Box::new(session)));
        }
        observer.event(Event::Done);
        Ok(image)
    }

    /// Tell the user once where the planes do not fit into the memory, because every pass then takes many times as long.
    fn tell_of_groups<T: Real>(&mut self, transform: &Transform<T>, observer: &dyn Observer) {
        let groups = transform.groups_of_planes();
        if groups < 2 || self.told_of_groups || !self.data.has_blocks() {
            return;
        }
        self.told_of_groups = true;
        let single = if size_of::<T>() > 4 { ", or single precision (--epsilon 1e-5), which halves them" } else { "" };
        observer.event(Event::Note(&format!(
            "the planes of the grid take {:.0} MB and do not fit into a quarter of the memory budget: they are made in {groups} groups for every block of rows, which takes long. \
             More memory (--memory) helps, or a smaller field{single}",
            transform.plane_bytes() as f64 / 1e6
        )));
    }

    /// A sum of scaled weights times values, divided by the sum of weights. Without weights the sum is 0 and stays 0.
    fn mean<P: Real>(&self, channel: usize, scale: f64, mut sum: Array2<P>) -> Array2<P> {
        if self.sums[channel] > 0.0 {
            let factor = scale / self.sums[channel];
            let times = |v: &mut P| *v = P::of(v.to64() * factor);
            match sum.as_slice_mut() {
                Some(all) => all.par_chunks_mut(PART).for_each(|part| part.iter_mut().for_each(times)),
                None => sum.par_iter_mut().for_each(times),
            }
        }
        sum
    }

    /// The residuals of an output channel with these weights over `scale`, gridded and transformed, and what they leave of chi squared.
    fn residual_sum<P: Real>(
        &mut self,
        how: (usize, ResidualWeights, f64),
        model: CowArray<'_, f64, Ix2>,
        observer: &dyn Observer,
    ) -> Result<(Residue, Array2<P>)> {
        if self.near.is_some() {
            return self.near_residual(how, model, observer);
        }
        if self.options.grid_options().single_precision_suffices() {
            self.residual_sum_in::<f32, P>(how, model, observer)
        } else {
            self.residual_sum_in::<f64, P>(how, model, observer)
        }
    }

    fn residual_sum_in<T: Real, P: Real>(
        &mut self,
        (channel, weights, scale): (usize, ResidualWeights, f64),
        model: CowArray<'_, f64, Ix2>,
        observer: &dyn Observer,
    ) -> Result<(Residue, Array2<P>)> {
        observer.event(Event::Phase { name: "residual", total: Some(self.data.survey().counts.total), unit: "vis" });
        let mut session = self.session::<T>(channel)?;
        let (mut left, sum) = match self.residual_bands(&mut session)? {
            Some(bands) => self.residual_by_bands((&mut session, &bands), (weights, scale), model, observer)?,
            None => self.residual_at_once(&mut session, (weights, scale), model, observer)?,
        };
        left.share(&*self.data.ranks());
        ensure!(left.used > 0, ChainError::NoData(format!("output channel {channel} has no usable visibility, and therefore no residual")));
        self.session = Some((channel, Box::new(session)));
        observer.event(Event::Done);
        Ok((left, sum))
    }

    /// Mean weight of an output channel. Weights are divided by it before they are rounded to single precision, so that a large unit cannot
    /// overflow it. It is 1 if no weight is positive.
    fn mean_weight(&self, channel: usize) -> f64 {
        self.over_used(self.sums[channel])
    }

    /// A sum of weights over the number of visibilities; 1 where that is no usable scale.
    fn over_used(&self, sum: f64) -> f64 {
        let mean = sum / self.survey().counts.used.max(1) as f64;
        if mean > 0.0 && mean.is_finite() { mean } else { 1.0 }
    }
}
