//! What an observation with a layout sees: its baselines and its beam.

use super::FigureOptions;
use super::beam_lobes::{Aperture, Reach};
use super::main_lobe::Beam;
use super::plane::Plane;
use super::psf::Psf;
use crate::{ArrayError, ArrayLayout, CoveragePlan, Result, SPEED_OF_LIGHT_M_S, Weighting};

/// Largest number of antennas for which figures are computed, because the pairs are held in memory.
const MOST_ANTENNAS: usize = 3000;
/// Most antennas of all channels and integrations together, each of which costs a phasor in every direction.
const MOST_SEEN: usize = 200_000;
/// Most baselines of all channels and integrations together that the beam of other than natural weights sums one by one.
const MOST_TERMS: usize = 250_000;

/// Baselines and beam of one integration at the zenith or boresight, or of a track.
pub(super) struct Seen {
    pub(super) plane: Plane,
    pub(super) wavelength_m: f64,
    /// Width of a cell of the u-v fill.
    pub(super) cell_m: f64,
    pub(super) psf: Psf,
    pub(super) beam: Beam,
    pub(super) aperture: Aperture,
    pub(super) reach: Reach,
}

impl ArrayLayout {
    /// What the layout sees over the band of the options.
    ///
    /// # Errors
    /// As [`ArrayLayout::figures_over`].
    pub(super) fn seen(&self, freq_hz: f64, options: &FigureOptions, track: Option<&CoveragePlan>) -> Result<Seen> {
        let (snapshot, wavelength_m) = self.in_plane(freq_hz, options)?;
        let plane = track.map_or(snapshot, |plan| Plane::along(plan, wavelength_m));
        let scales = options.scales(freq_hz);
        let seen = plane.n_seen() * scales.len();
        let expected = format!("longer ones or fewer channels: {seen} antennas of all channels and integrations, at most {MOST_SEEN}");
        ArrayError::need(
            "integration",
            format_args!("{} s", track.map_or(0.0, CoveragePlan::integration_s)),
            track.is_none() || seen <= MOST_SEEN,
            expected,
        )?;
        let terms = plane.pairs().count() * scales.len();
        ArrayError::need(
            "weighting",
            if options.weighting == Weighting::Uniform { "uniform" } else { "briggs" },
            options.weighting == Weighting::Natural || terms <= MOST_TERMS,
            format!("natural for {terms} baselines of all channels and integrations: other weights take at most {MOST_TERMS}"),
        )?;
        let cell_m = self.uv_cell_m(&plane, wavelength_m, options);
        let psf = Psf::weighted(&plane, &scales, options.weighting, options.robust.unwrap_or(0.0), cell_m / wavelength_m);
        let beam = Beam::fit(&psf);
        let aperture = Aperture::of(self, options, plane.longest() * wavelength_m);
        let reach = Reach { within: options.within, aperture: aperture.diameter_m / wavelength_m };
        Ok(Seen { plane, wavelength_m, cell_m, psf, beam, aperture, reach })
    }

    /// The antennas in the aperture plane and the wavelength, after a check of what was asked.
    pub(super) fn in_plane(&self, freq_hz: f64, options: &FigureOptions) -> Result<(Plane, f64)> {
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
    pub(super) fn uv_cell_m(&self, plane: &Plane, wavelength_m: f64, options: &FigureOptions) -> f64 {
        let smallest = self.antennas().iter().filter_map(|a| a.diameter_m).fold(f64::INFINITY, f64::min);
        let own = if smallest.is_finite() { smallest } else { plane.shortest() * wavelength_m };
        options.uv_cell.or(options.diameter).map_or(own, |c| c.si())
    }
}
