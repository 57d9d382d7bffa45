//! The tables and columns of a Measurement Set of version 2.
//!
//! # Reference
//! Kemball & Wieringa 2000, MeasurementSet definition version 2.0 (AIPS++ Note 229).

use super::keywords::Place;
use super::table::{Column, Manager, Table};
use crate::{Result, builtin};
use std::path::Path;
use std::sync::LazyLock;

static COLUMNS: LazyLock<Vec<Column>> = LazyLock::new(|| builtin::rows(include_str!("schema.csv")));

/// The columns of a table: of a subtable, or of one of the groups of columns that the main table is made of.
pub(super) fn columns(table: &str) -> Vec<&'static Column> {
    COLUMNS.iter().filter(|c| c.table == table).collect()
}

/// A column of the main table with a storage manager of its own.
pub(super) fn main_column(name: &str) -> Vec<&'static Column> {
    columns("MAIN").into_iter().filter(|c| c.name == name).collect()
}

/// Every required subtable.
pub(super) const SUBTABLES: [&str; 12] = [
    "ANTENNA",
    "DATA_DESCRIPTION",
    "FEED",
    "FIELD",
    "FLAG_CMD",
    "HISTORY",
    "OBSERVATION",
    "POINTING",
    "POLARIZATION",
    "PROCESSOR",
    "SPECTRAL_WINDOW",
    "STATE",
];

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
pub(super) fn add(table: &mut Table, columns: &[&Column], manager: &Manager, name: &str, frame: &str) -> Result<()> {
    table.add_columns(columns, manager, name)?;
    for Column { name: column, units, measure, .. } in columns {
        if !units.is_empty() {
            table.put_keyword_text(Place::column(column, "QuantumUnits"), &units.split(' ').collect::<Vec<_>>(), false)?;
        }
        if measure.is_empty() {
            continue;
        }
        table.put_keyword_text(Place::measure(column, "type"), &[measure], true)?;
        let reference = match measure.as_str() {
            "epoch" => "UTC",
            "position" => "ITRF",
            "frequency" => {
                table.put_keyword_text(Place::measure(column, "VarRefCol"), &["MEAS_FREQ_REF"], true)?;
                table.put_keyword_text(Place::measure(column, "TabRefTypes"), &FREQUENCY_FRAMES.map(|f| f.0), false)?;
                table.put_keyword_values(Place::measure(column, "TabRefCodes"), &FREQUENCY_FRAMES.map(|f| f.1))?;
                continue;
            }
            _ => frame,
        };
        table.put_keyword_text(Place::measure(column, "Ref"), &[reference], true)?;
    }
    Ok(())
}

/// Create one subtable in the directory `main` of the main table. Errors name it below `label`.
pub(super) fn create_subtable(main: &Path, label: &Path, name: &str, frame: &str) -> Result<Table> {
    let mut table = Table::create(&main.join(name), &label.join(name))?;
    add(&mut table, &columns(name), &Manager::Standard, "SSM", frame)?;
    Ok(table)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_column_is_read() {
        let lines = include_str!("schema.csv").lines().filter(|l| !l.starts_with('#')).count();
        assert_eq!(COLUMNS.len(), lines - 1);
        assert!(SUBTABLES.iter().all(|t| !columns(t).is_empty()));
    }
}
