//! The question of a study, and its places among the other axes.

use super::axes::{like, shown};
use super::config::{AxisSection, QuestionSection};
use crate::cli::failure::{Failure, Result, ensure};
use crate::study::{Axis, Bound, Grid, Question, least_seeds};
use std::collections::BTreeMap;

/// A question ready to be answered.
pub(super) struct Asked {
    pub(super) question: Question,
    pub(super) parameter: String,
    /// Unit of the values.
    pub(super) unit: String,
    /// The form of a value in the file.
    form: toml::Value,
    /// The combinations of the other axes.
    pub(super) places: Vec<Spot>,
}

/// A combination of the values of the other axes.
pub(super) struct Spot {
    /// Points of the grid there, with the value of the parameter at each.
    pub(super) points: Vec<(usize, f64)>,
    /// Parameters and values as text, such as `layout.name = vla-a`; empty without other axes.
    pub(super) text: String,
    /// The values of the other axes.
    others: Vec<(String, toml::Value)>,
}

impl Asked {
    /// The question of a section. `axes` are those of the grid with their values in the file.
    ///
    /// # Errors
    /// A number out of its range, a parameter that is not numeric, or too few seeds.
    pub(super) fn new(q: QuestionSection, grid: &Grid, seeds: usize, axes: &[(AxisSection, Vec<toml::Value>)]) -> Result<Self> {
        let wrong = |what: String| Err(Failure::message(format!("parameter {}: {what}", q.parameter)));
        let (limit, at_least) = match (q.at_least, q.at_most) {
            (Some(limit), None) => (limit, true),
            (None, Some(limit)) => (limit, false),
            _ => return Err(Failure::message("give at-least or at-most, and not both")),
        };
        let ends = Axis::new(&q.parameter, &[shown(&q.from), shown(&q.to)])?;
        let (Some(from), Some(to)) = (ends.values[0].number, ends.values[1].number) else {
            return wrong("from and to must be numbers in the same unit".into());
        };
        let Some(own) = grid.axes.iter().position(|a| a.name == q.parameter) else {
            return wrong("it is no axis".into());
        };
        let axis = &grid.axes[own];
        if !axis.is_numeric() || axis.unit != ends.unit {
            return wrong(format!("its axis must have numbers in the unit of from and to, {:?}", ends.unit));
        }
        let whole = matches!(q.from, toml::Value::Integer(_)) && matches!(q.to, toml::Value::Integer(_));
        let bound = Bound { score: q.keep, limit, at_least };
        let question = Question { bound, from, to, whole, log: q.log, fraction: q.fraction, precision: q.precision };
        question.check()?;
        let least = least_seeds(1.0 - q.fraction);
        ensure!(seeds >= least, Failure::message(format!("seeds is {seeds}, and a fraction of {} needs at least {least}", q.fraction)));
        let mut places: BTreeMap<Vec<usize>, Vec<(usize, f64)>> = BTreeMap::new();
        for point in 0..grid.n_points() {
            let mut indices = grid.indices(point);
            let value = axis.values[indices.remove(own)].number.unwrap_or(f64::NAN);
            places.entry(indices).or_default().push((point, value));
        }
        let spot = |(indices, points): (Vec<usize>, Vec<(usize, f64)>)| {
            let others = axes.iter().enumerate().filter(|(k, _)| *k != own).zip(indices);
            let others: Vec<(String, toml::Value)> = others.map(|((_, (s, l)), i)| (s.parameter.clone(), l[i].clone())).collect();
            let text = others.iter().map(|(p, v)| format!("{p} = {}", shown(v))).collect::<Vec<_>>().join(", ");
            Spot { points, text, others }
        };
        let places = places.into_iter().map(spot).collect();
        let form = if whole || matches!(q.from, toml::Value::String(_)) { q.from } else { toml::Value::Float(from) };
        Ok(Self { question, parameter: q.parameter, unit: ends.unit, form, places })
    }

    /// The parameters of the trials at a place, with their values in the form of the file.
    pub(super) fn changes(&self, place: usize, value: f64) -> Vec<(&str, toml::Value)> {
        let own = (self.parameter.as_str(), like(&self.form, value, &self.unit));
        self.places[place].others.iter().map(|(p, v)| (p.as_str(), v.clone())).chain([own]).collect()
    }

    /// Where a trial of the question is, for messages.
    pub(super) fn at(&self, place: usize, value: &str) -> String {
        let own = format!("{} = {value}{}", self.parameter, self.unit);
        if self.places[place].text.is_empty() { own } else { format!("{}, {own}", self.places[place].text) }
    }
}
