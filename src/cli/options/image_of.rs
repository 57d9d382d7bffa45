//! The arguments and steps that `beam`, `dirty` and `grid` share: one set of visibilities, one image, one output.

use super::{ColumnArgs, OutputArgs, SetArgs, range_file, with_range};
use crate::cli::context::Context;
use crate::cli::failure::{Context as _, Result};
use crate::cli::forecast::{FirstRows, Planner, Told, facts, format_of, say_waves, waves_of_image};
use crate::cost::{Forecast, InputFormat, WavePasses};
use crate::imaging::{ImageSize, Imager, ImagingOptions, Outlook};
use crate::progress::Observer;
use cittert_arrays::quantity::Angle;
use cittert_arrays::{Image, VisibilitySource};
use clap::Args;
use std::path::{Path, PathBuf};

/// The visibilities, the options of their image, and the output.
#[derive(Debug, Clone, Args)]
pub struct ImageOfArgs {
    #[command(flatten)]
    input: SetArgs,
    #[command(flatten)]
    column: ColumnArgs,
    #[command(flatten)]
    imaging: ImagingOptions,
    /// Where the result goes.
    #[command(flatten)]
    pub out: OutputArgs,
}

/// Makes an image of a set, and writes it under this name.
pub type Perform<'a> = dyn Fn(&mut dyn VisibilitySource, ImagingOptions, (&Path, &dyn Observer)) -> Result<()> + 'a;

impl ImageOfArgs {
    /// Check the output, open the set, and pass its imager to `work`. Errors name the work and the file.
    ///
    /// # Errors
    /// The file or an option is wrong, and the errors of `work`.
    pub fn imaged<R>(&self, doing: &str, context: &Context, work: impl FnOnce(&mut Imager<'_>) -> crate::Result<R>) -> Result<R> {
        self.imaged_by(|source, options, observer| Imager::new(source, options, observer), (doing, context), work)
    }

    /// [`ImageOfArgs::imaged`] where `work` makes one dirty image. It may be made while the set is read.
    ///
    /// # Errors
    /// As [`ImageOfArgs::imaged`].
    pub fn imaged_once<R>(&self, doing: &str, context: &Context, work: impl FnOnce(&mut Imager<'_>) -> crate::Result<R>) -> Result<R> {
        self.imaged_by(|source, options, observer| Imager::of_one_image(source, options, observer), (doing, context), work)
    }

    fn imaged_by<R>(
        &self,
        make: impl for<'a> FnOnce(&'a mut dyn VisibilitySource, ImagingOptions, &dyn Observer) -> crate::Result<Imager<'a>>,
        (doing, context): (&str, &Context),
        work: impl FnOnce(&mut Imager<'_>) -> crate::Result<R>,
    ) -> Result<R> {
        let input = self.input.files()?;
        let map = self.imaging.range.as_ref().and_then(range_file);
        self.out.claim([&self.out.output], input.all().iter().map(PathBuf::as_path).chain(map))?;
        let imaging = with_range(&self.imaging)?;
        let mut source = input.open_chosen(&self.column, context)?;
        let what = format!("{doing} {input}");
        let mut imager = make(source.as_mut(), imaging, &context.console).context(&what)?;
        work(&mut imager).context(&what)
    }

    /// The work of a command on the set: `work` makes the forecast from the outlook, the format and the number of threads, and `passes` says how often
    /// spherical waves pass through an image of a scene near the array. `perform` makes the image of a set and writes it into a folder, by which the forecast
    /// learns the pace of this machine.
    ///
    /// # Errors
    /// The file or an option is wrong.
    pub fn planned(
        &self,
        command: &'static str,
        planner: &Planner<'_>,
        (work, passes): (impl Fn(&Outlook, InputFormat, usize) -> Forecast, impl Fn(&Outlook) -> WavePasses),
        perform: Option<&Perform<'_>>,
    ) -> Result<Told> {
        let input = self.input.files()?;
        let mut source = input.open_chosen(&self.column, planner.context)?;
        let (mut outlook, _) = planner.outlook(source.as_mut(), &self.imaging)?;
        let waves = waves_of_image(&self.imaging, source.header(), &mut outlook, planner)?;
        let format = format_of(&input, planner.context)?;
        let mut forecast = work(&outlook, format, planner.threads);
        let mut facts = facts(&outlook);
        if let Some(waves) = waves {
            forecast = waves.put_into(forecast, &outlook, &passes(&outlook));
            say_waves(&waves, &outlook, &mut facts);
        } else if let Some(perform) = perform {
            let stages: Vec<&str> = forecast.stages.iter().map(|s| s.name).filter(|name| *name != "start").collect();
            let (rows, exists) = (source.n_rows(), input.exist(planner.context));
            // Some of the rows would choose another image.
            let grid = &outlook.grid;
            let (size, cell) = (ImageSize { columns: grid.n_l, rows: grid.n_m }, Angle(grid.cell_rad));
            let of_rows = |n: usize| match n < rows {
                true => ImagingOptions { size: Some(size), cell: Some(cell), ..self.imaging.clone() },
                false => self.imaging.clone(),
            };
            forecast = planner.tried(
                (forecast, exists),
                (&stages, rows),
                source.as_mut(),
                |source, n| Ok(work(&planner.outlook(&mut FirstRows::new(source, n), &of_rows(n))?.0, format, planner.threads)),
                |source, n, (folder, watch)| {
                    let mut rows = FirstRows::new(source, n);
                    let all: &mut dyn VisibilitySource = &mut rows;
                    perform(all, of_rows(n), (&folder.join("image.fits"), watch)).context(format!("imaging {input}"))
                },
            )?;
        }
        Ok(Told { command, forecast, facts })
    }

    /// Refuse a range, where the result is no image.
    ///
    /// # Errors
    /// A range.
    pub fn no_range(&self, instead: &str) -> Result<()> {
        super::no_range(&self.imaging, instead)
    }

    /// The set once more, and its options.
    ///
    /// # Errors
    /// The file or an option is wrong.
    pub fn opened(&self, context: &Context) -> Result<(Box<dyn VisibilitySource>, &ImagingOptions)> {
        Ok((self.input.files()?.open_chosen(&self.column, context)?, &self.imaging))
    }

    /// Check that an additional output can be written, and is not the input or the output.
    ///
    /// # Errors
    /// It exists, or it is one of these files.
    pub fn claim_beside(&self, path: &Path) -> Result<()> {
        self.out.claim([path, &self.out.output], self.input.files()?.all())
    }

    /// Write the image as FITS with the command line in its history, and return its path.
    ///
    /// # Errors
    /// An error of the file system.
    pub fn write<P: Copy + Into<f64> + Sync>(&self, image: &mut Image<P>, context: &Context) -> Result<&Path> {
        self.out.image(&self.out.output, image, context)?;
        Ok(&self.out.output)
    }
}
