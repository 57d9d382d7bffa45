//! The pixels of an image that count: those of a mask that lie before the horizon.

use ndarray::{Array2, ArrayBase, Data, Ix2, Zip};

/// The mask without pixels behind the horizon; `one` is 0 there \[m, l\].
pub(crate) fn in_front(one: &Array2<f64>, mut mask: Option<Array2<bool>>) -> Option<Array2<bool>> {
    if one.iter().any(|v| *v == 0.0) {
        let all = mask.get_or_insert_with(|| Array2::from_elem(one.dim(), true));
        Zip::from(all).and(one).for_each(|m, v| *m &= *v > 0.0);
    }
    mask
}

/// Sum over the pixels of a mask, or over all.
pub(crate) fn sum_inside<S: Data<Elem: Copy + Into<f64>>>(image: &ArrayBase<S, Ix2>, inside: Option<&Array2<bool>>) -> f64 {
    let all = || image.iter().map(|v| (*v).into());
    inside.map_or_else(|| all().sum(), |m| all().zip(m).filter(|(_, m)| **m).map(|(v, _)| v).sum())
}
