//! The pixels that a comparison takes.

use crate::{ChainError, Result};
use ndarray::Array2;
use serde::{Deserialize, Serialize};

/// The pixels that are compared.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub enum Region {
    /// All pixels.
    #[default]
    All,
    /// A disc around the middle of the frame.
    Disc {
        /// Radius as a fraction of the smaller side of the frame; 0.5 touches its edge.
        radius: f64,
    },
}

impl Region {
    /// True for the pixels of the region \[m, l\].
    ///
    /// # Errors
    /// The radius is not positive.
    pub fn mask(self, n_m: usize, n_l: usize) -> Result<Array2<bool>> {
        match self {
            Self::All => Ok(Array2::from_elem((n_m, n_l), true)),
            Self::Disc { radius } if radius.is_finite() && radius * n_m.min(n_l) as f64 >= 1.0 => {
                let r = radius * n_m.min(n_l) as f64;
                Ok(Array2::from_shape_fn((n_m, n_l), |(row, column)| {
                    (row as f64 - (n_m / 2) as f64).hypot(column as f64 - (n_l / 2) as f64) <= r
                }))
            }
            Self::Disc { radius } => {
                Err(ChainError::bad_option("radius of the disc", radius, "a fraction of the frame that is at least a pixel"))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_disc_has_its_radius() {
        let mask = Region::Disc { radius: 0.25 }.mask(16, 16).unwrap();
        assert!(mask[[8, 12]] && !mask[[8, 13]] && !mask[[0, 0]]);
        assert!(Region::Disc { radius: 0.0 }.mask(16, 16).is_err() && Region::Disc { radius: 0.05 }.mask(16, 16).is_err());
    }
}
