//! Options of maximum entropy.

use crate::cli::failure::{Context as _, Failure, Result};
use crate::imaging::Imager;
use crate::mem::regulariser::entropy_by_name;
use crate::mem::{Flux, MemGoals, MemOptions, Method, Noise, Prior, Uncertainty};
use cittert_arrays::quantity::{FluxDensity, Temperature};
use cittert_arrays::{BrightnessUnit, SPEED_OF_LIGHT_M_S, SkyGrid, VisUnit};
use clap::{Args, ValueEnum};
use ndarray::Array2;
use std::path::Path;

/// Boltzmann's constant, J/K.
const BOLTZMANN: f64 = 1.380_649e-23;
/// W m^-2 Hz^-1 of 1 Jy.
const JANSKY: f64 = 1e-26;

/// How to make an image of maximum entropy.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "MEM")]
pub struct MemArgs {
    /// Prior: a temperature (250K), a flux density a pixel (1mJy), a FITS image on the same grid, or smoothed, which is a first result
    /// smoothed [default: flat, with the flux that the shortest baselines see].
    #[arg(long, value_name = "PRIOR")]
    prior: Option<String>,
    /// Total flux to keep, such as 2.5Jy, or 15.7Ksr for a set in K sr.
    #[arg(long, value_name = "F", conflicts_with = "zero_spacing")]
    flux: Option<String>,
    /// Visibility at zero spacing to keep; it differs from the total flux where a pedestal was removed from the scene.
    #[arg(long, value_name = "F")]
    zero_spacing: Option<String>,
    /// quasi-newton or vtess (Cornwell & Evans).
    #[arg(long, value_name = "NAME", default_value = "quasi-newton")]
    solver: SolverName,
    /// Largest number of evaluations of the data term.
    #[arg(long, value_name = "N", default_value_t = 150)]
    niter: usize,
    /// relative, gull-skilling or log.
    #[arg(long, value_name = "NAME", default_value = "relative")]
    entropy: String,
    /// Noise: weights (they are 1/sigma^2), estimate (from the difference of two hands), or the standard deviation of the real part of a
    /// visibility, such as 5mJy or 1.4e-3Ksr [default: weights, or estimate where they are counts of samples].
    #[arg(long, value_name = "X")]
    noise: Option<String>,
    /// Chi squared over its expected value to aim at.
    #[arg(long, value_name = "X", default_value_t = 1.0)]
    chi2: f64,
    /// Largest relative departure from it.
    #[arg(long, value_name = "X", default_value_t = 0.008)]
    tolerance: f64,
    /// Largest KKT residual: length of the gradient over the sum of the lengths of its two sides.
    #[arg(long, value_name = "X", default_value_t = 1e-3)]
    kkt: f64,
    /// Weight of the total variation beside the entropy.
    #[arg(long, value_name = "X", default_value_t = 0.0)]
    total_variation: f64,
    /// Weight of the l1 norm beside the entropy.
    #[arg(long, value_name = "X", default_value_t = 0.0)]
    l1: f64,
    /// FITS image on the same grid; brightness only where it is above 0.
    #[arg(long = "mask", value_name = "FITS")]
    mem_mask: Option<std::path::PathBuf>,
    /// Map of uncertainties: none, beam (from the circulant next to the beam) or a number of random probes of the Hessian.
    #[arg(long, value_name = "HOW", default_value = "beam")]
    uncertainty: String,
    /// Seed of the probes.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

/// The solvers by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum SolverName {
    /// Newton steps on the beam's Hessian in s, with I = s^2 / 4.
    QuasiNewton,
    /// Cornwell & Evans 1985.
    Vtess,
}

impl MemArgs {
    /// The total flux as it was given.
    #[must_use]
    pub fn flux_text(&self) -> Option<&str> {
        self.flux.as_deref()
    }

    /// The noise where it is given in words that need no data; `None` where it is to be chosen.
    #[must_use]
    pub fn noise_word(&self) -> Option<&str> {
        self.noise.as_deref()
    }

    /// The library's options for an imager, with the noise that was found.
    ///
    /// # Errors
    /// A value that cannot be read or is out of range, a prior or mask on another grid.
    pub fn options(&self, imager: &Imager<'_>, noise: Noise) -> Result<MemOptions> {
        let unit = imager.header().unit;
        let grid = imager.grid();
        if self.niter < 2 {
            return Err(Failure::usage(format!("--niter is {}, expected at least 2 evaluations", self.niter)));
        }
        for (option, value) in [("--chi2", self.chi2), ("--tolerance", self.tolerance), ("--kkt", self.kkt)] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(Failure::usage(format!("{option} is {value}, expected a positive number")));
            }
        }
        let flux = match (&self.flux, &self.zero_spacing) {
            (Some(f), _) => Flux::Total(in_data_unit("--flux", f, unit)?),
            (None, Some(f)) => Flux::ZeroSpacing(in_data_unit("--zero-spacing", f, unit)?),
            (None, None) => Flux::Free,
        };
        if let Flux::Total(f) = flux
            && !(f > 0.0)
        {
            return Err(Failure::message(format!("--flux is {f}, expected a positive total flux: entropy is that of a positive image")));
        }
        let frequency = imager.header().spectrum.mean_hz();
        Ok(MemOptions {
            method: match self.solver {
                SolverName::QuasiNewton => Method::QuasiNewton,
                SolverName::Vtess => Method::Vtess,
            },
            entropy: entropy_by_name(&self.entropy)?,
            prior: prior(self.prior.as_deref(), grid, (unit, frequency))?,
            flux,
            goals: MemGoals {
                chi2: self.chi2,
                chi2_tolerance: self.tolerance,
                kkt: self.kkt,
                evaluations: self.niter,
                ..MemGoals::default()
            },
            mask: self.mask(grid)?,
            noise,
            total_variation: self.total_variation,
            l1: self.l1,
            uncertainty: self.map()?,
            ..MemOptions::default()
        })
    }

    fn map(&self) -> Result<Uncertainty> {
        match (self.uncertainty.as_str(), self.uncertainty.parse::<usize>()) {
            ("none", _) | (_, Ok(0)) => Ok(Uncertainty::None),
            ("beam", _) => Ok(Uncertainty::Circulant),
            (_, Ok(n)) if n <= 10_000 => Ok(Uncertainty::Probes(n, self.seed)),
            (other, _) => Err(Failure::usage(format!("--uncertainty is {other:?}, expected none, beam or a number of probes up to 10000"))),
        }
    }

    fn mask(&self, grid: &SkyGrid) -> Result<Option<Array2<bool>>> {
        let Some(path) = &self.mem_mask else { return Ok(None) };
        let image = cittert_formats::open_image(path)?;
        crate::fidelity::check_alignment(&image.grid, grid).context(format!("{}: the mask does not fit the image", path.display()))?;
        let mask = image.plane(0, 0).mapv(|v| v > 0.0);
        if mask.iter().any(|x| *x) {
            return Ok(Some(mask));
        }
        Err(Failure::message(format!("{}: the mask leaves no pixel for the image: no value is above 0", path.display())))
    }
}

/// A prior in words: a temperature, a flux density a pixel, a FITS image on `grid`, or `smoothed`.
///
/// # Errors
/// A text that is none of these, a level that is not positive, an image on another grid or in another unit.
pub fn prior(text: Option<&str>, grid: &SkyGrid, (unit, freq_hz): (VisUnit, f64)) -> Result<Prior> {
    let Some(text) = text else { return Ok(Prior::Auto) };
    if text == "smoothed" {
        return Ok(Prior::Smoothed);
    }
    // Rayleigh-Jeans: Jy a pixel for each kelvin.
    let jy_per_k = 2.0 * BOLTZMANN * (freq_hz / SPEED_OF_LIGHT_M_S).powi(2) * grid.cell_sr() / JANSKY;
    let level = if let Ok(t) = text.parse::<Temperature>() {
        Some(t.si() * if unit == VisUnit::KelvinSr { 1.0 } else { jy_per_k })
    } else {
        text.parse::<FluxDensity>().ok().map(|f| f.si() / if unit == VisUnit::KelvinSr { jy_per_k } else { 1.0 })
    };
    if let Some(level) = level {
        if !(level > 0.0 && level.is_finite()) {
            return Err(Failure::message(format!("--prior is {text}, expected a positive brightness: entropy is relative to it")));
        }
        return Ok(Prior::Flat(level));
    }
    let path = Path::new(text);
    if !path.exists() {
        return Err(Failure::usage(format!(
            "--prior is {text:?}, expected a temperature such as 250K, a flux density a pixel such as 1mJy, a FITS image, or smoothed"
        )));
    }
    let image = cittert_formats::open_image(path)?;
    crate::fidelity::check_alignment(&image.grid, grid).context(format!("{text}: the prior does not fit the image"))?;
    let plane = image.plane(0, 0).to_owned();
    match (image.unit, unit) {
        (BrightnessUnit::Kelvin, VisUnit::KelvinSr) => Ok(Prior::Image(plane)),
        (BrightnessUnit::Kelvin, _) => Ok(Prior::Image(plane * jy_per_k)),
        (BrightnessUnit::JyPerPixel, VisUnit::KelvinSr) => Ok(Prior::Image(plane / jy_per_k)),
        (BrightnessUnit::JyPerPixel, _) => Ok(Prior::Image(plane)),
        (other, _) => Err(Failure::message(format!("{text}: the prior is in {}, expected K or Jy/pixel", other.bunit()))),
    }
}

/// `2.5Jy`, or `15.7Ksr` for data in K sr.
pub fn in_data_unit(option: &str, text: &str, unit: VisUnit) -> Result<f64> {
    if unit == VisUnit::KelvinSr {
        let number = ["Ksr", "K sr", "K.sr", "K*sr", "K str"].iter().find_map(|u| text.trim().strip_suffix(u));
        if let Some(value) = number.and_then(|n| n.trim().parse::<f64>().ok()) {
            return Ok(value);
        }
        return Err(Failure::usage(format!("{option} is {text:?}, expected a number with the unit of the data, such as 15.7Ksr")));
    }
    let flux = text.parse::<FluxDensity>();
    flux.map(|f| f.si()).map_err(|_| Failure::usage(format!("{option} is {text:?}, expected a flux density such as 2.5Jy")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fluxes_are_read_in_the_unit_of_the_data() {
        assert_eq!(in_data_unit("--flux", "15.7Ksr", VisUnit::KelvinSr).unwrap(), 15.7);
        assert_eq!(in_data_unit("--flux", "-1.5 K sr", VisUnit::KelvinSr).unwrap(), -1.5);
        assert!((in_data_unit("--flux", "250mJy", VisUnit::Jy).unwrap() - 0.25).abs() < 1e-12);
        assert!(in_data_unit("--flux", "15.7", VisUnit::KelvinSr).is_err());
        assert!(in_data_unit("--flux", "15.7Ksr", VisUnit::Jy).is_err());
    }
}
