//! FITS images in the table of formats.

use super::header::Header;
use super::image_read::read_image;
use super::image_write::{ImageOptions, write_image};
use super::input::Input;
use crate::format::{Format, Holds, ImageFormat, Label};
use cittert_arrays::Image;
use std::path::Path;

pub(crate) struct FitsImage;

impl Format for FitsImage {
    fn label(&self) -> Label {
        Label {
            name: "FITS image",
            extensions: &["fits", "fit", "fts", "fits.gz"],
            description: "images and cubes in K, Jy/pixel or Jy/beam, on the sky or along a boresight",
        }
    }

    fn sniff(&self, path: &Path, start: &[u8]) -> bool {
        let plain = start.starts_with(b"SIMPLE  =") && !is_random_groups(start);
        plain || (start.starts_with(&[0x1f, 0x8b]) && Input::open(path).and_then(|mut input| Header::read(&mut input, true)).is_ok())
    }

    fn holds(&self) -> Holds<'_> {
        let write = |path: &Path, image: &Image, overwrite| write_image(path, image, ImageOptions { overwrite, double: false });
        Holds::Images(ImageFormat { read: read_image, write })
    }
}

/// True where the primary header is that of FITS random groups (UVFITS). `start` is the beginning of the file.
pub(crate) fn is_random_groups(start: &[u8]) -> bool {
    let card = |key: &str, value: &str| {
        start.chunks_exact(80).any(|c| {
            let text = String::from_utf8_lossy(c);
            text.starts_with(&format!("{key:<8}=")) && text[9..].split('/').next().is_some_and(|v| v.trim() == value)
        })
    };
    start.starts_with(b"SIMPLE  =") && card("GROUPS", "T") && card("NAXIS1", "0")
}
