//! Figures of a sensor: modulation transfer functions, ensquared energy and widths of the PSF.

use super::camera::Sensor;
use super::response::{Path, Response, sinc};
use ndarray::Array2;
use num_complex::Complex64;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Modulation at one spatial frequency, along the columns and along the rows of the image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Modulation {
    /// Spatial frequency, cycles/rad.
    pub frequency: f64,
    /// Of the optics.
    pub optics: [f64; 2],
    /// Of the footprint of a detector.
    pub footprint: [f64; 2],
    /// Of the motion during a sample.
    pub motion: [f64; 2],
}

impl Modulation {
    /// Of all together.
    #[must_use]
    pub fn total(&self) -> [f64; 2] {
        [0, 1].map(|k| self.optics[k] * self.footprint[k] * self.motion[k])
    }
}

/// Energy in a square around the centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ensquared {
    /// Side of the square, rad.
    pub width_rad: f64,
    /// Part of the energy of the PSF of the optics.
    pub optics: f64,
    /// Part of the energy of the PSF with footprint and motion.
    pub total: f64,
}

/// Real parts of a transfer function at evenly spaced frequencies \[v, u\] from -cutoff to cutoff. The imaginary parts belong to what is odd in the
/// PSF, and a square around the centre and a cut through it have none of that in common.
struct Spectrum {
    values: Array2<Complex64>,
    step: f64,
}

/// Frequencies on each side. The PSF repeats after so many widths of its finest detail.
const SIDE: usize = 256;

impl Spectrum {
    fn new(cutoff: f64, at: impl Fn(f64, f64) -> Complex64 + Sync) -> Self {
        let (n, step) = (2 * SIDE + 1, cutoff / SIDE as f64);
        let frequency = |k: usize| (k as f64 - SIDE as f64) * step;
        let rows: Vec<Complex64> =
            (0..n).into_par_iter().flat_map_iter(|r| (0..n).map(|c| at(frequency(c), frequency(r))).collect::<Vec<_>>()).collect();
        Self { values: Array2::from_shape_vec((n, n), rows).unwrap_or_default(), step }
    }

    /// Energy in a square of this width.
    fn ensquared(&self, width: f64) -> f64 {
        let weights: Vec<f64> = (0..self.values.nrows()).map(|k| sinc((k as f64 - SIDE as f64) * self.step * width)).collect();
        let row =
            |(values, w): (ndarray::ArrayView1<'_, Complex64>, &f64)| w * values.iter().zip(&weights).map(|(v, w)| v.re * w).sum::<f64>();
        let sum: f64 = self.values.rows().into_iter().zip(&weights).map(row).sum();
        sum * (width * self.step).powi(2)
    }

    /// Full width at half of the largest value of the cut through the centre along the columns or the rows, rad.
    fn width(&self, along_rows: bool) -> f64 {
        let line: Vec<Complex64> =
            (0..self.values.nrows()).map(|k| if along_rows { self.values.row(k).sum() } else { self.values.column(k).sum() }).collect();
        let cut = |x: f64| -> f64 {
            let term = |(k, v): (usize, &Complex64)| (v * Complex64::cis(TAU * (k as f64 - SIDE as f64) * self.step * x)).re;
            line.iter().enumerate().map(term).sum()
        };
        let finest = 1.0 / (SIDE as f64 * self.step);
        let (reach, step) = (60 * 16, finest / 16.0);
        let values: Vec<f64> = (-reach..=reach).map(|k| cut(f64::from(k) * step)).collect();
        let top = (0..values.len()).max_by(|a, b| values[*a].total_cmp(&values[*b])).unwrap_or(0);
        let half = 0.5 * values[top];
        // Where the cut falls through the half, between two values.
        let side = |mut walk: Box<dyn Iterator<Item = usize>>| {
            let mut last = top;
            walk.find_map(|k| {
                let crossed = values[k] <= half;
                let place = last.abs_diff(top) as f64 + (values[last] - half) / (values[last] - values[k]);
                last = k;
                crossed.then_some(place)
            })
        };
        let right = side(Box::new(top + 1..values.len())).unwrap_or(f64::NAN);
        let left = side(Box::new((0..top).rev())).unwrap_or(f64::NAN);
        (left + right) * step
    }
}

impl Sensor {
    /// Modulation at `n` frequencies from 0 to the cutoff of the optics, in the middle of the field.
    #[must_use]
    pub fn modulation(&self, n: usize) -> Vec<Modulation> {
        let cutoff = self.response().optics.cutoff();
        (0..n).map(|k| self.modulation_at(cutoff * k as f64 / (n - 1).max(1) as f64)).collect()
    }

    /// Modulation at a spatial frequency in cycles/rad, in the middle of the field.
    #[must_use]
    pub fn modulation_at(&self, frequency: f64) -> Modulation {
        let along = [(frequency, 0.0), (0.0, frequency)];
        let path = |path: Path| along.map(|(u, v)| path.at(u, v).abs());
        let [across, down] = self.footprint();
        let footprint = [path(across)[0], path(down)[1]];
        Modulation { frequency, optics: along.map(|(u, v)| self.response().optics.at(u, v).norm()), footprint, motion: path(self.smear()) }
    }

    /// Energy in squares of these widths in rad around the centre of the PSF, in the middle of the field.
    #[must_use]
    pub fn ensquared(&self, widths_rad: &[f64]) -> Vec<Ensquared> {
        let [optics, total] = spectra(self.response());
        let one = |&width_rad: &f64| Ensquared { width_rad, optics: optics.ensquared(width_rad), total: total.ensquared(width_rad) };
        widths_rad.par_iter().map(one).collect()
    }

    /// Full widths at half maximum along columns and rows in the middle of the field: of the PSF of the optics, and of that with footprint and
    /// motion, rad.
    #[must_use]
    pub fn widths_rad(&self) -> [[f64; 2]; 2] {
        spectra(self.response()).map(|spectrum| [spectrum.width(false), spectrum.width(true)])
    }

    /// Spatial frequency beyond which the optics pass nothing, cycles/rad.
    #[must_use]
    pub fn cutoff(&self) -> f64 {
        self.response().optics.cutoff()
    }
}

fn spectra(response: &Response) -> [Spectrum; 2] {
    let cutoff = response.optics.cutoff();
    [Spectrum::new(cutoff, |u, v| response.optics.at(u, v)), Spectrum::new(cutoff, |u, v| response.at(u, v))]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensor::SensorOptions;
    use cittert_arrays::quantity::{Angle, Frequency};
    use cittert_arrays::{SPEED_OF_LIGHT_M_S, SkyFrame, SkyGrid, SpectralWindow};

    const WAVELENGTH: f64 = SPEED_OF_LIGHT_M_S / 94e9;

    fn sensor(aperture: &str, footprint: f64) -> Sensor {
        let mut options = SensorOptions::default();
        options.pupil.aperture = Some(aperture.parse().unwrap());
        options.band.bandwidth = Some(Frequency(0.0));
        options.scan.footprint = Some(Angle(footprint));
        let grid = SkyGrid::new(32, 32, 1e-3, SkyFrame::Boresight).unwrap();
        Sensor::new(&options, &grid, &SpectralWindow::band(94e9, 1e9, 1).unwrap()).unwrap()
    }

    #[test]
    fn a_circle_has_its_width_and_its_energy_in_squares() {
        let sensor = sensor("circle=1m", 0.0);
        let [optics, total] = sensor.widths_rad();
        for width in [optics, total].concat() {
            assert!((width / (1.028_99 * WAVELENGTH) - 1.0).abs() < 1e-3, "{}", width / WAVELENGTH);
        }
        // The same energy as the sum over a fine PSF.
        let cell = 0.02 * WAVELENGTH;
        let psf = sensor.optics().psf((0.0, 0.0), cell, 400);
        for half in [20_usize, 50, 120] {
            let inside = psf.slice(ndarray::s![200 - half..=200 + half, 200 - half..=200 + half]).sum() * cell * cell;
            let found = sensor.ensquared(&[(2 * half + 1) as f64 * cell])[0];
            assert!((found.optics / inside - 1.0).abs() < 1e-3 && found.optics == found.total, "{half}: {found:?} {inside}");
        }
        let all = sensor.ensquared(&[60.0 * WAVELENGTH])[0].optics;
        assert!(all > 0.985 && all < 1.0, "{all}");
    }

    #[test]
    fn the_modulation_of_a_square_aperture_and_detector_is_known() {
        let sensor = sensor("rectangle=1m:0.5m", 2.0 * WAVELENGTH);
        for m in sensor.modulation(41) {
            let s = m.frequency * WAVELENGTH;
            let exact = [(1.0 - s).max(0.0), (1.0 - 2.0 * s).max(0.0)];
            for (k, exact) in exact.into_iter().enumerate() {
                assert!((m.optics[k] - exact).abs() < 1e-4, "{m:?}");
                let x = std::f64::consts::TAU * s;
                let box_of = if x == 0.0 { 1.0 } else { (x.sin() / x).abs() };
                assert!((m.footprint[k] - box_of).abs() < 1e-6 && m.motion[k] == 1.0, "{m:?}");
                assert!((m.total()[k] - m.optics[k] * box_of).abs() < 1e-6);
            }
        }
    }
}
