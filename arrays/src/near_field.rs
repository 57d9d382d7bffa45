//! What a set says of the near field: where its scene lies, and the point to which its visibilities are phased.
//!
//! The uvw of a set in the near field stay the true differences of positions. They no longer tell the phase of a visibility: a point at a finite distance has
//! its own path to each antenna, so that the layout and the pair of antennas are needed.

use crate::{ArrayError, Result};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// Longest name of a map, so that it fits one card of a FITS header.
const NAME: usize = 60;

/// The surface on which a scene lies. Distances count from the origin of the layout.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum SceneRange {
    /// A plane across the boresight at this distance, m.
    Plane {
        /// Distance along the boresight, m.
        distance_m: f64,
    },
    /// A sphere around the origin of the layout.
    Sphere {
        /// Radius, m.
        radius_m: f64,
    },
    /// A map of distances.
    Map {
        /// Name of its file or scene.
        name: String,
    },
}

impl SceneRange {
    /// A map of this name, shortened where it is long.
    #[must_use]
    pub fn map(name: &str) -> Self {
        Self::Map { name: name.trim().chars().filter(|c| c.is_ascii_graphic() || *c == ' ').take(NAME).collect() }
    }
}

impl fmt::Display for SceneRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Plane { distance_m } => write!(f, "plane {distance_m:?}"),
            Self::Sphere { radius_m } => write!(f, "sphere {radius_m:?}"),
            Self::Map { name } => write!(f, "map {name}"),
        }
    }
}

impl FromStr for SceneRange {
    type Err = ArrayError;

    /// A surface from the text that it prints.
    fn from_str(text: &str) -> Result<Self> {
        let wrong = || ArrayError::Parse(format!("{text:?} is not the range of a scene: expected plane METRES, sphere METRES or map NAME"));
        let (kind, value) = text.trim().split_once(' ').unwrap_or((text.trim(), ""));
        let metres = || value.trim().parse().ok().filter(|d: &f64| *d > 0.0).ok_or_else(wrong);
        match kind {
            "plane" => Ok(Self::Plane { distance_m: metres()? }),
            "sphere" => Ok(Self::Sphere { radius_m: metres()? }),
            "map" => Ok(Self::map(value)),
            _ => Err(wrong()),
        }
    }
}

/// The point to which the visibilities of a set are phased: those of a source there have phase 0.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FocusPoint {
    /// Direction cosine to the right of the boresight.
    pub l: f64,
    /// Direction cosine above the boresight.
    pub m: f64,
    /// Distance from the origin of the layout, m.
    pub range_m: f64,
}

impl FocusPoint {
    /// A point in front of the array.
    ///
    /// # Errors
    /// A direction behind the horizon, a distance that is not positive.
    pub fn new(l: f64, m: f64, range_m: f64) -> Result<Self> {
        let point = Self { l, m, range_m };
        ArrayError::unless(l * l + m * m < 1.0, "direction of the focus", format_args!("l = {l}, m = {m}"), "l^2 + m^2 < 1")?;
        ArrayError::unless(range_m > 0.0 && range_m.is_finite(), "distance of the focus in m", range_m, "a positive distance")?;
        Ok(point)
    }

    /// Direction cosines to the right, up and along the boresight.
    #[must_use]
    pub fn direction(&self) -> [f64; 3] {
        [self.l, self.m, (1.0 - self.l * self.l - self.m * self.m).max(0.0).sqrt()]
    }

    /// True if it lies on the boresight.
    #[must_use]
    pub fn is_on_axis(&self) -> bool {
        self.l == 0.0 && self.m == 0.0
    }
}

impl fmt::Display for FocusPoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "l {:?}, m {:?}, range {:?} m", self.l, self.m, self.range_m)
    }
}

/// What a set or an image says of the near field. The default is the far field.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct NearField {
    /// Where the scene lies, if that is known, as in simulated sets.
    pub scene: Option<SceneRange>,
    /// The point to which the visibilities are phased; `None` is the direction of the boresight.
    pub focus: Option<FocusPoint>,
}

impl NearField {
    /// True if nothing is said.
    #[must_use]
    pub fn is_far(&self) -> bool {
        *self == Self::default()
    }

    /// As in files: the text of the surface, and l, m and range of the focus.
    #[must_use]
    pub fn to_parts(&self) -> (Option<String>, [Option<f64>; 3]) {
        (self.scene.as_ref().map(ToString::to_string), [self.focus.map(|p| p.l), self.focus.map(|p| p.m), self.focus.map(|p| p.range_m)])
    }

    /// From the values of a file. A focus without a direction lies on the boresight.
    ///
    /// # Errors
    /// A text that is no surface, a point that is not in front of the array.
    pub fn of_parts(scene: Option<&str>, [l, m, range_m]: [Option<f64>; 3]) -> Result<Self> {
        let scene = scene.filter(|t| !t.trim().is_empty()).map(str::parse).transpose()?;
        let focus = range_m.map(|r| FocusPoint::new(l.unwrap_or(0.0), m.unwrap_or(0.0), r)).transpose()?;
        Ok(Self { scene, focus })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_comes_back_with_all_digits() {
        let surfaces =
            [SceneRange::Plane { distance_m: 10.0 / 3.0 }, SceneRange::Sphere { radius_m: 1e12 }, SceneRange::map("runway range.fits")];
        for scene in surfaces {
            let text = scene.to_string();
            assert_eq!(text.parse::<SceneRange>().unwrap(), scene, "{text}");
            let near = NearField { scene: Some(scene), focus: Some(FocusPoint::new(0.1, -0.2, 31.25).unwrap()) };
            let (text, numbers) = near.to_parts();
            assert_eq!(NearField::of_parts(text.as_deref(), numbers).unwrap(), near);
        }
        assert!(NearField::of_parts(None, [Some(0.1), None, None]).unwrap().is_far());
        assert!(SceneRange::map(&"x".repeat(200)).to_string().len() <= 68);
    }

    #[test]
    fn impossible_places_are_refused() {
        for text in ["plane", "plane -1", "sphere nan", "cube 3", ""] {
            assert!(text.parse::<SceneRange>().is_err(), "{text}");
        }
        assert!(FocusPoint::new(0.8, 0.8, 1.0).is_err());
        assert!(FocusPoint::new(0.0, 0.0, -1.0).is_err());
        assert!(FocusPoint::new(0.0, 0.0, f64::NAN).is_err());
    }
}
