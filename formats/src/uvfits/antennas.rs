//! The AIPS AN table: the antennas and the site of the array.

use crate::fits::{Header, table::Table};
use crate::uvh5::{NOMINAL_SITE, unique_names};
use crate::{FormatError, Result};
use cittert_arrays::{Antenna, ArrayLayout, LayoutFrame, Sensitivity, Site};

/// Geocentric coordinates closer to the centre of the Earth than this are not the position of an array, m.
const SMALLEST_RADIUS_M: f64 = 1e6;

/// The layout of an AN table. The primary header may hold the site where the table does not.
pub(super) fn read(table: &Table, primary: &Header) -> Result<ArrayLayout> {
    let header = &table.header;
    let path = header.path();
    let frame = header.text("FRAME").unwrap_or("ITRF").trim().to_ascii_uppercase();
    let unknown = frame.chars().all(|c| c == '?');
    if !unknown && !["ITRF", "ITRS", "GEOCENTRIC", ""].contains(&frame.as_str()) {
        return Err(FormatError::unsupported(path, format!("AIPS AN: the antenna frame is {frame:?}; only ITRF is read")));
    }
    let mut positions = Vec::with_capacity(table.rows());
    let left = header.text("XYZHAND").is_some_and(|h| h.trim().eq_ignore_ascii_case("LEFT"));
    for row in 0..table.rows() {
        match table.reals(row, "STABXYZ").as_deref() {
            Some(&[x, y, z]) => positions.push([x, if left { -y } else { y }, z]),
            _ => return Err(FormatError::malformed(path, format!("AIPS AN, row {row}, STABXYZ"), "three numbers", "something else")),
        }
    }
    if positions.is_empty() {
        return Err(FormatError::malformed(path, "AIPS AN", "at least one antenna", "no rows"));
    }
    let centre = ["ARRAYX", "ARRAYY", "ARRAYZ"].map(|k| header.real(k).unwrap_or(0.0));
    let far = |p: &[f64; 3]| p.iter().map(|v| v * v).sum::<f64>().sqrt() > SMALLEST_RADIUS_M;
    let stated = ["LAT", "LON", "ALT"].map(|k| primary.real(k));
    let mut site = None;
    // Where the frame is unknown, the site of the primary header is more reliable.
    if let (true, [Some(lat), Some(lon), Some(altitude_m)]) = (unknown, stated) {
        site = Some(Site { latitude_rad: lat.to_radians(), longitude_rad: lon.to_radians(), altitude_m });
    }
    // Offsets from the array centre in the geocentric axes.
    if far(&centre) {
        let place = Site::from_ecef_m(centre);
        // In AIPS the x axis points to the meridian of the array.
        let (sin, cos) = place.longitude_rad.sin_cos();
        positions.iter_mut().for_each(|p| *p = [p[0] * cos - p[1] * sin, p[0] * sin + p[1] * cos, p[2]]);
        site = site.or(Some(place));
    } else {
        // The positions are geocentric: the site is their mean.
        let n = positions.len() as f64;
        let mean = [0, 1, 2].map(|k| positions.iter().map(|p| p[k]).sum::<f64>() / n);
        if far(&mean) {
            positions.iter_mut().for_each(|p| *p = [0, 1, 2].map(|k| p[k] - mean[k]));
            site = site.or(Some(Site::from_ecef_m(mean)));
        }
    }
    let site = site.unwrap_or(NOMINAL_SITE);
    let names = (0..table.rows()).map(|row| table.text(row, "ANNAME").unwrap_or_default().replace('!', "")).collect();
    let mut antennas = Vec::with_capacity(positions.len());
    for (row, (name, p)) in unique_names(names).into_iter().zip(positions).enumerate() {
        let number = table.real(row, "NOSTA").filter(|n| (0.0..=65_535.0).contains(n)).ok_or_else(|| {
            let found = table.real(row, "NOSTA").map_or("nothing".into(), |n| n.to_string());
            FormatError::malformed(path, format!("AIPS AN, row {row}, NOSTA"), "a number from 0 to 65535", found)
        })?;
        let mut antenna = Antenna::new(name, number as u32, site.ecef_offset_to_enu(p));
        let positive = |column: &str| table.real(row, column).filter(|v| v.is_finite() && *v > 0.0);
        antenna.diameter_m = positive("DIAMETER");
        antenna.sensitivity = positive("SEFD").map(Sensitivity::SefdJy);
        let stated = |column: &str| table.real(row, column).filter(|v| v.is_finite() && *v >= 0.0);
        antenna.receiver = stated("RCVRSEFD").map(Sensitivity::SefdJy).or(stated("RCVRTEMP").map(Sensitivity::TsysK));
        antennas.push(antenna);
    }
    let name = header.text("ARRNAM").filter(|n| !n.is_empty()).or(primary.text("TELESCOP")).unwrap_or("unknown");
    ArrayLayout::from_data(name, LayoutFrame::EastNorthUp(site), antennas).map_err(|e| FormatError::values(path, e))
}
