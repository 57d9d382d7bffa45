//! Antenna rows along a ray. A hit turns a row to the plane of incidence, and a reflection multiplies it.
//!
//! No angle is computed: a turn is held as the cosine and sine of twice its angle. A test compares the result with products of Mueller
//! matrices.

use crate::radiometry::Response;
use crate::space::Vec3;

/// A turn of the polarisation reference by `psi`, as cosine and sine of twice the angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Turn {
    cos: f64,
    sin: f64,
}

/// The h direction of the plane of incidence, and the turn from the reference to it. `None` at normal incidence, where there is no plane.
#[inline]
pub(super) fn local_frame(direction: Vec3, normal: Vec3, reference: Vec3) -> Option<(Vec3, Turn)> {
    let k = -direction;
    let across = k.cross(normal);
    let size = across.norm();
    if size < 1e-12 {
        return None;
    }
    let local = across * (1.0 / size);
    let (c, s) = (local.dot(reference), local.dot(reference.cross(k)));
    Some((local, Turn { cos: c * c - s * s, sin: 2.0 * c * s }))
}

/// Turns a row.
#[inline]
pub(super) fn turn(row: &mut [f64; 4], by: Turn) {
    let (q, u) = (row[1], row[2]);
    row[1] = q * by.cos - u * by.sin;
    row[2] = q * by.sin + u * by.cos;
}

/// The antenna temperature of radiation with temperatures `[h, v]`.
#[inline]
pub(super) fn polarised(row: &[f64; 4], [h, v]: [f64; 2]) -> f64 {
    row[0] * (v + h) + row[1] * (v - h)
}

/// Multiplies a row by the Mueller matrix of a reflection.
#[inline]
pub(super) fn reflect(row: &mut [f64; 4], r: &Response) {
    let (a, b) = (0.5 * (r.power[1] + r.power[0]), 0.5 * (r.power[1] - r.power[0]));
    let [re, im] = r.cross;
    let [i, q, u, v] = *row;
    *row = [i * a + q * b, i * b + q * a, u * re - v * im, u * im + v * re];
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surfaces::fresnel;
    use crate::surfaces::stokes_tests::{AntennaPolarisation, PolarisedRay};
    use num_complex::Complex64;

    #[test]
    fn agrees_with_the_plain_algebra() {
        let mut plain = PolarisedRay::from_antenna([0.36, 0.48, -0.8], [1.0, 0.0, 0.2], AntennaPolarisation::V).unwrap();
        let mut row = plain.weight;
        let mut direction = Vec3::from(plain.direction);
        let mut reference = Vec3::from(plain.reference_h);
        for n in [[0.1, 0.2, 1.0], [-0.7, -0.3, -0.2], [0.2, -0.9, 0.5]] {
            let normal = Vec3::from(n).unit();
            let normal = if normal.dot(direction) > 0.0 { -normal } else { normal };
            let r = fresnel(Complex64::new(5.0, -3.0), (-normal.dot(direction)).acos()).unwrap();
            plain.reflect(normal.to_array(), &r);
            let (local, by) = local_frame(direction, normal, reference).unwrap();
            turn(&mut row, by);
            let response = Response { power: r.powers(), cross: [r.cross.re, r.cross.im], emitted_k: [0.0; 2] };
            reflect(&mut row, &response);
            reference = local;
            direction = direction.mirrored(normal);
            for (a, b) in row.iter().zip(plain.weight) {
                assert!((a - b).abs() < 1e-14, "{a} {b}");
            }
        }
    }
}
