//! Writing UVH5 in runs of rows, in constant memory.

use super::names::dataset_of;
use super::phase::{self, Sky};
use super::read::Uvh5Reader;
use super::{header, layout};
use crate::columns::check_columns;
use crate::h5::{Compression, H5Out, Rows};
use crate::{ColumnSink, CreateOptions, FormatError, Result, VisColumn};
use cittert_arrays::{ArrayError, VisibilityBlock, VisibilityHeader, VisibilitySink, VisibilitySource, for_each_block};
use ndarray::{Array1, ArrayView1, ArrayView3};
use num_complex::Complex;
use std::collections::HashSet;
use std::path::Path;

/// Size of the blocks that are copied, bytes.
const COPY_BYTES: usize = 1 << 24;

/// Names of the arrays with one element per row, in the order of [`Columns`].
const COLUMNS: [&str; 10] = [
    "ant_1_array",
    "ant_2_array",
    "phase_center_id_array",
    "time_array",
    "integration_time",
    "lst_array",
    "phase_center_app_ra",
    "phase_center_app_dec",
    "phase_center_frame_pa",
    "uvw_array",
];

/// The arrays that grow.
struct Growing {
    columns: Vec<Rows>,
    vis: Rows,
    /// In the order of the options.
    beside: Vec<Rows>,
    flags: Rows,
    nsamples: Rows,
    /// Written only where weights differ from the numbers of samples.
    weights: Option<Rows>,
    chunk_rows: usize,
}

/// A UVH5 file being written.
pub struct Uvh5Writer {
    out: H5Out,
    header: VisibilityHeader,
    options: CreateOptions,
    sky: Sky,
    ids: Vec<i64>,
    growing: Option<Growing>,
    rows: usize,
    baselines: HashSet<(u32, u32)>,
    antennas: HashSet<u32>,
    times: HashSet<u64>,
    /// Time and baseline of the last row, to see whether rows run by time, then baseline.
    last: Option<(f64, u32, u32)>,
    in_order: bool,
}

impl Uvh5Writer {
    /// Begin a file for sets with this header.
    ///
    /// # Errors
    /// The output exists and may not be overwritten, its folder is missing or not writable.
    pub fn create(path: &Path, header: &VisibilityHeader, options: &CreateOptions) -> Result<Self> {
        let out = H5Out::create(path, options.overwrite)?;
        header::write(&out, header)?;
        let site = layout::site_of(&header.layout);
        Ok(Self {
            out,
            header: header.clone(),
            options: options.clone(),
            sky: Sky::over(site),
            ids: phase::ids(&header.phase_centers),
            growing: None,
            rows: 0,
            baselines: HashSet::new(),
            antennas: HashSet::new(),
            times: HashSet::new(),
            last: None,
            in_order: true,
        })
    }

    /// Begin a file with the content of an existing file, to append to it. The old file stays until the new one is complete.
    ///
    /// # Errors
    /// An error in the existing file; a header or columns that are not those of the existing file (the error names the first difference);
    /// or as [`Uvh5Writer::create`].
    pub fn append(path: &Path, header: &VisibilityHeader, options: &CreateOptions) -> Result<Self> {
        let mut old = Uvh5Reader::open(path)?;
        let columns = Uvh5Reader::columns(path)?;
        let refused =
            |place: &str, expected: String, found: String| Err(FormatError::malformed(path, format!("append, {place}"), expected, found));
        if let Some((place, expected, found)) = header::difference(old.header(), header) {
            return refused(place, format!("as in this file: {expected}"), found);
        }
        if columns != options.columns {
            let names = |c: &[VisColumn]| c.iter().map(|c| c.name()).collect::<Vec<_>>().join(" ");
            return refused("columns beside the data", format!("[{}]", names(&columns)), format!("[{}]", names(&options.columns)));
        }
        let mut joined = old.header().clone();
        joined.history.extend(header.history.iter().filter(|line| !old.header().history.contains(line)).cloned());
        let mut beside = columns.iter().map(|c| Uvh5Reader::open_column(path, *c)).collect::<Result<Vec<_>>>()?;
        let mut writer = Self::create(path, &joined, &CreateOptions { overwrite: true, ..options.clone() })?;
        for_each_block::<ArrayError>(&mut old, COPY_BYTES, |first, block| {
            let rows = first..first + block.n_rows();
            let beside = beside.iter_mut().map(|source| source.read(rows.clone())).collect::<Result<Vec<_>>>()?;
            let views: Vec<_> = beside.iter().map(|b| b.vis.view()).collect();
            Ok(writer.write_columns(&block, &views)?)
        })
        .map_err(|e| FormatError::values(path, e))?;
        Ok(writer)
    }

    /// Append a block.
    ///
    /// # Errors
    /// A block whose shape is not that of the header, a time for which there is no sidereal time, or an error of the file system.
    pub fn write(&mut self, block: &VisibilityBlock) -> Result<()> {
        self.write_columns(block, &[])
    }

    /// Sidereal time and apparent place of each row.
    fn places(&mut self, block: &VisibilityBlock) -> Result<Vec<[f64; 4]>, ArrayError> {
        let c = &block.coverage;
        c.time_jd
            .iter()
            .zip(&c.phase_center)
            .map(|(time, center)| {
                let (lst, place) = self.sky.at(*time, &self.header.phase_centers, usize::from(*center))?;
                Ok([lst, place.ra_rad, place.dec_rad, place.frame_pa_rad])
            })
            .collect()
    }

    /// Create the arrays that grow. The first block sets the size of the chunks.
    fn begin(&self, block_rows: usize) -> Result<Growing> {
        let header = |name: &str| format!("Header/{name}");
        let mut columns = Vec::new();
        for name in &COLUMNS[..3] {
            columns.push(self.out.rows::<i64>(&header(name), &[], block_rows, Compression::None)?);
        }
        for name in &COLUMNS[3..9] {
            columns.push(self.out.rows::<f64>(&header(name), &[], block_rows, Compression::None)?);
        }
        columns.push(self.out.rows::<f64>(&header(COLUMNS[9]), &[3], block_rows, Compression::None)?);
        let (_, n_chan, n_pol) = self.header.shape(0);
        let tail = [n_chan, n_pol];
        // Flags and numbers of samples shrink well and are always compressed.
        let compression = self.options.compression.unwrap_or_default();
        let complex = |column: VisColumn| self.out.rows::<Complex<f32>>(dataset_of(column), &tail, block_rows, compression);
        Ok(Growing {
            columns,
            vis: complex(VisColumn::Data)?,
            beside: self.options.columns.iter().map(|c| complex(*c)).collect::<Result<_>>()?,
            flags: self.out.rows::<bool>("Data/flags", &tail, block_rows, Compression::Lzf)?,
            nsamples: self.out.rows::<f32>("Data/nsamples", &tail, block_rows, Compression::Lzf)?,
            weights: None,
            chunk_rows: block_rows,
        })
    }

    fn write_rows(&self, growing: &mut Growing, block: &VisibilityBlock, places: &[[f64; 4]]) -> Result<()> {
        let c = &block.coverage;
        let numbers =
            |ants: &[u32]| -> Array1<i64> { ants.iter().map(|a| i64::from(self.header.layout.antennas()[*a as usize].number)).collect() };
        let integers = [numbers(&c.ant1), numbers(&c.ant2), c.phase_center.iter().map(|p| self.ids[usize::from(*p)]).collect()];
        for (k, values) in integers.iter().enumerate() {
            self.out.append(&mut growing.columns[k], COLUMNS[k], values.view())?;
        }
        for (k, values) in [&c.time_jd, &c.integration_s].into_iter().enumerate() {
            self.out.append(&mut growing.columns[3 + k], COLUMNS[3 + k], ArrayView1::from(values.as_slice()))?;
        }
        for k in 0..4 {
            let values: Array1<f64> = places.iter().map(|p| p[k]).collect();
            self.out.append(&mut growing.columns[5 + k], COLUMNS[5 + k], values.view())?;
        }
        self.out.append(&mut growing.columns[9], COLUMNS[9], c.uvw_m.view())
    }

    /// Write weights once they differ from the numbers of samples. The numbers of samples of the earlier rows are then copied as their weights.
    fn write_weights(&self, growing: &mut Growing, block: &VisibilityBlock) -> Result<()> {
        const NAME: &str = "Data/weights";
        let same = |(a, b): (&f32, &f32)| a == b || (a.is_nan() && b.is_nan());
        if growing.weights.is_none() {
            if block.weights.iter().zip(&block.nsamples).all(same) {
                return Ok(());
            }
            let (_, n_chan, n_pol) = self.header.shape(0);
            let mut weights = self.out.rows::<f32>(NAME, &[n_chan, n_pol], growing.chunk_rows, Compression::Lzf)?;
            let mut start = 0;
            while start < self.rows {
                let end = (start + growing.chunk_rows.max(1)).min(self.rows);
                let rows = self.out.read_back::<f32>(&growing.nsamples, "Data/nsamples", start..end)?;
                self.out.append(&mut weights, NAME, rows.view())?;
                start = end;
            }
            growing.weights = Some(weights);
        }
        match &mut growing.weights {
            Some(weights) => self.out.append(weights, NAME, ArrayView3::from(&block.weights)),
            None => Ok(()),
        }
    }

    /// Count the baselines, antennas and times for the header, and check the order of the rows.
    fn count(&mut self, block: &VisibilityBlock) {
        let c = &block.coverage;
        for ((a, b), t) in c.ant1.iter().zip(&c.ant2).zip(&c.time_jd) {
            self.baselines.insert((*a, *b));
            self.antennas.extend([*a, *b]);
            self.times.insert(t.to_bits());
            let now = (*t, *a, *b);
            self.in_order &= self.last.is_none_or(|last| last < now);
            self.last = Some(now);
        }
    }

    /// Complete the header and give the file its final name.
    ///
    /// # Errors
    /// A set without rows, or an error of the file system. The old file then stays in place.
    pub fn complete(mut self) -> Result<()> {
        if self.growing.take().is_none() {
            return Err(FormatError::values(
                self.out.path(),
                ArrayError::bad_value("number of rows", "0", "at least one row of visibilities"),
            ));
        }
        for (name, value) in
            [("Nblts", self.rows), ("Nbls", self.baselines.len()), ("Ntimes", self.times.len()), ("Nants_data", self.antennas.len())]
        {
            self.out.scalar(&format!("Header/{name}"), value as i64)?;
        }
        if self.in_order {
            self.out.text("Header/blt_order", "time, baseline")?;
        }
        self.out.finish()
    }
}

impl ColumnSink for Uvh5Writer {
    fn write_columns(&mut self, block: &VisibilityBlock, columns: &[ArrayView3<'_, Complex<f32>>]) -> Result<()> {
        let path = self.out.path().to_path_buf();
        self.header.check_block(block).map_err(|e| FormatError::values(&path, e))?;
        check_columns(&path, block, columns, self.options.columns.len())?;
        if block.n_rows() == 0 {
            return Ok(());
        }
        let places = self.places(block).map_err(|e| FormatError::values(&path, e))?;
        let mut growing = match self.growing.take() {
            Some(g) => g,
            None => self.begin(block.n_rows())?,
        };
        self.write_rows(&mut growing, block, &places)?;
        let out = &self.out;
        out.append(&mut growing.vis, "Data/visdata", block.vis.view())?;
        for ((rows, column), values) in growing.beside.iter_mut().zip(&self.options.columns).zip(columns) {
            out.append(rows, dataset_of(*column), values.view())?;
        }
        out.append(&mut growing.flags, "Data/flags", block.flags.view())?;
        self.write_weights(&mut growing, block)?;
        self.out.append(&mut growing.nsamples, "Data/nsamples", block.nsamples.view())?;
        self.growing = Some(growing);
        self.rows += block.n_rows();
        self.count(block);
        Ok(())
    }
}

impl VisibilitySink for Uvh5Writer {
    fn write_block(&mut self, block: &VisibilityBlock) -> Result<(), ArrayError> {
        Ok(self.write(block)?)
    }

    fn finish(self: Box<Self>) -> Result<(), ArrayError> {
        Ok(self.complete()?)
    }
}
