//! Rows of the subtables of a Measurement Set.

use super::annotations::OF_OBSERVATION;
use super::codes::code_of;
use super::export::Plan;
use super::fields::Field;
use super::keywords::Place;
use super::schema::{self, SUBTABLES, TOPO};
use super::table::{Kind, Manager, Table};
use crate::uvh5::NOMINAL_SITE;
use crate::{FormatError, Result};
use cittert_arrays::{Sensitivity, VisibilityHeader, XOrientation};
use num_complex::Complex;
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

/// The data for the subtables.
#[derive(Debug)]
pub(super) struct Contents<'a> {
    pub(super) header: &'a VisibilityHeader,
    pub(super) plan: &'a Plan,
    pub(super) fields: &'a [Field],
    /// First and last moment, seconds of the modified Julian day.
    pub(super) time_range: [f64; 2],
    /// Lines for HISTORY.
    pub(super) history: &'a [String],
    /// Time of writing for HISTORY, seconds of the modified Julian day.
    pub(super) now: f64,
    /// Frame of directions without one of their own.
    pub(super) frame: &'static str,
}

/// Create, fill and flush every subtable, and link it to the main table.
pub(super) fn write(main: &mut Table, folder: &Path, label: &Path, contents: &Contents<'_>) -> Result<()> {
    for name in SUBTABLES {
        let mut table = schema::create_subtable(folder, label, name, contents.frame)?;
        fill(&mut table, name, contents)?;
        table.flush()?;
        main.put_table_keyword(name, &table)?;
    }
    Ok(())
}

fn fill(table: &mut Table, name: &str, c: &Contents<'_>) -> Result<()> {
    match name {
        "ANTENNA" => antenna(table, c),
        "DATA_DESCRIPTION" => data_description(table, c),
        "FEED" => feed(table, c),
        "FIELD" => field(table, c),
        "HISTORY" => add_history(table, c.history, c.now),
        "OBSERVATION" => observation(table, c),
        "POLARIZATION" => polarization(table, c),
        "SPECTRAL_WINDOW" => spectral_window(table, c),
        // FLAG_CMD, POINTING, PROCESSOR and STATE must exist and may be empty.
        _ => Ok(()),
    }
}

/// Telescope name for the file. Other programs look it up in their lists of observatories.
pub(super) fn telescope(header: &VisibilityHeader) -> &str {
    [header.telescope.as_str(), header.layout.name.as_str(), "unknown"].into_iter().find(|n| !n.is_empty()).unwrap_or("unknown")
}

fn antenna(t: &mut Table, c: &Contents<'_>) -> Result<()> {
    let layout = &c.header.layout;
    let rows = c.plan.antenna_rows.iter().max().map_or(0, |m| *m as usize + 1);
    let site = layout.site().unwrap_or(NOMINAL_SITE);
    let center = site.to_ecef_m();
    t.add_rows(rows)?;
    // Rows without an antenna get a position at the centre of the Earth, by which readers recognise them. They get the diameter of the first
    // antenna, because CASA takes different diameters as a heterogeneous array.
    let dish = layout.antennas().first().and_then(|a| a.diameter_m).unwrap_or(0.0);
    let (mut positions, mut diameters) = (vec![0.0; 3 * rows], vec![dish; rows]);
    let mut empty = vec![true; rows];
    let mut names = vec![""; rows];
    let about = &c.header.annotations;
    let (mut stations, mut mounts) = (vec![None; rows], vec![None; rows]);
    for (k, (a, row)) in layout.antennas().iter().zip(&c.plan.antenna_rows).enumerate() {
        let row = *row as usize;
        stations[row] = about.stations.get(k);
        mounts[row] = about.mounts.get(k).filter(|_| !c.header.is_boresight()).map(|m| m.to_ascii_uppercase());
        let d = site.enu_to_ecef_offset(a.position_m);
        (0..3).for_each(|k| positions[3 * row + k] = center[k] + d[k]);
        diameters[row] = a.diameter_m.unwrap_or(0.0);
        empty[row] = false;
        names[row] = &a.name;
    }
    t.put("POSITION", 0, &[3], &positions)?;
    t.put("OFFSET", 0, &[3], &vec![0.0; 3 * rows])?;
    t.put("DISH_DIAMETER", 0, &[], &diameters)?;
    t.put("FLAG_ROW", 0, &[], &empty)?;
    receivers(t, c, rows)?;
    for (row, name) in names.iter().enumerate() {
        t.put_text("NAME", row, &[name], true)?;
        t.put_text("STATION", row, &[stations[row].map_or(name, String::as_str)], true)?;
        t.put_text("TYPE", row, &["GROUND-BASED"], true)?;
        t.put_text("MOUNT", row, &[mounts[row].as_deref().unwrap_or("ALT-AZ")], true)?;
    }
    Ok(())
}

/// Keywords of ANTENNA with what the receivers add to the autocorrelations: a number for each row, NaN where it is stated otherwise or not.
pub(super) const RECEIVER_SEFD: &str = "receiver_sefd_jy";
pub(super) const RECEIVER_K: &str = "receiver_k";

fn receivers(t: &mut Table, c: &Contents<'_>, rows: usize) -> Result<()> {
    let (mut sefd, mut kelvin) = (vec![f64::NAN; rows], vec![f64::NAN; rows]);
    for (antenna, row) in c.header.layout.antennas().iter().zip(&c.plan.antenna_rows) {
        match antenna.receiver {
            Some(Sensitivity::SefdJy(v)) => sefd[*row as usize] = v,
            Some(Sensitivity::TsysK(t)) => kelvin[*row as usize] = t,
            None => {}
        }
    }
    for (key, values) in [(RECEIVER_SEFD, sefd), (RECEIVER_K, kelvin)] {
        if values.iter().any(|v| v.is_finite()) {
            t.put_keyword_values(Place::table(key), &values)?;
        }
    }
    Ok(())
}

fn data_description(t: &mut Table, c: &Contents<'_>) -> Result<()> {
    let n = c.plan.windows.len();
    t.add_rows(n)?;
    t.put("FLAG_ROW", 0, &[], &vec![false; n])?;
    t.put("POLARIZATION_ID", 0, &[], &vec![0_i32; n])?;
    t.put("SPECTRAL_WINDOW_ID", 0, &[], &(0..n as i32).collect::<Vec<_>>())
}

/// Two feeds on every antenna, right and left or X and Y.
fn feed(t: &mut Table, c: &Contents<'_>) -> Result<()> {
    let linear = c.plan.products.iter().any(|p| code_of(p.product) >= 9);
    let hands = if linear { ["X", "Y"] } else { ["R", "L"] };
    // The angle of a linear feed runs from north through east. X is taken to the east where nothing is known.
    let north = c.header.annotations.x_orientation == Some(XOrientation::North);
    let angles = match (linear, north) {
        (true, false) => [std::f64::consts::FRAC_PI_2, 0.0],
        (true, true) => [0.0, std::f64::consts::FRAC_PI_2],
        _ => [0.0, 0.0],
    };
    let rows = c.plan.antenna_rows.iter().max().map_or(0, |m| *m as usize + 1);
    t.add_rows(rows)?;
    let middle = (c.time_range[0] + c.time_range[1]) / 2.0;
    let response = [1.0, 0.0, 0.0, 1.0].map(|re| Complex::new(re, 0.0_f32));
    t.put("ANTENNA_ID", 0, &[], &(0..rows as i32).collect::<Vec<_>>())?;
    for (name, value) in [("BEAM_ID", -1), ("FEED_ID", 0), ("NUM_RECEPTORS", 2), ("SPECTRAL_WINDOW_ID", -1)] {
        t.put(name, 0, &[], &vec![value; rows])?;
    }
    t.put("TIME", 0, &[], &vec![middle; rows])?;
    // The interval is longer than any observation, because the feeds never change.
    t.put("INTERVAL", 0, &[], &vec![1e12; rows])?;
    t.put("POSITION", 0, &[3], &vec![0.0; 3 * rows])?;
    t.put("BEAM_OFFSET", 0, &[2, 2], &vec![0.0; 4 * rows])?;
    t.put("POL_RESPONSE", 0, &[2, 2], &response.repeat(rows))?;
    t.put("RECEPTOR_ANGLE", 0, &[2], &angles.repeat(rows))?;
    (0..rows).try_for_each(|row| t.put_text("POLARIZATION_TYPE", row, &hands, false))
}

/// Columns of directions, each with a column of frames where the fields differ in theirs.
const DIRECTIONS: [(&str, &str); 3] = [("DELAY_DIR", "DelayDir_Ref"), ("PHASE_DIR", "PhaseDir_Ref"), ("REFERENCE_DIR", "RefDir_Ref")];

fn field(t: &mut Table, c: &Contents<'_>) -> Result<()> {
    let n = c.fields.len();
    let mut frames: Vec<&str> = c.fields.iter().map(|f| f.frame).collect();
    frames.sort_unstable();
    frames.dedup();
    let mixed = frames.len() > 1;
    if mixed {
        t.add_columns(&schema::columns("FIELD frames"), &Manager::Standard, "SSMRef")?;
    }
    t.add_rows(n)?;
    let directions: Vec<f64> = c.fields.iter().flat_map(|f| [f.ra_rad, f.dec_rad]).collect();
    for (column, reference) in DIRECTIONS {
        t.put(column, 0, &[2, 1], &directions)?;
        if mixed {
            let codes: Vec<i32> = (0..frames.len() as i32).collect();
            t.put_keyword_text(Place::measure(column, "VarRefCol"), &[reference], true)?;
            t.put_keyword_text(Place::measure(column, "TabRefTypes"), &frames, false)?;
            t.put_keyword_values(Place::measure(column, "TabRefCodes"), &codes)?;
            let code = |f: &Field| frames.iter().position(|x| *x == f.frame).unwrap_or(0) as i32;
            t.put(reference, 0, &[], &c.fields.iter().map(code).collect::<Vec<_>>())?;
        }
    }
    t.put("FLAG_ROW", 0, &[], &vec![false; n])?;
    t.put("NUM_POLY", 0, &[], &vec![0_i32; n])?;
    t.put("SOURCE_ID", 0, &[], &c.fields.iter().map(|f| f.source_id).collect::<Vec<_>>())?;
    t.put("TIME", 0, &[], &vec![c.time_range[0]; n])?;
    for (row, f) in c.fields.iter().enumerate() {
        t.put_text("NAME", row, &[&f.name], true)?;
        t.put_text("CODE", row, &[""], true)?;
    }
    Ok(())
}

/// The present time, seconds of the modified Julian day.
pub(super) fn now_mjd_s() -> f64 {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |d| d.as_secs_f64());
    // The epoch of Unix is the modified Julian day 40587.
    now + 40_587.0 * 86_400.0
}

/// Add lines to HISTORY. A table of another program may lack columns.
pub(super) fn add_history(t: &mut Table, lines: &[String], now: f64) -> Result<()> {
    let (first, n) = (t.n_rows() as usize, lines.len());
    if n == 0 {
        return Ok(());
    }
    t.add_rows(n)?;
    if t.column_ndim("TIME", Kind::Double)?.is_some() {
        t.put("TIME", first, &[], &vec![now; n])?;
    }
    for column in ["OBJECT_ID", "OBSERVATION_ID"] {
        if t.column_ndim(column, Kind::Int)?.is_some() {
            t.put(column, first, &[], &vec![0_i32; n])?;
        }
    }
    for (row, line) in lines.iter().enumerate() {
        let message = line.replace('\0', "");
        let texts = [("APPLICATION", APPLICATION), ("ORIGIN", APPLICATION), ("PRIORITY", "NORMAL"), ("MESSAGE", &message)];
        for (column, text) in texts.into_iter().chain([("APP_PARAMS", ""), ("CLI_COMMAND", "")]) {
            if let Some(ndim) = t.column_ndim(column, Kind::String)? {
                t.put_text(column, first + row, &[text], ndim < 0)?;
            }
        }
    }
    Ok(())
}

/// Name of cittert in HISTORY, by which its own lines are recognised.
pub(super) const APPLICATION: &str = "cittert";

fn observation(t: &mut Table, c: &Contents<'_>) -> Result<()> {
    t.add_rows(1)?;
    t.put("TIME_RANGE", 0, &[2], &c.time_range)?;
    t.put("FLAG_ROW", 0, &[], &[false])?;
    t.put("RELEASE_DATE", 0, &[], &[c.time_range[1]])?;
    let site = c.header.layout.site().unwrap_or(NOMINAL_SITE);
    t.put("TELESCOPE_LOCATION", 0, &[3], &site.to_ecef_m())?;
    t.put_text("TELESCOPE_NAME", 0, &[telescope(c.header)], true)?;
    for name in ["LOG", "SCHEDULE"] {
        t.put_text(name, 0, &[""], false)?;
    }
    for (column, key) in OF_OBSERVATION {
        t.put_text(column, 0, &[&c.header.annotations.text(key).unwrap_or_default().replace('\0', "")], true)?;
    }
    t.put_text("SCHEDULE_TYPE", 0, &[""], true)
}

fn polarization(t: &mut Table, c: &Contents<'_>) -> Result<()> {
    let products = &c.plan.products;
    t.add_rows(1)?;
    t.put("NUM_CORR", 0, &[], &[products.len() as i32])?;
    t.put("CORR_TYPE", 0, &[products.len()], &products.iter().map(|p| code_of(p.product)).collect::<Vec<_>>())?;
    let feeds = |p: &super::export::Product| {
        let (a, b) = p.product.feeds().unwrap_or((0, 0));
        [a as i32, b as i32]
    };
    t.put("CORR_PRODUCT", 0, &[2, products.len()], &products.iter().flat_map(feeds).collect::<Vec<_>>())?;
    t.put("FLAG_ROW", 0, &[], &[false])
}

fn spectral_window(t: &mut Table, c: &Contents<'_>) -> Result<()> {
    let spectrum = &c.header.spectrum;
    t.add_rows(c.plan.windows.len())?;
    for (row, window) in c.plan.windows.iter().enumerate() {
        let n = window.channels.len();
        let freq: Vec<f64> = window.channels.iter().map(|k| spectrum.freq_hz()[*k]).collect();
        let width: Vec<f64> = window.channels.iter().map(|k| spectrum.width_hz()[*k]).collect();
        if n == 0 {
            return Err(FormatError::malformed(&t.path, "spectral window", "at least one channel", "none"));
        }
        t.put("CHAN_FREQ", row, &[n], &freq)?;
        for name in ["CHAN_WIDTH", "EFFECTIVE_BW", "RESOLUTION"] {
            t.put(name, row, &[n], &width)?;
        }
        t.put("REF_FREQUENCY", row, &[], &[freq.iter().sum::<f64>() / n as f64])?;
        t.put("TOTAL_BANDWIDTH", row, &[], &[width.iter().sum::<f64>()])?;
        for (name, value) in [("MEAS_FREQ_REF", TOPO), ("FREQ_GROUP", 0), ("IF_CONV_CHAIN", 0), ("NET_SIDEBAND", 1), ("NUM_CHAN", n as i32)]
        {
            t.put(name, row, &[], &[value])?;
        }
        t.put("FLAG_ROW", row, &[], &[false])?;
        t.put_text("NAME", row, &[&format!("window{row}")], true)?;
        t.put_text("FREQ_GROUP_NAME", row, &[""], true)?;
    }
    Ok(())
}
