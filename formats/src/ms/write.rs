//! Writing a Measurement Set in runs of rows, in constant memory.

use super::annotations;
use super::codes::{frame_code, mjd_seconds, name_of};
use super::export::Plan;
use super::fields::{Fields, Pointing};
use super::keywords::Place;
use super::own;
use super::rows::{Counts, Job};
use super::schema;
use super::subtables::{self, Contents};
use super::table::{Manager, Table, check_space};
use crate::atomic::{AtomicDir, Replaces};
use crate::columns::check_columns;
use crate::{ColumnSink, CreateOptions, FormatError, Result};
use cittert_arrays::{ArrayError, VisUnit, VisibilityBlock, VisibilityHeader, VisibilitySink};
use ndarray::ArrayView3;
use num_complex::Complex;
use std::path::{Path, PathBuf};

/// A run of rows of the main table that share a spectral window.
#[derive(Debug, Clone, Copy)]
struct Run {
    start: usize,
    rows: usize,
    window: usize,
}

/// Field and rotation of each row of a block, and its scan number.
type Columns = (Vec<Pointing>, Vec<i32>);

/// A Measurement Set being written.
///
/// uvw are negated and visibilities conjugated compared to memory, as imagers of Measurement Sets expect.
#[derive(Debug)]
pub struct MsWriter {
    // This order closes the tables before the directory is removed or renamed.
    main: Table,
    dir: AtomicDir,
    path: PathBuf,
    header: VisibilityHeader,
    /// Names of the columns beside the data.
    extras: Vec<&'static str>,
    plan: Plan,
    fields: Fields,
    frame: &'static str,
    n_rows: usize,
    runs: Vec<Run>,
    has_spectrum: bool,
    scan: i32,
    last: Option<(f64, u16)>,
    time_range: [f64; 2],
    counts: Counts,
    weight_scale: f64,
}

impl MsWriter {
    /// Begin a Measurement Set for sets with this header.
    ///
    /// # Errors
    /// The output exists and may not be overwritten, or is not a Measurement Set; its directory is missing or not writable; the header has
    /// polarisation products or celestial frames that a Measurement Set cannot hold.
    pub fn create(path: &Path, header: &VisibilityHeader, options: &CreateOptions) -> Result<Self> {
        let mut plan = Plan::new(path, header)?;
        let fields = Fields::new(path, header, &mut plan.notes)?;
        let dir = AtomicDir::create(path, options.overwrite, Replaces::Holding("table.dat"))?;
        let frame = header.phase_centers.first().and_then(|c| frame_code(&c.frame, c.epoch)).unwrap_or("ICRS");
        let extras: Vec<_> = options.columns.iter().filter_map(|c| name_of(*c)).collect();
        let main = main_table(dir.path(), path, header, &plan, &extras, frame)?;
        Ok(Self {
            main,
            dir,
            path: path.into(),
            header: header.clone(),
            extras,
            plan,
            fields,
            frame,
            n_rows: 0,
            runs: Vec::new(),
            has_spectrum: false,
            scan: 1,
            last: None,
            time_range: [f64::INFINITY, f64::NEG_INFINITY],
            counts: Counts::default(),
            weight_scale: 1.0,
        })
    }

    /// What is lost or changed, as far as it is known now. [`MsWriter::complete`] returns all notes. They are also written to HISTORY.
    #[must_use]
    pub fn notes(&self) -> &[String] {
        &self.plan.notes
    }

    /// Append a block, as DATA alone.
    ///
    /// # Errors
    /// A block whose shape is not that of the header, columns beside the data that are not given, a row whose antennas must be exchanged in a
    /// set with one cross product but not the other, or an error of the file system.
    pub fn write(&mut self, block: &VisibilityBlock) -> Result<()> {
        self.write_columns(block, &[])
    }

    /// Multiply small weights by a power of two. Images of CASA stay blank where the sum of weights is below about 1e-8, and an imager of warm
    /// scenes has large noise in Jy. A power of two keeps all digits, and the reader divides by it again.
    fn scale_weights(&mut self, block: &VisibilityBlock) {
        /// Mean weight below which weights are raised to about 1.
        const SMALL: f64 = 1e-6;
        let (mut sum, mut n) = (0.0, 0_u64);
        for ((_, chan, _), w) in block.weights.indexed_iter().filter(|(_, w)| **w > 0.0 && w.is_finite()) {
            sum += f64::from(*w) * self.plan.weight_factor / self.plan.factor[chan].powi(2);
            n += 1;
        }
        let mean = sum / n as f64;
        if n > 0 && mean > 0.0 && mean < SMALL {
            let power = (-mean.log2()).round();
            let scale = power.exp2();
            self.weight_scale = scale;
            self.plan.weight_factor *= scale;
            self.plan.notes.push(format!("weights multiplied by 2^{power}, as CASA takes weights as small as {mean:.1e} for none"));
        }
    }

    /// Bytes that casacore may still hold in memory: a tile of each column, and the subtables.
    fn reserve(&self) -> u64 {
        let antennas = self.plan.antenna_rows.iter().max().map_or(0, |m| *m as u64);
        (4 << 20) + 2048 * (antennas + self.fields.rows().len() as u64) + 1024 * self.header.history.len() as u64
    }

    /// Field, rotation and scan number of each row, which are the same for all windows.
    fn columns(&mut self, block: &VisibilityBlock) -> Result<Columns> {
        let c = &block.coverage;
        let (mut pointing, mut scan) = (Vec::new(), Vec::new());
        for row in 0..block.n_rows() {
            let (time, center) = (c.time_jd[row], c.phase_center[row]);
            if let Some((last_time, last_center)) = self.last {
                self.scan += i32::from(last_center != center && last_time != time);
            }
            self.last = Some((time, center));
            pointing.push(self.fields.at(center, time)?);
            scan.push(self.scan);
            let (t, half) = (mjd_seconds(time), c.integration_s[row] / 2.0);
            self.time_range = [self.time_range[0].min(t - half), self.time_range[1].max(t + half)];
        }
        Ok((pointing, scan))
    }

    fn write_window(&mut self, block: &VisibilityBlock, extras: &[ArrayView3<'_, Complex<f32>>], k: usize, base: &Columns) -> Result<()> {
        let (pointing, scan) = base;
        let window = &self.plan.windows[k];
        let n_chan = window.channels.len();
        let freq_hz = self.header.spectrum.freq_hz();
        let job = Job { path: &self.path, block, extras, plan: &self.plan, window, freq_hz };
        let values = job.values(pointing, &mut self.counts)?;
        let (start, rows) = (self.n_rows, block.n_rows());
        let vector = [self.plan.products.len()];
        let cell = [vector[0], n_chan];
        if values.weights_vary && !self.has_spectrum {
            self.add_spectrum()?;
        }
        let t = &mut self.main;
        t.add_rows(rows)?;
        for (name, numbers) in [("ANTENNA1", &values.ant1), ("ANTENNA2", &values.ant2), ("SCAN_NUMBER", scan)] {
            t.put(name, start, &[], numbers)?;
        }
        t.put("FIELD_ID", start, &[], &pointing.iter().map(|p| p.field).collect::<Vec<_>>())?;
        t.put("DATA_DESC_ID", start, &[], &vec![k as i32; rows])?;
        for name in ["ARRAY_ID", "FEED1", "FEED2", "OBSERVATION_ID"] {
            t.put(name, start, &[], &vec![0_i32; rows])?;
        }
        // Neither PROCESSOR nor STATE has rows.
        for name in ["PROCESSOR_ID", "STATE_ID"] {
            t.put(name, start, &[], &vec![-1_i32; rows])?;
        }
        let times: Vec<f64> = block.coverage.time_jd.iter().map(|t| mjd_seconds(*t)).collect();
        let lengths = &block.coverage.integration_s;
        for (name, numbers) in [("TIME", &times), ("TIME_CENTROID", &times), ("EXPOSURE", lengths), ("INTERVAL", lengths)] {
            t.put(name, start, &[], numbers)?;
        }
        t.put("FLAG_ROW", start, &[], &values.flag_row)?;
        t.put("UVW", start, &[3], &values.uvw)?;
        t.put("WEIGHT", start, &vector, &values.weight)?;
        t.put("SIGMA", start, &vector, &values.sigma)?;
        t.put("FLAG", start, &cell, &values.flags)?;
        t.put("DATA", start, &cell, &values.vis)?;
        for (name, vis) in self.extras.iter().zip(&values.extras) {
            t.put(name, start, &cell, vis)?;
        }
        if self.has_spectrum {
            t.put("WEIGHT_SPECTRUM", start, &cell, &values.weights)?;
        }
        self.n_rows += rows;
        match self.runs.last_mut() {
            Some(run) if run.window == k => run.rows += rows,
            _ => self.runs.push(Run { start, rows, window: k }),
        }
        Ok(())
    }

    /// Add WEIGHT_SPECTRUM when weights first differ between channels. For the earlier rows the weights of WEIGHT are copied.
    fn add_spectrum(&mut self) -> Result<()> {
        /// Number of rows that are copied together.
        const STEP: usize = 4096;
        let tile = tile(self.plan.products.len(), longest(&self.plan));
        let column = schema::main_column("WEIGHT_SPECTRUM");
        schema::add(&mut self.main, &column, &Manager::TiledShape(tile), "TiledWeightSpectrum", self.frame)?;
        let n_pol = self.plan.products.len();
        for run in &self.runs {
            let n_chan = self.plan.windows[run.window].channels.len();
            let mut start = run.start;
            while start < run.start + run.rows {
                let rows = STEP.min(run.start + run.rows - start);
                let mut weight = vec![0.0_f32; rows * n_pol];
                self.main.get_into("WEIGHT", start, &[n_pol], &mut weight)?;
                let spectrum: Vec<f32> = weight.chunks(n_pol).flat_map(|w| w.repeat(n_chan)).collect();
                self.main.put("WEIGHT_SPECTRUM", start, &[n_pol, n_chan], &spectrum)?;
                start += rows;
            }
        }
        self.has_spectrum = true;
        Ok(())
    }

    /// Write the subtables and give the directory its final name. Returns all notes about the
    /// output, including those that depend on the data.
    ///
    /// # Errors
    /// A set without rows, or an error of the file system. The old output then stays in place.
    pub fn complete(mut self) -> Result<Vec<String>> {
        if self.n_rows == 0 {
            let none = ArrayError::bad_value("number of rows", "0", "at least one row of visibilities");
            return Err(FormatError::values(&self.path, none));
        }
        check_space(self.dir.path(), &self.path, self.reserve())?;
        let mut notes = std::mem::take(&mut self.plan.notes);
        notes.extend(self.counts.notes());
        let history: Vec<String> = self.header.history.iter().chain(&notes).cloned().collect();
        let contents = Contents {
            header: &self.header,
            plan: &self.plan,
            fields: self.fields.rows(),
            time_range: self.time_range,
            history: &history,
            now: subtables::now_mjd_s(),
            frame: self.frame,
        };
        own::write_weight_scale(&mut self.main, self.weight_scale)?;
        subtables::write(&mut self.main, self.dir.path(), &self.path, &contents)?;
        self.main.flush()?;
        let Self { main, dir, .. } = self;
        drop(main);
        dir.commit()?;
        Ok(notes)
    }
}

impl ColumnSink for MsWriter {
    fn write_columns(&mut self, block: &VisibilityBlock, columns: &[ArrayView3<'_, Complex<f32>>]) -> Result<()> {
        self.header.check_block(block).map_err(|e| FormatError::values(&self.path, e))?;
        check_columns(&self.path, block, columns, self.extras.len())?;
        if block.n_rows() == 0 {
            return Ok(());
        }
        // Bytes of one visibility with weight and flag, then those of the further columns, then those of the other columns of a row.
        let datum = 13 + 8 * columns.len();
        let bytes = block.n_rows() * (self.plan.factor.len() * self.plan.products.len() * datum + 200 * self.plan.windows.len());
        check_space(self.dir.path(), &self.path, bytes as u64 + self.reserve())?;
        if self.n_rows == 0 {
            self.scale_weights(block);
        }
        let base = self.columns(block)?;
        for k in 0..self.plan.windows.len() {
            self.write_window(block, columns, k, &base)?;
        }
        Ok(())
    }
}

impl VisibilitySink for MsWriter {
    fn write_block(&mut self, block: &VisibilityBlock) -> Result<(), ArrayError> {
        Ok(self.write(block)?)
    }

    fn finish(self: Box<Self>) -> Result<(), ArrayError> {
        self.complete()?;
        Ok(())
    }

    fn finish_with_notes(self: Box<Self>) -> Result<Vec<String>, ArrayError> {
        Ok(self.complete()?)
    }
}

/// Shape of a tile of about 256 KiB of visibilities with as many rows as fit, because imagers read all channels of a run of rows.
pub(super) fn tile(n_pol: usize, longest_window: usize) -> Vec<i64> {
    const ELEMENTS: usize = 32_768;
    let n_pol = n_pol.max(1);
    let n_chan = longest_window.clamp(1, ELEMENTS / n_pol);
    vec![n_pol as i64, n_chan as i64, (ELEMENTS / (n_pol * n_chan)).max(1) as i64]
}

fn longest(plan: &Plan) -> usize {
    plan.windows.iter().map(|w| w.channels.len()).max().unwrap_or(1)
}

/// Create the main table without rows.
fn main_table(folder: &Path, label: &Path, header: &VisibilityHeader, plan: &Plan, extras: &[&str], frame: &str) -> Result<Table> {
    let mut t = Table::create(folder, label)?;
    t.set_info("Measurement Set", "Measurement Set of version 2, written by cittert")?;
    schema::add(&mut t, &schema::columns("MAIN standard"), &Manager::Standard, "SSM", frame)?;
    schema::add(&mut t, &schema::columns("MAIN incremental"), &Manager::Incremental, "ISM", frame)?;
    t.put_keyword_text(Place::column("FLAG_CATEGORY", "CATEGORY"), &[], false)?;
    schema::add(&mut t, &schema::main_column("UVW"), &Manager::TiledColumn(vec![3, 8192]), "TiledUVW", frame)?;
    let vector = vec![plan.products.len() as i64, 8192];
    for (column, name) in [("WEIGHT", "TiledWeight"), ("SIGMA", "TiledSigma")] {
        schema::add(&mut t, &schema::main_column(column), &Manager::TiledShape(vector.clone()), name, frame)?;
    }
    let tile = tile(plan.products.len(), longest(plan));
    let data = [("FLAG", "TiledFlag"), ("DATA", "TiledData"), ("MODEL_DATA", "TiledModel"), ("CORRECTED_DATA", "TiledCorrected")];
    for (column, name) in data.into_iter().filter(|(c, _)| !c.ends_with("_DATA") || extras.contains(c)) {
        schema::add(&mut t, &schema::main_column(column), &Manager::TiledShape(tile.clone()), name, frame)?;
        if column.ends_with("DATA") && plan.unit == VisUnit::Jy {
            t.put_keyword_text(Place::column(column, "QuantumUnits"), &["Jy"], false)?;
        }
    }
    t.put_keyword_value(Place::table("MS_VERSION"), 2.0_f32)?;
    own::write(&mut t, header)?;
    annotations::write(&mut t, &header.annotations)?;
    Ok(t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::{Antenna, ArrayLayout, LayoutFrame, PhaseCenter, Polarization, Site, SpectralWindow, UvCoverage};
    use ndarray::{Array2, Array3};

    /// One row and one source: the visibility on the disk is the one that an imager of Measurement Sets predicts there.
    #[test]
    fn on_the_disk_uvw_are_negated_and_visibilities_conjugated() {
        let site = Site { latitude_rad: 0.5, longitude_rad: 0.1, altitude_m: 0.0 };
        let ants = (0..2).map(|k| Antenna::new(format!("A{k}"), k, [f64::from(k) * 100.0, 0.0, 0.0])).collect();
        let header = VisibilityHeader {
            layout: ArrayLayout::new("t", LayoutFrame::EastNorthUp(site), ants).unwrap(),
            spectrum: SpectralWindow::new(vec![1e9, 2e9], vec![1e6; 2]).unwrap(),
            polarizations: vec![Polarization::XX],
            phase_centers: vec![PhaseCenter::sidereal("p", 1.0, 0.5).unwrap()],
            unit: VisUnit::Jy,
            telescope: "t".into(),
            instrument: String::new(),
            pedestal_k: None,
            scene_pedestal_k: None,
            scene_width_rad: None,
            antenna_temperature_k: None,
            near_field: Default::default(),
            annotations: Default::default(),
            history: Vec::new(),
        };
        let (uvw, l, m) = ([90.0, -7.0, 3.0], 0.012, 0.005_f64);
        let n1 = f64::sqrt(1.0 - l * l - m * m) - 1.0;
        let predict = |b: [f64; 3], freq: f64| {
            let turns = (b[0] * l + b[1] * m + b[2] * n1) * freq / cittert_arrays::SPEED_OF_LIGHT_M_S;
            Complex::cis((std::f64::consts::TAU * turns) as f32)
        };
        let rows =
            UvCoverage::new(Array2::from_shape_vec((1, 3), uvw.to_vec()).unwrap(), vec![0], vec![1], vec![2.46e6], vec![1.0], vec![0]);
        let mut block = VisibilityBlock::zeros(rows.unwrap(), 2, 1);
        block.vis = Array3::from_shape_fn((1, 2, 1), |(_, c, _)| predict(uvw, header.spectrum.freq_hz()[c]));
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.ms");
        let mut writer = MsWriter::create(&path, &header, &CreateOptions::default()).unwrap();
        writer.write(&block).unwrap();
        writer.complete().unwrap();
        let main = Table::open(&path).unwrap();
        let (mut stored, mut vis) = ([0.0_f64; 3], [Complex::<f32>::default(); 2]);
        main.get_into("UVW", 0, &[3], &mut stored).unwrap();
        main.get_into("DATA", 0, &[1, 2], &mut vis).unwrap();
        assert_eq!(stored, uvw.map(|x| -x));
        assert_eq!(vis[1], block.vis[(0, 1, 0)].conj());
        assert!((vis[1] - predict(stored, 2e9)).norm() < 1e-6, "the same formula holds with the uvw of the disk");
    }
}
