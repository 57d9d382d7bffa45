//! Layouts as TOML: the format of the built-in arrays and of layouts that users write.
//!
//! ```toml
//! name = "demo"
//! frame = "boresight"            # or "enu" or "ecef"
//! source = "where the positions come from"
//! aperture_m = 1.0               # if the array was designed for an aperture
//! mount = "fixed"                # or "alt-az", "equatorial", "alt-az+nasmyth-r", "alt-az+nasmyth-l", if the feeds turn with it
//!
//! [[antenna]]
//! name = "E1"
//! position_m = [0.0, 0.0, 0.0]
//! diameter_m = 0.01
//! tsys_k = 600.0                 # or sefd_jy
//! position_error_m = [1e-5, 1e-5, 2e-5]
//!
//! [pattern]                      # power pattern of every antenna, if the layout states one
//! kind = "airy"
//! ```

use crate::feeds::Mount;
use crate::pattern::in_toml;
use crate::{Antenna, ArrayError, ArrayLayout, ElementPattern, LayoutFrame, Result, Sensitivity, Site};
use serde::Deserialize;
use std::collections::HashMap;
use std::fmt::Write;
use std::ops::Range;
use toml::Spanned;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LayoutToml {
    name: String,
    frame: Spanned<String>,
    source: Option<String>,
    aperture_m: Option<Spanned<f64>>,
    mount: Option<Spanned<String>>,
    site: Option<Spanned<SiteToml>>,
    pattern: Option<Spanned<toml::Table>>,
    #[serde(default)]
    antenna: Vec<AntennaToml>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SiteToml {
    latitude_deg: f64,
    longitude_deg: f64,
    #[serde(default)]
    altitude_m: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AntennaToml {
    name: Spanned<String>,
    number: Option<u32>,
    position_m: Spanned<[f64; 3]>,
    diameter_m: Option<Spanned<f64>>,
    sefd_jy: Option<Spanned<f64>>,
    tsys_k: Option<Spanned<f64>>,
    position_error_m: Option<Spanned<[f64; 3]>>,
}

impl ArrayLayout {
    /// A layout from its TOML text.
    ///
    /// Positions in `ecef` become east, north, up about the given site, or about a site made from the centroid.
    ///
    /// # Errors
    /// A text that is not TOML, an unknown key, a missing or wrong value (each with line and column); a missing site for `enu`, or a site
    /// with `boresight`; and the errors of [`ArrayLayout::new`].
    pub fn from_toml(text: &str) -> Result<Self> {
        let refuse = |file: &str| {
            Err(ArrayError::Parse(format!(
                "the pattern is in the file {file:?}, but this text has no folder: state its samples in the layout"
            )))
        };
        Self::from_toml_with(text, &refuse)
    }

    /// As [`ArrayLayout::from_toml`], for texts that may name a file with the pattern of the antennas, which `read` reads.
    ///
    /// # Errors
    /// As [`ArrayLayout::from_toml`], and those of `read`.
    pub fn from_toml_with(text: &str, read: &dyn Fn(&str) -> Result<ElementPattern>) -> Result<Self> {
        let raw: LayoutToml = toml::from_str(text).map_err(|e| match e.span() {
            Some(span) => at(text, span, e.message()),
            None => ArrayError::Parse(e.message().into()),
        })?;
        let site = raw.site.as_ref().map(|s| {
            let s = s.get_ref();
            Site { latitude_rad: s.latitude_deg.to_radians(), longitude_rad: s.longitude_deg.to_radians(), altitude_m: s.altitude_m }
        });
        if let Some(s) = raw.site.as_ref().filter(|s| !(s.get_ref().latitude_deg.abs() <= 90.0)) {
            return Err(at(text, s.span(), &format!("latitude_deg is {}, expected -90 to 90", s.get_ref().latitude_deg)));
        }
        let mut antennas = Vec::with_capacity(raw.antenna.len());
        let mut lines = HashMap::new();
        for (i, a) in raw.antenna.into_iter().enumerate() {
            let span = a.name.span();
            if lines.insert(a.name.get_ref().clone(), span.clone()).is_some() {
                return Err(at(text, span, &format!("antenna name {:?} is used twice", a.name.get_ref())));
            }
            antennas.push(antenna(text, i, a)?);
        }
        let mut layout = match (raw.frame.get_ref().as_str(), site) {
            ("boresight", None) => Self::new(raw.name, LayoutFrame::Boresight, antennas),
            ("boresight", Some(_)) => {
                let span = raw.site.map_or(0..0, |s| s.span());
                Err(at(text, span, "a layout in the boresight frame has no [site]: take it out, or set frame = \"enu\""))
            }
            ("enu", Some(site)) => Self::new(raw.name, LayoutFrame::EastNorthUp(site), antennas),
            ("enu", None) => Err(at(text, raw.frame.span(), "frame \"enu\" needs a [site] with latitude_deg, longitude_deg, altitude_m")),
            ("ecef", site) => Self::from_ecef(raw.name, site, antennas),
            (other, _) => Err(at(text, raw.frame.span(), &format!("frame is {other:?}, expected \"boresight\", \"enu\" or \"ecef\""))),
        }
        .map_err(|e| match &e {
            ArrayError::CoincidentAntennas { second, .. } => match lines.remove(second) {
                Some(span) => at(text, span, &e.to_string()),
                None => e,
            },
            _ => e,
        })?;
        if let Some(a) = raw.aperture_m.as_ref().filter(|a| !(a.get_ref().is_finite() && *a.get_ref() > 0.0)) {
            return Err(at(text, a.span(), &format!("aperture_m is {}, expected a positive number of metres", a.get_ref())));
        }
        if let Some(mount) = &raw.mount {
            layout.mount = Some(Mount::named(mount.get_ref()).map_err(|e| at(text, mount.span(), &e.to_string()))?);
        }
        layout.source = raw.source;
        layout.aperture_m = raw.aperture_m.map(Spanned::into_inner);
        if let Some(table) = raw.pattern {
            let pattern = in_toml::from_table(table.get_ref(), layout.antennas(), read);
            layout.pattern = pattern.map_err(|e| at(text, table.span(), &e.to_string()))?;
        }
        Ok(layout)
    }

    /// The layout as TOML text that [`ArrayLayout::from_toml`] reads back to the same numbers.
    #[must_use]
    pub fn to_toml(&self) -> String {
        let mut t = String::new();
        let quoted = |s: &str| toml::Value::String(s.into()).to_string();
        // Writing to a String cannot fail.
        let _ = writeln!(t, "name = {}", quoted(&self.name));
        let frame = if self.site().is_some() { "enu" } else { "boresight" };
        let _ = writeln!(t, "frame = \"{frame}\"");
        if let Some(source) = &self.source {
            let _ = writeln!(t, "source = {}", quoted(source));
        }
        if let Some(aperture) = self.aperture_m {
            let _ = writeln!(t, "aperture_m = {aperture:?}");
        }
        if let Some(mount) = self.mount {
            let _ = writeln!(t, "mount = \"{}\"", mount.name());
        }
        if let Some(s) = self.site() {
            let (lat, lon) = (s.latitude_rad.to_degrees(), s.longitude_rad.to_degrees());
            let _ = write!(t, "\n[site]\nlatitude_deg = {lat:?}\nlongitude_deg = {lon:?}\naltitude_m = {:?}\n", s.altitude_m);
        }
        for (i, a) in self.antennas().iter().enumerate() {
            let _ = write!(t, "\n[[antenna]]\nname = {}\nposition_m = {:?}\n", quoted(&a.name), a.position_m);
            if a.number as usize != i {
                let _ = writeln!(t, "number = {}", a.number);
            }
            if let Some(d) = a.diameter_m {
                let _ = writeln!(t, "diameter_m = {d:?}");
            }
            let _ = match a.sensitivity {
                Some(Sensitivity::SefdJy(v)) => writeln!(t, "sefd_jy = {v:?}"),
                Some(Sensitivity::TsysK(v)) => writeln!(t, "tsys_k = {v:?}"),
                None => Ok(()),
            };
            if let Some(e) = a.position_error_m {
                let _ = writeln!(t, "position_error_m = {e:?}");
            }
        }
        t + &in_toml::to_text(&self.pattern)
    }
}

fn antenna(text: &str, index: usize, a: AntennaToml) -> Result<Antenna> {
    let name = a.name.get_ref();
    if a.position_m.get_ref().iter().any(|p| !p.is_finite()) {
        let message = format!("position_m of antenna {name:?} is {:?}, expected three finite numbers in metres", a.position_m.get_ref());
        return Err(at(text, a.position_m.span(), &message));
    }
    if let Some(e) = &a.position_error_m
        && e.get_ref().iter().any(|v| !(v.is_finite() && *v >= 0.0))
    {
        let message = format!("position_error_m of antenna {name:?} is {:?}, expected three numbers of at least 0", e.get_ref());
        return Err(at(text, e.span(), &message));
    }
    let positive = |key: &str, value: Option<Spanned<f64>>| match value {
        Some(v) if !(v.get_ref().is_finite() && *v.get_ref() > 0.0) => {
            Err(at(text, v.span(), &format!("{key} of antenna {name:?} is {}, expected a positive number", v.get_ref())))
        }
        v => Ok(v.map(Spanned::into_inner)),
    };
    let diameter_m = positive("diameter_m", a.diameter_m)?;
    let sensitivity = match (positive("sefd_jy", a.sefd_jy)?, positive("tsys_k", a.tsys_k)?) {
        (Some(_), Some(_)) => {
            return Err(at(text, a.name.span(), &format!("antenna {name:?} has both sefd_jy and tsys_k: give one")));
        }
        (Some(v), None) => Some(Sensitivity::SefdJy(v)),
        (None, Some(v)) => Some(Sensitivity::TsysK(v)),
        (None, None) => None,
    };
    Ok(Antenna {
        number: a.number.unwrap_or(index as u32),
        position_m: a.position_m.into_inner(),
        diameter_m,
        sensitivity,
        position_error_m: a.position_error_m.map(Spanned::into_inner),
        receiver: None,
        name: a.name.into_inner(),
    })
}

/// A message with the line and column, from 1, at which a span of the text begins.
fn at(text: &str, span: Range<usize>, message: &str) -> ArrayError {
    let before = text.get(..span.start.min(text.len())).unwrap_or(text);
    let line = before.matches('\n').count() + 1;
    let column = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
    ArrayError::Parse(format!("line {line}, column {column}: {}", message.trim_end()))
}

#[cfg(test)]
mod tests {
    use super::*;

    const ENU: &str = r#"name = "demo"
frame = "enu"
source = "made up"
aperture_m = 120.5
mount = "alt-az"

[site]
latitude_deg = 34.0
longitude_deg = -107.6
altitude_m = 2100.0

[[antenna]]
name = "a\"1"
position_m = [0.1, 1e-7, 3]
diameter_m = 25.0
sefd_jy = 300.0

[[antenna]]
name = "b"
number = 7
position_m = [100.0, 0.0, 0.0]
tsys_k = 30.0
position_error_m = [0.001, 0.001, 0.002]
"#;

    fn error(text: &str) -> String {
        ArrayLayout::from_toml(text).unwrap_err().to_string()
    }

    #[test]
    fn everything_survives_writing_and_reading() {
        let layout = ArrayLayout::from_toml(ENU).unwrap();
        assert_eq!((layout.antennas()[0].name.as_str(), layout.antennas()[1].number), ("a\"1", 7));
        assert_eq!(layout.antennas()[1].sensitivity, Some(Sensitivity::TsysK(30.0)));
        let back = ArrayLayout::from_toml(&layout.to_toml()).unwrap();
        assert_eq!(back.antennas(), layout.antennas());
        assert_eq!((&back.source, back.aperture_m), (&layout.source, Some(120.5)));
        assert_eq!((layout.mount, back.mount), (Some(Mount::AltAz), Some(Mount::AltAz)));
        let (a, b) = (back.site().unwrap(), layout.site().unwrap());
        assert!((a.latitude_rad - b.latitude_rad).abs() < 1e-15 && (a.longitude_rad - b.longitude_rad).abs() < 1e-15);
    }

    #[test]
    fn an_unknown_key_is_named_with_its_line() {
        let e = error(&ENU.replace("tsys_k", "tsys"));
        assert!(e.contains("line 22, column 1") && e.contains("tsys"), "{e}");
        let e = error(&format!("colour = 1\n{ENU}"));
        assert!(e.contains("line 1, column 1") && e.contains("colour"), "{e}");
        let e = error(&ENU.replace("altitude_m", "height_m"));
        assert!(e.contains("line 10") && e.contains("height_m"), "{e}");
    }

    #[test]
    fn bad_values_are_named_with_their_line() {
        let e = error(&ENU.replace("1e-7", "nan"));
        assert!(e.contains("line 14") && e.contains("NaN"), "{e}");
        let e = error(&ENU.replace("[100.0, 0.0, 0.0]", "[100.0, 0.0]"));
        assert!(e.contains("line 21"), "{e}");
        let e = error(&ENU.replace("\"enu\"", "\"xyz\""));
        assert!(e.contains("line 2, column 9") && e.contains("boresight"), "{e}");
        let e = error(&ENU.replace("alt-az", "orbiting"));
        assert!(e.contains("line 5, column 9") && e.contains("orbiting"), "{e}");
        assert!(error(&ENU.replace("sefd_jy = 300.0", "sefd_jy = 300.0\ntsys_k = 3.0")).contains("both"));
        let e = error(&ENU.replace("120.5", "0.0"));
        assert!(e.contains("line 4, column 14") && e.contains("aperture_m is 0"), "{e}");
        let e = error(&ENU.replace("25.0", "-25.0"));
        assert!(e.contains("line 15, column 14") && e.contains("diameter_m"), "{e}");
        let e = error(&ENU.replace("\"b\"", "'a\"1'"));
        assert!(e.contains("line 19") && e.contains("used twice"), "{e}");
        let e = error(&ENU.replace("34.0", "-134.0"));
        assert!(e.contains("line 7") && e.contains("-90 to 90"), "{e}");
        assert!(error("name = ").contains("line 1"));
        assert!(error("").contains("name"));
        assert!(error("name = \"x\"\nframe = \"boresight\"").contains("number of antennas"));
    }

    #[test]
    fn frames_and_sites_must_fit() {
        let no_site = ENU.replace("[site]\nlatitude_deg = 34.0\nlongitude_deg = -107.6\naltitude_m = 2100.0\n", "");
        assert!(error(&no_site).contains("needs a [site]"));
        let e = error(&ENU.replace("\"enu\"", "\"boresight\""));
        assert!(e.contains("line 7") && e.contains("no [site]"), "{e}");
        assert!(error(&ENU.replace("\"enu\"", "\"ecef\"")).contains("geocentric"));
        let e = error(&ENU.replace("[100.0, 0.0, 0.0]", "[0.1, 1e-7, 3.0]"));
        assert!(e.contains("line 19, column 8") && e.contains("same place"), "{e}");
    }
}
