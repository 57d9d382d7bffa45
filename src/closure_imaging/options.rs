//! Options of closure imaging.

use super::gather::Average;
use super::penalty::PenaltyWeights;
use super::phase_term::PhaseForm;
use super::tuning::ClosureImagingControl;
use crate::closure::ClosureSet;
use crate::{ChainError, Result};
use cittert_arrays::Polarization;

/// A kind of data that the image must explain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Term {
    /// Amplitudes, the gains of the antennas integrated out where they have an error.
    Amplitude,
    /// Closure phases.
    ClosurePhase,
    /// Logarithms of closure amplitudes.
    LogClosureAmplitude,
    /// Complex visibilities, self-calibrated against the image of the other terms first.
    Visibility,
}

impl Term {
    /// All of them with their names on the command line.
    pub const ALL: [(&'static str, Self); 4] =
        [("amp", Self::Amplitude), ("cphase", Self::ClosurePhase), ("logcamp", Self::LogClosureAmplitude), ("vis", Self::Visibility)];

    /// Its name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(_, t)| *t == self).map_or("", |(n, _)| n)
    }
}

/// Read a list of terms such as `cphase,logcamp,amp=0.5`: names, and weights where they are not 1.
///
/// # Errors
/// An unknown name, one that occurs twice, a weight that is not positive, no term but `vis`.
pub fn parse_terms(text: &str) -> Result<Vec<(Term, f64)>> {
    let bad = |expected: String| ChainError::BadOption { option: "terms", value: format!("{text:?}"), expected };
    let mut terms: Vec<(Term, f64)> = Vec::new();
    for part in text.split(',').map(str::trim) {
        let (name, weight) = part.split_once('=').map_or((part, Ok(1.0)), |(n, w)| (n.trim(), w.trim().parse::<f64>()));
        let Some((_, term)) = Term::ALL.iter().find(|(n, _)| *n == name) else {
            return Err(bad("amp, cphase, logcamp and vis, with commas between, each with =WEIGHT where it is not 1".into()));
        };
        let weight = weight.ok().filter(|w| *w > 0.0 && w.is_finite()).ok_or_else(|| bad(format!("a positive weight for {name}")))?;
        if terms.iter().any(|(t, _)| t == term) {
            return Err(bad(format!("{name} once")));
        }
        terms.push((*term, weight));
    }
    Ok(terms)
}

/// Where the total flux of the image comes from.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum FluxFrom {
    /// Given, Jy.
    Given(f64),
    /// The one that the amplitudes make most likely, up to what the co-located antennas see.
    #[default]
    Likelihood,
}

/// Options of [`super::reconstruct`].
#[derive(Debug, Clone, PartialEq)]
pub struct ClosureImagingOptions {
    /// The product that is imaged.
    pub polarization: Polarization,
    /// What is averaged first.
    pub average: Average,
    /// Error of every visibility in parts of its amplitude, added in quadrature: what does not close, such as leakage.
    pub systematic: f64,
    /// Leave out shorter baselines, wavelengths.
    pub uv_min_wl: f64,
    /// Terms with their weights on chi squared a datum.
    pub terms: Vec<(Term, f64)>,
    /// Independent closures or all of them.
    pub set: ClosureSet,
    /// Form of chi squared of closure phases.
    pub form: PhaseForm,
    /// Standard deviation of the log gain of every antenna.
    pub gain_error: f64,
    /// Raise it for antennas whose data want more.
    pub learn_gain_error: bool,
    /// Columns and rows; chosen from the coverage where not given.
    pub size: Option<(usize, usize)>,
    /// Cell, rad; chosen from the coverage where not given.
    pub cell_rad: Option<f64>,
    /// The total flux.
    pub flux: FluxFrom,
    /// Width of the Gaussian prior, rad; fitted to the amplitudes where not given.
    pub prior_fwhm_rad: Option<f64>,
    /// Weights of the penalties.
    pub penalty: PenaltyWeights,
    /// Rounds of imaging, each from the smoothed image of the last.
    pub rounds: usize,
    /// Iterations of each round.
    pub iterations: usize,
    /// Rounds with complex visibilities, self-calibrated before each.
    pub selfcal_rounds: usize,
    /// Starts: the first from the prior, others from random images like it.
    pub starts: usize,
    /// Seed of the random starts.
    pub seed: u64,
    /// How field, prior and flux are chosen where they are not given.
    pub tuning: ClosureImagingControl,
}

impl Default for ClosureImagingOptions {
    fn default() -> Self {
        Self {
            polarization: Polarization::I,
            average: Average::Scans,
            systematic: 0.02,
            uv_min_wl: 0.0,
            terms: vec![(Term::Amplitude, 1.0), (Term::ClosurePhase, 1.0)],
            set: ClosureSet::Minimal,
            form: PhaseForm::OneMinusCos,
            gain_error: 0.1,
            learn_gain_error: true,
            size: None,
            cell_rad: None,
            flux: FluxFrom::Likelihood,
            prior_fwhm_rad: None,
            penalty: PenaltyWeights::default(),
            rounds: 4,
            iterations: 100,
            selfcal_rounds: 2,
            starts: 1,
            seed: 1,
            tuning: ClosureImagingControl::default(),
        }
    }
}

impl ClosureImagingOptions {
    /// Refuse values out of their range.
    ///
    /// # Errors
    /// A flux, width or error that is not positive, no round, no term but visibilities, an image too large for the direct transform.
    pub fn check(&self) -> Result<()> {
        let bad =
            |option: &'static str, value: String, expected: &str| Err(ChainError::BadOption { option, value, expected: expected.into() });
        if let FluxFrom::Given(f) = self.flux
            && !(f > 0.0 && f.is_finite())
        {
            return bad("flux", f.to_string(), "a positive flux");
        }
        if let Some(f) = self.prior_fwhm_rad
            && !(f > 0.0 && f.is_finite())
        {
            return bad("prior_fwhm_rad", f.to_string(), "a positive angle");
        }
        if let Some((n, m)) = self.size
            && !((4..=512).contains(&n) && (4..=512).contains(&m))
        {
            return bad("size", format!("{n}x{m}"), "4 to 512 cells a side for closure imaging");
        }
        for (option, value) in [
            ("gain_error", self.gain_error),
            ("penalty.entropy", self.penalty.entropy),
            ("penalty.tv", self.penalty.tv),
            ("penalty.tv2", self.penalty.tv2),
            ("uv_min_wl", self.uv_min_wl),
        ] {
            if !(value >= 0.0 && value.is_finite()) {
                return bad(option, value.to_string(), "a number of 0 or more");
            }
        }
        for (option, value) in [("rounds", self.rounds), ("iterations", self.iterations), ("starts", self.starts)] {
            if value == 0 {
                return bad(option, "0".into(), "1 or more");
            }
        }
        if !self.terms.iter().any(|(t, _)| *t != Term::Visibility) {
            return bad("terms", "vis alone".into(), "at least one of amp, cphase and logcamp, that the self-calibration can start from");
        }
        Ok(())
    }

    /// Weight of a term, 0 where it is not asked for.
    #[must_use]
    pub fn weight(&self, term: Term) -> f64 {
        self.terms.iter().find(|(t, _)| *t == term).map_or(0.0, |(_, w)| *w)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn terms_are_read_with_their_weights() {
        let terms = parse_terms("cphase, logcamp=2,amp=0.5").unwrap();
        assert_eq!(terms, [(Term::ClosurePhase, 1.0), (Term::LogClosureAmplitude, 2.0), (Term::Amplitude, 0.5)]);
        for bad in ["", "amp,phase", "amp=0", "amp=x", "amp,amp"] {
            assert!(parse_terms(bad).unwrap_err().to_string().contains("terms"), "{bad}");
        }
        assert!(Term::ALL.iter().all(|(n, t)| t.name() == *n));
    }

    #[test]
    fn impossible_wishes_are_refused_by_name() {
        let ok = ClosureImagingOptions::default();
        assert!(ok.check().is_ok());
        let cases = [
            (ClosureImagingOptions { flux: FluxFrom::Given(0.0), ..ok.clone() }, "flux"),
            (ClosureImagingOptions { prior_fwhm_rad: Some(-1.0), ..ok.clone() }, "prior_fwhm_rad"),
            (ClosureImagingOptions { size: Some((4096, 4096)), ..ok.clone() }, "size"),
            (ClosureImagingOptions { gain_error: f64::NAN, ..ok.clone() }, "gain_error"),
            (ClosureImagingOptions { rounds: 0, ..ok.clone() }, "rounds"),
            (ClosureImagingOptions { terms: vec![(Term::Visibility, 1.0)], ..ok.clone() }, "terms"),
        ];
        for (options, name) in cases {
            assert!(options.check().unwrap_err().to_string().contains(name), "{name}");
        }
    }
}
