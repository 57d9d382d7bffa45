//! Pictures of visibility sets.

use super::args::{PlotArgs, What};
use super::layouts::antennas;
use super::title;
use crate::ChainError;
use crate::calibrate::{Accuracy, ModelVisibilities, SkyPrediction};
use crate::cli::context::Context;
use crate::cli::failure::{Context as _, Result};
use crate::cli::options::SetFiles;
use crate::cli::predict::load_model;
use crate::memory::MemoryBudget;
use crate::plot::{DEFAULT_HEIGHT, DEFAULT_WIDTH, ModelPlot, Picture, VisPlot, uv_coverage};
use cittert_arrays::{UvCoverage, VisibilitySource, for_each_block};
use cittert_formats::{JoinedSource, VisColumn};

/// Largest number of rows of coverage that a picture shows.
const MOST_ROWS: usize = 400_000;

pub(super) fn draw(args: &PlotArgs, context: &Context) -> Result<Picture> {
    let files = SetFiles::of(&args.files)?;
    let mut source = files.open(context)?;
    let reading = format!("reading {files}");
    let (width, height) = args.size(DEFAULT_WIDTH, DEFAULT_HEIGHT);
    let titled = |what: &str, source: &dyn VisibilitySource| args.title_or(|| title::of_visibilities(what, source.header()));
    let drawn = match args.what {
        Some(What::Antennas) => return antennas(args, &source.header().layout),
        Some(What::Uv) => {
            let coverage = coverage(source.as_mut()).context(&reading)?;
            let title = args.title_or(|| title::of_coverage(source.header()));
            uv_coverage(&coverage, &source.header().spectrum, &title, width, height)
        }
        Some(What::Model) => {
            let title = titled("Data and model", source.as_ref());
            model(args, &files, source.as_mut(), context).context(&reading)?.draw(&title, width, height)
        }
        _ => {
            let title = titled("Visibilities", source.as_ref());
            let mut plot = VisPlot::new(source.header());
            for_each_block(source.as_mut(), MemoryBudget::default().block(), |_, block| -> Result<()> {
                plot.add(&block);
                Ok(())
            })
            .context(&reading)?;
            plot.draw(&title, width, height)
        }
    };
    drawn.context(format!("drawing {files}"))
}

/// The data beside a model: that of a file, or the column of the set.
fn model(args: &PlotArgs, files: &SetFiles, source: &mut dyn VisibilitySource, context: &Context) -> Result<ModelPlot> {
    let header = source.header().clone();
    let mut plot = ModelPlot::new(&header);
    let budget = MemoryBudget::default().block();
    let Some(path) = &args.model else {
        let mut column: Box<dyn VisibilitySource> = match files.one() {
            Some(one) => cittert_formats::open_column(one, VisColumn::Model)?,
            None => Box::new(JoinedSource::open(files.all(), VisColumn::Model)?),
        };
        for_each_block::<ChainError>(source, budget, |first, block| {
            plot.add(&block, column.read_rows(first..first + block.n_rows())?.vis.view());
            Ok(())
        })?;
        return Ok(plot);
    };
    let sky = load_model(path, &header, context)?;
    let accuracy = Accuracy { epsilon: 1e-6, no_w: false };
    let mut model = SkyPrediction::new(&header, &sky, accuracy, &context.console).context(format!("predicting {}", path.display()))?;
    for_each_block::<ChainError>(source, budget, |first, block| {
        plot.add(&block, model.predict(&header, first, &block.coverage)?.view());
        Ok(())
    })?;
    Ok(plot)
}

/// The u-v coverage of a set, thinned evenly to the number of rows that a picture can show.
fn coverage(source: &mut dyn VisibilitySource) -> Result<UvCoverage> {
    let every = source.n_rows().div_ceil(MOST_ROWS).max(1);
    let mut kept = UvCoverage::empty();
    for_each_block(source, MemoryBudget::default().block(), |first, block| -> Result<()> {
        let rows: Vec<usize> = (0..block.n_rows()).filter(|r| (first + r) % every == 0).collect();
        kept.append(&block.coverage.select(&rows)?)?;
        Ok(())
    })?;
    Ok(kept)
}
