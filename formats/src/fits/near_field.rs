//! The near field in the cards of images and UVFITS.

use super::header::{Header, HeaderWriter};
use cittert_arrays::NearField;

/// Card of the surface on which the scene lies.
const RANGE: &str = "CITRANGE";
/// Cards of the point to which the visibilities are phased, and what they mean.
const FOCUS: [(&str, &str); 3] = [
    ("CITFOCL", "direction cosine l of the focus"),
    ("CITFOCM", "direction cosine m of the focus"),
    ("CITFOCR", "m, distance of the focus"),
];

/// Read it. A card that another program has changed is no reason to refuse the file.
pub(crate) fn near_field(header: &Header) -> NearField {
    NearField::of_parts(header.text(RANGE), FOCUS.map(|(key, _)| header.real(key))).unwrap_or_default()
}

/// Write the cards that it needs.
pub(crate) fn write_near_field(h: &mut HeaderWriter, near: &NearField) {
    let (scene, focus) = near.to_parts();
    if let Some(scene) = scene {
        h.text(RANGE, &scene, "");
    }
    for ((key, about), value) in FOCUS.iter().zip(focus) {
        if let Some(value) = value {
            h.real(key, value, about);
        }
    }
}
