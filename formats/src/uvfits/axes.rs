//! The axes of a group: the places of real part, imaginary part and weight of each channel and polarisation.

use crate::fits::{Header, table::Table};
use crate::{FormatError, Result};
use cittert_arrays::{Polarization, SpectralWindow};

/// The array of one group: lengths and strides (in numbers) of the axes that matter.
#[derive(Debug, Clone)]
pub(super) struct GroupAxes {
    /// Numbers in the array of one group.
    pub(super) numbers: usize,
    /// Stride of the COMPLEX axis.
    pub(super) complex: usize,
    pub(super) n_pol: usize,
    pub(super) pol: usize,
    pub(super) n_freq: usize,
    pub(super) freq: usize,
    pub(super) n_if: usize,
    pub(super) intermediate: usize,
    /// Number (from 1) of the STOKES, FREQ, RA and DEC axes in the header.
    pub(super) stokes_axis: Option<usize>,
    pub(super) freq_axis: usize,
    pub(super) ra_axis: Option<usize>,
    pub(super) dec_axis: Option<usize>,
}

impl GroupAxes {
    /// Read the axes of a random-groups header.
    pub(super) fn of(header: &Header) -> Result<Self> {
        let path = header.path();
        let bad = |place: &str, expected: &str, found: String| FormatError::malformed(path, place, expected, found);
        let lengths = header.axes()?;
        let mut axes = Self {
            numbers: 1,
            complex: 0,
            n_pol: 1,
            pol: 0,
            n_freq: 1,
            freq: 0,
            n_if: 1,
            intermediate: 0,
            stokes_axis: None,
            freq_axis: 0,
            ra_axis: None,
            dec_axis: None,
        };
        let mut complex_seen = false;
        for (i, len) in lengths.iter().enumerate().skip(1) {
            let k = i + 1;
            let ctype = header.ctype(k);
            let n = usize::try_from(*len).ok().filter(|n| (1..=1 << 24).contains(n));
            let n = n.ok_or_else(|| bad(&format!("NAXIS{k}"), "1 to 16777216", len.to_string()))?;
            let stride = axes.numbers;
            axes.numbers = stride
                .checked_mul(n)
                .filter(|n| *n <= 1 << 28)
                .ok_or_else(|| bad("NAXISn", "at most 2^28 numbers in a group", "more".into()))?;
            match ctype.as_str() {
                "COMPLEX" => {
                    complex_seen = true;
                    axes.complex = stride;
                    if n == 1 {
                        return Err(FormatError::unsupported(
                            path,
                            "the data are AIPS-compressed (COMPLEX axis of length 1): write them uncompressed",
                        ));
                    }
                    if n != 3 {
                        return Err(bad(&format!("NAXIS{k} (COMPLEX)"), "3: real, imaginary, weight", n.to_string()));
                    }
                }
                "STOKES" => (axes.n_pol, axes.pol, axes.stokes_axis) = (n, stride, Some(k)),
                "FREQ" => (axes.n_freq, axes.freq, axes.freq_axis) = (n, stride, k),
                "IF" => (axes.n_if, axes.intermediate) = (n, stride),
                _ if ctype.starts_with("RA") && n == 1 => axes.ra_axis = Some(k),
                _ if ctype.starts_with("DEC") && n == 1 => axes.dec_axis = Some(k),
                _ if n == 1 => {}
                _ => {
                    return Err(bad(
                        &format!("CTYPE{k}"),
                        "COMPLEX, STOKES, FREQ, IF, RA or DEC on an axis longer than 1",
                        format!("{ctype:?}"),
                    ));
                }
            }
        }
        if !complex_seen {
            return Err(bad("CTYPE2", "an axis COMPLEX", "none".into()));
        }
        if axes.freq_axis == 0 {
            return Err(bad("CTYPE4", "an axis FREQ", "none".into()));
        }
        Ok(axes)
    }

    /// Index of the real part of a channel (over all IFs) and polarisation in the numbers of a group.
    pub(super) fn offset(&self, chan: usize, pol: usize) -> usize {
        chan / self.n_freq * self.intermediate + chan % self.n_freq * self.freq + pol * self.pol
    }

    /// Polarisations of the STOKES axis.
    pub(super) fn polarizations(&self, header: &Header) -> Result<Vec<Polarization>> {
        let Some(k) = self.stokes_axis else { return Ok(vec![Polarization::I]) };
        header.polarizations(k, self.n_pol)
    }

    /// Channels from the FREQ axis and, where there is one, the FQ table.
    pub(super) fn spectrum(&self, header: &Header, fq: Option<&Table>) -> Result<SpectralWindow> {
        let path = header.path();
        let (reference, pixel, step) = header.axis(self.freq_axis, (0.0, 0.0));
        let (mut freq, mut width, mut spw) = (Vec::new(), Vec::new(), Vec::new());
        let cells = |name: &str| -> Result<Option<Vec<f64>>> {
            let Some(table) = fq else { return Ok(None) };
            match table.reals(0, name) {
                Some(v) if v.len() >= self.n_if => Ok(Some(v)),
                Some(v) => Err(FormatError::malformed(path, format!("AIPS FQ, {name}"), format!("{} IFs", self.n_if), v.len().to_string())),
                None => Ok(None),
            }
        };
        let (offsets, steps) = (cells("IF FREQ")?, cells("CH WIDTH")?);
        if offsets.is_none() && self.n_if > 1 {
            return Err(FormatError::malformed(path, "AIPS FQ", format!("the offsets of {} IFs", self.n_if), "no such table"));
        }
        for i in 0..self.n_if {
            let offset = offsets.as_ref().map_or(0.0, |o| o[i]);
            let mut own = steps.as_ref().map_or(step, |s| s[i]);
            // The table holds 32-bit floats. The header holds the same value with more digits.
            if own == 0.0 || (own - step).abs() <= 1e-6 * step.abs() {
                own = step;
            }
            for c in 0..self.n_freq {
                freq.push(reference + (1.0 - pixel) * step + offset + c as f64 * own);
                width.push(if own == 0.0 { reference } else { own });
                spw.push(i as u32);
            }
        }
        SpectralWindow::with_windows(freq, width, spw).map_err(|e| FormatError::values(path, e))
    }
}
