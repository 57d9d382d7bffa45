//! What an image still lacks to a coarser, common resolution.

use super::convolve::convolve;
use crate::values::need;
use crate::{ChainError, Result};
use cittert_arrays::quantity::Angle;
use cittert_arrays::{RestoringBeam, SkyGrid};
use ndarray::{Array2, ArrayView2};
use std::f64::consts::{FRAC_PI_2, PI};

/// Narrowest Gaussian that pixels can hold, in cells of the image: a narrower one would fall between them.
const NARROWEST_CELLS: f64 = 1.0;

/// The Gaussian that brings an image with this beam, or without one, to a round beam of a full width at half maximum in rad. The squares of the widths add
/// along each axis.
///
/// # Errors
/// A width that is not positive, or so little above that of the beam that pixels cannot hold the difference.
pub(super) fn missing(own: Option<&RestoringBeam>, fwhm_rad: f64, cell_rad: f64) -> Result<RestoringBeam> {
    let (major, minor, pa) = own.map_or((0.0, 0.0, 0.0), |b| (b.bmaj_rad, b.bmin_rad, b.bpa_rad));
    need("resolution", Angle(fwhm_rad), fwhm_rad.is_finite() && fwhm_rad > 0.0, "a positive angle")?;
    let lacks = |width: f64| (fwhm_rad * fwhm_rad - width * width).max(0.0).sqrt();
    let narrowest = NARROWEST_CELLS * cell_rad;
    if lacks(major) < narrowest {
        let least = Angle(major.hypot(narrowest));
        return Err(ChainError::bad_option(
            "resolution",
            Angle(fwhm_rad),
            format!("at least {least:.4} for an image with this beam and these pixels"),
        ));
    }
    // Where the beam is long, little is missing.
    let turned = pa + FRAC_PI_2;
    Ok(RestoringBeam { bmaj_rad: lacks(minor), bmin_rad: lacks(major), bpa_rad: if turned > FRAC_PI_2 { turned - PI } else { turned } })
}

/// A plane convolved with a beam, over what of the beam lies in the frame: the brightness at the edge of the frame does not fall.
///
/// # Errors
/// As [`convolve`].
pub(super) fn smooth(plane: ArrayView2<'_, f64>, grid: &SkyGrid, beam: &RestoringBeam) -> Result<Array2<f64>> {
    let inside = convolve(Array2::ones(plane.dim()).view(), grid, beam)?;
    Ok(convolve(plane, grid, beam)? / inside)
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::SkyFrame;

    #[test]
    fn an_image_with_a_beam_and_its_truth_meet_at_the_common_resolution() {
        let grid = SkyGrid::new(96, 96, 1e-3, SkyFrame::Boresight).unwrap();
        let mut truth = Array2::zeros((96, 96));
        for (row, column, value) in [(40, 44, 3.0), (52, 50, 1.0), (47, 60, 2.0)] {
            truth[[row, column]] = value;
        }
        for pa in [0.0, 0.7, -1.2] {
            let own = RestoringBeam { bmaj_rad: 6e-3, bmin_rad: 4e-3, bpa_rad: pa };
            let image = convolve(truth.view(), &grid, &own).unwrap();
            let fwhm = 7.5e-3;
            let found = convolve(image.view(), &grid, &missing(Some(&own), fwhm, 1e-3).unwrap()).unwrap();
            let round = missing(None, fwhm, 1e-3).unwrap();
            assert!(round.bmaj_rad == fwhm && round.bmin_rad == fwhm);
            let wanted = convolve(truth.view(), &grid, &round).unwrap();
            let peak = wanted.iter().copied().fold(0.0, f64::max);
            let worst = (&found - &wanted).iter().fold(0.0_f64, |w, v| w.max(v.abs()));
            assert!(worst < 2e-3 * peak, "{pa}: {worst} of {peak}");
            let flat = smooth(Array2::from_elem((96, 96), 270.0).view(), &grid, &round).unwrap();
            assert!(flat.iter().all(|v| (v - 270.0).abs() < 1e-9));
        }
    }

    #[test]
    fn a_resolution_that_pixels_cannot_hold_is_refused() {
        let own = RestoringBeam { bmaj_rad: 6e-3, bmin_rad: 4e-3, bpa_rad: 0.0 };
        for fwhm in [5e-3, 6e-3, 6.05e-3, f64::NAN, 0.0] {
            assert!(missing(Some(&own), fwhm, 1e-3).unwrap_err().to_string().contains("resolution"), "{fwhm}");
        }
    }
}
