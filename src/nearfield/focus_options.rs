//! Options of a focus.

use crate::values::{by_text, need, word_or_quantity};
use crate::{ChainError, Result, ensure};
use cittert_arrays::quantity::{Angle, Length};
use cittert_arrays::{FocusPoint, SPEED_OF_LIGHT_M_S, SkyFrame, SkyGrid, VisibilityHeader};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// The distance to which a set is focused.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FocusRange {
    /// Where the image is sharpest.
    Auto,
    /// The far field: an earlier focus is undone.
    Infinity,
    /// This distance from the origin of the layout.
    At(Length),
}
word_or_quantity!(
    FocusRange,
    "auto" => Auto,
    "infinity" => Infinity,
    At(Length),
    "A distance such as \"10m\", auto or infinity."
);

/// Direction cosines, written as two angles L,M.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FocusDirection {
    /// To the right.
    pub l: Angle,
    /// Up.
    pub m: Angle,
}
by_text!(FocusDirection, "string", "Direction cosines L,M as angles, such as \"2deg,-1deg\".");

impl fmt::Display for FocusDirection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{},{}", self.l, self.m)
    }
}

impl FromStr for FocusDirection {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let (l, m) = text.split_once(',').ok_or_else(|| format!("{text:?} is no direction: give L,M as two angles such as 2deg,-1deg"))?;
        let part = |t: &str| t.trim().parse::<Angle>().map_err(|e| e.to_string());
        Ok(Self { l: part(l)?, m: part(m)? })
    }
}

/// The point to which a set is phased, and the field in which it is judged.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args, schemars::JsonSchema))]
pub struct FocusOptions {
    /// Distance of the focus from the origin of the layout, auto (where the image is sharpest) or infinity (undo a focus).
    #[cfg_attr(feature = "cli", arg(long, value_name = "auto|infinity|LENGTH"))]
    pub range: FocusRange,
    /// Direction of the focus: direction cosines to the right of the boresight and above it, as angles [default: 0deg,0deg].
    #[serde(default)]
    #[cfg_attr(feature = "cli", arg(long, value_name = "L,M", allow_hyphen_values = true))]
    pub at: Option<FocusDirection>,
    /// Nearest distance that auto tries [default: twice the extent of the array].
    #[serde(default)]
    #[cfg_attr(feature = "cli", arg(long, value_name = "LENGTH"))]
    pub nearest: Option<Length>,
    /// Number of pixels along each side of the field in which the focus is judged and searched [default: chosen from the scene and the array].
    #[serde(default)]
    #[cfg_attr(feature = "cli", arg(long, value_name = "N"))]
    pub size: Option<usize>,
    /// Size of a pixel of this field [default: a third of a fringe of the longest baseline].
    #[serde(default)]
    #[cfg_attr(feature = "cli", arg(long, value_name = "ANGLE"))]
    pub cell: Option<Angle>,
}

impl FocusOptions {
    /// Check the numbers, and that each is used.
    ///
    /// # Errors
    /// A distance that is not positive, a direction behind the horizon, an option that would have no effect.
    pub fn check(&self) -> Result<()> {
        if let FocusRange::At(d) = self.range {
            need("range", d, d.si() > 0.0 && d.si().is_finite(), "a positive distance such as 10m, auto or infinity")?;
        }
        if let Some(d) = self.nearest {
            need("nearest", d, d.si() > 0.0 && d.si().is_finite(), "a positive distance")?;
            need("nearest", d, self.range == FocusRange::Auto, "no distance, or the range auto, which alone uses it")?;
        }
        if let Some(at) = self.at {
            need("at", at, self.range != FocusRange::Infinity, "no direction: at infinity the set is phased to its boresight")?;
        }
        if let Some(n) = self.size {
            need("size", n, (8..=4096).contains(&n), "8 to 4096 pixels")?;
        }
        Ok(())
    }

    /// The point; `plane_m` is the distance of the plane that auto found. `None` is the boresight at infinity.
    ///
    /// # Errors
    /// A direction behind the horizon.
    pub fn point(&self, plane_m: Option<f64>) -> Result<Option<FocusPoint>> {
        let (l, m) = self.at.map_or((0.0, 0.0), |at| (at.l.si(), at.m.si()));
        let depth = (1.0 - l * l - m * m).max(0.0).sqrt();
        match (self.range, plane_m) {
            (FocusRange::Infinity, _) => Ok(None),
            (FocusRange::At(d), _) => Ok(Some(FocusPoint::new(l, m, d.si())?)),
            (FocusRange::Auto, Some(plane)) => Ok(Some(FocusPoint::new(l, m, plane / depth)?)),
            (FocusRange::Auto, None) => Err(ChainError::Internal("the range was not searched".into())),
        }
    }

    /// The nearest distance that auto tries, m.
    #[must_use]
    pub fn nearest_m(&self, header: &VisibilityHeader) -> f64 {
        let reach = header.layout.antennas().iter().map(|a| a.position_m.iter().map(|x| x * x).sum::<f64>().sqrt()).fold(0.0, f64::max);
        self.nearest.map_or(4.0 * reach, |d| d.si())
    }
}

/// Largest side of a field that is chosen, pixels.
const LARGEST_FIELD: usize = 192;
/// Widest field that is chosen, as a difference of direction cosines.
const WIDEST_FIELD: f64 = 0.5;

/// The field in which a focus is searched, with a third of a fringe a pixel, or judged, as wide as the simulated scene; a cell that is given is that of both.
///
/// # Errors
/// A layout without a baseline, a cell that is not positive, a field beyond the horizon.
pub fn focus_grid(options: &FocusOptions, header: &VisibilityHeader, search: bool) -> Result<SkyGrid> {
    let antennas = header.layout.antennas();
    let apart = |a: [f64; 3], b: [f64; 3]| (a[0] - b[0]).hypot(a[1] - b[1]);
    let longest = antennas.iter().enumerate().flat_map(|(k, a)| antennas[..k].iter().map(move |b| apart(a.position_m, b.position_m)));
    let fringe = SPEED_OF_LIGHT_M_S / header.spectrum.range_hz().1 / longest.fold(0.0, f64::max);
    ensure!(fringe.is_finite(), ChainError::NoData("all antennas of the layout are in one place: it has no baseline to focus".into()));
    let width = header.scene_width_rad.unwrap_or(WIDEST_FIELD).min(WIDEST_FIELD);
    let fine = options.cell.map_or(fringe / 3.0, |c| c.si());
    let side = options.size.unwrap_or_else(|| ((width / fine).ceil() as usize).clamp(16, LARGEST_FIELD).next_multiple_of(2));
    let cell = if search || options.cell.is_some() { fine } else { width / side as f64 };
    Ok(SkyGrid::new(side, side, cell, SkyFrame::Boresight)?)
}
