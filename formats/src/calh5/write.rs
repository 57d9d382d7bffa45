//! Gain tables written as CalH5.
//!
//! A gain that both feeds share is written once for each feed, because UVCal applies the gains of a feed to that feed alone.

use super::leakage::as_feeds;
use super::names::{DAY_S, JONES, MODE_KEYWORD};
use crate::h5::H5Out;
use crate::uvh5::{site_of, write_spectrum, write_telescope};
use crate::{FormatError, Result};
use cittert_arrays::astrometry::lst_rad;
use cittert_arrays::{ArrayError, GainTable, SpectralWindow};
use ndarray::{Array1, Array2, Array3, Array4, ArrayView3, ArrayView4, Axis};
use std::path::Path;

/// Jones number of a feed.
fn jones_of(path: &Path, feed: &str) -> Result<i64> {
    let expected = "one of the feeds I, R, L, X, Y";
    let known = JONES.iter().find(|j| j.0 == feed).map(|j| j.1);
    known.ok_or_else(|| FormatError::malformed(path, "feeds of the gain table", expected, format!("{feed:?}")))
}

/// Write a gain table.
///
/// # Errors
/// Arrays of unequal shapes, an existing output that may not be overwritten, or an error of the file system.
pub fn write_gains(path: &Path, table: &GainTable, overwrite: bool) -> Result<()> {
    let own: Vec<usize> = (0..table.spectrum.n_chan()).collect();
    write_gains_on(path, table, (&table.spectrum, &own), overwrite)
}

/// Write a gain table on other channels: channel k of the file holds the gains of channel `from[k]` of the table. The table is spread one antenna
/// at a time, so that the memory does not depend on the number of channels in the file.
///
/// # Errors
/// As [`write_gains`]; or `from` has not one channel of the table for each channel of the file.
pub fn write_gains_on(path: &Path, table: &GainTable, (spectrum, from): (&SpectralWindow, &[usize]), overwrite: bool) -> Result<()> {
    table.check().map_err(|e| FormatError::values(path, e))?;
    if from.len() != spectrum.n_chan() || from.iter().any(|c| *c >= table.spectrum.n_chan()) {
        let found = format!("{} for {} channels", from.len(), spectrum.n_chan());
        return Err(FormatError::malformed(path, "channels of the gains", "one channel of the table for each channel of the file", found));
    }
    let table = &as_feeds(path, &table.with_each_feed())?;
    let out = begin(path, table, overwrite)?;
    write_spectrum(&out, spectrum)?;
    out.text("Header/cal_type", "gain")?;
    out.scalar("Header/wide_band", false)?;
    let (n_time, n_ant, _, n_feed) = table.gains.dim();
    let shape = [n_ant, from.len(), n_time, n_feed];
    write_antennas(&out, "Data/gains", &shape, (table.gains.view(), from))?;
    write_antennas(&out, "Data/flags", &shape, (table.flags.view(), from))?;
    if let Some(quality) = &table.quality {
        write_antennas(&out, "Data/qualities", &shape, (quality.view(), from))?;
    }
    if let Some(total) = &table.total_quality {
        write_total(&out, total.select(Axis(1), from).view())?;
    }
    out.finish()
}

/// Write \[solint, ant, chan, feed\] as \[ant, chan, time, jones\], one antenna at a time, with channel `from[k]` as channel k.
fn write_antennas<T: hdf5::H5Type + Clone>(
    out: &H5Out,
    name: &str,
    shape: &[usize; 4],
    (values, from): (ArrayView4<'_, T>, &[usize]),
) -> Result<()> {
    out.array_by_rows(name, shape, |ant| {
        let of_antenna = values.index_axis(Axis(1), ant).select(Axis(1), from);
        of_antenna.permuted_axes([1, 0, 2]).as_standard_layout().into_owned()
    })
}

fn write_total(out: &H5Out, total: ArrayView3<'_, f64>) -> Result<()> {
    out.array("Data/total_qualities", total.permuted_axes([1, 0, 2]).as_standard_layout().view())
}

/// Flags and qualities \[solint, ant, chan, feed\], and total qualities \[solint, chan, feed\].
pub(super) struct Extras {
    pub(super) flags: Array4<bool>,
    pub(super) quality: Option<Array4<f64>>,
    pub(super) total: Option<Array3<f64>>,
}

/// Begin a file with the header items that are common to gains and delays.
pub(super) fn begin(path: &Path, table: &GainTable, overwrite: bool) -> Result<H5Out> {
    let failed = |e: ArrayError| FormatError::values(path, e);
    let (n_time, n_ant) = (table.time_jd.len(), table.layout.n_ant());
    let out = H5Out::create(path, overwrite)?;
    out.text("Header/version", "1.0")?;
    write_telescope(&out, &table.layout, &table.layout.name, "", &[])?;
    out.text("Header/history", &table.history.join("\n"))?;
    for (name, value) in [("Njones", table.feeds.len()), ("Ntimes", n_time), ("Nants_data", n_ant)] {
        out.scalar(&format!("Header/{name}"), value as i64)?;
    }
    let numbers = table.layout.antennas().iter().map(|a| i64::from(a.number));
    out.array("Header/ant_array", Array1::from_iter(numbers).view())?;
    // Ranges instead of midpoints, because UVCal applies a gain to the times within its range.
    let ranges = time_ranges(table);
    out.array("Header/time_range", ranges.view())?;
    out.array("Header/integration_time", Array1::from_vec(table.interval_s.clone()).view())?;
    let site = site_of(&table.layout);
    let lst = ranges.iter().map(|t| lst_rad(*t, &site)).collect::<std::result::Result<Vec<f64>, _>>().map_err(failed)?;
    out.array("Header/lst_range", Array2::from_shape_fn((n_time, 2), |(i, end)| lst[2 * i + end]).view())?;
    let jones = table.feeds.iter().map(|f| jones_of(path, f)).collect::<Result<Array1<i64>>>()?;
    out.array("Header/jones_array", jones.view())?;
    write_feeds(&out, table)?;
    out.text("Header/gain_convention", "divide")?;
    match table.refant.and_then(|r| table.layout.antennas().get(r)) {
        Some(antenna) => {
            out.text("Header/cal_style", "sky")?;
            out.text("Header/ref_antenna_name", &antenna.name)?;
            out.text("Header/sky_catalog", "cittert")?;
        }
        // The style `sky` needs a reference antenna. Without one, `redundant` is the only other style.
        None => out.text("Header/cal_style", "redundant")?,
    }
    out.text(&format!("Header/extra_keywords/{MODE_KEYWORD}"), &table.mode)?;
    Ok(out)
}

/// Start and end (Julian dates) of each interval \[solint, 2\]. Adjacent intervals do not overlap by rounding.
fn time_ranges(table: &GainTable) -> Array2<f64> {
    let half = |i: usize| table.interval_s[i] / 2.0 / DAY_S;
    let start = |i: usize| table.time_jd[i] - half(i);
    let end = |i: usize| {
        let nominal = table.time_jd[i] + half(i);
        if i + 1 < table.time_jd.len() && table.time_jd[i] < start(i + 1) { nominal.min(start(i + 1)) } else { nominal }
    };
    Array2::from_shape_fn((table.time_jd.len(), 2), |(i, side)| if side == 0 { start(i) } else { end(i) })
}

/// Write delays with their flags and qualities. In memory the axes are [solint, ant, chan, feed], in the file
/// [ant, chan, time, jones].
pub(super) fn write_data<T: hdf5::H5Type + Clone>(out: &H5Out, name: &str, values: ArrayView4<'_, T>, extras: &Extras) -> Result<()> {
    let order = [1, 2, 0, 3];
    out.array(name, values.permuted_axes(order).as_standard_layout().view())?;
    out.array("Data/flags", extras.flags.view().permuted_axes(order).as_standard_layout().view())?;
    if let Some(quality) = &extras.quality {
        out.array("Data/qualities", quality.view().permuted_axes(order).as_standard_layout().view())?;
    }
    if let Some(total) = &extras.total {
        write_total(out, total.view())?;
    }
    Ok(())
}

/// Write the feeds of the antennas, which UVCal requires. They are circular unless the table names X or Y. The first points north.
fn write_feeds(out: &H5Out, table: &GainTable) -> Result<()> {
    let linear = table.feeds.iter().any(|f| ["X", "Y"].contains(&f.as_str()));
    let (n, names) = (table.layout.n_ant(), if linear { ["x", "y"] } else { ["r", "l"] });
    out.scalar("Header/Nfeeds", 2i64)?;
    out.texts("Header/feed_array", &names.repeat(n), &[n, 2])?;
    let angles = Array2::from_shape_fn((n, 2), |(_, feed)| feed as f64 * std::f64::consts::FRAC_PI_2);
    out.array("Header/feed_angle", angles.view())
}
