//! `plot`: a picture of an image, a visibility set, a gain table or a layout.

use super::context::{Context, Outcome};
use super::failure::{Context as _, Failure, Result};
use super::options::{OutputArgs, load_layout};
use super::picture;
use crate::memory::MemoryBudget;
use crate::plot::{
    self, CurveOptions, DEFAULT_HEIGHT, DEFAULT_WIDTH, ImagePlot, Picture, PictureFormat, Range, Series, Stretch, VisPlot, curves,
    uv_coverage,
};
use cittert_arrays::quantity::Frequency;
use cittert_arrays::{ArrayLayout, BuiltinLayout, CoveragePlan, SpectralWindow, UvCoverage, VisibilitySource, for_each_block};
use cittert_formats::{Holds, format_of};
use clap::{Args, ValueEnum};
use std::path::{Path, PathBuf};

/// What a picture of a visibility set or a layout shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum What {
    /// u-v coverage.
    Uv,
    /// Amplitude and phase against baseline length.
    Visibilities,
    /// Antenna positions.
    Antennas,
}

/// Options of `plot`.
#[derive(Debug, Args)]
pub struct PlotArgs {
    /// Image, visibility set, gain table, or layout (file or built-in name).
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// What a picture of a visibility set or a layout shows [default: visibilities of a set, antennas of a layout].
    #[arg(long, value_name = "WHAT")]
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
    /// Lowest value of the colours.
    #[arg(long, value_name = "X", requires = "max", allow_negative_numbers = true)]
    min: Option<f64>,
    /// Highest value of the colours.
    #[arg(long, value_name = "X", requires = "min", allow_negative_numbers = true)]
    max: Option<f64>,
    /// Use two colours around zero, as for residuals.
    #[arg(long, conflicts_with_all = ["min", "max"])]
    symmetric: bool,
    /// Use the range of values of this image, so that both pictures can be compared.
    #[arg(long, value_name = "IMAGE", conflicts_with_all = ["min", "max", "symmetric"])]
    like: Option<PathBuf>,
    /// Use an asinh stretch, which shows faint emission beside bright emission.
    #[arg(long)]
    asinh: bool,
    /// Title [default: the name of the file].
    #[arg(long, value_name = "TEXT")]
    title: Option<String>,
    /// Width of the picture in pixels.
    #[arg(long, default_value_t = DEFAULT_WIDTH, value_name = "N")]
    width: usize,
    /// Height of the picture in pixels.
    #[arg(long, default_value_t = DEFAULT_HEIGHT, value_name = "N")]
    height: usize,
    #[command(flatten)]
    out: OutputArgs,
}

/// Julian date of the coverage of a layout: noon of the first day of 2025.
const ANY_DATE_JD: f64 = 2_460_677.0;

/// Largest number of rows of coverage that a picture shows.
const MOST_ROWS: usize = 400_000;

/// Draw a picture.
///
/// # Errors
/// A file that cannot be drawn, options that do not suit the file, or an error of the file system.
pub fn run(args: &PlotArgs, _context: &Context) -> Result<Outcome> {
    let format = PictureFormat::of(&args.out.output).map_err(Failure::call)?;
    args.out.check(&args.out.output)?;
    let file = draw(args)?.file(format)?;
    args.out.write(&args.out.output, &file)?;
    let json = serde_json::json!({ "output": args.out.output, "bytes": file.len() });
    Ok(Outcome::new(json, args.out.output.display().to_string()).wrote(&args.out.output))
}

fn draw(args: &PlotArgs) -> Result<Picture> {
    let name = args.file.to_string_lossy();
    // The name of a built-in layout is no file.
    let holds = if BuiltinLayout::find(&name).is_some() { None } else { Some(format_of(&args.file)?.holds()) };
    let of_images = args.min.is_some() || args.symmetric || args.like.is_some() || args.asinh || args.channel != 0 || args.pol_index != 0;
    if of_images && !matches!(holds, Some(Holds::Images(_))) {
        let options = "--min, --max, --symmetric, --like, --asinh, --channel and --pol-index";
        return Err(Failure::usage(format!("{name}: {options} are for images")));
    }
    let of_layouts = holds.is_none() || matches!(holds, Some(Holds::Layouts(_)));
    if args.what.is_some() && !of_layouts && !matches!(holds, Some(Holds::Visibilities(_))) {
        return Err(Failure::usage(format!("{name}: --what is for visibilities and layouts")));
    }
    if args.freq.is_some() && !of_layouts {
        return Err(Failure::usage(format!("{name}: --freq is for layouts; visibilities have their own frequencies")));
    }
    match holds {
        None | Some(Holds::Layouts(_)) => of_layout(args, &load_layout(&name)?),
        Some(Holds::Images(_)) => image(args),
        Some(Holds::Visibilities(_)) => visibilities(args),
        Some(Holds::Gains(_)) => gains(args),
        Some(Holds::Sources(_)) => {
            Err(Failure::usage(format!("{name}: this is a source list; expected an image, visibilities, gains or a layout")))
        }
    }
}

/// The antennas of a layout, or the u-v coverage of one integration towards the zenith or boresight.
fn of_layout(args: &PlotArgs, array: &ArrayLayout) -> Result<Picture> {
    match args.what {
        None | Some(What::Antennas) => layout(args, array),
        Some(What::Uv) => {
            let freq = args.freq.ok_or_else(|| {
                Failure::usage(format!("{}: --what uv of a layout needs --freq, because u and v count wavelengths", args.file.display()))
            })?;
            // The date only fills the time column: the baselines are those of the layout.
            let coverage = CoveragePlan::snapshot(array, ANY_DATE_JD, 1.0)?.coverage()?;
            let title = args.title.clone().unwrap_or_else(|| format!("{} at {freq}, one integration", array.name));
            let band = SpectralWindow::new(vec![freq.si()], vec![freq.si()])?;
            Ok(uv_coverage(&coverage, &band, &title, args.width, args.height)?)
        }
        Some(What::Visibilities) => Err(Failure::usage(format!(
            "{}: a layout has no visibilities: use --what antennas or --what uv, or simulate them first",
            args.file.display()
        ))),
    }
}

fn layout(args: &PlotArgs, layout: &ArrayLayout) -> Result<Picture> {
    let title = args.title.clone().unwrap_or_else(|| picture::layout_title(layout));
    Ok(plot::layout(layout, &title, args.width, args.height)?)
}

fn title(args: &PlotArgs, object: &str) -> String {
    args.title.clone().unwrap_or_else(|| {
        let stem = args.file.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
        if object.is_empty() || stem == object { stem } else { format!("{object}: {stem}") }
    })
}

fn image(args: &PlotArgs) -> Result<Picture> {
    let image = cittert_formats::open_image(&args.file)?;
    let range = match (args.min, args.max) {
        (Some(min), Some(max)) => Range::Fixed(min, max),
        _ if args.symmetric => Range::Symmetric,
        _ => args.like.as_ref().map_or(Ok(Range::Full), |path| like(args, path))?,
    };
    let stretch = if args.asinh { Stretch::Asinh } else { Stretch::Linear };
    let title = title(args, &image.object);
    let options = ImagePlot { chan: args.channel, pol: args.pol_index, title, range, stretch, width: args.width, height: args.height };
    plot::image(&image, &options).context(format!("drawing {}", args.file.display()))
}

/// The range of values of the same plane of another image.
fn like(args: &PlotArgs, path: &Path) -> Result<Range> {
    let other = cittert_formats::open_image(path)?;
    let (n_chan, n_pol, ..) = other.data.dim();
    if args.channel >= n_chan || args.pol_index >= n_pol {
        let wanted = format!("channel {} and polarisation {}", args.channel, args.pol_index);
        let why = format!("it has {n_chan} channels and {n_pol} polarisations, and so not {wanted}");
        return Err(Failure::message(format!("{}: {why}", path.display())));
    }
    let values = || other.data.slice(ndarray::s![args.channel, args.pol_index, .., ..]).into_iter().copied().filter(|v| v.is_finite());
    let (min, max) = (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
    if min < max {
        return Ok(Range::Fixed(min, max));
    }
    Err(Failure::message(format!("{}: its values do not differ, so they give no range of colours", path.display())))
}

/// Largest number of antennas that the legend names.
const MOST_NAMES: usize = 12;

/// Draw the gain phases of the first feed in the middle channel. They are drawn against time, or against the antenna number where the table has
/// one time only.
fn gains(args: &PlotArgs) -> Result<Picture> {
    let table = cittert_formats::calh5::read_gains(&args.file)?;
    let (n_time, n_ant, n_chan, _) = table.gains.dim();
    let first = table.time_jd.first().copied().unwrap_or_default();
    let phase = |t: usize, a: usize| {
        let at = (t, a, n_chan / 2, 0);
        (!table.flags[at]).then(|| table.gains[at].arg().to_degrees())
    };
    let name = |a: usize| if n_ant <= MOST_NAMES { table.layout.antennas()[a].name.clone() } else { String::new() };
    let (series, x_label): (Vec<Series>, _) = if n_time == 1 {
        let points = (0..n_ant).filter_map(|a| Some(((a + 1) as f64, phase(0, a)?))).collect();
        (vec![Series { name: String::new(), points, errors: Vec::new() }], "Antenna")
    } else {
        let line = |a: usize| {
            let points = (0..n_time).filter_map(|t| Some(((table.time_jd[t] - first) * 1440.0, phase(t, a)?))).collect();
            Series { name: name(a), points, errors: Vec::new() }
        };
        ((0..n_ant).map(line).collect(), "Time (min)")
    };
    let options = CurveOptions {
        title: title(args, &table.layout.name),
        x_label: x_label.into(),
        y_label: "Phase (deg)".into(),
        width: args.width,
        height: args.height,
        ..CurveOptions::default()
    };
    curves(&series, &options).context(format!("drawing {}", args.file.display()))
}

fn visibilities(args: &PlotArgs) -> Result<Picture> {
    let mut source = cittert_formats::open_visibilities(&args.file)?;
    let title = title(args, "");
    let drawn = match args.what.unwrap_or(What::Visibilities) {
        What::Antennas => return layout(args, &source.header().layout),
        What::Uv => coverage(source.as_mut(), &args.file)
            .and_then(|c| Ok(uv_coverage(&c, &source.header().spectrum, &title, args.width, args.height)?)),
        What::Visibilities => {
            let mut plot = VisPlot::new(source.header());
            for_each_block(source.as_mut(), MemoryBudget::default().block(), |_, block| -> Result<()> {
                plot.add(&block);
                Ok(())
            })
            .context(format!("reading {}", args.file.display()))?;
            Ok(plot.draw(&title, args.width, args.height)?)
        }
    };
    drawn.context(format!("drawing {}", args.file.display()))
}

/// The u-v coverage of a set, thinned evenly to the number of rows that a picture can show.
fn coverage(source: &mut dyn VisibilitySource, path: &Path) -> Result<UvCoverage> {
    let every = source.n_rows().div_ceil(MOST_ROWS).max(1);
    let mut kept = UvCoverage::empty();
    for_each_block(source, MemoryBudget::default().block(), |first, block| -> Result<()> {
        let rows: Vec<usize> = (0..block.n_rows()).filter(|r| (first + r) % every == 0).collect();
        kept.append(&block.coverage.select(&rows)?)?;
        Ok(())
    })
    .context(format!("reading {}", path.display()))?;
    Ok(kept)
}
