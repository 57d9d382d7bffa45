//! What a UVFITS file holds that comes neither with its rows nor with its header.

use crate::Result;
use crate::fits::{Header, Input, padding, table::Table};
use std::path::Path;

/// Parameters of the groups that are read.
const PARAMETERS: [&str; 11] = ["UU", "VV", "WW", "BASELINE", "DATE", "_DATE", "INTTIM", "SOURCE", "ANTENNA1", "ANTENNA2", "SUBARRAY"];
/// Tables with their columns that are read, or that follow from what is read.
const TABLES: [(&str, &[&str]); 3] = [
    ("AIPS AN", &["ANNAME", "STABXYZ", "NOSTA", "MNTSTA", "DIAMETER", "SEFD", "POLTYA", "POLTYB", "RCVRSEFD", "RCVRTEMP"]),
    ("AIPS FQ", &["FRQSEL", "IF FREQ", "CH WIDTH", "TOTAL BANDWIDTH", "SIDEBAND", "BANDCODE"]),
    ("AIPS SU", &["ID. NO.", "SOURCE", "RAEPO", "DECEPO", "EPOCH", "RAAPP", "DECAPP", "BANDWIDTH"]),
];

pub(super) fn lines(path: &Path) -> Result<Vec<String>> {
    let mut input = Input::open(path)?;
    let mut lines = Vec::new();
    let Some(primary) = Header::read(&mut input, true)? else { return Ok(lines) };
    for k in 1..=primary.integer("PCOUNT").unwrap_or(0).clamp(0, 999) {
        let name = primary.text(&format!("PTYPE{k}")).unwrap_or("").trim().to_ascii_uppercase();
        let known = PARAMETERS.contains(&name.as_str()) || ["UU", "VV", "WW"].iter().any(|uvw| name.starts_with(uvw)) || name == "FREQSEL";
        if !known && !name.is_empty() {
            lines.push(format!("parameter {name} of the groups"));
        }
    }
    if primary.comments > 0 {
        lines.push(format!("{} COMMENT cards", primary.comments));
    }
    let bytes = primary.data_bytes()?;
    skip(&mut input, "visibilities (random groups)", bytes)?;
    while let Some(header) = Header::read(&mut input, false)? {
        let name = header.text("EXTNAME").unwrap_or("").trim().to_string();
        let version = header.integer("EXTVER").unwrap_or(1);
        match TABLES.iter().find(|(known, _)| *known == name && version == 1) {
            Some((_, read)) => {
                let table = Table::read(&mut input, header)?;
                let others: Vec<&str> = table.names().filter(|c| !c.is_empty() && !read.contains(c) && table.says_something(c)).collect();
                if !others.is_empty() {
                    let word = if others.len() == 1 { "column" } else { "columns" };
                    lines.push(format!("{word} {} of the table {name}", others.join(", ")));
                }
            }
            None => {
                let bytes = header.data_bytes()?;
                skip(&mut input, &format!("table {name}"), bytes)?;
                let which = if version > 1 { format!(" of version {version}") } else { String::new() };
                lines.push(format!("table {}{which}", if name.is_empty() { "without a name" } else { name.as_str() }));
            }
        }
    }
    Ok(lines)
}

fn skip(input: &mut Input, what: &str, bytes: u64) -> Result<()> {
    input.skip(what, bytes)?;
    input.read_some(&mut vec![0; padding(bytes) as usize]).map(drop)
}
