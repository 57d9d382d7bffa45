//! What a UVH5 file holds that comes neither with its rows nor with its header.

use super::annotations::KEYWORDS;
use super::names::ANTENNA_GROUP;
use crate::Result;
use crate::h5::H5In;
use cittert_arrays::VisibilityHeader;
use std::collections::BTreeSet;

/// Datasets of the header that are read, or that follow from what is read.
const KNOWN: [&str; 56] = [
    "Nants_data",
    "Nants_telescope",
    "Nbls",
    "Nblts",
    "Nfeeds",
    "Nfreqs",
    "Nphase",
    "Npols",
    "Nspws",
    "Ntimes",
    "altitude",
    "ant_1_array",
    "ant_2_array",
    "antenna_diameters",
    "antenna_names",
    "antenna_numbers",
    "antenna_positions",
    "blt_order",
    "blts_are_rectangular",
    "channel_width",
    "feed_angle",
    "feed_array",
    "flex_spw",
    "flex_spw_id_array",
    "freq_array",
    "history",
    "instrument",
    "integration_time",
    "latitude",
    "longitude",
    "lst_array",
    "mount_type",
    "multi_phase_center",
    "object_name",
    "phase_center_app_dec",
    "phase_center_app_ra",
    "phase_center_catalog",
    "phase_center_dec",
    "phase_center_epoch",
    "phase_center_frame",
    "phase_center_frame_pa",
    "phase_center_id_array",
    "phase_center_ra",
    "phase_type",
    "pol_convention",
    "polarization_array",
    "spw_array",
    "telescope_frame",
    "telescope_location",
    "telescope_name",
    "time_array",
    "time_axis_faster_than_bls",
    "uvw_array",
    "version",
    "vis_units",
    "x_orientation",
];
/// Datasets of the data that are read. The columns beside the data are told apart from these.
const DATA: [&str; 6] = ["visdata", "flags", "weights", "model", "corrected", "residual"];
/// Properties of phase centres that are read.
const OF_CENTERS: [&str; 7] = ["cat_name", "cat_type", "cat_lon", "cat_lat", "cat_frame", "cat_epoch", "info_source"];

pub(super) fn lines(file: &H5In, header: &VisibilityHeader, samples_are_kept: bool) -> Result<Vec<String>> {
    let mut lines = Vec::new();
    let (mut of_centers, mut attributes) = (BTreeSet::new(), Vec::new());
    for object in file.objects()? {
        let place = if object.name.is_empty() { "the file".to_string() } else { object.name.clone() };
        attributes.extend(object.attributes.iter().map(|a| format!("attribute {a} of {place}")));
        if !object.is_dataset || !object.has_values {
            continue;
        }
        let name = object.name.as_str();
        let known = match name.split_once('/') {
            Some(("Header", rest)) => match rest.split_once('/') {
                None => KNOWN.contains(&rest),
                Some(("extra_keywords", key)) => {
                    if file.keyword(&format!("{KEYWORDS}/{key}"))?.is_none() {
                        lines.push(format!("keyword {key} (it is not one number or text)"));
                    }
                    true
                }
                Some(("phase_center_catalog", property)) => {
                    let leaf = property.rsplit('/').next().unwrap_or(property);
                    if property.contains('/') && !OF_CENTERS.contains(&leaf) {
                        of_centers.insert(leaf.to_string());
                    }
                    true
                }
                Some(_) => false,
            },
            Some(("Data", "nsamples")) => {
                if !samples_are_kept && file.has("Data/weights") {
                    lines.push("dataset Data/nsamples (the weights are kept)".into());
                }
                true
            }
            Some(("Data", rest)) => DATA.contains(&rest),
            _ => name.starts_with(ANTENNA_GROUP),
        };
        if !known {
            lines.push(format!("dataset {name}"));
        }
    }
    if file.has("Header/feed_angle") && header.annotations.x_orientation.is_none() {
        lines.push("datasets Header/feed_array and Header/feed_angle (the names of the products are kept)".into());
    }
    if !of_centers.is_empty() {
        let names = of_centers.into_iter().collect::<Vec<_>>().join(", ");
        lines.push(format!("{names} of the phase centres (their names and directions are kept)"));
    }
    lines.extend(attributes);
    Ok(lines)
}
