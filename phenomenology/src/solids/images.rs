//! Pictures that a scene file names. Pictures of surfaces and heights are converted to rows.

use super::file::{HeightFieldRow, MapRow, SceneFile};
use crate::error::{Result, SceneError};
use crate::geometry::At;
use ndarray::Array2;

/// A function that reads a grey picture by its name. Values are 0 to 1, and the first row is the lowest. // [row, column]
pub type ReadGrey<'a> = &'a dyn Fn(&str) -> std::result::Result<Array2<f64>, Box<dyn std::error::Error + Send + Sync>>;

/// First of the characters that stand for the grey values of a map, in the private area of Unicode.
const FIRST_CHARACTER: u32 = 0xE000;

/// Replaces every picture of a file by rows. `line` returns the line of a position in the text.
pub(super) fn resolve(file: &mut SceneFile, read: ReadGrey<'_>, line: &dyn Fn(usize) -> usize) -> Result<()> {
    let Some(ground) = &mut file.ground else { return Ok(()) };
    let ground = ground.get_mut();
    if let Some(map) = &mut ground.map {
        let at = At(line(map.span().start));
        map_rows(map.get_mut(), read, at)?;
    }
    if let Some(field) = &mut ground.height_field {
        let at = At(line(field.span().start));
        height_rows(field.get_mut(), read, at)?;
    }
    Ok(())
}

fn picture(name: &str, read: ReadGrey<'_>, at: At) -> Result<Array2<f64>> {
    let grey = read(name).map_err(|source| SceneError::Picture { at, name: name.to_owned(), source })?;
    match grey.iter().find(|v| !(0.0..=1.0).contains(*v)) {
        Some(v) => Err(SceneError::At { at, message: format!("picture `{name}` of the ground has a value {v}, expected 0 to 1") }),
        None => Ok(grey),
    }
}

fn map_rows(map: &mut MapRow, read: ReadGrey<'_>, at: At) -> Result<()> {
    let Some(name) = map.image.take() else { return Ok(()) };
    if !map.rows.is_empty() {
        return Err(SceneError::At { at, message: "the map has rows and an image; give one of them".into() });
    }
    let mut letters = [' '; 256];
    for (k, (grey, surface)) in map.grey.iter().enumerate() {
        let Ok(value) = grey.parse::<u8>() else {
            return Err(SceneError::At { at, message: format!("grey value `{grey}` of the map; it must be a whole number of 0 to 255") });
        };
        let Some(letter) = char::from_u32(FIRST_CHARACTER + k as u32).filter(|_| letters[usize::from(value)] == ' ') else {
            return Err(SceneError::At { at, message: format!("grey value {value} of the map is given twice") });
        };
        letters[usize::from(value)] = letter;
        map.legend.insert(letter.to_string(), surface.clone());
    }
    let grey = picture(&name, read, at)?;
    map.rows =
        grey.rows().into_iter().rev().map(|row| row.iter().map(|v| letters[usize::from((v * 255.0).round() as u8)]).collect()).collect();
    map.grey.clear();
    Ok(())
}

fn height_rows(field: &mut HeightFieldRow, read: ReadGrey<'_>, at: At) -> Result<()> {
    let Some(name) = field.image.take() else { return Ok(()) };
    if !field.rows_m.is_empty() || !(field.high_m > field.low_m) {
        let message = "a height field from an image needs low_m below high_m, and no rows_m".into();
        return Err(SceneError::At { at, message });
    }
    let grey = picture(&name, read, at)?;
    let height = |v: &f64| field.low_m + v * (field.high_m - field.low_m);
    field.rows_m = grey.rows().into_iter().rev().map(|row| row.iter().map(height).collect()).collect();
    (field.low_m, field.high_m) = (0.0, 0.0);
    Ok(())
}
