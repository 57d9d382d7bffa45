//! Small dense linear algebra for the systems that have one row for each antenna or each baseline of one moment, and Gauss quadrature.

mod cholesky;
mod legendre;
mod matrix;
mod singular;

pub(crate) use cholesky::{Cholesky, condition_number};
pub(crate) use legendre::gauss_legendre;
pub(crate) use matrix::{Matrix, dot, solve_3};
pub(crate) use singular::{numerical_rank, singular_values, triangularise};
