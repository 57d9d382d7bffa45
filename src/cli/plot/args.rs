//! The options of `plot`, and which of them suit which file.

use crate::cli::failure::{Failure, Result};
use crate::cli::options::OutputArgs;
use cittert_arrays::quantity::Frequency;
use cittert_formats::Holds;
use clap::{Args, ValueEnum};
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// What a picture shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum What {
    /// u-v coverage.
    Uv,
    /// Amplitude and phase against baseline length.
    Visibilities,
    /// Data and model against baseline length.
    Model,
    /// Antenna positions.
    Antennas,
    /// Brightness.
    Image,
    /// A dirty beam in dB, with its profile.
    Psf,
    /// A residual in units of its noise.
    Residual,
    /// Phases of gains.
    Phase,
    /// Amplitudes of gains.
    Amplitude,
}

impl What {
    fn suits(self, holds: Option<Holds<'_>>) -> bool {
        match holds {
            None | Some(Holds::Layouts(_)) => matches!(self, Self::Uv | Self::Antennas | Self::Visibilities),
            Some(Holds::Visibilities(_)) => matches!(self, Self::Uv | Self::Antennas | Self::Visibilities | Self::Model),
            Some(Holds::Images(_)) => matches!(self, Self::Image | Self::Psf | Self::Residual),
            Some(Holds::Gains(_)) => matches!(self, Self::Phase | Self::Amplitude),
            Some(Holds::Sources(_)) => false,
        }
    }
}

/// Options of `plot`.
#[derive(Debug, Clone, Args)]
pub struct PlotArgs {
    /// Image, visibility set, gain table, or layout (file or built-in name). Several images stand side by side in the same
    /// colours; several files of visibilities are one set.
    #[arg(value_name = "FILE", required = true)]
    pub(super) files: Vec<PathBuf>,
    /// What the picture shows. Of visibilities: visibilities, uv, model, antennas. Of a layout: antennas, uv. Of an image: image, psf,
    /// residual. Of gains: phase, amplitude [default: the first of these; psf for a dirty beam, residual for a file PREFIX-residual].
    #[arg(long, value_name = "WHAT", hide_possible_values = true)]
    pub(super) what: Option<What>,
    /// Frequency for the u-v coverage of a layout.
    #[arg(long, value_name = "FREQ")]
    pub(super) freq: Option<Frequency>,
    /// Channel of an image.
    #[arg(long, default_value_t = 0, value_name = "N")]
    pub(super) channel: usize,
    /// Polarisation of an image (its index).
    #[arg(long, default_value_t = 0, value_name = "N")]
    pub(super) pol_index: usize,
    /// Values that the colours span: auto (chosen from the image), full, or LOW,HIGH in the unit of the image.
    #[arg(long, value_name = "RANGE", default_value = "auto", allow_hyphen_values = true)]
    pub(super) range: RangeChoice,
    /// How values become colours: auto (chosen from the image), linear, or asinh, which shows faint emission beside bright emission.
    #[arg(long, value_name = "STRETCH", value_enum, hide_possible_values = true, default_value_t = StretchChoice::Auto)]
    pub(super) stretch: StretchChoice,
    /// Use two colours around zero, in the unit of the image.
    #[arg(long)]
    pub(super) symmetric: bool,
    /// Use the colours and the part of the frame of this image, so that both pictures can be compared. May be repeated: the first one in
    /// the same unit is used.
    #[arg(long, value_name = "IMAGE", conflicts_with = "symmetric")]
    pub(super) like: Vec<PathBuf>,
    /// Show the whole image, also where the emission fills a small part of it.
    #[arg(long)]
    pub(super) full: bool,
    /// Show the image on the grid and at the resolution of this image, which has a restoring beam.
    #[arg(long, value_name = "IMAGE")]
    pub(super) beam_of: Option<PathBuf>,
    /// True gains, which are drawn beside the solved ones.
    #[arg(long, value_name = "GAINS")]
    pub(super) truth: Option<PathBuf>,
    /// Remove a phase gradient over the array before gains are compared with the truth. It is a shift of the image.
    #[arg(long, requires = "truth")]
    pub(super) gradient: bool,
    /// Remove one amplitude scale before gains are compared with the truth. It is the flux scale of the model.
    #[arg(long, requires = "truth")]
    pub(super) flux_scale: bool,
    /// Model for --what model: FITS image or source list (CSV) [default: the model column of the set].
    #[arg(long, value_name = "FITS|CSV")]
    pub(super) model: Option<PathBuf>,
    /// Title [default: what the file says about itself]. With several images, the title of each: repeat the option.
    #[arg(long, value_name = "TEXT")]
    pub(super) title: Vec<String>,
    /// Width of the picture in pixels [default: 900, and 560 for each of several images].
    #[arg(long, value_name = "N")]
    pub(super) width: Option<usize>,
    /// Height of the picture in pixels [default: by what is shown].
    #[arg(long, value_name = "N")]
    pub(super) height: Option<usize>,
    #[command(flatten)]
    pub(super) out: OutputArgs,
}

/// The values of `--range`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum RangeChoice {
    Auto,
    Full,
    Fixed(f64, f64),
}

impl FromStr for RangeChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |part: &str| part.trim().parse::<f64>().ok().filter(|v| crate::cli::numbers::usable(*v));
        match text {
            "auto" => Ok(Self::Auto),
            "full" => Ok(Self::Full),
            _ => match text.split_once(',').map(|(low, high)| (number(low), number(high))) {
                Some((Some(low), Some(high))) if low < high => Ok(Self::Fixed(low, high)),
                _ => Err("expected auto, full, or two numbers LOW,HIGH in the unit of the image, the smaller first".into()),
            },
        }
    }
}

/// The values of `--stretch`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum StretchChoice {
    /// Chosen from the image.
    Auto,
    /// In proportion.
    Linear,
    /// Linear for faint values, logarithmic for bright ones.
    Asinh,
}

impl PlotArgs {
    /// The first file.
    pub(super) fn file(&self) -> &Path {
        self.files.first().map_or(Path::new(""), PathBuf::as_path)
    }

    /// All files that are read.
    pub(super) fn inputs(&self) -> impl Iterator<Item = &PathBuf> {
        self.files.iter().chain(&self.like).chain(&self.beam_of).chain(&self.truth).chain(&self.model)
    }

    pub(super) fn size(&self, width: usize, height: usize) -> (usize, usize) {
        (self.width.unwrap_or(width), self.height.unwrap_or(height))
    }

    pub(super) fn title_or(&self, own: impl FnOnce() -> String) -> String {
        self.title.first().cloned().unwrap_or_else(own)
    }

    /// Refuse options that do not suit what a file holds.
    pub(super) fn check(&self, name: &str, holds: Option<Holds<'_>>) -> Result<()> {
        let images = matches!(holds, Some(Holds::Images(_)));
        let layout = matches!(holds, None | Some(Holds::Layouts(_)));
        let colours = self.range != RangeChoice::Auto || self.stretch != StretchChoice::Auto || self.symmetric || !self.like.is_empty();
        let part = self.full || self.beam_of.is_some() || self.channel != 0 || self.pol_index != 0;
        let several = self.files.len() > 1 && !matches!(holds, Some(Holds::Visibilities(_)));
        let refuse = |what: &str| Err(Failure::usage(format!("{name}: {what}")));
        if (colours || part) && !images {
            let options = "--range, --stretch, --symmetric, --like, --full, --beam-of, --channel and --pol-index";
            return refuse(&format!("{options} are for images"));
        }
        if several && !images {
            return refuse("several files are for images, and for visibilities that are one set");
        }
        if let Some(what) = self.what.filter(|w| !w.suits(holds)) {
            let word = what.to_possible_value().map(|v| v.get_name().to_owned()).unwrap_or_default();
            return refuse(&format!(
                "--what {word} does not suit this file: visibilities take visibilities, uv, model and antennas; layouts antennas and uv; images image, psf and residual; gains phase and amplitude"
            ));
        }
        if self.freq.is_some() && !layout {
            return refuse("--freq is for layouts; visibilities have their own frequencies");
        }
        if self.truth.is_some() && !matches!(holds, Some(Holds::Gains(_))) {
            return refuse("--truth is for gain tables");
        }
        if self.model.is_some() && self.what != Some(What::Model) {
            return refuse("--model is for visibilities with --what model");
        }
        if self.title.len() > 1 && (self.title.len() != self.files.len() || !images) {
            return refuse(&format!("{} titles for {} files; give one --title for each file", self.title.len(), self.files.len()));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_is_a_word_or_two_numbers() {
        assert_eq!("auto".parse(), Ok(RangeChoice::Auto));
        assert_eq!("-1.5,2e3".parse(), Ok(RangeChoice::Fixed(-1.5, 2000.0)));
        for wrong in ["2,1", "1", "a,b", "nan,1", "0,inf", ""] {
            assert!(wrong.parse::<RangeChoice>().is_err(), "{wrong}");
        }
    }
}
