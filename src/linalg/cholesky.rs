//! Symmetric positive definite systems: Cholesky factor, solution, determinant, condition number.

use super::matrix::{Matrix, dot, norm};

/// A Cholesky factor L of A = L L^T.
#[derive(Debug, Clone)]
pub(crate) struct Cholesky {
    l: Matrix,
}

impl Cholesky {
    /// Factor a symmetric matrix; `None` where it is not positive definite to rounding.
    pub(crate) fn new(a: &Matrix) -> Option<Self> {
        let n = a.rows;
        let largest = (0..n).map(|i| a[(i, i)]).fold(0.0, f64::max);
        let mut l = Matrix::zeros(n, n);
        for i in 0..n {
            for j in 0..=i {
                let s = a[(i, j)] - dot(&l.row(i)[..j], &l.row(j)[..j]);
                if i == j {
                    if !(s > largest * 1e-14 * n as f64) {
                        return None;
                    }
                    l[(i, i)] = s.sqrt();
                } else {
                    l[(i, j)] = s / l[(j, j)];
                }
            }
        }
        Some(Self { l })
    }

    /// ln det A.
    pub(crate) fn log_determinant(&self) -> f64 {
        2.0 * (0..self.l.rows).map(|i| self.l[(i, i)].ln()).sum::<f64>()
    }

    /// Solve A x = b.
    pub(crate) fn solve(&self, b: &[f64]) -> Vec<f64> {
        let n = self.l.rows;
        let mut x = b.to_vec();
        for i in 0..n {
            x[i] = (x[i] - dot(&self.l.row(i)[..i], &x[..i])) / self.l[(i, i)];
        }
        for i in (0..n).rev() {
            x[i] /= self.l[(i, i)];
            let xi = x[i];
            for (xj, lij) in x[..i].iter_mut().zip(&self.l.row(i)[..i]) {
                *xj -= lij * xi;
            }
        }
        x
    }
}

/// Largest over smallest eigenvalue of a symmetric positive definite matrix, by power and inverse iteration.
///
/// The result is accurate to a few per cent, which is enough for a condition number. The direction `deflate`, a unit vector, is left out.
pub(crate) fn condition_number(a: &Matrix, factor: &Cholesky, deflate: Option<&[f64]>) -> f64 {
    let n = a.rows;
    if n < 2 {
        return 1.0;
    }
    let clean = |x: &mut Vec<f64>| {
        if let Some(d) = deflate {
            let along = dot(x, d);
            x.iter_mut().zip(d).for_each(|(x, d)| *x -= along * d);
        }
        let length = norm(x);
        if length > 0.0 {
            x.iter_mut().for_each(|x| *x /= length);
        }
        length
    };
    // An irregular start has a part along every eigenvector.
    let start: Vec<f64> = (0..n).map(|i| ((i as f64 + 1.0) * 0.754_877_666).fract() - 0.5).collect();
    let extreme = |apply: &dyn Fn(&[f64]) -> Vec<f64>| {
        let mut x = start.clone();
        clean(&mut x);
        let mut value = 0.0;
        for _ in 0..30 {
            x = apply(&x);
            value = clean(&mut x);
        }
        value
    };
    let largest = extreme(&|x| a.times(x));
    let inverse_smallest = extreme(&|x| factor.solve(x));
    (largest * inverse_smallest).max(1.0)
}

#[cfg(test)]
mod tests {
    use super::super::matrix::matrix;
    use super::*;

    #[test]
    fn cholesky_solves_what_it_factored() {
        let a = matrix(&[&[4.0, 1.0, 0.5], &[1.0, 3.0, -1.0], &[0.5, -1.0, 2.0]]);
        let x = [1.0, -2.0, 3.0];
        let found = Cholesky::new(&a).unwrap().solve(&a.times(&x));
        assert!(found.iter().zip(&x).all(|(f, x)| (f - x).abs() < 1e-13), "{found:?}");
        assert!(Cholesky::new(&matrix(&[&[1.0, 1.0], &[1.0, 1.0]])).is_none());
    }

    #[test]
    fn the_condition_number_of_a_diagonal_matrix() {
        let a = matrix(&[&[10.0, 0.0, 0.0], &[0.0, 1.0, 0.0], &[0.0, 0.0, 0.5]]);
        let k = condition_number(&a, &Cholesky::new(&a).unwrap(), None);
        assert!((k - 20.0).abs() < 0.1, "{k}");
    }
}
