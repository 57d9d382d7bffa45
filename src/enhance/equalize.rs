//! Global histogram equalisation.

use super::border::{by_rows, line, range};
use super::step::{Given, Step};
use crate::Result;
use ndarray::{Array2, ArrayView2};
use rayon::prelude::*;

#[derive(Debug)]
struct Equalize;

impl Step for Equalize {
    fn apply(&self, frame: Array2<f64>) -> Result<Array2<f64>> {
        Ok(equalize(frame.view()))
    }
}

pub(super) fn make(_: &Given<'_>) -> Result<Box<dyn Step>> {
    Ok(Box::new(Equalize))
}

/// Each pixel gets the brightness that its rank among all pixels has on a straight line from the smallest to the largest one: every part
/// of the range is used by as many pixels. The order of the pixels and the range of the plane are kept, the differences of brightness are not.
///
/// # Reference
/// Gonzalez & Woods 2018, Digital Image Processing, 4th ed., section 3.3, without bins; the smallest pixel has rank 0, as in OpenCV's `equalizeHist`.
#[must_use]
pub fn equalize(plane: ArrayView2<'_, f64>) -> Array2<f64> {
    let plane = plane.as_standard_layout().into_owned();
    let mut sorted: Vec<f64> = plane.iter().copied().collect();
    sorted.par_sort_unstable_by(f64::total_cmp);
    let ((low, high), n) = (range(plane.view()), sorted.len());
    let up_to = |v: f64| sorted.partition_point(|x| *x <= v);
    let darkest = up_to(low);
    if darkest == n {
        return plane;
    }
    by_rows(plane.dim(), |r, out| {
        for (o, v) in out.iter_mut().zip(line(&plane, r)) {
            *o = low + (high - low) * (up_to(*v) - darkest) as f64 / (n - darkest) as f64;
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::array;

    #[test]
    fn ranks_are_spread_over_the_range_and_a_flat_plane_stays() {
        let found = equalize(array![[10.0, 11.0, 50.0], [10.0, 12.0, 11.0]].view());
        assert_eq!(found, array![[10.0, 30.0, 50.0], [10.0, 40.0, 30.0]]);
        let flat = Array2::from_elem((4, 4), 290.0);
        assert_eq!(equalize(flat.view()), flat);
    }
}
