//! Richardson-Lucy deconvolution.

use super::border::mean;
use super::psf::{Blur, Psf};
use super::step::{Given, Step};
use crate::{ChainError, Result, ensure};
use ndarray::{Array2, ArrayView2, Zip};

#[derive(Debug)]
struct RichardsonLucy {
    psf: Psf,
    iterations: usize,
}

impl Step for RichardsonLucy {
    fn apply(&self, frame: Array2<f64>) -> Result<Array2<f64>> {
        richardson_lucy(frame.view(), &self.psf, self.iterations)
    }
}

pub(super) fn make(given: &Given<'_>) -> Result<Box<dyn Step>> {
    let psf = given.psf()?;
    psf.check_positive()?;
    Ok(Box::new(RichardsonLucy { psf, iterations: given.whole(0) }))
}

/// The most likely frame without negative values for noise that grows with the brightness (Poisson), approached in `iterations` steps from a flat
/// one. The number of steps decides how far noise is drawn out: 5 to 30 are usual. The sum is kept away from the border.
///
/// # Errors
/// A frame with values below 0.
///
/// # Reference
/// Richardson 1972, J. Opt. Soc. Am. 62, 55; Lucy 1974, AJ 79, 745, eq. 15.
pub fn richardson_lucy(plane: ArrayView2<'_, f64>, psf: &Psf, iterations: usize) -> Result<Array2<f64>> {
    let negative = plane.iter().filter(|v| **v < 0.0).count();
    ensure!(
        negative == 0,
        ChainError::Incompatible(format!(
            "{negative} of {} pixels are below 0, which richardson-lucy cannot explain: use wiener-deconvolution",
            plane.len()
        ))
    );
    let blur = Blur::new(psf, plane.dim());
    let mut out = Array2::from_elem(plane.dim(), mean(plane));
    for _ in 0..iterations {
        let mut ratio = blur.forward(&out);
        Zip::from(&mut ratio).and(&plane).for_each(|r, seen| *r = if *r > 0.0 { seen / *r } else { 0.0 });
        // The rounding of the transform may lead below 0 where all light is gone.
        Zip::from(&mut out).and(&blur.back(&ratio)).for_each(|o, c| *o *= c.max(0.0));
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::array;

    fn psf() -> Psf {
        Psf::new(array![[0.5, 1.0, 0.5], [1.0, 2.0, 1.0], [0.5, 1.0, 0.5]].view(), 1.0).unwrap()
    }

    #[test]
    fn two_points_that_ran_together_come_apart_and_the_sum_is_kept() {
        let mut truth = Array2::from_elem((32, 32), 1.0);
        truth[[16, 14]] = 200.0;
        truth[[16, 17]] = 100.0;
        let seen = Blur::new(&psf(), truth.dim()).forward(&truth);
        let out = richardson_lucy(seen.view(), &psf(), 200).unwrap();
        assert!(out[[16, 14]] > 180.0 && out[[16, 17]] > 90.0 && out[[16, 16]] < 12.0, "{}", out.row(16));
        assert!((out.sum() / truth.sum() - 1.0).abs() < 1e-9);
        assert!(seen[[16, 14]] < 70.0);
    }

    #[test]
    fn a_flat_frame_stays_and_values_below_0_are_refused() {
        let flat = Array2::from_elem((20, 24), 290.0);
        assert!(richardson_lucy(flat.view(), &psf(), 10).unwrap().iter().all(|v| (v - 290.0).abs() < 1e-9));
        let e = richardson_lucy(array![[1.0, -1.0]].view(), &psf(), 1).unwrap_err().to_string();
        assert!(e.contains("1 of 2 pixels") && e.contains("wiener-deconvolution"), "{e}");
    }
}
