//! Minor cycles of the output channels of an image, shared among processes.
//!
//! All processes have the exact residual of each channel. One of them makes the minor cycle, always the same one, because it learns from cycle to cycle how
//! far an approximate residual may be trusted. The others get the components, from which all predict their own rows.

use super::channel_cycles::ChannelRun;
use crate::deconvolve::{Component, MinorStop};
use crate::{ChainError, Result};
use cittert_arrays::Ranks;

/// How the stop of a cycle is told: by its place.
const STOPS: [MinorStop; 4] = [MinorStop::Level, MinorStop::Iterations, MinorStop::Diverged, MinorStop::Nothing];

/// The minor cycles of some channels. Says why each has stopped.
///
/// # Errors
/// An array of a channel of this process has another shape than the beam.
pub(super) fn minor_cycles(runs: &mut [&mut ChannelRun<'_>], ranks: &dyn Ranks) -> Result<Vec<MinorStop>> {
    let mut own = Vec::new();
    for run in runs.iter_mut().filter(|run| run.channel() % ranks.size() == ranks.rank()) {
        let before = run.n_components();
        let stop = run.descend()?;
        let found = run.components_from(before);
        own.extend([STOPS.iter().position(|s| *s == stop).unwrap_or(0) as f64, found.len() as f64]);
        own.extend(found.iter().flat_map(|c| [c.row as f64, c.column as f64, c.flux, c.scale_px]));
    }
    let all = ranks.exchange(own.iter().flat_map(|x| x.to_le_bytes()).collect());
    let mut left: Vec<_> =
        all.iter().map(|bytes| bytes.chunks_exact(8).map(|b| b.try_into().map_or(f64::NAN, f64::from_le_bytes))).collect();
    let mut stops = Vec::with_capacity(runs.len());
    for run in runs {
        let owner = run.channel() % ranks.size();
        let mut next = || left[owner].next().ok_or_else(|| ChainError::Internal("a process sent too few components".into()));
        let (stop, n) = (next()? as usize, next()? as usize);
        let mut components = Vec::with_capacity(n);
        for _ in 0..n {
            let (row, column) = (next()? as usize, next()? as usize);
            components.push(Component { row, column, flux: next()?, scale_px: next()? });
        }
        if owner != ranks.rank() {
            run.take(components);
        }
        stops.push(STOPS[stop.min(STOPS.len() - 1)]);
    }
    Ok(stops)
}
