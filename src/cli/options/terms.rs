//! Options of images from closure quantities and amplitudes.

use crate::cli::failure::{Failure, Result};
use crate::closure::ClosureSet;
use crate::closure_imaging::{Average, ClosureImagingOptions, FluxFrom, PenaltyWeights, parse_terms};
use crate::imaging::ImagingOptions;
use cittert_arrays::quantity::{Angle, Duration};
use clap::{Args, ValueEnum};

/// What the image must explain where the antennas are not calibrated.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Closure quantities")]
pub struct TermsArgs {
    /// Image from these instead of from calibrated visibilities: cphase (closure phases), logcamp (log closure amplitudes), amp
    /// (amplitudes with uncertain antenna gains) and vis (complex, self-calibrated last), with commas between and =WEIGHT where it is not 1.
    #[arg(long, value_name = "LIST")]
    terms: Option<String>,
    /// Average before closure quantities are formed: scan, none (single integrations) or a time.
    #[arg(long, value_name = "scan|none|TIME", default_value = "scan")]
    average: String,
    /// Part of each amplitude by which its error is raised, in quadrature.
    #[arg(long, value_name = "X", default_value_t = 0.02)]
    systematic_noise: f64,
    /// Error of the antenna gains that is expected, in parts of 1; 0 takes amplitudes as calibrated.
    #[arg(long, value_name = "X", default_value_t = 0.1)]
    gain_error: f64,
    /// Keep the gain errors as given instead of raising those of antennas whose data want it.
    #[arg(long)]
    fixed_gain_error: bool,
    /// Independent closure quantities, or all of them with less weight each.
    #[arg(long, value_enum, default_value_t = Closures::Minimal)]
    closures: Closures,
    /// Width of the Gaussian prior [default: fitted to the amplitudes].
    #[arg(long, value_name = "ANGLE")]
    prior_fwhm: Option<Angle>,
    /// Leave out baselines shorter than this, wavelengths.
    #[arg(long, value_name = "N", default_value_t = 0.0)]
    uv_min: f64,
    /// Weights of the penalties that differ from entropy=0.5,tv=0.05,tv2=0.05,flux=50,centroid=0.5.
    #[arg(long, value_name = "LIST")]
    penalties: Option<String>,
    /// Rounds of imaging, each from the smoothed image of the last.
    #[arg(long, value_name = "N", default_value_t = 4)]
    closure_rounds: usize,
    /// Iterations of each round.
    #[arg(long, value_name = "N", default_value_t = 100)]
    round_niter: usize,
    /// Images from so many starts: the best is kept, and their scatter written.
    #[arg(long, value_name = "N", default_value_t = 1)]
    starts: usize,
    /// Seed of the random starts.
    #[arg(long, value_name = "N", default_value_t = 1)]
    start_seed: u64,
}

/// Which closure quantities.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Closures {
    /// Independent ones.
    Minimal,
    /// All.
    All,
}

impl TermsArgs {
    /// True where an image from closure quantities is asked for.
    #[must_use]
    pub fn asked(&self) -> bool {
        self.terms.is_some()
    }

    /// The library's options.
    ///
    /// # Errors
    /// A list, time or weight that cannot be read.
    pub fn options(&self, imaging: &ImagingOptions, flux: Option<f64>) -> Result<ClosureImagingOptions> {
        let average = match self.average.as_str() {
            "scan" => Average::Scans,
            "none" => Average::Integration,
            text => {
                Average::Seconds(text.parse::<Duration>().map_err(|e| Failure::usage(format!("--average: {e}, or scan or none")))?.si())
            }
        };
        let defaults = ClosureImagingOptions::default();
        let terms = self.terms.as_deref().map(parse_terms).transpose().map_err(|e| Failure::usage(e.to_string()))?;
        Ok(ClosureImagingOptions {
            polarization: imaging.polarization,
            average,
            systematic: self.systematic_noise,
            uv_min_wl: self.uv_min,
            terms: terms.unwrap_or(defaults.terms.clone()),
            set: if self.closures == Closures::All { ClosureSet::All } else { ClosureSet::Minimal },
            gain_error: self.gain_error,
            learn_gain_error: !self.fixed_gain_error,
            size: imaging.size,
            cell_rad: imaging.cell_rad,
            flux: flux.map_or(FluxFrom::Likelihood, FluxFrom::Given),
            prior_fwhm_rad: self.prior_fwhm.map(|a| a.si()),
            penalty: penalties(self.penalties.as_deref().unwrap_or_default())?,
            rounds: self.closure_rounds,
            iterations: self.round_niter,
            starts: self.starts,
            seed: self.start_seed,
            ..defaults
        })
    }
}

fn penalties(text: &str) -> Result<PenaltyWeights> {
    let mut weights = PenaltyWeights::default();
    for part in text.split(',').map(str::trim).filter(|p| !p.is_empty()) {
        let wrong =
            || Failure::usage(format!("--penalties: {part:?}, expected entropy, tv, tv2, flux or centroid with =WEIGHT of 0 or more"));
        let (name, value) = part.split_once('=').ok_or_else(wrong)?;
        let value = value.trim().parse::<f64>().ok().filter(|v| *v >= 0.0 && v.is_finite()).ok_or_else(wrong)?;
        let slot = match name.trim() {
            "entropy" => &mut weights.entropy,
            "tv" => &mut weights.tv,
            "tv2" => &mut weights.tv2,
            "flux" => &mut weights.flux,
            "centroid" => &mut weights.centroid,
            _ => return Err(wrong()),
        };
        *slot = value;
    }
    Ok(weights)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn penalties_are_read_by_name() {
        assert_eq!(penalties("").unwrap(), PenaltyWeights::default());
        assert_eq!(penalties("tv=2, entropy=0").unwrap(), PenaltyWeights { tv: 2.0, entropy: 0.0, ..PenaltyWeights::default() });
        for bad in ["tv", "tv=-1", "smooth=1", "tv=x"] {
            assert!(penalties(bad).unwrap_err().to_string().contains("--penalties"), "{bad}");
        }
    }
}
