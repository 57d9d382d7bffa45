//! How algorithms report progress. They never print: the command line decides what the user sees.

/// One report of a running computation.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Event<'a> {
    /// A phase of the work begins.
    Phase {
        /// Name of the phase, such as "gridding".
        name: &'a str,
        /// Number of units in the phase, if it is known.
        total: Option<u64>,
        /// Name of a unit, such as "vis".
        unit: &'a str,
    },
    /// This number of further units is done.
    Advance(u64),
    /// The phase has ended.
    Done,
    /// One major cycle of a deconvolution, or one step of an iteration.
    Cycle {
        /// The output channel, from 0, of an image that has several.
        channel: Option<usize>,
        /// Number of the cycle, starting at 1.
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
        /// Number of the step, starting at 1.
        number: usize,
        /// Evaluations of the data term so far.
        evaluations: usize,
        /// Chi squared divided by its expected value.
        chi2: f64,
        /// Length of the gradient of the Lagrangian divided by the sum of the lengths of its two terms.
        kkt: f64,
        /// Sum of the image, Jy or K sr.
        flux: f64,
        /// Lagrange multiplier of chi squared, in the unit of flux.
        lambda: f64,
    },
    /// Information for the user.
    Note(&'a str),
    /// A condition that makes the result doubtful.
    Warning(&'a str),
}

/// Receives events. Implementations must be fast: algorithms call them after every block of rows.
pub trait Observer: Sync {
    /// Receive an event.
    fn event(&self, event: Event<'_>);

    /// True when the computation should stop at the next safe point.
    fn cancelled(&self) -> bool {
        false
    }
}

/// Ignores all events.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Observer for Silent {
    fn event(&self, _event: Event<'_>) {}
}

/// Passes on only whether to stop, for work whose events would not tell the user anything.
pub struct Quiet<'a>(pub &'a dyn Observer);

impl Observer for Quiet<'_> {
    fn event(&self, _event: Event<'_>) {}

    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
}

/// Passes on everything but notes, for work that is repeated on the same data and would repeat them.
pub struct WithoutNotes<'a>(pub &'a dyn Observer);

impl Observer for WithoutNotes<'_> {
    fn event(&self, event: Event<'_>) {
        if !matches!(event, Event::Note(_)) {
            self.0.event(event);
        }
    }

    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
}
