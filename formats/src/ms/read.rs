//! Reading a Measurement Set in runs of rows.

use super::codes::{jd_of, name_of};
use super::index::{Index, Run};
use super::keywords::Place;
use super::metadata::{self, Description};
use super::own;
use super::table::{Kind, Table};
use super::{annotations, unread};
use crate::{FormatError, Result, VisColumn};
use cittert_arrays::astrometry::eop;
use cittert_arrays::{ArrayError, UvCoverage, VisUnit, VisibilityBlock, VisibilityHeader, VisibilitySource};
use ndarray::{Array2, Array3};
use num_complex::Complex;
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Time scale of the column TIME.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Clock {
    Utc,
    Ut1,
    Tai,
    Tt,
}

/// The channels of a window within the channels of the set.
#[derive(Debug, Clone, Copy)]
pub(super) struct Channels {
    pub(super) first: usize,
    pub(super) n: usize,
}

/// A Measurement Set as a source of visibilities. Rows have the order of the file. Where a set has several spectral windows, the rows of one
/// baseline, time and field become one row, in the order of their first appearance. A window without a row is flagged.
#[derive(Debug)]
pub struct MsSource {
    pub(super) main: Table,
    path: PathBuf,
    /// Name of the column that is read.
    column: &'static str,
    header: VisibilityHeader,
    pub(super) index: Index,
    pub(super) windows: Vec<Channels>,
    /// Place of each product of the header in a row.
    pub(super) order: Vec<usize>,
    antenna_of_row: Vec<Option<u32>>,
    clock: Clock,
    /// True where uvw and visibilities have the convention of imagers of Measurement Sets, which is opposite to the convention in memory.
    pub(super) flipped: bool,
    pub(super) has_spectrum: bool,
    /// Weights of the data divided by weights of the file.
    pub(super) weight_factor: f32,
}

impl MsSource {
    /// Open a Measurement Set to read one of its columns of visibilities.
    ///
    /// # Errors
    /// A directory that is not a Measurement Set of version 2, a column or subtable that is missing or damaged, windows with different products,
    /// or moving fields.
    pub fn open(path: &Path, column: VisColumn) -> Result<Self> {
        Self::of(open_main(path)?, path, column)
    }

    /// A Measurement Set whose main table is open.
    pub(super) fn of(main: Table, path: &Path, column: VisColumn) -> Result<Self> {
        let what = || FormatError::unsupported(path, format!("a Measurement Set has no column {:?}", column.name()));
        let column = name_of(column).ok_or_else(what)?;
        let n_rows = count_rows(path, &main)?;
        check_column(&main, column)?;
        let index = Index::new(&main, n_rows)?;
        let descriptions = metadata::descriptions(path, index.ids())?;
        let spectrum = metadata::spectrum(path, &descriptions)?;
        let own = own::read(&main)?;
        let history = metadata::history(path)?;
        let array = metadata::array(path, &own, history.from_importuvfits)?;
        let stored = &descriptions[0].products;
        let mut order: Vec<usize> = (0..stored.len()).collect();
        order.sort_by_key(|k| stored[*k].aips().abs());
        let header = VisibilityHeader {
            layout: array.layout.clone(),
            spectrum,
            polarizations: order.iter().map(|k| stored[*k]).collect(),
            phase_centers: metadata::phase_centers(path, &own)?,
            unit: unit(&main, column)?,
            instrument: own.instrument.unwrap_or_else(|| array.telescope.clone()),
            telescope: array.telescope.clone(),
            annotations: array.annotate(annotations::read(path, &main)?),
            pedestal_k: own.pedestal_k,
            scene_pedestal_k: own.scene_pedestal_k,
            antenna_temperature_k: own.antenna_temperature_k,
            near_field: own.near_field,
            scene_width_rad: own.scene_width_rad,
            history: history.lines,
        };
        let flag = main.keyword_number(Place::table("pyuvdata_flip_conj"), 0)?;
        let mut first = 0;
        let windows = descriptions
            .iter()
            .map(|d| {
                first += d.freq_hz.len();
                Channels { first: first - d.freq_hz.len(), n: d.freq_hz.len() }
            })
            .collect();
        let source = Self {
            path: path.into(),
            column,
            header,
            windows,
            order,
            antenna_of_row: array.of_row,
            clock: clock(&main)?,
            // Only old sets of pyuvdata have the convention in memory.
            flipped: flag.map_or(!history.from_pyuvdata, |f| f != 0.0),
            has_spectrum: main.column_ndim("WEIGHT_SPECTRUM", Kind::Float)?.is_some(),
            weight_factor: own.weight_scale.map_or(1.0, |s| (1.0 / s) as f32),
            index,
            main,
        };
        source.check_shapes(&descriptions)?;
        Ok(source)
    }

    /// Which columns of visibilities the set has, of those that can be read.
    #[must_use]
    pub fn columns(&self) -> Vec<VisColumn> {
        columns(&self.main)
    }

    /// What the set holds beside its rows and its header.
    pub(super) fn unread(&self) -> Result<Vec<String>> {
        unread::lines(&self.path, &self.main, self.has_spectrum)
    }

    /// Check that the first row of each window has the shape that the subtables state.
    fn check_shapes(&self, descriptions: &[Description]) -> Result<()> {
        for (k, d) in descriptions.iter().enumerate() {
            let Some(row) = self.index.first_row(k) else { continue };
            let expected = vec![d.products.len(), d.freq_hz.len()];
            let found = self.main.cell_shape(self.column, row)?;
            if found.as_ref() != Some(&expected) {
                let place = format!("{}, row {row}", self.column);
                let found = found.map_or("an empty cell".into(), |f| format!("shape {f:?}"));
                let expected = format!("shape {expected:?} (products, channels) as POLARIZATION and SPECTRAL_WINDOW say");
                return Err(FormatError::malformed(&self.path, place, expected, found));
            }
        }
        Ok(())
    }

    /// Read the rows of `range`.
    ///
    /// # Errors
    /// A range past the last row, cells that are missing or of another shape than their window's, rows that name an antenna or a field
    /// that does not exist.
    pub fn read(&mut self, range: Range<usize>) -> Result<VisibilityBlock> {
        self.read_parts(range, true)
    }

    /// As [`MsSource::read`], with the weights and flags alone: coverage and visibilities stay 0.
    pub(super) fn read_weights(&mut self, range: Range<usize>) -> Result<VisibilityBlock> {
        self.read_parts(range, false)
    }

    fn read_parts(&mut self, range: Range<usize>, all: bool) -> Result<VisibilityBlock> {
        let total = self.index.n_rows();
        if range.end > total || range.start > range.end {
            return Err(FormatError::values(&self.path, ArrayError::OutOfRange { what: "row", index: range.end, len: total }));
        }
        let (n, n_chan, n_pol) = self.header.shape(range.len());
        let mut block = VisibilityBlock {
            coverage: empty_coverage(n),
            vis: Array3::zeros((n, n_chan, n_pol)),
            weights: Array3::zeros((n, n_chan, n_pol)),
            flags: Array3::from_elem((n, n_chan, n_pol), true),
            nsamples: Array3::zeros((n, n_chan, n_pol)),
        };
        for k in 0..self.windows.len() {
            for run in self.index.runs(range.clone(), k) {
                if run.rows > 0 {
                    if all {
                        self.read_places(run, &mut block.coverage)?;
                    }
                    self.read_data(run, self.windows[k], &mut block, all)?;
                }
            }
        }
        block.nsamples.assign(&block.weights);
        Ok(block)
    }

    fn read_places(&self, run: Run, c: &mut UvCoverage) -> Result<()> {
        let Run { start, at, rows } = run;
        let (ant1, ant2) = (self.main.scalars::<i32>("ANTENNA1", start, rows)?, self.main.scalars::<i32>("ANTENNA2", start, rows)?);
        let (field, time) = (self.main.scalars::<i32>("FIELD_ID", start, rows)?, self.main.scalars::<f64>("TIME", start, rows)?);
        let exposure = self.main.scalars::<f64>("EXPOSURE", start, rows)?;
        let mut uvw = vec![0.0_f64; 3 * rows];
        self.main.get_into("UVW", start, &[3], &mut uvw)?;
        let sign = if self.flipped { -1.0 } else { 1.0 };
        for k in 0..rows {
            c.ant1[at + k] = self.antenna(ant1[k], "ANTENNA1", start + k)?;
            c.ant2[at + k] = self.antenna(ant2[k], "ANTENNA2", start + k)?;
            c.phase_center[at + k] = u16::try_from(field[k])
                .ok()
                .filter(|f| usize::from(*f) < self.header.phase_centers.len())
                .ok_or_else(|| self.wrong("FIELD_ID", start + k, "a row of FIELD", field[k].to_string()))?;
            if !time[k].is_finite() {
                return Err(self.wrong("TIME", start + k, "a finite time", time[k].to_string()));
            }
            c.time_jd[at + k] = self.clock.utc_jd(jd_of(time[k]));
            c.integration_s[at + k] = exposure[k];
            for (axis, value) in uvw[3 * k..3 * k + 3].iter().enumerate() {
                c.uvw_m[[at + k, axis]] = sign * value + 0.0;
            }
        }
        Ok(())
    }

    fn antenna(&self, row_of_antenna: i32, column: &str, row: usize) -> Result<u32> {
        let known = usize::try_from(row_of_antenna).ok().and_then(|k| self.antenna_of_row.get(k).copied().flatten());
        known.ok_or_else(|| self.wrong(column, row, "a row of ANTENNA with a position", row_of_antenna.to_string()))
    }

    fn wrong(&self, column: &str, row: usize, expected: &str, found: String) -> FormatError {
        FormatError::malformed(&self.path, format!("{column}, row {row}"), expected, found)
    }

    fn read_data(&self, run: Run, window: Channels, block: &mut VisibilityBlock, with_vis: bool) -> Result<()> {
        let Run { start, at, rows } = run;
        let n_pol = self.order.len();
        let (cell, size) = ([n_pol, window.n], n_pol * window.n);
        let mut vis = vec![Complex::<f32>::default(); if with_vis { rows * size } else { 0 }];
        self.main.get_into(self.column, start, &cell, &mut vis)?;
        let mut flags = vec![false; rows * size];
        self.main.get_into("FLAG", start, &cell, &mut flags)?;
        let flag_row = self.main.scalars::<bool>("FLAG_ROW", start, rows)?;
        let spectrum = self.has_spectrum && self.main.cell_shape("WEIGHT_SPECTRUM", start)?.as_deref() == Some(&cell);
        let mut weights = vec![0.0_f32; rows * if spectrum { size } else { n_pol }];
        if spectrum {
            self.main.get_into("WEIGHT_SPECTRUM", start, &cell, &mut weights)?;
        } else {
            self.main.get_into("WEIGHT", start, &cell[..1], &mut weights)?;
        }
        for row in 0..rows {
            for chan in 0..window.n {
                for (pol, stored) in self.order.iter().enumerate() {
                    let from = row * size + chan * n_pol + stored;
                    let to = (at + row, window.first + chan, pol);
                    if with_vis {
                        block.vis[to] = if self.flipped { vis[from].conj() } else { vis[from] };
                    }
                    block.flags[to] = flags[from] || flag_row[row];
                    block.weights[to] = self.weight_factor * weights[if spectrum { from } else { row * n_pol + stored }];
                }
            }
        }
        Ok(())
    }
}

impl VisibilitySource for MsSource {
    fn header(&self) -> &VisibilityHeader {
        &self.header
    }

    fn n_rows(&self) -> usize {
        self.index.n_rows()
    }

    fn read_rows(&mut self, range: Range<usize>) -> Result<VisibilityBlock, ArrayError> {
        Ok(self.read(range)?)
    }

    fn read_coverage(&mut self, range: Range<usize>) -> Result<UvCoverage, ArrayError> {
        ArrayError::unless_rows(&range, self.index.n_rows()).map_err(|e| FormatError::values(&self.path, e))?;
        let mut coverage = empty_coverage(range.len());
        for k in 0..self.windows.len() {
            for run in self.index.runs(range.clone(), k) {
                if run.rows > 0 {
                    self.read_places(run, &mut coverage)?;
                }
            }
        }
        Ok(coverage)
    }
}

/// Coverage of `n` rows, with zeros.
fn empty_coverage(n: usize) -> UvCoverage {
    UvCoverage {
        uvw_m: Array2::zeros((n, 3)),
        ant1: vec![0; n],
        ant2: vec![0; n],
        time_jd: vec![0.0; n],
        integration_s: vec![0.0; n],
        phase_center: vec![0; n],
    }
}

impl Clock {
    /// Julian date in UTC.
    fn utc_jd(self, jd: f64) -> f64 {
        /// TT minus TAI, s.
        const TT_TAI_S: f64 = 32.184;
        match self {
            Self::Utc => jd,
            Self::Ut1 => jd - eop::at(jd).ut1_utc_s / 86_400.0,
            // Within a minute of a leap second this may be the offset of the wrong day.
            Self::Tai => jd - eop::tai_utc_s(jd) / 86_400.0,
            Self::Tt => jd - (eop::tai_utc_s(jd) + TT_TAI_S) / 86_400.0,
        }
    }
}

fn clock(main: &Table) -> Result<Clock> {
    if let Some(unit) = main.keyword_text(Place::column("TIME", "QuantumUnits"), 0)?.filter(|u| u != "s") {
        return Err(FormatError::unsupported(&main.path, format!("TIME is in {unit:?}: only seconds are read")));
    }
    let scale = main.keyword_text(Place::measure("TIME", "Ref"), 0)?.unwrap_or_else(|| "UTC".into());
    Ok(match scale.to_ascii_uppercase().as_str() {
        "UTC" => Clock::Utc,
        "UT1" | "UT" => Clock::Ut1,
        "TAI" | "IAT" => Clock::Tai,
        "TT" | "TDT" | "ET" => Clock::Tt,
        _ => {
            let what = format!("TIME counts in {scale}: UTC, UT1, TAI and TT are read");
            return Err(FormatError::unsupported(&main.path, what));
        }
    })
}

/// The unit of the column. Calibrated columns without a stated unit are in Jy.
fn unit(main: &Table, column: &str) -> Result<VisUnit> {
    let stated = main.keyword_text(Place::column(column, "QuantumUnits"), 0)?;
    Ok(match (stated, column) {
        (Some(name), _) => VisUnit::from_name(&name),
        (None, "DATA") => VisUnit::Uncalibrated,
        (None, _) => VisUnit::Jy,
    })
}

fn open_main(path: &Path) -> Result<Table> {
    let not = |found: &str| FormatError::not_a(path, "a Measurement Set (a directory with table.dat)", found);
    let meta = fs::metadata(path).map_err(|e| FormatError::io(path, "open", e))?;
    if !meta.is_dir() {
        return Err(not("it is a file"));
    }
    if !path.join("table.dat").is_file() {
        return Err(not("it is a directory without table.dat"));
    }
    let main = Table::open(path)?;
    match main.keyword_number(Place::table("MS_VERSION"), 0)? {
        Some(version) if (2.0..3.0).contains(&version) => Ok(main),
        Some(version) => Err(FormatError::unsupported(path, format!("Measurement Set of version {version}: only version 2 is read"))),
        None => Err(not("it is another table of casacore, without MS_VERSION")),
    }
}

/// Number of rows. A table that claims more rows than its files have bytes is damaged.
fn count_rows(path: &Path, main: &Table) -> Result<usize> {
    let rows = main.n_rows();
    let files = fs::read_dir(path).map_err(|e| FormatError::io(path, "read", e))?;
    let bytes: u64 = files.filter_map(|f| f.ok()?.metadata().ok()).map(|m| m.len()).sum();
    if rows == 0 || rows > bytes {
        let expected = format!("between 1 row and what {bytes} bytes can hold");
        return Err(FormatError::malformed(path, "table.dat", expected, format!("{rows} rows")));
    }
    Ok(rows as usize)
}

/// The columns of visibilities that a table has.
fn columns(main: &Table) -> Vec<VisColumn> {
    let has = |c: &VisColumn| name_of(*c).is_some_and(|name| matches!(main.column_ndim(name, Kind::Complex), Ok(Some(_))));
    VisColumn::ALL.into_iter().filter(has).collect()
}

fn check_column(main: &Table, column: &str) -> Result<()> {
    let have: Vec<_> = columns(main).into_iter().filter_map(name_of).collect();
    if have.contains(&column) {
        return Ok(());
    }
    let found = if have.is_empty() { "no column of visibilities".into() } else { format!("only {}", have.join(", ")) };
    Err(FormatError::malformed(&main.path, column, "a column of complex numbers", found))
}
