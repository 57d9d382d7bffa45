//! `predict`: the visibilities of a model for the rows of a set, or the data minus these visibilities.

use super::beside::{Beside, place_of};
use super::context::{Context, Outcome};
use super::failure::{Context as _, Failure, Result};
use super::forecast::{FirstRows, Plan, Planner, Sampling, Told, format_of};
use super::options::{OutputArgs, SceneArgs, SetArgs, SetFiles, model_surface, range_file};
use super::planned::check_room_for_set;
use super::ranks;
use crate::ChainError;
use crate::calibrate::{Accuracy, ModelVisibilities, SkyPrediction};
use crate::cost;
use crate::memory::MemoryBudget;
use crate::nearfield::RangeChoice;
use crate::progress::{Event, Observer};
use crate::simulate::{Method, SceneOptions, SkyModel};
use cittert_arrays::{
    Alone, ArrayError, InTurn, PhaseCenter, VisibilityBlock, VisibilityHeader, VisibilitySink, VisibilitySource, for_each_block,
    rows_of_block,
};
use cittert_formats::{ColumnSink, CreateOptions, Edit, VisColumn};
use clap::Args;
use ndarray::Array3;
use num_complex::Complex;
use std::path::{Path, PathBuf};
use std::sync::Arc;

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
    /// Other processes than 0 have none.
    sink: Option<Box<dyn ColumnSink>>,
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
            let create = || cittert_formats::create_visibilities_with(path, header, &options);
            let created = (!ranks::is_silent()).then(create).transpose()?;
            created.iter().flat_map(|c| &c.notes).for_each(|n| context.console.note(n));
            let sink = created.map(|c| c.sink);
            return Ok(Self { sink, beside: Beside::default(), columns: Vec::new(), is_copy: false });
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
            return Ok(Self { sink: Some(created.sink), beside: Beside::default(), columns, is_copy: true });
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
        Ok(Self { sink: Some(created.sink), beside, columns, is_copy: false })
    }

    fn only_residual(&self) -> bool {
        !self.columns.is_empty() && self.columns.iter().all(|c| c.0 == VisColumn::Residual)
    }
}

/// Predicts blocks, and adds up what is written.
struct Tally<'a> {
    header: &'a VisibilityHeader,
    /// In a copy, the flags stay as they are.
    keeps_flags: bool,
    /// Count the residual instead of the model.
    residual: bool,
    /// The sum of squares and the number of unflagged visibilities, and how many have no model.
    sums: [f64; 3],
}

impl Tally<'_> {
    /// The model of a block, and the data less the model.
    fn predict(&mut self, model: &mut SkyPrediction<'_>, first: usize, block: &mut VisibilityBlock) -> Result<(Cube, Cube), ChainError> {
        let mut predicted = model.predict(self.header, first, &block.coverage)?;
        let mut residual = block.vis.clone();
        let [power, used, lost] = &mut self.sums;
        for ((at, m), left) in predicted.indexed_iter_mut().zip(&mut residual) {
            if !m.is_finite() {
                block.flags[at] |= !self.keeps_flags;
                *lost += 1.0;
                (*m, *left) = (Complex::new(0.0, 0.0), Complex::new(0.0, 0.0));
                continue;
            }
            *left -= *m;
            let told = if self.residual { *left } else { *m };
            if !block.flags[at] && told.is_finite() {
                *power += f64::from(told.re).powi(2) + f64::from(told.im).powi(2);
                *used += 1.0;
            }
        }
        Ok((predicted, residual))
    }
}

/// Visibilities \[blt, chan, pol\].
type Cube = Array3<Complex<f32>>;

/// Predict all rows, by processes in turn.
fn in_turn(
    source: &mut dyn VisibilitySource,
    model: &mut SkyPrediction<'_>,
    tally: &mut Tally<'_>,
    turns: &mut InTurn<'_>,
    observer: &dyn Observer,
) -> Result<(), ChainError> {
    let (n_rows, step) = (source.n_rows(), rows_of_block(source.header(), MemoryBudget::default().block()));
    for start in (0..n_rows).step_by(step) {
        let end = (start + step).min(n_rows);
        if turns.processes() > 1 {
            model.cover(&source.read_coverage(start..end)?)?;
        }
        let share = (end - start).div_ceil(turns.processes());
        for first in (start..end).step_by(share) {
            let rows = first..(first + share).min(end);
            let mut own = None;
            if turns.is_own() {
                let mut block = source.read_rows(rows.clone())?;
                let (predicted, residual) = tally.predict(model, first, &mut block)?;
                block.vis = if tally.residual { residual } else { predicted };
                own = Some(block);
            }
            turns.write(own)?;
            observer.event(Event::Advance(rows.len() as u64));
        }
    }
    Ok(())
}

/// Predict a model on the rows of a set and write it, or the residual.
///
/// # Errors
/// A file or an option is wrong, or an error of the file system.
pub fn run(args: &PredictArgs, context: &Context) -> Result<Outcome> {
    let path = &args.out.output;
    let input = args.input.files()?;
    if !args.into.is_empty() {
        ranks::refuse_several("predict then writes no columns beside the data. Leave out --into, or start it without mpirun")?;
    }
    let map = args.range.as_ref().and_then(range_file);
    if args.into.is_empty() {
        args.out.claim([path.as_path()], input.all().iter().map(PathBuf::as_path).chain([args.model.as_path()]).chain(map))?;
    } else {
        // Columns may be added to the input in place: the new file replaces it when it is complete.
        let others: Vec<&Path> = [args.model.as_path()].into_iter().chain(map).collect();
        input.claim_or_edit(&args.out, &others)?;
    }
    // Several processes predict blocks of rows in turn, so each has all rows at hand.
    let mut source = input.open_whole(context)?;
    check_room_for_set(source.as_ref(), path)?;
    let mut header = source.header().clone();
    let surface = args.range.as_ref().map(|choice| model_surface(choice, &header.near_field)).transpose()?;
    let sky = load_model(&args.model, &header, context)?.at(surface);
    let what = format!("predicting {} on the rows of {}", args.model.display(), input);
    let mut model =
        SkyPrediction::new(&header, &sky, Accuracy { epsilon: args.epsilon, no_w: args.no_w }, &context.console).context(&what)?;
    let mut out = Output::begin(args, &input, &mut header, context)?;
    let console = &context.console;
    console.event(Event::Phase { name: "predicting", total: Some(source.n_rows() as u64), unit: "rows" });
    let residual = args.residual || out.only_residual();
    let mut tally = Tally { header: &header, keeps_flags: out.is_copy, residual, sums: [0.0; 3] };
    if out.columns.is_empty() {
        let mut turns = InTurn::new(ranks::all(), out.sink.as_deref_mut().map(|sink| sink as &mut dyn VisibilitySink));
        in_turn(source.as_mut(), &mut model, &mut tally, &mut turns, console).context(&what)?;
    } else {
        for_each_block::<ChainError>(source.as_mut(), MemoryBudget::default().block(), |first, mut block| {
            let (predicted, residual) = tally.predict(&mut model, first, &mut block)?;
            console.event(Event::Advance(block.n_rows() as u64));
            let kept = out.beside.read(first..first + block.n_rows())?;
            let mut views: Vec<_> = kept.iter().map(|c| c.view()).collect();
            views.extend(out.columns.iter().map(|(what, _)| if *what == VisColumn::Model { predicted.view() } else { residual.view() }));
            out.sink.iter_mut().try_for_each(|sink| sink.write_columns(&block, &views)).map_err(ArrayError::from)?;
            Ok(())
        })
        .context(&what)?;
    }
    console.event(Event::Done);
    let mut sums = tally.sums;
    ranks::all().sum(&mut sums);
    let ([power, used, lost], fate) = (sums, if out.is_copy { "their model is 0" } else { "they are flagged" });
    let only_residual = out.only_residual();
    out.sink.map_or(Ok(()), |sink| sink.finish()).context(format!("{}", path.display()))?;
    let (used, lost) = (used as u64, lost as u64);
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

impl Plan for PredictArgs {
    fn plan(&self, planner: &Planner<'_>) -> Result<Told> {
        let input = self.input.files()?;
        let mut source = input.open(planner.context)?;
        let header = source.header().clone();
        let sky = load_model(&self.model, &header, planner.context)?;
        let (n_rows, spectrum) = (source.n_rows(), &header.spectrum);
        let share = planner.stretch((n_rows * spectrum.n_chan()) as f64)? / planner.ranks as f64;
        let block_rows = rows_of_block(&header, MemoryBudget::default().block());
        let coverage = source.read_coverage(0..block_rows.min(n_rows))?;
        let how = Sampling {
            rows: n_rows as f64 * share,
            channels: spectrum.freq_hz().to_vec(),
            subchannels: 1,
            products: header.polarizations.len(),
            block_rows,
            method: Method::Degrid,
            epsilon: self.epsilon,
            no_w: self.no_w,
        };
        let format = format_of(&input, planner.context)?;
        if let Some(choice) = &self.range {
            let (work, facts) = how.near_work(&sky, &model_surface(choice, &header.near_field)?, &header)?;
            return Ok(Told { command: "predict", forecast: cost::predict(&work, format), facts });
        }
        let (work, facts) = how.work(&sky, coverage.uvw_m)?;
        let of = |n: f64| cost::predict(&work.of_rows(n), format);
        // Columns beside the data are written otherwise.
        let exists = self.into.is_empty() && input.exist(planner.context);
        let stages = (&["read", "predict"][..], n_rows);
        let forecast = planner.tried(
            (of(work.rows), exists),
            stages,
            source.as_mut(),
            |_, n| Ok(of(n as f64)),
            |source, n, (folder, watch)| {
                let mut rows = FirstRows::new(source, n);
                let accuracy = Accuracy { epsilon: self.epsilon, no_w: self.no_w };
                let mut model = SkyPrediction::new(&header, &sky, accuracy, watch)?;
                let mut sink = cittert_formats::create_visibilities(&folder.join("set.uvh5"), &header, false)?.sink;
                let mut tally = Tally { header: &header, keeps_flags: false, residual: self.residual, sums: [0.0; 3] };
                in_turn(&mut rows, &mut model, &mut tally, &mut InTurn::new(Arc::new(Alone), Some(sink.as_mut())), watch)?;
                Ok(sink.finish()?)
            },
        )?;
        Ok(Told { command: "predict", forecast, facts })
    }

    fn output(&self) -> &Path {
        &self.out.output
    }
}
