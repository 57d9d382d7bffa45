//! Images that options name: masks, and priors of maximum entropy.

use crate::cli::failure::{Context as _, Failure, Result};
use crate::deconvolve::CleanOptions;
use crate::mem::PriorChoice;
use cittert_arrays::{Image, SkyGrid};
use ndarray::Array2;
use std::path::{Path, PathBuf};

/// The pixels of a FITS image on `grid` that are above 0.
///
/// # Errors
/// A file that is no image, or an image on another grid.
pub fn fits_mask(path: &Path, grid: &SkyGrid) -> Result<Array2<bool>> {
    let image = cittert_formats::open_image(path)?;
    crate::fidelity::check_alignment(&image.grid, grid).context(format!("{}: the mask does not fit the image", path.display()))?;
    Ok(image.plane(0, 0).mapv(|v| v > 0.0))
}

/// Options of CLEAN with their mask and boxes loaded for an image on `grid`.
///
/// # Errors
/// The mask cannot be read or is on another grid, or no pixel is allowed.
pub fn loaded(options: &CleanOptions, grid: &SkyGrid) -> Result<CleanOptions> {
    let mask = options.mask.as_deref().map(|path| fits_mask(path, grid)).transpose()?;
    let chosen = options.clone().with_region(mask, grid);
    match &options.mask {
        Some(path) => chosen.context(path.display()),
        None => Ok(chosen?),
    }
}

/// The file of a prior, where it is one.
pub fn prior_file(prior: &PriorChoice) -> Option<&PathBuf> {
    if let PriorChoice::File(path) = prior { Some(path) } else { None }
}

/// The image of a prior, where it is one.
///
/// # Errors
/// A text that is neither a brightness nor the path of an image.
pub fn prior_image(prior: Option<&PriorChoice>) -> Result<Option<Image>> {
    let Some(PriorChoice::File(path)) = prior else { return Ok(None) };
    if !path.exists() {
        return Err(Failure::usage(format!(
            "--prior is {:?}, expected a temperature such as 250K, a flux density in a pixel such as 1mJy, a FITS image, or smoothed",
            path.display().to_string()
        )));
    }
    Ok(Some(cittert_formats::open_image(path)?))
}
