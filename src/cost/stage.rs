//! A stage of a command, and the forecast of a whole command.

use super::speeds::Speeds;
use super::term::Term;

/// Memory of a stage over its arrays: freed blocks leave holes that the next arrays do not fit into. The median of 70 runs of all commands on random sets,
/// of which 66 then lie within 10 %.
const HOLES: f64 = 1.03;

/// What the first image and its verdict leave in the heap while a second image is made. Without this, 19 runs with a second image took 9 MB more than their
/// forecast in the median, and 14 runs without one took 4 MB more.
const LEFT: f64 = 6e6;

/// A part of a command: what it does, and what it holds in memory meanwhile.
#[derive(Debug, Clone, PartialEq)]
pub struct Stage {
    /// Its name.
    pub name: &'static str,
    /// How often each operation is done.
    pub work: Vec<(Term, f64)>,
    /// Seconds that were timed on this machine, on as many threads as will work.
    pub timed_s: f64,
    /// Time that a rehearsal took over what its operations say; 1 without one.
    pub pace: f64,
    /// Bytes of all arrays that are in memory together at its largest moment.
    pub bytes: f64,
    /// Bytes of images and sums that several processes would add up over the network.
    pub summed_bytes: f64,
    /// Bytes that are read from files.
    pub read_bytes: f64,
    /// True where several processes each do all of it, because it works on whole images.
    pub whole: bool,
}

impl Stage {
    /// A stage that holds so many bytes.
    #[must_use]
    pub fn new(name: &'static str, bytes: f64) -> Self {
        let (work, timed_s, pace) = (Vec::new(), 0.0, 1.0);
        Self { name, work, timed_s, pace, bytes, summed_bytes: 0.0, read_bytes: 0.0, whole: false }
    }

    /// Add operations.
    #[must_use]
    pub fn doing(mut self, work: impl IntoIterator<Item = (Term, f64)>) -> Self {
        self.work.extend(work.into_iter().filter(|(_, n)| *n > 0.0));
        self
    }

    /// A second image of most of the data: the work of all stages but these.
    #[must_use]
    pub fn second<const N: usize>(stages: &[Self], but: [&str; N]) -> Self {
        let again: Vec<&Self> = stages.iter().filter(|s| !but.contains(&s.name)).collect();
        let bytes = LEFT + again.iter().map(|s| s.bytes).fold(0.0, f64::max);
        Self::new("second image", bytes).doing(again.iter().flat_map(|s| s.work.iter().copied()))
    }

    /// Memory of the process in this stage, bytes.
    #[must_use]
    pub fn memory(&self, speeds: &Speeds) -> f64 {
        speeds.base_bytes() + HOLES * self.bytes
    }

    /// Its time in seconds on so many threads.
    #[must_use]
    pub fn seconds(&self, speeds: &Speeds, threads: usize) -> f64 {
        self.pace * (self.timed_s + self.work.iter().map(|(term, n)| n * speeds.seconds(*term, threads)).sum::<f64>())
    }
}

/// What a command will do.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Forecast {
    /// The stages, in order.
    pub stages: Vec<Stage>,
    /// Bytes of the files that it writes.
    pub output_bytes: f64,
    /// Groups that the planes of the grid are made in; 1 where they fit into memory together.
    pub groups_of_planes: usize,
    /// What is not known before, and what is taken in its place: one sentence each.
    pub assumptions: Vec<String>,
}

impl Forecast {
    /// Time of all stages, s.
    #[must_use]
    pub fn seconds(&self, speeds: &Speeds, threads: usize) -> f64 {
        self.stages.iter().map(|s| s.seconds(speeds, threads)).sum()
    }

    /// Largest memory of the process, bytes.
    #[must_use]
    pub fn peak_bytes(&self, speeds: &Speeds) -> f64 {
        self.stages.iter().map(|s| s.memory(speeds)).fold(speeds.base_bytes(), f64::max)
    }

    /// The stage that needs most memory.
    #[must_use]
    pub fn largest(&self) -> Option<&Stage> {
        self.stages.iter().max_by(|a, b| a.bytes.total_cmp(&b.bytes))
    }
}
