//! Damaged files for every reader of the formats; see `harness`.

/// Where the corpus lies.
#[cfg(test)]
const CORPUS: &str = "fuzz/corpus";

#[cfg(test)]
#[path = "../tests/common/mod.rs"]
mod common;
#[cfg(test)]
mod crashes;
#[cfg(test)]
mod harness;
#[cfg(test)]
mod make;
#[cfg(test)]
mod refusals;
#[cfg(test)]
mod targets;
