//! The axes of a study: their values, and the question that may add one.

use super::config::{AxisSection, QuestionSection};
use crate::cli::failure::{Failure, Result};
use crate::study::Axis;

/// Number of values of the axis that a question adds.
const SCAN: usize = 5;

/// The axes of a study with the values that they have in the file. If there is a question and its parameter is no axis, it becomes the first.
pub(super) fn axes(mut sections: Vec<AxisSection>, question: Option<&QuestionSection>) -> Result<Vec<(AxisSection, Vec<toml::Value>)>> {
    if let Some(q) = question.filter(|q| !sections.iter().any(|s| s.parameter == q.parameter)) {
        let (from, to) = (Some(q.from.clone()), Some(q.to.clone()));
        let scan = AxisSection { parameter: q.parameter.clone(), values: Vec::new(), from, to, count: Some(SCAN), log: q.log };
        sections.insert(0, scan);
    }
    sections.into_iter().map(|s| values(&s).map(|v| (s, v))).collect()
}

/// A value as it is written on a command line.
pub(super) fn shown(value: &toml::Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

/// A number in the form of another value: an integer, a decimal, or a text with a unit.
pub(super) fn like(form: &toml::Value, x: f64, unit: &str) -> toml::Value {
    match form {
        toml::Value::Integer(_) => toml::Value::Integer(x.round() as i64),
        toml::Value::Float(_) => toml::Value::Float(x),
        _ => toml::Value::String(format!("{x}{unit}")),
    }
}

/// The values of an axis: as listed, or from, to and count.
fn values(axis: &AxisSection) -> Result<Vec<toml::Value>> {
    let wrong = |what: &str| Failure::message(format!("axis {}: {what}", axis.parameter));
    let (Some(from), Some(to), Some(count)) = (&axis.from, &axis.to, axis.count) else {
        if axis.values.is_empty() || axis.from.is_some() || axis.to.is_some() || axis.count.is_some() {
            return Err(wrong("give values = [...], or from, to and count"));
        }
        return Ok(axis.values.clone());
    };
    let ends = Axis::new(&axis.parameter, &[shown(from), shown(to)])?;
    let (Some(a), Some(b)) = (ends.values[0].number, ends.values[1].number) else {
        return Err(wrong("from and to must be numbers in the same unit"));
    };
    if !axis.values.is_empty() || !(2..=1_000_000).contains(&count) || (axis.log && !(a > 0.0 && b > 0.0)) {
        return Err(wrong("from, to and count go without values, with a count of at least 2 (and positive numbers for log)"));
    }
    let at = |k: usize| {
        let t = k as f64 / (count - 1) as f64;
        let x = if axis.log { a * (b / a).powf(t) } else { a + t * (b - a) };
        // With twelve digits the ends and round steps are printed as they were typed.
        format!("{x:.11e}").parse::<f64>().unwrap_or(x)
    };
    let mut all: Vec<toml::Value> = (0..count).map(|k| like(from, at(k), &ends.unit)).collect();
    // A short range has fewer integers than values.
    all.dedup();
    Ok(all)
}
