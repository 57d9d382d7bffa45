//! Zernike polynomials on the unit disc, in the order and with the norm of Noll: the mean of each square over the disc is 1, so that a
//! coefficient is the root mean square of its part of the wavefront.

/// The largest index: all polynomials to degree 20.
pub(super) const LARGEST: usize = 231;

/// Degree n and azimuthal frequency m of a Noll index. m is negative for sines.
///
/// # Reference
/// Noll 1976, J. Opt. Soc. Am. 66, 207.
#[must_use]
pub fn degree(index: usize) -> (usize, isize) {
    let mut n = 0;
    let mut before = 0;
    while before + n + 1 < index {
        before += n + 1;
        n += 1;
    }
    // The k-th of degree n, from 1: 0 (for even n) comes first, then each frequency twice.
    let k = index.saturating_sub(before);
    let m = if n.is_multiple_of(2) { 2 * (k / 2) } else { 2 * k.div_ceil(2) - 1 };
    (n, if m > 0 && !index.is_multiple_of(2) { -(m as isize) } else { m as isize })
}

/// The polynomial of a Noll index at polar coordinates.
#[must_use]
pub fn zernike(index: usize, radius: f64, angle_rad: f64) -> f64 {
    let (n, m) = degree(index);
    let radial = radial(n, m.unsigned_abs(), radius);
    let norm = (n as f64 + 1.0).sqrt();
    match m {
        0 => norm * radial,
        m if m > 0 => norm * std::f64::consts::SQRT_2 * radial * (m as f64 * angle_rad).cos(),
        m => norm * std::f64::consts::SQRT_2 * radial * (-m as f64 * angle_rad).sin(),
    }
}

/// The radial polynomial by the recurrence of Jacobi polynomials: r^m P_k^(0,m)(2 r^2 - 1) with k = (n - m) / 2. The sum of powers would lose
/// digits at high degrees.
///
/// # Reference
/// Kintner 1976, Optica Acta 23, 679; NIST DLMF 18.9.2.
fn radial(n: usize, m: usize, radius: f64) -> f64 {
    let (b, x) = (m as f64, 2.0 * radius * radius - 1.0);
    let (mut before, mut now) = (0.0, 1.0);
    for k in 0..(n - m) / 2 {
        let k = k as f64;
        let next = if k == 0.0 {
            0.5 * (b + 2.0) * x - 0.5 * b
        } else {
            let c = 2.0 * k + b;
            let a1 = 2.0 * (k + 1.0) * (k + b + 1.0) * c;
            let a2 = (c + 1.0) * ((c + 2.0) * c * x - b * b);
            let a3 = 2.0 * k * (k + b) * (c + 2.0);
            (a2 * now - a3 * before) / a1
        };
        (before, now) = (now, next);
    }
    radius.powi(m as i32) * now
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::gauss_legendre;
    use std::f64::consts::TAU;

    #[test]
    fn indices_are_those_of_noll() {
        let table =
            [(0, 0), (1, 1), (1, -1), (2, 0), (2, -2), (2, 2), (3, -1), (3, 1), (3, -3), (3, 3), (4, 0), (4, 2), (4, -2), (4, 4), (4, -4)];
        for (k, expected) in table.into_iter().enumerate() {
            assert_eq!(degree(k + 1), expected, "{}", k + 1);
        }
        assert_eq!(degree(LARGEST).0, 20);
        assert_eq!(degree(LARGEST + 1).0, 21);
    }

    #[test]
    fn low_orders_are_their_textbook_polynomials() {
        let (r, a): (f64, f64) = (0.7, 0.4);
        let known = [
            (1, 1.0),
            (2, 2.0 * r * a.cos()),
            (4, 3.0_f64.sqrt() * (2.0 * r * r - 1.0)),
            (7, 8.0_f64.sqrt() * (3.0 * r.powi(3) - 2.0 * r) * a.sin()),
            (11, 5.0_f64.sqrt() * (6.0 * r.powi(4) - 6.0 * r * r + 1.0)),
            (22, 7.0_f64.sqrt() * (20.0 * r.powi(6) - 30.0 * r.powi(4) + 12.0 * r * r - 1.0)),
        ];
        for (index, value) in known {
            assert!((zernike(index, r, a) - value).abs() < 1e-13, "{index}");
        }
    }

    #[test]
    fn all_are_orthonormal_to_1e_10() {
        // The product of two polynomials of degree 20 is exact with 24 nodes of Gauss in r^2 and 48 angles.
        let (nodes, angles) = (gauss_legendre(24), 48);
        let places: Vec<(f64, f64, f64)> = nodes
            .iter()
            .flat_map(|&(x, w)| {
                let radius = (0.5 * (x + 1.0)).sqrt();
                (0..angles).map(move |k| (radius, TAU * k as f64 / angles as f64, 0.5 * w / angles as f64))
            })
            .collect();
        let values: Vec<Vec<f64>> = (1..=LARGEST).map(|j| places.iter().map(|p| zernike(j, p.0, p.1)).collect()).collect();
        let mut worst = 0.0_f64;
        for i in 0..LARGEST {
            for j in i..LARGEST {
                let mean: f64 = places.iter().zip(values[i].iter().zip(&values[j])).map(|(p, (a, b))| p.2 * a * b).sum();
                worst = worst.max((mean - f64::from(i == j)).abs());
            }
        }
        assert!(worst < 1e-10, "{worst}");
    }
}
