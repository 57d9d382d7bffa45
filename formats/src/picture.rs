//! Grey-scale pictures (PNG) as scenes: a plane of numbers from 0 (black) to 1 (white).

use crate::files::{describe, open_file, start_of};
use crate::{FormatError, Result};
use image::{ImageFormat, ImageReader, Limits};
use ndarray::Array2;
use std::io::BufReader;
use std::path::Path;

/// Largest side of a picture.
const LARGEST_SIDE: u32 = 16_384;
/// Most memory that decoding may take, bytes.
const MOST_BYTES: u64 = 1 << 31;

/// Read a grey PNG of 8 or 16 bits as \[m, l\] values from 0 to 1; the first row is the lowest of the picture, columns run to the right.
///
/// # Errors
/// Not a PNG, damaged, in colour, or larger than 16,384 pixels a side.
pub fn read_grey_png(path: &Path) -> Result<Array2<f64>> {
    let start = start_of(path)?;
    if !start.starts_with(b"\x89PNG\r\n\x1a\n") {
        return Err(FormatError::not_a(path, "a PNG picture", format!("it is {}", describe(&start))));
    }
    let mut limits = Limits::default();
    (limits.max_image_width, limits.max_image_height, limits.max_alloc) = (Some(LARGEST_SIDE), Some(LARGEST_SIDE), Some(MOST_BYTES));
    let mut reader = ImageReader::with_format(BufReader::new(open_file(path)?), ImageFormat::Png);
    reader.limits(limits);
    let expected = format!("an undamaged PNG picture of at most {LARGEST_SIDE} pixels a side");
    let picture = reader.decode().map_err(|e| FormatError::malformed(path, "picture", expected, e.to_string()))?;
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    if picture.color().has_color() && picture.to_rgb16().pixels().any(|p| p[0] != p[1] || p[1] != p[2]) {
        return Err(FormatError::unsupported(path, "the picture is in colour: convert it to grey (8 or 16 bits) first"));
    }
    let grey = picture.into_luma16();
    Ok(Array2::from_shape_fn((height, width), |(row, column)| {
        f64::from(grey.get_pixel(column as u32, (height - 1 - row) as u32)[0]) / f64::from(u16::MAX)
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_row_is_the_lowest_and_white_is_one() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.png");
        image::GrayImage::from_raw(2, 3, vec![255, 0, 51, 0, 0, 102]).unwrap().save(&path).unwrap();
        let plane = read_grey_png(&path).unwrap();
        assert_eq!(plane.dim(), (3, 2));
        assert_eq!((plane[(2, 0)], plane[(0, 1)], plane[(1, 0)]), (1.0, 0.4, 0.2));
        image::ImageBuffer::<image::Luma<u16>, _>::from_raw(2, 1, vec![13_107u16, 65_535]).unwrap().save(&path).unwrap();
        assert_eq!(read_grey_png(&path).unwrap().row(0).to_vec(), [0.2, 1.0]);
    }

    #[test]
    fn colour_damage_and_other_files_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.png");
        image::RgbImage::from_raw(1, 1, vec![1, 2, 3]).unwrap().save(&path).unwrap();
        assert!(read_grey_png(&path).unwrap_err().to_string().contains("colour"));
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..40]).unwrap();
        assert!(read_grey_png(&path).unwrap_err().to_string().contains("undamaged"));
        std::fs::write(&path, "SIMPLE  = T").unwrap();
        assert!(read_grey_png(&path).unwrap_err().to_string().contains("FITS"));
    }
}
