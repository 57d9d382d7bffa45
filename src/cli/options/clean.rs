//! Options of CLEAN.

use crate::cli::failure::{Context as _, Failure, Result};
use crate::deconvolve::{DeconvolveOptions, by_name};
use crate::imaging::major::CleanOptions;
use cittert_arrays::SkyGrid;
use cittert_arrays::quantity::{Angle, FluxDensity, Temperature};
use clap::Args;
use ndarray::Array2;
use std::path::{Path, PathBuf};

/// How to clean.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "CLEAN")]
pub struct CleanArgs {
    /// hogbom, clark or multiscale; in `selfcal` also mem, which solves image and gains together by maximum entropy.
    #[arg(long, visible_alias = "deconvolver", value_name = "NAME", default_value = "hogbom")]
    algorithm: String,
    /// Part of the peak that one component takes.
    #[arg(long, value_name = "X", default_value_t = 0.1)]
    gain: f64,
    /// Largest number of components.
    #[arg(long, value_name = "N", default_value_t = 1000)]
    niter: usize,
    /// Peak at which to stop, such as 1mJy (a beam) or 2K.
    #[arg(long, value_name = "X")]
    threshold: Option<String>,
    /// Stop at this multiple of the robust noise of the residual (1.4826 MAD); 0 is off.
    #[arg(long, value_name = "X", default_value_t = 0.0)]
    nsigma: f64,
    /// Part by which a minor cycle may bring the peak down.
    #[arg(long, value_name = "X", default_value_t = 0.8)]
    mgain: f64,
    /// A minor cycle stops at this times the largest side lobe times the peak.
    #[arg(long, value_name = "X", default_value_t = 1.5)]
    cyclefactor: f64,
    /// Largest number of major cycles.
    #[arg(long, value_name = "N", default_value_t = 100)]
    max_major: usize,
    /// FITS image on the same grid; components only where it is above 0.
    #[arg(long, value_name = "FITS")]
    mask: Option<PathBuf>,
    /// Components only in this box of l and m: L0,M0,L1,M1 as angles (may be repeated).
    #[arg(long = "box", value_name = "L0,M0,L1,M1", allow_hyphen_values = true)]
    boxes: Vec<String>,
    /// Make and grow a mask of what stands so many times above the noise.
    #[arg(long, value_name = "X")]
    auto_mask: Option<f64>,
    /// Take positive components only.
    #[arg(long)]
    no_negative: bool,
    /// Scales of multiscale in pixels, 0 for points [default: from the beam and the size].
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    scales: Vec<f64>,
    /// How much multiscale favours small scales.
    #[arg(long, value_name = "X", default_value_t = 0.6)]
    scale_bias: f64,
}

impl CleanArgs {
    /// The library's options for an image on `grid`.
    ///
    /// # Errors
    /// An unknown algorithm, a threshold or box that cannot be read, a mask on another grid.
    pub fn options(&self, grid: &SkyGrid) -> Result<CleanOptions> {
        Ok(CleanOptions {
            algorithm: by_name(&self.algorithm)?,
            deconvolve: DeconvolveOptions { scales_px: self.scales.clone(), scale_bias: self.scale_bias, ..DeconvolveOptions::default() },
            gain: self.gain,
            niter: self.niter,
            threshold: self.threshold.as_deref().map(threshold).transpose()?.unwrap_or(0.0),
            nsigma: self.nsigma,
            mgain: self.mgain,
            cyclefactor: self.cyclefactor,
            mask: self.mask(grid)?,
            auto_mask: self.auto_mask,
            negative: !self.no_negative,
            max_major: self.max_major,
            ..CleanOptions::default()
        })
    }

    /// Name of the deconvolver.
    #[must_use]
    pub fn algorithm(&self) -> &str {
        &self.algorithm
    }

    /// Where components may be; `None` without a mask or box.
    ///
    /// # Errors
    /// A mask that cannot be read or is on another grid, a box that cannot be read, no pixel left.
    pub fn mask(&self, grid: &SkyGrid) -> Result<Option<Array2<bool>>> {
        let mut mask = self.mask.as_deref().map(|path| fits_mask(path, grid)).transpose()?;
        if !self.boxes.is_empty() {
            let boxes = self.boxes.iter().map(|b| corners(b)).collect::<Result<Vec<_>>>()?;
            let all = mask.get_or_insert_with(|| Array2::from_elem((grid.n_m, grid.n_l), false));
            for ((row, column), inside) in all.indexed_iter_mut() {
                let (l, m) = (grid.l_at(column as f64), grid.m_at(row as f64));
                *inside |= boxes.iter().any(|b| l >= b[0].min(b[2]) && l <= b[0].max(b[2]) && m >= b[1].min(b[3]) && m <= b[1].max(b[3]));
            }
        }
        match mask {
            Some(m) if !m.iter().any(|x| *x) => Err(Failure::message("the mask leaves no pixel for components: widen --mask or --box")),
            mask => Ok(mask),
        }
    }
}

/// `1mJy` or `2K` in SI.
fn threshold(text: &str) -> Result<f64> {
    if let Ok(flux) = text.parse::<FluxDensity>() {
        return Ok(flux.si());
    }
    text.parse::<Temperature>()
        .map(|t| t.si())
        .map_err(|_| Failure::usage(format!("--threshold is {text:?}, expected a flux density such as 1mJy or a temperature such as 2K")))
}

fn corners(text: &str) -> Result<[f64; 4]> {
    let parts: std::result::Result<Vec<f64>, _> = text.split(',').map(|t| t.parse::<Angle>().map(|a| a.si())).collect();
    let wrong =
        || Failure::usage(format!("--box is {text:?}, expected four angles L0,M0,L1,M1 such as -10arcsec,-5arcsec,10arcsec,5arcsec"));
    parts.ok().and_then(|p| p.try_into().ok()).ok_or_else(wrong)
}

fn fits_mask(path: &Path, grid: &SkyGrid) -> Result<Array2<bool>> {
    let image = cittert_formats::open_image(path)?;
    crate::fidelity::check_alignment(&image.grid, grid).context(format!("{}: the mask does not fit the image", path.display()))?;
    Ok(image.plane(0, 0).mapv(|v| v > 0.0))
}
