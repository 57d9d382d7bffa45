//! Antenna configurations of CASA's simulator: `x y z diameter [pad [antenna]]` below `# observatory=` and `# coordsys=` comments.
//!
//! Coordinate systems: `XYZ` geocentric, `LOC` east, north, up at the observatory (or at `# COFA=longitude,latitude` in degrees), `UTM`
//! easting, northing and height with `# zone=`, `# datum=WGS84` and `# hemisphere=N|S`.

use super::error::{LayoutError, ReadContext, Result};
use super::observatories::known_site;
use super::text::{self, Keeps, Line};
use super::utm::Datum;
use crate::format::{Label, LayoutFormat};
use cittert_arrays::{Antenna, ArrayLayout, LayoutFrame, Site};
use std::fmt::Write;

pub(crate) struct CasaCfg;

const COLUMNS: &str = "x y z diameter, and optionally a name";
/// Largest distance of the observatory from the antennas, m. A more distant observatory is not their site.
const NEAR_M: f64 = 100e3;

impl LayoutFormat for CasaCfg {
    fn label(&self) -> Label {
        Label {
            name: "casa-cfg",
            extensions: &["cfg"],
            description: "CASA simulator configuration: positions (geocentric, local or UTM), diameters, names",
        }
    }

    fn sniff(&self, text: &str, _: &str) -> bool {
        let columns = |l: &Line<'_>| l.fields.len() > 3 && l.fields[..4].iter().all(|f| f.parse::<f64>().is_ok());
        let named = |l: &Line<'_>| l.fields.len() > 4 && l.fields[4].parse::<f64>().is_err();
        text::comment(text, "coordsys").is_some() || text::lines(text).next().is_some_and(|l| columns(&l) && named(&l))
    }

    fn read(&self, text: &str, context: &ReadContext) -> Result<ArrayLayout> {
        let Some((line, system)) = text::comment(text, "coordsys") else {
            return Err(LayoutError::Missing("expected a line '# coordsys=' with XYZ, LOC or UTM, found none".into()));
        };
        let mut antennas = Vec::new();
        for l in text::lines(text) {
            antennas.push(antenna(&l, antennas.len())?);
        }
        let observatory = text::comment(text, "observatory").map(|(_, name)| name);
        let name = observatory.unwrap_or(&context.name);
        let system = system.to_uppercase();
        let layout = if system.starts_with("XYZ") {
            geocentric(name, observatory, context, antennas)?
        } else if system.starts_with("LOC") {
            let site = match (context.site, cofa(text)?) {
                (Some(site), _) | (None, Some(site)) => site,
                (None, None) => observatory.and_then(known_site).ok_or_else(|| {
                    LayoutError::Missing(format!(
                        "local coordinates need a place, and observatory {:?} is not known: add '# COFA=longitude,latitude' or give a site",
                        observatory.unwrap_or("")
                    ))
                })?,
            };
            ArrayLayout::new(name, LayoutFrame::EastNorthUp(site), antennas)?
        } else if system.starts_with("UTM") {
            let (zone, south, datum) = utm_zone(text)?;
            for a in &mut antennas {
                a.position_m = datum.utm_to_ecef_m(a.position_m, zone, south);
            }
            geocentric(name, observatory, context, antennas)?
        } else {
            return Err(LayoutError::Line { line, expected: "coordsys XYZ, LOC or UTM".into(), found: system });
        };
        Ok(layout)
    }

    fn write(&self, layout: &ArrayLayout) -> Result<String> {
        let refuse = |reason: String| LayoutError::Cannot { format: "casa-cfg", reason };
        let Some(places) = layout.ecef_m() else {
            return Err(refuse("it is in the boresight frame, and a .cfg needs a place on the Earth".into()));
        };
        let mut t = format!("# observatory={}\n# coordsys=XYZ\n# x y z diam name\n", text::one_line(&layout.name));
        for (a, [x, y, z]) in layout.antennas().iter().zip(places) {
            let diameter = a.diameter_m.ok_or_else(|| refuse(format!("antenna {:?} has no diameter", a.name)))?;
            // Writing to a String cannot fail.
            let _ = writeln!(t, "{x:.7} {y:.7} {z:.7} {diameter} {}", text::one_field(&a.name));
        }
        Ok(t)
    }

    fn loses(&self, layout: &ArrayLayout) -> Vec<String> {
        text::lost(layout, Keeps { names: true, diameters: true, ..Keeps::default() })
    }
}

fn antenna(l: &Line<'_>, index: usize) -> Result<Antenna> {
    if l.fields.len() < 4 {
        return Err(l.expected(COLUMNS));
    }
    let position_m = [l.number(0, "x")?, l.number(1, "y")?, l.number(2, "z")?];
    let diameter = l.number(3, "a diameter in metres")?;
    if diameter <= 0.0 {
        return Err(l.expected("a positive diameter in the fourth column"));
    }
    let name = l.fields.get(5).or(l.fields.get(4)).map_or_else(|| format!("A{index:02}"), |n| (*n).to_owned());
    Ok(Antenna { diameter_m: Some(diameter), ..Antenna::new(name, index as u32, position_m) })
}

/// The centre of the array from `# COFA=longitude,latitude`, degrees, on the ellipsoid, as in CASA.
fn cofa(text: &str) -> Result<Option<Site>> {
    let Some((line, value)) = text::comment(text, "COFA") else { return Ok(None) };
    let Some((lon, lat)) = value.split_once(',') else {
        return Err(LayoutError::Line { line, expected: "COFA=longitude,latitude in degrees".into(), found: value.into() });
    };
    let (lon, lat) = (text::number(line, lon.trim(), "longitude")?, text::number(line, lat.trim(), "latitude")?);
    Ok(Some(Site { latitude_rad: lat.to_radians(), longitude_rad: lon.to_radians(), altitude_m: 0.0 }))
}

/// A layout with the named observatory as its site where the antennas are near it, else with their centroid as its site.
fn geocentric(name: &str, observatory: Option<&str>, context: &ReadContext, antennas: Vec<Antenna>) -> Result<ArrayLayout> {
    let near = observatory.and_then(known_site).filter(|s| antennas.iter().all(|a| distance_m(s, a.position_m) < NEAR_M));
    Ok(ArrayLayout::from_ecef(name, context.site.or(near), antennas)?)
}

/// Zone, true for the southern hemisphere, and datum.
fn utm_zone(text: &str) -> Result<(u32, bool, &'static Datum)> {
    let need = |key: &str| {
        text::comment(text, key).ok_or_else(|| {
            LayoutError::Missing(format!("coordsys UTM needs '# {key}=': zone 1 to 60, hemisphere N or S, datum such as WGS84"))
        })
    };
    let (line, zone) = need("zone")?;
    let zone = zone.parse::<u32>().ok().filter(|z| (1..=60).contains(z)).ok_or_else(|| LayoutError::Line {
        line,
        expected: "a UTM zone from 1 to 60".into(),
        found: zone.into(),
    })?;
    let (line, hemisphere) = need("hemisphere")?;
    let south = match hemisphere.chars().next().map(|c| c.to_ascii_uppercase()) {
        Some('N') => false,
        Some('S') => true,
        _ => return Err(LayoutError::Line { line, expected: "hemisphere N or S".into(), found: hemisphere.into() }),
    };
    let (line, datum) = need("datum")?;
    let found = Datum::find(datum).ok_or_else(|| LayoutError::Line {
        line,
        expected: format!("one of the datums {}", Datum::names()),
        found: datum.into(),
    })?;
    Ok((zone, south, found))
}

fn distance_m(site: &Site, p: [f64; 3]) -> f64 {
    let c = site.to_ecef_m();
    (0..3).map(|k| (c[k] - p[k]).powi(2)).sum::<f64>().sqrt()
}
