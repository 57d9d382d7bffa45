//! The table of entropies, and the prior that all of them need.

use super::burg::Burg;
use super::gull_skilling::GullSkilling;
use super::penalty::Regulariser;
use super::relative::RelativeEntropy;
use crate::{ChainError, Result};
use ndarray::Array2;

/// A row of the table of entropies: each is made from a prior image.
#[derive(Debug)]
pub struct Entry {
    /// Its name on the command line.
    pub name: &'static str,
    /// Its formula in one line.
    pub about: &'static str,
    /// Make the entropy from a prior \[m, l\], flux per pixel, which [`check_prior`] has accepted.
    pub make: fn(Array2<f64>) -> Box<dyn Regulariser>,
}

/// Entropies by name; the first is the default.
pub const ENTROPIES: [Entry; 3] = [
    Entry { name: "relative", about: "-sum I (ln(I/M) - 1)", make: |m| Box::new(RelativeEntropy::new(m)) },
    Entry { name: "gull-skilling", about: "sum I - M - I ln(I/M), which is 0 at the prior", make: |m| Box::new(GullSkilling::new(m)) },
    Entry { name: "log", about: "sum M (ln(I/M) - I/M + 1), Burg's", make: |m| Box::new(Burg::new(m)) },
];

/// An entropy of the table.
///
/// # Errors
/// A name that is not in it.
pub fn entropy_by_name(name: &str) -> Result<&'static Entry> {
    ENTROPIES.iter().find(|e| e.name == name).ok_or_else(|| {
        let names: Vec<&str> = ENTROPIES.iter().map(|e| e.name).collect();
        ChainError::BadOption { option: "entropy", value: format!("{name:?}"), expected: names.join(", ") }
    })
}

/// Refuse a prior with pixels that are not positive.
///
/// # Errors
/// A pixel (inside the mask, if there is one) is not positive and finite.
pub fn check_prior(prior: &Array2<f64>, inside: Option<&Array2<bool>>) -> Result<()> {
    let bad = |((i, j), v): &((usize, usize), &f64)| !(**v > 0.0 && v.is_finite()) && inside.is_none_or(|m| m[(*i, *j)]);
    match prior.indexed_iter().find(bad) {
        None => Ok(()),
        Some(((row, column), v)) => Err(ChainError::BadOption {
            option: "prior",
            value: format!("{v} at column {column}, row {row}"),
            expected: "a prior that is positive and finite in every pixel".into(),
        }),
    }
}
