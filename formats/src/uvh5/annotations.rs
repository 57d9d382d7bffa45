//! Properties of an observation that are only carried: extra keywords, the direction of the feeds, mounts and stations.

use super::layout::UNKNOWN_MOUNT;
use super::names::{
    ANTENNA_GROUP, ANTENNA_TEMPERATURE_KEYWORD, FOCUS_KEYWORDS, FRAME_KEYWORD, LAYOUT_KEYWORD, PATTERN_KEYWORD, PEDESTAL_KEYWORD,
    SCENE_PEDESTAL_KEYWORD, SCENE_RANGE_KEYWORD, SCENE_WIDTH_KEYWORD, SOURCE_KEYWORD,
};
use crate::Result;
use crate::h5::{H5In, H5Out};
use cittert_arrays::{Annotations, ArrayLayout, XOrientation};
use std::f64::consts::{FRAC_PI_2, PI};

/// Group of the extra keywords.
pub(super) const KEYWORDS: &str = "Header/extra_keywords";
/// Extra keywords with a meaning of their own.
const OWN: [&str; 12] = [
    ANTENNA_TEMPERATURE_KEYWORD,
    FOCUS_KEYWORDS[0],
    FOCUS_KEYWORDS[1],
    FOCUS_KEYWORDS[2],
    FRAME_KEYWORD,
    LAYOUT_KEYWORD,
    PATTERN_KEYWORD,
    PEDESTAL_KEYWORD,
    SCENE_PEDESTAL_KEYWORD,
    SCENE_RANGE_KEYWORD,
    SCENE_WIDTH_KEYWORD,
    SOURCE_KEYWORD,
];
/// Largest difference of the angle of a feed, rad.
const FEED_TOLERANCE_RAD: f64 = 1e-6;

/// Texts of one property of all antennas.
fn stations() -> String {
    format!("{ANTENNA_GROUP}/antenna_station")
}

pub(super) fn read(file: &H5In, layout: &ArrayLayout) -> Result<Annotations> {
    let n_ant = layout.n_ant();
    let mut found = Annotations::default();
    for key in file.members(KEYWORDS)?.into_iter().filter(|key| !OWN.contains(&key.as_str())) {
        if let Some(value) = file.keyword(&format!("{KEYWORDS}/{key}"))? {
            found.keywords.insert(key, value);
        }
    }
    let stated = file.text("Header/x_orientation")?.and_then(|name| XOrientation::named(&name));
    found.x_orientation = stated.or(of_feeds(file, n_ant)?);
    let per_antenna = |name: &str| -> Result<Vec<String>> { Ok(file.texts(name)?.filter(|t| t.len() == n_ant).unwrap_or_default()) };
    found.stations = per_antenna(&stations())?;
    let mounts = per_antenna("Header/mount_type")?;
    if layout.site().is_some() && mounts.iter().any(|mount| mount != UNKNOWN_MOUNT) {
        found.mounts = mounts;
    }
    Ok(found)
}

/// The direction of the X feeds, where all antennas have X and Y feeds at the same right angles.
fn of_feeds(file: &H5In, n_ant: usize) -> Result<Option<XOrientation>> {
    let (Some(names), Some((_, angles))) = (file.texts("Header/feed_array")?, file.reals("Header/feed_angle")?) else { return Ok(None) };
    if names.is_empty() || names.len() != angles.len() || n_ant == 0 {
        return Ok(None);
    }
    let at = |orientation: XOrientation| {
        names.iter().zip(&angles).all(|(name, angle)| {
            let x = match name.to_ascii_lowercase().as_str() {
                "x" => true,
                "y" => false,
                _ => return false,
            };
            let wanted = if x == (orientation == XOrientation::East) { FRAC_PI_2 } else { 0.0 };
            let turn = (angle - wanted).rem_euclid(PI);
            turn.min(PI - turn) < FEED_TOLERANCE_RAD
        })
    };
    Ok([XOrientation::East, XOrientation::North].into_iter().find(|o| at(*o)))
}

/// Write all but the mounts, which belong to the telescope.
pub(super) fn write(out: &H5Out, annotations: &Annotations, n_ant: usize) -> Result<()> {
    for (key, value) in &annotations.keywords {
        // In HDF5 a slash would make a group.
        let key = key.replace('/', "_");
        if !OWN.contains(&key.as_str()) && !key.is_empty() && key != "." {
            out.keyword(&format!("{KEYWORDS}/{key}"), value)?;
        }
    }
    if let Some(orientation) = annotations.x_orientation {
        out.text("Header/x_orientation", orientation.name())?;
    }
    if annotations.stations.len() == n_ant && n_ant > 0 {
        let texts: Vec<&str> = annotations.stations.iter().map(String::as_str).collect();
        out.texts(&stations(), &texts, &[n_ant])?;
    }
    Ok(())
}
