//! What films need of pictures: the names above their panels, and their colours.

use super::canvas::{Align, Canvas, INK};
use super::failed::plot_error;
use super::panel::fitted;
use super::shape::Rgb;
use crate::Result;
use ndarray::Array2;

/// Rows of a name.
const ROWS: usize = 26;
/// Size of its letters, pixels.
const EM: f64 = 15.0;
/// Smallest side of a canvas.
const LEAST: usize = 100;

/// A text in levels, white on black, in the middle of a strip of so many columns. // [row from the top, column]
///
/// # Errors
/// A strip that is wider than a picture can be.
pub fn name_strip(text: &str, columns: usize) -> Result<Array2<u8>> {
    let width = columns.max(LEAST);
    let mut canvas = Canvas::new(width, LEAST)?;
    let (shown, em) = fitted(&canvas, text, EM, 0.95 * columns as f64);
    // The base line leaves room for descenders.
    canvas.text((columns as f64 / 2.0, ROWS as f64 - 8.0), &shown, em, Align::Center, INK)?;
    let drawn = image::load_from_memory(&canvas.png()?).map_err(plot_error)?.into_luma8();
    Ok(Array2::from_shape_fn((ROWS, columns), |(row, column)| 255 - drawn.get_pixel(column as u32, row as u32).0[0]))
}

/// The colour of a level from black over red to yellow.
///
/// # Reference
/// Smith & van der Walt 2015, the map inferno of matplotlib.
#[must_use]
pub fn inferno(level: u8) -> Rgb {
    let c = colorous::INFERNO.eval_continuous(f64::from(level) / 255.0);
    [c.r, c.g, c.b]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_bright_on_black_and_inside_of_its_strip() {
        for (text, columns) in [("truth", 64), ("filled aperture", 256), ("a name that is far too long for a strip", 80)] {
            let strip = name_strip(text, columns).unwrap();
            assert_eq!(strip.dim(), (26, columns));
            assert!(strip.iter().filter(|v| **v > 150).count() > 30, "{text}");
            let border = strip.row(0).iter().chain(strip.row(25)).chain(strip.column(0)).chain(strip.column(columns - 1)).all(|v| *v == 0);
            assert!(border, "{text}");
        }
        assert!(name_strip("x", 9000).is_err());
    }

    #[test]
    fn colours_rise_from_black() {
        let sum = |level| inferno(level).iter().map(|c| u32::from(*c)).sum::<u32>();
        assert!(sum(0) < 10 && (1..=255).all(|l| sum(l) + 3 >= sum(l - 1)));
    }
}
