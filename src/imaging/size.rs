//! Size and cell of an image: checked where given, chosen from the coverage where not.

use super::{ImagingOptions, Survey};
use crate::progress::{Event, Observer};
use crate::{ChainError, Result};
use cittert_arrays::{SPEED_OF_LIGHT_M_S, SkyGrid, VisibilityHeader};

/// Cells for each 1 / (longest baseline): about four across the main lobe of natural weights.
const CELLS_A_FRINGE: f64 = 4.0;
/// Sides that are chosen on their own.
const SIDES: (usize, usize) = (64, 4096);

/// The grid of an image of these data.
pub(super) fn choose_grid(survey: &Survey, header: &VisibilityHeader, opts: &ImagingOptions, observer: &dyn Observer) -> Result<SkyGrid> {
    let center = header.phase_centers.get(survey.phase_center).or(header.phase_centers.first());
    let center = center.ok_or_else(|| ChainError::NoData("the set has no phase centre".into()))?;
    let frame = SkyGrid::frame_of(center);
    let (shortest, longest) = survey.uv_range_wl;
    let needed = |what: &str| ChainError::NoData(format!("{what} cannot be chosen: no baseline is longer than 0. Give a size and a cell"));
    let cell = match opts.cell {
        Some(cell) => cell.si(),
        None if longest > 0.0 => 1.0 / (CELLS_A_FRINGE * longest),
        None => return Err(needed("a cell")),
    };
    let side = match opts.size {
        Some(size) => (size.columns, size.rows),
        None => {
            if !(longest > 0.0) {
                return Err(needed("an image size"));
            }
            let n = natural_side(field_of_view(header, shortest), cell);
            (n, n)
        }
    };
    let grid = SkyGrid::new(side.0, side.1, cell, frame)?;
    if opts.cell.is_none() || opts.size.is_none() {
        let text = format!(
            "image of {} x {} cells of {:.4e} rad ({:.4} arcsec), chosen from the coverage",
            side.0,
            side.1,
            cell,
            cell.to_degrees() * 3600.0
        );
        observer.event(Event::Note(&text));
    }
    if longest > 0.5 / cell {
        let text = format!(
            "a cell of {cell:.4e} rad is too coarse for the longest baseline of {longest:.4e} wavelengths, which aliases: use at most {:.4e} rad ({:.4} arcsec)",
            0.5 / longest,
            (0.5 / longest).to_degrees() * 3600.0
        );
        observer.event(Event::Warning(&text));
    }
    Ok(grid)
}

/// Width of the field in rad: the main lobe of the antennas where their diameter is known, else what the shortest baseline sees.
fn field_of_view(header: &VisibilityHeader, shortest_wl: f64) -> f64 {
    let smallest = header.layout.antennas().iter().filter_map(|a| a.diameter_m).filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min);
    let (lowest, _) = header.spectrum.range_hz();
    let lobe = 2.4 * SPEED_OF_LIGHT_M_S / lowest / smallest;
    let seen = if shortest_wl > 0.0 { 2.0 / shortest_wl } else { f64::INFINITY };
    let width = if lobe > 0.0 { lobe.min(4.0 * seen) } else { seen };
    width.min(1.4)
}

/// An even side with small factors within the limits and inside the horizon.
fn natural_side(field: f64, cell: f64) -> usize {
    let most = (1.99 / cell).min(SIDES.1 as f64) as usize;
    let wanted = ((field / cell).ceil().min(1e9) as usize).clamp(SIDES.0, SIDES.1);
    let smooth = |n: &usize| {
        let mut n = *n;
        for p in [2, 3, 5] {
            while n.is_multiple_of(p) {
                n /= p;
            }
        }
        n == 1
    };
    let good = (wanted..=2 * SIDES.1).find(|n| n.is_multiple_of(2) && smooth(n)).unwrap_or(wanted);
    good.min(most.max(2) / 2 * 2).max(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_are_smooth_even_and_inside_the_horizon() {
        assert_eq!(natural_side(1.0, 0.01), 100);
        assert_eq!(natural_side(1.03, 0.01), 108);
        assert_eq!(natural_side(1e-9, 0.01), 64);
        assert_eq!(natural_side(f64::INFINITY, 1e-6), 4096);
        assert!(natural_side(1.4, 0.05) <= 40);
    }
}
