//! Gain tables read from CalH5.

use super::delays;
use super::leakage::from_feeds;
use super::names::{DAY_S, JONES, MODE_KEYWORD};
use crate::h5::{self, H5In};
use crate::uvh5::{read_spectrum, read_telescope};
use crate::{FormatError, Result};
use bytemuck::Pod;
use cittert_arrays::{GainTable, SpectralWindow};
use hdf5::{Dataset, H5Type};
use ndarray::{Array3, Array4, Axis, Ix3, Ix4};
use num_complex::Complex64;
use std::path::Path;

/// Most gains of one table.
const MOST_GAINS: usize = 1 << 27;

/// True where the content of a file is a gain table.
#[must_use]
pub fn is_gains(path: &Path) -> bool {
    h5::has(path, "Data/gains") || h5::has(path, "Data/delays")
}

/// Read a gain table written by cittert or by pyuvdata. Delays without channels become gains on channels that are made for them.
///
/// # Errors
/// A file that is not HDF5 or has no gains, or an item that is missing or has the wrong shape.
pub fn read_gains(path: &Path) -> Result<GainTable> {
    read(path, None)
}

/// As [`read_gains`], but delays become gains at `channels`, the channels of the data to be calibrated, and gains that are the same in all
/// channels of the file become one channel as wide as the band, which takes less memory.
///
/// # Errors
/// As [`read_gains`].
pub fn read_gains_for(path: &Path, channels: &SpectralWindow) -> Result<GainTable> {
    read(path, Some(channels))
}

fn read(path: &Path, channels: Option<&SpectralWindow>) -> Result<GainTable> {
    let file = h5::open(path, "a CalH5 gain table")?;
    let delays = !file.has("Data/gains");
    if delays && !file.has("Data/delays") {
        return Err(FormatError::not_a(path, "a CalH5 gain table", "an HDF5 file without Data/gains or Data/delays"));
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
        Some("divide") => false,
        Some("multiply") => true,
        None => return Err(file.missing("Header/gain_convention")),
        Some(other) => return Err(file.wrong("Header/gain_convention", "divide or multiply", format!("{other:?}"))),
    };
    let values = match channels {
        _ if delays => Values::Delays(delays::read(&file, own, shape, channels)?),
        Some(_) if same_in_all_channels(&file, &own, shape)? => Values::Gains(whole_band(&file, &own)?),
        _ => Values::Gains(own),
    };
    let (time_jd, interval_s) = times(&file, shape[2])?;
    if shape[2].saturating_mul(layout.n_ant()).saturating_mul(values.spectrum().n_chan()) > MOST_GAINS {
        return Err(file.wrong("Header/Nants_telescope", format!("at most {MOST_GAINS} gains in all"), layout.n_ant().to_string()));
    }
    let mut table =
        GainTable::unity(layout, values.spectrum().clone(), feeds, time_jd, interval_s).map_err(|e| FormatError::values(path, e))?;
    fill(&file, &mut table, &values, shape, invert)?;
    if let Some(name) = file.text("Header/ref_antenna_name")?.filter(|name| !name.is_empty()) {
        let index = table.layout.index_of(&name);
        table.refant = Some(index.ok_or_else(|| file.wrong("Header/ref_antenna_name", "the name of an antenna of the table", name))?);
    }
    table.mode =
        file.text(&format!("Header/extra_keywords/{MODE_KEYWORD}"))?.unwrap_or_else(|| if delays { "delay" } else { "gain" }.into());
    table.history = file.text("Header/history")?.unwrap_or_default().lines().map(String::from).collect();
    table.check().map_err(|e| FormatError::values(path, e))?;
    Ok(from_feeds(&file, table, invert)?.with_equal_feeds_joined())
}

/// The values of a file, with the channels of the table.
enum Values {
    /// Gains are read one antenna after the other. The channels of the table are the first ones of the file.
    Gains(SpectralWindow),
    /// Delays as gains.
    Delays(delays::DelayGains),
}

impl Values {
    fn spectrum(&self) -> &SpectralWindow {
        match self {
            Self::Gains(spectrum) => spectrum,
            Self::Delays(delays) => &delays.spectrum,
        }
    }

    /// For each channel of the table, the index along the axis of the file.
    fn own(&self) -> Vec<usize> {
        match self {
            Self::Gains(spectrum) => (0..spectrum.n_chan()).collect(),
            Self::Delays(delays) => delays.own.clone(),
        }
    }
}

/// The numbers of one antenna in the file \[chan, time, jones\].
struct OfAntenna {
    gains: Array3<Complex64>,
    flags: Array3<i8>,
    quality: Option<Array3<f64>>,
}

/// The datasets of a file, to be read one antenna after the other.
struct Datasets<'a> {
    file: &'a H5In,
    gains: Option<Dataset>,
    flags: Dataset,
    quality: Option<Dataset>,
}

impl<'a> Datasets<'a> {
    fn open(file: &'a H5In, shape: &[usize; 4], delays: bool) -> Result<Self> {
        let gains = if delays { None } else { Some(file.shaped("Data/gains", &[shape])?) };
        gains.as_ref().map_or(Ok(()), |d| file.demand_complex(d, "Data/gains"))?;
        let quality = file.optional_numbers("Data/qualities", &[shape])?;
        Ok(Self { file, gains, flags: file.numbers("Data/flags", &[shape])?, quality })
    }

    fn part<T: H5Type + Pod>(&self, dataset: &Dataset, name: &str, ant: usize) -> Result<Array3<T>> {
        let part: Array4<T> = self.file.rows::<_, Ix4>(dataset, name, ant..ant + 1)?;
        Ok(part.index_axis_move(Axis(0), 0))
    }

    fn antenna(&self, ant: usize) -> Result<OfAntenna> {
        let gains = self.gains.as_ref().map_or_else(|| Ok(Array3::default((0, 0, 0))), |d| self.part(d, "Data/gains", ant))?;
        let quality = self.quality.as_ref().map(|d| self.part(d, "Data/qualities", ant)).transpose()?;
        Ok(OfAntenna { gains, flags: self.part(&self.flags, "Data/flags", ant)?, quality })
    }
}

/// True where a file of one spectral window has the same gains, flags and qualities in every channel.
fn same_in_all_channels(file: &H5In, own: &SpectralWindow, shape: [usize; 4]) -> Result<bool> {
    if own.n_chan() < 2 || own.spw().iter().any(|w| *w != own.spw()[0]) {
        return Ok(false);
    }
    fn equal<T: PartialEq>(values: &Array3<T>) -> bool {
        values.outer_iter().all(|channel| channel == values.index_axis(Axis(0), 0))
    }
    let data = Datasets::open(file, &shape, false)?;
    for ant in 0..shape[0] {
        let of = data.antenna(ant)?;
        if !(equal(&of.gains) && equal(&of.flags) && of.quality.as_ref().is_none_or(equal)) {
            return Ok(false);
        }
    }
    let total = file.optional_numbers("Data/total_qualities", &[&shape[1..]])?;
    total.map_or(Ok(true), |d| Ok(equal(&file.rows::<f64, Ix3>(&d, "Data/total_qualities", 0..shape[1])?)))
}

/// One channel as wide as all channels of a spectral window.
fn whole_band(file: &H5In, own: &SpectralWindow) -> Result<SpectralWindow> {
    let (centre, width) = delays::extents(own);
    SpectralWindow::with_windows(centre, width, own.spw()[..1].to_vec()).map_err(|e| FormatError::values(file.path(), e))
}

fn feed_name(file: &H5In, jones: f64) -> Result<String> {
    JONES
        .iter()
        .find(|j| j.1 as f64 == jones)
        .map(|j| j.0.to_string())
        .ok_or_else(|| file.wrong("Header/jones_array", "0, or -1 (R) to -8 (Jyx)", jones.to_string()))
}

/// Read the channels. A wide-band table and a table of delays have one value for each spectral window.
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

/// Read the midpoints (Julian date) and lengths (s) of the solution intervals.
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
    // Lengths in the file are exact. Differences of Julian dates are accurate only to 40 microseconds.
    Ok((middle, if file.has("Header/integration_time") { lengths()? } else { length }))
}

/// Fill in the gains, flags and qualities of the antennas in the file. The gains of other antennas stay 1 and are flagged.
fn fill(file: &H5In, table: &mut GainTable, values: &Values, n: [usize; 4], invert: bool) -> Result<()> {
    let place = |number: f64| {
        let found = table.layout.antennas().iter().position(|a| f64::from(a.number) == number);
        found.ok_or_else(|| file.wrong("Header/ant_array", "a number of Header/antenna_numbers", number.to_string()))
    };
    let at = file.list("Header/ant_array", n[0])?.into_iter().map(place).collect::<Result<Vec<usize>>>()?;
    let data = Datasets::open(file, &n, matches!(values, Values::Delays(_)))?;
    let own = values.own();
    table.flags.fill(true);
    let mut own_quality = data.quality.as_ref().map(|_| Array4::zeros(table.gains.raw_dim()));
    for (a, place) in at.iter().enumerate() {
        let of = data.antenna(a)?;
        for ((time, chan, feed), gain) in table.gains.index_axis_mut(Axis(1), *place).indexed_iter_mut() {
            let from = (own[chan], time, feed);
            let found = match values {
                Values::Gains(_) => of.gains[from],
                Values::Delays(delays) => delays.gains[(a, chan, time, feed)],
            };
            *gain = if invert { found.inv() } else { found };
            let to = (time, *place, chan, feed);
            table.flags[to] = of.flags[from] != 0;
            if let (Some(all), Some(quality)) = (&mut own_quality, &of.quality) {
                all[to] = quality[from];
            }
        }
    }
    table.quality = own_quality;
    if let Some(dataset) = file.optional_numbers("Data/total_qualities", &[&n[1..]])? {
        let total: Array3<f64> = file.rows::<_, Ix3>(&dataset, "Data/total_qualities", 0..n[1])?;
        let of_channels = total.select(Axis(0), &own);
        table.total_quality = Some(of_channels.permuted_axes([1, 0, 2]).as_standard_layout().into_owned());
    }
    Ok(())
}
