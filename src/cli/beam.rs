//! `beam`: the dirty beam.

use super::context::{Context, Outcome};
use super::failure::Result;
use super::options::ImageOfArgs;
use super::text::{angle, beam, note_beam};
use crate::imaging::psf_image;
use clap::Args;
use serde_json::json;

/// Options of `beam`.
#[derive(Debug, Args)]
pub struct BeamArgs {
    #[command(flatten)]
    of: ImageOfArgs,
}

/// Make the dirty beam and write it as FITS.
///
/// # Errors
/// The file or an option is wrong, or an error of the file system.
pub fn run(args: &BeamArgs, context: &Context) -> Result<Outcome> {
    let (mut image, beams) = args.of.imaged("imaging", context, |imager| psf_image(imager, &context.console))?;
    let path = args.of.write(&mut image, context)?;
    let g = &image.grid;
    let mut json = json!({ "output": path, "size": [g.n_l, g.n_m], "cell_rad": g.cell_rad });
    let mut text = format!("{}: {} x {} pixels of {}", path.display(), g.n_l, g.n_m, angle(g.cell_rad));
    note_beam(&mut json, &beams);
    if let Some(b) = beams.first() {
        text += &format!("\nmain lobe {}", beam(b));
    }
    Ok(Outcome::new(json, text).wrote(path))
}
