//! CLEAN as the model maker of self-calibration: any deconvolver of the table, inside its major cycles.

use super::model::ModelVisibilities;
use super::selfcal::{ModelMaker, ModelMetrics, RoundPlan};
use crate::fourier::{Degridder, GridOptions, Real, UvwExtent};
use crate::imaging::major::CleanOptions;
use crate::imaging::{CleanProducts, Imager, ImagingOptions, clean};
use crate::progress::Observer;
use crate::{ChainError, Result};
use cittert_arrays::{BrightnessUnit, Image, Polarization, UvCoverage, VisibilityHeader, VisibilitySource};
use ndarray::{Array2, Array3, ArrayView2, Axis, s};
use num_complex::Complex;
use std::ops::Range;

/// Images and cleans the data of each round, and predicts from the model. The grid of the first round stays.
pub struct CleanMaker {
    imaging: ImagingOptions,
    clean: CleanOptions,
    now: Option<State>,
    best: Option<State>,
}

#[derive(Clone)]
struct State {
    products: CleanProducts,
    /// Channels of the set in each output channel.
    channels: Vec<Range<usize>>,
    extent: UvwExtent,
    predictors: std::sync::Arc<Predictors>,
}

/// Degridders of the output channels, in the precision that the error allows.
enum Predictors {
    Single(Vec<Degridder<f32>>),
    Double(Vec<Degridder<f64>>),
}

impl CleanMaker {
    /// A maker with these options. In each round `clean.threshold` is raised to the plan's depth times the peak of the round
    /// before, so that the model grows from round to round; the last round goes as deep as the options say.
    #[must_use]
    pub fn new(imaging: ImagingOptions, clean: CleanOptions) -> Self {
        Self { imaging, clean, now: None, best: None }
    }

    /// Images of the present round: after the loop, those of the best.
    #[must_use]
    pub fn products(&self) -> Option<&CleanProducts> {
        self.now.as_ref().map(|s| &s.products)
    }

    fn grid_options(&self) -> GridOptions {
        GridOptions { epsilon: self.imaging.epsilon, w_term: self.imaging.w_term, divide_by_n: false }
    }
}

impl ModelMaker for CleanMaker {
    fn update(&mut self, data: &mut dyn VisibilitySource, plan: &RoundPlan, observer: &dyn Observer) -> Result<ModelMetrics> {
        let freq_hz = data.header().spectrum.freq_hz().to_vec();
        let mut imager = Imager::new(data, self.imaging.clone(), observer)?;
        let grid = imager.grid().clone();
        (self.imaging.size, self.imaging.cell_rad) = (Some((grid.n_l, grid.n_m)), Some(grid.cell_rad));
        let mut options = self.clean.clone();
        if plan.depth > 0.0 {
            let peak = match &self.now {
                Some(state) => peak(&state.products.restored),
                // No component yet: the dirty image in its unit, and nothing else.
                None => peak(&clean(&mut imager, &CleanOptions { niter: 0, ..options.clone() }, observer)?.dirty),
            };
            options.threshold = options.threshold.max(plan.depth * peak);
        }
        let products = clean(&mut imager, &options, observer)?;
        let (channels, extent) = (imager.channels().to_vec(), imager.survey().extent);
        drop(imager);
        let predictors = std::sync::Arc::new(Predictors::new(&products.model, &channels, &freq_hz, extent, &self.grid_options())?);
        let statistics = &products.statistics;
        let metrics = ModelMetrics {
            peak: peak(&products.restored),
            residual_rms: statistics.residual_rms,
            model_flux: statistics.model_flux,
            iterations: statistics.iterations,
        };
        self.now = Some(State { products, channels, extent, predictors });
        Ok(metrics)
    }

    fn remember(&mut self) {
        self.best.clone_from(&self.now);
    }

    fn recall(&mut self) {
        if self.best.is_some() {
            self.now.clone_from(&self.best);
        }
    }
}

impl ModelVisibilities for CleanMaker {
    fn predict(&mut self, header: &VisibilityHeader, _first_row: usize, coverage: &UvCoverage) -> Result<Array3<Complex<f32>>> {
        let grid_options = self.grid_options();
        let Some(state) = &mut self.now else {
            return Err(ChainError::NoData("there is no model yet: make an image first".into()));
        };
        let n_chan = header.spectrum.n_chan();
        if state.channels.last().map_or(0, |r| r.end) != n_chan {
            return Err(ChainError::Incompatible(format!("the model was made for another set, not for one of {n_chan} channels")));
        }
        let extent = state.extent.union(UvwExtent::of(coverage.uvw_m.view()));
        if extent != state.extent {
            let freq = header.spectrum.freq_hz();
            let made = Predictors::new(&state.products.model, &state.channels, freq, extent, &grid_options)?;
            (state.extent, state.predictors) = (extent, std::sync::Arc::new(made));
        }
        // Rows without a place in the u-v plane have no model; they are predicted at the origin and then marked.
        let lost: Vec<usize> = (0..coverage.n_rows()).filter(|r| coverage.uvw_m.row(*r).iter().any(|x| !x.is_finite())).collect();
        let mut uvw_m = coverage.uvw_m.clone();
        lost.iter().for_each(|r| uvw_m.row_mut(*r).fill(0.0));
        let mut one = Array2::zeros((coverage.n_rows(), n_chan));
        match &*state.predictors {
            Predictors::Single(p) => fill(p, &state.channels, uvw_m.view(), &mut one)?,
            Predictors::Double(p) => fill(p, &state.channels, uvw_m.view(), &mut one)?,
        }
        lost.iter().for_each(|r| one.row_mut(*r).fill(Complex::new(f32::NAN, f32::NAN)));
        let mut vis = Array3::zeros(header.shape(coverage.n_rows()));
        for (p, pol) in header.polarizations.iter().enumerate() {
            if pol.is_parallel_hand() || *pol == Polarization::I {
                vis.index_axis_mut(Axis(2), p).assign(&one);
            }
        }
        Ok(vis)
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
    let one =
        |(k, range): (usize, &Range<usize>)| Degridder::new(&model.grid, flux(model, k).view(), &freq_hz[range.clone()], extent, options);
    channels.iter().enumerate().map(one).collect()
}

/// Largest value above the constant that was added back.
fn peak(image: &Image) -> f64 {
    image.data.iter().copied().fold(f64::NEG_INFINITY, f64::max) - image.pedestal_k.unwrap_or(0.0)
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
        // A cell of direction cosines sees 1/n of solid angle more than one at the centre.
        if n2 > 0.0 { (plane[(i, j)] - constant) * grid.cell_sr() / n2.sqrt() } else { 0.0 }
    })
}

fn fill<T: Real>(
    predictors: &[Degridder<T>],
    channels: &[Range<usize>],
    uvw_m: ArrayView2<'_, f64>,
    out: &mut Array2<Complex<f32>>,
) -> Result<()> {
    for (predictor, range) in predictors.iter().zip(channels) {
        let mut part = Array2::from_elem((uvw_m.nrows(), range.len()), Complex::new(T::default(), T::default()));
        predictor.predict(uvw_m, part.view_mut())?;
        let mut to = out.slice_mut(s![.., range.clone()]);
        ndarray::Zip::from(&mut to).and(&part).for_each(|o, v| *o = Complex::new(v.re.to64() as f32, v.im.to64() as f32));
    }
    Ok(())
}
