//! Size and cell of an image. They are checked if the caller gives them, and chosen from the coverage otherwise.

use super::options::ImagingOptions;
use super::size_tuning::SizeTuning;
use super::survey::Survey;
use crate::fourier::good_size;
use crate::progress::{Event, Observer};
use crate::{ChainError, Result, ensure};
use cittert_arrays::{ArrayError, ElementPattern, SPEED_OF_LIGHT_M_S, SkyGrid, VisibilityHeader};

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
            let apart = shortest_between_sites(&survey.shortest_by_octave_wl);
            let measured = field_of_view(header, apart.unwrap_or(shortest), &opts.sizes);
            let has_total_power = survey.total_power.used > 0;
            let lobe = has_total_power.then(|| lobe_width(&header.layout.pattern, header.spectrum.range_hz().0, &opts.sizes)).flatten();
            let seen = seen_width(header.scene_width_rad, lobe).filter(|(width, _)| has_total_power || *width < measured);
            let field = seen.map_or(measured, |(width, _)| width.min(opts.sizes.widest_field));
            let n = chosen_side(field, cell, &opts.sizes);
            let covered = n as f64 * cell;
            if let Some((width, what)) = seen {
                let text = if width > 1.01 * covered {
                    format!(
                        "the image covers {covered:.3e} rad, and {what} is {width:.3e} rad wide: what lies outside the image is not modelled. The options size and cell change this"
                    )
                } else {
                    format!("the image covers the {width:.3e} rad of {what}. The option size makes it larger")
                };
                observer.event(Event::Note(&text));
            } else if let Some(apart) = apart {
                let text = format!(
                    "baselines of {shortest:.3e} wavelengths join antennas of one site, and those between sites begin at {apart:.3e}: the image covers the field that the latter measure. The option size makes it larger"
                );
                observer.event(Event::Note(&text));
            } else if field > 1.01 * covered {
                let text = format!(
                    "the image covers {covered:.3e} rad of a field of {field:.3e} rad, so that it has at most {} pixels a side. The options size and cell change this",
                    opts.sizes.largest_side
                );
                observer.event(Event::Note(&text));
            }
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

/// Octaves without a baseline between those of one site and those between sites. Antennas of one array are spread over all lengths up to its
/// size. The two antennas of a site of a world-wide array are hundreds of times closer to each other than to the next site.
const GAP_OCTAVES: usize = 4;

/// The shortest baseline beyond the last gap of the coverage; `None` where there is no gap. The baselines below a gap measure only the total
/// flux, and the field of an image that follows from them has millions of empty beams.
fn shortest_between_sites(shortest_by_octave_wl: &[f64]) -> Option<f64> {
    let used: Vec<usize> = (0..shortest_by_octave_wl.len()).filter(|k| shortest_by_octave_wl[*k].is_finite()).collect();
    let gap = used.windows(2).rev().find(|w| w[1] - w[0] > GAP_OCTAVES);
    gap.map(|w| shortest_by_octave_wl[w[1]])
}

/// Width in rad of what the antennas certainly see, and what that is: a scene that was simulated, as far as the lobe reaches. The lobe is given where
/// total power is used: that sees all of it, also where no baseline measures so large a structure, so that a narrower image cannot hold it.
fn seen_width(scene: Option<f64>, lobe: Option<f64>) -> Option<(f64, &'static str)> {
    let scene = scene.map(|width| (width, "the scene that was simulated"));
    let lobe = lobe.map(|width| (width, "the lobe of the elements"));
    scene.into_iter().chain(lobe).min_by(|a, b| a.0.total_cmp(&b.0))
}

/// Width of the main lobe of a pattern, as a difference of direction cosines: from the axis to where the power falls below a given part, along the
/// direction in which that is farthest. `None` without a pattern.
fn lobe_width(pattern: &ElementPattern, freq_hz: f64, sizes: &SizeTuning) -> Option<f64> {
    const STEPS: usize = 4096;
    const DIRECTIONS: usize = 16;
    if pattern.is_none() {
        return None;
    }
    let farthest = 0.5 * sizes.widest_field;
    let step_of = |direction: usize| {
        let (sin, cos) = (std::f64::consts::TAU * direction as f64 / DIRECTIONS as f64).sin_cos();
        let power = |step: &usize| {
            let r = farthest * *step as f64 / STEPS as f64;
            pattern.power(r * cos, r * sin, freq_hz)
        };
        (1..STEPS).find(|step| power(step) < sizes.edge_of_lobe).unwrap_or(STEPS)
    };
    let widest = (0..DIRECTIONS).map(step_of).max().unwrap_or(STEPS);
    Some(2.0 * farthest * widest as f64 / STEPS as f64)
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
    use cittert_arrays::pattern::Gaussian;

    #[test]
    fn baselines_within_a_site_do_not_set_the_field() {
        let coverage = |octaves: &[usize]| {
            let mut all = vec![f64::INFINITY; 48];
            octaves.iter().for_each(|k| all[*k] = 1.5 * f64::from(1 << k));
            all
        };
        // ALMA to APEX has 2^20 wavelengths at 1.3 mm, and the shortest baseline between sites 2^28.
        assert_eq!(shortest_between_sites(&coverage(&[16, 17, 28, 29, 30])), Some(1.5 * f64::from(1 << 28)));
        assert_eq!(shortest_between_sites(&coverage(&[10, 11, 13, 17])), None);
        assert_eq!(shortest_between_sites(&coverage(&[])), None);
    }

    #[test]
    fn a_lobe_ends_where_its_power_falls_below_a_hundredth() {
        let sizes = SizeTuning::default();
        let gaussian = ElementPattern::Gaussian(Gaussian { fwhm_rad: 0.1, ref_freq_hz: None });
        let expected = 0.1 * (100.0_f64.ln() / 2.0_f64.ln()).sqrt();
        let width = lobe_width(&gaussian, 60e9, &sizes).unwrap();
        assert!((width / expected - 1.0).abs() < 0.02, "{width} {expected}");
        assert_eq!(lobe_width(&ElementPattern::None, 60e9, &sizes), None);
    }

    #[test]
    fn an_image_covers_what_is_known_to_be_seen() {
        assert_eq!(seen_width(None, None), None);
        assert_eq!(seen_width(None, Some(0.3)).unwrap().0, 0.3);
        assert_eq!(seen_width(Some(0.2), Some(0.3)).unwrap().0, 0.2);
        assert_eq!(seen_width(Some(0.4), Some(0.3)).unwrap().0, 0.3);
        assert_eq!(seen_width(Some(0.4), None).unwrap().0, 0.4);
    }

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
