//! Figures of merit of an array: its size, and at one frequency or over a band its beam, side lobes, u-v coverage and noise, for a snapshot at
//! the zenith or over a track.

mod beam_lobes;
mod cable;
mod coverage;
mod ghost_map;
mod ghosts;
mod hole;
mod losses;
mod main_lobe;
mod options;
mod plane;
mod psf;
mod seen;
mod sensitivity;
mod shadowing;
mod side_lobes;
mod uniformity;
mod weights;

pub use beam_lobes::{Aperture, ApertureFrom, BeamLobes};
pub use ghost_map::{GhostLobe, GhostMap};
pub use ghosts::Ghosts;
pub use losses::{LOSS_FIGURES, LossFigures, LossSummary, Losses};
pub use options::{FigureOptions, WITHIN};
pub use shadowing::Shadowing;

use beam_lobes::Reach;
use main_lobe::HalfPower;
use seen::Seen;

use crate::{ArrayLayout, CoveragePlan, Result};
use std::f64::consts::PI;

/// Baselines of an array.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LayoutExtent {
    /// Number of antennas.
    pub n_antennas: usize,
    /// Number of pairs.
    pub n_baselines: usize,
    /// Shortest baseline, m; 0 for a single antenna.
    pub shortest_m: f64,
    /// Longest baseline, m.
    pub longest_m: f64,
}

/// Figures at one frequency or over a band, for one integration towards the zenith or boresight, or for all integrations of a track together.
#[derive(Debug, Clone, PartialEq)]
pub struct LayoutFigures {
    /// Full width at half maximum of the main lobe along its major axis, rad (Gaussian fit); pi where the array has no
    /// resolution.
    pub bmaj_rad: f64,
    /// Full width at half maximum along the minor axis, rad.
    pub bmin_rad: f64,
    /// Position angle of the major axis from +y (north) towards +x (east), rad in -pi/2 to pi/2.
    pub bpa_rad: f64,
    /// Widest and narrowest diameter of the contour on which the beam is half of its peak, rad. They follow the beam itself, not a Gaussian.
    pub half_power_rad: [f64; 2],
    /// Diameter of the circle with the area of that contour, rad.
    pub half_power_equivalent_rad: f64,
    /// Wavelength over the shortest projected baseline, rad.
    pub largest_scale_rad: f64,
    /// The aperture whose wavelengths are the unit of `within`.
    pub aperture: Aperture,
    /// Distance from the centre to which side lobes count, wavelengths over the aperture.
    pub within: f64,
    /// The same, rad.
    pub within_rad: f64,
    /// Largest side lobe (of either sign) over the main lobe, dB, from the first minimum to that distance.
    pub psl_within_db: f64,
    /// Root mean square of the beam outside the main lobe over its peak, within that distance.
    pub rms_sidelobe_within: f64,
    /// Lowest value of the beam there: its deepest negative side lobe.
    pub lowest_sidelobe_within: f64,
    /// Distance from the centre to the edge of the whole field, wavelengths over the aperture: that of the horizon, or a nearer one where the sums
    /// would take long.
    pub field: f64,
    /// The same, rad; 1 is the horizon.
    pub field_rad: f64,
    /// Largest side lobe (of either sign) of the whole field over the main lobe, dB.
    pub psl_db: f64,
    /// Root mean square of the beam outside the main lobe over its peak, in the whole field.
    pub rms_sidelobe: f64,
    /// Lowest value of the beam in the whole field.
    pub lowest_sidelobe: f64,
    /// Fraction of the u-v cells within the longest baseline that contain a baseline. A cell has the size of the smallest element diameter,
    /// or of the shortest baseline where no diameter is known, or that of the options.
    pub uv_fill: f64,
    /// The size of that cell, m: divided by the wavelength it is a distance in the u-v plane.
    pub uv_fill_cell_m: f64,
    /// Evenness of the baselines over ten rings of equal area: 1 where all hold the same number, 0.1 where one holds all.
    pub radial_uniformity: f64,
    /// Evenness over eighteen sectors of 10 degrees: 1 where all hold the same number, 1/18 where one holds all.
    pub azimuthal_uniformity: f64,
    /// Diameter of the largest circle within the longest baseline without a baseline, m: divided by the wavelength it is a distance in the u-v
    /// plane.
    pub largest_hole_m: f64,
    /// Number of baselines divided by the number of different baselines.
    pub redundancy: f64,
    /// Number of different baselines. Baselines within a tenth of a wavelength of each other count once.
    pub unique_baselines: usize,
    /// Where regular spacings repeat the image.
    pub ghosts: Ghosts,
    /// Number of integrations: 1 without a track.
    pub n_integrations: usize,
    /// Time to which the noise belongs, s: that of the options, or of all integrations of the track.
    pub time_s: f64,
    /// Rms of a point source in the naturally weighted image, Jy; `None` without a bandwidth or the sensitivity of every antenna.
    pub point_source_jy: Option<f64>,
    /// The same as brightness averaged over the fitted beam, K.
    pub delta_t_k: Option<f64>,
}

impl ArrayLayout {
    /// Number and lengths of the baselines.
    #[must_use]
    pub fn extent(&self) -> LayoutExtent {
        let (mut shortest, mut longest) = (f64::INFINITY, 0.0_f64);
        let antennas = self.antennas();
        for (i, a) in antennas.iter().enumerate() {
            for b in &antennas[i + 1..] {
                let d2: f64 = (0..3).map(|k| (b.position_m[k] - a.position_m[k]).powi(2)).sum();
                shortest = shortest.min(d2);
                longest = longest.max(d2);
            }
        }
        LayoutExtent {
            n_antennas: self.n_ant(),
            n_baselines: self.n_baselines(),
            shortest_m: if shortest.is_finite() { shortest.sqrt() } else { 0.0 },
            longest_m: longest.sqrt(),
        }
    }

    /// Figures of merit at a frequency with natural weights.
    ///
    /// # Errors
    /// As [`ArrayLayout::figures_with`].
    pub fn figures(&self, freq_hz: f64) -> Result<LayoutFigures> {
        self.figures_with(freq_hz, &FigureOptions::default())
    }

    /// Figures of merit at a frequency, or over the band around it.
    ///
    /// # Errors
    /// A frequency that is not positive; fewer than two antennas or more than 3,000; antennas that all lie along the line of sight; an option out of
    /// its range; sums that would take minutes.
    pub fn figures_with(&self, freq_hz: f64, options: &FigureOptions) -> Result<LayoutFigures> {
        self.figures_of(freq_hz, options, None)
    }

    /// Figures of merit of all integrations of a track together. The plan must be one of this layout.
    ///
    /// # Errors
    /// As [`ArrayLayout::figures_with`]; so many integrations that the sums would take minutes.
    pub fn figures_over(&self, freq_hz: f64, options: &FigureOptions, plan: &CoveragePlan) -> Result<LayoutFigures> {
        self.figures_of(freq_hz, options, Some(plan))
    }

    fn figures_of(&self, freq_hz: f64, options: &FigureOptions, track: Option<&CoveragePlan>) -> Result<LayoutFigures> {
        let Seen { plane, wavelength_m, cell_m, psf, beam, aperture, reach } = self.seen(freq_hz, options, track)?;
        let cell = cell_m / wavelength_m;
        let width = HalfPower::of(&psf, &beam);
        let near = reach.side_lobes(&psf, &beam)?;
        let whole = reach.whole(&psf, &beam);
        let far = if whole.within > reach.within { whole.side_lobes(&psf, &beam)? } else { near };
        let different = coverage::different_baselines(self, wavelength_m / 10.0).into_iter().max().map_or(0, |last| last + 1);
        let hit = coverage::uv_cells(&plane, cell).into_iter().flatten().max().map_or(0, |last| last + 1);
        let sefd = sensitivity::sefd_jy(self, options, wavelength_m);
        // Pairs of all integrations, each of which has the time of one.
        let (n_integrations, each_s) = (plane.views.len(), track.map_or(options.time.si(), CoveragePlan::integration_s));
        let of = |view: Vec<(usize, [f64; 2])>, s: &[f64]| sensitivity::pairs(&view.iter().map(|(i, _)| s[*i]).collect::<Vec<_>>());
        let pairs = |s: &[f64]| track.map_or_else(|| sensitivity::pairs(s), |plan| plan.views().map(|view| of(view, s)).sum());
        let point = sefd.zip(options.bandwidth).map(|(s, b)| sensitivity::point_source_jy(pairs(&s), b.si(), each_s));
        let (major, minor) = (beam.major_rad.min(PI), beam.minor_rad.min(PI));
        Ok(LayoutFigures {
            bmaj_rad: major,
            bmin_rad: minor,
            bpa_rad: beam.pa_rad,
            half_power_rad: [width.widest_rad, width.narrowest_rad],
            half_power_equivalent_rad: width.equivalent_rad,
            largest_scale_rad: 1.0 / plane.shortest(),
            aperture,
            within: options.within,
            within_rad: reach.radius_rad(),
            psl_within_db: 10.0 * near.peak.log10(),
            rms_sidelobe_within: near.rms,
            lowest_sidelobe_within: near.lowest,
            field: whole.within,
            field_rad: whole.radius_rad(),
            // The tops of the highest lobes are found from the same grid points, of which only so many are followed.
            psl_db: 10.0 * far.peak.max(near.peak).log10(),
            rms_sidelobe: far.rms,
            lowest_sidelobe: far.lowest.min(near.lowest),
            uv_fill: coverage::uv_fill(hit, plane.longest(), cell),
            uv_fill_cell_m: cell_m,
            radial_uniformity: uniformity::radial(&plane),
            azimuthal_uniformity: uniformity::azimuthal(&plane),
            largest_hole_m: hole::diameter(&plane) * wavelength_m,
            redundancy: self.n_baselines() as f64 / different as f64,
            unique_baselines: different,
            ghosts: Ghosts::of(&plane),
            n_integrations,
            time_s: n_integrations as f64 * each_s,
            point_source_jy: point,
            delta_t_k: point.map(|p| p * sensitivity::kelvin_per_jy(freq_hz, major, minor)),
        })
    }

    /// Figures with any one antenna lost, and any two if `pairs`: at one frequency, with natural weights. The side lobes are those
    /// within the distance of the options, in wavelengths over the aperture of the full array.
    ///
    /// # Errors
    /// As [`ArrayLayout::figures_with`]; fewer than three antennas (four for pairs), more than 256 for pairs.
    pub fn figures_with_losses(&self, freq_hz: f64, options: &FigureOptions, pairs: bool) -> Result<Losses> {
        let (plane, wavelength_m) = self.in_plane(freq_hz, options)?;
        let sefd = sensitivity::sefd_jy(self, options, wavelength_m);
        let aperture_m = Aperture::of(self, options, plane.longest() * wavelength_m).diameter_m;
        let reach = Reach { within: options.within, aperture: aperture_m / wavelength_m };
        self.losses(wavelength_m, self.uv_cell_m(&plane, wavelength_m, options), sefd.as_deref(), reach, pairs)
    }
}

#[cfg(test)]
mod closed_forms;
#[cfg(test)]
mod tests;
