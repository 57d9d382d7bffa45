//! Antennas: names, numbers, and positions as ECEF offsets from the array centre.

use super::names::{ANTENNA_GROUP, BORESIGHT, FRAME_KEYWORD, LAYOUT_KEYWORD, NOMINAL_SITE, SOURCE_KEYWORD};
use crate::h5::{H5In, H5Out};
use crate::{FormatError, Result};
use cittert_arrays::{Antenna, ArrayLayout, LayoutFrame, Sensitivity, Site};
use ndarray::{Array1, Array2};
use std::collections::HashSet;

/// Name of a mount that is not known.
pub(super) const UNKNOWN_MOUNT: &str = "other";

/// The site of a layout, or the nominal site for a boresight layout.
pub(crate) fn site_of(layout: &ArrayLayout) -> Site {
    layout.site().unwrap_or(NOMINAL_SITE)
}

/// Write the telescope part of a header; UVH5 and CalH5 share this part.
pub(crate) fn write_telescope(out: &H5Out, layout: &ArrayLayout, telescope: &str, instrument: &str, mounts: &[String]) -> Result<()> {
    let site = site_of(layout);
    let name = if telescope.is_empty() { layout.name.as_str() } else { telescope };
    let name = if name.is_empty() { "unknown" } else { name };
    out.text("Header/telescope_name", name)?;
    out.text("Header/instrument", if instrument.is_empty() { name } else { instrument })?;
    out.text("Header/telescope_frame", "itrs")?;
    out.scalar("Header/latitude", site.latitude_rad.to_degrees())?;
    out.scalar("Header/longitude", site.longitude_rad.to_degrees())?;
    out.scalar("Header/altitude", site.altitude_m)?;
    let antennas = layout.antennas();
    out.scalar("Header/Nants_telescope", antennas.len() as i64)?;
    out.texts("Header/antenna_names", &antennas.iter().map(|a| a.name.as_str()).collect::<Vec<_>>(), &[antennas.len()])?;
    out.array("Header/antenna_numbers", Array1::from_iter(antennas.iter().map(|a| i64::from(a.number))).view())?;
    let mut positions = Array2::zeros((antennas.len(), 3));
    for (mut row, a) in positions.rows_mut().into_iter().zip(antennas) {
        row.assign(&Array1::from_vec(site.enu_to_ecef_offset(a.position_m).to_vec()));
    }
    out.array("Header/antenna_positions", positions.view())?;
    // An aperture-plane imager has fixed elements.
    let mounts: Vec<&str> = match layout.site() {
        None => vec!["fixed"; antennas.len()],
        Some(_) if mounts.len() == antennas.len() => mounts.iter().map(String::as_str).collect(),
        Some(_) => vec![UNKNOWN_MOUNT; antennas.len()],
    };
    out.texts("Header/mount_type", &mounts, &[antennas.len()])?;
    if let Some(diameters) = antennas.iter().map(|a| a.diameter_m).collect::<Option<Vec<f64>>>() {
        out.array("Header/antenna_diameters", Array1::from_vec(diameters).view())?;
    } else if antennas.iter().any(|a| a.diameter_m.is_some()) {
        property(out, "diameter_m", antennas, |a| a.diameter_m)?;
    }
    property(out, "sefd_jy", antennas, |a| match a.sensitivity {
        Some(Sensitivity::SefdJy(v)) => Some(v),
        _ => None,
    })?;
    property(out, "tsys_k", antennas, |a| match a.sensitivity {
        Some(Sensitivity::TsysK(v)) => Some(v),
        _ => None,
    })?;
    property(out, "receiver_sefd_jy", antennas, |a| match a.receiver {
        Some(Sensitivity::SefdJy(v)) => Some(v),
        _ => None,
    })?;
    property(out, "receiver_k", antennas, |a| match a.receiver {
        Some(Sensitivity::TsysK(v)) => Some(v),
        _ => None,
    })?;
    for (k, axis) in ["x", "y", "z"].iter().enumerate() {
        property(out, &format!("position_error_{axis}_m"), antennas, |a| a.position_error_m.map(|e| e[k]))?;
    }
    if layout.site().is_none() {
        out.text(&format!("Header/extra_keywords/{FRAME_KEYWORD}"), BORESIGHT)?;
    }
    if layout.name != name && !layout.name.is_empty() {
        out.text(&format!("Header/extra_keywords/{LAYOUT_KEYWORD}"), &layout.name)?;
    }
    if let Some(source) = &layout.source {
        out.text(&format!("Header/extra_keywords/{SOURCE_KEYWORD}"), source)?;
    }
    Ok(())
}

/// Write a property for which UVH5 has no place. Nothing is written where no antenna has the property.
fn property(out: &H5Out, name: &str, antennas: &[Antenna], get: impl Fn(&Antenna) -> Option<f64>) -> Result<()> {
    if antennas.iter().any(|a| get(a).is_some()) {
        let values = Array1::from_iter(antennas.iter().map(|a| get(a).unwrap_or(f64::NAN)));
        out.array(&format!("{ANTENNA_GROUP}/antenna_{name}"), values.view())?;
    }
    Ok(())
}

/// Read the telescope part of a header: the layout and the telescope's name.
pub(crate) fn read_telescope(file: &H5In) -> Result<(ArrayLayout, String)> {
    if let Some(frame) = file.text("Header/telescope_frame")?.filter(|f| f != "itrs") {
        return Err(FormatError::unsupported(file.path(), format!("the telescope frame is {frame:?}: only itrs (the Earth) is read")));
    }
    let site = read_site(file)?;
    let telescope = file.text("Header/telescope_name")?.unwrap_or_default();
    let n = file.count("Header/Nants_telescope")?;
    let names = file.texts("Header/antenna_names")?.ok_or_else(|| file.missing("Header/antenna_names"))?;
    if names.len() != n {
        return Err(file.wrong("Header/antenna_names", format!("{n} names"), names.len().to_string()));
    }
    let numbers = file.list("Header/antenna_numbers", n)?;
    let positions = file.list("Header/antenna_positions", 3 * n)?;
    let finite = |name: &str| -> Result<Vec<Option<f64>>> {
        if !file.has(name) {
            return Ok(vec![None; n]);
        }
        Ok(file.list(name, n)?.into_iter().map(|d| Some(d).filter(|d| d.is_finite())).collect())
    };
    let optional = |name: &str| -> Result<Vec<Option<f64>>> { Ok(finite(name)?.into_iter().map(|d| d.filter(|d| *d > 0.0)).collect()) };
    let receiver = |name: &str| finite(&format!("{ANTENNA_GROUP}/antenna_receiver_{name}"));
    let receivers = (receiver("sefd_jy")?, receiver("k")?);
    let own = |name: &str| optional(&format!("{ANTENNA_GROUP}/antenna_{name}"));
    let (diameters, diameters_too) = (optional("Header/antenna_diameters")?, own("diameter_m")?);
    let (sefd, tsys) = (own("sefd_jy")?, own("tsys_k")?);
    let errors = [own("position_error_x_m")?, own("position_error_y_m")?, own("position_error_z_m")?];
    let names = unique_names(names);
    let mut antennas = Vec::with_capacity(n);
    for (k, name) in names.into_iter().enumerate() {
        let number = numbers[k];
        if !(0.0..=f64::from(u32::MAX)).contains(&number) || number.fract() != 0.0 {
            return Err(file.wrong("Header/antenna_numbers", "whole numbers from 0 to 4294967295", number.to_string()));
        }
        let mut antenna =
            Antenna::new(name, number as u32, site.ecef_offset_to_enu([positions[3 * k], positions[3 * k + 1], positions[3 * k + 2]]));
        antenna.diameter_m = diameters[k].or(diameters_too[k]);
        antenna.sensitivity = sefd[k].map(Sensitivity::SefdJy).or(tsys[k].map(Sensitivity::TsysK));
        antenna.receiver = receivers.0[k].map(Sensitivity::SefdJy).or(receivers.1[k].map(Sensitivity::TsysK)).filter(not_negative);
        antenna.position_error_m = match [errors[0][k], errors[1][k], errors[2][k]] {
            [None, None, None] => None,
            e => Some(e.map(|v| v.unwrap_or(0.0))),
        };
        antennas.push(antenna);
    }
    let keyword = |name: &str| file.text(&format!("Header/extra_keywords/{name}"));
    let frame = match keyword(FRAME_KEYWORD)?.as_deref() {
        Some(BORESIGHT) => LayoutFrame::Boresight,
        _ => LayoutFrame::EastNorthUp(site),
    };
    let name = keyword(LAYOUT_KEYWORD)?.unwrap_or_else(|| telescope.clone());
    let mut layout = ArrayLayout::from_data(name, frame, antennas).map_err(|e| FormatError::values(file.path(), e))?;
    layout.source = keyword(SOURCE_KEYWORD)?;
    Ok((layout, telescope))
}

/// A receiver may add nothing, but not less.
fn not_negative(receiver: &Sensitivity) -> bool {
    let (Sensitivity::SefdJy(v) | Sensitivity::TsysK(v)) = receiver;
    *v >= 0.0
}

/// The position of the array: latitude, longitude, altitude, or geocentric coordinates in old files.
fn read_site(file: &H5In) -> Result<Site> {
    let degrees = |name: &str| file.real(&format!("Header/{name}"));
    if let (Some(lat), Some(lon), Some(altitude_m)) = (degrees("latitude")?, degrees("longitude")?, degrees("altitude")?) {
        return Ok(Site { latitude_rad: lat.to_radians(), longitude_rad: lon.to_radians(), altitude_m });
    }
    match file.reals("Header/telescope_location")? {
        Some((_, xyz)) if xyz.len() == 3 => Ok(Site::from_ecef_m([xyz[0], xyz[1], xyz[2]])),
        _ => Err(file.wrong("Header/latitude, longitude, altitude", "three numbers (or telescope_location)", "not all of them")),
    }
}

/// Make names unique. Files of real arrays have blank names, and pads that are listed twice.
pub(crate) fn unique_names(names: Vec<String>) -> Vec<String> {
    let mut seen = HashSet::new();
    names
        .into_iter()
        .enumerate()
        .map(|(k, name)| {
            let base = if name.is_empty() { format!("ANT{k}") } else { name };
            let mut unique = base.clone();
            let mut n = 1;
            while !seen.insert(unique.clone()) {
                n += 1;
                unique = format!("{base}#{n}");
            }
            unique
        })
        .collect()
}
