//! The scene: its checks and its conversion to the unit of the visibilities.

use super::dft::n_minus_1;
use crate::finite::all_finite;
use crate::nearfield::Surface;
use crate::progress::{Event, Observer};
use crate::{ChainError, Result};
use cittert_arrays::ElementPattern;
use cittert_arrays::{
    BrightnessUnit, Image, PhaseCenter, Polarization, SkyFrame, SkyGrid, Source, SpectralWindow, VisUnit, jy_per_kelvin_sr,
};
use ndarray::{Array2, Axis};
use num_complex::Complex64;
use rayon::prelude::*;

/// The observed scene: the sum of images and analytic sources.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SkyModel {
    /// Images in K, Jy/pixel or Jy/beam. An image with one channel is used for the whole band. If an image has several channels, each channel
    /// of the set uses the nearest one.
    pub images: Vec<Image>,
    /// Points and Gaussians.
    pub sources: Vec<Source>,
    /// Where all of them lie; `None` is the far field.
    pub surface: Option<Surface>,
}

impl SkyModel {
    /// A scene with one image.
    #[must_use]
    pub fn of_image(image: Image) -> Self {
        Self { images: vec![image], ..Self::default() }
    }

    /// A scene with sources only.
    #[must_use]
    pub fn of_sources(sources: Vec<Source>) -> Self {
        Self { sources, ..Self::default() }
    }

    /// The same scene on a surface, or in the far field.
    #[must_use]
    pub fn at(self, surface: Option<Surface>) -> Self {
        Self { surface, ..self }
    }

    /// Width of the square about the phase centre that holds all images, as a difference of direction cosines. Sources in a list say nothing of the
    /// field around them, so a scene that has some has no width.
    #[must_use]
    pub fn width_rad(&self) -> Option<f64> {
        if !self.sources.is_empty() {
            return None;
        }
        let edges = self.images.iter().flat_map(|image| {
            let (g, n_l, n_m) = (&image.grid, image.grid.n_l as f64, image.grid.n_m as f64);
            [g.l_at(-0.5), g.l_at(n_l - 0.5), g.m_at(-0.5), g.m_at(n_m - 0.5)]
        });
        Some(2.0 * edges.fold(0.0, |most: f64, x| most.max(x.abs()))).filter(|w| w.is_finite() && *w > 0.0)
    }
}

/// Factor from flux densities in Jy to the unit of the visibilities.
pub(crate) fn from_jy(unit: VisUnit, freq_hz: f64) -> f64 {
    if unit == VisUnit::KelvinSr { 1.0 / jy_per_kelvin_sr(freq_hz) } else { 1.0 }
}

/// Factor from the apparent plane of an image to the unit of the visibilities.
pub(crate) fn unit_factor(image: BrightnessUnit, unit: VisUnit, freq_hz: f64) -> f64 {
    match (image, unit) {
        (BrightnessUnit::Kelvin, VisUnit::KelvinSr) => 1.0,
        (BrightnessUnit::Kelvin, _) => jy_per_kelvin_sr(freq_hz),
        (_, unit) => from_jy(unit, freq_hz),
    }
}

/// The coefficient with which a Stokes parameter (or a correlation) of the scene contributes to a product of the set.
///
/// # Reference
/// Hamaker & Bregman 1996, A&AS 117, 161, with I = (XX + YY) / 2 = (RR + LL) / 2: an unpolarised source has XX = I. Visibilities in memory are the
/// conjugates of those of the paper (see [`cittert_arrays::feeds`]).
pub(crate) fn stokes_coefficient(scene: Polarization, product: Polarization) -> Complex64 {
    use Polarization::{I, LL, LR, Q, RL, RR, U, V, XX, XY, YX, YY};
    let (re, im) = match (scene, product) {
        (a, b) if a == b => (1.0, 0.0),
        (I, RR | LL | XX | YY) | (Q, XX | RL | LR) | (U, XY | YX) | (V, RR) => (1.0, 0.0),
        (Q, YY) | (V, LL) => (-1.0, 0.0),
        (U, RL) | (V, XY) => (0.0, -1.0),
        (U, LR) | (V, YX) => (0.0, 1.0),
        _ => (0.0, 0.0),
    };
    Complex64::new(re, im)
}

/// Check an image against the phase centres of a set and the numbers in it.
///
/// # Errors
/// The image has another frame or centre than the set, a pixel is not finite, the unit is not a brightness, or an image in Jy/beam has neither
/// one beam nor one for each channel.
pub(crate) fn check_image(image: &Image, centers: &[PhaseCenter]) -> Result<()> {
    for center in centers {
        check_frame(&image.grid, center)?;
    }
    if !all_finite(&image.data, |v| v)
        && let Some((at, value)) = image.data.indexed_iter().find(|(_, v)| !v.is_finite())
    {
        return Err(ChainError::Incompatible(format!(
            "scene {:?} is {value} at column {}, row {} (channel {}, polarisation {}): replace blank pixels by a number first",
            image.object, at.3, at.2, at.0, at.1
        )));
    }
    match image.unit {
        BrightnessUnit::Kelvin | BrightnessUnit::JyPerPixel => Ok(()),
        BrightnessUnit::JyPerBeam if image.beams.is_empty() => Err(ChainError::Incompatible(format!(
            "scene {:?} is in Jy/beam but has no beam (BMAJ, BMIN, BPA): its flux density is unknown",
            image.object
        ))),
        BrightnessUnit::JyPerBeam if ![1, image.spectrum.n_chan()].contains(&image.beams.len()) => Err(ChainError::Incompatible(format!(
            "scene {:?} has {} beams for {} channels: one beam, or one for each channel is needed",
            image.object,
            image.beams.len(),
            image.spectrum.n_chan()
        ))),
        BrightnessUnit::JyPerBeam => Ok(()),
        other => Err(ChainError::Incompatible(format!(
            "scene {:?} has the unit {:?}: K, Jy/pixel or Jy/beam is needed",
            image.object,
            other.bunit()
        ))),
    }
}

fn check_frame(grid: &SkyGrid, center: &PhaseCenter) -> Result<()> {
    match (&grid.frame, SkyGrid::frame_of(center)) {
        (scene @ SkyFrame::Sky { .. }, set @ SkyFrame::Sky { .. }) if scene.is_b1950() != set.is_b1950() => {
            let name = |old: bool| if old { "B1950 (FK4)" } else { "J2000 or ICRS" };
            Err(ChainError::Incompatible(format!(
                "the coordinates of the scene are those of {}, and those of the set are {}: convert the image first, because they differ by 0.6 degrees",
                name(scene.is_b1950()),
                name(set.is_b1950())
            )))
        }
        (SkyFrame::Boresight, SkyFrame::Boresight) => Ok(()),
        (SkyFrame::Sky { ra_rad, dec_rad, .. }, SkyFrame::Sky { ra_rad: ra, dec_rad: dec, .. }) => {
            let d_ra = (ra_rad - ra + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI;
            let offset = (d_ra * dec.cos()).hypot(dec_rad - dec);
            // The centre in a FITS header in degrees is much more accurate than this.
            if offset <= (1e-3 * grid.cell_rad).max(1e-9) {
                return Ok(());
            }
            Err(ChainError::Incompatible(format!(
                "the scene is centred on RA {:.6} deg, Dec {:.6} deg but the set is phased to RA {:.6} deg, Dec {:.6} deg ({:.1} arcsec away): use the centre of the scene as the phase centre",
                ra_rad.to_degrees(),
                dec_rad.to_degrees(),
                ra.to_degrees(),
                dec.to_degrees(),
                offset.to_degrees() * 3600.0
            )))
        }
        (SkyFrame::Boresight, SkyFrame::Sky { .. }) => Err(ChainError::Incompatible(format!(
            "the scene is drawn around a boresight but phase centre {:?} is a point of the sky: give the scene a celestial frame (l grows to the left there)",
            center.name
        ))),
        (SkyFrame::Sky { .. }, SkyFrame::Boresight) => Err(ChainError::Incompatible(format!(
            "the scene is drawn on the sky but phase centre {:?} is a direction fixed to the array: use a sidereal phase centre",
            center.name
        ))),
    }
}

/// True for the products to which the total intensity, and therefore the pedestal, contributes.
pub(crate) fn holds_intensity(pol: Polarization) -> bool {
    stokes_coefficient(Polarization::I, pol).re != 0.0
}

/// The apparent brightness of one plane \[m, l\]: the integral of the brightness over each cell, times the element pattern.
///
/// An image in K gives K sr: T cell^2 / n, because dOmega = dl dm / n. An image in Jy/pixel already contains the integral. In Jy/beam, the
/// solid angles of the cell and of the beam depend on n in the same way, so the ratio of their areas at the centre applies everywhere.
pub(crate) fn apparent_plane(
    image: &Image,
    (chan, pol): (usize, usize),
    pattern: &ElementPattern,
    freq_hz: f64,
    pedestal_k: f64,
    one_over_n: bool,
) -> Array2<f64> {
    let grid = &image.grid;
    let beam_cells = image.beams.get(chan).or(image.beams.first()).map_or(1.0, |b| b.solid_angle_sr() / grid.cell_sr());
    let pedestal = if holds_intensity(image.polarizations[pol]) { pedestal_k } else { 0.0 };
    let plane = image.plane(chan, pol);
    let pixel = |row: usize, column: usize| {
        let (l, m) = (grid.l_at(column as f64), grid.m_at(row as f64));
        let value = plane[[row, column]];
        let cell = match image.unit {
            BrightnessUnit::Kelvin => {
                let n = n_minus_1(l, m).map_or(0.0, |x| x + 1.0);
                if n <= 0.0 {
                    return 0.0;
                }
                (value - pedestal) * grid.cell_sr() / if one_over_n { n } else { 1.0 }
            }
            BrightnessUnit::JyPerBeam => value / beam_cells,
            _ => value,
        };
        // An image that contains a pattern already is what the elements see.
        if cell == 0.0 || !image.pattern.is_none() { cell } else { cell * pattern.power(l, m, freq_hz) }
    };
    let mut seen = Array2::zeros((grid.n_m, grid.n_l));
    let lines = seen.axis_iter_mut(Axis(0)).into_par_iter().enumerate();
    lines.for_each(|(row, mut line)| line.iter_mut().enumerate().for_each(|(column, v)| *v = pixel(row, column)));
    seen
}

/// Warn of pixels that no array sees.
pub(crate) fn warn_beyond_horizon(image: &Image, observer: &dyn Observer) {
    let grid = &image.grid;
    // What lies between directions above the horizon lies above it too.
    let corner =
        [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)].map(|(x, y)| (grid.l_at(x * grid.n_l as f64), grid.m_at(y * grid.n_m as f64)));
    if corner.iter().all(|(l, m)| n_minus_1(*l, *m).is_some()) {
        return;
    }
    let hidden =
        image.data.indexed_iter().filter(|((_, _, r, c), v)| **v != 0.0 && n_minus_1(grid.l_at(*c as f64), grid.m_at(*r as f64)).is_none());
    let count = hidden.count();
    if count > 0 {
        observer.event(Event::Warning(&format!(
            "{count} pixels of scene {:?} lie behind the horizon (l^2 + m^2 > 1) and do not contribute",
            image.object
        )));
    }
}

/// For each channel of the set, the channel of the image with the nearest frequency \[chan\].
pub(crate) fn nearest_channels(image: &SpectralWindow, set: &SpectralWindow) -> Vec<usize> {
    let distance = |c: &usize, f: f64| (image.freq_hz()[*c] - f).abs();
    set.freq_hz().iter().map(|f| (0..image.n_chan()).min_by(|a, b| distance(a, *f).total_cmp(&distance(b, *f))).unwrap_or(0)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::RestoringBeam;
    use cittert_arrays::feeds::{coherency, feed_matrix, products};
    use ndarray::Array4;

    fn image(unit: BrightnessUnit, value: f64) -> Image {
        let grid = SkyGrid::new(16, 16, 0.02, SkyFrame::Boresight).unwrap();
        let spectrum = SpectralWindow::band(1e9, 1e6, 1).unwrap();
        Image::new(grid, spectrum, vec![Polarization::I], Array4::from_elem((1, 1, 16, 16), value), unit).unwrap()
    }

    #[test]
    fn kelvin_and_jansky_agree_by_the_rayleigh_jeans_law() {
        // 1 K over 1 sr at 300 MHz: 2 k / lambda^2.
        assert!((jy_per_kelvin_sr(299_792_458.0) - 2.0 * 1.380_649e-23 * 1e26).abs() < 1e-9);
        let f = 94e9;
        assert!((unit_factor(BrightnessUnit::Kelvin, VisUnit::Jy, f) * from_jy(VisUnit::KelvinSr, f) - 1.0).abs() < 1e-15);
    }

    #[test]
    fn each_unit_integrates_over_its_cell() {
        let seen = |im: &Image, one_over_n| apparent_plane(im, (0, 0), &ElementPattern::None, 1e9, 0.0, one_over_n);
        let k = image(BrightnessUnit::Kelvin, 2.0);
        let (l, m) = (k.grid.l_at(3.0), k.grid.m_at(12.0));
        let n = (1.0 - l * l - m * m).sqrt();
        assert!((seen(&k, true)[[12, 3]] - 2.0 * 4e-4 / n).abs() < 1e-18);
        assert!((seen(&k, false)[[12, 3]] - 2.0 * 4e-4).abs() < 1e-18);
        assert_eq!(seen(&image(BrightnessUnit::JyPerPixel, 2.0), true)[[12, 3]], 2.0);
        let mut beam = image(BrightnessUnit::JyPerBeam, 2.0);
        assert!(check_image(&beam, &[PhaseCenter::unprojected("b")]).is_err());
        beam.beams.push(RestoringBeam { bmaj_rad: 0.06, bmin_rad: 0.04, bpa_rad: 0.0 });
        let cells = 1.133_090_035_456_798 * 3.0 * 2.0;
        assert!((seen(&beam, true)[[12, 3]] - 2.0 / cells).abs() < 1e-14);
    }

    #[test]
    fn frames_that_do_not_match_and_blank_pixels_are_refused() {
        let mut k = image(BrightnessUnit::Kelvin, 2.0);
        let sky = PhaseCenter::sidereal("s", 1.0, 0.5).unwrap();
        assert!(check_image(&k, std::slice::from_ref(&sky)).unwrap_err().to_string().contains("boresight"));
        k.grid.frame = SkyFrame::Sky { ra_rad: 1.0 + std::f64::consts::TAU, dec_rad: 0.5, frame: "icrs".into() };
        check_image(&k, std::slice::from_ref(&sky)).unwrap();
        k.grid.frame = SkyFrame::Sky { ra_rad: 1.001, dec_rad: 0.5, frame: "icrs".into() };
        assert!(check_image(&k, std::slice::from_ref(&sky)).unwrap_err().to_string().contains("arcsec away"));
        k.grid.frame = SkyFrame::Sky { ra_rad: 1.0, dec_rad: 0.5, frame: "fk4".into() };
        assert!(check_image(&k, std::slice::from_ref(&sky)).unwrap_err().to_string().contains("B1950"));
        let old = PhaseCenter { frame: "fk4".into(), ..sky };
        check_image(&k, std::slice::from_ref(&old)).unwrap();
        let mut k = image(BrightnessUnit::Kelvin, 2.0);
        k.data[[0, 0, 4, 7]] = f64::NAN;
        let e = check_image(&k, &[PhaseCenter::unprojected("b")]).unwrap_err().to_string();
        assert!(e.contains("column 7, row 4"), "{e}");
    }

    #[test]
    fn polarisation_products_are_those_of_a_coherency_matrix() {
        use Polarization::{I, LL, LR, Q, RL, RR, U, V, XX, XY, YX, YY};
        // The determinant of the coherency matrix is I^2 - Q^2 - U^2 - V^2 in either basis.
        let stokes = [(I, 2.0), (Q, 0.5), (U, -0.7), (V, 0.3)];
        let product = |p| stokes.iter().map(|(s, x)| stokes_coefficient(*s, p) * *x).sum::<Complex64>();
        let truth = 4.0 - 0.25 - 0.49 - 0.09;
        for (circular, [a, b, c, d]) in [(false, [XX, YY, XY, YX]), (true, [RR, LL, RL, LR])] {
            assert!((product(a) * product(b) - product(c) * product(d) - truth).norm() < 1e-14);
            assert!((product(c) - product(d).conj()).norm() < 1e-15);
            // The same products by the matrices of the feeds.
            let feeds = feed_matrix(circular, false, 0.0);
            let matrix = products(&feeds, &coherency(stokes.map(|s| Complex64::new(s.1, 0.0))), &feeds);
            for (p, (j, k)) in [(a, (0, 0)), (b, (1, 1)), (c, (0, 1)), (d, (1, 0))] {
                assert!((product(p) - matrix[j][k]).norm() < 1e-14, "{p}");
            }
        }
    }
}
