//! The pixels of a plane as a grey picture without axes, such as a frame of a film.

use super::canvas::encode;
use crate::{ChainError, Result};
use image::GrayImage;
use ndarray::ArrayView2;

/// A PNG with one pixel for each cell of the plane: black at `low`, white at `high`, the last row on top. // [m, l]
///
/// # Errors
/// A plane without pixels, or larger than a PNG can be.
pub fn grey(plane: ArrayView2<'_, f64>, low: f64, high: f64) -> Result<Vec<u8>> {
    let (rows, columns) = plane.dim();
    // Rounds to the nearest; NaN is black.
    let level = |v: &f64| (255.0 * ((v - low) / (high - low)).clamp(0.0, 1.0) + 0.5) as u8;
    let mut bytes = Vec::with_capacity(rows * columns);
    for row in plane.rows().into_iter().rev() {
        bytes.extend(row.iter().map(level));
    }
    let size = u32::try_from(columns).ok().zip(u32::try_from(rows).ok()).filter(|(w, h)| *w > 0 && *h > 0);
    let picture = size.and_then(|(w, h)| GrayImage::from_raw(w, h, bytes));
    encode(picture.ok_or_else(|| ChainError::NoData(format!("a picture of {columns} x {rows} pixels cannot be drawn")))?.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::array;

    #[test]
    fn the_last_row_is_on_top_and_values_are_clipped() {
        let png = grey(array![[0.0, 100.0, 200.0], [300.0, 150.0, f64::NAN]].view(), 100.0, 200.0).unwrap();
        let read = image::load_from_memory(&png).unwrap().into_luma8();
        assert_eq!(read.dimensions(), (3, 2));
        assert_eq!(read.into_raw(), [255, 128, 0, 0, 0, 255]);
        assert!(grey(ndarray::Array2::zeros((0, 3)).view(), 0.0, 1.0).is_err());
    }
}
