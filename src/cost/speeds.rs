//! Seconds of each operation, as they were fitted on some machines.

use super::scale::Scale;
use super::term::Term;
use crate::{ChainError, Result};
use serde::Deserialize;
use std::collections::BTreeMap;

/// The machines whose speeds come with the program: `make bench-book` writes the file of the machine that runs it. The first is the one that the tables of the
/// book were made for.
const MACHINES: [&str; 4] = [
    include_str!("machines/intel-xeon.toml"),
    include_str!("machines/amd-epyc.toml"),
    include_str!("machines/amd-epyc-25-1.toml"),
    // The same kind of machine, in hours in which its host had other work too.
    include_str!("machines/amd-epyc-25-1-busy.toml"),
];

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
    /// The speeds of the machine for which the tables of the book were made.
    ///
    /// # Errors
    /// The file in the program is damaged.
    pub fn built_in() -> Result<Self> {
        Self::parse(MACHINES[0])
    }

    /// The speeds of this machine. Its short tests are run first.
    ///
    /// # Errors
    /// A file in the program is damaged.
    pub fn here() -> Result<Self> {
        let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let name = info.lines().find(|line| line.starts_with("model name")).and_then(|line| line.split_once(':'));
        Self::of_machine(name.map_or("", |(_, name)| name.trim()), &Scale::measure()?)
    }

    /// The speeds of a machine with this processor, whose short tests take so long: those of a machine of the program whose processor is of the same maker,
    /// or of the first, each changed as its short test is. The rest of the work does not follow the short tests alike on processors of all makers, nor on slow
    /// and fast ones of one maker: of several machines the one with the nearest short tests counts.
    fn of_machine(processor: &str, short_tests: &Scale) -> Result<Self> {
        let all = MACHINES.into_iter().map(Self::parse).collect::<Result<Vec<_>>>()?;
        let same = all.into_iter().filter(|speeds| maker(&speeds.machine) == maker(processor));
        let nearest = same.min_by(|a, b| a.gauges.distance(short_tests).total_cmp(&b.gauges.distance(short_tests)));
        Ok(nearest.map_or_else(Self::built_in, Ok)?.scaled(short_tests))
    }

    /// Speeds from the text of a file such as `machines/intel-xeon.toml`.
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

/// The maker of a processor: the first word of its name.
fn maker(processor: &str) -> String {
    processor.split([' ', '(', ',']).next().unwrap_or_default().to_lowercase()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_machine_is_taken_for_one_with_a_processor_of_its_maker() {
        let short_tests = Scale { grid_s: 4e-3, fourier_s: 2e-3, stream_s: 1e-3 };
        for (processor, expected) in [
            ("AMD EPYC 9B14 96-Core Processor", "AMD"),
            ("Intel(R) Core(TM) i7-8700 CPU @ 3.20GHz", "Intel"),
            ("Neoverse-N1", "Intel"),
            ("", "Intel"),
        ] {
            let found = Speeds::of_machine(processor, &short_tests).unwrap();
            assert!(found.machine.starts_with(expected), "{processor}: {}", found.machine);
            assert_eq!(*found.gauges(), short_tests);
        }
    }

    #[test]
    fn of_machines_by_one_maker_the_one_that_is_as_fast_counts() {
        for text in MACHINES {
            let known = Speeds::parse(text).unwrap();
            let g = known.gauges;
            let here = Scale { grid_s: 1.1 * g.grid_s, fourier_s: 0.95 * g.fourier_s, stream_s: 1.2 * g.stream_s };
            let found = Speeds::of_machine(&known.machine, &here).unwrap();
            assert_eq!(found.start_bytes, known.start_bytes, "{}", known.machine);
        }
    }

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
        let gap: String = MACHINES[0].lines().filter(|l| !l.contains("pass.cell")).map(|l| format!("{l}\n")).collect();
        let e = Speeds::parse(&gap).unwrap_err().to_string();
        assert!(e.contains("pass.cell") && e.contains("make bench-book"), "{e}");
        assert!(Speeds::parse(&MACHINES[0].replace("\"pass.cell\" = ", "\"pass.cell\" = -")).is_err());
    }
}
