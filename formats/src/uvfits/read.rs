//! Reading UVFITS in runs of rows: only the requested rows are in memory.

use super::axes::GroupAxes;
use super::groups::{Parameters, UvwKind};
use super::{annotations, antennas, phase};
use crate::files::open_file;
use crate::fits::{Header, Input, Number, padding, table::Table};
use crate::uvh5::Sky;
use crate::{FormatError, Result};
use cittert_arrays::{ArrayError, UvCoverage, VisUnit, VisibilityBlock, VisibilityHeader, VisibilitySource};
use ndarray::{Array2, Array3};
use num_complex::Complex;
use std::collections::HashMap;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Bytes of groups that are in memory while their coverage is read.
const COVERAGE_BYTES: usize = 1 << 22;

/// An open UVFITS file.
pub struct UvfitsReader {
    file: File,
    path: PathBuf,
    header: VisibilityHeader,
    axes: GroupAxes,
    parameters: Parameters,
    pub(super) number: Number,
    data_start: u64,
    pub(super) group_bytes: usize,
    n_rows: usize,
    /// Scale and zero of the numbers of the array.
    pub(super) scale: (f64, f64),
    integration_s: f64,
    index_of_number: HashMap<i64, u32>,
    index_of_source: HashMap<i64, u16>,
    sky: Sky,
}

/// The AIPS tables after the groups.
#[derive(Default)]
struct Tables {
    an: Option<Table>,
    fq: Option<Table>,
    su: Option<Table>,
}

impl Tables {
    fn read(input: &mut Input) -> Result<Self> {
        let mut tables = Self::default();
        while let Some(header) = Header::read(input, false)? {
            let first = header.integer("EXTVER").unwrap_or(1) == 1;
            let name = header.text("EXTNAME").unwrap_or("").trim().to_string();
            let slot = match name.as_str() {
                "AIPS AN" if first => &mut tables.an,
                "AIPS FQ" => &mut tables.fq,
                "AIPS SU" => &mut tables.su,
                _ => {
                    let bytes = header.data_bytes()?;
                    input.skip(&format!("table {name}"), bytes)?;
                    let mut gap = vec![0; padding(bytes) as usize];
                    input.read_some(&mut gap)?;
                    continue;
                }
            };
            *slot = Some(Table::read(input, header)?);
        }
        Ok(tables)
    }
}

impl UvfitsReader {
    /// Open a UVFITS file.
    ///
    /// # Errors
    /// A file that is not FITS, has no random groups or is truncated; a missing AN table, axis or parameter.
    pub fn open(path: &Path) -> Result<Self> {
        let mut input = Input::open(path)?;
        if !input.is_plain() {
            return Err(FormatError::unsupported(path, "the file is compressed: unpack it first (gunzip)"));
        }
        let primary = Header::read(&mut input, true)?.ok_or_else(|| FormatError::unsupported(path, "no header"))?;
        if !(primary.is_true("GROUPS") && primary.integer("NAXIS1") == Some(0)) {
            return Err(FormatError::not_a(
                path,
                "UVFITS (random groups: NAXIS1 = 0 and GROUPS = T)",
                "a FITS file without random groups (an image, or tables)",
            ));
        }
        let axes = GroupAxes::of(&primary)?;
        let number = Number::of(&primary)?;
        let frequency = primary.real(&format!("CRVAL{}", axes.freq_axis)).unwrap_or(0.0);
        let parameters = Parameters::of(&primary, frequency)?;
        let group_bytes = (parameters.count + axes.numbers) * number.bytes();
        let n_rows = primary.require("GCOUNT", 1..=i64::MAX)? as usize;
        let data_start = input.position();
        let bytes = primary.data_bytes()?;
        input.skip("visibilities (random groups)", bytes)?;
        input.read_some(&mut vec![0; padding(bytes) as usize])?;
        let tables = Tables::read(&mut input)?;
        let an = tables.an.ok_or_else(|| FormatError::malformed(path, "extensions", "an AIPS AN table (antennas)", "none"))?;
        let mut layout = antennas::read(&an, &primary)?;
        // A card that another program has changed is no reason to refuse the set.
        layout.pattern = primary.text("CITPATT").and_then(|t| t.parse().ok()).unwrap_or_default();
        let su = tables.su.as_ref().filter(|_| parameters.source.is_some());
        let phase_centers = phase::read(&primary, &axes, su)?;
        let text = |key: &str| primary.text(key).unwrap_or("").to_string();
        let telescope = if text("TELESCOP").is_empty() { layout.name.clone() } else { text("TELESCOP") };
        let header = VisibilityHeader {
            spectrum: axes.spectrum(&primary, tables.fq.as_ref())?,
            polarizations: axes.polarizations(&primary)?,
            unit: VisUnit::from_name(primary.text("BUNIT").unwrap_or("")),
            instrument: text("INSTRUME"),
            pedestal_k: primary.real("CITPEDST"),
            scene_pedestal_k: primary.real("CITSCPED"),
            scene_width_rad: primary.real("CITSCWID").filter(|w| *w > 0.0),
            antenna_temperature_k: primary.real("CITTANT"),
            near_field: crate::fits::near_field(&primary),
            annotations: annotations::read(&primary, &an),
            history: primary.history.clone(),
            phase_centers,
            telescope,
            layout,
        };
        let file = open_file(path)?;
        let scale = (primary.real("BSCALE").unwrap_or(1.0), primary.real("BZERO").unwrap_or(0.0));
        let index_of_number = header.layout.antennas().iter().enumerate().map(|(k, a)| (i64::from(a.number), k as u32)).collect();
        let index_of_source = header.phase_centers.iter().enumerate().map(|(k, c)| (c.id, k as u16)).collect();
        let sky = Sky::over(header.layout.site().unwrap_or(crate::uvh5::NOMINAL_SITE));
        let mut reader = Self {
            file,
            path: path.into(),
            header,
            axes,
            parameters,
            number,
            data_start,
            group_bytes,
            n_rows,
            scale,
            integration_s: 0.0,
            index_of_number,
            index_of_source,
            sky,
        };
        if reader.parameters.integration.is_none() {
            reader.integration_s = reader.shortest_step_s()?;
        }
        Ok(reader)
    }

    /// Shortest time between rows, s, for files that do not state the integration time; 0 with a single time.
    fn shortest_step_s(&mut self) -> Result<f64> {
        let mut times = Vec::new();
        for start in (0..self.n_rows.min(200_000)).step_by(1000) {
            let range = start..(start + 1000).min(self.n_rows);
            let n = range.len();
            let bytes = self.bytes(range)?;
            times.extend((0..n).map(|r| self.parameters.time_jd(self.number, &bytes[r * self.group_bytes..(r + 1) * self.group_bytes])));
        }
        times.sort_by(f64::total_cmp);
        let step = times.windows(2).map(|w| (w[1] - w[0]) * 86_400.0).filter(|d| *d > 1e-3).fold(f64::INFINITY, f64::min);
        Ok(if step.is_finite() { step } else { 0.0 })
    }

    /// The bytes of the primary header.
    pub(super) fn header_bytes(&mut self) -> Result<Vec<u8>> {
        let io = |e| FormatError::io(&self.path, "read", e);
        let mut buffer = vec![0; self.data_start as usize];
        self.file.seek(SeekFrom::Start(0)).map_err(io)?;
        self.file.read_exact(&mut buffer).map_err(io)?;
        Ok(buffer)
    }

    /// The file at the start of the groups, to copy all that follows.
    pub(super) fn seek_groups(&mut self) -> Result<&mut File> {
        self.file.seek(SeekFrom::Start(self.data_start)).map_err(|e| FormatError::io(&self.path, "read", e))?;
        Ok(&mut self.file)
    }

    /// Indices of real part, imaginary part and weight of a visibility in the numbers of a group.
    pub(super) fn places(&self, chan: usize, pol: usize) -> [usize; 3] {
        [0, 1, 2].map(|k| self.parameters.count + self.axes.offset(chan, pol) + k * self.axes.complex)
    }

    /// Read the bytes of the groups of `range`.
    pub(super) fn bytes(&mut self, range: Range<usize>) -> Result<Vec<u8>> {
        let io = |e| FormatError::io(&self.path, "read", e);
        let mut buffer = vec![0; range.len() * self.group_bytes];
        self.file.seek(SeekFrom::Start(self.data_start + range.start as u64 * self.group_bytes as u64)).map_err(io)?;
        self.file.read_exact(&mut buffer).map_err(io)?;
        Ok(buffer)
    }

    /// Read the rows of `range`.
    ///
    /// # Errors
    /// A range past the last row, an antenna or source that the tables do not have, several subarrays or frequency set-ups.
    pub fn read(&mut self, range: Range<usize>) -> Result<VisibilityBlock> {
        if range.end > self.n_rows || range.start > range.end {
            let error = ArrayError::OutOfRange { what: "row", index: range.end, len: self.n_rows };
            return Err(FormatError::values(&self.path, error));
        }
        let (start, rows) = (range.start, range.len());
        let bytes = self.bytes(range)?;
        let (_, n_chan, n_pol) = self.header.shape(rows);
        let mut vis = Array3::zeros((rows, n_chan, n_pol));
        let mut weights = Array3::zeros((rows, n_chan, n_pol));
        let mut flags = Array3::from_elem((rows, n_chan, n_pol), false);
        let mut coverage = UvCoverage::empty();
        coverage.uvw_m = Array2::zeros((rows, 3));
        let offsets: Vec<usize> = (0..n_chan * n_pol).map(|i| self.parameters.count + self.axes.offset(i / n_pol, i % n_pol)).collect();
        let step = self.axes.complex;
        for (r, group) in bytes.chunks_exact(self.group_bytes).enumerate() {
            self.row(&mut coverage, r, start + r, group)?;
            let get = |k: usize| {
                let raw = self.number.get(group, k);
                if self.scale == (1.0, 0.0) { raw } else { raw * self.scale.0 + self.scale.1 }
            };
            for (i, at) in offsets.iter().enumerate() {
                let cell = (r, i / n_pol, i % n_pol);
                let weight = get(at + 2 * step);
                vis[cell] = Complex::new(get(*at) as f32, -get(at + step) as f32);
                weights[cell] = weight.abs() as f32;
                flags[cell] = !(weight > 0.0);
            }
        }
        let nsamples = weights.clone();
        VisibilityBlock::new(coverage, vis, weights, flags, nsamples).map_err(|e| FormatError::values(&self.path, e))
    }

    /// Copy the parameters of one group into row `r` of the block. `row` is the row in the file.
    fn row(&mut self, coverage: &mut UvCoverage, r: usize, row: usize, group: &[u8]) -> Result<()> {
        let (p, number) = (&self.parameters, self.number);
        let bad = |place: &str, expected: &str, found: String| {
            FormatError::malformed(&self.path, format!("group {row}, {place}"), expected, found)
        };
        let pair = p.pair(number, group);
        if pair.subarray != 1 {
            return Err(bad("SUBARRAY", "1 (split files with several subarrays first)", pair.subarray.to_string()));
        }
        let antenna = |n: i64| {
            self.index_of_number.get(&n).copied().ok_or_else(|| bad("antenna", "a number (NOSTA) of the AIPS AN table", n.to_string()))
        };
        let (first, second) = (antenna(pair.first)?, antenna(pair.second)?);
        if let Some(id) = p.freq_id.as_ref().map(|f| f.get(number, group)).filter(|id| *id > 1.0) {
            return Err(bad("FREQSEL", "1 (split files with several frequency set-ups first)", id.to_string()));
        }
        let center = match &p.source {
            Some(source) if self.header.phase_centers.len() > 1 || self.header.phase_centers[0].id != 0 => {
                let id = source.get(number, group).round() as i64;
                *self.index_of_source.get(&id).ok_or_else(|| bad("SOURCE", "a number of the AIPS SU table", id.to_string()))?
            }
            _ => 0,
        };
        let time = p.time_jd(number, group);
        if !time.is_finite() {
            return Err(bad("DATE", "a finite Julian date", time.to_string()));
        }
        let mut uvw = p.uvw_m(number, group);
        if p.kind == UvwKind::Ncp {
            let place =
                self.sky.at(time, &self.header.phase_centers, usize::from(center)).map_err(|e| FormatError::values(&self.path, e))?.1;
            uvw = from_ncp(uvw, place.dec_rad);
        }
        coverage.uvw_m.row_mut(r).assign(&ndarray::arr1(&uvw));
        coverage.ant1.push(first);
        coverage.ant2.push(second);
        coverage.time_jd.push(time);
        coverage.integration_s.push(self.parameters.integration.as_ref().map_or(self.integration_s, |p| p.get(number, group)));
        coverage.phase_center.push(center);
        Ok(())
    }
}

/// Convert uvw with w along the pole to uvw with w along the phase centre: a rotation about u by 90 deg minus the apparent declination.
fn from_ncp([u, v, w]: [f64; 3], dec: f64) -> [f64; 3] {
    let (sin, cos) = dec.sin_cos();
    [u, v * sin + w * cos, w * sin - v * cos]
}

impl VisibilitySource for UvfitsReader {
    fn header(&self) -> &VisibilityHeader {
        &self.header
    }

    fn n_rows(&self) -> usize {
        self.n_rows
    }

    fn read_rows(&mut self, range: Range<usize>) -> Result<VisibilityBlock, ArrayError> {
        Ok(self.read(range)?)
    }

    fn read_coverage(&mut self, range: Range<usize>) -> Result<UvCoverage, ArrayError> {
        ArrayError::unless_rows(&range, self.n_rows).map_err(|e| FormatError::values(&self.path, e))?;
        let mut coverage = UvCoverage::empty();
        coverage.uvw_m = Array2::zeros((range.len(), 3));
        // A run of groups is in memory at once, as they hold the visibilities too.
        let step = (COVERAGE_BYTES / self.group_bytes).max(1);
        let mut start = range.start;
        while start < range.end {
            let end = (start + step).min(range.end);
            let bytes = self.bytes(start..end)?;
            for (k, group) in bytes.chunks_exact(self.group_bytes).enumerate() {
                self.row(&mut coverage, start - range.start + k, start + k, group)?;
            }
            start = end;
        }
        Ok(coverage)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn w_along_the_pole_turns_to_the_phase_centre() {
        // Values of pyuvdata 3.2.8, _rotate_one_axis about the first axis by dec - 90 deg.
        let found = from_ncp([1.0, 2.0, 3.0], 0.3);
        for (a, b) in found.iter().zip([1.0, 3.457_049_880_7, -1.024_112_358_3]) {
            assert!((a - b).abs() < 1e-9, "{found:?}");
        }
        assert_eq!(from_ncp([1.0, 2.0, 3.0], std::f64::consts::FRAC_PI_2).map(f64::round), [1.0, 2.0, 3.0]);
    }
}
