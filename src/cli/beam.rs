//! `beam`: the dirty beam.

use super::context::{Context, Outcome};
use super::failure::{Context as _, Result};
use super::options::{ColumnArgs, ImagingArgs, OutputArgs};
use super::text::angle;
use crate::imaging::{Imager, psf_image};
use cittert_formats::fits::{ImageOptions, write_image};
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

/// Options of `beam`.
#[derive(Debug, Args)]
pub struct BeamArgs {
    /// Visibilities.
    #[arg(value_name = "IN")]
    input: PathBuf,
    #[command(flatten)]
    column: ColumnArgs,
    #[command(flatten)]
    imaging: ImagingArgs,
    #[command(flatten)]
    out: OutputArgs,
}

/// Make the dirty beam and write it as FITS.
///
/// # Errors
/// Anything wrong with the file, the options or the disk.
pub fn run(args: &BeamArgs, context: &Context) -> Result<Outcome> {
    let path = &args.out.output;
    args.out.check(path)?;
    let mut source = args.column.open(&args.input)?;
    let what = format!("imaging {}", args.input.display());
    let mut imager = Imager::new(source.as_mut(), args.imaging.options()?, &context.console).context(&what)?;
    let (mut image, beams) = psf_image(&mut imager, &context.console).context(&what)?;
    image.history.push(context.history());
    write_image(path, &image, ImageOptions { overwrite: args.out.overwrite, ..ImageOptions::default() })?;
    let g = &image.grid;
    let mut json = json!({ "output": path, "size": [g.n_l, g.n_m], "cell_rad": g.cell_rad });
    let mut text = format!("{}: {} x {} pixels of {}", path.display(), g.n_l, g.n_m, angle(g.cell_rad));
    if let Some(b) = beams.first() {
        json["bmaj_rad"] = b.bmaj_rad.into();
        json["bmin_rad"] = b.bmin_rad.into();
        json["bpa_rad"] = b.bpa_rad.into();
        text += &format!("\nmain lobe {} x {}, position angle {:.1} deg", angle(b.bmaj_rad), angle(b.bmin_rad), b.bpa_rad.to_degrees());
    }
    Ok(Outcome::new(json, text).wrote(path))
}
