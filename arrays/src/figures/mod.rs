//! Figures of merit of an array: its size, and at one frequency its beam, side lobes and u-v coverage for a snapshot at the zenith.

mod coverage;
mod plane;
mod psf;

use plane::Plane;

use crate::{ArrayError, ArrayLayout, Result, SPEED_OF_LIGHT_M_S};

/// Largest number of antennas for which figures are computed, because the pairs are held in memory.
const MOST_ANTENNAS: usize = 3000;

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

/// Figures at one frequency, for natural weights and one integration towards the zenith or boresight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LayoutFigures {
    /// Full width at half maximum of the main lobe along its major axis, rad (Gaussian fit); pi where the array has no
    /// resolution.
    pub bmaj_rad: f64,
    /// Full width at half maximum along the minor axis, rad.
    pub bmin_rad: f64,
    /// Position angle of the major axis from +y (north) towards +x (east), rad in -pi/2 to pi/2.
    pub bpa_rad: f64,
    /// Wavelength over the shortest projected baseline, rad.
    pub largest_scale_rad: f64,
    /// Largest side lobe (of either sign) over the main lobe, dB, within 30 beams of the centre.
    pub psl_db: f64,
    /// Root mean square of the beam outside the main lobe over its peak, within 30 beams of the centre.
    pub rms_sidelobe: f64,
    /// Fraction of the u-v cells within the longest baseline that contain a baseline. A cell has the size of the smallest element diameter,
    /// or of the shortest baseline where no diameter is known.
    pub uv_fill: f64,
    /// The size of that cell, m: divided by the wavelength it is a distance in the u-v plane.
    pub uv_fill_cell_m: f64,
    /// Number of baselines divided by the number of different baselines.
    pub redundancy: f64,
    /// Number of different baselines. Baselines within a tenth of a wavelength of each other count once.
    pub unique_baselines: usize,
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

    /// Figures of merit at a frequency.
    ///
    /// # Errors
    /// A frequency that is not positive; fewer than two antennas or more than 3,000; antennas that all lie along the line of sight.
    pub fn figures(&self, freq_hz: f64) -> Result<LayoutFigures> {
        ArrayError::unless(freq_hz.is_finite() && freq_hz > 0.0, "frequency", format_args!("{freq_hz} Hz"), "a positive frequency")?;
        ArrayError::unless(
            (2..=MOST_ANTENNAS).contains(&self.n_ant()),
            "number of antennas",
            self.n_ant(),
            "2 to 3000 for figures of merit",
        )?;
        let wavelength_m = SPEED_OF_LIGHT_M_S / freq_hz;
        let plane = Plane::new(self, wavelength_m);
        ArrayError::unless(
            plane.longest() != 0.0,
            "longest baseline in the aperture plane",
            "0 m",
            "antennas side by side, not one behind the other",
        )?;
        let beam = psf::Beam::fit(&plane);
        let lobes = psf::side_lobes(&plane, &beam);
        let cell_m = self.antennas().iter().filter_map(|a| a.diameter_m).fold(f64::INFINITY, f64::min);
        let cell = if cell_m.is_finite() { cell_m / wavelength_m } else { plane.shortest() };
        let unique_baselines = coverage::unique_baselines(self, wavelength_m / 10.0);
        Ok(LayoutFigures {
            bmaj_rad: beam.major_rad.min(std::f64::consts::PI),
            bmin_rad: beam.minor_rad.min(std::f64::consts::PI),
            bpa_rad: beam.pa_rad,
            largest_scale_rad: 1.0 / plane.shortest(),
            psl_db: 10.0 * lobes.peak.log10(),
            rms_sidelobe: lobes.rms,
            uv_fill: coverage::uv_fill(&plane, cell),
            uv_fill_cell_m: cell * wavelength_m,
            redundancy: self.n_baselines() as f64 / unique_baselines as f64,
            unique_baselines,
        })
    }
}

#[cfg(test)]
mod tests;
