//! Writing the text of bodies and regions.

use super::model::{NamedBody, RegionSource};
use std::fmt::Write;

/// The text of bodies and regions. `surface` holds the name of the surface of each region, if it has one \[region\]; it has one entry
/// for every region.
///
/// Reading it back gives the same bodies to the last bit.
#[must_use]
pub fn write_text(bodies: &[NamedBody], regions: &[RegionSource], surface: &[Option<String>]) -> String {
    let mut out = String::from("# bodies: name type parameters (MORSE/GIFT order, m)\n");
    for b in bodies {
        let _ = write!(out, "{} {}", b.name, b.body.entry.code);
        for p in &b.body.parameters {
            let _ = write!(out, " {p}");
        }
        out.push('\n');
    }
    out.push_str("# regions: REGION name ; expression ; surface\n");
    for (i, r) in regions.iter().enumerate() {
        let _ = write!(out, "REGION {} ; {}", r.name, r.expression);
        if let Some(s) = &surface[i] {
            let _ = write!(out, " ; {s}");
        }
        out.push('\n');
    }
    out
}
