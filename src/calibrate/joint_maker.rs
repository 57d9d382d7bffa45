//! The joint solution of image and gains as a model maker of self-calibration.
//!
//! The first image it is asked for is made together with gains of its own, from data whose gains nobody knows. The loop then solves
//! the gains against that image as against any other model, and the images of calibrated data only show what it leaves.

use super::clean_maker::CleanMaker;
use super::joint::{Joint, JointGoals, Lattice, joint};
use super::model::ModelVisibilities;
use super::options::SolveOptions;
use super::selfcal::{ModelMaker, ModelMetrics, RoundPlan};
use super::unknown_gains::{UnknownGains, UnknownGainsBuilder};
use crate::fourier::{Degridder, GridOptions, UvwExtent};
use crate::imaging::major::{CleanProducts, CleanStatistics, StopReason};
use crate::imaging::{Imager, ImagingOptions, Kind, with_beam};
use crate::mem::data::VisibilityTerm;
use crate::mem::regulariser::WeightedSum;
use crate::mem::{ChiSquared, Gathered, MemImager, MemOptions, Objective, Prior, flux_of_one, noise_from_hands, prepared, sum_inside};
use crate::progress::{Event, Observer};
use crate::{ChainError, Result};
use cittert_arrays::{Polarization, SPEED_OF_LIGHT_M_S, UvCoverage, VisUnit, VisibilityHeader, VisibilitySource, for_each_block};
use ndarray::{Array2, Array3, Axis};
use num_complex::Complex;
use std::sync::Arc;
use std::time::Instant;

/// Bytes of rows read at once.
const BLOCK_BYTES: usize = 64 << 20;
/// Error of the transforms of the joint solution.
const EPSILON: f64 = 1e-4;
/// Error of the predictions that gains are solved against.
const PREDICTED: f64 = 1e-5;

/// How the joint solution is made.
#[derive(Debug, Clone)]
pub struct JointOptions {
    /// What gains are solved for: mode, interval, channels and feeds.
    pub solve: SolveOptions,
    /// The prior.
    pub prior: Prior,
    /// Where the image may be bright \[m, l\].
    pub mask: Option<Array2<bool>>,
    /// When it is done; the noise is found where the weights are mere counts, whatever this says.
    pub goals: JointGoals,
}

/// Makes image and gains at once from the first data it sees, and shows what the image leaves of those that follow.
pub struct JointMaker {
    imaging: ImagingOptions,
    options: JointOptions,
    found: Option<(Joint, Array2<f64>)>,
    now: Option<CleanProducts>,
    best: Option<CleanProducts>,
    predictor: Option<(UvwExtent, Degridder<f32>)>,
}

impl JointMaker {
    /// A maker with these options.
    #[must_use]
    pub fn new(imaging: ImagingOptions, options: JointOptions) -> Self {
        Self { imaging, options, found: None, now: None, best: None, predictor: None }
    }

    /// Solve image and gains from data as they are.
    fn find(&mut self, data: &mut dyn VisibilitySource, observer: &dyn Observer) -> Result<(Joint, Array2<f64>)> {
        let counts = noise_from_hands(data)?.weights_are_counts;
        let mut builder = UnknownGainsBuilder::new(data.header(), &self.options.solve)?;
        let mut places: Vec<f64> = Vec::new();
        for_each_block(data, BLOCK_BYTES, |_, block| -> Result<()> {
            for row in builder.add(&block)? {
                places.extend(block.coverage.uvw_m.row(row));
            }
            Ok(())
        })?;
        let gains = Arc::new(builder.finish()?);
        let uvw_m = Array2::from_shape_fn((places.len() / 3, 3), |(r, k)| places[3 * r + k]);
        let freq_hz = data.header().spectrum.freq_hz().to_vec();
        let mut imager = Imager::new(data, self.imaging.clone(), observer)?;
        let one = flux_of_one(&imager);
        let pedestal = imager.header().pedestal_k.filter(|_| imager.header().unit == VisUnit::KelvinSr);
        let offset = pedestal.map(|t| &one * t);
        let inside = inside(&one, self.options.mask.clone());
        let prior = match &self.options.prior {
            Prior::Flat(t) => &one * *t,
            Prior::Image(image) => &one * image,
            Prior::Auto | Prior::Smoothed => {
                let hidden = offset.as_ref().map_or(0.0, |o| sum_inside(o, inside.as_ref()));
                // Amplitudes on the shortest baselines know the flux whatever the phases are.
                let seen = Gathered::new(&mut imager, 0, observer)?.flux_seen() + hidden;
                &one * (seen / sum_inside(&one, inside.as_ref()).max(f64::MIN_POSITIVE))
            }
        };
        let grid_options = GridOptions { epsilon: self.imaging.epsilon.max(EPSILON), w_term: self.imaging.w_term, divide_by_n: false };
        let term: Box<dyn VisibilityTerm> = Box::new(Arc::clone(&gains));
        let chi2 = ChiSquared::new(imager.grid(), &freq_hz, uvw_m.view(), &grid_options, vec![(1.0, term)])?;
        drop(imager);
        let objective = Objective { chi2, penalty: WeightedSum::default(), inside, offset, flux: None, beam: None, unit: 1.0 };
        let mut solver = prepared(objective, prior, &MemOptions::default())?;
        let goals = JointGoals { find_noise: counts, ..self.options.goals };
        let found = solved(&mut solver, &gains, (&uvw_m, &freq_hz), &goals, observer)?;
        let mut model = found.state.image.clone();
        if let Some(offset) = &solver.objective().offset {
            model -= offset;
        }
        Ok((found, model))
    }
}

fn solved(
    solver: &mut MemImager,
    gains: &UnknownGains,
    (uvw_m, freq_hz): (&Array2<f64>, &[f64]),
    goals: &JointGoals,
    observer: &dyn Observer,
) -> Result<Joint> {
    let lattice = |axis: usize| -> Vec<f64> {
        let column = uvw_m.column(axis);
        column.iter().flat_map(|x| freq_hz.iter().map(move |f| x * f / SPEED_OF_LIGHT_M_S)).collect()
    };
    let (u, v) = (lattice(0), lattice(1));
    let begun = Instant::now();
    let found = joint(solver, gains, Lattice { u: &u, v: &v }, goals, observer)?;
    let evaluations = found.state.evaluations;
    observer.event(Event::Note(&format!(
        "image and gains solved together in {evaluations} evaluations and {:.1} s, chi2/datum {:.3}",
        begun.elapsed().as_secs_f64(),
        found.state.chi2_per_datum / found.noise_factor.unwrap_or(1.0)
    )));
    Ok(found)
}

/// The mask without pixels behind the horizon, which show nothing.
fn inside(one: &Array2<f64>, mask: Option<Array2<bool>>) -> Option<Array2<bool>> {
    let mut mask = mask;
    if one.iter().any(|v| *v == 0.0) {
        let all = mask.get_or_insert_with(|| Array2::from_elem(one.dim(), true));
        ndarray::Zip::from(all).and(one).for_each(|m, v| *m &= *v > 0.0);
    }
    mask
}

/// A model maker with images to show.
pub trait ImageMaker: ModelMaker {
    /// Images of the present round: after the loop, those of the best.
    fn products(&self) -> Option<&CleanProducts>;

    /// How image and gains were solved together, by makers that do so.
    fn solution(&self) -> Option<&Joint> {
        None
    }
}

impl ImageMaker for CleanMaker {
    fn products(&self) -> Option<&CleanProducts> {
        Self::products(self)
    }
}

impl ImageMaker for JointMaker {
    fn products(&self) -> Option<&CleanProducts> {
        self.now.as_ref()
    }

    fn solution(&self) -> Option<&Joint> {
        self.found.as_ref().map(|f| &f.0)
    }
}

impl ModelMaker for JointMaker {
    fn update(&mut self, data: &mut dyn VisibilitySource, _plan: &RoundPlan, observer: &dyn Observer) -> Result<ModelMetrics> {
        if self.imaging.channels_out != 1 || self.imaging.polarization != Polarization::I {
            let expected = "one output channel of Stokes I in a joint solution of image and gains".into();
            return Err(ChainError::BadOption { option: "--channels-out", value: self.imaging.channels_out.to_string(), expected });
        }
        let found = match self.found.take() {
            Some(found) => found,
            None => self.find(data, observer)?,
        };
        let mut imager = Imager::new(data, self.imaging.clone(), observer)?;
        (self.imaging.size, self.imaging.cell_rad) = (Some((imager.grid().n_l, imager.grid().n_m)), Some(imager.grid().cell_rad));
        let products = show(&mut imager, &found.1, found.0.state.evaluations, observer)?;
        let s = &products.statistics;
        let peak = products.restored.data.iter().copied().fold(f64::NEG_INFINITY, f64::max) - products.restored.pedestal_k.unwrap_or(0.0);
        let metrics = ModelMetrics { peak, residual_rms: s.residual_rms, model_flux: s.model_flux, iterations: s.iterations };
        (self.found, self.now) = (Some(found), Some(products));
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

/// Images of a model and of what it leaves.
fn show(imager: &mut Imager<'_>, model: &Array2<f64>, evaluations: usize, observer: &dyn Observer) -> Result<CleanProducts> {
    let psf = imager.psf(0, observer)?;
    let beam = imager.beam_of(&psf)?;
    let dirty = imager.dirty(0, observer)?;
    let left = imager.residual(0, model.view(), observer)?;
    let restored = with_beam(imager.grid(), model.view(), &beam) + &left.image;
    let beams = vec![beam];
    let residual = imager.image(vec![left.image], Kind::Residual, &beams)?;
    let restored = imager.image(vec![restored], Kind::Restored, &beams)?;
    let residual_rms = (residual.data.iter().map(|v| v * v).sum::<f64>() / residual.data.len() as f64).sqrt();
    let top = restored.data.iter().copied().fold(f64::NEG_INFINITY, f64::max) - restored.pedestal_k.unwrap_or(0.0);
    let statistics = CleanStatistics {
        stop: vec![StopReason::Noise],
        iterations: evaluations,
        major_cycles: evaluations,
        residual_rms,
        residual_peak: residual.data.iter().fold(0.0, |a, v| a.max(v.abs())),
        model_flux: model.sum(),
        dynamic_range: top / residual_rms.max(f64::MIN_POSITIVE),
        chi2_per_datum: left.chi2_per_datum,
        seconds: std::collections::BTreeMap::new(),
    };
    Ok(CleanProducts {
        psf: imager.image(vec![psf], Kind::Psf, &beams)?,
        dirty: imager.image(vec![dirty], Kind::Dirty, &beams)?,
        model: imager.image(vec![model.clone()], Kind::Model, &beams)?,
        residual,
        restored,
        components: Vec::new(),
        statistics,
        beams,
    })
}

impl ModelVisibilities for JointMaker {
    fn predict(&mut self, header: &VisibilityHeader, _first_row: usize, coverage: &UvCoverage) -> Result<Array3<Complex<f32>>> {
        let (Some((_, model)), Some(products)) = (&self.found, &self.now) else {
            return Err(ChainError::NoData("there is no model yet: make an image first".into()));
        };
        // Rows without a place in the u-v plane have no model; they are predicted at the origin and then marked.
        let lost: Vec<usize> = (0..coverage.n_rows()).filter(|r| coverage.uvw_m.row(*r).iter().any(|x| !x.is_finite())).collect();
        let mut uvw_m = coverage.uvw_m.clone();
        lost.iter().for_each(|r| uvw_m.row_mut(*r).fill(0.0));
        let here = UvwExtent::of(uvw_m.view());
        let extent = self.predictor.as_ref().map_or(here, |p| p.0.union(here));
        if self.predictor.as_ref().is_none_or(|p| p.0 != extent) {
            let options = GridOptions { epsilon: PREDICTED, w_term: self.imaging.w_term, divide_by_n: false };
            let freq_hz = header.spectrum.freq_hz();
            self.predictor = Some((extent, Degridder::new(&products.model.grid, model.view(), freq_hz, extent, &options)?));
        }
        let mut one = Array2::from_elem((coverage.n_rows(), header.spectrum.n_chan()), Complex::new(0.0_f32, 0.0));
        if let Some((_, predictor)) = &self.predictor {
            predictor.predict(uvw_m.view(), one.view_mut())?;
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
