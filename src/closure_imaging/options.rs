//! Options of closure imaging.

use super::gather::Average;
use super::penalty::PenaltyWeights;
use super::tuning::ClosureImagingControl;
use crate::closure::ClosureSet;
use crate::imaging::ImageSize;
use crate::values::{bad_value, by_text, need, word_or_quantity};
use crate::{ChainError, Result};
use cittert_arrays::Polarization;
use cittert_arrays::quantity::{Angle, Duration};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

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

/// Terms with their weights on chi squared a datum.
#[derive(Debug, Clone, PartialEq)]
pub struct Terms(pub Vec<(Term, f64)>);
by_text!(Terms, "string", "amp, cphase, logcamp and vis with commas between, each with =WEIGHT where it is not 1.");

impl fmt::Display for Terms {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let one = |(term, weight): &(Term, f64)| if *weight == 1.0 { term.name().to_owned() } else { format!("{}={weight}", term.name()) };
        f.write_str(&self.0.iter().map(one).collect::<Vec<_>>().join(","))
    }
}

impl FromStr for Terms {
    type Err = ChainError;

    /// Read a list such as `cphase,logcamp,amp=0.5`.
    ///
    /// # Errors
    /// An unknown name, one that occurs twice, a weight that is not positive.
    fn from_str(text: &str) -> Result<Self> {
        let bad = |expected: String| bad_value("terms", format!("{text:?}"), expected);
        let mut terms: Vec<(Term, f64)> = Vec::new();
        for part in text.split(',').map(str::trim) {
            let (name, weight) = part.split_once('=').map_or((part, Ok(1.0)), |(n, w)| (n.trim(), w.trim().parse::<f64>()));
            let Some((_, term)) = Term::ALL.iter().find(|(n, _)| *n == name) else {
                return bad("amp, cphase, logcamp and vis, with commas between, each with =WEIGHT where it is not 1".into());
            };
            let Some(weight) = weight.ok().filter(|w| *w > 0.0 && *w <= 1e6) else {
                return bad(format!("a positive weight of at most 1e6 for {name}"));
            };
            need("terms", format!("{text:?}"), terms.iter().all(|(t, _)| t != term), format!("{name} once"))?;
            terms.push((*term, weight));
        }
        Ok(Self(terms))
    }
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

/// Options of images from closure quantities and amplitudes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args, schemars::JsonSchema))]
#[cfg_attr(feature = "cli", command(next_help_heading = "Closure quantities"))]
pub struct ClosureImagingOptions {
    /// Image from these data instead of from calibrated visibilities: cphase (closure phases), logcamp (log closure amplitudes), amp
    /// (amplitudes with uncertain antenna gains) and vis (complex visibilities, self-calibrated last), with commas between and =WEIGHT
    /// where it is not 1.
    #[cfg_attr(feature = "cli", arg(long, value_name = "LIST"))]
    pub terms: Option<Terms>,
    /// Average before closure quantities are formed: over scans, over none (single integrations) or over a time.
    #[cfg_attr(feature = "cli", arg(long, value_name = "scan|none|TIME", default_value_t = ClosureImagingOptions::default().average))]
    pub average: Average,
    /// Error of every visibility as a fraction of its amplitude, added in quadrature. It stands for what does not close, such as leakage.
    #[serde(rename = "systematic-noise")]
    #[cfg_attr(feature = "cli", arg(long = "systematic-noise", value_name = "X", default_value_t = ClosureImagingOptions::default().systematic))]
    pub systematic: f64,
    /// Standard deviation of the log gain of every antenna. 0 takes amplitudes as calibrated.
    #[cfg_attr(feature = "cli", arg(long, value_name = "X", default_value_t = ClosureImagingOptions::default().gain_error))]
    pub gain_error: f64,
    /// Keep the gain errors as given. Otherwise those of antennas whose data need it are raised.
    #[cfg_attr(feature = "cli", arg(long))]
    pub fixed_gain_error: bool,
    /// Independent closure quantities, or all of them with less weight each.
    #[serde(rename = "closures")]
    #[cfg_attr(feature = "cli", arg(long = "closures", value_enum, default_value_t = ClosureImagingOptions::default().set))]
    pub set: ClosureSet,
    /// Full width at half maximum of the Gaussian prior [default: fitted to the amplitudes].
    #[cfg_attr(feature = "cli", arg(long, value_name = "ANGLE"))]
    pub prior_fwhm: Option<Angle>,
    /// Leave out baselines shorter than this number of wavelengths.
    #[serde(rename = "uv-min")]
    #[cfg_attr(feature = "cli", arg(long = "uv-min", value_name = "N", default_value_t = ClosureImagingOptions::default().uv_min_wl))]
    pub uv_min_wl: f64,
    /// Weights of the penalties. Those that are left out keep their default.
    #[serde(rename = "penalties")]
    #[cfg_attr(feature = "cli", arg(long = "penalties", value_name = "LIST", default_value_t = ClosureImagingOptions::default().penalty))]
    pub penalty: PenaltyWeights,
    /// Rounds of imaging, each from the smoothed image of the last.
    #[serde(rename = "closure-rounds")]
    #[cfg_attr(feature = "cli", arg(long = "closure-rounds", id = "closure-rounds", value_name = "N", default_value_t = ClosureImagingOptions::default().rounds))]
    pub rounds: usize,
    /// Iterations of each round.
    #[serde(rename = "round-niter")]
    #[cfg_attr(feature = "cli", arg(long = "round-niter", value_name = "N", default_value_t = ClosureImagingOptions::default().iterations))]
    pub iterations: usize,
    /// Number of starts: the first from the prior, others from random images like it. The best image is kept, and their scatter written.
    #[cfg_attr(feature = "cli", arg(long, value_name = "N", default_value_t = ClosureImagingOptions::default().starts))]
    pub starts: usize,
    /// Seed of the random starts.
    #[serde(rename = "start-seed")]
    #[cfg_attr(feature = "cli", arg(long = "start-seed", id = "start-seed", value_name = "N", default_value_t = ClosureImagingOptions::default().seed))]
    pub seed: u64,
    /// The product that is imaged.
    #[serde(skip)]
    #[cfg_attr(feature = "cli", arg(skip = Polarization::I))]
    pub polarization: Polarization,
    /// Columns and rows. `None`: chosen from the coverage.
    #[serde(skip)]
    #[cfg_attr(feature = "cli", arg(skip))]
    pub size: Option<ImageSize>,
    /// Cell. `None`: chosen from the coverage.
    #[serde(skip)]
    #[cfg_attr(feature = "cli", arg(skip))]
    pub cell: Option<Angle>,
    /// The total flux.
    #[serde(skip)]
    #[cfg_attr(feature = "cli", arg(skip))]
    pub flux: FluxFrom,
    /// Rounds with complex visibilities, self-calibrated before each.
    #[serde(skip)]
    #[cfg_attr(feature = "cli", arg(skip = ClosureImagingOptions::default().selfcal_rounds))]
    pub selfcal_rounds: usize,
    /// How field, prior and flux are chosen where they are not given.
    #[serde(skip)]
    #[cfg_attr(feature = "cli", arg(skip))]
    pub tuning: ClosureImagingControl,
}

impl Default for ClosureImagingOptions {
    fn default() -> Self {
        Self {
            terms: None,
            average: Average::Scans,
            systematic: 0.02,
            gain_error: 0.1,
            fixed_gain_error: false,
            set: ClosureSet::Minimal,
            prior_fwhm: None,
            uv_min_wl: 0.0,
            penalty: PenaltyWeights::default(),
            rounds: 4,
            iterations: 100,
            starts: 1,
            seed: 1,
            polarization: Polarization::I,
            size: None,
            cell: None,
            flux: FluxFrom::Likelihood,
            selfcal_rounds: 2,
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
        if let FluxFrom::Given(f) = self.flux {
            need("flux", f, f > 0.0 && f.is_finite(), "a positive flux")?;
        }
        if let Some(f) = self.prior_fwhm {
            need("prior-fwhm", f, f.si() > 0.0 && f.si().is_finite(), "a positive angle")?;
        }
        if let Some(size @ ImageSize { columns: n, rows: m }) = self.size {
            let good = (4..=512).contains(&n) && (4..=512).contains(&m);
            need("size", size, good, "4 to 512 cells a side for closure imaging")?;
        }
        for (option, value) in [
            ("gain-error", self.gain_error),
            ("penalties entropy", self.penalty.entropy),
            ("penalties tv", self.penalty.tv),
            ("penalties tv2", self.penalty.tv2),
            ("uv-min", self.uv_min_wl),
        ] {
            need(option, value, value >= 0.0 && value.is_finite(), "a number of 0 or more")?;
        }
        for (option, value) in [("closure-rounds", self.rounds), ("round-niter", self.iterations), ("starts", self.starts)] {
            need(option, value, value > 0, "1 or more")?;
        }
        let starts = self.terms().iter().any(|(t, _)| *t != Term::Visibility);
        need("terms", "vis alone", starts, "at least one of amp, cphase and logcamp, that the self-calibration can start from")
    }

    /// The terms. The default is amplitudes and closure phases.
    #[must_use]
    pub fn terms(&self) -> &[(Term, f64)] {
        const USUAL: &[(Term, f64)] = &[(Term::Amplitude, 1.0), (Term::ClosurePhase, 1.0)];
        self.terms.as_ref().map_or(USUAL, |t| &t.0)
    }

    /// Weight of a term, 0 if it is not selected.
    #[must_use]
    pub fn weight(&self, term: Term) -> f64 {
        self.terms().iter().find(|(t, _)| *t == term).map_or(0.0, |(_, w)| *w)
    }
}

word_or_quantity!(
    Average,
    "scan" => Scans,
    "none" => Integration,
    Time(Duration),
    "scan, none (single integrations) or a time such as \"60s\"."
);

by_text!(PenaltyWeights, "string", "Weights entropy, tv, tv2, flux and centroid as NAME=WEIGHT with commas between.");

impl PenaltyWeights {
    /// The weights with their names.
    fn named(&mut self) -> [(&'static str, &mut f64); 5] {
        let Self { entropy, tv, tv2, flux, centroid } = self;
        [("entropy", entropy), ("tv", tv), ("tv2", tv2), ("flux", flux), ("centroid", centroid)]
    }
}

impl fmt::Display for PenaltyWeights {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&{ *self }.named().map(|(name, weight)| format!("{name}={weight}")).join(","))
    }
}

impl FromStr for PenaltyWeights {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let mut weights = Self::default();
        for part in text.split(',').map(str::trim).filter(|p| !p.is_empty()) {
            let wrong = || format!("{part:?} is not entropy, tv, tv2, flux or centroid with =WEIGHT from 0 to 1e6");
            let (name, value) = part.split_once('=').ok_or_else(wrong)?;
            let value = value.trim().parse::<f64>().ok().filter(|v| (0.0..=1e6).contains(v)).ok_or_else(wrong)?;
            *weights.named().into_iter().find(|(n, _)| *n == name.trim()).ok_or_else(wrong)?.1 = value;
        }
        Ok(weights)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn terms_are_read_with_their_weights() {
        let terms = "cphase, logcamp=2,amp=0.5".parse::<Terms>().unwrap().0;
        assert_eq!(terms, [(Term::ClosurePhase, 1.0), (Term::LogClosureAmplitude, 2.0), (Term::Amplitude, 0.5)]);
        for bad in ["", "amp,phase", "amp=0", "amp=x", "amp,amp"] {
            assert!(bad.parse::<Terms>().unwrap_err().to_string().contains("terms"), "{bad}");
        }
        assert!(Term::ALL.iter().all(|(n, t)| t.name() == *n));
    }

    #[test]
    fn penalties_are_read_by_name() {
        assert_eq!("".parse(), Ok(PenaltyWeights::default()));
        assert_eq!("tv=2, entropy=0".parse(), Ok(PenaltyWeights { tv: 2.0, entropy: 0.0, ..PenaltyWeights::default() }));
        for bad in ["tv", "tv=-1", "smooth=1", "tv=x"] {
            assert!(bad.parse::<PenaltyWeights>().is_err(), "{bad}");
        }
    }

    #[test]
    fn impossible_wishes_are_refused_by_name() {
        let ok = ClosureImagingOptions::default();
        assert!(ok.check().is_ok());
        let cases = [
            (ClosureImagingOptions { flux: FluxFrom::Given(0.0), ..ok.clone() }, "flux"),
            (ClosureImagingOptions { prior_fwhm: Some(Angle(-1.0)), ..ok.clone() }, "prior-fwhm"),
            (ClosureImagingOptions { size: Some(ImageSize::square(4096)), ..ok.clone() }, "size"),
            (ClosureImagingOptions { gain_error: f64::NAN, ..ok.clone() }, "gain-error"),
            (ClosureImagingOptions { rounds: 0, ..ok.clone() }, "closure-rounds"),
            (ClosureImagingOptions { terms: Some(Terms(vec![(Term::Visibility, 1.0)])), ..ok.clone() }, "terms"),
        ];
        for (options, name) in cases {
            assert!(options.check().unwrap_err().to_string().contains(name), "{name}");
        }
    }
}
