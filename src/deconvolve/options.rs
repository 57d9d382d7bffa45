//! Options of CLEAN: one type for the library, the command line and the files of `run` and `study`.

use super::minor::Scales;
use super::tuning::CleanTuning;
use super::{EXTENDED, Entry, TABLE, by_name, names};
use crate::values::{Level, bad_value, by_text, need};
use crate::{ChainError, Result};
use cittert_arrays::SkyGrid;
use cittert_arrays::quantity::{Angle, QuantityError};
use ndarray::Array2;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

/// Options of CLEAN.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args, schemars::JsonSchema))]
#[cfg_attr(feature = "cli", command(next_help_heading = "CLEAN"))]
pub struct CleanOptions {
    /// The deconvolver: hogbom, clark, multiscale, or auto. `selfcal` and `study` also take mem, which images by maximum entropy. With auto,
    /// `selfcal` chooses among hogbom, multiscale and mem by the baselines that it holds out, and every other command uses hogbom.
    #[serde(alias = "deconvolver")]
    #[cfg_attr(feature = "cli", arg(long, visible_alias = "deconvolver", value_name = "NAME", default_value_t = CleanOptions::default().algorithm))]
    pub algorithm: Algorithm,
    /// Loop gain: the fraction of the peak that one component removes.
    #[cfg_attr(feature = "cli", arg(long, value_name = "X", default_value_t = CleanOptions::default().gain))]
    pub gain: f64,
    /// Largest number of components, over all major cycles of an output channel.
    #[cfg_attr(feature = "cli", arg(long, value_name = "N", default_value_t = CleanOptions::default().niter))]
    pub niter: usize,
    /// Stop at this peak: a flux density in a beam such as 1mJy, or a temperature such as 2K for images in kelvin.
    #[cfg_attr(feature = "cli", arg(long, value_name = "LEVEL"))]
    pub threshold: Option<Level>,
    /// Stop at this multiple of the robust noise of the residual (1.4826 times the median absolute deviation). 0 turns this off.
    #[cfg_attr(feature = "cli", arg(long, value_name = "X", default_value_t = CleanOptions::default().nsigma))]
    pub nsigma: f64,
    /// Largest fraction by which one minor cycle lowers the peak.
    #[cfg_attr(feature = "cli", arg(long, value_name = "X", default_value_t = CleanOptions::default().mgain))]
    pub mgain: f64,
    /// A minor cycle stops at this factor times the largest side lobe times the peak.
    #[cfg_attr(feature = "cli", arg(long, value_name = "X", default_value_t = CleanOptions::default().cyclefactor))]
    pub cyclefactor: f64,
    /// Largest number of major cycles.
    #[cfg_attr(feature = "cli", arg(long, value_name = "N", default_value_t = CleanOptions::default().max_major))]
    pub max_major: usize,
    /// FITS image on the grid of the image. Components are placed only where it is above 0.
    #[cfg_attr(feature = "cli", arg(long, value_name = "FITS"))]
    pub mask: Option<PathBuf>,
    /// Components are placed only in this box of l and m, L0,M0,L1,M1 as angles. May be repeated.
    #[cfg_attr(feature = "cli", arg(long = "box", value_name = "L0,M0,L1,M1", allow_hyphen_values = true))]
    #[serde(rename = "box")]
    pub boxes: Vec<SkyBox>,
    /// Make a mask of the pixels above this multiple of the noise, and let it grow.
    #[cfg_attr(feature = "cli", arg(long, value_name = "X"))]
    pub auto_mask: Option<f64>,
    /// Take positive components only.
    #[cfg_attr(feature = "cli", arg(long))]
    pub no_negative: bool,
    /// Widths of the scales of multiscale in pixels, 0 for points [default: chosen from the beam and the size of the image].
    #[cfg_attr(feature = "cli", arg(long, value_name = "LIST", value_delimiter = ','))]
    pub scales: Vec<f64>,
    /// How strongly multiscale prefers small scales: a scale s competes with its peak times 1 - bias s / (largest scale).
    #[cfg_attr(feature = "cli", arg(long, value_name = "X", default_value_t = CleanOptions::default().scale_bias))]
    pub scale_bias: f64,
    /// Smallest and largest level of a minor cycle, as fractions of the peak, whatever the side lobes are.
    #[serde(skip)]
    #[cfg_attr(feature = "cli", arg(skip = CleanOptions::default().psf_fraction))]
    pub psf_fraction: (f64, f64),
    /// Where components may be \[m, l\]: the mask and the boxes, once they are loaded for a grid.
    #[serde(skip)]
    #[cfg_attr(feature = "cli", arg(skip))]
    pub region: Option<Array2<bool>>,
    /// Constants that few users need to change.
    #[serde(skip)]
    #[cfg_attr(feature = "cli", arg(skip))]
    pub tuning: CleanTuning,
}

impl Default for CleanOptions {
    fn default() -> Self {
        Self {
            algorithm: Algorithm::Auto,
            gain: 0.1,
            niter: 20_000,
            threshold: None,
            nsigma: 3.0,
            mgain: 0.8,
            cyclefactor: 1.5,
            max_major: 100,
            mask: None,
            boxes: Vec::new(),
            auto_mask: None,
            no_negative: false,
            scales: Vec::new(),
            scale_bias: Scales::default().bias,
            psf_fraction: (0.05, 0.8),
            region: None,
            tuning: CleanTuning::default(),
        }
    }
}

impl CleanOptions {
    /// Set `region`, the pixels where components may be: those of `mask`, which the caller has read, and of the boxes.
    ///
    /// # Errors
    /// No pixel is left for components.
    pub fn with_region(mut self, mask: Option<Array2<bool>>, grid: &SkyGrid) -> Result<Self> {
        self.region = mask;
        if !self.boxes.is_empty() {
            let all = self.region.get_or_insert_with(|| Array2::from_elem((grid.n_m, grid.n_l), false));
            for ((row, column), inside) in all.indexed_iter_mut() {
                *inside |= self.boxes.iter().any(|b| b.holds(grid.l_at(column as f64), grid.m_at(row as f64)));
            }
        }
        match &self.region {
            Some(m) if !m.iter().any(|x| *x) => {
                Err(ChainError::NoData("the mask leaves no pixel for components: widen the mask or the box".into()))
            }
            _ => Ok(self),
        }
    }

    /// The scales for a beam whose main lobe has this width in pixels.
    pub(crate) fn scales(&self, beam_px: f64) -> Scales {
        Scales { widths_px: self.scales.clone(), bias: self.scale_bias, beam_px }
    }

    /// Check what does not depend on the image.
    ///
    /// # Errors
    /// An option is out of range.
    pub fn check(&self) -> Result<()> {
        for (option, value) in [("gain", self.gain), ("mgain", self.mgain)] {
            need(option, value, value > 0.0 && value <= 1.0, "above 0, at most 1")?;
        }
        for (option, value) in [("nsigma", self.nsigma), ("cyclefactor", self.cyclefactor)] {
            need(option, value, value >= 0.0 && value.is_finite(), "a number of 0 or more")?;
        }
        let (low, high) = self.psf_fraction;
        let rising = low >= 0.0 && low <= high && high <= 1.0;
        need("fractions of the peak", format!("{low} to {high}"), rising, "two fractions of the peak from 0 to 1, the smaller one first")?;
        let sigmas = self.auto_mask.unwrap_or(1.0);
        need("auto-mask", sigmas, sigmas > 0.0 && sigmas.is_finite(), "a positive multiple of the noise")?;
        self.tuning.check()
    }

    /// The deconvolver, after a check of the options that belong to one algorithm.
    ///
    /// # Errors
    /// The algorithm is maximum entropy, which is not a CLEAN, or an option is for another algorithm.
    pub(crate) fn entry(&self) -> Result<&'static Entry> {
        let entry = match self.algorithm {
            Algorithm::Auto => &TABLE[0],
            Algorithm::Clean(entry) => entry,
            Algorithm::Mem => return bad_value("algorithm", self.algorithm, format!("one of {}", names())),
        };
        if entry.name != EXTENDED {
            need(
                "scales",
                format!("{:?}", self.scales),
                self.scales.is_empty(),
                "no scales, or the algorithm multiscale, which alone uses them",
            )?;
            let bias = Scales::default().bias;
            let expected = format!("{bias}, or the algorithm multiscale, which alone uses it");
            need("scale-bias", self.scale_bias, self.scale_bias == bias, expected)?;
        }
        Ok(entry)
    }
}

/// What turns a residual into a model: a deconvolver of the table, or maximum entropy.
#[derive(Debug, Clone, Copy)]
pub enum Algorithm {
    /// The first of the table in an image. Self-calibration compares several.
    Auto,
    /// A kind of CLEAN.
    Clean(&'static Entry),
    /// Maximum entropy. Self-calibration then solves image and gains as one problem.
    Mem,
}
by_text!(Algorithm, "string", "auto, hogbom, clark, multiscale, or (in self-calibration and studies) mem.");

impl Algorithm {
    /// Its name on the command line and in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Clean(entry) => entry.name,
            Self::Mem => "mem",
        }
    }

    /// True for maximum entropy.
    #[must_use]
    pub fn is_mem(self) -> bool {
        matches!(self, Self::Mem)
    }
}

impl PartialEq for Algorithm {
    fn eq(&self, other: &Self) -> bool {
        self.name() == other.name()
    }
}

impl From<&'static Entry> for Algorithm {
    fn from(entry: &'static Entry) -> Self {
        Self::Clean(entry)
    }
}

impl fmt::Display for Algorithm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Algorithm {
    type Err = ChainError;

    fn from_str(name: &str) -> Result<Self> {
        match name {
            "auto" => Ok(Self::Auto),
            "mem" => Ok(Self::Mem),
            _ => by_name(name).map(Self::Clean),
        }
    }
}

/// A box of l and m between two opposite corners, written L0,M0,L1,M1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SkyBox {
    /// One corner: l and m.
    pub from: [Angle; 2],
    /// The opposite corner: l and m.
    pub to: [Angle; 2],
}
by_text!(SkyBox, "string", "Four angles L0,M0,L1,M1, such as \"-10arcsec,-5arcsec,10arcsec,5arcsec\".");

impl SkyBox {
    fn holds(&self, l: f64, m: f64) -> bool {
        let between = |x: f64, a: Angle, b: Angle| x >= a.si().min(b.si()) && x <= a.si().max(b.si());
        between(l, self.from[0], self.to[0]) && between(m, self.from[1], self.to[1])
    }
}

impl fmt::Display for SkyBox {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{},{},{},{}", self.from[0], self.from[1], self.to[0], self.to[1])
    }
}

impl FromStr for SkyBox {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let angles: std::result::Result<Vec<Angle>, QuantityError> = text.split(',').map(str::parse).collect();
        match angles.as_deref() {
            Ok(&[l0, m0, l1, m1]) => Ok(Self { from: [l0, m0], to: [l1, m1] }),
            _ => Err(format!("{text:?} is not a box of four angles L0,M0,L1,M1 such as -10arcsec,-5arcsec,10arcsec,5arcsec")),
        }
    }
}
