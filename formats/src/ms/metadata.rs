//! Reading the subtables of a Measurement Set as the header of a set.

use super::codes::{frame_of, product_of};
use super::keywords::Place;
use super::observatories;
use super::own::Own;
use super::parts::open;
use super::subtables::{APPLICATION, RECEIVER_K, RECEIVER_SEFD};
use super::table::{Kind, Table};
use crate::uvh5::{NOMINAL_SITE, unique_names};
use crate::{FormatError, Result};
use cittert_arrays::{Annotations, Antenna, ArrayLayout, LayoutFrame, PhaseCenter, Polarization, Sensitivity, Site, SpectralWindow};
use std::collections::HashSet;
use std::path::Path;

/// Largest number of lines of HISTORY that are read.
const MAX_HISTORY: usize = 10_000;

/// One data description: window, and products of its rows.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Description {
    pub(super) window: i32,
    pub(super) products: Vec<Polarization>,
    pub(super) freq_hz: Vec<f64>,
    pub(super) width_hz: Vec<f64>,
}

/// The data descriptions of these numbers.
pub(super) fn descriptions(ms: &Path, ids: &[i32]) -> Result<Vec<Description>> {
    let (dd, n_dd) = open(ms, "DATA_DESCRIPTION")?;
    let (pol, n_pol) = open(ms, "POLARIZATION")?;
    let (spw, n_spw) = open(ms, "SPECTRAL_WINDOW")?;
    let windows = dd.scalars::<i32>("SPECTRAL_WINDOW_ID", 0, n_dd)?;
    let polarizations = dd.scalars::<i32>("POLARIZATION_ID", 0, n_dd)?;
    let row = |what: &str, id: i32, n: usize, table: &str| {
        usize::try_from(id)
            .ok()
            .filter(|k| *k < n)
            .ok_or_else(|| FormatError::malformed(ms, what, format!("a row of {table}, which has {n}"), id.to_string()))
    };
    ids.iter()
        .map(|id| {
            let k = row("DATA_DESC_ID", *id, n_dd, "DATA_DESCRIPTION")?;
            let s = row("DATA_DESCRIPTION/SPECTRAL_WINDOW_ID", windows[k], n_spw, "SPECTRAL_WINDOW")?;
            let p = row("DATA_DESCRIPTION/POLARIZATION_ID", polarizations[k], n_pol, "POLARIZATION")?;
            let (_, freq_hz) = spw.array::<f64>("CHAN_FREQ", s)?;
            let (_, width_hz) = spw.array::<f64>("CHAN_WIDTH", s)?;
            if width_hz.len() != freq_hz.len() {
                let found = format!("{} widths", width_hz.len());
                return Err(FormatError::malformed(&spw.path, format!("CHAN_WIDTH, row {s}"), format!("{} widths", freq_hz.len()), found));
            }
            let (_, codes) = pol.array::<i32>("CORR_TYPE", p)?;
            let products = codes
                .iter()
                .map(|c| {
                    product_of(*c).ok_or_else(|| {
                        let expected = "codes 1 to 12 (I Q U V RR RL LR LL XX XY YX YY)";
                        FormatError::malformed(&pol.path, format!("CORR_TYPE, row {p}"), expected, c.to_string())
                    })
                })
                .collect::<Result<Vec<_>>>()?;
            Ok(Description { window: windows[k], products, freq_hz, width_hz })
        })
        .collect()
}

/// All channels, window after window.
pub(super) fn spectrum(ms: &Path, descriptions: &[Description]) -> Result<SpectralWindow> {
    let mut seen = HashSet::new();
    if let Some(d) = descriptions.iter().find(|d| !seen.insert(d.window)) {
        let what = format!("two data descriptions share spectral window {}: split the set by DATA_DESC_ID first", d.window);
        return Err(FormatError::unsupported(ms, what));
    }
    if let Some(d) = descriptions.iter().find(|d| d.products != descriptions[0].products) {
        let what = format!(
            "spectral window {} has other polarisation products than window {}: split the set by DATA_DESC_ID first",
            d.window, descriptions[0].window
        );
        return Err(FormatError::unsupported(ms, what));
    }
    let freq = descriptions.iter().flat_map(|d| d.freq_hz.iter().copied()).collect();
    let width = descriptions.iter().flat_map(|d| d.width_hz.iter().copied()).collect();
    let spw = descriptions.iter().flat_map(|d| vec![d.window as u32; d.freq_hz.len()]).collect();
    SpectralWindow::with_windows(freq, width, spw).map_err(|e| FormatError::values(&ms.join("SPECTRAL_WINDOW"), e))
}

/// The array, and for each row of ANTENNA its antenna.
#[derive(Debug)]
pub(super) struct Array {
    pub(super) layout: ArrayLayout,
    pub(super) telescope: String,
    pub(super) of_row: Vec<Option<u32>>,
    /// STATION and MOUNT of each antenna.
    stations: Vec<String>,
    mounts: Vec<String>,
}

impl Array {
    /// Add the mounts, and the stations where they are not the names of the antennas.
    pub(super) fn annotate(&self, mut annotations: Annotations) -> Annotations {
        let antennas = self.layout.antennas();
        if self.layout.site().is_some() && self.mounts.iter().any(|m| !m.is_empty()) {
            annotations.mounts = self.mounts.iter().map(|m| m.to_ascii_lowercase()).collect();
        }
        if self.stations.iter().zip(antennas).any(|(station, a)| !station.is_empty() && *station != a.name) {
            annotations.stations.clone_from(&self.stations);
        }
        annotations
    }
}

/// Read ANTENNA and OBSERVATION.
pub(super) fn array(ms: &Path, own: &Own, from_importuvfits: bool) -> Result<Array> {
    let (observation, n_obs) = open(ms, "OBSERVATION")?;
    let telescope = if n_obs > 0 { observation.get_text("TELESCOPE_NAME", 0, 0)? } else { String::new() };
    let (t, rows) = open(ms, "ANTENNA")?;
    let mut positions = vec![0.0_f64; 3 * rows];
    t.get_into("POSITION", 0, &[3], &mut positions)?;
    let diameters = t.scalars::<f64>("DISH_DIAMETER", 0, rows)?;
    let texts = |column: &str| (0..rows).map(|r| t.get_text(column, r, 0)).collect::<Result<Vec<_>>>();
    let (names, stations) = (texts("NAME")?, texts("STATION")?);
    let place = |r: usize| [positions[3 * r], positions[3 * r + 1], positions[3 * r + 2]];
    // Rows without an antenna have a position at the centre of the Earth.
    let real: Vec<usize> = (0..rows).filter(|r| place(*r) != [0.0; 3]).collect();
    let real = if real.is_empty() { (0..rows).collect() } else { real };
    if real.is_empty() {
        return Err(FormatError::malformed(&t.path, "rows", "at least one antenna", "none"));
    }
    let center = if own.boresight { Some(NOMINAL_SITE.to_ecef_m()) } else { location(&observation, n_obs)? };
    let mean = || [0, 1, 2].map(|k| real.iter().map(|r| place(*r)[k]).sum::<f64>() / real.len() as f64);
    let center = center.or_else(|| observatories::center_m(&telescope)).unwrap_or_else(mean);
    let site = if own.boresight { NOMINAL_SITE } else { Site::from_ecef_m(center) };
    // importuvfits writes antenna numbers as names, and the names as stations.
    let distinct = real.iter().map(|r| names[*r].as_str()).collect::<HashSet<_>>().len() == real.len();
    let named = !from_importuvfits && distinct && real.iter().all(|r| !names[*r].is_empty());
    let labels = unique_names(real.iter().map(|r| if named { names[*r].clone() } else { stations[*r].clone() }).collect());
    let stated = |key: &str, row: usize| -> Result<Option<f64>> {
        Ok(t.keyword_number(Place::table(key), row)?.filter(|v| v.is_finite() && *v >= 0.0))
    };
    let receiver = |row: usize| -> Result<Option<Sensitivity>> {
        let sefd = stated(RECEIVER_SEFD, row)?.map(Sensitivity::SefdJy);
        Ok(sefd.or(stated(RECEIVER_K, row)?.map(Sensitivity::TsysK)))
    };
    let mut of_row = vec![None; rows];
    let mut antennas = Vec::with_capacity(real.len());
    for ((k, r), label) in real.iter().enumerate().zip(labels) {
        of_row[*r] = Some(k as u32);
        let d = [0, 1, 2].map(|i| place(*r)[i] - center[i]);
        let mut antenna = Antenna::new(label, *r as u32, site.ecef_offset_to_enu(d));
        antenna.diameter_m = Some(diameters[*r]).filter(|d| d.is_finite() && *d > 0.0);
        antenna.receiver = receiver(*r)?;
        antennas.push(antenna);
    }
    let frame = if own.boresight { LayoutFrame::Boresight } else { LayoutFrame::EastNorthUp(site) };
    let name = own.layout.clone().unwrap_or_else(|| telescope.clone());
    let mut layout = ArrayLayout::from_data(name, frame, antennas).map_err(|e| FormatError::values(&t.path, e))?;
    layout.pattern.clone_from(&own.pattern);
    layout.source.clone_from(&own.source);
    let mounts = match t.column_ndim("MOUNT", Kind::String)? {
        Some(_) => real.iter().map(|r| t.get_text("MOUNT", *r, 0)).collect::<Result<Vec<_>>>()?,
        None => Vec::new(),
    };
    let stations = real.iter().map(|r| stations[*r].clone()).collect();
    Ok(Array { layout, telescope, of_row, stations, mounts })
}

/// The centre of the array, which pyuvdata and cittert store in a column of OBSERVATION.
fn location(observation: &Table, rows: usize) -> Result<Option<[f64; 3]>> {
    const COLUMN: &str = "TELESCOPE_LOCATION";
    if rows == 0 || observation.column_ndim(COLUMN, Kind::Double)?.is_none() {
        return Ok(None);
    }
    let (_, xyz) = observation.array::<f64>(COLUMN, 0)?;
    Ok(match xyz[..] {
        [x, y, z] if [x, y, z].iter().all(|v| v.is_finite()) && [x, y, z] != [0.0; 3] => Some([x, y, z]),
        _ => None,
    })
}

/// Read FIELD.
pub(super) fn phase_centers(ms: &Path, own: &Own) -> Result<Vec<PhaseCenter>> {
    let (t, rows) = open(ms, "FIELD")?;
    if rows == 0 || rows > 1 << 16 {
        return Err(FormatError::malformed(&t.path, "rows", "1 to 65536 fields", rows.to_string()));
    }
    let ids = match t.column_ndim("SOURCE_ID", Kind::Int)? {
        Some(_) => t.scalars::<i32>("SOURCE_ID", 0, rows)?,
        None => Vec::new(),
    };
    let distinct = ids.len() == rows && ids.iter().all(|i| *i >= 0) && ids.iter().collect::<HashSet<_>>().len() == rows;
    (0..rows)
        .map(|row| {
            let name = t.get_text("NAME", row, 0)?;
            let id = if distinct { i64::from(ids[row]) } else { row as i64 };
            if own.boresight {
                return Ok(PhaseCenter { id, ..PhaseCenter::unprojected(&name) });
            }
            let (shape, direction) = t.array::<f64>("PHASE_DIR", row)?;
            let place = format!("PHASE_DIR, row {row}");
            if shape.first() != Some(&2) {
                return Err(FormatError::malformed(&t.path, place, "two angles (and their rates)", format!("shape {shape:?}")));
            }
            if direction[2..].iter().any(|rate| *rate != 0.0) {
                return Err(FormatError::unsupported(
                    &t.path,
                    format!("field {name:?} moves ({place} has rates): fix its phase centre first"),
                ));
            }
            let (frame, epoch) = frame(&t, row)?;
            let center = PhaseCenter::sidereal(&name, direction[0], direction[1]).map_err(|e| FormatError::values(&t.path, e))?;
            Ok(PhaseCenter { id, frame: frame.into(), epoch: Some(epoch), ..center })
        })
        .collect()
}

/// The frame of a field: of the column, or of its row where the fields differ.
fn frame(t: &Table, row: usize) -> Result<(&'static str, f64)> {
    const COLUMN: &str = "PHASE_DIR";
    let of_row = match t.keyword_text(Place::measure(COLUMN, "VarRefCol"), 0)? {
        None => t.keyword_text(Place::measure(COLUMN, "Ref"), 0)?,
        Some(column) if t.column_ndim(&column, Kind::String)?.is_some() => Some(t.get_text(&column, row, 0)?),
        Some(column) => {
            let code = t.scalars::<i32>(&column, row, 1)?.first().copied().unwrap_or(0);
            let mut name = None;
            for k in 0..64 {
                match t.keyword_number(Place::measure(COLUMN, "TabRefCodes"), k)? {
                    Some(c) if c == f64::from(code) => name = t.keyword_text(Place::measure(COLUMN, "TabRefTypes"), k)?,
                    Some(_) => {}
                    None => break,
                }
            }
            name
        }
    };
    // Sets that do not state a frame are in J2000, according to the definition.
    let code = of_row.unwrap_or_else(|| "J2000".into());
    frame_of(&code).ok_or_else(|| {
        FormatError::unsupported(&t.path, format!("field {row} is in the frame {code}; J2000, ICRS, B1950 and APP are read"))
    })
}

/// Lines of HISTORY, and whether importuvfits or pyuvdata wrote the set.
#[derive(Debug, Default)]
pub(super) struct History {
    pub(super) lines: Vec<String>,
    pub(super) from_importuvfits: bool,
    pub(super) from_pyuvdata: bool,
}

/// Read HISTORY; a set without it has none.
pub(super) fn history(ms: &Path) -> Result<History> {
    let mut history = History::default();
    if !ms.join("HISTORY/table.dat").is_file() {
        return Ok(history);
    }
    let (t, rows) = open(ms, "HISTORY")?;
    for row in 0..rows.min(MAX_HISTORY) {
        let (application, message) = (t.get_text("APPLICATION", row, 0)?, t.get_text("MESSAGE", row, 0)?);
        history.from_pyuvdata |= application.contains("pyuvdata");
        let origin = t.get_text("ORIGIN", row, 0)?;
        history.from_importuvfits |= [&application, &message, &origin].iter().any(|text| text.contains("importuvfits"));
        let ours = application == APPLICATION || application.is_empty();
        history.lines.push(if ours { message } else { format!("{application}: {message}") });
    }
    if rows > MAX_HISTORY {
        history.lines.push(format!("{} further lines of history", rows - MAX_HISTORY));
    }
    Ok(history)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blank_and_repeated_names_become_unique() {
        let names = ["A", "", "A", "A#2"].map(String::from).to_vec();
        assert_eq!(unique_names(names), ["A", "ANT1", "A#2", "A#2#2"]);
    }
}
