//! Global and local histogram equalisation together.

use super::clahe::clahe;
use super::equalize::equalize;
use super::step::{Given, Step};
use crate::Result;
use ndarray::{Array2, ArrayView2, Zip};

#[derive(Debug)]
struct Hybrid {
    local: f64,
    clip: f64,
    tiles: usize,
}

impl Step for Hybrid {
    fn apply(&self, frame: Array2<f64>) -> Result<Array2<f64>> {
        Ok(hybrid(frame.view(), self.local, self.clip, self.tiles))
    }
}

pub(super) fn make(given: &Given<'_>) -> Result<Box<dyn Step>> {
    Ok(Box::new(Hybrid { local: given.number(0), clip: given.number(1), tiles: given.whole(2) }))
}

/// The mean of local, contrast-limited equalisation (weight `local`) and of global equalisation (the rest). The local part draws out weak detail,
/// the global part keeps what is bright in one corner brighter than what is dark in another. The range of the plane is kept.
///
/// # Reference
/// Own definition: a weighted mean of [`equalize`] and [`clahe`].
#[must_use]
pub fn hybrid(plane: ArrayView2<'_, f64>, local: f64, clip: f64, tiles: usize) -> Array2<f64> {
    Zip::from(&clahe(plane, clip, tiles)).and(&equalize(plane)).map_collect(|a, b| local * a + (1.0 - local) * b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::enhance::samples::noise;

    #[test]
    fn its_ends_are_the_two_parts() {
        let plane = noise(32, 32, 10);
        assert_eq!(hybrid(plane.view(), 1.0, 2.0, 4), clahe(plane.view(), 2.0, 4));
        assert_eq!(hybrid(plane.view(), 0.0, 2.0, 4), equalize(plane.view()));
    }
}
