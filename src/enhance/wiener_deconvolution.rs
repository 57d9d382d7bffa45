//! Wiener deconvolution.

use super::border::{by_rows, line, mean};
use super::psf::{Psf, mirrored};
use super::step::{Given, Step};
use crate::Result;
use cittert_fourier_planner::{FftDirection, along};
use ndarray::{Array2, ArrayView2, Zip};
use num_complex::Complex64;

#[derive(Debug)]
struct Deconvolution {
    psf: Psf,
    noise: f64,
}

impl Step for Deconvolution {
    fn apply(&self, frame: Array2<f64>) -> Result<Array2<f64>> {
        Ok(wiener_deconvolution(frame.view(), &self.psf, self.noise))
    }
}

pub(super) fn make(given: &Given<'_>) -> Result<Box<dyn Step>> {
    Ok(Box::new(Deconvolution { psf: given.psf()?, noise: given.number(0) }))
}

/// Divide the spectrum of the frame by that of the PSF, H, where the signal stands above the noise: the spectrum is multiplied by
/// conj(H) / (|H|^2 + `noise`). `noise` is the power of the noise over that of the scene, the same at all frequencies. The mean is
/// kept: the filter acts on the differences from it. The frame is continued by its mirror images.
///
/// # Reference
/// Wiener 1949, Extrapolation, Interpolation and Smoothing of Stationary Time Series; Gonzalez & Woods 2018, Digital Image Processing, 4th ed.,
/// section 5.8.
#[must_use]
pub fn wiener_deconvolution(plane: ArrayView2<'_, f64>, psf: &Psf, noise: f64) -> Array2<f64> {
    let (n_m, n_l) = plane.dim();
    let level = mean(plane);
    let transform = |real: Array2<f64>| {
        let mut z = real.mapv(Complex64::from);
        along(&mut z, 1, FftDirection::Forward);
        along(&mut z, 0, FftDirection::Forward);
        z
    };
    let mut z = transform(mirrored(plane.mapv(|v| v - level).view()));
    Zip::from(&mut z).and(&transform(psf.wrapped(2 * n_m, 2 * n_l))).for_each(|v, h| *v *= h.conj() / (h.norm_sqr() + noise));
    along(&mut z, 0, FftDirection::Inverse);
    along(&mut z, 1, FftDirection::Inverse);
    let scale = 1.0 / (4 * n_m * n_l) as f64;
    let real = z.mapv(|v| v.re);
    by_rows((n_m, n_l), |r, out| out.iter_mut().zip(line(&real, r)).for_each(|(o, v)| *o = level + scale * v))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::enhance::psf::Blur;
    use crate::enhance::samples::{noise, rms};

    #[test]
    fn a_blurred_frame_without_noise_comes_back_with_its_mean() {
        let psf = Psf::new(Array2::from_shape_fn((5, 5), |(r, c)| if (r, c) == (2, 2) { 2.0 } else { 0.04 }).view(), 1.0).unwrap();
        let truth = noise(40, 31, 14) + 280.0;
        let seen = Blur::new(&psf, truth.dim()).forward(&truth);
        let out = wiener_deconvolution(seen.view(), &psf, 1e-12);
        assert!(rms(&out - &truth) < 1e-8 && rms(&seen - &truth) > 0.2, "{}", rms(&out - &truth));
        let strong = wiener_deconvolution(seen.view(), &psf, 1.0);
        assert!((strong.mean().unwrap() - seen.mean().unwrap()).abs() < 1e-10);
    }
}
