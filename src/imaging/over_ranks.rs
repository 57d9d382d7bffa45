//! Sums of images over the processes that share a set.

use crate::fourier::{Gridder, Real, in_precision};
use cittert_arrays::Ranks;
use ndarray::Array2;

/// Bytes of planes that are made at once by every process. The heap grows in steps of this size, so that bands of smaller planes would save nothing.
pub(super) const SMALL_PLANES: usize = 16 << 20;

/// Values that are summed at once.
const PART: usize = 1 << 16;

/// The image of what all processes have gridded. It is summed in double precision, and rounded after that: what each process rounds by itself would make the
/// sum depend on their number.
pub(crate) fn finished<T: Real, P: Real>(ranks: &dyn Ranks, gridder: Gridder<T>) -> Array2<P> {
    if ranks.size() == 1 {
        return gridder.finish();
    }
    let mut image: Array2<f64> = gridder.finish();
    summed(ranks, &mut image);
    in_precision(image)
}

/// Replace an image by the sum of those of all processes.
pub(crate) fn summed(ranks: &dyn Ranks, image: &mut Array2<f64>) {
    if ranks.size() > 1 {
        image.as_slice_mut().into_iter().flat_map(|all| all.chunks_mut(PART)).for_each(|part| ranks.sum(part));
    }
}
