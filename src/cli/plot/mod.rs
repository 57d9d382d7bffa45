//! `plot`: a picture of images, a visibility set, a gain table or a layout.

mod args;
mod gains;
mod images;
mod layouts;
mod title;
mod visibilities;

use super::context::{Context, Outcome};
use super::failure::{Failure, Result};
use super::options::{SetFiles, load_layout};
use crate::plot::{Picture, PictureFormat};
pub use args::PlotArgs;
use cittert_arrays::BuiltinLayout;
use cittert_formats::{Holds, format_of};

/// Draw a picture.
///
/// # Errors
/// A file that cannot be drawn, options that do not suit the file, or an error of the file system.
pub fn run(args: &PlotArgs, context: &Context) -> Result<Outcome> {
    let format = PictureFormat::of(&args.out.output).map_err(Failure::call)?;
    let args = &PlotArgs { files: SetFiles::of(&args.files)?.all().to_vec(), ..args.clone() };
    args.out.claim([&args.out.output], args.inputs())?;
    let file = draw(args, context)?.file(format)?;
    args.out.write(&args.out.output, &file)?;
    let json = serde_json::json!({ "output": args.out.output, "bytes": file.len() });
    Ok(Outcome::new(json, args.out.output.display().to_string()).wrote(&args.out.output))
}

fn draw(args: &PlotArgs, context: &Context) -> Result<Picture> {
    let name = args.file().to_string_lossy();
    // The name of a built-in layout is no file.
    let holds = if BuiltinLayout::find(&name).is_some() { None } else { Some(format_of(args.file())?.holds()) };
    args.check(&name, holds)?;
    match holds {
        None | Some(Holds::Layouts(_)) => layouts::draw(args, &load_layout(&name)?),
        Some(Holds::Images(_)) => images::draw(args, context),
        Some(Holds::Visibilities(_)) => visibilities::draw(args, context),
        Some(Holds::Gains(_)) => gains::draw(args),
        Some(Holds::Sources(_)) => {
            Err(Failure::usage(format!("{name}: this is a source list; expected an image, visibilities, gains or a layout")))
        }
    }
}
