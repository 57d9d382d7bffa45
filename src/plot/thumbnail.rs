//! Smaller copies of pictures, for pages that hold many of them.

use super::failed::plot_error;
use super::palette::indexed;
use crate::Result;
use image::imageops::{FilterType, resize};

/// A copy of a PNG that is at most `width` pixels wide.
///
/// # Errors
/// Bytes that are no picture, or a failure of the encoder.
pub fn thumbnail(png: &[u8], width: u32) -> Result<Vec<u8>> {
    let picture = image::load_from_memory(png).map_err(plot_error)?.to_rgb8();
    let (w, h) = picture.dimensions();
    if w <= width {
        return Ok(png.to_vec());
    }
    let height = (f64::from(h) * f64::from(width) / f64::from(w)).round().max(1.0) as u32;
    let small = resize(&picture, width, height, FilterType::CatmullRom);
    indexed(width as usize, height as usize, small.as_raw())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_copy_keeps_its_shape_and_colours() {
        let png = indexed(200, 100, &[10, 200, 30].repeat(200 * 100)).unwrap();
        let small = image::load_from_memory(&thumbnail(&png, 50).unwrap()).unwrap().to_rgb8();
        assert_eq!((small.dimensions(), small.get_pixel(20, 10).0), ((50, 25), [10, 200, 30]));
        assert_eq!(thumbnail(&png, 200).unwrap(), png);
        assert!(thumbnail(b"no picture", 10).is_err());
    }
}
