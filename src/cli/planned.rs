//! What is said about a planned observation before the work begins.

use super::context::Context;
use super::failure::{Failure, Result};
use cittert_arrays::CoveragePlan;
use cittert_formats::free_disk;
use std::path::Path;

/// Number of visibilities above which their number is told first.
const MANY: u64 = 100_000_000;
/// Bytes of one visibility in a file: a complex number, its number of samples and its flag.
const BYTES: u64 = 13;

/// Warn if the antennas of a track look below the horizon. Simulated data of such times are those of an Earth that hides nothing.
pub(super) fn warn(plan: &CoveragePlan, context: &Context) {
    let share = plan.share_below_horizon();
    if share > 0.0 {
        context.console.warn(&format!(
            "the phase centre is below the horizon for {:.1} % of the antennas and times, which take part all the same: --elevation-limit 0deg leaves them out",
            100.0 * share
        ));
    }
}

/// Tell the number of visibilities of a long observation, and refuse one that the disk of its output cannot hold.
///
/// # Errors
/// The output would be larger than the free space of its disk.
pub(super) fn check_size(plan: &CoveragePlan, per_row: usize, output: Option<&Path>, context: &Context) -> Result<()> {
    let visibilities = (plan.n_rows() as u64).saturating_mul(per_row as u64);
    let bytes = visibilities.saturating_mul(BYTES);
    let size = |bytes: u64| format!("{:.1} GB", bytes as f64 / 1e9);
    if let Some(path) = output
        && let Some(free) = free_disk(path).filter(|free| bytes > *free)
    {
        return Err(Failure::message(format!(
            "{}: {visibilities} visibilities ({} rows of {per_row}) take {}, and the disk has {} left: use fewer channels or integrations",
            path.display(),
            plan.n_rows(),
            size(bytes),
            size(free)
        )));
    }
    if visibilities > MANY {
        let held = if output.is_some() { format!(", about {} on the disk", size(bytes)) } else { String::new() };
        let rows = plan.n_rows();
        let text = format!("{visibilities} visibilities ({rows} rows of {per_row}){held}: this takes long. -v prints each phase");
        context.console.note(&text);
    }
    Ok(())
}
