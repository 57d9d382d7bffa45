//! Reading UVH5 in runs of rows.

use super::names::dataset_of;
use super::{header, unread};
use crate::h5::{self, H5In, Three};
use crate::{FormatError, Result, VisColumn};
use cittert_arrays::{ArrayError, PartSource, RowPart, UvCoverage, VisibilityBlock, VisibilityHeader, VisibilitySource};
use hdf5::Dataset;
use ndarray::{Array1, Array2, Array3, Ix1, Ix2, Ix3};
use num_complex::Complex;
use std::collections::HashMap;
use std::ops::Range;
use std::path::Path;

/// An open UVH5 file.
pub struct Uvh5Reader {
    file: H5In,
    header: VisibilityHeader,
    n_rows: usize,
    columns: Columns,
    data: Data,
    index_of_number: HashMap<i64, u32>,
    index_of_center: HashMap<i64, u16>,
}

/// Arrays with one element per row.
struct Columns {
    uvw: Dataset,
    ant1: Dataset,
    ant2: Dataset,
    time: Dataset,
    /// One value per row, or a single value in old files.
    integration: Dataset,
    centers: Option<Dataset>,
}

/// Arrays \[blt, chan, pol\].
struct Data {
    name: &'static str,
    vis: Dataset,
    flags: Dataset,
    nsamples: Dataset,
    weights: Option<Dataset>,
}

impl Data {
    /// What images are made of.
    fn three(&self) -> Three<'_> {
        [&self.vis, self.weights.as_ref().unwrap_or(&self.nsamples), &self.flags]
    }
}

impl Uvh5Reader {
    /// Open a UVH5 file of any version.
    ///
    /// # Errors
    /// Not HDF5, truncated, a header item that is missing or of the wrong shape, a filter that is not known, or shapes that the file
    /// cannot hold.
    pub fn open(path: &Path) -> Result<Self> {
        Self::open_column(path, VisColumn::Data)
    }

    /// The columns beside the data that a file has.
    ///
    /// # Errors
    /// Not HDF5, or damaged.
    pub fn columns(path: &Path) -> Result<Vec<VisColumn>> {
        let file = h5::open(path, "a UVH5 file")?;
        Ok(VisColumn::ALL.into_iter().filter(|c| *c != VisColumn::Data && file.has(dataset_of(*c))).collect())
    }

    /// As [`Uvh5Reader::open`], with the visibilities of a column.
    ///
    /// # Errors
    /// A column that the file does not have, or as [`Uvh5Reader::open`].
    pub fn open_column(path: &Path, column: VisColumn) -> Result<Self> {
        let file = h5::open(path, "a UVH5 file")?;
        if file.members("Header")?.is_empty() || !file.has("Data/visdata") {
            return Err(FormatError::not_a(path, "a UVH5 file", "an HDF5 file without Header and Data/visdata"));
        }
        let header = header::read(&file)?;
        let n_rows = file.count("Header/Nblts")?;
        let columns = Columns::open(&file, n_rows)?;
        let data = Data::open(&file, dataset_of(column), header.shape(n_rows))?;
        let index_of_number = header.layout.antennas().iter().enumerate().map(|(k, a)| (i64::from(a.number), k as u32)).collect();
        let index_of_center = header.phase_centers.iter().enumerate().map(|(k, c)| (c.id, k as u16)).collect();
        Ok(Self { file, header, n_rows, columns, data, index_of_number, index_of_center })
    }

    /// Read the rows of `range`.
    ///
    /// # Errors
    /// A range past the last row, an antenna or phase centre that the header does not have, or a damaged file.
    pub fn read(&self, range: Range<usize>) -> Result<VisibilityBlock> {
        let values = |e| FormatError::values(self.file.path(), e);
        ArrayError::unless_rows(&range, self.n_rows).map_err(values)?;
        let coverage = self.coverage(range.clone())?;
        let file = &self.file;
        let vis: Array3<Complex<f32>> = file.rows::<_, Ix3>(&self.data.vis, self.data.name, range.clone())?;
        let nsamples = self.samples(range.clone())?;
        let weights = match &self.data.weights {
            Some(_) => self.weights(range.clone())?,
            None => nsamples.clone(),
        };
        VisibilityBlock::new(coverage, vis, weights, self.flags(range)?, nsamples).map_err(values)
    }

    /// Numbers of samples of some rows.
    pub(super) fn samples(&self, range: Range<usize>) -> Result<Array3<f32>> {
        self.file.rows::<f32, Ix3>(&self.data.nsamples, "Data/nsamples", range)
    }

    /// Weights of some rows.
    pub(super) fn weights(&self, range: Range<usize>) -> Result<Array3<f32>> {
        match &self.data.weights {
            Some(weights) => self.file.rows::<f32, Ix3>(weights, "Data/weights", range),
            None => self.samples(range),
        }
    }

    /// Flags of some rows.
    pub(super) fn flags(&self, range: Range<usize>) -> Result<Array3<bool>> {
        let flags: Array3<i8> = self.file.rows::<_, Ix3>(&self.data.flags, "Data/flags", range)?;
        Ok(flags.mapv(|f| f != 0))
    }

    /// What the file holds beside its rows and its header.
    pub(super) fn unread(&self, samples_are_kept: bool) -> Result<Vec<String>> {
        unread::lines(&self.file, &self.header, samples_are_kept)
    }

    /// The history as it stands in the file.
    pub(super) fn history_text(&self) -> Result<Option<String>> {
        self.file.text("Header/history")
    }

    fn coverage(&self, range: Range<usize>) -> Result<UvCoverage> {
        let file = &self.file;
        let uvw: Array2<f64> = file.rows::<_, Ix2>(&self.columns.uvw, "Header/uvw_array", range.clone())?;
        let time: Array1<f64> = file.rows::<_, Ix1>(&self.columns.time, "Header/time_array", range.clone())?;
        let integration = if self.columns.integration.size() == self.n_rows && self.columns.integration.ndim() == 1 {
            file.rows::<f64, Ix1>(&self.columns.integration, "Header/integration_time", range.clone())?.to_vec()
        } else {
            vec![file.require_real("Header/integration_time")?; range.len()]
        };
        let centers = match &self.columns.centers {
            Some(dataset) => {
                let what = "a number of phase_center_catalog";
                self.indices(dataset, "Header/phase_center_id_array", range.clone(), &self.index_of_center, what)?
            }
            None => vec![0; range.len()],
        };
        let antennas = |dataset: &Dataset, name: &str| {
            self.indices(dataset, name, range.clone(), &self.index_of_number, "a number of Header/antenna_numbers")
        };
        let ant1 = antennas(&self.columns.ant1, "Header/ant_1_array")?;
        let ant2 = antennas(&self.columns.ant2, "Header/ant_2_array")?;
        UvCoverage::new(uvw, ant1, ant2, time.to_vec(), integration, centers).map_err(|e| FormatError::values(file.path(), e))
    }

    /// The numbers of a column as indices into the header.
    fn indices<T: Copy>(&self, dataset: &Dataset, name: &str, range: Range<usize>, of: &HashMap<i64, T>, what: &str) -> Result<Vec<T>> {
        let numbers: Array1<i64> = self.file.rows::<_, Ix1>(dataset, name, range.clone())?;
        let unknown = |row: usize, n: i64| self.file.wrong(&format!("{name}, row {}", range.start + row), what, n.to_string());
        // Most rows have the same number as the row before.
        let mut last: Option<(i64, T)> = None;
        let index_of = |(row, n): (usize, &i64)| match last {
            Some((same, index)) if same == *n => Ok(index),
            _ => {
                let index = of.get(n).copied().ok_or_else(|| unknown(row, *n))?;
                last = Some((*n, index));
                Ok(index)
            }
        };
        numbers.iter().enumerate().map(index_of).collect()
    }
}

impl Columns {
    fn open(file: &H5In, n: usize) -> Result<Self> {
        Ok(Self {
            uvw: file.numbers("Header/uvw_array", &[&[n, 3]])?,
            ant1: file.numbers("Header/ant_1_array", &[&[n]])?,
            ant2: file.numbers("Header/ant_2_array", &[&[n]])?,
            time: file.numbers("Header/time_array", &[&[n]])?,
            integration: file.numbers("Header/integration_time", &[&[n], &[], &[1]])?,
            centers: file.optional_numbers("Header/phase_center_id_array", &[&[n]])?,
        })
    }
}

impl Data {
    fn open(file: &H5In, name: &'static str, (n, chan, pol): (usize, usize, usize)) -> Result<Self> {
        // Versions before 1.0 have a spectral-window axis of length 1.
        let shapes: [&[usize]; 2] = [&[n, chan, pol], &[n, 1, chan, pol]];
        let vis = file.shaped(name, &shapes)?;
        file.demand_complex(&vis, name)?;
        Ok(Self {
            name,
            vis,
            flags: file.numbers("Data/flags", &shapes)?,
            nsamples: file.numbers("Data/nsamples", &shapes)?,
            weights: file.optional_numbers("Data/weights", &shapes)?,
        })
    }
}

impl VisibilitySource for Uvh5Reader {
    fn header(&self) -> &VisibilityHeader {
        &self.header
    }

    fn n_rows(&self) -> usize {
        self.n_rows
    }

    fn read_rows(&mut self, range: Range<usize>) -> Result<VisibilityBlock, ArrayError> {
        Ok(self.read(range)?)
    }

    fn read_runs(&mut self, runs: &[Range<usize>]) -> Result<Vec<VisibilityBlock>, ArrayError> {
        Ok(h5::side_by_side(runs, |rows| self.read(rows.clone()))?)
    }

    fn read_coverage(&mut self, range: Range<usize>) -> Result<UvCoverage, ArrayError> {
        ArrayError::unless_rows(&range, self.n_rows).map_err(|e| FormatError::values(self.file.path(), e))?;
        Ok(self.coverage(range)?)
    }

    fn in_parts(&mut self) -> Option<&mut dyn PartSource> {
        if self.file.has_parts(self.data.three()) { Some(self) } else { None }
    }
}

impl PartSource for Uvh5Reader {
    fn read_parts(&mut self, range: Range<usize>, step: usize, take: &(dyn Fn(RowPart<'_>) + Sync)) -> Result<(), ArrayError> {
        ArrayError::unless_rows(&range, self.n_rows).map_err(|e| FormatError::values(self.file.path(), e))?;
        let names = [self.data.name, if self.data.weights.is_some() { "Data/weights" } else { "Data/nsamples" }, "Data/flags"];
        Ok(self.file.parts((self.data.three(), names), (range, step), take)?)
    }

    fn held_bytes(&mut self) -> usize {
        self.file.held_of_parts(self.data.three())
    }
}
