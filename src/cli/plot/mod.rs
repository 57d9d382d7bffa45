//! `plot`: a picture of images, a visibility set, a gain table or a layout.

mod gains;
mod images;
mod title;
mod visibilities;

use super::context::{Context, Outcome};
use super::failure::{Failure, Result};
use super::options::{OutputArgs, load_layout};
use super::picture;
use crate::plot::{self, DEFAULT_HEIGHT, DEFAULT_WIDTH, Picture, PictureFormat, uv_coverage};
use cittert_arrays::quantity::Frequency;
use cittert_arrays::{ArrayLayout, BuiltinLayout, CoveragePlan, SpectralWindow};
use cittert_formats::{Holds, format_of};
use clap::{Args, ValueEnum};
use images::{RangeChoice, StretchChoice};
use std::path::{Path, PathBuf};

/// What a picture shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum What {
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
#[derive(Debug, Args)]
pub struct PlotArgs {
    /// Image, visibility set, gain table, or layout (file or built-in name). Several images stand side by side in the same colours.
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    /// What the picture shows. Of visibilities: visibilities, uv, model, antennas. Of a layout: antennas, uv. Of an image: image, psf,
    /// residual. Of gains: phase, amplitude [default: the first of these; psf for a dirty beam, residual for a file PREFIX-residual].
    #[arg(long, value_name = "WHAT", hide_possible_values = true)]
    what: Option<What>,
    /// Frequency for the u-v coverage of a layout.
    #[arg(long, value_name = "FREQ")]
    freq: Option<Frequency>,
    /// Channel of an image.
    #[arg(long, default_value_t = 0, value_name = "N")]
    channel: usize,
    /// Polarisation of an image (its index).
    #[arg(long, default_value_t = 0, value_name = "N")]
    pol_index: usize,
    /// Values that the colours span: auto (chosen from the image), full, or LOW,HIGH in the unit of the image.
    #[arg(long, value_name = "RANGE", default_value = "auto", allow_hyphen_values = true)]
    range: RangeChoice,
    /// How values become colours: auto (chosen from the image), linear, or asinh, which shows faint emission beside bright emission.
    #[arg(long, value_name = "STRETCH", value_enum, hide_possible_values = true, default_value_t = StretchChoice::Auto)]
    stretch: StretchChoice,
    /// Use two colours around zero, in the unit of the image.
    #[arg(long)]
    symmetric: bool,
    /// Use the colours and the part of the frame of this image, so that both pictures can be compared. May be repeated: the first one in
    /// the same unit is used.
    #[arg(long, value_name = "IMAGE", conflicts_with = "symmetric")]
    like: Vec<PathBuf>,
    /// Show the whole image, also where the emission fills a small part of it.
    #[arg(long)]
    full: bool,
    /// Show the image on the grid and at the resolution of this image, which has a restoring beam.
    #[arg(long, value_name = "IMAGE")]
    beam_of: Option<PathBuf>,
    /// True gains, which are drawn beside the solved ones.
    #[arg(long, value_name = "GAINS")]
    truth: Option<PathBuf>,
    /// Remove a phase gradient over the array before gains are compared with the truth. It is a shift of the image.
    #[arg(long, requires = "truth")]
    gradient: bool,
    /// Remove one amplitude scale before gains are compared with the truth. It is the flux scale of the model.
    #[arg(long, requires = "truth")]
    flux_scale: bool,
    /// Model for --what model: FITS image or source list (CSV) [default: the model column of the set].
    #[arg(long, value_name = "FITS|CSV")]
    model: Option<PathBuf>,
    /// Title [default: what the file says about itself]. With several images, the title of each: repeat the option.
    #[arg(long, value_name = "TEXT")]
    title: Vec<String>,
    /// Width of the picture in pixels [default: 900, and 560 for each of several images].
    #[arg(long, value_name = "N")]
    width: Option<usize>,
    /// Height of the picture in pixels [default: by what is shown].
    #[arg(long, value_name = "N")]
    height: Option<usize>,
    #[command(flatten)]
    out: OutputArgs,
}

/// Julian date of the coverage of a layout: noon of the first day of 2025.
const ANY_DATE_JD: f64 = 2_460_677.0;

/// Draw a picture.
///
/// # Errors
/// A file that cannot be drawn, options that do not suit the file, or an error of the file system.
pub fn run(args: &PlotArgs, context: &Context) -> Result<Outcome> {
    let format = PictureFormat::of(&args.out.output).map_err(Failure::call)?;
    args.out.check(&args.out.output)?;
    let file = draw(args, context)?.file(format)?;
    args.out.write(&args.out.output, &file)?;
    let json = serde_json::json!({ "output": args.out.output, "bytes": file.len() });
    Ok(Outcome::new(json, args.out.output.display().to_string()).wrote(&args.out.output))
}

impl PlotArgs {
    /// The first file.
    fn file(&self) -> &Path {
        self.files.first().map_or(Path::new(""), PathBuf::as_path)
    }

    fn size(&self, width: usize, height: usize) -> (usize, usize) {
        (self.width.unwrap_or(width), self.height.unwrap_or(height))
    }

    fn title_or(&self, own: impl FnOnce() -> String) -> String {
        self.title.first().cloned().unwrap_or_else(own)
    }

    /// Refuse options that do not suit what a file holds.
    fn check(&self, name: &str, holds: Option<Holds<'_>>) -> Result<()> {
        let images = matches!(holds, Some(Holds::Images(_)));
        let layout = matches!(holds, None | Some(Holds::Layouts(_)));
        let colours = self.range != RangeChoice::Auto || self.stretch != StretchChoice::Auto || self.symmetric || !self.like.is_empty();
        let part = self.full || self.beam_of.is_some() || self.channel != 0 || self.pol_index != 0 || self.files.len() > 1;
        let refuse = |what: &str| Err(Failure::usage(format!("{name}: {what}")));
        if (colours || part) && !images {
            let options = "--range, --stretch, --symmetric, --like, --full, --beam-of, --channel, --pol-index and several files";
            return refuse(&format!("{options} are for images"));
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
        if self.title.len() > 1 && self.title.len() != self.files.len() {
            return refuse(&format!("{} titles for {} files; give one --title for each file", self.title.len(), self.files.len()));
        }
        Ok(())
    }
}

fn draw(args: &PlotArgs, context: &Context) -> Result<Picture> {
    let name = args.file().to_string_lossy();
    // The name of a built-in layout is no file.
    let holds = if BuiltinLayout::find(&name).is_some() { None } else { Some(format_of(args.file())?.holds()) };
    args.check(&name, holds)?;
    match holds {
        None | Some(Holds::Layouts(_)) => of_layout(args, &load_layout(&name)?),
        Some(Holds::Images(_)) => images::draw(args, context),
        Some(Holds::Visibilities(_)) => visibilities::draw(args, context),
        Some(Holds::Gains(_)) => gains::draw(args),
        Some(Holds::Sources(_)) => {
            Err(Failure::usage(format!("{name}: this is a source list; expected an image, visibilities, gains or a layout")))
        }
    }
}

/// The antennas of a layout, or the u-v coverage of one integration towards the zenith or boresight.
fn of_layout(args: &PlotArgs, array: &ArrayLayout) -> Result<Picture> {
    let (width, height) = args.size(DEFAULT_WIDTH, DEFAULT_HEIGHT);
    match args.what {
        Some(What::Uv) => {
            let freq = args.freq.ok_or_else(|| {
                Failure::usage(format!("{}: --what uv of a layout needs --freq, because u and v count wavelengths", args.file().display()))
            })?;
            // The date only fills the time column: the baselines are those of the layout.
            let coverage = CoveragePlan::snapshot(array, ANY_DATE_JD, 1.0)?.coverage()?;
            let title = args.title_or(|| format!("u-v coverage of {}\n{}, one integration", array.name, title::frequency(freq.si())));
            let band = SpectralWindow::new(vec![freq.si()], vec![freq.si()])?;
            Ok(uv_coverage(&coverage, &band, &title, width, height)?)
        }
        Some(What::Visibilities) => Err(Failure::usage(format!(
            "{}: a layout has no visibilities: use --what antennas or --what uv, or simulate them first",
            args.file().display()
        ))),
        _ => antennas(args, array),
    }
}

fn antennas(args: &PlotArgs, layout: &ArrayLayout) -> Result<Picture> {
    let (width, height) = args.size(DEFAULT_WIDTH, DEFAULT_HEIGHT);
    Ok(plot::layout(layout, &args.title_or(|| picture::layout_title(layout)), width, height)?)
}
