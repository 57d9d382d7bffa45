//! Options that every imaging subcommand has.

use crate::cli::failure::{Failure, Result};
use crate::imaging::{ImagingOptions, WeightOptions, Weighting};
use cittert_arrays::quantity::Angle;
use cittert_arrays::{Polarization, RestoringBeam};
use clap::Args;

/// Grid, weights and accuracy of an image.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Image")]
pub struct ImagingArgs {
    /// Pixels along each side, or COLUMNSxROWS [default: chosen from the coverage].
    #[arg(long, value_name = "N")]
    size: Option<String>,
    /// Size of a pixel [default: chosen from the coverage].
    #[arg(long, value_name = "ANGLE")]
    cell: Option<Angle>,
    /// natural, uniform or briggs.
    #[arg(long, value_name = "SCHEME", default_value = "uniform")]
    weighting: String,
    /// Robustness of briggs, from -2 (uniform) to 2 (natural).
    #[arg(long, value_name = "R", default_value_t = 0.0, allow_negative_numbers = true)]
    robust: f64,
    /// Cells of the weight grid so many times wider than the image's own (super-uniform).
    #[arg(long, value_name = "X", default_value_t = 1.0)]
    super_uniform: f64,
    /// Gaussian taper that smooths like a beam of this width.
    #[arg(long, value_name = "ANGLE")]
    taper: Option<Angle>,
    /// Gaussian taper of the short baselines that removes structure wider than this.
    #[arg(long, value_name = "ANGLE")]
    inner_taper: Option<Angle>,
    /// Give every datum the same weight instead of the file's.
    #[arg(long)]
    unit_weights: bool,
    /// Stokes parameter or correlation to image.
    #[arg(long, value_name = "POL", default_value = "I")]
    pol: Polarization,
    /// Number of output channels; the channels are shared out evenly.
    #[arg(long, value_name = "N", default_value_t = 1)]
    channels_out: usize,
    /// Weigh each output channel with the density of all channels together.
    #[arg(long)]
    joint_weights: bool,
    /// Error of the transforms, relative.
    #[arg(long, value_name = "X", default_value_t = 1e-5)]
    epsilon: f64,
    /// Leave out the w term.
    #[arg(long)]
    no_w: bool,
    /// Restoring beam as MAJOR,MINOR,PA such as 12arcsec,8arcsec,30deg [default: fitted].
    #[arg(long, value_name = "BEAM")]
    beam: Option<String>,
}

impl ImagingArgs {
    /// The library's options.
    ///
    /// # Errors
    /// A scheme, size or beam that cannot be read.
    pub fn options(&self) -> Result<ImagingOptions> {
        let weighting = match self.weighting.as_str() {
            "natural" => Weighting::Natural,
            "uniform" => Weighting::Uniform,
            "briggs" => Weighting::Briggs { robust: self.robust },
            other => return Err(Failure::usage(format!("--weighting is {other:?}, expected natural, uniform or briggs"))),
        };
        Ok(ImagingOptions {
            size: self.size.as_deref().map(size).transpose()?,
            cell_rad: self.cell.map(|c| c.si()),
            polarization: self.pol,
            weights: WeightOptions {
                weighting,
                super_uniform: self.super_uniform,
                taper_rad: self.taper.map(|t| t.si()),
                inner_taper_rad: self.inner_taper.map(|t| t.si()),
            },
            unit_weights: self.unit_weights,
            channels_out: self.channels_out,
            weights_per_channel_out: !self.joint_weights,
            epsilon: self.epsilon,
            w_term: !self.no_w,
            beam: self.beam.as_deref().map(beam).transpose()?,
            ..ImagingOptions::default()
        })
    }
}

/// `512` or `512x256` as columns and rows.
fn size(text: &str) -> Result<(usize, usize)> {
    let (columns, rows) = text.split_once('x').unwrap_or((text, text));
    match (columns.trim().parse(), rows.trim().parse()) {
        (Ok(columns), Ok(rows)) => Ok((columns, rows)),
        _ => Err(Failure::usage(format!("--size is {text:?}, expected a number of pixels such as 512, or COLUMNSxROWS"))),
    }
}

fn beam(text: &str) -> Result<RestoringBeam> {
    let parts = text.split(',').map(|t| t.parse::<Angle>()).collect::<std::result::Result<Vec<_>, _>>();
    match parts.map_err(|e| Failure::usage(format!("--beam: {e}")))?.as_slice() {
        [major, minor, pa] if major.si() >= minor.si() && minor.si() > 0.0 => {
            Ok(RestoringBeam { bmaj_rad: major.si(), bmin_rad: minor.si(), bpa_rad: pa.si() })
        }
        _ => Err(Failure::usage(format!(
            "--beam is {text:?}, expected MAJOR,MINOR,PA with MAJOR at least MINOR, such as 12arcsec,8arcsec,30deg"
        ))),
    }
}
