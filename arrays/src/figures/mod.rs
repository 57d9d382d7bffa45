//! Figures of merit of an array: its size, and at one frequency or over a band its beam, side lobes, u-v coverage and noise, for a snapshot at
//! the zenith.

mod cable;
mod coverage;
mod ghosts;
mod hole;
mod losses;
mod main_lobe;
mod options;
mod plane;
mod psf;
mod sensitivity;
mod shadowing;
mod side_lobes;
mod uniformity;
mod weights;

pub use ghosts::Ghosts;
pub use losses::{LOSS_FIGURES, LossFigures, LossSummary, Losses};
pub use options::FigureOptions;
pub use shadowing::Shadowing;

use main_lobe::{Beam, HalfPower};
use plane::Plane;
use psf::Psf;
use side_lobes::{Field, SideLobes};

use crate::{ArrayError, ArrayLayout, Result, SPEED_OF_LIGHT_M_S, Weighting};
use std::f64::consts::PI;

/// Largest number of antennas for which figures are computed, because the pairs are held in memory.
const MOST_ANTENNAS: usize = 3000;
/// Most baselines of all channels together that the beam of other than natural weights sums one by one.
const MOST_TERMS: usize = 250_000;

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

/// Figures at one frequency or over a band, for one integration towards the zenith or boresight.
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
    /// Largest side lobe (of either sign) over the main lobe, dB, within 30 beams of the centre.
    pub psl_db: f64,
    /// Root mean square of the beam outside the main lobe over its peak, within 30 beams of the centre.
    pub rms_sidelobe: f64,
    /// Lowest value of the beam there: its deepest negative side lobe.
    pub lowest_sidelobe: f64,
    /// Peak side lobe, dB, and rms side lobe within the distance of the options.
    pub within: Option<(f64, f64)>,
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
        let (plane, wavelength_m) = self.in_plane(freq_hz, options)?;
        let scales = options.scales(freq_hz);
        let terms = self.n_baselines() * scales.len();
        ArrayError::need(
            "weighting",
            if options.weighting == Weighting::Uniform { "uniform" } else { "briggs" },
            options.weighting == Weighting::Natural || terms <= MOST_TERMS,
            format!("natural for {terms} baselines of all channels: other weights take at most {MOST_TERMS}"),
        )?;
        let cell_m = self.uv_cell_m(&plane, wavelength_m, options);
        let cell = cell_m / wavelength_m;
        let psf = Psf::weighted(&plane, &scales, options.weighting, options.robust.unwrap_or(0.0), cell);
        let beam = Beam::fit(&psf);
        let width = HalfPower::of(&psf, &beam);
        let lobes = SideLobes::of(&psf, &Field::whole(&beam));
        let within = options.within.map(|x| within(&psf, &beam, x, plane.longest())).transpose()?;
        let different = coverage::different_baselines(self, wavelength_m / 10.0).into_iter().max().map_or(0, |last| last + 1);
        let hit = coverage::uv_cells(&plane, cell).into_iter().flatten().max().map_or(0, |last| last + 1);
        let sefd = sensitivity::sefd_jy(self, options, wavelength_m);
        let point =
            sefd.zip(options.bandwidth).map(|(s, b)| sensitivity::point_source_jy(sensitivity::pairs(&s), b.si(), options.time.si()));
        let (major, minor) = (beam.major_rad.min(PI), beam.minor_rad.min(PI));
        Ok(LayoutFigures {
            bmaj_rad: major,
            bmin_rad: minor,
            bpa_rad: beam.pa_rad,
            half_power_rad: [width.widest_rad, width.narrowest_rad],
            half_power_equivalent_rad: width.equivalent_rad,
            largest_scale_rad: 1.0 / plane.shortest(),
            psl_db: 10.0 * lobes.peak.log10(),
            rms_sidelobe: lobes.rms,
            lowest_sidelobe: lobes.lowest,
            within,
            uv_fill: coverage::uv_fill(hit, plane.longest(), cell),
            uv_fill_cell_m: cell_m,
            radial_uniformity: uniformity::radial(&plane),
            azimuthal_uniformity: uniformity::azimuthal(&plane),
            largest_hole_m: hole::diameter(&plane) * wavelength_m,
            redundancy: self.n_baselines() as f64 / different as f64,
            unique_baselines: different,
            ghosts: Ghosts::of(&plane),
            point_source_jy: point,
            delta_t_k: point.map(|p| p * sensitivity::kelvin_per_jy(freq_hz, major, minor)),
        })
    }

    /// Figures with any one antenna lost, and any two if `pairs`: at one frequency, with natural weights. The side lobes are those within 30 beams
    /// of the full array.
    ///
    /// # Errors
    /// As [`ArrayLayout::figures_with`]; fewer than three antennas (four for pairs), more than 256 for pairs.
    pub fn figures_with_losses(&self, freq_hz: f64, options: &FigureOptions, pairs: bool) -> Result<Losses> {
        let (plane, wavelength_m) = self.in_plane(freq_hz, options)?;
        let sefd = sensitivity::sefd_jy(self, options, wavelength_m);
        self.losses(wavelength_m, self.uv_cell_m(&plane, wavelength_m, options), sefd.as_deref(), pairs)
    }

    /// The antennas in the aperture plane and the wavelength, after a check of what was asked.
    fn in_plane(&self, freq_hz: f64, options: &FigureOptions) -> Result<(Plane, f64)> {
        ArrayError::unless(freq_hz.is_finite() && freq_hz > 0.0, "frequency", format_args!("{freq_hz} Hz"), "a positive frequency")?;
        ArrayError::unless(
            (2..=MOST_ANTENNAS).contains(&self.n_ant()),
            "number of antennas",
            self.n_ant(),
            "2 to 3000 for figures of merit",
        )?;
        options.check(freq_hz)?;
        let wavelength_m = SPEED_OF_LIGHT_M_S / freq_hz;
        let plane = Plane::new(self, wavelength_m);
        ArrayError::unless(
            plane.longest() != 0.0,
            "longest baseline in the aperture plane",
            "0 m",
            "antennas side by side, not one behind the other",
        )?;
        Ok((plane, wavelength_m))
    }

    /// Width of a cell of the u-v fill.
    fn uv_cell_m(&self, plane: &Plane, wavelength_m: f64, options: &FigureOptions) -> f64 {
        let smallest = self.antennas().iter().filter_map(|a| a.diameter_m).fold(f64::INFINITY, f64::min);
        let own = if smallest.is_finite() { smallest } else { plane.shortest() * wavelength_m };
        options.uv_cell.or(options.diameter).map_or(own, |c| c.si())
    }
}

/// Peak side lobe in dB and rms within `x` wavelengths over the longest baseline.
fn within(psf: &Psf, beam: &Beam, x: f64, longest: f64) -> Result<(f64, f64)> {
    let Some(field) = Field::within(beam, x / longest) else {
        ArrayError::need("within", x, false, format!("at most {:.0} for this array: 1000 beams", 1000.0 * beam.minor_rad * longest))?;
        return Ok((0.0, 0.0));
    };
    let lobes = SideLobes::of(psf, &field);
    let main = beam.major_rad * longest;
    ArrayError::need("within", x, lobes.peak > 0.0, format!("more than the main lobe, which is {main:.1} wide at half of its peak"))?;
    Ok((10.0 * lobes.peak.log10(), lobes.rms))
}

#[cfg(test)]
mod closed_forms;
#[cfg(test)]
mod tests;
