//! Zenithal projections, and the shift of the reference of an image to its centre.

use crate::{FormatError, Result};
use std::path::Path;

/// Zenithal projections by the distance of a point from the reference in the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Projection {
    Sin,
    Tan,
    Arc,
    Stg,
    Zea,
}

impl Projection {
    /// From the last letters of CTYPE, such as `RA---SIN`.
    pub(crate) fn from_ctype(path: &Path, ctype: &str) -> Result<Self> {
        Ok(match ctype.get(5..8).unwrap_or("").trim() {
            // Axes without a code are taken as SIN, which is linear near the centre.
            "SIN" | "" => Self::Sin,
            "TAN" => Self::Tan,
            "ARC" => Self::Arc,
            "STG" => Self::Stg,
            "ZEA" => Self::Zea,
            _ => {
                return Err(FormatError::unsupported(
                    path,
                    format!("CTYPE1 is {ctype:?}: only the projections SIN, TAN, ARC, STG and ZEA are read; reproject the image first"),
                ));
            }
        })
    }

    /// Angle from the reference of a point at distance `r` (rad) in the picture; `None` beyond the edge of the projection.
    ///
    /// # Reference
    /// Calabretta & Greisen 2002, A&A 395, 1077, section 5.1.
    fn angle(self, r: f64) -> Option<f64> {
        Some(match self {
            Self::Sin => (r <= 1.0).then(|| r.asin())?,
            Self::Tan => r.atan(),
            Self::Arc => (r <= std::f64::consts::PI).then_some(r)?,
            Self::Stg => 2.0 * (r / 2.0).atan(),
            Self::Zea => (r <= 2.0).then(|| 2.0 * (r / 2.0).asin())?,
        })
    }

    /// Right ascension and declination of a point (x east, y north, rad) of the picture around a reference.
    pub(crate) fn to_sky(self, x: f64, y: f64, reference: (f64, f64)) -> Option<(f64, f64)> {
        let r = x.hypot(y);
        let angle = self.angle(r)?;
        let (east, north) = if r > 0.0 { (x / r * angle.sin(), y / r * angle.sin()) } else { (0.0, 0.0) };
        let (sin_d0, cos_d0) = reference.1.sin_cos();
        let up = angle.cos();
        let sin_d = north * cos_d0 + up * sin_d0;
        let ra = reference.0 + east.atan2(up * cos_d0 - north * sin_d0);
        Some((ra.rem_euclid(std::f64::consts::TAU), sin_d.clamp(-1.0, 1.0).asin()))
    }
}

/// Direction cosines (l, m) of a place seen from a centre; `None` behind the horizon.
fn direction_cosines(place: (f64, f64), centre: (f64, f64)) -> Option<(f64, f64)> {
    let (sin_d, cos_d) = place.1.sin_cos();
    let (sin_d0, cos_d0) = centre.1.sin_cos();
    let (sin_a, cos_a) = (place.0 - centre.0).sin_cos();
    let n = sin_d * sin_d0 + cos_d * cos_d0 * cos_a;
    (n > 0.0).then_some((cos_d * sin_a, sin_d * cos_d0 - cos_d * sin_d0 * cos_a))
}

/// The sky at column n_l / 2, row n_m / 2 (from 0) of a picture whose reference may be elsewhere and whose projection may not be SIN.
///
/// `reference_pixel` counts from 0; `step` is the (square) cell in rad; columns run to the west, rows to the north.
///
/// # Errors
/// A picture whose corners would be more than a tenth of a cell away from their places on a SIN grid.
pub(crate) fn recentre(
    path: &Path,
    projection: Projection,
    size: (usize, usize),
    reference_pixel: (f64, f64),
    step: f64,
    reference: (f64, f64),
) -> Result<(f64, f64)> {
    let (mid_l, mid_m) = ((size.0 / 2) as f64, (size.1 / 2) as f64);
    let sky = |column: f64, row: f64| projection.to_sky(-(column - reference_pixel.0) * step, (row - reference_pixel.1) * step, reference);
    let refuse = |why: String| {
        FormatError::unsupported(
            path,
            format!("{why}: reproject the image to SIN with the reference pixel at its centre (CRPIX = N/2 + 1)"),
        )
    };
    if projection == Projection::Sin && reference_pixel == (mid_l, mid_m) {
        return Ok(reference);
    }
    let centre = sky(mid_l, mid_m).ok_or_else(|| refuse("the centre of the image lies off the sky".into()))?;
    let (last_l, last_m) = (size.0 as f64 - 1.0, size.1 as f64 - 1.0);
    for (column, row) in [(0.0, 0.0), (last_l, 0.0), (0.0, last_m), (last_l, last_m)] {
        // A corner outside the sky has no direction to compare.
        let Some(place) = sky(column, row) else { continue };
        let (l, m) = direction_cosines(place, centre).unwrap_or((f64::NAN, f64::NAN));
        let off = ((mid_l - l / step) - column).hypot((mid_m + m / step) - row);
        if !(off < 0.1) {
            return Err(refuse(format!(
                "its {projection:?} grid with the reference at pixel ({:.1}, {:.1}) differs from a centred SIN grid by {off:.2} pixels in a corner",
                reference_pixel.0 + 1.0,
                reference_pixel.1 + 1.0
            )));
        }
    }
    Ok(centre)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_half_pixel_shift_moves_the_centre_by_half_a_cell() {
        let step = 1e-5;
        let (ra, dec) = recentre(Path::new("x"), Projection::Tan, (256, 256), (127.5, 127.5), step, (1.0, 0.5)).unwrap();
        assert!((dec - 0.5 - step / 2.0).abs() < 1e-9, "{dec}");
        assert!((ra - 1.0 + step / 2.0 / 0.5_f64.cos()).abs() < 1e-9, "{ra}");
    }

    #[test]
    fn a_wide_tan_field_and_a_far_reference_are_refused() {
        assert!(recentre(Path::new("x"), Projection::Tan, (512, 512), (256.0, 256.0), 1e-3, (1.0, 0.5)).is_err());
        assert!(recentre(Path::new("x"), Projection::Sin, (512, 512), (-9000.0, 0.0), 1e-5, (1.0, 1.2)).is_err());
    }

    #[test]
    fn projecting_and_deprojecting_agree() {
        let centre = (2.0, -0.7);
        let (x, y) = (0.02, -0.013);
        let (l, m) = direction_cosines(Projection::Sin.to_sky(x, y, centre).unwrap(), centre).unwrap();
        assert!((l - x).abs() < 1e-15 && (m - y).abs() < 1e-15, "{l} {m}");
    }
}
