//! Sums of images over the processes that share a set.

use crate::fourier::Real;
use cittert_arrays::Ranks;
use ndarray::Array2;

/// Values that are summed at once. They are summed as doubles, whatever the precision of the image.
const PART: usize = 1 << 16;

/// Replace an image by its sum over all processes.
pub(crate) fn sum_image<P: Real>(ranks: &dyn Ranks, mut image: Array2<P>) -> Array2<P> {
    if ranks.size() == 1 {
        return image;
    }
    let mut buffer = Vec::with_capacity(PART);
    let mut values = image.iter_mut();
    loop {
        let part: Vec<&mut P> = values.by_ref().take(PART).collect();
        if part.is_empty() {
            break;
        }
        buffer.clear();
        buffer.extend(part.iter().map(|v| v.to64()));
        ranks.sum(&mut buffer);
        part.into_iter().zip(&buffer).for_each(|(v, sum)| *v = P::of(*sum));
    }
    image
}
