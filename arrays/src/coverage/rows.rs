//! Baseline-time rows: uvw, antenna pairs, times.

use crate::{ArrayError, Result};
use ndarray::{Array, Array2, Axis, RemoveAxis, s};
use std::ops::Range;

/// Baseline-time rows. `ant1` and `ant2` index the antennas of the layout; uvw = r2 - r1.
#[derive(Debug, Clone, PartialEq)]
pub struct UvCoverage {
    /// Baseline vectors, m \[blt, 3\].
    pub uvw_m: Array2<f64>,
    /// Index of the first antenna \[blt\].
    pub ant1: Vec<u32>,
    /// Index of the second antenna \[blt\].
    pub ant2: Vec<u32>,
    /// Midpoint of the integration, Julian date UTC \[blt\].
    pub time_jd: Vec<f64>,
    /// Length of the integration, s \[blt\].
    pub integration_s: Vec<f64>,
    /// Index into the phase centres of the header \[blt\].
    pub phase_center: Vec<u16>,
}

impl UvCoverage {
    /// Rows from their columns.
    ///
    /// # Errors
    /// Columns of different lengths, or a uvw array that is not \[blt, 3\].
    pub fn new(
        uvw_m: Array2<f64>,
        ant1: Vec<u32>,
        ant2: Vec<u32>,
        time_jd: Vec<f64>,
        integration_s: Vec<f64>,
        phase_center: Vec<u16>,
    ) -> Result<Self> {
        let rows = ant1.len();
        ArrayError::unless_shape("uvw", uvw_m.shape(), &[rows, 3])?;
        for (what, len) in [
            ("antenna 2", ant2.len()),
            ("time", time_jd.len()),
            ("integration time", integration_s.len()),
            ("phase centre", phase_center.len()),
        ] {
            ArrayError::unless_shape(what, &[len], &[rows])?;
        }
        Ok(Self { uvw_m, ant1, ant2, time_jd, integration_s, phase_center })
    }

    /// No rows.
    #[must_use]
    pub fn empty() -> Self {
        Self {
            uvw_m: Array2::zeros((0, 3)),
            ant1: Vec::new(),
            ant2: Vec::new(),
            time_jd: Vec::new(),
            integration_s: Vec::new(),
            phase_center: Vec::new(),
        }
    }

    /// Number of rows.
    #[must_use]
    pub fn n_rows(&self) -> usize {
        self.ant1.len()
    }

    /// A run of rows, copied.
    ///
    /// # Errors
    /// A range past the last row.
    pub fn rows(&self, range: Range<usize>) -> Result<Self> {
        ArrayError::unless_rows(&range, self.n_rows())?;
        Ok(Self {
            uvw_m: self.uvw_m.slice(s![range.clone(), ..]).to_owned(),
            ant1: self.ant1[range.clone()].to_vec(),
            ant2: self.ant2[range.clone()].to_vec(),
            time_jd: self.time_jd[range.clone()].to_vec(),
            integration_s: self.integration_s[range.clone()].to_vec(),
            phase_center: self.phase_center[range].to_vec(),
        })
    }

    /// Some rows, copied in the order given.
    ///
    /// # Errors
    /// A row past the last.
    pub fn select(&self, rows: &[usize]) -> Result<Self> {
        if let Some(&index) = rows.iter().find(|r| **r >= self.n_rows()) {
            return Err(ArrayError::OutOfRange { what: "row", index, len: self.n_rows() });
        }
        Ok(Self {
            uvw_m: self.uvw_m.select(Axis(0), rows),
            ant1: rows.iter().map(|r| self.ant1[*r]).collect(),
            ant2: rows.iter().map(|r| self.ant2[*r]).collect(),
            time_jd: rows.iter().map(|r| self.time_jd[*r]).collect(),
            integration_s: rows.iter().map(|r| self.integration_s[*r]).collect(),
            phase_center: rows.iter().map(|r| self.phase_center[*r]).collect(),
        })
    }

    /// Append the rows of `other`.
    ///
    /// # Errors
    /// None for coverages made by this crate. The shape of uvw is checked.
    pub fn append(&mut self, other: &Self) -> Result<()> {
        append_rows("uvw", &mut self.uvw_m, &other.uvw_m)?;
        self.ant1.extend_from_slice(&other.ant1);
        self.ant2.extend_from_slice(&other.ant2);
        self.time_jd.extend_from_slice(&other.time_jd);
        self.integration_s.extend_from_slice(&other.integration_s);
        self.phase_center.extend_from_slice(&other.phase_center);
        Ok(())
    }

    /// Longest baseline in the u-v plane, m; 0 without rows.
    #[must_use]
    pub fn longest_uv_m(&self) -> f64 {
        self.uvw_m.rows().into_iter().map(|r| r[0].hypot(r[1])).fold(0.0, f64::max)
    }
}

/// Append along the rows. The error names the array whose shape does not fit.
pub(crate) fn append_rows<T: Clone, D: RemoveAxis>(what: &'static str, to: &mut Array<T, D>, from: &Array<T, D>) -> Result<()> {
    let expected = to.shape().to_vec();
    to.append(Axis(0), from.view()).map_err(|_| ArrayError::ShapeMismatch { what, expected, found: from.shape().to_vec() })
}
