//! Dense square matrices of some tens of rows, as the layers of a scattering medium need them.

use std::ops::{Add, Index, IndexMut, Mul, Sub};

/// A matrix, row by row.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Matrix {
    rows: usize,
    columns: usize,
    values: Vec<f64>,
}

impl Matrix {
    pub(super) fn zeros(rows: usize, columns: usize) -> Self {
        Self { rows, columns, values: vec![0.0; rows * columns] }
    }

    pub(super) fn diagonal(values: &[f64]) -> Self {
        let mut out = Self::zeros(values.len(), values.len());
        for (i, v) in values.iter().enumerate() {
            out[(i, i)] = *v;
        }
        out
    }

    pub(super) fn identity(n: usize) -> Self {
        Self::diagonal(&vec![1.0; n])
    }

    pub(super) fn rows(&self) -> usize {
        self.rows
    }

    pub(super) fn columns(&self) -> usize {
        self.columns
    }

    pub(super) fn row(&self, i: usize) -> &[f64] {
        &self.values[i * self.columns..(i + 1) * self.columns]
    }

    fn row_mut(&mut self, i: usize) -> &mut [f64] {
        &mut self.values[i * self.columns..(i + 1) * self.columns]
    }

    pub(super) fn row_sums(&self) -> Vec<f64> {
        (0..self.rows).map(|i| self.row(i).iter().sum()).collect()
    }

    /// The largest size of an element.
    pub(super) fn largest(&self) -> f64 {
        self.values.iter().fold(0.0, |m, v| m.max(v.abs()))
    }

    pub(super) fn times(mut self, factor: f64) -> Self {
        self.values.iter_mut().for_each(|v| *v *= factor);
        self
    }

    /// Each row times its own factor.
    pub(super) fn scale_rows(mut self, factors: &[f64]) -> Self {
        for (i, f) in factors.iter().enumerate() {
            self.row_mut(i).iter_mut().for_each(|v| *v *= f);
        }
        self
    }

    /// Each column times its own factor.
    pub(super) fn scale_columns(mut self, factors: &[f64]) -> Self {
        for i in 0..self.rows {
            self.row_mut(i).iter_mut().zip(factors).for_each(|(v, f)| *v *= f);
        }
        self
    }

    /// The matrix with its first `rows` rows and `columns` columns. Elements beyond the old size are 0.
    pub(super) fn resized(&self, rows: usize, columns: usize) -> Self {
        let mut out = Self::zeros(rows, columns);
        for i in 0..rows.min(self.rows) {
            let width = columns.min(self.columns);
            out.row_mut(i)[..width].copy_from_slice(&self.row(i)[..width]);
        }
        out
    }

    /// The solution `x` of `self x = right`, by Gaussian elimination with row pivots.
    pub(super) fn solve(mut self, mut right: Self) -> Self {
        let n = self.rows;
        for k in 0..n {
            let pivot = (k..n).max_by(|&a, &b| self[(a, k)].abs().total_cmp(&self[(b, k)].abs())).unwrap_or(k);
            if pivot != k {
                self.swap_rows(pivot, k);
                right.swap_rows(pivot, k);
            }
            let inverse = 1.0 / self[(k, k)];
            for i in k + 1..n {
                let factor = self[(i, k)] * inverse;
                if factor != 0.0 {
                    self.subtract_row(i, k, factor, k);
                    right.subtract_row(i, k, factor, 0);
                }
            }
        }
        for k in (0..n).rev() {
            let inverse = 1.0 / self[(k, k)];
            right.row_mut(k).iter_mut().for_each(|v| *v *= inverse);
            for i in 0..k {
                let factor = self[(i, k)];
                if factor != 0.0 {
                    right.subtract_row(i, k, factor, 0);
                }
            }
        }
        right
    }

    fn swap_rows(&mut self, a: usize, b: usize) {
        for j in 0..self.columns {
            self.values.swap(a * self.columns + j, b * self.columns + j);
        }
    }

    /// Row `i` minus a multiple of row `k`, from a column on.
    fn subtract_row(&mut self, i: usize, k: usize, factor: f64, from: usize) {
        let width = self.columns;
        let (low, high) = (i.min(k), i.max(k));
        let (first, second) = self.values.split_at_mut(high * width);
        let (low, high) = (&mut first[low * width..(low + 1) * width], &mut second[..width]);
        let (changed, pivot) = if i < k { (low, &*high) } else { (high, &*low) };
        for (v, p) in changed[from..].iter_mut().zip(&pivot[from..]) {
            *v -= factor * p;
        }
    }
}

impl Index<(usize, usize)> for Matrix {
    type Output = f64;

    fn index(&self, (i, j): (usize, usize)) -> &f64 {
        &self.values[i * self.columns + j]
    }
}

impl IndexMut<(usize, usize)> for Matrix {
    fn index_mut(&mut self, (i, j): (usize, usize)) -> &mut f64 {
        &mut self.values[i * self.columns + j]
    }
}

impl Mul for &Matrix {
    type Output = Matrix;

    fn mul(self, other: &Matrix) -> Matrix {
        let mut out = Matrix::zeros(self.rows, other.columns);
        for i in 0..self.rows {
            let sums = &mut out.values[i * other.columns..(i + 1) * other.columns];
            for (k, a) in self.row(i).iter().enumerate().filter(|(_, a)| **a != 0.0) {
                for (s, b) in sums.iter_mut().zip(other.row(k)) {
                    *s += a * b;
                }
            }
        }
        out
    }
}

impl Add<&Matrix> for Matrix {
    type Output = Self;

    fn add(mut self, other: &Self) -> Self {
        self.values.iter_mut().zip(&other.values).for_each(|(a, b)| *a += b);
        self
    }
}

impl Sub<&Matrix> for Matrix {
    type Output = Self;

    fn sub(mut self, other: &Self) -> Self {
        self.values.iter_mut().zip(&other.values).for_each(|(a, b)| *a -= b);
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solutions_solve_their_equations() {
        let n = 7;
        let mut a = Matrix::zeros(n, n);
        let mut b = Matrix::zeros(n, 3);
        for i in 0..n {
            for j in 0..n {
                // The first pivot is 0, so rows have to be exchanged.
                a[(i, j)] = ((3 * i + 5 * j * j) % 11) as f64 - if i == 0 && j == 0 { 0.0 } else { 1.5 };
            }
            for j in 0..3 {
                b[(i, j)] = (i as f64 - j as f64).cos();
            }
        }
        let x = a.clone().solve(b.clone());
        assert!((&a * &x - &b).largest() < 1e-12);
    }
}
