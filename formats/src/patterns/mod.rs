//! Files with the power pattern of an antenna: tables as CSV or FITS, and the beam files of pyuvdata (beamfits).

mod beamfits;
mod columns;

use crate::Result;
use crate::files::start_of;
use cittert_arrays::ElementPattern;
use std::path::Path;

/// Read a pattern: a CSV or a FITS table with the columns `theta_deg`, `power` or `power_db`, and where there are several, `freq_ghz` and
/// `phi_deg`; or a beam file of pyuvdata's UVBeam on a grid of azimuth and zenith angle.
///
/// # Errors
/// A file that is none of these, a column or an axis that is missing, samples that do not fill a grid, or no power along the boresight.
pub fn read_pattern(path: &Path) -> Result<ElementPattern> {
    let start = start_of(path)?;
    let fits = start.starts_with(b"SIMPLE") || start.starts_with(&[0x1f, 0x8b]);
    let table = if fits { beamfits::read(path)? } else { columns::read_csv(path)? };
    Ok(ElementPattern::Sampled(table.into()))
}
