//! Options of maximum entropy: one type for the library, the command line and the files of `run` and `study`.

use super::imager::{MemGoals, Method};
use super::noise::{Noise, noise_from_hands};
use super::pipeline::{Flux, MemPlan, Prior, announce_noise};
use super::regulariser::{ENTROPIES, Entry, entropy_by_name};
use super::tuning::MemTuning;
use super::uncertainty::Uncertainty;
use crate::imaging::Imager;
use crate::progress::{Event, Observer};
use crate::values::{DataFlux, bad_value, by_text};
use crate::{ChainError, Result};
use cittert_arrays::quantity::{FluxDensity, Temperature};
use cittert_arrays::{BOLTZMANN_J_PER_K, BrightnessUnit, Image, JANSKY_W_M2_HZ, SPEED_OF_LIGHT_M_S, SkyGrid, VisUnit, VisibilitySource};
use ndarray::Array2;
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
    #[cfg_attr(feature = "cli", arg(long, value_name = "NAME", default_value_t = MemOptions::default().entropy))]
    pub entropy: Entropy,
    /// Noise: weights (they are 1/sigma^2), estimate (from the difference of two parallel hands), or the standard deviation of the real
    /// part of a visibility, such as 5mJy or 1.4e-3Ksr [default: weights, or estimate where the weights are counts of samples].
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
    pub uncertainty: UncertaintyChoice,
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
            entropy: Entropy(&ENTROPIES[0]),
            noise: None,
            chi2: goals.chi2,
            tolerance: goals.chi2_tolerance,
            kkt: goals.kkt,
            total_variation: 0.0,
            l1: 0.0,
            mask: None,
            uncertainty: UncertaintyChoice::Beam,
            seed: 1,
        }
    }
}

/// Files that the options name, once they are read.
#[derive(Debug, Default)]
pub struct MemInputs {
    /// The image of the prior.
    pub prior: Option<Image>,
    /// Where the image may be bright \[m, l\].
    pub mask: Option<Array2<bool>>,
}

impl MemOptions {
    /// Check what can be checked before any file is read.
    ///
    /// # Errors
    /// An option is out of its range.
    pub fn check(&self) -> Result<()> {
        if self.niter < 2 {
            return bad_value("niter", self.niter, "at least 2 evaluations");
        }
        for (field, value) in [("chi2", self.chi2), ("tolerance", self.tolerance), ("kkt", self.kkt)] {
            if !(value > 0.0 && value.is_finite()) {
                return bad_value(field, value, "a positive number");
            }
        }
        Ok(())
    }

    /// The noise that these options select, or the one that suits the weights of the data.
    ///
    /// # Errors
    /// The noise is not positive or has another unit than the data, the estimate needs two hands and the set has one, or the source fails.
    pub fn believed_noise(&self, source: &mut dyn VisibilitySource, observer: &dyn Observer) -> Result<Noise> {
        if let Some(NoiseChoice::Sigma(flux)) = self.noise {
            let sigma = flux.in_unit("noise", source.header().unit)?;
            if !(sigma > 0.0 && sigma.is_finite()) {
                return bad_value("noise", flux, "a positive noise: without noise chi squared has no expected value");
            }
            return Ok(Noise::Sigma(sigma));
        }
        if self.noise == Some(NoiseChoice::Weights) {
            return Ok(Noise::Weights);
        }
        let asked = self.noise.is_some();
        let hands = noise_from_hands(source)?;
        if !asked && !hands.weights_are_counts {
            return Ok(Noise::Weights);
        }
        let noise = match hands.factor {
            Some(f) if f > 0.0 => Noise::Factor(f),
            Some(_) => {
                return Err(ChainError::NoData("the two hands do not differ, so the data hold no noise to estimate: give a noise".into()));
            }
            None if asked => {
                return bad_value("noise", "estimate", "a value: an estimate needs two parallel hands (RR and LL, or XX and YY)");
            }
            None => {
                let text = "the weights are counts of samples, not 1/sigma^2: chi squared has no known expected value; give a noise";
                observer.event(Event::Warning(text));
                Noise::Weights
            }
        };
        announce_noise(noise, observer);
        Ok(noise)
    }

    /// The plan for an imager, in its units and on its grid.
    ///
    /// # Errors
    /// A value that is out of range or in another unit than the data, a prior in an unknown unit.
    pub fn plan(&self, imager: &Imager<'_>, inputs: MemInputs, noise: Noise) -> Result<MemPlan> {
        self.check()?;
        let unit = imager.header().unit;
        let flux = match (self.flux, self.zero_spacing) {
            (Some(f), _) => Flux::Total(f.in_unit("flux", unit)?),
            (None, Some(f)) => Flux::ZeroSpacing(f.in_unit("zero-spacing", unit)?),
            (None, None) => Flux::Free,
        };
        if let Flux::Total(f) = flux
            && !(f > 0.0)
        {
            return bad_value("flux", f, "a positive total flux: entropy is that of a positive image");
        }
        if inputs.mask.is_none() && self.mask.is_some() {
            return Err(ChainError::Incompatible("the mask of maximum entropy must be loaded first".into()));
        }
        let prior = match &self.prior {
            None => Prior::Auto,
            Some(choice) => choice.prior(inputs.prior, imager.grid(), unit, imager.header().spectrum.mean_hz())?,
        };
        Ok(MemPlan {
            method: self.solver,
            entropy: self.entropy.0,
            prior,
            flux,
            goals: MemGoals {
                chi2: self.chi2,
                chi2_tolerance: self.tolerance,
                kkt: self.kkt,
                evaluations: self.niter,
                ..MemGoals::default()
            },
            mask: inputs.mask,
            noise,
            total_variation: self.total_variation,
            l1: self.l1,
            uncertainty: match self.uncertainty {
                UncertaintyChoice::None => Uncertainty::None,
                UncertaintyChoice::Beam => Uncertainty::Circulant,
                UncertaintyChoice::Probes(n) => Uncertainty::Probes(n, self.seed),
            },
            tuning: MemTuning::default(),
        })
    }
}

/// Form of the entropy: a row of the table of entropies.
#[derive(Debug, Clone, Copy)]
pub struct Entropy(pub &'static Entry);
by_text!(Entropy, "string", "relative, gull-skilling or log.");

impl PartialEq for Entropy {
    fn eq(&self, other: &Self) -> bool {
        self.0.name == other.0.name
    }
}

impl fmt::Display for Entropy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.0.name)
    }
}

impl FromStr for Entropy {
    type Err = ChainError;

    fn from_str(name: &str) -> Result<Self> {
        entropy_by_name(name).map(Self)
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

impl PriorChoice {
    /// The prior for an image on `grid` of data in `unit`; `image` is the file's content.
    ///
    /// # Errors
    /// The level is not positive, the image is on another grid or in another unit, or the file has not been read.
    pub fn prior(&self, image: Option<Image>, grid: &SkyGrid, unit: VisUnit, freq_hz: f64) -> Result<Prior> {
        // Rayleigh-Jeans: Jy a pixel for each kelvin.
        let jy_per_k = 2.0 * BOLTZMANN_J_PER_K * (freq_hz / SPEED_OF_LIGHT_M_S).powi(2) * grid.cell_sr() / JANSKY_W_M2_HZ;
        let kelvin = unit == VisUnit::KelvinSr;
        let level = match self {
            Self::Smoothed => return Ok(Prior::Smoothed),
            Self::Temperature(t) => t.si() * if kelvin { 1.0 } else { jy_per_k },
            Self::FluxDensity(s) => s.si() / if kelvin { jy_per_k } else { 1.0 },
            Self::File(path) => {
                let wrong = |why: String| ChainError::Incompatible(format!("{}: {why}", path.display()));
                let image = image.ok_or_else(|| wrong("the prior must be loaded first".into()))?;
                crate::fidelity::check_alignment(&image.grid, grid).map_err(|e| wrong(format!("the prior does not fit the image: {e}")))?;
                let factor = match (image.unit, kelvin) {
                    (BrightnessUnit::Kelvin, true) | (BrightnessUnit::JyPerPixel, false) => 1.0,
                    (BrightnessUnit::Kelvin, false) => jy_per_k,
                    (BrightnessUnit::JyPerPixel, true) => 1.0 / jy_per_k,
                    (other, _) => return Err(wrong(format!("the prior is in {}, expected K or Jy/pixel", other.bunit()))),
                };
                return Ok(Prior::Image(image.plane(0, 0).mapv(|v| v * factor)));
            }
        };
        if !(level > 0.0 && level.is_finite()) {
            return bad_value("prior", self, "a positive brightness: entropy is relative to it");
        }
        Ok(Prior::Flat(level))
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
by_text!(NoiseChoice, "string", "weights, estimate, or a standard deviation in the unit of the data such as \"5mJy\".");

impl fmt::Display for NoiseChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Weights => f.write_str("weights"),
            Self::Estimate => f.write_str("estimate"),
            Self::Sigma(flux) => flux.fmt(f),
        }
    }
}

impl FromStr for NoiseChoice {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        match text {
            "weights" => Ok(Self::Weights),
            "estimate" => Ok(Self::Estimate),
            _ => text.parse().map(Self::Sigma).map_err(|e| format!("{e}; or weights, or estimate")),
        }
    }
}

/// How the map of uncertainties is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum UncertaintyChoice {
    /// No map.
    None,
    /// From the circulant approximation next to the beam.
    Beam,
    /// From this number of random probes.
    Probes(usize),
}
by_text!(UncertaintyChoice, ["string", "integer"], "none, beam, or a number of random probes up to 10000.");

impl fmt::Display for UncertaintyChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::None => f.write_str("none"),
            Self::Beam => f.write_str("beam"),
            Self::Probes(n) => n.fmt(f),
        }
    }
}

impl FromStr for UncertaintyChoice {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        match (text, text.parse::<usize>()) {
            ("none", _) | (_, Ok(0)) => Ok(Self::None),
            ("beam", _) => Ok(Self::Beam),
            (_, Ok(n)) if n <= 10_000 => Ok(Self::Probes(n)),
            _ => Err(format!("{text:?} is not a map: use none, beam or a number of probes up to 10000")),
        }
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::QuasiNewton => "quasi-newton",
            Self::Vtess => "vtess",
        })
    }
}
