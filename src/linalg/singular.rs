//! Singular values of small dense matrices, and their numerical rank.

use super::matrix::{Matrix, dot, norm};

/// Singular values (in descending order) and right singular vectors (rows, in the same order) of a matrix with any number of rows.
///
/// Householder reduction to a square triangle first, then one-sided Jacobi rotations, which find small singular values to
/// full relative precision.
///
/// # Reference
/// Golub & Van Loan 2013, Matrix Computations, sections 5.2 and 8.6.3.
pub(crate) fn singular_values(mut a: Matrix) -> (Vec<f64>, Matrix) {
    let n = a.cols;
    triangularise(&mut a);
    // Columns of R as rows of `work`, so that rotations run along memory.
    let mut work = Matrix::zeros(n, n);
    for r in 0..a.rows.min(n) {
        for c in r..n {
            work[(c, r)] = a[(r, c)];
        }
    }
    let mut v = Matrix::zeros(n, n);
    for i in 0..n {
        v[(i, i)] = 1.0;
    }
    let floor = f64::EPSILON * (0..n).map(|c| norm(work.row(c))).fold(0.0, f64::max);
    for _ in 0..60 {
        let mut rotated = false;
        for p in 0..n {
            for q in p + 1..n {
                let (alpha, beta) = (dot(work.row(p), work.row(p)), dot(work.row(q), work.row(q)));
                let gamma = dot(work.row(p), work.row(q));
                // Columns that consist of rounding errors need no rotation.
                let pointless = alpha.min(beta).sqrt() <= floor;
                if gamma == 0.0 || pointless || gamma.abs() <= 1e-14 * (alpha * beta).sqrt() {
                    continue;
                }
                rotated = true;
                let zeta = (beta - alpha) / (2.0 * gamma);
                let t = zeta.signum() / (zeta.abs() + (1.0 + zeta * zeta).sqrt());
                let c = 1.0 / (1.0 + t * t).sqrt();
                rotate(&mut work, p, q, c, c * t);
                rotate(&mut v, p, q, c, c * t);
            }
        }
        if !rotated {
            break;
        }
    }
    let sigma: Vec<f64> = (0..n).map(|c| norm(work.row(c))).collect();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|a, b| sigma[*b].total_cmp(&sigma[*a]));
    let mut vectors = Matrix::zeros(n, n);
    for (to, &from) in order.iter().enumerate() {
        vectors.row_mut(to).copy_from_slice(v.row(from));
    }
    (order.iter().map(|&i| sigma[i]).collect(), vectors)
}

fn rotate(m: &mut Matrix, p: usize, q: usize, c: f64, s: f64) {
    let cols = m.cols;
    let (head, tail) = m.data.split_at_mut(q * cols);
    let (x, y) = (&mut head[p * cols..(p + 1) * cols], &mut tail[..cols]);
    for (x, y) in x.iter_mut().zip(y) {
        (*x, *y) = (c * *x - s * *y, s * *x + c * *y);
    }
}

/// Replace a tall matrix by the triangle R of its QR decomposition. The rows below the triangle have no meaning afterwards.
pub(crate) fn triangularise(a: &mut Matrix) {
    let (rows, cols) = (a.rows, a.cols);
    for k in 0..cols.min(rows) {
        let length = (k..rows).map(|r| a[(r, k)].powi(2)).sum::<f64>().sqrt();
        if length == 0.0 {
            continue;
        }
        let alpha = if a[(k, k)] > 0.0 { -length } else { length };
        let mut v: Vec<f64> = (k..rows).map(|r| a[(r, k)]).collect();
        v[0] -= alpha;
        let vv = dot(&v, &v);
        let mut along = vec![0.0; cols - k];
        for (i, vi) in v.iter().enumerate().filter(|(_, vi)| **vi != 0.0) {
            for (s, x) in along.iter_mut().zip(&a.row(k + i)[k..]) {
                *s += vi * x;
            }
        }
        for (i, vi) in v.iter().enumerate().filter(|(_, vi)| **vi != 0.0) {
            let scale = 2.0 * vi / vv;
            for (x, s) in a.row_mut(k + i)[k..].iter_mut().zip(&along) {
                *x -= scale * s;
            }
        }
    }
}

/// Number of singular values above rounding: sigma > max(rows, cols) eps sigma_max, with a hundredfold margin.
pub(crate) fn numerical_rank(sigma: &[f64], rows: usize) -> usize {
    let largest = sigma.first().copied().unwrap_or(0.0);
    let floor = largest * 100.0 * f64::EPSILON * rows.max(sigma.len()) as f64;
    sigma.iter().filter(|s| **s > floor).count()
}

#[cfg(test)]
mod tests {
    use super::super::matrix::matrix;
    use super::*;

    #[test]
    fn singular_values_of_a_known_matrix() {
        // diag(3, 2, 0) turned on both sides.
        let (c, s) = (0.6, 0.8);
        let a = matrix(&[&[3.0 * c, 2.0 * s, 0.0], &[-3.0 * s, 2.0 * c, 0.0], &[0.0, 0.0, 0.0], &[0.0, 0.0, 0.0]]);
        let (sigma, v) = singular_values(a.clone());
        assert!((sigma[0] - 3.0).abs() < 1e-14 && (sigma[1] - 2.0).abs() < 1e-14 && sigma[2] < 1e-15, "{sigma:?}");
        for (i, s) in sigma.iter().enumerate() {
            assert!((norm(&a.times(v.row(i))) - s).abs() < 1e-13);
        }
        assert_eq!(numerical_rank(&sigma, 4), 2);
    }

    #[test]
    fn a_wide_matrix_has_the_rank_of_its_rows() {
        let a = matrix(&[&[1.0, 2.0, 3.0, 4.0], &[2.0, 1.0, 0.0, 1.0]]);
        let (sigma, v) = singular_values(a.clone());
        assert_eq!(numerical_rank(&sigma, 2), 2);
        assert!(norm(&a.times(v.row(3))) < 1e-13);
    }
}
