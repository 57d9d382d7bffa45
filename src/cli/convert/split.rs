//! `convert --split`: writes the parts of a set as files of their own.

use super::args::ConvertArgs;
use super::cut::Parts;
use crate::cli::beside::Beside;
use crate::cli::context::{Context, Outcome};
use crate::cli::failure::{Context as _, Failure, Result};
use crate::cli::options::{OutputArgs, SetFiles};
use crate::cli::planned::check_room_for_set;
use crate::cli::ranks;
use crate::memory::MemoryBudget;
use cittert_arrays::{SpectralWindow, VisibilityBlock, VisibilityHeader, VisibilitySource};
use cittert_formats::{ColumnSink, CreateOptions};
use ndarray::{Array3, Axis, s};
use num_complex::Complex;
use serde_json::json;
use std::ops::Range;
use std::path::PathBuf;

/// Files that are written at a time. The set is read once for each such batch.
const BATCH: usize = 64;

/// A part, and its file once it has a row.
struct Part {
    path: PathBuf,
    group: usize,
    channels: Range<usize>,
    products: Range<usize>,
    sink: Option<Box<dyn ColumnSink>>,
    rows: usize,
}

/// Cut a set and write its parts. Several processes write some of the parts each.
///
/// # Errors
/// A cut that the set does not allow, an output that exists, a damaged input, or an error of the file system.
pub(super) fn split(args: &ConvertArgs, input: &SetFiles, source: &mut dyn VisibilitySource, context: &Context) -> Result<Outcome> {
    let reading = format!("splitting {input}");
    let parts = Parts::of(source, &args.split).context(&reading)?;
    let mut all = named(args, &parts)?;
    let out = OutputArgs { output: args.output.clone(), overwrite: args.overwrite };
    out.claim(all.iter().map(|p| &p.path), input.all())?;
    check_room_for_set(source, &args.output)?;
    let mut beside = match args.column.chosen() {
        None => Beside::open(input, &args.output)?,
        Some(_) => Beside::default(),
    };
    let mut lost = std::mem::take(&mut beside.lost);
    lost.extend(input.losses(&args.output, source.header())?);
    let mut notes = std::mem::take(&mut beside.notes);
    let mut header = source.header().clone();
    header.history.push(context.history());
    header.history.extend(notes.iter().cloned());
    let options =
        CreateOptions { overwrite: args.overwrite, append: false, compression: args.compression, columns: beside.columns.clone() };
    let processes = ranks::all();
    let (n, own) = (all.len(), own_parts(&parts, (processes.rank(), processes.size())));
    let some_only = own.len() < n || n > BATCH;
    for batch in all[own].chunks_mut(BATCH) {
        pass(source, &mut beside, (&parts, &mut *batch, some_only), &mut |part: &Part| {
            let created = cittert_formats::create_visibilities_with(&part.path, &header_of(&header, part)?, &options)?;
            notes.extend(created.notes.into_iter().filter(|n| !notes.contains(n)).collect::<Vec<_>>());
            Ok(created.sink)
        })
        .context(&reading)?;
        for part in batch {
            if let Some(sink) = part.sink.take() {
                let told = sink.finish_with_notes().context(format!("writing {}", part.path.display()))?;
                notes.extend(told.into_iter().filter(|n| !notes.contains(n)).collect::<Vec<_>>());
            }
        }
    }
    let told = processes.exchange(notes.join("\n").into_bytes());
    for note in told.iter().flat_map(|told| String::from_utf8_lossy(told).lines().map(str::to_owned).collect::<Vec<_>>()) {
        if !notes.contains(&note) {
            notes.push(note);
        }
    }
    notes.iter().chain(&lost).for_each(|note| context.console.note(note));
    let mut rows: Vec<f64> = all.iter().map(|part| part.rows as f64).collect();
    processes.sum(&mut rows);
    all.iter_mut().zip(rows).for_each(|(part, rows)| part.rows = rows as usize);
    all.retain(|part| part.rows > 0);
    if all.len() < n {
        context.console.note(&format!("{} parts have no rows, and no file", n - all.len()));
    }
    let files: Vec<_> = all.iter().map(|p| json!({ "output": p.path, "n_blts": p.rows })).collect();
    let text = all.iter().map(|p| format!("{}: {} rows", p.path.display(), p.rows)).collect::<Vec<_>>().join("\n");
    let json = json!({ "outputs": files, "n_blts": source.n_rows(), "notes": notes, "lost": lost });
    Ok(all.iter().fold(Outcome::new(json, text), |o, p| o.wrote(&p.path)))
}

/// The parts that a process writes: neighbours, with all parts of some groups of rows where there are enough groups.
fn own_parts(parts: &Parts, (rank, size): (usize, usize)) -> Range<usize> {
    let (unit, n) = if parts.groups() >= size { (parts.n() / parts.groups(), parts.groups()) } else { (1, parts.n()) };
    unit * (rank * n / size)..unit * ((rank + 1) * n / size)
}

/// The parts with the names of their files.
fn named(args: &ConvertArgs, parts: &Parts) -> Result<Vec<Part>> {
    let no_name = || Failure::usage(format!("{}: expected the name of a file", args.output.display()));
    let stem = args.output.file_stem().and_then(|s| s.to_str()).ok_or_else(no_name)?;
    let end = args.output.extension().and_then(|e| e.to_str()).map_or(String::new(), |e| format!(".{e}"));
    let mut all = Vec::with_capacity(parts.n());
    for group in 0..parts.groups() {
        for (c, channels) in parts.channels.iter().enumerate() {
            for (p, products) in parts.products.iter().enumerate() {
                let path = args.output.with_file_name(format!("{stem}{}{end}", parts.suffix(group, c, p)));
                all.push(Part { path, group, channels: channels.clone(), products: products.clone(), sink: None, rows: 0 });
            }
        }
    }
    Ok(all)
}

/// Read the set once and write the parts of a batch. With `skip`, runs of rows without a row of the batch are not read.
fn pass(
    source: &mut dyn VisibilitySource,
    beside: &mut Beside,
    (parts, batch, skip): (&Parts, &mut [Part], bool),
    create: &mut dyn FnMut(&Part) -> Result<Box<dyn ColumnSink>>,
) -> Result<()> {
    let header = source.header();
    let row_bytes = 17 * header.spectrum.n_chan() * header.polarizations.len() + 60;
    let step = (MemoryBudget::default().block() / row_bytes).max(1);
    let is_here = |groups: &[usize], batch: &[Part]| groups.iter().any(|g| batch.iter().any(|p| p.group == *g));
    let n_rows = source.n_rows();
    for start in (0..n_rows).step_by(step) {
        let range = start..(start + step).min(n_rows);
        if skip && !is_here(&parts.group_of_rows(&source.read_coverage(range.clone())?), batch) {
            continue;
        }
        let block = source.read_rows(range.clone())?;
        let columns = beside.read(range)?;
        let groups = parts.group_of_rows(&block.coverage);
        for part in batch.iter_mut() {
            let rows: Vec<usize> = (0..groups.len()).filter(|r| groups[*r] == part.group).collect();
            if rows.is_empty() {
                continue;
            }
            let cut = part.of_block(&block, &rows)?;
            let columns: Vec<Array3<Complex<f32>>> = columns.iter().map(|c| part.cut(c, &rows)).collect();
            let views: Vec<_> = columns.iter().map(|c| c.view()).collect();
            if part.sink.is_none() {
                part.sink = Some(create(part)?);
            }
            if let Some(sink) = &mut part.sink {
                sink.write_columns(&cut, &views)?;
            }
            part.rows += rows.len();
        }
    }
    Ok(())
}

impl Part {
    fn cut<T: Clone>(&self, all: &Array3<T>, rows: &[usize]) -> Array3<T> {
        all.slice(s![.., self.channels.clone(), self.products.clone()]).select(Axis(0), rows)
    }

    fn of_block(&self, block: &VisibilityBlock, rows: &[usize]) -> Result<VisibilityBlock> {
        Ok(VisibilityBlock::new(
            block.coverage.select(rows)?,
            self.cut(&block.vis, rows),
            self.cut(&block.weights, rows),
            self.cut(&block.flags, rows),
            self.cut(&block.nsamples, rows),
        )?)
    }
}

fn header_of(header: &VisibilityHeader, part: &Part) -> Result<VisibilityHeader> {
    let (s, range) = (&header.spectrum, part.channels.clone());
    let spectrum =
        SpectralWindow::with_windows(s.freq_hz()[range.clone()].to_vec(), s.width_hz()[range.clone()].to_vec(), s.spw()[range].to_vec())?;
    Ok(VisibilityHeader { spectrum, polarizations: header.polarizations[part.products.clone()].to_vec(), ..header.clone() })
}
