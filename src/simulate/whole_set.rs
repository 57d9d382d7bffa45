//! Simulations of whole sets in memory.

use super::engine::Simulator;
use super::{SimulateOptions, SkyModel};
use crate::Result;
use crate::progress::Observer;
use cittert_arrays::{UvCoverage, VisibilityBlock, VisibilityHeader, VisibilitySet};

/// Simulate a whole set in memory.
///
/// # Errors
/// As [`Simulator::new`] and [`Simulator::run`].
pub fn simulate_set(
    header: VisibilityHeader,
    coverage: &UvCoverage,
    sky: &SkyModel,
    options: &SimulateOptions,
    observer: &dyn Observer,
) -> Result<VisibilitySet> {
    let mut simulator = Simulator::new(header, sky, options, observer)?;
    let header = simulator.header().clone();
    let empty = VisibilityBlock::zeros(UvCoverage::empty(), header.spectrum.n_chan(), header.polarizations.len());
    let mut set = VisibilitySet::new(header, empty)?;
    simulator.run(&mut std::iter::once(Ok(coverage.clone())), Some(coverage.n_rows() as u64), &mut set, observer)?;
    Ok(set)
}
