//! The near field: keywords that other programs carry.

use super::names::{FOCUS_KEYWORDS, SCENE_RANGE_KEYWORD};
use crate::h5::{H5In, H5Out};
use crate::{FormatError, Result};
use cittert_arrays::NearField;

fn place(key: &str) -> String {
    format!("Header/extra_keywords/{key}")
}

pub(super) fn write(out: &H5Out, near: &NearField) -> Result<()> {
    let (scene, focus) = near.to_parts();
    if let Some(scene) = scene {
        out.text(&place(SCENE_RANGE_KEYWORD), &scene)?;
    }
    for (key, value) in FOCUS_KEYWORDS.iter().zip(focus) {
        if let Some(value) = value {
            out.scalar(&place(key), value)?;
        }
    }
    Ok(())
}

pub(super) fn read(file: &H5In) -> Result<NearField> {
    let scene = file.text(&place(SCENE_RANGE_KEYWORD))?;
    let mut focus = [None; 3];
    for (key, value) in FOCUS_KEYWORDS.iter().zip(&mut focus) {
        *value = file.real(&place(key))?;
    }
    NearField::of_parts(scene.as_deref(), focus).map_err(|e| FormatError::values(file.path(), e))
}
