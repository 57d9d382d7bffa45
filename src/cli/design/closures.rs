//! Closure phases of the first integration, with and without errors.

use crate::cli::failure::Result;
use crate::closure::{ClosureOptions, closure_phases};
use crate::progress::Silent;
use cittert_arrays::{VisibilityHeader, VisibilitySet};
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Most triangles that are shown. Of more, every so manieth is.
const MOST_SHOWN: usize = 150;
/// Most antennas for which triangles are formed: their number grows with the square.
const MOST_ANTENNAS: usize = 200;

/// Closure phases in rad by triangle.
pub(super) type Closures = BTreeMap<[usize; 3], f64>;

/// The closure phases of the first integration of a set; none for few antennas, or for very many.
///
/// # Errors
/// As [`closure_phases`].
pub(super) fn closures(set: &VisibilitySet) -> Result<Closures> {
    let mut out = Closures::new();
    if !(3..=MOST_ANTENNAS).contains(&set.header.layout.n_ant()) {
        return Ok(out);
    }
    let times = &set.data.coverage.time_jd;
    let rows = times.iter().take_while(|t| Some(*t) == times.first()).count();
    let mut first = VisibilitySet::new(set.header.clone(), set.data.rows(0..rows)?)?;
    closure_phases(&mut first, &ClosureOptions::default(), &Silent, |c| {
        out.entry(c.antennas).or_insert(c.phase_rad);
        Ok(())
    })?;
    Ok(out)
}

/// What the page shows of them: the same triangles of both.
pub(super) fn told(seq: u64, header: &VisibilityHeader, without: &Closures, with: &Closures) -> Value {
    let both: Vec<_> = without.iter().filter_map(|(t, a)| Some((t, *a, *with.get(t)?))).collect();
    let shown: Vec<_> = both.iter().step_by(both.len().div_ceil(MOST_SHOWN).max(1)).collect();
    let all = header.layout.antennas();
    json!({
        "is": "closures", "seq": seq,
        "names": shown.iter().map(|(t, ..)| t.map(|k| all[k].name.as_str()).join(", ")).collect::<Vec<_>>(),
        "true_rad": shown.iter().map(|s| s.1).collect::<Vec<_>>(), "observed_rad": shown.iter().map(|s| s.2).collect::<Vec<_>>(),
    })
}
