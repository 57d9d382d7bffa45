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

    /// Write the visibilities of a run of rows, as the reader found them.
    fn put_vis(&mut self, column: &str, run: Run, window: Channels, values: &ArrayView3<'_, Complex<f32>>) -> Result<()> {
        let set = &mut self.set;
        let n_pol = set.order.len();
        let mut cells = vec![Complex::default(); run.rows * window.n * n_pol];
        for row in 0..run.rows {
            for chan in 0..window.n {
                for (pol, stored) in set.order.iter().enumerate() {
                    let v = values[[run.at + row, window.first + chan, pol]];
                    cells[(row * window.n + chan) * n_pol + stored] = if set.flipped { v.conj() } else { v };
                }
            }
        }
        set.main.put(column, run.start, &[n_pol, window.n], &cells)
    }

    /// Add the flags that are new in a run of rows.
    fn put_flags(&mut self, run: Run, window: Channels, block: &VisibilityBlock, before: &VisibilityBlock) -> Result<()> {
        let set = &mut self.set;
        let n_pol = set.order.len();
        let mut new = Vec::new();
        for row in 0..run.rows {
            for chan in 0..window.n {
                for (pol, stored) in set.order.iter().enumerate() {
                    let at = [run.at + row, window.first + chan, pol];
                    if block.flags[at] && !before.flags[at] {
                        new.push((row * window.n + chan) * n_pol + stored);
                    }
                }
            }
        }
        if new.is_empty() {
            return Ok(());
        }
        let cell = [n_pol, window.n];
        let mut flags = vec![false; run.rows * window.n * n_pol];
        set.main.get_into("FLAG", run.start, &cell, &mut flags)?;
        new.into_iter().for_each(|k| flags[k] = true);
        set.main.put("FLAG", run.start, &cell, &flags)
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
                for (at, values) in columns.iter().enumerate() {
                    self.put_vis(self.columns[at], run, window, values)?;
                }
                if let Some(before) = &before {
                    self.put_vis("DATA", run, window, &block.vis.view())?;
                    self.put_flags(run, window, block, before)?;
                    self.put_weights(run, window, block, before)?;
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
