//! The result of CLEAN: images, components and statistics.

use super::clock::Clock;
use super::components::{CleanComponent, joined};
use super::imager::{Imager, Residual};
use super::output::Kind;
use super::restore::with_beam;
use crate::Result;
use crate::deconvolve::Component;
use cittert_arrays::{Image, RestoringBeam};
use ndarray::Array2;
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
pub(super) struct Channel {
    pub(super) psf: Array2<f64>,
    pub(super) beam: RestoringBeam,
    pub(super) dirty: Array2<f64>,
    pub(super) model: Array2<f64>,
    pub(super) residual: Residual,
    pub(super) components: Vec<Component>,
    /// Flux that was added to raise the model to its floor \[m, l\].
    pub(super) given_back: Array2<f64>,
    pub(super) stop: StopReason,
    pub(super) major: usize,
}

/// Make the products of all output channels.
pub(super) fn products(imager: &Imager<'_>, channels: Vec<Channel>, mut clock: Clock) -> Result<CleanProducts> {
    let grid = imager.grid().clone();
    let beams: Vec<RestoringBeam> = channels.iter().map(|c| c.beam).collect();
    let restored: Vec<Array2<f64>> =
        clock.time("restore", || channels.iter().map(|c| with_beam(&grid, c.model.view(), &c.beam) + &c.residual.image).collect());
    let mut statistics = CleanStatistics {
        stop: channels.iter().map(|c| c.stop).collect(),
        iterations: channels.iter().map(|c| c.components.len()).sum(),
        major_cycles: channels.iter().map(|c| c.major).sum(),
        residual_rms: 0.0,
        residual_peak: 0.0,
        model_flux: channels.iter().map(|c| c.model.sum()).sum::<f64>() / channels.len() as f64,
        dynamic_range: 0.0,
        chi2_per_datum: channels.iter().map(|c| c.residual.chi2_per_datum).sum::<f64>() / channels.len() as f64,
        seconds: clock.0,
    };
    let mut components = Vec::new();
    let (mut psfs, mut dirties, mut models, mut residuals) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (channel, c) in channels.into_iter().enumerate() {
        let back = c.given_back.indexed_iter().filter(|(_, f)| **f != 0.0);
        let back = back.map(|((row, column), flux)| Component::point(row, column, *flux));
        components.extend(c.components.into_iter().chain(back).map(|c| CleanComponent::on(&grid, channel, c)));
        psfs.push(c.psf);
        dirties.push(c.dirty);
        models.push(c.model);
        residuals.push(c.residual.image);
    }
    let residual = imager.image(residuals, Kind::Residual, &beams)?;
    let restored = imager.image(restored, Kind::Restored, &beams)?;
    statistics.residual_rms = (residual.data.iter().map(|v| v * v).sum::<f64>() / residual.data.len() as f64).sqrt();
    statistics.residual_peak = residual.data.iter().fold(0.0, |a, v| a.max(v.abs()));
    let top = restored.data.iter().copied().fold(f64::NEG_INFINITY, f64::max) - restored.pedestal_k.unwrap_or(0.0);
    statistics.dynamic_range = top / statistics.residual_rms.max(f64::MIN_POSITIVE);
    Ok(CleanProducts {
        psf: imager.image(psfs, Kind::Psf, &beams)?,
        dirty: imager.image(dirties, Kind::Dirty, &beams)?,
        model: imager.image(models, Kind::Model, &beams)?,
        residual,
        restored,
        components: joined(components),
        statistics,
        beams,
    })
}
