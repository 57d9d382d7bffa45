//! Writing UVFITS in runs of rows, in constant memory.

use super::export::{Export, phase_centers};
use super::{annotations, tables};
use crate::atomic::AtomicFile;
use crate::drift::{Drift, Phased};
use crate::fits::{HeaderWriter, padding};
use crate::{ColumnSink, FormatError, Result};
use cittert_arrays::{ArrayError, PhaseCenter, SPEED_OF_LIGHT_M_S, VisUnit, VisibilityBlock, VisibilityHeader, VisibilitySink};
use ndarray::ArrayView3;
use num_complex::Complex;
use std::f64::consts::TAU;
use std::fs::File;
use std::io::{BufWriter, Seek, SeekFrom, Write};
use std::path::Path;

/// Options of a new UVFITS file.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct UvfitsOptions {
    /// Replace an existing file.
    pub overwrite: bool,
    /// Keep a set of Stokes I as it is. By default it is written as two equal hands RR and LL, because the importer of CASA refuses Stokes I.
    pub stokes_i: bool,
}

/// A UVFITS file being written.
pub struct UvfitsWriter {
    file: BufWriter<File>,
    out: AtomicFile,
    header: VisibilityHeader,
    export: Export,
    start: Option<Start>,
    rows: u64,
}

/// Properties of the file that depend on the first row.
struct Start {
    /// 0 h UTC of the day of the first row.
    midnight_jd: f64,
    centers: Vec<PhaseCenter>,
    /// The phasing of rows to them, where the array does not track the sky.
    drift: Option<Drift>,
    /// Factor on the weights of each channel.
    weights: Vec<f32>,
}

impl UvfitsWriter {
    /// Begin a file for sets with this header.
    ///
    /// # Errors
    /// The output exists and may not be overwritten, or its folder is not writable.
    pub fn create(path: &Path, header: &VisibilityHeader, options: UvfitsOptions) -> Result<Self> {
        let export = Export::of(header, options.stokes_i);
        let out = AtomicFile::create(path, options.overwrite)?;
        let file = BufWriter::with_capacity(1 << 18, out.open()?);
        Ok(Self { file, out, header: header.clone(), export, start: None, rows: 0 })
    }

    /// What was changed or is not kept, one sentence each. The history of the file holds the same sentences.
    #[must_use]
    pub fn notes(&self) -> &[String] {
        &self.export.notes
    }

    fn io(&self) -> impl Fn(std::io::Error) -> FormatError + use<> {
        let path = self.out.target().to_path_buf();
        move |e| FormatError::io(&path, "write", e)
    }

    fn values(&self) -> impl Fn(ArrayError) -> FormatError + use<> {
        let path = self.out.target().to_path_buf();
        move |e| FormatError::values(&path, e)
    }

    /// True where rows name their phase centre.
    fn several_sources(&self) -> bool {
        self.header.phase_centers.len() > 1
    }

    /// True where BASELINE can hold the antenna numbers.
    fn short_numbers(&self) -> bool {
        self.export.numbers.iter().all(|n| *n <= 255)
    }

    /// Names, scales and zeros of the parameters.
    fn parameters(&self, midnight_jd: f64) -> Vec<(&'static str, f64)> {
        let mut list = vec![("UU---SIN", 0.0), ("VV---SIN", 0.0), ("WW---SIN", 0.0)];
        if self.short_numbers() {
            list.push(("BASELINE", 0.0));
        }
        list.extend([("DATE", midnight_jd), ("DATE", 0.0), ("INTTIM", 0.0)]);
        if self.several_sources() {
            list.push(("SOURCE", 0.0));
        }
        list.extend([("ANTENNA1", 0.0), ("ANTENNA2", 0.0), ("SUBARRAY", 0.0)]);
        list
    }

    /// The primary header for `rows` rows; its length does not depend on their number.
    fn primary(&self, start: &Start, rows: u64) -> Vec<u8> {
        let (w, pols) = (&self.export.windows, &self.export.pols);
        let parameters = self.parameters(start.midnight_jd);
        let mut h = HeaderWriter::default();
        h.logical("SIMPLE", true, "conforms to FITS standard");
        h.integer("BITPIX", -32, "32-bit floating point");
        h.integer("NAXIS", 7, "");
        for (k, n) in [0, 3, pols.len(), w.n_freq, w.n_if, 1, 1].iter().enumerate() {
            h.integer(&format!("NAXIS{}", k + 1), *n as i64, "");
        }
        h.logical("EXTEND", true, "");
        h.logical("GROUPS", true, "random groups");
        h.integer("PCOUNT", parameters.len() as i64, "");
        h.integer("GCOUNT", rows as i64, "");
        let several = self.several_sources();
        let center = &start.centers[0];
        let (ra, dec) = center.ra_dec_rad().filter(|_| !several).map_or((0.0, 0.0), |(a, d)| (a.to_degrees(), d.to_degrees()));
        let pol_step = pols.get(1).map_or(-1, |second| second.aips - pols[0].aips);
        for (k, (ctype, value, step)) in [
            ("COMPLEX", 1.0, 1.0),
            ("STOKES", f64::from(pols[0].aips), f64::from(pol_step)),
            ("FREQ", w.first_hz[0], w.step_hz[0]),
            ("IF", 1.0, 1.0),
            ("RA", ra, 1.0),
            ("DEC", dec, 1.0),
        ]
        .into_iter()
        .enumerate()
        {
            let k = k + 2;
            h.text(&format!("CTYPE{k}"), ctype, "");
            h.real(&format!("CRVAL{k}"), value, "");
            h.real(&format!("CDELT{k}"), step, "");
            h.real(&format!("CRPIX{k}"), 1.0, "");
            h.real(&format!("CROTA{k}"), 0.0, "");
        }
        for (k, (name, zero)) in parameters.iter().enumerate() {
            h.text(&format!("PTYPE{}", k + 1), name, "");
            h.real(&format!("PSCAL{}", k + 1), 1.0, "");
            h.real(&format!("PZERO{}", k + 1), *zero, "");
        }
        h.text("BUNIT", self.export.unit, "");
        if self.header.unit != VisUnit::Uncalibrated {
            // Stokes I is half the sum of the parallel hands.
            h.text("POLCONV", "avg", "");
        }
        h.real("BSCALE", 1.0, "");
        h.real("BZERO", 0.0, "");
        h.text("OBJECT", if several { "MULTI" } else { &center.name }, "");
        let telescope = tables::telescope(&self.header);
        h.text("TELESCOP", telescope, "");
        h.text("INSTRUME", if self.header.instrument.is_empty() { telescope } else { &self.header.instrument }, "");
        let date = crate::time::fits_date(start.midnight_jd).unwrap_or_default();
        h.text("DATE-OBS", date.get(..10).unwrap_or(""), "");
        h.real("EPOCH", center.epoch.unwrap_or(2000.0), "");
        // The standard writes ICRS, but readers of UVFITS know the name in small letters only.
        h.text("RADESYS", &center.frame.to_ascii_lowercase(), "");
        if !several {
            h.real("OBSRA", ra, "deg");
            h.real("OBSDEC", dec, "deg");
        }
        h.text("ORIGIN", "cittert", "");
        if let Some(pedestal) = self.header.pedestal_k {
            h.real("CITPEDST", pedestal, "K, removed from the scene before the transform");
        }
        if let Some(right) = self.header.scene_pedestal_k {
            h.real("CITSCPED", right, "K, suits the scene");
        }
        if let Some(width) = self.header.scene_width_rad {
            h.real("CITSCWID", width, "rad, width of the simulated scene");
        }
        if let Some(seen) = self.header.antenna_temperature_k {
            h.real("CITTANT", seen, "K, antenna temperature by total power");
        }
        if self.header.layout.pattern.parameters().is_some() {
            h.text("CITPATT", &self.header.layout.pattern.to_string(), "");
        }
        crate::fits::write_near_field(&mut h, &self.header.near_field);
        annotations::write(&mut h, &self.header.annotations);
        h.history(&self.header.history);
        h.history(&annotations::lost_keywords(&self.header.annotations).into_iter().map(|l| l.1).collect::<Vec<_>>());
        h.history(&self.export.notes.iter().map(|n| format!("UVFITS export: {n}")).collect::<Vec<_>>());
        h.finish()
    }

    /// Append a block.
    ///
    /// # Errors
    /// A block whose shape is not that of the header, or an error of the file system.
    pub fn write(&mut self, block: &VisibilityBlock) -> Result<()> {
        self.header.check_block(block).map_err(self.values())?;
        let Some(first) = block.coverage.time_jd.first() else { return Ok(()) };
        let io = self.io();
        let mut start = match self.start.take() {
            Some(start) => start,
            None => {
                let (centers, drift) = phase_centers(&self.header, *first).map_err(self.values())?;
                let start = Start { midnight_jd: (first - 0.5).floor() + 0.5, centers, drift, weights: self.weights(block) };
                let primary = self.primary(&start, 0);
                self.file.write_all(&primary).map_err(&io)?;
                start
            }
        };
        let mut group = Vec::new();
        for row in 0..block.n_rows() {
            group.clear();
            let c = &block.coverage;
            let uvw_m = [0, 1, 2].map(|k| c.uvw_m[(row, k)]);
            let place = match &mut start.drift {
                Some(drift) => drift.phased(usize::from(c.phase_center[row]), c.time_jd[row], uvw_m).map_err(self.values())?,
                None => Phased { uvw_m, stop_w_m: 0.0 },
            };
            self.parameters_of(block, row, (start.midnight_jd, place.uvw_m), &mut group);
            self.data_of(block, row, (&start.weights, place.stop_w_m), &mut group);
            self.file.write_all(bytemuck::cast_slice(&group)).map_err(&io)?;
        }
        self.rows += block.n_rows() as u64;
        self.start = Some(start);
        Ok(())
    }

    /// Factors on the weights, which are 1/Jy^2 for data in Jy. Weights that are only numbers of samples carry no information on the noise. They
    /// keep their size, because importers take weights near the smallest 32-bit float as zero.
    fn weights(&self, block: &VisibilityBlock) -> Vec<f32> {
        let jy = &self.export.jy;
        let unit = if block.weights == block.nsamples { jy.iter().map(|f| f * f).sum::<f64>() / jy.len() as f64 } else { 1.0 };
        jy.iter().map(|f| (unit / (f * f)) as f32).collect()
    }

    /// The parameters of a row, big-endian.
    fn parameters_of(&self, block: &VisibilityBlock, row: usize, (midnight_jd, uvw_m): (f64, [f64; 3]), group: &mut Vec<[u8; 4]>) {
        let c = &block.coverage;
        let mut push = |v: f64| group.push((v as f32).to_be_bytes());
        uvw_m.iter().for_each(|v| push(-v / SPEED_OF_LIGHT_M_S));
        let [a, b] = [c.ant1[row], c.ant2[row]].map(|a| f64::from(self.export.numbers[a as usize]));
        if self.short_numbers() {
            push(256.0 * a + b);
        }
        // The time in two 32-bit parts is accurate to better than a microsecond.
        let day = c.time_jd[row] - midnight_jd;
        push(day);
        push(day - f64::from(day as f32));
        push(c.integration_s[row]);
        if self.several_sources() {
            push(f64::from(c.phase_center[row]) + 1.0);
        }
        push(a);
        push(b);
        push(1.0);
    }

    /// Conjugated visibilities and weights of a row, big-endian; flagged ones have negative weights.
    fn data_of(&self, block: &VisibilityBlock, row: usize, (weights, stop_w_m): (&[f32], f64), group: &mut Vec<[u8; 4]>) {
        for (chan, jy) in self.export.jy.iter().enumerate() {
            let turns = stop_w_m * self.header.spectrum.freq_hz()[chan] / SPEED_OF_LIGHT_M_S;
            let factor = Complex::from_polar(*jy, -TAU * turns.fract());
            for pol in &self.export.pols {
                let [re, im, weight] = match pol.from {
                    None => [0.0; 3],
                    Some(p) => {
                        let at = (row, chan, p);
                        let w = block.weights[at] * pol.weight * weights[chan];
                        let weight = if block.flags[at] { -w.abs() } else { w };
                        let v = block.vis[at];
                        if *jy == 1.0 && stop_w_m == 0.0 {
                            [v.re, -v.im, weight]
                        } else {
                            let v = Complex::new(f64::from(v.re), f64::from(v.im)) * factor;
                            [v.re as f32, -v.im as f32, weight]
                        }
                    }
                };
                group.extend([re, im, weight].map(f32::to_be_bytes));
            }
        }
    }

    /// Write the tables and give the file its final name.
    ///
    /// # Errors
    /// A set without rows, or an error of the file system. The old file then stays in place.
    pub fn complete(mut self) -> Result<()> {
        let (io, values) = (self.io(), self.values());
        let Some(start) = self.start.take() else {
            return Err(values(ArrayError::bad_value("number of rows", "0", "at least one row of visibilities")));
        };
        let w = &self.export.windows;
        let numbers = self.parameters(0.0).len() + 3 * self.export.pols.len() * w.n_freq * w.n_if;
        let bytes = 4 * numbers as u64 * self.rows;
        self.file.write_all(&vec![0; padding(bytes) as usize]).map_err(&io)?;
        self.file.write_all(&tables::antennas(&self.header, &self.export, start.midnight_jd).map_err(&values)?).map_err(&io)?;
        self.file.write_all(&tables::frequencies(&self.export)).map_err(&io)?;
        if self.several_sources() {
            let su = tables::sources(&self.export, &start.centers, start.midnight_jd, &self.header).map_err(&values)?;
            self.file.write_all(&su).map_err(&io)?;
        }
        // The number of rows is known only now.
        let primary = self.primary(&start, self.rows);
        self.file.seek(SeekFrom::Start(0)).map_err(&io)?;
        self.file.write_all(&primary).map_err(&io)?;
        self.file.flush().map_err(&io)?;
        drop(self.file);
        self.out.commit()
    }
}

impl ColumnSink for UvfitsWriter {
    fn write_columns(&mut self, block: &VisibilityBlock, columns: &[ArrayView3<'_, Complex<f32>>]) -> Result<()> {
        if columns.is_empty() {
            self.write(block)
        } else {
            Err(FormatError::unsupported(self.out.target(), "UVFITS has no columns beside the data"))
        }
    }
}

impl VisibilitySink for UvfitsWriter {
    fn write_block(&mut self, block: &VisibilityBlock) -> Result<(), ArrayError> {
        Ok(self.write(block)?)
    }

    fn finish(self: Box<Self>) -> Result<(), ArrayError> {
        Ok(self.complete()?)
    }
}
