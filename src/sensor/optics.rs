//! The optics: pupil and wavefront over the band.

use super::aberrations::Wavefront;
use super::options::SensorOptions;
use super::pupil::Pupil;
use super::response::sinc;
use super::transfer::Transfer;
use crate::linalg::gauss_legendre;
use crate::values::need;
use crate::{Result, ensure};
use cittert_arrays::SPEED_OF_LIGHT_M_S;
use cittert_arrays::SpectralWindow;
use ndarray::Array2;
use num_complex::Complex64;

/// Received band.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Band {
    /// Centre, Hz.
    pub freq_hz: f64,
    /// Width, Hz.
    pub bandwidth_hz: f64,
}

/// Pupil and wavefront over the band.
#[derive(Debug)]
pub struct Optics {
    pupil: Pupil,
    wave: Wavefront,
    band: Band,
    /// Wavelengths in m, and weights whose sum is 1.
    wavelengths: Vec<(f64, f64)>,
}

impl Optics {
    /// The optics for images of this spectrum.
    ///
    /// # Errors
    /// An option that is outside of its range, or options that do not go together.
    pub fn new(options: &SensorOptions, spectrum: &SpectralWindow) -> Result<Self> {
        let freq_hz = options.band.freq.map_or(spectrum.mean_hz(), |f| f.si());
        let bandwidth_hz = options.band.bandwidth.map_or(spectrum.extent_hz(), |b| b.si());
        need("freq", format!("{freq_hz} Hz"), freq_hz > 0.0, "a frequency above 0Hz, which the image does not have")?;
        let good = (0.0..2.0 * freq_hz).contains(&bandwidth_hz);
        need("bandwidth", format!("{bandwidth_hz} Hz"), good, "a width from 0Hz to below twice the frequency")?;
        let count = options.band.frequencies;
        need("frequencies", count, (1..=64).contains(&count), "1 to 64")?;
        let nodes = gauss_legendre(if bandwidth_hz == 0.0 { 1 } else { count });
        let wavelengths: Vec<_> = nodes.iter().map(|(x, w)| (SPEED_OF_LIGHT_M_S / (freq_hz + 0.5 * bandwidth_hz * x), 0.5 * w)).collect();
        let center_m = SPEED_OF_LIGHT_M_S / freq_hz;
        let wave = Wavefront::new(&options.aberrations, center_m)?;
        // The sampling of the pupil suits the centre of the field and its edges.
        let edges = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)].map(|place| wave.at(place));
        let shortest = wavelengths.iter().fold(f64::INFINITY, |a, w| a.min(w.0));
        let waves = if wave.varies() { &edges[..] } else { &edges[..1] };
        let pupil = Pupil::new(&options.pupil, waves, shortest)?;
        ensure!(pupil.power > 0.0, crate::ChainError::Internal("a pupil without power".into()));
        Ok(Self { pupil, wave, band: Band { freq_hz, bandwidth_hz }, wavelengths })
    }

    /// The received band.
    #[must_use]
    pub fn band(&self) -> Band {
        self.band
    }

    /// Open area of the pupil, m^2.
    #[must_use]
    pub fn area_m2(&self) -> f64 {
        self.pupil.area_m2
    }

    /// True if the PSF depends on the place in the field.
    pub(super) fn varies(&self) -> bool {
        self.wave.varies()
    }

    /// Transfer function at a place of the field, in units of the distance of its nearer edge.
    pub(super) fn transfer(&self, place: (f64, f64)) -> Transfer {
        Transfer::new(&self.pupil, &self.pupil.paths_m(&self.wave.at(place)), &self.wavelengths)
    }

    /// PSF of the optics at a place of the field, as a density in 1/sr \[m, l\]: `n` x `n` values at multiples of `cell_rad` around the pixel
    /// n / 2. Its integral over all directions is 1. The field of view of the pupil's cells limits it to directions well within wavelength / cell.
    ///
    /// # Reference
    /// Soummer et al. 2007, Opt. Express 15, 15935 (the Fourier transform as two products of matrices, at any sampling).
    #[must_use]
    pub fn psf(&self, place: (f64, f64), cell_rad: f64, n: usize) -> Array2<f64> {
        self.density(&self.wave.at(place), cell_rad, n)
    }

    fn density(&self, wave: &Wavefront, cell_rad: f64, n: usize) -> Array2<f64> {
        let paths = self.pupil.paths_m(wave);
        let (cells, d) = (self.pupil.cells(), self.pupil.cell_m);
        let mut out = Array2::zeros((n, n));
        for &(wavelength, weight) in &self.wavelengths {
            // The transform of a cell is a sinc; with it, the energy of all directions is the power of the pupil.
            let wave = Array2::from_shape_fn((n, cells), |(k, j)| {
                let cycles = (k as f64 - (n / 2) as f64) * cell_rad * d / wavelength;
                let place = j as f64 + 0.5 - 0.5 * cells as f64;
                Complex64::cis(-std::f64::consts::TAU * cycles * place) * sinc(cycles)
            });
            let field = wave.dot(&self.pupil.field(&paths, wavelength)).dot(&wave.t());
            let scale = weight * d * d / (wavelength * wavelength * self.pupil.power);
            out.zip_mut_with(&field, |o, e| *o += scale * e.norm_sqr());
        }
        out
    }

    /// Strehl ratio at a place of the field: the PSF at its centre over that without aberrations.
    #[must_use]
    pub fn strehl(&self, place: (f64, f64)) -> f64 {
        let at_center = |wave: &Wavefront| self.density(wave, 1e-9, 1)[[0, 0]];
        at_center(&self.wave.at(place)) / at_center(&Wavefront::default())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    const WAVELENGTH: f64 = SPEED_OF_LIGHT_M_S / 94e9;

    fn optics(pupil: &[(&str, &str)], zernike: &str, bandwidth_hz: f64) -> Optics {
        let mut options = SensorOptions::default();
        for (key, text) in pupil {
            match *key {
                "aperture" => options.pupil.aperture = Some(text.parse().unwrap()),
                "blockage" => options.pupil.blockage = Some(text.parse().unwrap()),
                _ => options.pupil.taper = text.parse().unwrap(),
            }
        }
        options.aberrations.zernike = (!zernike.is_empty()).then(|| zernike.parse().unwrap());
        options.band.bandwidth = Some(cittert_arrays::quantity::Frequency(bandwidth_hz));
        Optics::new(&options, &SpectralWindow::band(94e9, 1e9, 1).unwrap()).unwrap()
    }

    /// Bessel function by its integral, whose trapezoidal sum is exact to rounding.
    fn j1(x: f64) -> f64 {
        let angles = (1..200).map(|k| PI * f64::from(k) / 200.0);
        angles.map(|t| (t - x * t.sin()).cos()).sum::<f64>() / 200.0
    }

    fn airy(x: f64) -> f64 {
        if x == 0.0 { 1.0 } else { 2.0 * j1(x) / x }
    }

    #[test]
    fn a_circle_has_the_airy_pattern_and_a_ring_its_own() {
        let cell = 0.1 * WAVELENGTH;
        let angle = |r: usize, c: usize| PI * ((r as f64 - 100.0).hypot(c as f64 - 100.0)) * 0.1;
        let circle = optics(&[("aperture", "circle=1m")], "", 0.0).psf((0.0, 0.0), cell, 200);
        let ring = optics(&[("aperture", "circle=1m"), ("blockage", "circle=0.4m")], "", 0.0).psf((0.0, 0.0), cell, 200);
        let peaks = [circle[[100, 100]], ring[[100, 100]]];
        assert!((peaks[0] / (PI / 4.0 / (WAVELENGTH * WAVELENGTH)) - 1.0).abs() < 1e-4);
        for r in 0..200 {
            for c in 0..200 {
                let x = angle(r, c);
                let exact = [airy(x).powi(2), ((airy(x) - 0.16 * airy(0.4 * x)) / 0.84).powi(2)];
                for (plane, (peak, exact)) in [&circle, &ring].into_iter().zip(peaks.into_iter().zip(exact)) {
                    assert!((plane[[r, c]] / peak - exact).abs() < 2e-5, "{r} {c}: {} {exact}", plane[[r, c]] / peak);
                }
            }
        }
        // The first dark ring at 1.22 and the first bright ring of 1.75 %, within 1 %.
        let fine = optics(&[("aperture", "circle=1m")], "", 0.0).psf((0.0, 0.0), 0.02 * WAVELENGTH, 200);
        let row: Vec<f64> = (100..200).map(|c| fine[[100, c]] / peaks[0]).collect();
        let bright = row[62..].iter().fold(0.0_f64, |a, v| a.max(*v));
        let dark = (40..80).min_by(|a, b| row[*a].total_cmp(&row[*b])).unwrap();
        assert!((bright / 0.017_498 - 1.0).abs() < 0.01 && dark == 61, "{bright} {dark}");
    }

    #[test]
    fn small_aberrations_have_the_strehl_ratio_of_marechal() {
        for zernike in ["4:0.05", "6:0.04,5:-0.03", "8:0.05", "11:0.03,7:0.02,13:-0.02", "22:0.04"] {
            let sum: f64 = zernike.split(',').map(|t| t.split_once(':').unwrap().1.parse::<f64>().unwrap().powi(2)).sum();
            let expected = (-(std::f64::consts::TAU.powi(2)) * sum).exp();
            let found = optics(&[("aperture", "circle=1m")], zernike, 0.0).strehl((0.0, 0.0));
            assert!((found / expected - 1.0).abs() < 0.01, "{zernike}: {found} {expected}");
        }
    }

    #[test]
    fn the_energy_is_1_at_any_sampling_and_over_the_band() {
        let cell = 0.25 * WAVELENGTH;
        let sum = |height: f64, n: usize, taper, zernike, bandwidth| {
            let optics = optics(&[("aperture", &format!("rectangle=1m:{height}m")), ("taper", taper)], zernike, bandwidth);
            optics.psf((0.0, 0.0), cell, n).sum() * cell * cell
        };
        // A slit has 1 / (pi^2 x) of its energy beyond x wavelengths over its width. The edges of the second one lie inside of cells, which spread
        // them: it has its wings nearer to the axis.
        let inside = |height: f64, n: usize| (1.0 - 8.0 / (PI * PI * n as f64)) * (1.0 - 8.0 / (PI * PI * n as f64 * height));
        for (height, n, tolerance) in [(0.75, 600, 5e-5), (0.7, 150, 5e-4)] {
            for (zernike, bandwidth) in [("", 0.0), ("", 16e9), ("7:0.2,5:0.1", 8e9)] {
                // Aberrations move energy to where the wave is steep.
                let tolerance = if zernike.is_empty() { tolerance } else { 5e-4 };
                let found = sum(height, n, "uniform", zernike, bandwidth);
                assert!((found - inside(height, n)).abs() < tolerance, "{height} {zernike} {bandwidth}: {found} {}", inside(height, n));
            }
        }
        let tapered = sum(0.75, 600, "gaussian=10", "", 0.0);
        assert!(tapered > inside(0.75, 600) && tapered < 1.0, "{tapered}");
    }

    #[test]
    fn a_taper_widens_the_beam_and_lowers_the_side_lobes() {
        let cell = 0.02 * WAVELENGTH;
        let cut = |taper| {
            let psf = optics(&[("aperture", "circle=1m"), ("taper", taper)], "", 0.0).psf((0.0, 0.0), cell, 600);
            let row: Vec<f64> = (300..600).map(|c| psf[[300, c]] / psf[[300, 300]]).collect();
            let half = row.iter().position(|v| *v < 0.5).unwrap();
            let dark = row.windows(2).position(|w| w[1] > w[0]).unwrap();
            (half, row[dark..].iter().fold(0.0_f64, |a, v| a.max(*v)))
        };
        let (flat, tapered) = (cut("uniform"), cut("gaussian=15"));
        assert!(tapered.0 > flat.0 && tapered.1 < 0.35 * flat.1, "{flat:?} {tapered:?}");
        // A parabola to the power 1 without pedestal: the first side lobe is -24.6 dB (Balanis, table 12-1).
        let parabola = cut("parabola=100:1");
        assert!((10.0 * parabola.1.log10() + 24.6).abs() < 0.1, "{parabola:?}");
    }
}
