//! How algorithms tell what they are doing. They never print: the command line decides what a person sees.

use std::sync::atomic::{AtomicBool, Ordering};

/// Something worth telling while a long computation runs.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Event<'a> {
    /// A phase of the work begins, with the number of units it will take where that is known.
    Phase {
        /// What is done, such as "gridding".
        name: &'a str,
        /// Total number of units, such as visibilities.
        total: Option<u64>,
        /// What a unit is, such as "vis".
        unit: &'a str,
    },
    /// So many further units are done.
    Advance(u64),
    /// The phase is over.
    Done,
    /// One major cycle of a deconvolution, or one step of an iteration.
    Cycle {
        /// Number of the cycle, from 1.
        number: usize,
        /// Components or iterations so far.
        iterations: usize,
        /// Largest residual, in the unit of the image.
        peak: f64,
        /// Flux in the model so far.
        flux: f64,
        /// Rms of the residual.
        rms: f64,
    },
    /// One step towards the image of maximum entropy.
    Entropy {
        /// Number of the step, from 1.
        number: usize,
        /// Evaluations of the data term so far.
        evaluations: usize,
        /// Chi squared over its expected value.
        chi2: f64,
        /// Length of the gradient over the sum of the lengths of its sides.
        kkt: f64,
        /// Sum of the image, Jy or K sr.
        flux: f64,
        /// Lagrange multiplier of chi squared, flux.
        lambda: f64,
    },
    /// Something the user should know that is no error.
    Note(&'a str),
    /// Something that makes the result doubtful.
    Warning(&'a str),
}

/// Receives events. Implementations must be cheap: algorithms call them from inner loops' edges.
pub trait Observer: Sync {
    /// Take an event.
    fn event(&self, event: Event<'_>);

    /// True when the work should stop at the next safe place.
    fn cancelled(&self) -> bool {
        false
    }
}

/// Hears nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Observer for Silent {
    fn event(&self, _event: Event<'_>) {}
}

/// Collects notes and warnings, for tests and for reports.
#[derive(Debug, Default)]
pub struct Recorder {
    messages: std::sync::Mutex<Vec<String>>,
    cancel: AtomicBool,
}

impl Recorder {
    /// The notes and warnings so far.
    #[must_use]
    pub fn messages(&self) -> Vec<String> {
        self.messages.lock().map(|m| m.clone()).unwrap_or_default()
    }

    /// Ask the work to stop.
    pub fn cancel(&self) {
        self.cancel.store(true, Ordering::Relaxed);
    }
}

impl Observer for Recorder {
    fn event(&self, event: Event<'_>) {
        if let Event::Note(text) | Event::Warning(text) = event
            && let Ok(mut m) = self.messages.lock()
        {
            m.push(text.to_owned());
        }
    }

    fn cancelled(&self) -> bool {
        self.cancel.load(Ordering::Relaxed)
    }
}
