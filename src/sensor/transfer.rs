//! The optical transfer function: the autocorrelation of the pupil, averaged over the band.
//!
//! The field of the pupil is constant in each of its cells, so that its autocorrelation is linear between whole numbers of cells: the values at
//! these, which a Fourier transform gives, are all of it. Its value at 0 is the power of the pupil, and a flat scene keeps its temperature.

use super::pupil::Pupil;
use super::transform::{back, forward};
use ndarray::Array2;
use num_complex::Complex64;

/// Autocorrelation of the pupil at one wavelength, divided by the power \[y, x\], with lag 0 in the middle.
#[derive(Debug)]
struct Lags {
    values: Array2<Complex64>,
    /// Cells for each cycle/rad: the wavelength over the cell.
    cells: f64,
    weight: f64,
}

/// Transfer function of the optics over the band.
#[derive(Debug)]
pub(super) struct Transfer {
    lags: Vec<Lags>,
    cutoff: f64,
}

impl Transfer {
    /// The mean over wavelengths with weights whose sum is 1.
    pub(super) fn new(pupil: &Pupil, paths_m: &Array2<f64>, wavelengths: &[(f64, f64)]) -> Self {
        let flat = paths_m.iter().all(|path| *path == 0.0);
        let mut lags: Vec<Lags> = Vec::new();
        for &(wavelength_m, weight) in wavelengths {
            // Without aberrations the field is the same at all wavelengths.
            let values = match lags.first() {
                Some(first) if flat => first.values.clone(),
                _ => autocorrelation(pupil, &pupil.field(paths_m, wavelength_m)),
            };
            lags.push(Lags { values, cells: wavelength_m / pupil.cell_m, weight });
        }
        let shortest = wavelengths.iter().fold(f64::INFINITY, |a, w| a.min(w.0));
        let mut transfer = Self { lags, cutoff: 0.0 };
        transfer.cutoff = transfer.reach() as f64 * pupil.cell_m / shortest;
        transfer
    }

    /// The largest lag along an axis at which the autocorrelation is not 0, in cells, and one more.
    fn reach(&self) -> usize {
        let Some(first) = self.lags.first() else { return 0 };
        let half = first.values.nrows() / 2;
        let used = first.values.indexed_iter().filter(|(_, v)| v.norm() > 1e-9);
        used.map(|((r, c), _)| r.abs_diff(half).max(c.abs_diff(half))).max().unwrap_or(0) + 1
    }

    /// Spatial frequency along an axis beyond which it is 0, cycles/rad.
    pub(super) fn cutoff(&self) -> f64 {
        self.cutoff
    }

    /// Its value at spatial frequencies along x and y, cycles/rad. A point at the origin has the image whose Fourier transform this is.
    pub(super) fn at(&self, u: f64, v: f64) -> Complex64 {
        self.lags.iter().map(|lags| lags.at(u, v) * lags.weight).sum()
    }
}

impl Lags {
    fn at(&self, u: f64, v: f64) -> Complex64 {
        let half = (self.values.nrows() / 2) as f64;
        let (x, y) = (u * self.cells + half, v * self.cells + half);
        let last = self.values.nrows() as f64 - 1.0;
        if !(x >= 0.0 && y >= 0.0 && x < last && y < last) {
            return Complex64::default();
        }
        let (c, r) = (x as usize, y as usize);
        let (a, b) = (x - c as f64, y - r as f64);
        let line = |r: usize| self.values[[r, c]] * (1.0 - a) + self.values[[r, c + 1]] * a;
        line(r) * (1.0 - b) + line(r + 1) * b
    }
}

/// The sum over the pupil of p(x) p*(x + lag), over the power.
fn autocorrelation(pupil: &Pupil, field: &Array2<Complex64>) -> Array2<Complex64> {
    let n = field.nrows();
    let mut wide = Array2::zeros((2 * n, 2 * n));
    wide.slice_mut(ndarray::s![..n, ..n]).assign(field);
    let mut spectrum = forward(wide);
    spectrum.mapv_inplace(|v| Complex64::from(v.norm_sqr()));
    let lags = back(spectrum);
    // The transform gives the conjugate, from lag 0 on. The edges of cells that are open in part overlap with themselves at lag 0.
    let mut out = Array2::from_shape_fn((2 * n, 2 * n), |(r, c)| lags[[(r + n) % (2 * n), (c + n) % (2 * n)]].conj() / pupil.power);
    out[[n, n]] = Complex64::from(1.0);
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensor::aberrations::Wavefront;
    use crate::sensor::options::{AberrationOptions, PupilOptions};
    use std::f64::consts::PI;

    fn transfer(aperture: &str, blockage: Option<&str>, zernike: &str) -> Transfer {
        let options = PupilOptions {
            aperture: Some(aperture.parse().unwrap()),
            blockage: blockage.map(|b| b.parse().unwrap()),
            ..PupilOptions::default()
        };
        let aberrations = AberrationOptions { zernike: (!zernike.is_empty()).then(|| zernike.parse().unwrap()), ..Default::default() };
        let wave = Wavefront::new(&aberrations, 1e-3).unwrap();
        let pupil = Pupil::new(&options, std::slice::from_ref(&wave), 1e-3).unwrap();
        Transfer::new(&pupil, &pupil.paths_m(&wave), &[(1e-3, 1.0)])
    }

    #[test]
    fn a_circle_and_a_square_have_their_known_transfer_functions() {
        let circle = transfer("circle=1m", None, "");
        for s in [0.02, 0.1, 0.35, 0.7, 0.95] {
            let exact = 2.0 / PI * (f64::acos(s) - s * (1.0 - s * s).sqrt());
            for (x, y) in [(1.0, 0.0), (0.0, -1.0), (0.6, 0.8)] {
                let found = circle.at(s * 1e3 * x, s * 1e3 * y);
                assert!((found.re - exact).abs() < 2e-4 && found.im.abs() < 1e-12, "{s}: {found} {exact}");
            }
        }
        assert!((circle.cutoff() - 1e3).abs() < 10.0 && circle.at(1001.0, 0.0).norm() < 1e-12);
        assert_eq!(circle.at(0.0, 0.0), Complex64::from(1.0));
        let rectangle = transfer("rectangle=1m:0.5m", None, "");
        assert!((rectangle.at(300.0, 200.0).re - 0.7 * 0.6).abs() < 1e-6, "{}", rectangle.at(300.0, 200.0));
    }

    #[test]
    fn aberrations_lower_it_and_keep_its_symmetry() {
        let (ideal, coma) = (transfer("circle=1m", Some("circle=0.3m"), ""), transfer("circle=1m", Some("circle=0.3m"), "8:0.1,5:0.05"));
        for (u, v) in [(100.0, 50.0), (-300.0, 400.0), (7.0, -600.0)] {
            assert!(coma.at(u, v).norm() < ideal.at(u, v).norm());
            assert!((coma.at(u, v) - coma.at(-u, -v).conj()).norm() < 1e-12);
        }
        assert!(coma.at(300.0, 0.0).im.abs() > 1e-3);
    }
}
