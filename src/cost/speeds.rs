//! Seconds of each operation, as they were fitted on one machine.

use super::scale::Scale;
use super::term::Term;
use crate::{ChainError, Result};
use serde::Deserialize;
use std::collections::BTreeMap;

/// The speeds that come with the program: `make bench-book` writes this file.
const BUILT_IN: &str = include_str!("machine.toml");

/// Seconds of each operation on one machine.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Speeds {
    /// The processor of the machine.
    pub machine: String,
    /// Date of the fit.
    pub date: String,
    /// Memory of the program with its libraries and empty buffers while it works, bytes.
    base_bytes: f64,
    /// What the program of the fit held when it had read its command line, bytes.
    start_bytes: f64,
    /// Seconds of the short tests on that machine.
    gauges: Scale,
    /// Seconds of each operation on one thread.
    seconds: BTreeMap<String, f64>,
    /// Part of the time of each group of operations that more threads do not shorten.
    serial: BTreeMap<String, f64>,
    /// What is typical of runs whose course is not known before.
    typical: BTreeMap<String, f64>,
}

impl Speeds {
    /// The speeds of the machine on which this program was measured.
    ///
    /// # Errors
    /// The file in the program is damaged.
    pub fn built_in() -> Result<Self> {
        Self::parse(BUILT_IN)
    }

    /// Speeds from the text of a file such as `machine.toml`.
    ///
    /// # Errors
    /// The text is no TOML of this form, an operation is missing or not known, or a number is negative.
    pub fn parse(text: &str) -> Result<Self> {
        let wrong = |why: String| ChainError::Incompatible(format!("speeds of a machine: {why}"));
        let speeds: Self = toml::from_str(text).map_err(|e| wrong(e.to_string()))?;
        if let Some(term) = Term::ALL.iter().find(|t| !speeds.seconds.contains_key(t.name())) {
            return Err(wrong(format!("the operation {} is missing: run make bench-book", term.name())));
        }
        let known = |name: &String| Term::ALL.iter().any(|t| t.name() == name);
        if let Some(name) = speeds.seconds.keys().find(|n| !known(n)) {
            return Err(wrong(format!("{name} is no operation")));
        }
        let all = speeds.seconds.iter().chain(&speeds.serial).chain(&speeds.typical);
        if let Some((name, value)) = all.clone().find(|(_, v)| !(v.is_finite() && **v >= 0.0)) {
            return Err(wrong(format!("{name} is {value}, expected a number of 0 or more")));
        }
        Ok(speeds)
    }

    /// The same for a machine whose short tests take so long.
    #[must_use]
    pub fn scaled(mut self, here: &Scale) -> Self {
        for term in Term::ALL {
            let factor = here.of(term.kind()) / self.gauges.of(term.kind());
            if let Some(seconds) = self.seconds.get_mut(term.name())
                && factor.is_finite()
                && factor > 0.0
            {
                *seconds *= factor;
            }
        }
        self.gauges = *here;
        self
    }

    /// The same for a program that holds `start_bytes` when it has read its command line. Its libraries are not those of the program of the fit: MPI and casacore
    /// alone take 12 MB. 0 where the system does not tell.
    #[must_use]
    pub fn with_program(mut self, start_bytes: f64) -> Self {
        if start_bytes > 0.0 {
            self.base_bytes = (self.base_bytes + start_bytes - self.start_bytes).max(0.0);
            self.start_bytes = start_bytes;
        }
        self
    }

    /// Seconds of one operation, where so many threads share it.
    #[must_use]
    pub fn seconds(&self, term: Term, threads: usize) -> f64 {
        let serial = self.serial.get(term.group()).copied().unwrap_or(1.0);
        self.seconds.get(term.name()).copied().unwrap_or(0.0) * (serial + (1.0 - serial) / threads.max(1) as f64)
    }

    /// Memory of the program without its data, bytes.
    #[must_use]
    pub fn base_bytes(&self) -> f64 {
        self.base_bytes
    }

    /// Memory of the program when it has read its command line, bytes.
    #[must_use]
    pub fn start_bytes(&self) -> f64 {
        self.start_bytes
    }

    /// Seconds of the short tests.
    #[must_use]
    pub fn gauges(&self) -> &Scale {
        &self.gauges
    }

    /// A number that is typical of runs, such as the major cycles of CLEAN.
    #[must_use]
    pub fn typical(&self, name: &str) -> f64 {
        self.typical.get(name).copied().unwrap_or(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_speeds_of_the_program_are_complete_and_scale_with_the_tests() {
        let speeds = Speeds::built_in().unwrap();
        assert!(Term::ALL.iter().all(|t| speeds.seconds(*t, 1) >= speeds.seconds(*t, 2)));
        assert!(speeds.base_bytes() > 1e6 && !speeds.machine.is_empty());
        let g = *speeds.gauges();
        let slow = speeds.clone().scaled(&Scale { grid_s: 2.0 * g.grid_s, fourier_s: 3.0 * g.fourier_s, stream_s: g.stream_s });
        for (term, factor) in [(Term::Spread, 2.0), (Term::ToImage, 3.0), (Term::Pixel, 1.0)] {
            assert!((slow.seconds(term, 1) - factor * speeds.seconds(term, 1)).abs() <= 1e-12 * slow.seconds(term, 1), "{term:?}");
        }
    }

    #[test]
    fn a_program_with_more_libraries_takes_as_much_more() {
        let fitted = Speeds::built_in().unwrap();
        let (base, start) = (fitted.base_bytes(), fitted.start_bytes());
        assert!(start > 1e6 && start < base);
        let larger = fitted.clone().with_program(start + 12e6);
        assert!((larger.base_bytes() - base - 12e6).abs() < 1.0, "{}", larger.base_bytes());
        assert_eq!(larger.with_program(start + 12e6).base_bytes(), base + 12e6, "counted once");
        assert_eq!(fitted.with_program(0.0).base_bytes(), base, "where the system does not tell");
    }

    #[test]
    fn a_file_with_a_gap_is_refused_with_what_to_do() {
        let gap: String = BUILT_IN.lines().filter(|l| !l.contains("pass.cell")).map(|l| format!("{l}\n")).collect();
        let e = Speeds::parse(&gap).unwrap_err().to_string();
        assert!(e.contains("pass.cell") && e.contains("make bench-book"), "{e}");
        assert!(Speeds::parse(&BUILT_IN.replace("\"pass.cell\" = ", "\"pass.cell\" = -")).is_err());
    }
}
