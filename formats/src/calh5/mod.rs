//! CalH5: antenna gains as pyuvdata's UVCal keeps them, in HDF5.
//!
//! On disk gains are \[ant, chan, time, jones\] and say how they are meant: `divide` is ours, V_corrupt = g1 conj(g2) V for
//! uvw = r2 - r1. Tables that say `multiply` are inverted on reading. Delays become gains of modulus 1, see [`write_delays`].
//!
//! # Reference
//! Hazelton et al. 2017, JOSS 2, 140 (pyuvdata); the CalH5 memo of that project.

mod delays;

pub use delays::write_delays;

use crate::format::{Format, GainFormat, Holds};
use crate::h5::{H5In, H5Out};
use crate::uvh5::{read_spectrum, read_telescope, site_of, write_spectrum, write_telescope};
use crate::{FormatError, Result};
use cittert_arrays::astrometry::lst_rad;
use cittert_arrays::{ArrayError, GainTable, SpectralWindow};
use ndarray::{Array1, Array2, Array3, Array4, ArrayView4, Axis, Ix3, Ix4};
use num_complex::Complex64;
use std::path::Path;

/// Keyword (of `extra_keywords`) that says what the gains are.
const MODE_KEYWORD: &str = "cittert_mode";
/// Seconds of a day.
const DAY_S: f64 = 86_400.0;
/// Most gains of one table.
const MOST_GAINS: usize = 1 << 27;

/// Names of feeds and their Jones numbers; gains of Stokes I have 0. Gains that feeds share are written once for each, since UVCal
/// applies those of a feed to that feed alone.
const JONES: [(&str, i64); 4] = [("R", -1), ("L", -2), ("X", -5), ("Y", -6)];

fn jones_of(feed: &str) -> i64 {
    JONES.iter().find(|j| j.0 == feed).map_or(0, |j| j.1)
}

/// Write a gain table.
///
/// # Errors
/// Arrays of unequal shapes, an existing output that may not be overwritten, or whatever the disk says.
pub fn write_gains(path: &Path, table: &GainTable, overwrite: bool) -> Result<()> {
    table.check().map_err(|e| FormatError::values(path, e))?;
    let table = &table.with_each_feed();
    let out = begin(path, table, overwrite)?;
    write_spectrum(&out, &table.spectrum)?;
    out.text("Header/cal_type", "gain")?;
    out.scalar("Header/wide_band", false)?;
    write_data(&out, "Data/gains", table.gains.view(), &Extras::of(table))?;
    out.finish()
}

/// Flags and qualities \[solint, ant, chan, feed\], and total qualities \[solint, chan, feed\].
struct Extras {
    flags: Array4<bool>,
    quality: Option<Array4<f64>>,
    total: Option<Array3<f64>>,
}

impl Extras {
    fn of(table: &GainTable) -> Self {
        Self { flags: table.flags.clone(), quality: table.quality.clone(), total: table.total_quality.clone() }
    }
}

/// Begin a file with the header items that gains and delays share.
fn begin(path: &Path, table: &GainTable, overwrite: bool) -> Result<H5Out> {
    let failed = |e: ArrayError| FormatError::values(path, e);
    let (n_time, n_ant) = (table.time_jd.len(), table.layout.n_ant());
    let out = H5Out::create(path, overwrite)?;
    out.text("Header/version", "1.0")?;
    write_telescope(&out, &table.layout, &table.layout.name, "")?;
    out.text("Header/history", &table.history.join("\n"))?;
    for (name, value) in [("Njones", table.feeds.len()), ("Ntimes", n_time), ("Nants_data", n_ant)] {
        out.scalar(&format!("Header/{name}"), value as i64)?;
    }
    let numbers = table.layout.antennas().iter().map(|a| i64::from(a.number));
    out.array("Header/ant_array", Array1::from_iter(numbers).view())?;
    // Ranges, not middles: UVCal applies a gain to the times within its range.
    let ranges = time_ranges(table);
    out.array("Header/time_range", ranges.view())?;
    out.array("Header/integration_time", Array1::from_vec(table.interval_s.clone()).view())?;
    let site = site_of(&table.layout);
    let lst = ranges.iter().map(|t| lst_rad(*t, &site)).collect::<std::result::Result<Vec<f64>, _>>().map_err(failed)?;
    out.array("Header/lst_range", Array2::from_shape_fn((n_time, 2), |(i, end)| lst[2 * i + end]).view())?;
    out.array("Header/jones_array", Array1::from_iter(table.feeds.iter().map(|f| jones_of(f))).view())?;
    write_feeds(&out, table)?;
    out.text("Header/gain_convention", "divide")?;
    match table.refant.and_then(|r| table.layout.antennas().get(r)) {
        Some(antenna) => {
            out.text("Header/cal_style", "sky")?;
            out.text("Header/ref_antenna_name", &antenna.name)?;
            out.text("Header/sky_catalog", "cittert")?;
        }
        // Without a reference antenna the format's other style is the only one left.
        None => out.text("Header/cal_style", "redundant")?,
    }
    out.text(&format!("Header/extra_keywords/{MODE_KEYWORD}"), &table.mode)?;
    Ok(out)
}

/// First and last moment (Julian dates) of each interval \[solint, 2\]; they meet, but never overlap by a rounding.
fn time_ranges(table: &GainTable) -> Array2<f64> {
    let half = |i: usize| table.interval_s[i] / 2.0 / DAY_S;
    let start = |i: usize| table.time_jd[i] - half(i);
    let end = |i: usize| {
        let nominal = table.time_jd[i] + half(i);
        if i + 1 < table.time_jd.len() && table.time_jd[i] < start(i + 1) { nominal.min(start(i + 1)) } else { nominal }
    };
    Array2::from_shape_fn((table.time_jd.len(), 2), |(i, side)| if side == 0 { start(i) } else { end(i) })
}

/// Write gains or delays with their flags and qualities: ours are [solint, ant, chan, feed], theirs [ant, chan, time, jones].
fn write_data<T: hdf5::H5Type + Clone>(out: &H5Out, name: &str, values: ArrayView4<'_, T>, extras: &Extras) -> Result<()> {
    let order = [1, 2, 0, 3];
    out.array(name, values.permuted_axes(order).as_standard_layout().view())?;
    out.array("Data/flags", extras.flags.view().permuted_axes(order).as_standard_layout().view())?;
    if let Some(quality) = &extras.quality {
        out.array("Data/qualities", quality.view().permuted_axes(order).as_standard_layout().view())?;
    }
    if let Some(total) = &extras.total {
        out.array("Data/total_qualities", total.view().permuted_axes([1, 0, 2]).as_standard_layout().view())?;
    }
    Ok(())
}

/// Feeds of the antennas, which UVCal demands: circular ones unless the table names X or Y; the first points north.
fn write_feeds(out: &H5Out, table: &GainTable) -> Result<()> {
    let linear = table.feeds.iter().any(|f| ["X", "Y"].contains(&f.as_str()));
    let (n, names) = (table.layout.n_ant(), if linear { ["x", "y"] } else { ["r", "l"] });
    out.scalar("Header/Nfeeds", 2i64)?;
    out.texts("Header/feed_array", &names.repeat(n), &[n, 2])?;
    let angles = Array2::from_shape_fn((n, 2), |(_, feed)| feed as f64 * std::f64::consts::FRAC_PI_2);
    out.array("Header/feed_angle", angles.view())
}

/// The row of CalH5 in the table of formats.
pub(crate) struct CalH5;

impl Format for CalH5 {
    fn name(&self) -> &'static str {
        "CalH5"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["calh5"]
    }

    fn description(&self) -> &'static str {
        "antenna gains and delays (HDF5), as pyuvdata's UVCal reads and applies them"
    }

    fn sniff(&self, path: &Path, start: &[u8]) -> bool {
        start.starts_with(crate::h5::SIGNATURE) && is_gains(path)
    }

    fn holds(&self) -> Holds<'_> {
        Holds::Gains(self)
    }
}

impl GainFormat for CalH5 {
    fn read(&self, path: &Path) -> Result<GainTable> {
        read_gains(path)
    }

    fn write(&self, path: &Path, table: &GainTable, overwrite: bool) -> Result<()> {
        write_gains(path, table, overwrite)
    }
}

/// True where the content of a file is a gain table.
#[must_use]
pub fn is_gains(path: &Path) -> bool {
    crate::h5::has(path, "Data/gains") || crate::h5::has(path, "Data/delays")
}

/// Read a gain table written by this program or by pyuvdata. Delays without channels become gains on channels made for them.
///
/// # Errors
/// Not HDF5 or no gains in it, an item that is missing or of the wrong shape.
pub fn read_gains(path: &Path) -> Result<GainTable> {
    read(path, None)
}

/// As [`read_gains`], but delays become gains at the channels `channels` of the data that they are for.
///
/// # Errors
/// As [`read_gains`].
pub fn read_gains_for(path: &Path, channels: &SpectralWindow) -> Result<GainTable> {
    read(path, Some(channels))
}

fn read(path: &Path, channels: Option<&SpectralWindow>) -> Result<GainTable> {
    let file = H5In::open(path, "a CalH5 gain table")?;
    let delays = !file.has("Data/gains");
    if delays && !file.has("Data/delays") {
        let found = "an HDF5 file without Data/gains or Data/delays".into();
        return Err(FormatError::NotA { path: path.into(), expected: "a CalH5 gain table".into(), found });
    }
    let (layout, _) = read_telescope(&file)?;
    let own = spectrum(&file, delays)?;
    let shape = [file.count("Header/Nants_data")?, own.n_chan(), file.count("Header/Ntimes")?, file.count("Header/Njones")?];
    if shape.iter().try_fold(1usize, |p, k| p.checked_mul(*k)).is_none_or(|p| p == 0 || p > MOST_GAINS) {
        return Err(file.wrong(
            "Header/Nants_data, Nfreqs, Ntimes, Njones",
            format!("1 to {MOST_GAINS} gains in all"),
            format!("{shape:?}"),
        ));
    }
    let feeds = file.list("Header/jones_array", shape[3])?.iter().map(|j| feed_name(&file, *j)).collect::<Result<Vec<_>>>()?;
    let invert = match file.text("Header/gain_convention")?.as_deref() {
        Some("divide") | None => false,
        Some("multiply") => true,
        Some(other) => return Err(file.wrong("Header/gain_convention", "divide or multiply", format!("{other:?}"))),
    };
    let values = if delays { delays::read(&file, own, shape, channels)? } else { Values::gains(&file, own, shape)? };
    let (time_jd, interval_s) = times(&file, shape[2])?;
    if shape[2].saturating_mul(layout.n_ant()).saturating_mul(values.spectrum.n_chan()) > MOST_GAINS {
        return Err(file.wrong("Header/Nants_telescope", format!("at most {MOST_GAINS} gains in all"), layout.n_ant().to_string()));
    }
    let mut table =
        GainTable::unity(layout, values.spectrum.clone(), feeds, time_jd, interval_s).map_err(|e| FormatError::values(path, e))?;
    fill(&file, &mut table, &values, shape, invert)?;
    let reference = file.text("Header/ref_antenna_name")?;
    table.refant = reference.and_then(|name| table.layout.index_of(&name));
    table.mode =
        file.text(&format!("Header/extra_keywords/{MODE_KEYWORD}"))?.unwrap_or_else(|| if delays { "delay" } else { "gain" }.into());
    table.history = file.text("Header/history")?.unwrap_or_default().lines().map(String::from).collect();
    table.check().map_err(|e| FormatError::values(path, e))?;
    Ok(table.with_equal_feeds_joined())
}

/// The gains of a file \[ant, chan, time, jones\].
struct Values {
    gains: Array4<Complex64>,
    spectrum: SpectralWindow,
    /// For each channel, the index along the file's own axis, where flags and qualities are found.
    own: Vec<usize>,
}

impl Values {
    fn gains(file: &H5In, spectrum: SpectralWindow, shape: [usize; 4]) -> Result<Self> {
        let dataset = file.shaped("Data/gains", &[&shape])?;
        file.demand_complex(&dataset, "Data/gains")?;
        let gains = file.rows::<_, Ix4>(&dataset, "Data/gains", 0..shape[0])?;
        Ok(Self { gains, own: (0..spectrum.n_chan()).collect(), spectrum })
    }
}

fn feed_name(file: &H5In, jones: f64) -> Result<String> {
    if jones == 0.0 {
        return Ok("I".into());
    }
    JONES.iter().find(|j| j.1 as f64 == jones).map(|j| j.0.to_string()).ok_or_else(|| {
        file.wrong("Header/jones_array", "0, -1 (R), -2 (L), -5 (X) or -6 (Y); leakage terms are not read", jones.to_string())
    })
}

/// Channels; a wide-band table, and every one of delays, has one value for each spectral window.
fn spectrum(file: &H5In, delays: bool) -> Result<SpectralWindow> {
    if !delays && file.real("Header/wide_band")?.unwrap_or(0.0) == 0.0 {
        return read_spectrum(file);
    }
    let n = file.count("Header/Nspws")?;
    let (centre, width) = if file.has("Header/freq_range") {
        let ranges = file.list("Header/freq_range", 2 * n)?;
        ranges.chunks_exact(2).map(|r| ((r[0] + r[1]) / 2.0, r[1] - r[0])).unzip()
    } else {
        delays::extents(&read_spectrum(file)?)
    };
    SpectralWindow::with_windows(centre, width, (0..n as u32).collect()).map_err(|e| FormatError::values(file.path(), e))
}

/// Middle (Julian date) and length (s) of the solution intervals.
fn times(file: &H5In, n: usize) -> Result<(Vec<f64>, Vec<f64>)> {
    let lengths = || match file.reals("Header/integration_time")? {
        Some((_, v)) if v.len() == 1 => Ok(vec![v[0]; n]),
        _ => file.list("Header/integration_time", n),
    };
    if file.has("Header/time_array") {
        return Ok((file.list("Header/time_array", n)?, lengths()?));
    }
    let ranges = file.list("Header/time_range", 2 * n)?;
    let (middle, length): (Vec<f64>, Vec<f64>) = ranges.chunks_exact(2).map(|r| ((r[0] + r[1]) / 2.0, (r[1] - r[0]) * DAY_S)).unzip();
    // Lengths that are written are exact; a Julian date is good to 40 microseconds.
    Ok((middle, if file.has("Header/integration_time") { lengths()? } else { length }))
}

/// Gains, flags and qualities of the antennas that the file has; the others stay at 1 and are flagged.
fn fill(file: &H5In, table: &mut GainTable, values: &Values, n: [usize; 4], invert: bool) -> Result<()> {
    let place = |number: f64| {
        let found = table.layout.antennas().iter().position(|a| f64::from(a.number) == number);
        found.ok_or_else(|| file.wrong("Header/ant_array", "a number of Header/antenna_numbers", number.to_string()))
    };
    let at = file.list("Header/ant_array", n[0])?.into_iter().map(place).collect::<Result<Vec<usize>>>()?;
    let numbers = |name: &str, shape: &[usize]| -> Result<hdf5::Dataset> {
        let dataset = file.shaped(name, &[shape])?;
        file.demand_numbers(&dataset, name)?;
        Ok(dataset)
    };
    let flags: Array4<i8> = file.rows::<_, Ix4>(&numbers("Data/flags", &n)?, "Data/flags", 0..n[0])?;
    let quality = match file.has("Data/qualities") {
        true => Some(file.rows::<f64, Ix4>(&numbers("Data/qualities", &n)?, "Data/qualities", 0..n[0])?),
        false => None,
    };
    table.flags.fill(true);
    let mut own_quality = quality.as_ref().map(|_| Array4::zeros(table.gains.raw_dim()));
    for ((a, chan, time, feed), gain) in values.gains.indexed_iter() {
        let (to, from) = ((time, at[a], chan, feed), (a, values.own[chan], time, feed));
        table.gains[to] = if invert { gain.inv() } else { *gain };
        table.flags[to] = flags[from] != 0;
        if let (Some(own), Some(q)) = (&mut own_quality, &quality) {
            own[to] = q[from];
        }
    }
    table.quality = own_quality;
    if file.has("Data/total_qualities") {
        let dataset = numbers("Data/total_qualities", &n[1..])?;
        let total: Array3<f64> = file.rows::<_, Ix3>(&dataset, "Data/total_qualities", 0..n[1])?;
        let of_channels = total.select(Axis(0), &values.own);
        table.total_quality = Some(of_channels.permuted_axes([1, 0, 2]).as_standard_layout().into_owned());
    }
    Ok(())
}

#[cfg(test)]
mod tests;
