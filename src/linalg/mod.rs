//! Small dense linear algebra: the systems that have one row for each antenna or each baseline of one moment.

mod cholesky;
mod matrix;
mod singular;

pub(crate) use cholesky::{Cholesky, condition_number};
pub(crate) use matrix::{Matrix, dot, solve_3};
pub(crate) use singular::{numerical_rank, singular_values, triangularise};
