//! Keywords of the main table for properties that a Measurement Set has no place for.

use super::keywords::Place;
use super::table::Table;
use crate::Result;
use cittert_arrays::{ElementPattern, NearField, VisUnit, VisibilityHeader};

const FRAME: &str = "cittert_frame";
const BORESIGHT: &str = "boresight";
const LAYOUT: &str = "cittert_layout";
const SOURCE: &str = "cittert_layout_source";
const INSTRUMENT: &str = "cittert_instrument";
const PEDESTAL: &str = "pedestal_k";
const SCENE_PEDESTAL: &str = "scene_pedestal_k";
const SCENE_WIDTH: &str = "scene_width_rad";
/// The power pattern of the elements, as in UVH5.
const PATTERN: &str = "element_pattern";
const ANTENNA_TEMPERATURE: &str = "antenna_temperature_k";
/// The near field, as in UVH5.
const SCENE_RANGE: &str = "scene_range";
const FOCUS: [&str; 3] = ["focus_l", "focus_m", "focus_range_m"];
const WEIGHT_SCALE: &str = "cittert_weight_scale";

/// All of these keywords.
pub(super) const KEYWORDS: [&str; 14] = [
    ANTENNA_TEMPERATURE,
    FRAME,
    LAYOUT,
    SOURCE,
    INSTRUMENT,
    PATTERN,
    PEDESTAL,
    SCENE_PEDESTAL,
    SCENE_RANGE,
    SCENE_WIDTH,
    FOCUS[0],
    FOCUS[1],
    FOCUS[2],
    WEIGHT_SCALE,
];

/// The values of these keywords.
#[derive(Debug, Default, Clone, PartialEq)]
pub(super) struct Own {
    pub(super) boresight: bool,
    pub(super) layout: Option<String>,
    pub(super) source: Option<String>,
    pub(super) instrument: Option<String>,
    pub(super) pedestal_k: Option<f64>,
    pub(super) scene_pedestal_k: Option<f64>,
    pub(super) scene_width_rad: Option<f64>,
    pub(super) pattern: ElementPattern,
    pub(super) antenna_temperature_k: Option<f64>,
    pub(super) near_field: NearField,
    /// Weights of the file divided by weights of the data.
    pub(super) weight_scale: Option<f64>,
}

/// Write the keywords that this header needs.
pub(super) fn write(main: &mut Table, header: &VisibilityHeader) -> Result<()> {
    let mut text = |key: &str, value: &str| main.put_keyword_text(Place::table(key), &[value], true);
    if header.is_boresight() {
        text(FRAME, BORESIGHT)?;
    }
    if !header.layout.name.is_empty() && header.layout.name != header.telescope {
        text(LAYOUT, &header.layout.name)?;
    }
    if let Some(source) = header.layout.source.as_deref().filter(|s| !s.is_empty()) {
        text(SOURCE, source)?;
    }
    if !header.instrument.is_empty() && header.instrument != header.telescope {
        text(INSTRUMENT, &header.instrument)?;
    }
    if header.layout.pattern.parameters().is_some() {
        text(PATTERN, &header.layout.pattern.to_string())?;
    }
    let (scene, focus) = header.near_field.to_parts();
    if let Some(scene) = scene {
        text(SCENE_RANGE, &scene)?;
    }
    if header.unit != VisUnit::Uncalibrated {
        // The name in pyuvdata of the convention that Stokes I is half the sum of the parallel hands.
        text("pyuvdata_polconv", "avg")?;
    }
    let numbers = [
        (PEDESTAL, header.pedestal_k),
        (SCENE_PEDESTAL, header.scene_pedestal_k),
        (SCENE_WIDTH, header.scene_width_rad),
        (ANTENNA_TEMPERATURE, header.antenna_temperature_k),
    ];
    for (key, value) in numbers.into_iter().chain(FOCUS.into_iter().zip(focus)) {
        if let Some(value) = value {
            main.put_keyword_value(Place::table(key), value)?;
        }
    }
    Ok(())
}

/// Write the factor by which the weights were multiplied.
pub(super) fn write_weight_scale(main: &mut Table, scale: f64) -> Result<()> {
    if scale == 1.0 { Ok(()) } else { main.put_keyword_value(Place::table(WEIGHT_SCALE), scale) }
}

/// Read the keywords.
pub(super) fn read(main: &Table) -> Result<Own> {
    let text = |key: &str| main.keyword_text(Place::table(key), 0);
    let number = |key: &str| -> Result<Option<f64>> { Ok(main.keyword_number(Place::table(key), 0)?.filter(|v| v.is_finite())) };
    let focus = [number(FOCUS[0])?, number(FOCUS[1])?, number(FOCUS[2])?];
    Ok(Own {
        near_field: NearField::of_parts(text(SCENE_RANGE)?.as_deref(), focus).unwrap_or_default(),
        boresight: text(FRAME)?.as_deref() == Some(BORESIGHT),
        // A keyword that another program has changed is no reason to refuse the set.
        pattern: text(PATTERN)?.and_then(|t| t.parse().ok()).unwrap_or_default(),
        layout: text(LAYOUT)?,
        source: text(SOURCE)?,
        instrument: text(INSTRUMENT)?,
        pedestal_k: main.keyword_number(Place::table(PEDESTAL), 0)?.filter(|p| p.is_finite()),
        scene_pedestal_k: main.keyword_number(Place::table(SCENE_PEDESTAL), 0)?.filter(|p| p.is_finite()),
        scene_width_rad: main.keyword_number(Place::table(SCENE_WIDTH), 0)?.filter(|w| w.is_finite() && *w > 0.0),
        antenna_temperature_k: main.keyword_number(Place::table(ANTENNA_TEMPERATURE), 0)?.filter(|t| t.is_finite()),
        weight_scale: main.keyword_number(Place::table(WEIGHT_SCALE), 0)?.filter(|s| s.is_finite() && *s > 0.0),
    })
}
