//! What is said about a planned observation before the work begins.

use super::context::Context;
use super::failure::{Failure, Result};
use cittert_arrays::{CoveragePlan, SkyGrid, VisibilitySource};
use cittert_formats::free_disk;
use num_complex::Complex;
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

/// A number of bytes for people.
fn size(bytes: u64) -> String {
    let (unit, name) = [(1e9, "GB"), (1e6, "MB")].into_iter().find(|(unit, _)| bytes as f64 >= *unit).unwrap_or((1e3, "kB"));
    format!("{:.1} {name}", bytes as f64 / unit)
}

/// Refuse visibilities that the disk of their output cannot hold. Complex numbers hardly shrink, and flags shrink to almost nothing.
///
/// # Errors
/// The output would be larger than the free space of its disk.
pub(super) fn check_room_for_set(source: &dyn VisibilitySource, output: &Path) -> Result<()> {
    let header = source.header();
    let per_row = header.spectrum.n_chan().saturating_mul(header.polarizations.len());
    let rows = source.n_rows().saturating_mul(source.ranks().size());
    let bytes = rows.saturating_mul(per_row).saturating_mul(size_of::<Complex<f32>>());
    check_room(bytes as u64, "visibilities", output)
}

/// Refuse images of one channel that the disk of their output cannot hold.
///
/// # Errors
/// The output would be larger than the free space of its disk.
pub(super) fn check_room_for_images(images: usize, grid: &SkyGrid, output: &Path) -> Result<()> {
    let pixels = grid.n_l.saturating_mul(grid.n_m).saturating_mul(images);
    check_room(pixels.saturating_mul(size_of::<f32>()) as u64, "images", output)
}

fn check_room(bytes: u64, what: &str, output: &Path) -> Result<()> {
    match free_disk(output).filter(|free| bytes > *free) {
        Some(free) => {
            let (needed, free) = (size(bytes), size(free));
            let text = format!("{}: the {what} take {needed} or more, and the disk has {free} left", output.display());
            Err(Failure::message(format!("{text}: make room, or choose another disk")))
        }
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_disk_holds_is_refused_before_the_work() {
        let folder = tempfile::tempdir().unwrap();
        let output = folder.path().join("a.uvh5");
        assert!(check_room(1, "visibilities", &output).is_ok());
        let e = check_room(u64::MAX, "visibilities", &output).unwrap_err().to_string();
        assert!(e.contains("a.uvh5") && e.contains("left"), "{e}");
        assert_eq!([2_500, 3_400_000, 5_600_000_000].map(size), ["2.5 kB", "3.4 MB", "5.6 GB"]);
    }
}
