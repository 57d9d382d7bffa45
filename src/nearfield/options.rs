//! Where a scene lies, as an option.

use super::surface::Surface;
use crate::values::{bad_value, by_text, need};
use crate::{ChainError, Result};
use cittert_arrays::quantity::Length;
use cittert_arrays::{NearField, SceneRange};
use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

/// The surface on which a scene lies.
#[derive(Debug, Clone, PartialEq)]
pub enum RangeChoice {
    /// What is known: the distances of a traced scene, or what a set says.
    Auto,
    /// A plane across the boresight.
    Plane(Length),
    /// A sphere around the origin of the layout.
    Sphere(Length),
    /// A FITS image of distances.
    File(PathBuf),
}
by_text!(
    RangeChoice,
    "string",
    "A distance such as \"10m\" (a plane across the boresight), \"sphere:10m\", a FITS image of distances in m, or auto."
);

impl fmt::Display for RangeChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto => f.write_str("auto"),
            Self::Plane(d) => d.fmt(f),
            Self::Sphere(d) => write!(f, "sphere:{d}"),
            Self::File(path) => path.display().fmt(f),
        }
    }
}

impl FromStr for RangeChoice {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let (kind, value) = text.split_once(':').unwrap_or(("plane", text));
        let file = [".fits", ".fit", ".fits.gz"].iter().any(|end| text.to_ascii_lowercase().ends_with(end));
        let wrong = |e: String| format!("{e}; give a distance such as 10m, sphere:10m, a FITS image of distances, or auto");
        match kind {
            _ if text == "auto" => Ok(Self::Auto),
            _ if file => Ok(Self::File(text.into())),
            "plane" => value.parse().map(Self::Plane).map_err(|e| wrong(format!("{e}"))),
            "sphere" => value.parse().map(Self::Sphere).map_err(|e| wrong(format!("{e}"))),
            _ => Err(wrong(format!("{text:?} is no surface"))),
        }
    }
}

impl RangeChoice {
    /// The surface, if it needs no file and nothing that is known.
    ///
    /// # Errors
    /// A distance that is not positive.
    pub fn surface(&self) -> Result<Option<Surface>> {
        let (Self::Plane(d) | Self::Sphere(d)) = self else { return Ok(None) };
        need("range", self, d.si() > 0.0 && d.si().is_finite(), "a positive distance such as 10m")?;
        Ok(Some(if matches!(self, Self::Plane(_)) { Surface::Plane(d.si()) } else { Surface::Sphere(d.si()) }))
    }

    /// The surface for a set that says this of the near field. The surface that is known is that of the simulated scene, or the plane through the focus.
    ///
    /// # Errors
    /// A distance that is not positive; nothing is known, or only the name of a map; a file, which must be read first.
    pub fn surface_of(&self, near: &NearField) -> Result<Surface> {
        if let Some(surface) = self.surface()? {
            return Ok(surface);
        }
        if let Self::File(path) = self {
            return Err(ChainError::Incompatible(format!("{}: the map of distances must be loaded first", path.display())));
        }
        match (&near.scene, near.focus) {
            (Some(SceneRange::Plane { distance_m }), _) => Ok(Surface::Plane(*distance_m)),
            (Some(SceneRange::Sphere { radius_m }), _) => Ok(Surface::Sphere(*radius_m)),
            (Some(SceneRange::Map { name }), _) => {
                bad_value("range", self, format!("the FITS image of distances, as the scene of the set lies on a map ({name})"))
            }
            (None, Some(focus)) => Ok(Surface::Plane(focus.range_m * focus.direction()[2])),
            (None, None) => bad_value("range", self, "a distance such as 10m: the set is not focused and does not say where its scene is"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::FocusPoint;

    #[test]
    fn surfaces_are_read_from_their_texts() {
        for text in ["10m", "sphere:2.5m", "auto", "maps/range.fits"] {
            assert_eq!(text.parse::<RangeChoice>().unwrap().to_string(), text);
        }
        assert_eq!("plane:10m".parse::<RangeChoice>().unwrap().surface().unwrap(), Some(Surface::Plane(10.0)));
        assert!("10".parse::<RangeChoice>().unwrap_err().contains("sphere:10m"));
        assert!("cube:10m".parse::<RangeChoice>().is_err());
        assert!("-1m".parse::<RangeChoice>().unwrap().surface().is_err());
    }

    #[test]
    fn what_a_set_says_is_used_where_it_says_something() {
        let focus = Some(FocusPoint::new(0.6, 0.0, 10.0).unwrap());
        let of = |scene: Option<SceneRange>, focus| RangeChoice::Auto.surface_of(&NearField { scene, focus });
        assert_eq!(of(Some(SceneRange::Sphere { radius_m: 3.0 }), focus).unwrap(), Surface::Sphere(3.0));
        assert_eq!(of(None, focus).unwrap(), Surface::Plane(8.0));
        assert!(of(None, None).unwrap_err().to_string().contains("not focused"));
        assert!(of(Some(SceneRange::map("a.fits")), None).unwrap_err().to_string().contains("a.fits"));
    }
}
