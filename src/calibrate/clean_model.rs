//! CLEAN as the model maker of self-calibration: any deconvolver of the table, inside its major cycles.

use super::model::ModelVisibilities;
use super::predicted::{Left, Predicted, Unpolarized, of_products};
use super::rounds::{ModelMaker, ModelMetrics, RoundPlan};
use super::selfcal_tuning::SelfcalTuning;
use crate::deconvolve::EXTENDED;
use crate::fourier::{Degridder, GridOptions, Real, UvwExtent};
use crate::imaging::major::CleanOptions;
use crate::imaging::{BackgroundChoice, CleanProducts, Continue, Imager, ImagingOptions, Tools, clean_from, joined};
use crate::progress::{Observer, WithoutNotes};
use crate::values::Level;
use crate::{ChainError, Result};
use cittert_arrays::{BrightnessUnit, Image, Polarization, SkyGrid, UvCoverage, VisUnit, VisibilityHeader, VisibilitySource};
use ndarray::{Array2, Array3, ArrayView2, Axis, s};
use num_complex::Complex;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;

/// Images and cleans the data of each round, and predicts from the model. All rounds use the grid of the first round.
///
/// The first image starts from an empty model; later ones continue from the present model. All rounds but the last take one major
/// cycle: the residual visibilities of the newly calibrated data are gridded, and one minor cycle cleans them. A round costs two
/// transforms, one to predict the model and one to grid the residual, so many short rounds cost no more than a few deep images. Short
/// rounds also solve extended scenes: gains and image improve together, before either takes up the errors of the other.
pub struct CleanMaker {
    imaging: ImagingOptions,
    clean: CleanOptions,
    now: Option<State>,
    best: Option<State>,
    tools: Option<Tools>,
    predicted: Predicted,
    tuning: SelfcalTuning,
}

#[derive(Clone)]
struct State {
    products: Arc<CleanProducts>,
    /// Channels of the set in each output channel.
    channels: Vec<Range<usize>>,
    extent: UvwExtent,
    predictors: Arc<Predictors>,
    /// How predictions are made.
    grid_options: GridOptions,
}

/// The grid and the channels of the data of an imager.
struct Place {
    channels: Vec<Range<usize>>,
    freq_hz: Vec<f64>,
    extent: UvwExtent,
}

impl Place {
    fn of(imager: &Imager<'_>) -> Self {
        Self { channels: imager.channels().to_vec(), freq_hz: imager.header().spectrum.freq_hz().to_vec(), extent: imager.survey().extent }
    }
}

/// All later images use the grid of the first image.
fn stay_on(imaging: &mut ImagingOptions, grid: &SkyGrid) -> SkyGrid {
    *imaging = imaging.on_grid(grid);
    grid.clone()
}

/// Degridders of the output channels, in the precision that the error allows.
enum Predictors {
    Single(Vec<Degridder<f32>>),
    Double(Vec<Degridder<f64>>),
}

impl CleanMaker {
    /// A maker with these options. In each round `clean.threshold` is raised to the depth of the plan times the peak of the round before,
    /// so that the model grows from round to round. The last round goes to the depth of the options. `clean.niter` limits the components of
    /// each round.
    #[must_use]
    pub fn new(imaging: ImagingOptions, clean: CleanOptions) -> Self {
        // The loop continues from models of the whole data. A background that is taken out of them would be counted twice.
        let imaging = ImagingOptions { background: BackgroundChoice::None, ..imaging };
        Self { imaging, clean, now: None, best: None, tools: None, predicted: Predicted::default(), tuning: SelfcalTuning::default() }
    }

    /// Set other constants for the short rounds.
    #[must_use]
    pub fn tuned(mut self, tuning: SelfcalTuning) -> Self {
        self.tuning = tuning;
        self
    }

    /// Images of the present round; after the loop, those of the best round.
    #[must_use]
    pub fn products(&self) -> Option<&CleanProducts> {
        self.now.as_ref().map(|s| &*s.products)
    }

    /// Use a model that was made elsewhere. Predictions use it, and the products contain it and its residual.
    ///
    /// # Errors
    /// As for an image; a model (flux a pixel \[m, l\]) of another shape.
    pub fn show(&mut self, data: &mut dyn VisibilitySource, model: &Array2<f64>, observer: &dyn Observer) -> Result<ModelMetrics> {
        let mut imager = Imager::new(data, self.imaging.clone(), observer)?;
        stay_on(&mut self.imaging, imager.grid());
        let options = CleanOptions { niter: 0, ..self.clean.clone() };
        let from = Continue { models: std::slice::from_ref(model), ..Continue::default() };
        let products = clean_from(&mut imager, &options, &mut self.tools, from, observer)?;
        let place = Place::of(&imager);
        drop(imager);
        self.hold(place, products, self.imaging.epsilon)
    }

    /// Keep the products, and prepare predictions with an error of `epsilon`.
    fn hold(&mut self, place: Place, products: CleanProducts, epsilon: f64) -> Result<ModelMetrics> {
        let Place { channels, freq_hz, extent } = place;
        let grid_options = GridOptions { epsilon, ..self.imaging.grid_options() };
        let made = Predictors::new(&products.model, &channels, &freq_hz, extent, &grid_options)?;
        let statistics = &products.statistics;
        let metrics = ModelMetrics {
            peak: peak(&products.restored),
            residual_rms: statistics.residual_rms,
            model_flux: statistics.model_flux,
            iterations: statistics.iterations,
        };
        self.predicted.clear();
        self.now = Some(State { products: Arc::new(products), channels, extent, predictors: Arc::new(made), grid_options });
        Ok(metrics)
    }

    /// Lower limit of the flux of a pixel. A thermal scene is nowhere colder than 0 K. There is no limit for sources in Jy, because a point
    /// between pixels needs negative neighbours.
    fn floor(&self, header: &VisibilityHeader, grid: &SkyGrid) -> Option<f64> {
        let thermal = header.unit == VisUnit::KelvinSr && self.imaging.pol == Polarization::I;
        let coldest = -header.pedestal_k.unwrap_or(0.0) * grid.cell_sr();
        (thermal || self.clean.no_negative).then_some(if self.clean.no_negative { 0.0 } else { coldest })
    }
}

impl ModelMaker for CleanMaker {
    fn update(&mut self, data: &mut dyn VisibilitySource, plan: &RoundPlan, observer: &dyn Observer) -> Result<ModelMetrics> {
        let observer = &WithoutNotes(observer);
        let header = data.header().clone();
        let mut state = self.now.take();
        // In the last round, point sources are cleaned from an empty model. False points from the first, poorly calibrated rounds therefore
        // disappear. An extended scene continues from the present model, because all rounds contribute to it.
        if plan.last && self.clean.algorithm.name() != EXTENDED {
            state = None;
        }
        let models: Vec<Array2<f64>> = state.iter().flat_map(|s| (0..s.channels.len()).map(|k| flux(&s.products.model, k))).collect();
        let peak_before = state.as_ref().map(|s| peak(&s.products.restored));
        let subtracted = state.is_some() && !plan.last;
        let mut imaging = self.imaging.clone();
        if subtracted && self.tools.is_some() {
            imaging.epsilon = self.tuning.epsilon_of_short_rounds(&imaging.grid_options());
        }
        let mut left;
        let source: &mut dyn VisibilitySource = match &mut state {
            Some(model) if subtracted => {
                left = Left { inner: data, model, known: &self.predicted };
                &mut left
            }
            _ => data,
        };
        let mut imager = Imager::new(source, imaging, observer)?;
        let grid = stay_on(&mut self.imaging, imager.grid());
        let from = Continue { models: &models, subtracted, floor: self.floor(&header, &grid), exact: plan.last };
        let mut options = self.clean.clone();
        if !plan.last {
            options.max_major = options.max_major.min(1);
            // A minor cycle works on an approximate residual, so it may place some flux wrongly. The next round computes the exact residual and
            // corrects it. The minor cycle may therefore go deeper than the side-lobe limit.
            options.cyclefactor = 0.0;
            // Gains solved against points in the noise would fit the noise. (Extended structure is brighter than any of its residuals.)
            if options.algorithm.name() != EXTENDED {
                options.nsigma = options.nsigma.max(self.tuning.short_nsigma);
            }
        }
        match peak_before {
            Some(before) => {
                let given = options.threshold.map_or(Ok(0.0), |level| level.in_unit("threshold", header.unit))?;
                options.threshold = Some(Level::of(given.max(plan.depth * before), header.unit));
            }
            // The peak is not known before the first image, so its only cycle stops at a fraction of the peak.
            None if !plan.last => options.mgain = options.mgain.min(1.0 - plan.depth.min(0.99)),
            None => {}
        }
        let mut products = clean_from(&mut imager, &options, &mut self.tools, from, observer)?;
        let place = Place::of(&imager);
        drop(imager);
        if let Some(before) = state {
            products.components = joined(before.products.components.iter().cloned().chain(products.components));
        }
        let epsilon =
            if plan.last { self.imaging.epsilon } else { (self.tuning.predicted_epsilon * plan.depth).min(1e-3).max(self.imaging.epsilon) };
        self.hold(place, products, epsilon)
    }

    fn remember(&mut self) {
        self.best.clone_from(&self.now);
    }

    fn recall(&mut self) {
        if self.best.is_some() {
            self.now.clone_from(&self.best);
            self.predicted.clear();
        }
    }
}
impl CleanMaker {
    /// Give `use_it` the unpolarised model of some rows \[row, chan\]. It is made where it is not known, and kept for the next image.
    fn with_one<R>(
        &mut self,
        (header, first_row, coverage): (&VisibilityHeader, usize, &UvCoverage),
        use_it: impl FnOnce(ArrayView2<'_, Complex<f32>>) -> R,
    ) -> Result<R> {
        let Some(state) = &mut self.now else {
            return Err(ChainError::NoData("there is no model yet: make an image first".into()));
        };
        let places = coverage.uvw_m.view();
        if let Some(known) = self.predicted.of(first_row, places) {
            return Ok(use_it(known));
        }
        let made = state.one(header, coverage)?;
        if let Some(not_kept) = self.predicted.keep(first_row, places, made) {
            return Ok(use_it(not_kept.view()));
        }
        let kept = self.predicted.of(first_row, places);
        kept.map(use_it).ok_or_else(|| ChainError::Internal("a prediction that is not kept".into()))
    }
}

impl ModelVisibilities for CleanMaker {
    fn predict(&mut self, header: &VisibilityHeader, first_row: usize, coverage: &UvCoverage) -> Result<Array3<Complex<f32>>> {
        self.with_one((header, first_row, coverage), |one| of_products(one, header))
    }

    fn predict_some(
        &mut self,
        header: &VisibilityHeader,
        (first_row, coverage): (usize, &UvCoverage),
        rows: &[usize],
    ) -> Result<Array3<Complex<f32>>> {
        // The next image needs the model of all rows.
        self.with_one((header, first_row, coverage), |one| of_products(selected(one, rows).view(), header))
    }
}

impl Unpolarized for State {
    fn one(&mut self, header: &VisibilityHeader, coverage: &UvCoverage) -> Result<Array2<Complex<f32>>> {
        let n_chan = header.spectrum.n_chan();
        if self.channels.last().map_or(0, |r| r.end) != n_chan {
            return Err(ChainError::Incompatible(format!("the model was made for another set, not for one of {n_chan} channels")));
        }
        let extent = self.extent.union(UvwExtent::of(coverage.uvw_m.view()));
        if extent != self.extent {
            let freq = header.spectrum.freq_hz();
            let made = Predictors::new(&self.products.model, &self.channels, freq, extent, &self.grid_options)?;
            (self.extent, self.predictors) = (extent, Arc::new(made));
        }
        // Rows whose u, v, w are not finite have no model. They are predicted at the origin and then set to NaN.
        let lost: Vec<usize> =
            (0..coverage.n_rows()).into_par_iter().filter(|r| coverage.uvw_m.row(*r).iter().any(|x| !x.is_finite())).collect();
        let mut uvw_m = std::borrow::Cow::Borrowed(&coverage.uvw_m);
        lost.iter().for_each(|r| uvw_m.to_mut().row_mut(*r).fill(0.0));
        let mut one = cleared((coverage.n_rows(), n_chan));
        match &*self.predictors {
            Predictors::Single(p) => fill(p, &self.channels, uvw_m.view(), &mut one, |v| v)?,
            Predictors::Double(p) => fill(p, &self.channels, uvw_m.view(), &mut one, |v| Complex::new(v.re as f32, v.im as f32))?,
        }
        lost.iter().for_each(|r| one.row_mut(*r).fill(Complex::new(f32::NAN, f32::NAN)));
        Ok(one)
    }
}

impl Predictors {
    fn new(model: &Image, channels: &[Range<usize>], freq_hz: &[f64], extent: UvwExtent, options: &GridOptions) -> Result<Self> {
        Ok(if options.single_precision_suffices() {
            Self::Single(degridders(model, channels, freq_hz, extent, options)?)
        } else {
            Self::Double(degridders(model, channels, freq_hz, extent, options)?)
        })
    }
}

fn degridders<T: Real>(
    model: &Image,
    channels: &[Range<usize>],
    freq_hz: &[f64],
    extent: UvwExtent,
    options: &GridOptions,
) -> Result<Vec<Degridder<T>>> {
    let one = |(k, range): (usize, &Range<usize>)| {
        Degridder::new(&model.grid, flux(model, k).view(), &freq_hz[range.clone()], extent, options, None)
    };
    channels.iter().enumerate().map(one).collect()
}

/// Some rows of an array, which all threads copy.
fn selected(all: ArrayView2<'_, Complex<f32>>, rows: &[usize]) -> Array2<Complex<f32>> {
    let mut some = cleared((rows.len(), all.ncols()));
    some.axis_iter_mut(Axis(0)).into_par_iter().zip(rows).for_each(|(mut to, row)| to.assign(&all.row(*row)));
    some
}

/// Largest value above the constant that was added back.
fn peak(image: &Image) -> f64 {
    image.data.par_iter().copied().reduce(|| f64::NEG_INFINITY, f64::max) - image.pedestal_k.unwrap_or(0.0)
}

/// Flux in each pixel of an output channel, in the unit of the visibilities.
fn flux(model: &Image, channel: usize) -> Array2<f64> {
    let plane = model.data.slice(s![channel, 0, .., ..]);
    if model.unit != BrightnessUnit::Kelvin {
        return plane.to_owned();
    }
    let (grid, constant) = (&model.grid, model.pedestal_k.unwrap_or(0.0));
    Array2::from_shape_fn(plane.dim(), |(i, j)| {
        let (l, m) = (grid.l_at(j as f64), grid.m_at(i as f64));
        let n2 = 1.0 - l * l - m * m;
        // The solid angle of a cell of direction cosines is 1/n times that of a cell at the centre.
        if n2 > 0.0 { (plane[(i, j)] - constant) * grid.cell_sr() / n2.sqrt() } else { 0.0 }
    })
}

/// Write the prediction of each output channel into its channels, each value changed by `convert`.
fn fill<T: Real>(
    predictors: &[Degridder<T>],
    channels: &[Range<usize>],
    uvw_m: ArrayView2<'_, f64>,
    out: &mut Array2<Complex<f32>>,
    convert: impl Fn(Complex<T>) -> Complex<f32> + Sync,
) -> Result<()> {
    for (predictor, range) in predictors.iter().zip(channels) {
        predictor.predict_as(uvw_m, out.slice_mut(s![.., range.clone()]), &convert)?;
    }
    Ok(())
}

/// An array of zeros that all threads clear, because the first touch of new memory takes longer than what is written into it.
fn cleared((rows, columns): (usize, usize)) -> Array2<Complex<f32>> {
    let mut values = Vec::with_capacity(rows * columns);
    values.par_extend(rayon::iter::repeat_n(Complex::default(), rows * columns));
    Array2::from_shape_vec((rows, columns), values).unwrap_or_default()
}
