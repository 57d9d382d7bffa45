//! Size and cell of an image. They are checked if the caller gives them, and chosen from the coverage otherwise.

use super::data::Survey;
use super::options::ImagingOptions;
use super::size_tuning::SizeTuning;
use crate::fourier::good_size;
use crate::progress::{Event, Observer};
use crate::{ChainError, Result, ensure};
use cittert_arrays::{ArrayError, SPEED_OF_LIGHT_M_S, SkyGrid, VisibilityHeader};

/// The grid of an image of these data.
pub(super) fn choose_grid(survey: &Survey, header: &VisibilityHeader, opts: &ImagingOptions, observer: &dyn Observer) -> Result<SkyGrid> {
    let (index, len) = (survey.phase_center, header.phase_centers.len());
    let center = header.phase_centers.get(index).ok_or(ArrayError::OutOfRange { what: "phase centre", index, len })?;
    let frame = SkyGrid::frame_of(center);
    let (shortest, longest) = survey.uv_range_wl;
    let needed = |what: &str| ChainError::NoData(format!("{what} cannot be chosen: no baseline is longer than 0. Give a size and a cell"));
    let cell = match opts.cell.map(|c| c.si()) {
        Some(cell) => cell,
        None if longest > 0.0 => 1.0 / (opts.sizes.cells_per_fringe * longest),
        None => return Err(needed("a cell")),
    };
    let side = match opts.size.map(|s| (s.columns, s.rows)) {
        Some(size) => size,
        None => {
            ensure!(longest > 0.0, needed("an image size"));
            let n = chosen_side(field_of_view(header, shortest, &opts.sizes), cell, &opts.sizes);
            (n, n)
        }
    };
    let grid = SkyGrid::new(side.0, side.1, cell, frame)?;
    if opts.cell.is_none() || opts.size.is_none() {
        let (n_l, n_m) = side;
        let arcsec = cell.to_degrees() * 3600.0;
        let text = format!("image of {n_l} x {n_m} cells of {cell:.4e} rad ({arcsec:.4} arcsec), chosen from the coverage");
        observer.event(Event::Note(&text));
    }
    warn_coarse(cell, longest, observer);
    Ok(grid)
}

/// Warn where the cells are too coarse for the longest baseline, in wavelengths.
pub(crate) fn warn_coarse(cell_rad: f64, longest_wl: f64, observer: &dyn Observer) {
    let most = 0.5 / longest_wl;
    if cell_rad > most {
        observer.event(Event::Warning(&format!(
            "a cell of {cell_rad:.4e} rad is too coarse for the longest baseline of {longest_wl:.4e} wavelengths, which aliases: use at most {most:.4e} rad ({:.4} arcsec)",
            most.to_degrees() * 3600.0
        )));
    }
}

/// Width of the field in rad: the main lobe of the antennas if their diameters are known, otherwise the largest structure that the shortest
/// baseline measures.
fn field_of_view(header: &VisibilityHeader, shortest_wl: f64, sizes: &SizeTuning) -> f64 {
    let smallest = header.layout.antennas().iter().filter_map(|a| a.diameter_m).filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min);
    let (lowest, _) = header.spectrum.range_hz();
    let lobe = sizes.field_per_lobe * SPEED_OF_LIGHT_M_S / lowest / smallest;
    let measured = if shortest_wl > 0.0 { sizes.field_per_fringe / shortest_wl } else { f64::INFINITY };
    let width = if lobe > 0.0 { lobe.min(sizes.most_fields * measured) } else { measured };
    width.min(sizes.widest_field)
}

/// An even side without prime factors above 5, within the limits and inside the horizon.
fn chosen_side(field: f64, cell: f64, sizes: &SizeTuning) -> usize {
    let most = (1.99 / cell).min(sizes.largest_side as f64) as usize;
    let wanted = ((field / cell).ceil().min(1e9) as usize).max(sizes.least_side).min(sizes.largest_side);
    good_size(wanted).min(most.max(2) / 2 * 2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_are_smooth_even_and_inside_the_horizon() {
        let side = |field, cell| chosen_side(field, cell, &SizeTuning::default());
        assert_eq!(side(1.0, 0.01), 100);
        assert_eq!(side(1.03, 0.01), 108);
        assert_eq!(side(1e-9, 0.01), 64);
        assert_eq!(side(f64::INFINITY, 1e-6), 4096);
        assert!(side(1.4, 0.05) <= 40);
    }
}
