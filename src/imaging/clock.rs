//! Wall-clock seconds of the stages of a run.

use std::collections::BTreeMap;
use std::time::Instant;

/// Seconds of each stage.
#[derive(Debug, Default)]
pub(crate) struct Clock(pub(crate) BTreeMap<&'static str, f64>);

impl Clock {
    pub(crate) fn time<R>(&mut self, stage: &'static str, work: impl FnOnce() -> R) -> R {
        let start = Instant::now();
        let result = work();
        *self.0.entry(stage).or_default() += start.elapsed().as_secs_f64();
        result
    }
}
