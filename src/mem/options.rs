//! Options of maximum entropy: one type for the library, the command line and the files of `run` and `study`.

use super::imager::Method;
use super::regulariser::Entropy;
use super::solver::MemGoals;
use super::uncertainty::Uncertainty;
use crate::Result;
use crate::values::{DataFlux, by_text, need, word_or_quantity};
use cittert_arrays::quantity::{FluxDensity, Temperature};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

/// Options of maximum entropy.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args, schemars::JsonSchema))]
#[cfg_attr(feature = "cli", command(next_help_heading = "MEM"))]
pub struct MemOptions {
    /// Prior: a temperature (250K), a flux density in a pixel (1mJy), a FITS image on the grid of the image, or smoothed (a first result,
    /// smoothed) [default: flat, with the flux that the shortest baselines see].
    #[cfg_attr(feature = "cli", arg(long, value_name = "PRIOR"))]
    pub prior: Option<PriorChoice>,
    /// Total flux of the image, such as 2.5Jy, or 15.7Ksr for a set in K sr.
    #[cfg_attr(feature = "cli", arg(long, value_name = "F", conflicts_with = "zero_spacing"))]
    pub flux: Option<DataFlux>,
    /// Visibility at zero spacing. It differs from the total flux where a pedestal was subtracted from the scene.
    #[cfg_attr(feature = "cli", arg(long, value_name = "F"))]
    pub zero_spacing: Option<DataFlux>,
    /// The solver: quasi-newton, or vtess (Cornwell & Evans 1985).
    #[cfg_attr(feature = "cli", arg(long, value_name = "NAME", value_enum, hide_possible_values = true, default_value_t = MemOptions::default().solver))]
    pub solver: Method,
    /// Largest number of evaluations of the data term.
    #[cfg_attr(feature = "cli", arg(long, value_name = "N", default_value_t = MemOptions::default().niter))]
    pub niter: usize,
    /// Form of the entropy: relative, gull-skilling or log.
    #[cfg_attr(feature = "cli", arg(long, value_name = "NAME", value_enum, hide_possible_values = true, default_value_t = MemOptions::default().entropy))]
    pub entropy: Entropy,
    /// Noise: weights (they are 1/sigma^2), estimate (from the difference of two parallel hands), or the standard deviation of the real
    /// part of a visibility, such as 5mJy or 1.4e-3Ksr [default: weights; where these are only counts of samples, estimate; where there is only
    /// one hand too, 1 % of the rms amplitude].
    #[cfg_attr(feature = "cli", arg(long, value_name = "X"))]
    pub noise: Option<NoiseChoice>,
    /// Chi squared to reach, over its expected value.
    #[cfg_attr(feature = "cli", arg(long, value_name = "X", default_value_t = MemOptions::default().chi2))]
    pub chi2: f64,
    /// Largest relative departure of chi squared from that value.
    #[cfg_attr(feature = "cli", arg(long, value_name = "X", default_value_t = MemOptions::default().tolerance))]
    pub tolerance: f64,
    /// Largest KKT residual: length of the gradient over the sum of the lengths of its two sides.
    #[cfg_attr(feature = "cli", arg(long, value_name = "X", default_value_t = MemOptions::default().kkt))]
    pub kkt: f64,
    /// How far neighbours are expected to be alike: none (entropy alone), auto (as far as the data ask for it, where the set says through which
    /// pattern its elements saw the scene; not with vtess), or the rms by which a smooth scene is expected to vary, such as 30K.
    #[cfg_attr(feature = "cli", arg(long, value_name = "HOW", default_value_t = MemOptions::default().smoothness))]
    pub smoothness: SmoothnessChoice,
    /// Weight of the total variation against the entropy.
    #[cfg_attr(feature = "cli", arg(long, value_name = "X", default_value_t = MemOptions::default().total_variation))]
    pub total_variation: f64,
    /// Weight of the l1 norm against the entropy.
    #[cfg_attr(feature = "cli", arg(long, value_name = "X", default_value_t = MemOptions::default().l1))]
    pub l1: f64,
    /// FITS image on the grid of the image. The image is bright only where the mask is above 0.
    #[cfg_attr(feature = "cli", arg(long, value_name = "FITS"))]
    pub mask: Option<PathBuf>,
    /// Map of uncertainties: none, beam (from the circulant approximation next to the beam) or a number of random probes of the Hessian.
    #[cfg_attr(feature = "cli", arg(long, value_name = "HOW", default_value_t = MemOptions::default().uncertainty))]
    pub uncertainty: Uncertainty,
    /// Seed of the random probes.
    #[cfg_attr(feature = "cli", arg(long, value_name = "N", default_value_t = MemOptions::default().seed))]
    pub seed: u64,
}

impl Default for MemOptions {
    fn default() -> Self {
        let goals = MemGoals::default();
        Self {
            prior: None,
            flux: None,
            zero_spacing: None,
            solver: Method::QuasiNewton,
            niter: goals.evaluations,
            entropy: Entropy::Relative,
            noise: None,
            chi2: goals.chi2,
            tolerance: goals.chi2_tolerance,
            kkt: goals.kkt,
            smoothness: SmoothnessChoice::Auto,
            total_variation: 0.0,
            l1: 0.0,
            mask: None,
            uncertainty: Uncertainty::Beam,
            seed: 1,
        }
    }
}

impl MemOptions {
    /// Check what can be checked before any file is read.
    ///
    /// # Errors
    /// An option is out of its range.
    pub fn check(&self) -> Result<()> {
        need("niter", self.niter, self.niter >= 2, "at least 2 evaluations")?;
        for (field, value) in [("chi2", self.chi2), ("tolerance", self.tolerance), ("kkt", self.kkt)] {
            need(field, value, value > 0.0 && value.is_finite(), "a positive number")?;
        }
        for (field, value) in [("total-variation", self.total_variation), ("l1", self.l1)] {
            need(field, value, value >= 0.0 && value.is_finite(), "a weight of 0 or more")?;
        }
        if let SmoothnessChoice::Varies(rms) = self.smoothness {
            need("smoothness", rms, rms.si() > 0.0 && rms.si().is_finite(), "auto, none, or a positive temperature such as 30K")?;
        }
        Ok(())
    }

    /// The goals of the solver.
    #[must_use]
    pub fn goals(&self) -> MemGoals {
        let goals = MemGoals::default();
        MemGoals { chi2: self.chi2, chi2_tolerance: self.tolerance, kkt: self.kkt, evaluations: self.niter, ..goals }
    }
}

/// Where the prior comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum PriorChoice {
    /// A first result with a flat prior, smoothed.
    Smoothed,
    /// Flat, of this temperature.
    Temperature(Temperature),
    /// Flat, of this flux density in a pixel.
    FluxDensity(FluxDensity),
    /// A FITS image.
    File(PathBuf),
}
by_text!(PriorChoice, "string", "A temperature such as \"250K\", a flux density in a pixel such as \"1mJy\", a FITS image, or smoothed.");

impl fmt::Display for PriorChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Smoothed => f.write_str("smoothed"),
            Self::Temperature(t) => t.fmt(f),
            Self::FluxDensity(s) => s.fmt(f),
            Self::File(path) => path.display().fmt(f),
        }
    }
}

impl FromStr for PriorChoice {
    type Err = std::convert::Infallible;

    fn from_str(text: &str) -> std::result::Result<Self, Self::Err> {
        Ok(match (text, text.parse(), text.parse()) {
            ("smoothed", _, _) => Self::Smoothed,
            (_, Ok(t), _) => Self::Temperature(t),
            (_, _, Ok(s)) => Self::FluxDensity(s),
            _ => Self::File(text.into()),
        })
    }
}

/// Which noise is believed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NoiseChoice {
    /// The weights are 1/sigma^2.
    Weights,
    /// From the difference of two parallel hands.
    Estimate,
    /// This standard deviation of the real part of a visibility.
    Sigma(DataFlux),
}
word_or_quantity!(
    NoiseChoice,
    "weights" => Weights,
    "estimate" => Estimate,
    Sigma(DataFlux),
    "weights, estimate, or a standard deviation in the unit of the data such as \"5mJy\"."
);

/// Whether neighbours are expected to be alike.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum SmoothnessChoice {
    /// As far as the data ask for it, where the elements have a pattern.
    #[default]
    Auto,
    /// Pixels are independent.
    None,
    /// The scene is smooth and varies by this rms.
    Varies(Temperature),
}
word_or_quantity!(
    SmoothnessChoice,
    "auto" => Auto,
    "none" => None,
    Varies(Temperature),
    "auto, none, or the rms by which the scene is expected to vary, such as \"30K\"."
);
