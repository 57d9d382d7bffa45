//! Options of every image: one type for the library, the command line and the files of `run` and `study`.

use super::size_tuning::SizeTuning;
use super::split::BackgroundChoice;
use crate::Result;
use crate::fourier::GridOptions;
use crate::memory::MemoryBudget;
use crate::nearfield::{RangeChoice, Surface};
use crate::values::{by_text, need};
use cittert_arrays::quantity::Angle;
use cittert_arrays::{NearField, Polarization, RestoringBeam, SkyGrid, Weighting};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// Grid, weights and accuracy of an image.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args, schemars::JsonSchema))]
#[cfg_attr(feature = "cli", command(next_help_heading = "Image"))]
pub struct ImagingOptions {
    /// Number of pixels along each side, or COLUMNSxROWS [default: chosen from the coverage].
    #[cfg_attr(feature = "cli", arg(long, value_name = "N"))]
    pub size: Option<ImageSize>,
    /// Size of a pixel [default: chosen from the coverage].
    #[cfg_attr(feature = "cli", arg(long, value_name = "ANGLE"))]
    pub cell: Option<Angle>,
    /// Scheme of the weights.
    #[cfg_attr(feature = "cli", arg(long, value_name = "SCHEME", value_enum, hide_possible_values = true, default_value_t = ImagingOptions::default().weighting))]
    pub weighting: Weighting,
    /// Robustness of briggs weights, from -2 (close to uniform) to 2 (close to natural) [default: 0].
    #[cfg_attr(feature = "cli", arg(long, value_name = "R", allow_negative_numbers = true))]
    pub robust: Option<f64>,
    /// Super-uniform weights: the cells of the density of weights are wider by this factor.
    #[cfg_attr(feature = "cli", arg(long, value_name = "X", default_value_t = ImagingOptions::default().super_uniform))]
    pub super_uniform: f64,
    /// Gaussian taper that acts on the image like a smoothing to this full width at half maximum.
    #[cfg_attr(feature = "cli", arg(long, value_name = "ANGLE"))]
    pub taper: Option<Angle>,
    /// Gaussian taper of the short baselines that removes structure wider than this full width at half maximum.
    #[cfg_attr(feature = "cli", arg(long, value_name = "ANGLE"))]
    pub inner_taper: Option<Angle>,
    /// Give every usable visibility the weight 1 instead of its weight in the file.
    #[cfg_attr(feature = "cli", arg(long))]
    pub unit_weights: bool,
    /// Stokes parameter or correlation product to image.
    #[cfg_attr(feature = "cli", arg(long, value_name = "POL", default_value_t = ImagingOptions::default().pol))]
    pub pol: Polarization,
    /// Number of output channels. The channels are divided evenly among them, in order.
    #[cfg_attr(feature = "cli", arg(long, value_name = "N", default_value_t = ImagingOptions::default().channels_out))]
    pub channels_out: usize,
    /// Weight each output channel with the density of all channels together.
    #[cfg_attr(feature = "cli", arg(long))]
    pub joint_weights: bool,
    /// Relative error of the transforms between visibilities and image. Grids are in double precision if it is less than 1e-5.
    #[cfg_attr(feature = "cli", arg(long, value_name = "X", default_value_t = ImagingOptions::default().epsilon))]
    pub epsilon: f64,
    /// Leave out the w term.
    #[cfg_attr(feature = "cli", arg(long))]
    pub no_w: bool,
    /// Restoring beam MAJOR,MINOR,PA such as 12arcsec,8arcsec,30deg [default: fitted to the dirty beam].
    #[cfg_attr(feature = "cli", arg(long, value_name = "BEAM"))]
    pub beam: Option<BeamShape>,
    /// Uniform background that elements with a pattern see: it is taken out of visibilities in K sr before an image is made, and put back into the
    /// image. auto (by total power, or fitted to the visibilities), none or a temperature.
    #[cfg_attr(feature = "cli", arg(long, value_name = "auto|none|TEMP", default_value_t = ImagingOptions::default().background))]
    pub background: BackgroundChoice,
    /// Image by exact spherical waves from a scene at this distance: a plane across the boresight (10m), a sphere around the array (sphere:10m), a FITS image of
    /// distances in m, or auto (what the set says of its scene or its focus) [default: a Fourier image].
    #[cfg_attr(feature = "cli", arg(long, value_name = "RANGE"))]
    pub range: Option<RangeChoice>,
    /// The map of distances of the range, once it is read.
    #[serde(skip)]
    #[cfg_attr(feature = "cli", arg(skip))]
    pub surface: Option<Surface>,
    /// Memory that the visibilities, the grid and their buffers share.
    #[serde(skip)]
    #[cfg_attr(feature = "cli", arg(skip))]
    pub memory: MemoryBudget,
    /// Rules for a size and a cell that are chosen from the coverage.
    #[serde(skip)]
    #[cfg_attr(feature = "cli", arg(skip))]
    pub sizes: SizeTuning,
}

impl Default for ImagingOptions {
    fn default() -> Self {
        Self {
            size: None,
            cell: None,
            weighting: Weighting::Uniform,
            robust: None,
            super_uniform: 1.0,
            taper: None,
            inner_taper: None,
            unit_weights: false,
            pol: Polarization::I,
            channels_out: 1,
            joint_weights: false,
            epsilon: 1e-5,
            no_w: false,
            beam: None,
            background: BackgroundChoice::Auto,
            range: None,
            surface: None,
            memory: MemoryBudget::default(),
            sizes: SizeTuning::default(),
        }
    }
}

impl ImagingOptions {
    /// Check the numbers of the weights.
    ///
    /// # Errors
    /// A robustness, factor or taper that is not finite or out of range.
    pub fn check(&self) -> Result<()> {
        let robust = self.robust.unwrap_or(0.0);
        need("robust", robust, (-2.0..=2.0).contains(&robust), "a number from -2 (uniform) to 2 (natural)")?;
        let used = self.robust.is_none() || self.weighting == Weighting::Briggs;
        need("robust", robust, used, "no robustness, or the weighting briggs, which alone uses it")?;
        need("super-uniform", self.super_uniform, (1.0..=1000.0).contains(&self.super_uniform), "a factor from 1 to 1000")?;
        let used = self.super_uniform == 1.0 || self.weighting != Weighting::Natural;
        need("super-uniform", self.super_uniform, used, "1, or the weighting uniform or briggs, which alone use it")?;
        for (field, taper) in [("taper", self.taper), ("inner-taper", self.inner_taper)] {
            let width = taper.unwrap_or(Angle(1.0));
            need(field, width, width.si().is_finite() && width.si() > 0.0, "a positive angle")?;
        }
        need("epsilon", self.epsilon, (1e-13..=0.5).contains(&self.epsilon), "a relative error from 1e-13 to 0.5")
    }

    /// The surface of the scene, for images by spherical waves of a set that says this of the near field; `None` for Fourier images.
    ///
    /// # Errors
    /// A distance that is not positive, a map that was not read, a set that does not say where its scene is.
    pub fn surface_of(&self, near: &NearField) -> Result<Option<Surface>> {
        match (&self.surface, &self.range) {
            (Some(surface), _) => Ok(Some(surface.clone())),
            (None, None) => Ok(None),
            (None, Some(choice)) => choice.surface_of(near).map(Some),
        }
    }

    /// The same options with the size and the cell of a grid.
    #[must_use]
    pub fn on_grid(&self, grid: &SkyGrid) -> Self {
        let size = Some(ImageSize { columns: grid.n_l, rows: grid.n_m });
        Self { size, cell: Some(Angle(grid.cell_rad)), ..self.clone() }
    }

    pub(crate) fn grid_options(&self) -> GridOptions {
        GridOptions { epsilon: self.epsilon, w_term: !self.no_w, divide_by_n: false, memory: self.memory }
    }
}

/// Number of pixels of an image: 512, or 512x256.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ImageSize {
    /// Pixels along l.
    pub columns: usize,
    /// Pixels along m.
    pub rows: usize,
}
by_text!(ImageSize, ["integer", "string"], "Number of pixels along each side such as 512, or COLUMNSxROWS such as \"512x256\".");

impl ImageSize {
    /// A square image.
    #[must_use]
    pub fn square(side: usize) -> Self {
        Self { columns: side, rows: side }
    }
}

impl fmt::Display for ImageSize {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.columns == self.rows { write!(f, "{}", self.columns) } else { write!(f, "{}x{}", self.columns, self.rows) }
    }
}

impl FromStr for ImageSize {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let (columns, rows) = text.split_once('x').unwrap_or((text, text));
        match (columns.trim().parse(), rows.trim().parse()) {
            (Ok(columns), Ok(rows)) => Ok(Self { columns, rows }),
            _ => Err(format!("{text:?} is not a size: give a number of pixels such as 512, or COLUMNSxROWS")),
        }
    }
}

/// A restoring beam, written MAJOR,MINOR,PA.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeamShape {
    /// Full width at half maximum along the major axis.
    pub major: Angle,
    /// Full width at half maximum along the minor axis.
    pub minor: Angle,
    /// Position angle of the major axis.
    pub position_angle: Angle,
}
by_text!(BeamShape, "string", "MAJOR,MINOR,PA as angles, such as \"12arcsec,8arcsec,30deg\".");

impl BeamShape {
    /// The beam in radians.
    #[must_use]
    pub fn restoring(self) -> RestoringBeam {
        RestoringBeam { bmaj_rad: self.major.si(), bmin_rad: self.minor.si(), bpa_rad: self.position_angle.si() }
    }
}

impl fmt::Display for BeamShape {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{},{},{}", self.major, self.minor, self.position_angle)
    }
}

impl FromStr for BeamShape {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let angles = text.split(',').map(str::parse::<Angle>).collect::<std::result::Result<Vec<_>, _>>();
        match angles.map_err(|e| e.to_string())?.as_slice() {
            &[major, minor, position_angle] if major.si() >= minor.si() && minor.si() > 0.0 => Ok(Self { major, minor, position_angle }),
            _ => Err(format!("{text:?} is not a beam MAJOR,MINOR,PA with MAJOR at least MINOR, such as 12arcsec,8arcsec,30deg")),
        }
    }
}
