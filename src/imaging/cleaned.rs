//! The result of CLEAN: images, components and statistics.

use super::clock::Clock;
use super::components::{CleanComponent, joined};
use super::imager::{Imager, Residual};
use super::output::Kind;
use super::restore::with_beam;
use crate::deconvolve::Component;
use crate::{ChainError, Result};
use cittert_arrays::{Image, RestoringBeam};
use ndarray::{ArcArray2, Array2, ArrayView1, Axis, Zip};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// The reason why CLEAN stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopReason {
    /// The peak is at or below the threshold.
    Threshold,
    /// The peak is at or below the given multiple of the noise.
    Noise,
    /// All iterations are used.
    Iterations,
    /// All major cycles are used.
    MajorCycles,
    /// The residual grew. The state with the lowest peak is kept.
    Diverged,
    /// No component can be found in the residual.
    Nothing,
}

impl StopReason {
    /// A short name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Threshold => "threshold",
            Self::Noise => "nsigma",
            Self::Iterations => "niter",
            Self::MajorCycles => "major cycles",
            Self::Diverged => "diverged",
            Self::Nothing => "nothing left",
        }
    }
}

/// Statistics of a run of CLEAN.
#[derive(Debug, Clone, PartialEq)]
pub struct CleanStatistics {
    /// Why each output channel stopped.
    pub stop: Vec<StopReason>,
    /// Number of components in all output channels.
    pub iterations: usize,
    /// Number of major cycles in all output channels.
    pub major_cycles: usize,
    /// Rms of the residual, in the unit of the residual image.
    pub residual_rms: f64,
    /// Largest absolute residual.
    pub residual_peak: f64,
    /// Sum of the model over the pixels, averaged over the output channels: Jy, or K sr.
    pub model_flux: f64,
    /// Largest value of the restored image divided by the rms of the residual.
    pub dynamic_range: f64,
    /// Chi squared divided by the number of measured real numbers, averaged over the output channels.
    pub chi2_per_datum: f64,
    /// Wall-clock seconds of each stage.
    pub seconds: BTreeMap<&'static str, f64>,
}

/// The images, the components and the statistics of a run of CLEAN.
#[derive(Debug, Clone)]
pub struct CleanProducts {
    /// Dirty beam.
    pub psf: Image,
    /// Dirty image.
    pub dirty: Image,
    /// Model: flux per pixel, or kelvin.
    pub model: Image,
    /// Residual.
    pub residual: Image,
    /// The model convolved with the restoring beam, plus the residual.
    pub restored: Image,
    /// Components, brightest first. Components with the same position and scale are summed.
    pub components: Vec<CleanComponent>,
    /// Statistics of the run.
    pub statistics: CleanStatistics,
    /// Restoring beam of each output channel.
    pub beams: Vec<RestoringBeam>,
}

/// The state of one output channel.
#[derive(Debug)]
pub(crate) struct Channel {
    pub(super) psf: ArcArray2<f32>,
    pub(super) beam: RestoringBeam,
    pub(super) dirty: Array2<f32>,
    /// The final model \[m, l\]; until then it is empty.
    pub(super) model: Array2<f64>,
    pub(super) residual: Residual<f32>,
    pub(super) components: Vec<Component>,
    /// Flux that was added to raise the model to its floor.
    pub(super) given_back: Vec<Component>,
    pub(super) stop: StopReason,
    pub(super) major: usize,
}

/// A finished run whose images are not made yet.
#[derive(Debug)]
pub(crate) struct Cleaned {
    pub(super) channels: Vec<Channel>,
    pub(super) clock: Clock,
}

/// What a run of CLEAN tells besides its images.
#[derive(Debug)]
pub(crate) struct CleanReport {
    pub(crate) components: Vec<CleanComponent>,
    pub(crate) statistics: CleanStatistics,
    pub(crate) beams: Vec<RestoringBeam>,
}

impl Cleaned {
    /// Major cycles and components of all output channels.
    pub(crate) fn counts(&self) -> (usize, usize) {
        (self.channels.iter().map(|c| c.major).sum(), self.channels.iter().map(|c| c.components.len()).sum())
    }

    /// Only the model: the other images are not made.
    ///
    /// # Errors
    /// A model that does not fit the grid.
    pub(crate) fn into_model(self, imager: &Imager<'_>) -> Result<Image> {
        let beams: Vec<RestoringBeam> = self.channels.iter().map(|c| c.beam).collect();
        imager.image(self.channels.into_iter().map(|c| c.model).collect(), Kind::Model, &beams)
    }

    /// Make the images one after the other, and hand each to `take`: beam, dirty image, restored image, residual. The planes of an image are
    /// dropped with it. The model is returned.
    ///
    /// # Errors
    /// Those of `take`.
    pub(crate) fn deliver<E: From<ChainError>>(
        self,
        imager: &Imager<'_>,
        mut take: impl FnMut(Kind, Image<f32>) -> Result<(), E>,
    ) -> Result<(CleanReport, Image), E> {
        let (major_cycles, iterations) = self.counts();
        let Self { mut channels, mut clock } = self;
        let grid = imager.grid();
        let beams: Vec<RestoringBeam> = channels.iter().map(|c| c.beam).collect();
        let psfs = channels.iter_mut().map(|c| std::mem::take(&mut c.psf).into_owned()).collect();
        take(Kind::Psf, imager.image(psfs, Kind::Psf, &beams)?)?;
        let dirties = channels.iter_mut().map(|c| std::mem::take(&mut c.dirty)).collect();
        take(Kind::Dirty, imager.image(dirties, Kind::Dirty, &beams)?)?;
        let mut statistics = CleanStatistics {
            stop: channels.iter().map(|c| c.stop).collect(),
            iterations,
            major_cycles,
            residual_rms: 0.0,
            residual_peak: 0.0,
            model_flux: channels.iter().map(|c| c.model.sum()).sum::<f64>() / channels.len() as f64,
            dynamic_range: 0.0,
            chi2_per_datum: channels.iter().map(|c| c.residual.chi2_per_datum).sum::<f64>() / channels.len() as f64,
            seconds: BTreeMap::new(),
        };
        let restored = |c: &mut Channel| {
            let model = with_beam(grid, c.model.view(), &c.beam);
            Zip::from(&c.residual.image).and(&model).par_map_collect(|p, m| (f64::from(*p) + m) as f32)
        };
        let restored: Vec<Array2<f32>> = clock.time("restore", || channels.iter_mut().map(restored).collect());
        let restored = imager.image(restored, Kind::Restored, &beams)?;
        let top = f64::from(Sums::of(&restored).highest) - restored.pedestal_k.unwrap_or(0.0);
        take(Kind::Restored, restored)?;
        let residuals = channels.iter_mut().map(|c| std::mem::take(&mut c.residual.image)).collect();
        let residual = imager.image(residuals, Kind::Residual, &beams)?;
        let sums = Sums::of(&residual);
        statistics.residual_rms = (sums.squares / residual.data.len() as f64).sqrt();
        statistics.residual_peak = sums.farthest.into();
        statistics.dynamic_range = top / statistics.residual_rms.max(f64::MIN_POSITIVE);
        take(Kind::Residual, residual)?;
        let models = channels.iter_mut().map(|c| std::mem::take(&mut c.model)).collect();
        let model = imager.image(models, Kind::Model, &beams)?;
        statistics.seconds = clock.0;
        let of_channel = |(k, c): (usize, Channel)| {
            let all = c.components.into_iter().chain(c.given_back);
            all.map(move |one| CleanComponent::on(grid, k, one))
        };
        let components = joined(channels.into_iter().enumerate().flat_map(of_channel));
        Ok((CleanReport { components, statistics, beams }, model))
    }
}

/// What the statistics need of the pixels of an image.
struct Sums {
    highest: f32,
    /// Largest absolute value.
    farthest: f32,
    /// Sum of the squares.
    squares: f64,
}

impl Sums {
    fn of(image: &Image<f32>) -> Self {
        let of_line = |line: ArrayView1<'_, f32>| {
            line.iter().fold((f32::NEG_INFINITY, 0.0_f32, 0.0), |(high, far, sum), v| {
                (high.max(*v), far.max(v.abs()), sum + f64::from(*v).powi(2))
            })
        };
        // The lines are summed in their order, so that the result does not depend on the number of threads.
        let lines: Vec<_> = image.data.lanes(Axis(3)).into_iter().collect::<Vec<_>>().into_par_iter().map(of_line).collect();
        let add = |(high, far, sum): (f32, f32, f64), line: &(f32, f32, f64)| (high.max(line.0), far.max(line.1), sum + line.2);
        let (highest, farthest, squares) = lines.iter().fold((f32::NEG_INFINITY, 0.0, 0.0), add);
        Self { highest, farthest, squares }
    }
}

impl CleanProducts {
    /// All images of a finished run together.
    pub(super) fn of(run: Cleaned, imager: &Imager<'_>) -> Result<Self> {
        let mut images = Vec::new();
        let (CleanReport { components, statistics, beams }, model) = run.deliver(imager, |_, image| -> Result<()> {
            images.push(image.into());
            Ok(())
        })?;
        let images: [Image; 4] = images.try_into().map_err(|_| ChainError::Internal("CLEAN makes four images of the data".into()))?;
        let [psf, dirty, restored, residual] = images;
        Ok(Self { psf, dirty, model, residual, restored, components, statistics, beams })
    }
}
