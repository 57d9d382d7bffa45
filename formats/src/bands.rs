//! Responses of receivers as CSV: a line for each frequency under `freq_hz` (or `freq_ghz`), or `offset_hz` from the middle of each channel; then
//! `re,im`, or `amplitude` and, optional, `phase_deg`; and `antenna` where the receivers differ (empty: all that have no lines of their own).

use crate::lines::{Lines, quoted};
use crate::{FormatError, Result, atomic::write_file};
use cittert_arrays::{ArrayLayout, BandSample, BandTable};
use num_complex::Complex64;
use std::fmt::Write;
use std::path::Path;

const NAMES: [&str; 8] = ["antenna", "freq_hz", "freq_ghz", "offset_hz", "re", "im", "amplitude", "phase_deg"];

/// Read the response of receivers over frequency.
///
/// # Errors
/// A column that is missing or not known, a number that is none, or samples that make no response.
pub fn read_band(path: &Path) -> Result<BandTable> {
    let mut lines = Lines::open(path, &NAMES)?;
    let axes: Vec<(&str, f64)> = [("freq_hz", 1.0), ("freq_ghz", 1e9), ("offset_hz", 1.0)].into_iter().filter(|a| lines.has(a.0)).collect();
    let [axis] = axes[..] else {
        return Err(FormatError::malformed(path, "names of the columns", "one of freq_hz, freq_ghz and offset_hz", axes.len().to_string()));
    };
    let polar = lines.has("amplitude");
    lines.require(if polar { &["amplitude"] } else { &["re", "im"] })?;
    if polar && (lines.has("re") || lines.has("im")) {
        return Err(FormatError::malformed(path, "names of the columns", "re and im, or amplitude and phase_deg", "both"));
    }
    let mut samples = Vec::new();
    while lines.next()? {
        let response = if polar {
            Complex64::from_polar(lines.number("amplitude")?, lines.number_or("phase_deg", 0.0)?.to_radians())
        } else {
            Complex64::new(lines.number("re")?, lines.number("im")?)
        };
        let antenna = Some(lines.text("antenna")?).filter(|a| !a.is_empty());
        samples.push(BandSample { antenna, freq_hz: lines.number(axis.0)? * axis.1, response });
    }
    BandTable::new(samples, axis.0 == "offset_hz").map_err(|e| FormatError::values(path, e))
}

/// Write how the receivers of a layout are out of tune: offset in Hz, width over what it should be, and jitter in s, for each antenna.
///
/// # Errors
/// An existing output that may not be overwritten, or an error of the file system.
pub fn write_receivers(path: &Path, layout: &ArrayLayout, of: &[[f64; 3]], overwrite: bool) -> Result<()> {
    let mut text = String::from("antenna,band_offset_hz,band_width,jitter_s\n");
    for (antenna, [offset, width, jitter]) in layout.antennas().iter().zip(of) {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{},{offset:?},{width:?},{jitter:?}", quoted(&antenna.name));
    }
    write_file(path, overwrite, text.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_ways_to_write_a_response_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("b.csv");
        let read = |text: &str| {
            std::fs::write(&path, text).unwrap();
            read_band(&path)
        };
        let a = read("# a receiver\nfreq_ghz,amplitude,phase_deg\n94,1,0\n94.1,2,90\n").unwrap();
        let b = read("freq_hz,re,im\n94e9,1,0\n94.1e9,0,2\n").unwrap();
        let (a, b) = (a.samples("x").unwrap(), b.samples("x").unwrap());
        assert!(a.iter().zip(b).all(|(a, b)| a.0 == b.0 && (a.1 - b.1).norm() < 1e-15));
        let each = read("antenna,offset_hz,amplitude\nA,-1,1\nA,1,1\n,-2,1\n,2,1\n").unwrap();
        assert!(each.relative);
        assert_eq!([each.samples("A").unwrap()[0].0, each.samples("B").unwrap()[0].0], [-1.0, -2.0]);
        assert!(read("freq_hz,offset_hz,re,im\n1,1,1,1\n").unwrap_err().to_string().contains("one of freq_hz"));
        assert!(read("freq_hz,re\n1,1\n").unwrap_err().to_string().contains("im"));
        assert!(read("freq_hz,amplitude\n1,1\n").unwrap_err().to_string().contains("two samples"));
        assert!(read("freq_hz,gain\n1,1\n").unwrap_err().to_string().contains("gain"));
    }
}
