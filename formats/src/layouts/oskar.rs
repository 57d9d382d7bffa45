//! `layout.txt` of an OSKAR telescope model: east, north and optionally up in metres, then optionally the errors of the three.
//!
//! The file holds no site: it is in `position.txt` beside it (longitude, latitude in degrees, optionally altitude in metres), or in the
//! comments that cittert writes.

use super::error::{LayoutError, ReadContext, Result};
use super::text::{self, Keeps};
use crate::format::{Label, LayoutFormat};
use cittert_arrays::{Antenna, ArrayLayout, Site};
use std::fmt::Write;

pub(super) const NAME: &str = "oskar";

pub(crate) struct OskarLayout;

impl LayoutFormat for OskarLayout {
    fn label(&self) -> Label {
        Label {
            name: NAME,
            extensions: &["txt"],
            description: "OSKAR layout.txt: east, north, up and position errors; the site from position.txt",
        }
    }

    fn is_folder(&self, path: &std::path::Path) -> bool {
        path.join("layout.txt").is_file()
    }

    fn sniff(&self, text: &str, _: &str) -> bool {
        let mut any = false;
        text::lines(text).all(|l| {
            any = true;
            (2..=6).contains(&l.fields.len()) && l.is_numeric()
        }) && any
    }

    fn read(&self, text: &str, context: &ReadContext) -> Result<ArrayLayout> {
        let mut antennas = Vec::new();
        for l in text::lines(text) {
            let n = l.fields.len();
            if !(2..=6).contains(&n) {
                return Err(l.expected("east and north, optionally up and three position errors"));
            }
            let or_zero = |i: usize, what: &str| if i < n { l.number(i, what) } else { Ok(0.0) };
            let position_m = [l.number(0, "east")?, l.number(1, "north")?, or_zero(2, "up")?];
            let mut a = Antenna::new(format!("A{:03}", antennas.len()), antennas.len() as u32, position_m);
            if n > 3 {
                // The errors of OSKAR are displacements. Their absolute values are used as uncertainties.
                let error = |i: usize| or_zero(i, "position error").map(f64::abs);
                a.position_error_m = Some([error(3)?, error(4)?, error(5)?]);
            }
            antennas.push(a);
        }
        text::local_layout(text, context, antennas)
    }

    fn write(&self, layout: &ArrayLayout) -> Result<String> {
        let mut t = text::local_header(layout);
        let errors = layout.antennas().iter().any(|a| a.position_error_m.is_some());
        for a in layout.antennas() {
            let [e, n, u] = a.position_m;
            // Writing to a String cannot fail.
            let _ = write!(t, "{e:?}, {n:?}, {u:?}");
            if errors {
                let [de, dn, du] = a.position_error_m.unwrap_or_default();
                let _ = write!(t, ", {de:?}, {dn:?}, {du:?}");
            }
            t.push('\n');
        }
        Ok(t)
    }

    fn loses(&self, layout: &ArrayLayout) -> Vec<String> {
        text::lost(layout, Keeps { errors: true, exact_site: true, ..Keeps::default() })
    }
}

/// The site in a `position.txt`: longitude and latitude in degrees, optionally altitude in metres.
pub(super) fn read_position(text: &str) -> Result<Site> {
    let Some(l) = text::lines(text).next() else {
        return Err(LayoutError::Missing("there is no line with longitude and latitude in degrees".into()));
    };
    let altitude_m = if l.fields.len() > 2 { l.number(2, "altitude in metres")? } else { 0.0 };
    let (lon, lat) = (l.number(0, "longitude in degrees")?, l.number(1, "latitude in degrees")?);
    if lat.abs() > 90.0 {
        return Err(l.expected("longitude, then a latitude between -90 and 90 deg"));
    }
    Ok(Site { latitude_rad: lat.to_radians(), longitude_rad: lon.to_radians(), altitude_m })
}
