//! The imaging weights of all rows of a set.

use super::imager::Imager;
use crate::Result;
use crate::progress::Observer;

/// Imaging weights \[row x chan\]; 0 for data that do not count.
#[derive(Debug, Clone)]
pub struct WeighedRows {
    weights: Vec<f32>,
    n_chan: usize,
}

impl WeighedRows {
    /// The weight of a datum.
    #[must_use]
    pub fn at(&self, row: usize, chan: usize) -> f64 {
        f64::from(self.weights[row * self.n_chan + chan])
    }
}

impl Imager<'_> {
    /// The imaging weights of all rows.
    ///
    /// # Errors
    /// The source fails.
    pub fn weighed_rows(&mut self, observer: &dyn Observer) -> Result<WeighedRows> {
        let n_chan = self.header().spectrum.n_chan();
        let mut weights = Vec::new();
        self.for_each_weighed(observer, |block| {
            weights.extend(block.imaging().iter());
            Ok(())
        })?;
        Ok(WeighedRows { weights, n_chan })
    }
}
