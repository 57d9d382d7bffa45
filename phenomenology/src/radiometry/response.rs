//! Reflection and emission at one angle, and how finely they are tabulated for mirrors.

/// Temperature of the radiation for which an error of a reflectivity is counted in kelvins.
pub(super) const KELVIN: f64 = 300.0;
/// First and largest number of intervals of the table of a mirror. The largest number is never reached with a tolerance of 1e-3 K.
pub(super) const MIRROR_ANGLES: (usize, usize) = (128, 1 << 15);
/// Reflection and emission of a surface at one angle of incidence. Temperatures are Rayleigh-Jeans temperatures in K.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Response {
    /// Power reflectivity along the mirror ray, h and v.
    pub power: [f64; 2],
    /// Real and imaginary part of `r_v` times the conjugate of `r_h`.
    pub cross: [f64; 2],
    /// Emitted temperature, h and v, RJ, K.
    pub emitted_k: [f64; 2],
}

impl Response {
    pub(super) fn of(row: &[f64]) -> Self {
        Self { power: [row[0], row[1]], cross: [row[2], row[3]], emitted_k: [row[4], row[5]] }
    }
}
