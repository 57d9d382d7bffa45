//! Voltages of a pattern as polynomials of its offset.
//!
//! E(s; d) = sum over k of c_k(d) E(s; d_k), with the Lagrange polynomials c_k of total degree 3 at ten offsets d_k. The visibilities of a pair of
//! antennas are then a sum over c_k(d_p) c_l(d_q) V_kl, with the visibilities V_kl of the scene times E_k E_l. These are made once by fast
//! transforms, and any offsets cost only the sum.

use crate::linalg::{Cholesky, Matrix};
use std::f64::consts::PI;

/// Degree of the polynomials.
const DEGREE: usize = 3;
/// Number of polynomials of that degree in two variables.
pub(super) const NODES: usize = (DEGREE + 1) * (DEGREE + 2) / 2;
/// Number of products of two voltages.
pub(super) const PRODUCTS: usize = NODES * (NODES + 1) / 2;

/// Place of the product of voltages k and l.
pub(super) fn product(k: usize, l: usize) -> usize {
    let (a, b) = (k.min(l), k.max(l));
    b * (b + 1) / 2 + a
}

/// Powers x^i y^j with i + j up to the degree, or their derivatives.
fn monomials([x, y]: [f64; 2], [dx, dy]: [bool; 2]) -> [f64; NODES] {
    let power = |x: f64, n: usize, derivative: bool| match (derivative, n) {
        (false, n) => x.powi(n as i32),
        (true, 0) => 0.0,
        (true, n) => n as f64 * x.powi(n as i32 - 1),
    };
    let mut out = [0.0; NODES];
    let mut at = 0;
    for total in 0..=DEGREE {
        for j in 0..=total {
            out[at] = power(x, total - j, dx) * power(y, j, dy);
            at += 1;
        }
    }
    out
}

/// Lagrange polynomials over a square of offsets.
#[derive(Debug, Clone)]
pub(super) struct OffsetBasis {
    /// Half of the side of the square, rad.
    pub(super) reach: f64,
    /// Coefficients of the monomials \[polynomial\]\[monomial\].
    coefficients: Vec<[f64; NODES]>,
}

/// The values of the polynomials at an offset, and their derivatives by its two components, per rad.
#[derive(Debug, Clone, Copy)]
pub(super) struct Weights {
    pub(super) value: [f64; NODES],
    pub(super) by: [[f64; NODES]; 2],
}

impl OffsetBasis {
    /// Polynomials for offsets of up to `reach` rad along each axis.
    pub(super) fn new(reach: f64) -> Option<Self> {
        // V c = e for each polynomial, with the monomials of each node in a row of V, by the normal equations.
        let rows: Vec<[f64; NODES]> = unit_nodes().iter().map(|n| monomials(*n, [false; 2])).collect();
        let mut normal = Matrix::zeros(NODES, NODES);
        for i in 0..NODES {
            for j in 0..NODES {
                normal[(i, j)] = rows.iter().map(|r| r[i] * r[j]).sum();
            }
        }
        let factor = Cholesky::new(&normal)?;
        let coefficients = rows.iter().map(|row| std::array::from_fn(|j| factor.solve(row)[j])).collect();
        Some(Self { reach, coefficients })
    }

    /// The offsets d_k, rad.
    pub(super) fn nodes(&self) -> [[f64; 2]; NODES] {
        unit_nodes().map(|n| n.map(|x| x * self.reach))
    }

    pub(super) fn at(&self, offset: [f64; 2]) -> Weights {
        let x = offset.map(|d| d / self.reach);
        let of = |derivative: [bool; 2], scale: f64| {
            let powers = monomials(x, derivative);
            std::array::from_fn(|k| self.coefficients[k].iter().zip(&powers).map(|(c, p)| c * p).sum::<f64>() * scale)
        };
        Weights { value: of([false; 2], 1.0), by: [of([true, false], 1.0 / self.reach), of([false, true], 1.0 / self.reach)] }
    }
}

/// The Padua points of the square from -1 to 1, in which polynomials of the degree are determined well.
///
/// # Reference
/// Caliari, De Marchi & Vianello 2005, Appl. Math. Comput. 165, 261.
fn unit_nodes() -> [[f64; 2]; NODES] {
    let (n, m) = (DEGREE as f64, DEGREE as f64 + 1.0);
    let mut all = [[0.0; 2]; NODES];
    let mut at = 0;
    for j in 0..=DEGREE {
        for k in (0..=DEGREE + 1).filter(|k| (j + k) % 2 == 0) {
            all[at] = [(j as f64 * PI / n).cos(), (k as f64 * PI / m).cos()];
            at += 1;
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cubic_functions_and_their_slopes_are_exact() {
        let basis = OffsetBasis::new(0.02).unwrap();
        let f = |[x, y]: [f64; 2]| 1.0 + 30.0 * x - 20.0 * y + 700.0 * x * y - 900.0 * y * y + 4e4 * x * x * y - 1e4 * y * y * y;
        let values = basis.nodes().map(f);
        for d in [[0.0, 0.0], [0.013, -0.004], [-0.02, 0.02]] {
            let w = basis.at(d);
            let sum = |c: &[f64; NODES]| c.iter().zip(&values).map(|(c, v)| c * v).sum::<f64>();
            assert!((sum(&w.value) - f(d)).abs() < 1e-11);
            let slope = 30.0 + 700.0 * d[1] + 8e4 * d[0] * d[1];
            assert!((sum(&w.by[0]) - slope).abs() < 1e-8, "{} {slope}", sum(&w.by[0]));
        }
    }

    #[test]
    fn a_gaussian_voltage_is_interpolated_within_its_fourth_order() {
        let e = |x: f64, [a, b]: [f64; 2]| (-((x - a).powi(2) + (0.03 - b).powi(2)) / (2.0 * 0.094_f64.powi(2))).exp();
        let basis = OffsetBasis::new(0.017).unwrap();
        for x in [0.0, 0.05, 0.1, 0.2] {
            let w = basis.at([0.01, -0.012]);
            let sum: f64 = w.value.iter().zip(basis.nodes()).map(|(c, n)| c * e(x, n)).sum();
            assert!((sum - e(x, [0.01, -0.012])).abs() < 2e-5, "{x}");
        }
    }

    #[test]
    fn products_have_places_of_their_own() {
        let mut places: Vec<usize> = (0..NODES).flat_map(|k| (0..=k).map(move |l| product(k, l))).collect();
        places.sort_unstable();
        assert_eq!(places, (0..PRODUCTS).collect::<Vec<_>>());
    }
}
