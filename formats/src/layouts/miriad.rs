//! Antenna files of `uvgen` of Miriad: three columns of numbers. The parameter `baseunit` of `uvgen` gives their meaning.
//!
//! A negative baseunit means north, east, up; a positive one the equatorial axes of the site: x to the meridian on the equator, y east,
//! z to the pole. Its size is the unit of the columns in nanoseconds of light time, 1 by default. cittert writes it as a
//! comment; a file without the comment is read with the default of `uvgen`.

use super::error::{LayoutError, ReadContext, Result};
use super::text::{self, Keeps};
use crate::format::{Label, LayoutFormat};
use cittert_arrays::{Antenna, ArrayLayout, SPEED_OF_LIGHT_M_S};
use std::fmt::Write;

pub(crate) struct MiriadAnt;

impl LayoutFormat for MiriadAnt {
    fn label(&self) -> Label {
        Label {
            name: "miriad",
            extensions: &["ant"],
            description: "Miriad uvgen antenna file: positions only (north, east, up or equatorial)",
        }
    }

    fn sniff(&self, text: &str, extension: &str) -> bool {
        let mut any = false;
        let columns = text::lines(text).all(|l| {
            any = true;
            l.fields.len() == 3 && l.is_numeric()
        });
        // The numbers alone could also be an OSKAR layout.
        columns && any && (extension == "ant" || text::comment(text, "baseunit").is_some())
    }

    fn read(&self, text: &str, context: &ReadContext) -> Result<ArrayLayout> {
        let unit = match text::comment(text, "baseunit") {
            Some((line, value)) => match text::number(line, value, "baseunit")? {
                0.0 => return Err(LayoutError::Line { line, expected: "a baseunit other than 0".into(), found: value.into() }),
                unit => unit,
            },
            None => 1.0,
        };
        let scale = unit.abs() * 1e-9 * SPEED_OF_LIGHT_M_S;
        let site = match context.site {
            Some(site) => Some(site),
            None => text::commented_site(text)?,
        };
        let mut antennas = Vec::new();
        for l in text::lines(text) {
            if l.fields.len() != 3 {
                return Err(l.expected("three coordinates"));
            }
            let [a, b, c] = [
                l.number(0, "first coordinate")? * scale,
                l.number(1, "second coordinate")? * scale,
                l.number(2, "third coordinate")? * scale,
            ];
            let position_m = if unit < 0.0 {
                [b, a, c]
            } else {
                let Some(site) = site else {
                    return Err(LayoutError::Missing(
                        "a site is expected where baseunit is positive (equatorial coordinates), found none: give one, or write \
                         '# latitude_deg = ' and '# longitude_deg = ' lines (for north, east, up in metres write '# baseunit = -3.33564')"
                            .into(),
                    ));
                };
                // x and z lie in the meridian plane.
                let (sin_lat, cos_lat) = site.latitude_rad.sin_cos();
                [b, cos_lat * c - sin_lat * a, cos_lat * a + sin_lat * c]
            };
            antennas.push(Antenna::new(format!("A{:02}", antennas.len() + 1), antennas.len() as u32, position_m));
        }
        text::local_layout(text, context, antennas)
    }

    fn write(&self, layout: &ArrayLayout) -> Result<String> {
        let mut t = text::local_header(layout);
        let metre_ns = 1e9 / SPEED_OF_LIGHT_M_S;
        // Writing to a String cannot fail.
        let _ = writeln!(t, "# baseunit = {:?}\n# north east up, m", -metre_ns);
        for a in layout.antennas() {
            let [e, n, u] = a.position_m;
            let _ = writeln!(t, "{n:.7} {e:.7} {u:.7}");
        }
        Ok(t)
    }

    fn loses(&self, layout: &ArrayLayout) -> Vec<String> {
        text::lost(layout, Keeps { exact_site: true, ..Keeps::default() })
    }
}
