//! A finished picture, which can be written in several formats.

use super::canvas::Canvas;
use super::pdf::pdf;
use super::vector::svg;
use crate::{ChainError, Result};
use std::path::Path;

/// A format of pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PictureFormat {
    /// Pixels.
    Png,
    /// Shapes that can be drawn at any size. The cells of an image stay pixels.
    Svg,
    /// The same shapes on a page, with the letters of the font that the picture uses.
    Pdf,
}

impl PictureFormat {
    /// The format that the ending of a name stands for.
    ///
    /// # Errors
    /// Another ending.
    pub fn of(path: &Path) -> Result<Self> {
        let end = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
        match end.as_str() {
            "png" => Ok(Self::Png),
            "svg" => Ok(Self::Svg),
            "pdf" => Ok(Self::Pdf),
            _ => Err(ChainError::bad_option("output", path.display(), "a name that ends in .png, .svg or .pdf")),
        }
    }
}

/// A finished picture.
pub struct Picture(pub(super) Canvas);

impl Picture {
    /// The picture as a PNG file.
    ///
    /// # Errors
    /// Never for a picture of this module; the encoder's error is passed on.
    pub fn png(self) -> Result<Vec<u8>> {
        self.0.png()
    }

    /// The picture as a file of this format.
    ///
    /// # Errors
    /// As [`Picture::png`].
    pub fn file(self, format: PictureFormat) -> Result<Vec<u8>> {
        match format {
            PictureFormat::Png => self.png(),
            PictureFormat::Svg => {
                let (width, height) = self.0.size();
                Ok(svg(width, height, self.0.shapes())?.into_bytes())
            }
            PictureFormat::Pdf => {
                let (width, height) = self.0.size();
                pdf(width, height, self.0.shapes())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn endings_choose_the_format_or_are_refused() {
        assert_eq!(PictureFormat::of(Path::new("a.PNG")).unwrap(), PictureFormat::Png);
        assert_eq!(PictureFormat::of(Path::new("a.b.svg")).unwrap(), PictureFormat::Svg);
        assert_eq!(PictureFormat::of(Path::new("a.pdf")).unwrap(), PictureFormat::Pdf);
        for wrong in ["a.eps", "a.jpg", "a", "svg"] {
            let e = PictureFormat::of(Path::new(wrong)).unwrap_err().to_string();
            assert!(e.contains(wrong) && e.contains(".svg"), "{e}");
        }
    }
}
