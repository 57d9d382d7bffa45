//! From options to a plan in the units and on the grid of an imager.

use super::noise::{ASSUMED, Noise, noise_from_hands};
use super::options::{MemOptions, NoiseChoice, PriorChoice};
use super::tuning::MemTuning;
use crate::imaging::Imager;
use crate::progress::{Event, Observer};
use crate::values::{bad_value, need};
use crate::{ChainError, Result, ensure};
use cittert_arrays::{
    BOLTZMANN_J_PER_K, BrightnessUnit, Image, JANSKY_W_M2_HZ, Polarization, SPEED_OF_LIGHT_M_S, SkyGrid, VisUnit, VisibilitySource,
};
use ndarray::Array2;

/// Where the prior comes from.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Prior {
    /// Flat, with the given flux, or with the flux that the shortest baselines measure.
    #[default]
    Auto,
    /// Flat, in K for a set in K sr, and in Jy/pixel for a set in Jy.
    Flat(f64),
    /// An image \[m, l\] in that unit.
    Image(Array2<f64>),
    /// A first result with a flat prior, smoothed with twice the restoring beam.
    Smoothed,
}

/// The constraint on the total flux.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Flux {
    /// No constraint.
    #[default]
    Free,
    /// This total flux of the image, Jy or K sr.
    Total(f64),
    /// This visibility at zero spacing, in the unit of the data: the total flux without that of the pedestal.
    ZeroSpacing(f64),
}

/// The plan for an image of maximum entropy: the options, and what they mean for one set.
#[derive(Debug, Clone, Default)]
pub struct MemPlan {
    /// Solver, entropy, goals, weights of the penalties and map of uncertainties. Their prior, flux, noise and mask are not read.
    pub options: MemOptions,
    /// The prior.
    pub prior: Prior,
    /// The total flux.
    pub flux: Flux,
    /// Where the image may be bright \[m, l\].
    pub mask: Option<Array2<bool>>,
    /// The noise of the data.
    pub noise: Noise,
    /// Constants of the solvers.
    pub tuning: MemTuning,
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
    /// The noise that these options select, or the one that suits the weights of the data.
    ///
    /// # Errors
    /// The noise is not positive or has another unit than the data, the estimate needs two hands and the set has one, or the source fails.
    pub fn believed_noise(&self, source: &mut dyn VisibilitySource, observer: &dyn Observer) -> Result<Noise> {
        if let Some(NoiseChoice::Sigma(flux)) = self.noise {
            let sigma = flux.in_unit("noise", source.header().unit)?;
            let expected = "a positive noise: without noise chi squared has no expected value";
            need("noise", flux, sigma > 0.0 && sigma.is_finite(), expected)?;
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
            Some(_) if asked => {
                return Err(ChainError::NoData("the two hands do not differ, so the data hold no noise to estimate: give a noise".into()));
            }
            None if asked => {
                return bad_value("noise", "estimate", "a value: an estimate needs two parallel hands (RR and LL, or XX and YY)");
            }
            _ => {
                let text = format!(
                    "the weights are counts of samples, not 1/sigma^2, and nothing else tells the noise: {} % of the rms amplitude of the visibilities is assumed; give the noise if it is known",
                    100.0 * ASSUMED
                );
                observer.event(Event::Warning(&text));
                Noise::Assumed(ASSUMED)
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
        let pol = imager.options().pol;
        need(
            "pol",
            pol,
            pol == Polarization::I || pol.is_parallel_hand(),
            "I or a parallel hand: entropy is that of a positive image (clean takes Q, U and V)",
        )?;
        let unit = imager.header().unit;
        let flux = match (self.flux, self.zero_spacing) {
            (Some(f), _) => Flux::Total(f.in_unit("flux", unit)?),
            (None, Some(f)) => Flux::ZeroSpacing(f.in_unit("zero-spacing", unit)?),
            (None, None) => Flux::Free,
        };
        if let Flux::Total(f) = flux {
            need("flux", f, f > 0.0, "a positive total flux: entropy is that of a positive image")?;
        }
        let loaded = inputs.mask.is_some() || self.mask.is_none();
        ensure!(loaded, ChainError::Incompatible("the mask of maximum entropy must be loaded first".into()));
        let prior = match &self.prior {
            None => Prior::Auto,
            Some(choice) => choice.prior(inputs.prior, imager.grid(), unit, imager.header().spectrum.mean_hz())?,
        };
        Ok(MemPlan { options: self.clone(), prior, flux, mask: inputs.mask, noise, tuning: MemTuning::default() })
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
        need("prior", self, level > 0.0 && level.is_finite(), "a positive brightness: entropy is relative to it")?;
        Ok(Prior::Flat(level))
    }
}

/// Report where the noise is taken from, if it is not the weights.
pub fn announce_noise(noise: Noise, observer: &dyn Observer) {
    if let Noise::Factor(f) = noise {
        let text = format!(
            "the weights are counts of samples, not 1/sigma^2: the difference of the two hands gives a variance of {f:.4e} a count (the option noise overrides it)"
        );
        observer.event(Event::Note(&text));
    }
}
