//! The response of receivers as a table over frequency, linear between its samples and 0 beyond them.

use crate::{ArrayError, Result};
use num_complex::Complex64;
use std::collections::BTreeMap;

/// A sample of the response of one receiver, or of all.
#[derive(Debug, Clone, PartialEq)]
pub struct BandSample {
    /// Name of the antenna; `None` for all antennas.
    pub antenna: Option<String>,
    /// Frequency, or distance from the middle of each channel, Hz.
    pub freq_hz: f64,
    /// Complex response in the convention V = H1 conj(H2). Its scale is arbitrary.
    pub response: Complex64,
}

/// Responses over frequency.
#[derive(Clone, PartialEq)]
pub struct BandTable {
    /// True if the frequencies are distances from the middle of each channel.
    pub relative: bool,
    /// The samples in the order of frequency, by antenna; those of `None` are for all antennas.
    of: BTreeMap<Option<String>, Vec<(f64, Complex64)>>,
}

impl std::fmt::Debug for BandTable {
    /// Its size: a history line holds this text.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let samples: usize = self.of.values().map(Vec::len).sum();
        write!(f, "BandTable({samples} samples, {})", if self.relative { "about each channel" } else { "over the band" })
    }
}

impl BandTable {
    /// From samples in any order.
    ///
    /// # Errors
    /// Fewer than two samples of an antenna, a frequency twice, a number that is not finite, or a response that is 0 everywhere.
    pub fn new(samples: Vec<BandSample>, relative: bool) -> Result<Self> {
        let mut of: BTreeMap<Option<String>, Vec<(f64, Complex64)>> = BTreeMap::new();
        for s in samples {
            of.entry(s.antenna).or_default().push((s.freq_hz, s.response));
        }
        if of.is_empty() {
            return Err(ArrayError::Parse("the table of the band has no samples".into()));
        }
        for (antenna, list) in &mut of {
            let whose = antenna.as_ref().map_or("the receivers".to_owned(), |a| format!("antenna {a:?}"));
            let bad = |what: &str| Err(ArrayError::Parse(format!("the band of {whose} {what}")));
            list.sort_by(|a, b| a.0.total_cmp(&b.0));
            if list.iter().any(|(f, h)| !(f.is_finite() && h.is_finite())) {
                return bad("holds a number that is not finite");
            }
            if list.len() < 2 || list.iter().all(|(_, h)| *h == Complex64::ZERO) {
                return bad("needs two samples or more, and a response that is not 0");
            }
            if let Some(twice) = list.windows(2).find(|w| w[0].0 == w[1].0) {
                return bad(&format!("has two samples at {} Hz", twice[0].0));
            }
        }
        Ok(Self { relative, of })
    }

    /// The samples of an antenna.
    ///
    /// # Errors
    /// The table has none for it.
    pub fn samples(&self, antenna: &str) -> Result<&[(f64, Complex64)]> {
        let found = self.of.get(&Some(antenna.to_owned())).or_else(|| self.of.get(&None));
        found.map(Vec::as_slice).ok_or_else(|| {
            ArrayError::Parse(format!("the table of the band has no samples of antenna {antenna:?}, and none for all antennas"))
        })
    }
}

/// The response at a frequency, by linear interpolation of the real and the imaginary part of samples in ascending order.
#[must_use]
pub fn band_response(samples: &[(f64, Complex64)], freq_hz: f64) -> Complex64 {
    let after = samples.partition_point(|s| s.0 < freq_hz);
    match (after.checked_sub(1).map(|k| samples[k]), samples.get(after)) {
        (Some((f0, h0)), Some((f1, h1))) => h0 + (h1 - h0) * ((freq_hz - f0) / (f1 - f0)),
        (None, Some((f, h))) if *f == freq_hz => *h,
        _ => Complex64::ZERO,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(antenna: Option<&str>, freq_hz: f64, re: f64) -> BandSample {
        BandSample { antenna: antenna.map(str::to_owned), freq_hz, response: Complex64::new(re, -re) }
    }

    #[test]
    fn samples_are_joined_by_lines_and_end() {
        let table = BandTable::new(
            vec![sample(None, 3.0, 1.0), sample(None, 1.0, 0.0), sample(Some("B"), 0.0, 1.0), sample(Some("B"), 1.0, 1.0)],
            true,
        );
        let table = table.unwrap();
        let of = |name: &str, f: f64| band_response(table.samples(name).unwrap(), f).re;
        assert_eq!([of("A", 0.9), of("A", 1.0), of("A", 2.0), of("A", 3.0), of("A", 3.1)], [0.0, 0.0, 0.5, 1.0, 0.0]);
        assert_eq!([of("B", 0.0), of("B", 0.5), of("B", 1.5)], [1.0, 1.0, 0.0]);
    }

    #[test]
    fn wrong_tables_say_whose_band_is_wrong() {
        let say = |samples: Vec<BandSample>| BandTable::new(samples, false).unwrap_err().to_string();
        assert!(say(vec![]).contains("no samples"));
        assert!(say(vec![sample(Some("B"), 1.0, 1.0)]).contains("antenna \"B\" needs two samples"));
        assert!(say(vec![sample(None, 1.0, 1.0), sample(None, 1.0, 2.0)]).contains("two samples at 1 Hz"));
        assert!(say(vec![sample(None, 1.0, f64::NAN), sample(None, 2.0, 2.0)]).contains("not finite"));
        let one = BandTable::new(vec![sample(Some("B"), 1.0, 1.0), sample(Some("B"), 2.0, 1.0)], false).unwrap();
        assert!(one.samples("A").unwrap_err().to_string().contains("\"A\""));
    }
}
