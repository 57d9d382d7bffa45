//! Phase centres: one from the RA and DEC axes, or several from the AIPS SU table.

use super::axes::GroupAxes;
use crate::fits::{Header, table::Table};
use crate::{FormatError, Result};
use cittert_arrays::PhaseCenter;

/// Phase centres of a file; ids are the source numbers.
pub(super) fn read(header: &Header, axes: &GroupAxes, su: Option<&Table>) -> Result<Vec<PhaseCenter>> {
    let path = header.path();
    let stated = ["PHSFRAME", "RADESYS", "RADESYSA"].iter().find_map(|k| header.text(k)).map(|f| f.trim().to_ascii_lowercase());
    let center = |id: i64, name: &str, ra_deg: f64, dec_deg: f64, epoch: Option<f64>| -> Result<PhaseCenter> {
        let mut c = PhaseCenter::sidereal(name, ra_deg.to_radians(), dec_deg.to_radians()).map_err(|e| FormatError::values(path, e))?;
        c.id = id;
        c.epoch = epoch;
        c.frame = match (&stated, epoch) {
            (Some(frame), _) => frame.clone(),
            (None, None) => "icrs".into(),
            (None, Some(1950.0)) => "fk4".into(),
            (None, Some(_)) => "fk5".into(),
        };
        Ok(c)
    };
    if let Some(table) = su {
        let number = |row: usize, column: &str| {
            table.real(row, column).ok_or_else(|| FormatError::malformed(path, format!("AIPS SU, row {row}, {column}"), "a number", "none"))
        };
        let rows = (0..table.rows()).map(|row| {
            let name = table.text(row, "SOURCE").unwrap_or_default();
            let epoch = table.real(row, "EPOCH").filter(|e| *e > 0.0);
            center(number(row, "ID. NO.")? as i64, &name, number(row, "RAEPO")?, number(row, "DECEPO")?, epoch)
        });
        return rows.collect();
    }
    let axis = |k: Option<usize>, other: &str| k.and_then(|k| header.real(&format!("CRVAL{k}"))).or_else(|| header.real(other));
    let (Some(ra), Some(dec)) = (axis(axes.ra_axis, "OBSRA"), axis(axes.dec_axis, "OBSDEC")) else {
        return Err(FormatError::malformed(path, "CRVALn of the axes RA and DEC", "the phase centre", "no such numbers"));
    };
    Ok(vec![center(0, header.text("OBJECT").unwrap_or("unknown"), ra, dec, header.real("EPOCH"))?])
}
