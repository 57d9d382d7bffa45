//! `predict`: the visibilities of a model for the rows of a set, or the data minus these visibilities.

use super::beside::{Beside, place_of};
use super::context::{Context, Outcome};
use super::failure::{Context as _, Failure, Result};
use super::options::{OutputArgs, SceneArgs, SetArgs, SetFiles, model_surface, range_file};
use super::planned::check_room_for_set;
use crate::ChainError;
use crate::calibrate::{Accuracy, ModelVisibilities, SkyPrediction};
use crate::memory::MemoryBudget;
use crate::nearfield::RangeChoice;
use crate::progress::{Event, Observer};
use crate::simulate::{SceneOptions, SkyModel};
use cittert_arrays::{ArrayError, PhaseCenter, VisibilityHeader, for_each_block};
use cittert_formats::{ColumnSink, CreateOptions, Edit, VisColumn};
use clap::Args;
use num_complex::Complex;
use std::path::{Path, PathBuf};

/// Options of `predict`.
#[derive(Debug, Args)]
pub struct PredictArgs {
    // Its rows, weights and flags are taken.
    #[command(flatten)]
    input: SetArgs,
    /// Model: FITS image (K, Jy/pixel or Jy/beam) or source list (CSV).
    #[arg(long, value_name = "FITS|CSV")]
    model: PathBuf,
    /// Write the data less the model.
    #[arg(long)]
    residual: bool,
    /// Write all that the input holds, with the prediction beside it in these columns: model, residual. `-o IN --overwrite` puts them
    /// into the input itself, and changes nothing else of it.
    #[arg(long, value_name = "COLUMN", value_delimiter = ',', conflicts_with = "residual", value_parser = ["model", "residual"])]
    into: Vec<String>,
    /// Predict the near field, a model at this distance: a plane across the boresight (10m), a sphere around the array (sphere:10m), a FITS image of distances in m, or
    /// auto (what the set says of its scene or its focus) [default: the far field].
    #[arg(long, value_name = "RANGE")]
    range: Option<RangeChoice>,
    /// Accuracy relative to the total flux.
    #[arg(long, default_value_t = 1e-6, value_name = "X")]
    epsilon: f64,
    /// Leave out the w term.
    #[arg(long)]
    no_w: bool,
    #[command(flatten)]
    out: OutputArgs,
}

/// The model of a file, placed around the phase centre of a set.
///
/// # Errors
/// A file that is no model, a set without a phase centre.
pub(super) fn load_model(path: &Path, header: &VisibilityHeader, context: &Context) -> Result<SkyModel> {
    let center: &PhaseCenter = header.phase_centers.first().ok_or_else(|| Failure::message("the set has no phase centre"))?;
    let file = SceneArgs { scene: path.to_path_buf(), how: SceneOptions::default() };
    Ok(file.load(center, &header.spectrum, context)?.sky)
}

/// The output, and what goes into it.
struct Output {
    sink: Box<dyn ColumnSink>,
    /// Columns of the input that are written again. In a copy that is changed they are there already.
    beside: Beside,
    /// Each quantity that is written beside the data, and its column in the output.
    columns: Vec<(VisColumn, VisColumn)>,
    /// True for a copy of the input, in which only these columns change.
    is_copy: bool,
}

impl Output {
    /// Begin the output. With columns beside the data it is a copy of the input, if both have the same format.
    fn begin(args: &PredictArgs, input: &SetFiles, header: &mut VisibilityHeader, context: &Context) -> Result<Self> {
        let path = &args.out.output;
        header.history.push(context.history());
        let wanted: Vec<VisColumn> = args.into.iter().filter_map(|name| VisColumn::named(name)).collect();
        if wanted.is_empty() {
            let options = CreateOptions { overwrite: args.out.overwrite, ..CreateOptions::default() };
            let created = cittert_formats::create_visibilities_with(path, header, &options)?;
            created.notes.iter().for_each(|n| context.console.note(n));
            return Ok(Self { sink: created.sink, beside: Beside::default(), columns: Vec::new(), is_copy: false });
        }
        let to = input.one().map_or_else(|| cittert_formats::format_to_write(path), |one| cittert_formats::format_of_output(one, path))?;
        let (mut columns, mut notes) = (Vec::new(), Vec::new());
        for what in VisColumn::ALL.into_iter().filter(|c| wanted.contains(c)) {
            let place = place_of(what, |c| to.keeps(c)).ok_or_else(|| {
                let text = format!("{} has no place for the column {:?} beside the data", to.name(), what.name());
                Failure::message(format!("{}: {text}: leave out --into, or write UVH5", path.display()))
            })?;
            if place != what {
                notes.push(format!("the column {:?} is kept as {:?}, as CASA's uvsub does", what.name(), place.name()));
            }
            columns.push((what, place));
        }
        let places = || columns.iter().map(|c| c.1);
        let lines = [context.history()].into_iter().chain(notes.iter().cloned()).collect();
        let edit = Edit { overwrite: args.out.overwrite, data: false, columns: places().collect(), history: lines };
        if let Some(created) = input.one().map_or(Ok(None), |one| cittert_formats::edit_visibilities(one, path, &edit))? {
            notes.iter().chain(&created.notes).for_each(|n| context.console.note(n));
            return Ok(Self { sink: created.sink, beside: Beside::default(), columns, is_copy: true });
        }
        let mut beside = places().fold(Beside::open(input, path)?, Beside::without);
        beside.notes.extend(notes);
        let lost = std::mem::take(&mut beside.lost);
        beside.notes.extend(lost);
        header.history.extend(beside.notes.iter().cloned());
        let all = beside.columns.iter().copied().chain(places()).collect();
        let options = CreateOptions { overwrite: args.out.overwrite, columns: all, ..CreateOptions::default() };
        let created = cittert_formats::create_visibilities_with(path, header, &options)?;
        beside.notes.iter().chain(&created.notes).for_each(|n| context.console.note(n));
        Ok(Self { sink: created.sink, beside, columns, is_copy: false })
    }

    fn only_residual(&self) -> bool {
        !self.columns.is_empty() && self.columns.iter().all(|c| c.0 == VisColumn::Residual)
    }
}

/// Predict a model on the rows of a set and write it, or the residual.
///
/// # Errors
/// A file or an option is wrong, or an error of the file system.
pub fn run(args: &PredictArgs, context: &Context) -> Result<Outcome> {
    let path = &args.out.output;
    let input = args.input.files()?;
    let map = args.range.as_ref().and_then(range_file);
    if args.into.is_empty() {
        args.out.claim([path.as_path()], input.all().iter().map(PathBuf::as_path).chain([args.model.as_path()]).chain(map))?;
    } else {
        // Columns may be added to the input in place: the new file replaces it when it is complete.
        let others: Vec<&Path> = [args.model.as_path()].into_iter().chain(map).collect();
        input.claim_or_edit(&args.out, &others)?;
    }
    let mut source = input.open(context)?;
    check_room_for_set(source.as_ref(), path)?;
    let mut header = source.header().clone();
    let surface = args.range.as_ref().map(|choice| model_surface(choice, &header.near_field)).transpose()?;
    let sky = load_model(&args.model, &header, context)?.at(surface);
    let what = format!("predicting {} on the rows of {}", args.model.display(), input);
    let mut model =
        SkyPrediction::new(&header, &sky, Accuracy { epsilon: args.epsilon, no_w: args.no_w }, &context.console).context(&what)?;
    let mut out = Output::begin(args, &input, &mut header, context)?;
    let mut lost = 0_u64;
    let (mut power, mut used) = (0.0, 0_u64);
    let console = &context.console;
    console.event(Event::Phase { name: "predicting", total: Some(source.n_rows() as u64), unit: "rows" });
    for_each_block::<ChainError>(source.as_mut(), MemoryBudget::default().block(), |first, mut block| {
        let mut predicted = model.predict(&header, first, &block.coverage)?;
        let mut residual = block.vis.clone();
        for ((at, m), left) in predicted.indexed_iter_mut().zip(&mut residual) {
            if !m.is_finite() {
                // In a copy, the flags stay as they are.
                block.flags[at] |= !out.is_copy;
                lost += 1;
                (*m, *left) = (Complex::new(0.0, 0.0), Complex::new(0.0, 0.0));
                continue;
            }
            *left -= *m;
            let told = if args.residual || out.only_residual() { *left } else { *m };
            if !block.flags[at] && told.is_finite() {
                power += f64::from(told.re).powi(2) + f64::from(told.im).powi(2);
                used += 1;
            }
        }
        console.event(Event::Advance(block.n_rows() as u64));
        if out.columns.is_empty() {
            block.vis = if args.residual { residual } else { predicted };
            return Ok(out.sink.write_block(&block)?);
        }
        let kept = out.beside.read(first..first + block.n_rows())?;
        let mut views: Vec<_> = kept.iter().map(|c| c.view()).collect();
        views.extend(out.columns.iter().map(|(what, _)| if *what == VisColumn::Model { predicted.view() } else { residual.view() }));
        out.sink.write_columns(&block, &views).map_err(ArrayError::from)?;
        Ok(())
    })
    .context(&what)?;
    console.event(Event::Done);
    let (only_residual, fate) = (out.only_residual(), if out.is_copy { "their model is 0" } else { "they are flagged" });
    out.sink.finish().context(format!("{}", path.display()))?;
    if lost > 0 {
        console.warn(&format!("{lost} visibilities lie at coordinates that are not finite: {fate}"));
    }
    let rms = if used > 0 { (power / used as f64).sqrt() } else { 0.0 };
    let (n_rows, unit) = (source.n_rows(), header.unit.name());
    let json = serde_json::json!({
        "output": path, "n_blts": n_rows, "residual": args.residual, "into": args.into, "rms": rms, "unit": unit, "n_unflagged": used, "n_without_model": lost,
    });
    let kind = if args.residual || only_residual { "residual" } else { "model" };
    Ok(Outcome::new(json, format!("{}: {n_rows} rows, {kind} of rms {rms:.5e} {unit}", path.display())).wrote(path))
}
