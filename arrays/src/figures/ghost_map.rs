//! A map of the beam over the directions in which ghosts lie, with a list of its highest lobes.
//!
//! [`super::Ghosts`] knows the exact copies that an array on a grid makes. Spacings that are only partly regular make weaker copies, and a band or
//! a track smears all of them; the beam itself shows them.

use super::main_lobe::Beam;
use super::psf::Psf;
use super::seen::Seen;
use super::side_lobes::{Field, RAY_STEPS};
use super::{FigureOptions, Ghosts};
use crate::{ArrayError, ArrayLayout, CoveragePlan, Result};
use ndarray::Array2;

/// The map reaches this many times as far as the nearest exact ghost, so that it shows the ghosts around it.
const BEYOND: f64 = 2.5;
/// Most cells from the centre to the edge of the map: with four cells in a beam, 128 beams.
const MOST_CELLS: f64 = 512.0;
/// Most products of phasors in a map: tens of seconds on one core.
const MOST_PRODUCTS: f64 = 2e10;
/// Most lobes that are listed.
const MOST_LOBES: usize = 100;

/// The beam around a source at the zenith (or boresight), out to its ghosts.
#[derive(Debug, Clone, PartialEq)]
pub struct GhostMap {
    /// The beam over its peak \[m, l\], with the source in the middle; NaN beyond the horizon. The number of cells along each side is odd.
    pub levels: Array2<f64>,
    /// Size of a cell, direction cosines.
    pub cell: f64,
    /// Lobes of the map that reach the level, the highest first, at most 100. The opposite directions have lobes too. A line of antennas has none
    /// here, because its lobes are lines across the sky.
    pub lobes: Vec<GhostLobe>,
    /// The exact ghosts.
    pub ghosts: Ghosts,
}

/// The top of a lobe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GhostLobe {
    /// Direction cosines from the source.
    pub lm: [f64; 2],
    /// The beam there over its peak.
    pub level: f64,
}

impl GhostMap {
    /// Distance from the middle to the edge, direction cosines.
    #[must_use]
    pub fn radius(&self) -> f64 {
        (self.levels.dim().0 / 2) as f64 * self.cell
    }
}

impl ArrayLayout {
    /// The map of where ghosts lie, with the lobes of at least `level_db` relative to the peak. It reaches 2.5 times as far as the nearest exact
    /// ghost; where there is none, as far as side lobes count. It ends at the horizon, at 128 beams, or where its sums would take minutes.
    ///
    /// # Errors
    /// As [`ArrayLayout::figures_over`]; a level that is not below 0.
    pub fn ghost_map(&self, freq_hz: f64, options: &FigureOptions, track: Option<&CoveragePlan>, level_db: f64) -> Result<GhostMap> {
        ArrayError::need("ghost-level", level_db, level_db.is_finite() && level_db < 0.0, "a level below 0 dB, the peak of the beam")?;
        let Seen { plane, psf, beam, reach, .. } = self.seen(freq_hz, options, track)?;
        let ghosts = Ghosts::of(&plane);
        let nearest = ghosts.directions.first().map(|[l, m]| l.hypot(*m));
        let field = Field::of_cells(&beam, cells(&psf, &beam, nearest.map_or(reach.radius_rad(), |d| BEYOND * d)));
        let rows = psf.on_grid(field.step_x, field.step_y, field.half);
        let lobes = if beam.is_line() { Vec::new() } else { lobes(&psf, &field, &rows, 10.0_f64.powf(level_db / 10.0)) };
        let cell = field.step_x[0];
        Ok(GhostMap { levels: whole(&rows, cell), cell, lobes, ghosts })
    }
}

/// Cells from the centre to the edge of a map that shall reach `radius`.
fn cells(psf: &Psf, beam: &Beam, radius: f64) -> i64 {
    let wanted = (radius.min(1.0) / Field::step(beam)).floor();
    let most = (MOST_PRODUCTS / 2.0 / psf.n_terms() as f64).sqrt().floor();
    wanted.min(most).clamp(2.0, MOST_CELLS) as i64
}

fn lobes(psf: &Psf, field: &Field, rows: &[Vec<f64>], level: f64) -> Vec<GhostLobe> {
    let edges = field.edges(|ray, step| {
        let [l, m] = field.on_ray(ray, step as f64 / RAY_STEPS);
        psf.at(l, m)
    });
    let mut found: Vec<GhostLobe> =
        field.tops(rows, &edges, level, |l, m| psf.curve(l, m)).map(|(level, lm)| GhostLobe { lm, level }).collect();
    // Equal lobes, such as the exact ghosts of a grid, come in the order of their distances.
    let distance = |lobe: &GhostLobe| lobe.lm[0].hypot(lobe.lm[1]);
    found.sort_by(|a, b| (b.level * 1e6).round().total_cmp(&(a.level * 1e6).round()).then(distance(a).total_cmp(&distance(b))));
    found.truncate(MOST_LOBES);
    found
}

/// The whole map from its upper half, as the beam is even.
fn whole(rows: &[Vec<f64>], cell: f64) -> Array2<f64> {
    let half = rows.len() - 1;
    let side = 2 * half + 1;
    Array2::from_shape_fn((side, side), |(row, column)| {
        let (x, y) = (column as f64 - half as f64, row as f64 - half as f64);
        if x.hypot(y) * cell > 1.0 {
            f64::NAN
        } else if row >= half {
            rows[row - half][column]
        } else {
            rows[half - row][side - 1 - column]
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quantity::{Frequency, Length};
    use crate::{GenerateOptions, LayoutKind, SPEED_OF_LIGHT_M_S};

    fn made(kind: &str, elements: usize, columns: Option<usize>) -> ArrayLayout {
        let options = GenerateOptions { columns, ..GenerateOptions::new(elements, Length(1.0)) };
        LayoutKind::find(kind).unwrap().layout(&options).unwrap()
    }

    #[test]
    fn ghosts_of_a_rectangular_grid_lie_at_the_wavelength_over_its_spacing() {
        // 10 columns of 6 elements at 94 GHz.
        let layout = made("rectangular", 60, Some(10));
        let map = layout.ghost_map(94e9, &FigureOptions::default(), None, -3.0).unwrap();
        let ghost = SPEED_OF_LIGHT_M_S / 94e9 / layout.extent().shortest_m;
        assert!((map.radius() / (2.5 * ghost) - 1.0).abs() < 0.02, "{} {ghost}", map.radius());
        // In units of the distance of the nearest ghost they have whole coordinates, within 2.5 of both axes.
        assert_eq!(map.lobes.len(), 12, "{:?}", map.lobes);
        for lobe in &map.lobes {
            let place = lobe.lm.map(|v| v / ghost);
            assert!(place.iter().all(|v| (v - v.round()).abs() < 1e-6) && (lobe.level - 1.0).abs() < 1e-9, "{lobe:?}");
        }
        assert!((map.lobes[0].lm[0].hypot(map.lobes[0].lm[1]) / ghost - 1.0).abs() < 1e-6);
        // The map has the beam in every cell, also in the lower half.
        let half = map.levels.dim().0 / 2;
        assert!((map.levels[[half, half]] - 1.0).abs() < 1e-12);
        for (row, column) in [(half + 7, half - 30), (half - 11, half + 4), (3, 5)] {
            assert!((map.levels[[row, column]] - map.levels[[2 * half - row, 2 * half - column]]).abs() < 1e-12);
        }
    }

    #[test]
    fn a_band_smears_ghosts_and_irregular_places_have_none() {
        let layout = made("rectangular", 64, None);
        let band = FigureOptions { bandwidth: Some(Frequency(20e9)), channels: 16, ..FigureOptions::default() };
        let sharp = layout.ghost_map(94e9, &FigureOptions::default(), None, -3.0).unwrap();
        let smeared = layout.ghost_map(94e9, &band, None, -3.0).unwrap();
        assert!(sharp.lobes.len() > smeared.lobes.len(), "{} {}", sharp.lobes.len(), smeared.lobes.len());
        let spiral = made("fermat", 64, None);
        let map = spiral.ghost_map(94e9, &FigureOptions::default(), None, -3.0).unwrap();
        assert!(map.lobes.is_empty() && map.ghosts.directions.is_empty());
        // Its highest lobe is that of the figures.
        let lower = spiral.ghost_map(94e9, &FigureOptions::default(), None, -12.0).unwrap();
        let figures = spiral.figures(94e9).unwrap();
        assert!(
            (10.0 * lower.lobes[0].level.log10() - figures.psl_within_db).abs() < 0.05,
            "{:?} {}",
            lower.lobes[0],
            figures.psl_within_db
        );
        assert!(spiral.ghost_map(94e9, &FigureOptions::default(), None, 0.0).is_err());
    }
}
