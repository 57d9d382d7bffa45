//! Leakages as further elements of the Jones matrices.
//!
//! The element Jxy = g_x d_x is the response of feed X to the field of Y. The file holds it beside Jxx = g_x, with the numbers -7 (-3 for R and
//! L) and -8 (-4).

use crate::h5::H5In;
use crate::{FormatError, Result};
use cittert_arrays::GainTable;
use ndarray::{Axis, concatenate};
use num_complex::Complex64;
use std::path::Path;

/// Names of the elements by the feeds of a table.
const ELEMENTS: [([&str; 2], [&str; 2]); 2] = [(["R", "L"], ["RL", "LR"]), (["X", "Y"], ["XY", "YX"])];

/// An element has the flags and qualities of the gain of its feed.
const TWICE: [usize; 4] = [0, 1, 0, 1];

/// The table of the file: its gains, and then the other elements, as if they were feeds.
pub(super) fn as_feeds(path: &Path, table: &GainTable) -> Result<GainTable> {
    let Some(leakages) = &table.leakages else { return Ok(table.clone()) };
    let names = ELEMENTS.iter().find(|e| table.feeds == e.0);
    let (_, more) = names.ok_or_else(|| {
        FormatError::malformed(path, "feeds of a table with leakages", "R and L, or X and Y, in this order", table.feeds.join(", "))
    })?;
    let failed = |e: ndarray::ShapeError| FormatError::malformed(path, "leakages", "one for each gain", e.to_string());
    let elements = leakages * &table.gains;
    Ok(GainTable {
        feeds: table.feeds.iter().cloned().chain(more.iter().map(ToString::to_string)).collect(),
        gains: concatenate(Axis(3), &[table.gains.view(), elements.view()]).map_err(failed)?,
        flags: table.flags.select(Axis(3), &TWICE),
        quality: table.quality.as_ref().map(|q| q.select(Axis(3), &TWICE)),
        total_quality: table.total_quality.as_ref().map(|q| q.select(Axis(2), &TWICE)),
        leakages: None,
        ..table.clone()
    })
}

/// The table in memory of one as [`as_feeds`] makes it. Other tables pass unchanged.
pub(super) fn from_feeds(file: &H5In, table: GainTable, inverted: bool) -> Result<GainTable> {
    let is_element = |f: &String| ELEMENTS.iter().any(|e| e.1.contains(&f.as_str()));
    if !table.feeds.iter().any(is_element) {
        return Ok(table);
    }
    let at = |name: &str| table.feeds.iter().position(|f| f == name);
    let places = ELEMENTS.iter().find_map(|(feeds, more)| Some(([at(feeds[0])?, at(feeds[1])?], [at(more[0])?, at(more[1])?], feeds)));
    let wrong = |expected: &str| file.wrong("Header/jones_array", expected, table.feeds.join(", "));
    let (own, more, feeds) =
        places.ok_or_else(|| wrong("the elements of both feeds, -1 to -4 or -5 to -8, where one of them is a leakage"))?;
    if inverted {
        return Err(wrong("the gain convention divide, as leakages are not inverted one by one"));
    }
    let gains = table.gains.select(Axis(3), &own);
    let mut leakages = table.gains.select(Axis(3), &more);
    let mut flags = table.flags.select(Axis(3), &own);
    let unknown = table.flags.select(Axis(3), &more);
    for ((at, d), g) in leakages.indexed_iter_mut().zip(&gains) {
        let known = g.norm_sqr() > 0.0 && !unknown[at] && !flags[at];
        flags[at] |= unknown[at];
        *d = if known { *d / g } else { Complex64::ZERO };
    }
    Ok(GainTable {
        feeds: feeds.iter().map(ToString::to_string).collect(),
        quality: table.quality.as_ref().map(|q| q.select(Axis(3), &own)),
        total_quality: table.total_quality.as_ref().map(|q| q.select(Axis(2), &own)),
        gains,
        flags,
        leakages: Some(leakages),
        ..table
    })
}
