//! The path error of the wavefront over the pupil: Zernike polynomials, defocus by range, and coma and astigmatism that grow over the field.

use super::options::AberrationOptions;
use super::zernike::zernike;
use crate::values::need;
use crate::{ChainError, Result};

/// Path error of the wavefront.
#[derive(Debug, Clone, Default)]
pub(super) struct Wavefront {
    /// Coefficients by Noll index, m.
    terms: Vec<(usize, f64)>,
    /// Coma and astigmatism at the edge of the field, m.
    coma_m: f64,
    astigmatism_m: f64,
    /// Difference of the curvatures of the waves from the scene and from the focus, 1/m.
    curvature: f64,
}

impl Wavefront {
    /// # Errors
    /// A range or a focus that is not above 0, or aberrations that are not small numbers of waves.
    pub(super) fn new(options: &AberrationOptions, wavelength_m: f64) -> Result<Self> {
        for (name, length) in [("range", options.range), ("focus", options.focus)] {
            if let Some(length) = length {
                need(name, length, length.si() > 0.0, "a distance above 0")?;
            }
        }
        for (name, waves) in [("coma", options.coma), ("astigmatism", options.astigmatism)] {
            need(name, waves, waves.abs() <= 100.0, "at most 100 waves")?;
        }
        need("field_nodes", options.field_nodes, (2..=33).contains(&options.field_nodes), "2 to 33 places along each axis")?;
        let inverse = |length: Option<cittert_arrays::quantity::Length>| length.map_or(0.0, |length| 1.0 / length.si());
        let focus = inverse(options.focus);
        let terms = options.zernike.iter().flat_map(|list| &list.0).map(|&(index, waves)| (index, waves * wavelength_m)).collect();
        Ok(Self {
            terms,
            coma_m: options.coma * wavelength_m,
            astigmatism_m: options.astigmatism * wavelength_m,
            curvature: options.range.map_or(0.0, |range| 1.0 / range.si() - focus),
        })
    }

    /// True if it depends on the place in the field.
    pub(super) fn varies(&self) -> bool {
        self.coma_m != 0.0 || self.astigmatism_m != 0.0
    }

    /// True if it is 0 everywhere.
    pub(super) fn is_flat(&self) -> bool {
        self.terms.iter().all(|t| t.1 == 0.0) && self.curvature == 0.0 && !self.varies()
    }

    /// The wavefront at a place of the field (x, y), in units of the distance of its nearer edge.
    pub(super) fn at(&self, (x, y): (f64, f64)) -> Self {
        let mut terms = self.terms.clone();
        // Noll 7 and 8 are coma along y and x. 6 and 5 turn by twice the angle: their sum points along (x, y).
        terms.extend([(7, self.coma_m * y), (8, self.coma_m * x)]);
        terms.extend([(6, self.astigmatism_m * (x * x - y * y)), (5, self.astigmatism_m * 2.0 * x * y)]);
        terms.retain(|t| t.1 != 0.0);
        Self { terms, coma_m: 0.0, astigmatism_m: 0.0, curvature: self.curvature }
    }

    /// Path error at a place of the pupil, m. The radius of the pupil is that of the unit disc of the polynomials.
    pub(super) fn path_m(&self, x: f64, y: f64, radius_m: f64) -> f64 {
        let (square, angle) = (x * x + y * y, y.atan2(x));
        let sum: f64 = self.terms.iter().map(|&(index, c)| c * zernike(index, square.sqrt() / radius_m, angle)).sum();
        sum + 0.5 * square * self.curvature
    }
}

/// Refuse a wavefront that is too rough for any sampling of the pupil.
pub(super) fn too_rough(step_waves: f64) -> ChainError {
    ChainError::Incompatible(format!(
        "the aberrations change by {step_waves:.2} waves between neighbouring samples of the pupil, which has 1536 across: give smaller \
         coefficients, or a --range nearer to the --focus"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::quantity::Length;

    #[test]
    fn defocus_is_the_difference_of_the_spheres() {
        let options = AberrationOptions { range: Some(Length(50.0)), focus: Some(Length(100.0)), ..AberrationOptions::default() };
        let wave = Wavefront::new(&options, 3e-3).unwrap();
        let sphere = |r: f64| (r * r + 0.36_f64).sqrt() - r;
        assert!((wave.path_m(0.0, 0.6, 0.6) - (sphere(50.0) - sphere(100.0))).abs() < 1e-6);
        assert!(!wave.is_flat() && Wavefront::new(&AberrationOptions::default(), 3e-3).unwrap().is_flat());
    }

    #[test]
    fn coma_points_away_from_the_centre_and_astigmatism_turns_with_the_field() {
        let options = AberrationOptions { coma: 0.2, astigmatism: 0.1, ..AberrationOptions::default() };
        let wave = Wavefront::new(&options, 1.0).unwrap();
        // The same place of the pupil, seen from the direction of the field, at any direction.
        let turned = |angle: f64| {
            let (sin, cos) = angle.sin_cos();
            let at = wave.at((0.8 * cos, 0.8 * sin));
            at.path_m(0.5 * cos - 0.3 * sin, 0.5 * sin + 0.3 * cos, 1.0)
        };
        assert!((turned(0.0) - turned(0.7)).abs() < 1e-12 && (turned(0.0) - turned(-2.0)).abs() < 1e-12);
        assert!(wave.at((0.0, 0.0)).is_flat() && wave.varies());
    }
}
