//! Changes to a copy of a Measurement Set: columns of visibilities, or the data with their weights and flags, and HISTORY. Every other column,
//! keyword and subtable stays as it is.

use super::codes::name_of;
use super::index::Run;
use super::keywords::Place;
use super::read::{Channels, MsSource};
use super::schema;
use super::subtables::{add_history, now_mjd_s};
use super::table::{Kind, Manager, Table, check_space};
use super::write::tile;
use crate::atomic::{AtomicDir, Replaces};
use crate::columns::{check_columns, check_rows};
use crate::{ColumnSink, Edit, FormatError, Result, VisColumn};
use cittert_arrays::{ArrayError, VisUnit, VisibilityBlock, VisibilitySink, VisibilitySource};
use ndarray::ArrayView3;
use num_complex::Complex;
use std::path::{Path, PathBuf};

/// Room that casacore needs besides the visibilities, bytes.
const RESERVE: u64 = 8 << 20;
/// Frame of directions. The columns that are added here have none.
pub(super) const NO_FRAME: &str = "ICRS";

/// A copy of a Measurement Set that is being changed.
#[derive(Debug)]
pub(super) struct MsEdit {
    // This order closes the tables before the directory is removed or renamed.
    pub(super) set: MsSource,
    dir: AtomicDir,
    pub(super) path: PathBuf,
    columns: Vec<&'static str>,
    data: bool,
    rows: usize,
}

/// A run of rows of one window, with the place of each of its cells in a block.
pub(super) struct Cells {
    pub(super) run: Run,
    pub(super) window: Channels,
    /// Products and channels of a row.
    pub(super) shape: [usize; 2],
    pub(super) places: Vec<usize>,
}

impl MsEdit {
    /// Begin a copy.
    pub(super) fn begin(from: &Path, to: &Path, edit: &Edit) -> Result<Self> {
        let no_place = |c: &VisColumn| FormatError::unsupported(to, format!("a Measurement Set has no column {:?}", c.name()));
        let columns = edit.columns.iter().map(|c| name_of(*c).ok_or_else(|| no_place(c))).collect::<Result<Vec<_>>>()?;
        let dir = AtomicDir::create(to, edit.overwrite, Replaces::Holding("table.dat"))?;
        dir.fill_from(from)?;
        let mut main = Table::open_to_change(dir.path(), to)?;
        history(&mut main, dir.path(), to, &edit.history)?;
        // The set itself has the same flaw, and its error names the file that the user knows.
        let flaw = |e| MsSource::open(from, VisColumn::Data).err().unwrap_or(e);
        let set = MsSource::of(main, dir.path(), VisColumn::Data).map_err(flaw)?;
        let mut new = Self { set, dir, path: to.into(), columns: columns.clone(), data: edit.data, rows: 0 };
        columns.into_iter().try_for_each(|column| new.add(column))?;
        Ok(new)
    }

    /// Add a column of visibilities, unless there is one.
    fn add(&mut self, column: &'static str) -> Result<()> {
        if self.set.main.column_ndim(column, Kind::Complex)?.is_some() {
            return Ok(());
        }
        let manager = Manager::TiledShape(tile(self.set.order.len(), self.longest_window()));
        schema::add(&mut self.set.main, &schema::main_column(column), &manager, &format!("Cittert{column}"), NO_FRAME)?;
        if self.set.header().unit == VisUnit::Jy {
            self.set.main.put_keyword_text(Place::column(column, "QuantumUnits"), &["Jy"], false)?;
        }
        Ok(())
    }

    pub(super) fn longest_window(&self) -> usize {
        self.set.windows.iter().map(|w| w.n).max().unwrap_or(1)
    }

    /// The place in a block of each cell of a run of rows, in the order of the file.
    fn places(&self, run: Run, window: Channels) -> Vec<usize> {
        let (_, n_chan, n_pol) = self.set.header().shape(0);
        let mut product_of = vec![0; n_pol];
        self.set.order.iter().enumerate().for_each(|(pol, stored)| product_of[*stored] = pol);
        let mut places = Vec::with_capacity(run.rows * window.n * n_pol);
        for row in run.at..run.at + run.rows {
            for chan in window.first..window.first + window.n {
                let first = (row * n_chan + chan) * n_pol;
                places.extend(product_of.iter().map(|pol| first + pol));
            }
        }
        places
    }

    /// Write the visibilities of a run of rows, as the reader found them.
    fn put_vis(&mut self, column: &str, cells: &Cells, values: &ArrayView3<'_, Complex<f32>>) -> Result<()> {
        let set = &mut self.set;
        let values = values.as_standard_layout();
        let values = values.as_slice().unwrap_or_default();
        let vis: Vec<_> = cells.places.iter().map(|k| if set.flipped { values[*k].conj() } else { values[*k] }).collect();
        set.main.put(column, cells.run.start, &cells.shape, &vis)
    }

    /// Add the flags that are new in a run of rows.
    fn put_flags(&mut self, cells: &Cells, block: &VisibilityBlock, before: &VisibilityBlock) -> Result<()> {
        let (now, then) = (block.flags.as_standard_layout(), before.flags.as_standard_layout());
        let (now, then) = (now.as_slice().unwrap_or_default(), then.as_slice().unwrap_or_default());
        let new = |k: &usize| now[*k] && !then[*k];
        if !cells.places.iter().any(new) {
            return Ok(());
        }
        let mut flags = vec![false; cells.places.len()];
        self.set.main.get_into("FLAG", cells.run.start, &cells.shape, &mut flags)?;
        flags.iter_mut().zip(&cells.places).for_each(|(flag, k)| *flag |= new(k));
        self.set.main.put("FLAG", cells.run.start, &cells.shape, &flags)
    }

    fn complete(mut self) -> Result<()> {
        check_rows(&self.path, self.rows, self.set.n_rows())?;
        self.set.main.flush()?;
        let Self { set, dir, .. } = self;
        drop(set);
        dir.commit()
    }
}

/// Add lines to HISTORY, which is made where a set has none.
fn history(main: &mut Table, folder: &Path, label: &Path, lines: &[String]) -> Result<()> {
    if lines.is_empty() {
        return Ok(());
    }
    let place = folder.join("HISTORY");
    if place.join("table.dat").is_file() {
        let mut table = Table::open_to_change(&place, &label.join("HISTORY"))?;
        add_history(&mut table, lines, now_mjd_s())?;
        return table.flush();
    }
    let mut table = schema::create_subtable(folder, label, "HISTORY", NO_FRAME)?;
    add_history(&mut table, lines, now_mjd_s())?;
    table.flush()?;
    main.put_table_keyword("HISTORY", &table)
}

impl ColumnSink for MsEdit {
    fn write_columns(&mut self, block: &VisibilityBlock, columns: &[ArrayView3<'_, Complex<f32>>]) -> Result<()> {
        self.set.header().check_block(block).map_err(|e| FormatError::values(&self.path, e))?;
        check_columns(&self.path, block, columns, self.columns.len())?;
        // A column that is there already takes no more room, but casacore may need it all the same.
        let bytes = block.vis.len() * (8 * columns.len() + if self.data { 4 } else { 0 });
        check_space(self.dir.path(), &self.path, bytes as u64 + RESERVE)?;
        let range = self.rows..self.rows + block.n_rows();
        let before = if self.data { Some(self.set.read_weights(range.clone())?) } else { None };
        for k in 0..self.set.windows.len() {
            let window = self.set.windows[k];
            for run in self.set.index.runs(range.clone(), k).into_iter().filter(|run| run.rows > 0) {
                let cells = Cells { run, window, shape: [self.set.order.len(), window.n], places: self.places(run, window) };
                for (at, values) in columns.iter().enumerate() {
                    self.put_vis(self.columns[at], &cells, values)?;
                }
                if let Some(before) = &before {
                    self.put_vis("DATA", &cells, &block.vis.view())?;
                    self.put_flags(&cells, block, before)?;
                    self.put_weights(&cells, block, before)?;
                }
            }
        }
        self.rows = range.end;
        Ok(())
    }
}

impl VisibilitySink for MsEdit {
    fn write_block(&mut self, block: &VisibilityBlock) -> Result<(), ArrayError> {
        Ok(self.write_columns(block, &[])?)
    }

    fn finish(self: Box<Self>) -> Result<(), ArrayError> {
        Ok(self.complete()?)
    }
}
