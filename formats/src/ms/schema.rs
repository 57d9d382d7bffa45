//! The tables and columns of a Measurement Set of version 2.
//!
//! # Reference
//! Kemball & Wieringa 2000, MeasurementSet definition version 2.0 (AIPS++ Note 229).

use super::keywords::Place;
use super::table::{Cell, Column, Kind, Manager, Table};
use crate::Result;
use std::path::Path;

/// The measure of a column, for programs that convert between frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Measure {
    None,
    /// UTC.
    Epoch,
    /// Geocentric.
    Position,
    /// On the sky, in the frame of the phase centres.
    Direction,
    /// Baselines, in the frame of the phase centres.
    Uvw,
    /// In the frame that MEAS_FREQ_REF names.
    Frequency,
}

/// A column with its unit and measure.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spec {
    pub(super) column: Column,
    units: &'static [&'static str],
    pub(super) measure: Measure,
}

/// A subtable.
#[derive(Debug, Clone, Copy)]
pub(super) struct Subtable {
    pub(super) name: &'static str,
    pub(super) columns: &'static [Spec],
}

const fn of(name: &'static str, kind: Kind, cell: Cell) -> Spec {
    Spec { column: Column { name, kind, cell, comment: "" }, units: &[], measure: Measure::None }
}
const fn int(name: &'static str) -> Spec {
    of(name, Kind::Int, Cell::Scalar)
}
const fn flag(name: &'static str) -> Spec {
    of(name, Kind::Bool, Cell::Scalar)
}
const fn string(name: &'static str) -> Spec {
    of(name, Kind::String, Cell::Scalar)
}
const fn strings(name: &'static str) -> Spec {
    of(name, Kind::String, Cell::Array(1))
}
const fn seconds(name: &'static str) -> Spec {
    of(name, Kind::Double, Cell::Scalar).unit(&["s"])
}
const fn epoch(name: &'static str) -> Spec {
    seconds(name).measured(Measure::Epoch)
}
const fn position(name: &'static str) -> Spec {
    of(name, Kind::Double, Cell::Fixed(&[3])).unit(&["m", "m", "m"]).measured(Measure::Position)
}
const fn direction(name: &'static str) -> Spec {
    of(name, Kind::Double, Cell::Array(2)).unit(&["rad", "rad"]).measured(Measure::Direction)
}
const fn hertz(name: &'static str, cell: Cell) -> Spec {
    of(name, Kind::Double, cell).unit(&["Hz"])
}

impl Spec {
    const fn unit(self, units: &'static [&'static str]) -> Self {
        Self { units, ..self }
    }
    const fn measured(self, measure: Measure) -> Self {
        Self { measure, ..self }
    }
    const fn saying(self, comment: &'static str) -> Self {
        Self { column: Column { comment, ..self.column }, ..self }
    }
}

/// MAIN columns that may change from every row to the next.
pub(super) const MAIN_STANDARD: [Spec; 6] = [
    int("ANTENNA1").saying("Row in ANTENNA of the first antenna"),
    int("ANTENNA2").saying("Row in ANTENNA of the second antenna"),
    flag("FLAG_ROW"),
    epoch("TIME").saying("Midpoint of the integration, modified Julian day in seconds"),
    epoch("TIME_CENTROID").saying("Midpoint of the integration, modified Julian day in seconds"),
    of("FLAG_CATEGORY", Kind::Bool, Cell::Array(3)).saying("Flags by category; not used"),
];

/// MAIN columns that stay the same over many rows.
pub(super) const MAIN_INCREMENTAL: [Spec; 11] = [
    int("ARRAY_ID"),
    int("DATA_DESC_ID").saying("Row in DATA_DESCRIPTION"),
    seconds("EXPOSURE"),
    int("FEED1"),
    int("FEED2"),
    int("FIELD_ID").saying("Row in FIELD"),
    seconds("INTERVAL"),
    int("OBSERVATION_ID"),
    int("PROCESSOR_ID"),
    int("SCAN_NUMBER"),
    int("STATE_ID"),
];

/// Baselines.
pub(super) const UVW: Spec = of("UVW", Kind::Double, Cell::Fixed(&[3]))
    .unit(&["m", "m", "m"])
    .measured(Measure::Uvw)
    .saying("Baseline as imagers of Measurement Sets take it: antenna 1 minus antenna 2");

/// Columns of \[pol\] cells.
pub(super) const MAIN_VECTORS: [Spec; 2] = [
    of("WEIGHT", Kind::Float, Cell::Array(1)).saying("1/sigma^2 of a channel, mean over the channels in use"),
    of("SIGMA", Kind::Float, Cell::Array(1)).saying("rms noise of a channel"),
];

/// Flags, \[pol, chan\] cells.
pub(super) const FLAG: Spec = of("FLAG", Kind::Bool, Cell::Array(2));
/// Weights of each channel, where they differ from channel to channel.
pub(super) const WEIGHT_SPECTRUM: Spec = of("WEIGHT_SPECTRUM", Kind::Float, Cell::Array(2)).saying("1/sigma^2 of each channel");
/// Visibilities as observed.
pub(super) const DATA: Spec = of("DATA", Kind::Complex, Cell::Array(2));
/// Visibilities of the model.
pub(super) const MODEL_DATA: Spec = of("MODEL_DATA", Kind::Complex, Cell::Array(2));
/// Visibilities after calibration.
pub(super) const CORRECTED_DATA: Spec = of("CORRECTED_DATA", Kind::Complex, Cell::Array(2));

const ANTENNA: Subtable = Subtable {
    name: "ANTENNA",
    columns: &[
        position("OFFSET"),
        position("POSITION"),
        string("TYPE"),
        of("DISH_DIAMETER", Kind::Double, Cell::Scalar).unit(&["m"]),
        flag("FLAG_ROW"),
        string("MOUNT"),
        string("NAME"),
        string("STATION"),
    ],
};
const DATA_DESCRIPTION: Subtable =
    Subtable { name: "DATA_DESCRIPTION", columns: &[flag("FLAG_ROW"), int("POLARIZATION_ID"), int("SPECTRAL_WINDOW_ID")] };
const FEED: Subtable = Subtable {
    name: "FEED",
    columns: &[
        position("POSITION"),
        direction("BEAM_OFFSET"),
        strings("POLARIZATION_TYPE"),
        of("POL_RESPONSE", Kind::Complex, Cell::Array(2)),
        of("RECEPTOR_ANGLE", Kind::Double, Cell::Array(1)).unit(&["rad"]),
        int("ANTENNA_ID"),
        int("BEAM_ID"),
        int("FEED_ID"),
        seconds("INTERVAL"),
        int("NUM_RECEPTORS"),
        int("SPECTRAL_WINDOW_ID"),
        epoch("TIME"),
    ],
};
const FIELD: Subtable = Subtable {
    name: "FIELD",
    columns: &[
        direction("DELAY_DIR"),
        direction("PHASE_DIR"),
        direction("REFERENCE_DIR"),
        string("CODE"),
        flag("FLAG_ROW"),
        string("NAME"),
        int("NUM_POLY"),
        int("SOURCE_ID"),
        epoch("TIME"),
    ],
};
const FLAG_CMD: Subtable = Subtable {
    name: "FLAG_CMD",
    columns: &[
        flag("APPLIED"),
        string("COMMAND"),
        seconds("INTERVAL"),
        int("LEVEL"),
        string("REASON"),
        int("SEVERITY"),
        epoch("TIME"),
        string("TYPE"),
    ],
};
const HISTORY: Subtable = Subtable {
    name: "HISTORY",
    columns: &[
        strings("APP_PARAMS"),
        strings("CLI_COMMAND"),
        string("APPLICATION"),
        string("MESSAGE"),
        int("OBJECT_ID"),
        int("OBSERVATION_ID"),
        string("ORIGIN"),
        string("PRIORITY"),
        epoch("TIME"),
    ],
};
const OBSERVATION: Subtable = Subtable {
    name: "OBSERVATION",
    columns: &[
        of("TIME_RANGE", Kind::Double, Cell::Fixed(&[2])).unit(&["s"]).measured(Measure::Epoch),
        strings("LOG"),
        strings("SCHEDULE"),
        flag("FLAG_ROW"),
        string("OBSERVER"),
        string("PROJECT"),
        epoch("RELEASE_DATE"),
        string("SCHEDULE_TYPE"),
        string("TELESCOPE_NAME"),
        // Not part of the definition: pyuvdata stores the centre of the array here. Antenna positions are relative to it.
        position("TELESCOPE_LOCATION"),
    ],
};
const POINTING: Subtable = Subtable {
    name: "POINTING",
    columns: &[
        direction("DIRECTION"),
        int("ANTENNA_ID"),
        seconds("INTERVAL"),
        string("NAME"),
        int("NUM_POLY"),
        of("TARGET", Kind::Double, Cell::Array(0)).unit(&["rad", "rad"]).measured(Measure::Direction),
        epoch("TIME"),
        epoch("TIME_ORIGIN"),
        flag("TRACKING"),
    ],
};
const POLARIZATION: Subtable = Subtable {
    name: "POLARIZATION",
    columns: &[
        of("CORR_TYPE", Kind::Int, Cell::Array(1)),
        of("CORR_PRODUCT", Kind::Int, Cell::Array(2)),
        flag("FLAG_ROW"),
        int("NUM_CORR"),
    ],
};
const PROCESSOR: Subtable =
    Subtable { name: "PROCESSOR", columns: &[flag("FLAG_ROW"), int("MODE_ID"), string("TYPE"), int("TYPE_ID"), string("SUB_TYPE")] };
const SPECTRAL_WINDOW: Subtable = Subtable {
    name: "SPECTRAL_WINDOW",
    columns: &[
        int("MEAS_FREQ_REF"),
        hertz("CHAN_FREQ", Cell::Array(1)).measured(Measure::Frequency),
        hertz("REF_FREQUENCY", Cell::Scalar).measured(Measure::Frequency),
        hertz("CHAN_WIDTH", Cell::Array(1)),
        hertz("EFFECTIVE_BW", Cell::Array(1)),
        hertz("RESOLUTION", Cell::Array(1)),
        flag("FLAG_ROW"),
        int("FREQ_GROUP"),
        string("FREQ_GROUP_NAME"),
        int("IF_CONV_CHAIN"),
        string("NAME"),
        int("NET_SIDEBAND"),
        int("NUM_CHAN"),
        hertz("TOTAL_BANDWIDTH", Cell::Scalar),
    ],
};
const STATE: Subtable = Subtable {
    name: "STATE",
    columns: &[
        of("CAL", Kind::Double, Cell::Scalar).unit(&["K"]),
        flag("FLAG_ROW"),
        of("LOAD", Kind::Double, Cell::Scalar).unit(&["K"]),
        string("OBS_MODE"),
        flag("REF"),
        flag("SIG"),
        int("SUB_SCAN"),
    ],
};

/// Every required subtable.
pub(super) const SUBTABLES: [Subtable; 12] =
    [ANTENNA, DATA_DESCRIPTION, FEED, FIELD, FLAG_CMD, HISTORY, OBSERVATION, POINTING, POLARIZATION, PROCESSOR, SPECTRAL_WINDOW, STATE];

/// Frequency frames and their codes in casacore.
const FREQUENCY_FRAMES: [(&str, i32); 10] = [
    ("REST", 0),
    ("LSRK", 1),
    ("LSRD", 2),
    ("BARY", 3),
    ("GEO", 4),
    ("TOPO", 5),
    ("GALACTO", 6),
    ("LGROUP", 7),
    ("CMB", 8),
    ("Undefined", 64),
];
/// Code of topocentric frequencies.
pub(super) const TOPO: i32 = 5;

/// Add columns that share a storage manager, with their units and measures; `frame` is the frame of directions.
pub(super) fn add(table: &mut Table, specs: &[Spec], manager: &Manager, name: &str, frame: &str) -> Result<()> {
    let columns: Vec<Column> = specs.iter().map(|s| s.column).collect();
    table.add_columns(&columns, manager, name)?;
    for spec in specs {
        let column = spec.column.name;
        if !spec.units.is_empty() {
            table.put_keyword_text(Place::column(column, "QuantumUnits"), spec.units, false)?;
        }
        let measure = match spec.measure {
            Measure::None => continue,
            Measure::Epoch => ("epoch", "UTC"),
            Measure::Position => ("position", "ITRF"),
            Measure::Direction => ("direction", frame),
            Measure::Uvw => ("uvw", frame),
            Measure::Frequency => ("frequency", ""),
        };
        table.put_keyword_text(Place::measure(column, "type"), &[measure.0], true)?;
        if spec.measure == Measure::Frequency {
            table.put_keyword_text(Place::measure(column, "VarRefCol"), &["MEAS_FREQ_REF"], true)?;
            table.put_keyword_text(Place::measure(column, "TabRefTypes"), &FREQUENCY_FRAMES.map(|f| f.0), false)?;
            table.put_keyword_values(Place::measure(column, "TabRefCodes"), &FREQUENCY_FRAMES.map(|f| f.1))?;
        } else {
            table.put_keyword_text(Place::measure(column, "Ref"), &[measure.1], true)?;
        }
    }
    Ok(())
}

/// Create one subtable in the directory `main` of the main table. Errors name it below `label`.
pub(super) fn create_subtable(main: &Path, label: &Path, subtable: &Subtable, frame: &str) -> Result<Table> {
    let mut table = Table::create(&main.join(subtable.name), &label.join(subtable.name))?;
    add(&mut table, subtable.columns, &Manager::Standard, "SSM", frame)?;
    Ok(table)
}
