//! Pictures of images: brightness, dirty beams and residuals.

use super::args::{PlotArgs, RangeChoice, StretchChoice, What};
use super::title;
use crate::cli::context::Context;
use crate::cli::failure::{Context as _, Failure, Result};
use crate::fidelity::{CompareOptions, Region, compare, convolve};
use crate::plot::{self, DEFAULT_HEIGHT, DEFAULT_WIDTH, ImagePlot, Picture, Range, Stretch, View, Wish};
use cittert_arrays::{BrightnessUnit, Image, SpectralWindow};
use ndarray::{Array2, Axis};
use std::path::Path;

/// Residuals show so many times their noise on both sides of zero, the same in every picture.
const RESIDUAL_SIGMAS: f64 = 5.0;
/// Width of each of several images side by side, pixels.
const WIDTH_OF_SEVERAL: usize = 560;

pub(super) fn draw(args: &PlotArgs, context: &Context) -> Result<Picture> {
    let all: Vec<Image> = args.files.iter().map(|path| open(args, path)).collect::<Result<_>>()?;
    let Some(first) = all.first() else { return Err(Failure::usage("plot needs a file")) };
    let path = args.file();
    let drawing = || format!("drawing {}", path.display());
    let named_residual = path.file_stem().is_some_and(|s| s.to_string_lossy().ends_with("-residual"));
    let what = match args.what {
        Some(what) => what,
        None if all.len() == 1 && args.beam_of.is_none() && plot::is_psf(first) => What::Psf,
        None if named_residual && !args.symmetric => What::Residual,
        None => What::Image,
    };
    let chosen_colours = args.range != RangeChoice::Auto || args.stretch != StretchChoice::Auto || args.symmetric || !args.like.is_empty();
    if what != What::Image && args.what.is_some() && chosen_colours {
        return Err(Failure::usage(
            "--range, --stretch, --symmetric and --like are for --what image: a beam is shown in dB, a residual in units of its noise",
        ));
    }
    if what == What::Psf && all.len() > 1 {
        return Err(Failure::usage("--what psf takes one file"));
    }
    // Colours that were asked for have the last word over what the name of a file says.
    let what = if chosen_colours { What::Image } else { what };
    let range = match args.range {
        _ if what == What::Residual => Range::Noise(RESIDUAL_SIGMAS),
        _ if args.symmetric => Range::Symmetric,
        RangeChoice::Auto => Range::Auto,
        RangeChoice::Full => Range::Full,
        RangeChoice::Fixed(low, high) => Range::Fixed(low, high),
    };
    let stretch = match args.stretch {
        StretchChoice::Auto => Stretch::Auto,
        StretchChoice::Linear => Stretch::Linear,
        StretchChoice::Asinh => Stretch::Asinh,
    };
    let several = all.len() > 1;
    let (width, height) = match what {
        What::Psf => args.size(DEFAULT_WIDTH, DEFAULT_HEIGHT * 5 / 4),
        _ if several => args.size(WIDTH_OF_SEVERAL * all.len(), WIDTH_OF_SEVERAL + 60),
        _ => args.size(DEFAULT_WIDTH, DEFAULT_HEIGHT),
    };
    let own = |k: usize| args.title.get(k).cloned().unwrap_or_else(|| title::of_image(&all[k], &args.files[k]));
    let options = ImagePlot {
        chan: args.channel,
        pol: args.pol_index,
        title: if several { String::new() } else { own(0) },
        wish: Wish { range, stretch, full: args.full },
        view: view(args, first, context)?,
        width,
        height,
    };
    if what == What::Psf {
        return plot::psf(first, &options).context(drawing());
    }
    // Side by side, there is room for the first line of a title only.
    let titles: Vec<String> = (0..all.len()).map(|k| own(k).lines().next().unwrap_or_default().to_owned()).collect();
    let named: Vec<(&Image, &str)> =
        all.iter().zip(&titles).map(|(image, title)| (image, if several { title.as_str() } else { "" })).collect();
    plot::images(&named, &options).context(drawing())
}

/// An image, on the grid and at the resolution of another where `--beam-of` asks for it.
fn open(args: &PlotArgs, path: &Path) -> Result<Image> {
    let image = cittert_formats::open_image(path)?;
    let Some(like) = &args.beam_of else { return Ok(image) };
    let other = cittert_formats::open_image(like)?;
    let beam = *other.beams.first().ok_or_else(|| {
        Failure::message(format!("{}: it has no restoring beam (BMAJ, BMIN, BPA), which --beam-of needs", like.display()))
    })?;
    let options = CompareOptions { region: Region::All, beam: Some(beam), ..CompareOptions::default() };
    let found = compare(&other, &image, &options).context(format!("convolving {} as {}", path.display(), like.display()))?;
    let band = SpectralWindow::new(other.spectrum.freq_hz()[..1].to_vec(), other.spectrum.width_hz()[..1].to_vec())?;
    let mut shown = found.truth;
    if other.unit == BrightnessUnit::Kelvin {
        // Outside of the frame the sky is taken as 0, which would give a warm scene a dark border.
        let inside = convolve(Array2::ones(shown.dim()).view(), &other.grid, &beam)?;
        shown /= &inside;
    }
    let data = shown.insert_axis(Axis(0)).insert_axis(Axis(0));
    let mut out = Image::new(other.grid.clone(), band, other.polarizations[..1].to_vec(), data, other.unit)?;
    (out.object, out.telescope, out.history) = (image.object, image.telescope, image.history);
    out.beams.push(beam);
    Ok(out)
}

/// The view of the first image of `--like` that has the same unit.
fn view(args: &PlotArgs, image: &Image, context: &Context) -> Result<Option<View>> {
    for path in &args.like {
        let other = cittert_formats::open_image(path)?;
        let (n_chan, n_pol, ..) = other.data.dim();
        if args.channel >= n_chan || args.pol_index >= n_pol {
            let wanted = format!("channel {} and polarisation {}", args.channel, args.pol_index);
            let why = format!("it has {n_chan} channels and {n_pol} polarisations, and so not {wanted}");
            return Err(Failure::message(format!("{}: {why}", path.display())));
        }
        if other.unit == image.unit {
            let wish = Wish { full: args.full, ..Wish::default() };
            let name = title::of_image(&other, path).lines().next().unwrap_or_default().to_owned();
            let view = View::new(&other, args.channel, args.pol_index, &wish).context(path.display())?;
            return Ok(Some(view.like(&format!("\u{201c}{name}\u{201d}"))));
        }
    }
    if !args.like.is_empty() {
        let file = args.file().display();
        context.console.note(&format!("{file}: no image of --like has the unit {:?}, so its colours are its own", image.unit.bunit()));
    }
    Ok(None)
}
