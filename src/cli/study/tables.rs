//! The tables of a finished study.

use super::failures::Ranking;
use super::journal::Key;
use super::plan::Plan;
use super::question::Asked;
use crate::cli::failure::{Failure, Result};
use crate::study::{Axis, N_SCORES, Quality, Score, Statistics, TrialResult, summarize};
use cittert_formats::{Column, Table};
use serde_json::Value;
use std::collections::BTreeMap;

/// Names of the statistics in tables.
const STATISTICS: [&str; 5] = ["mean", "std", "median", "p16", "p84"];

fn values(s: &Statistics) -> [f64; 5] {
    [s.mean, s.std, s.median, s.p16, s.p84]
}

fn integer(x: usize) -> i64 {
    i64::try_from(x).unwrap_or(i64::MAX)
}

/// Columns of the axes for the given points.
fn axis_columns(plan: &Plan, points: &[usize]) -> Vec<(String, Column)> {
    let grid = &plan.study.grid;
    let column = |(k, axis): (usize, &Axis)| {
        let at = |p: &usize| grid.point(*p)[k].clone();
        let values = if axis.is_numeric() {
            Column::Real(points.iter().map(|p| at(p).number.unwrap_or(f64::NAN)).collect())
        } else {
            Column::Text(points.iter().map(|p| at(p).text).collect())
        };
        (axis.column(), values)
    };
    grid.axes.iter().enumerate().map(column).collect()
}

/// The stages of the images of a study.
pub(super) fn stages(plan: &Plan) -> &'static [&'static str] {
    if plan.has_after() { &["before", "after"] } else { &["before"] }
}

fn stage(r: &TrialResult, name: &str) -> [f64; N_SCORES] {
    if name == "before" { r.before.values() } else { r.after.map_or([f64::NAN; N_SCORES], |q: Quality| q.values()) }
}

/// The columns of the results of some trials.
fn results(plan: &Plan, trials: &[&TrialResult]) -> Vec<(String, Column)> {
    let mut columns = Vec::new();
    for name in stages(plan) {
        for (k, score) in Score::ALL.iter().enumerate() {
            columns.push((format!("{}_{name}", score.name()), Column::Real(trials.iter().map(|r| stage(r, name)[k]).collect())));
        }
    }
    if plan.has_after() {
        columns.push(("accepted".into(), Column::Integer(trials.iter().map(|r| i64::from(r.accepted == Some(true))).collect())));
    }
    columns.push(("rounds".into(), Column::Integer(trials.iter().map(|r| integer(r.rounds)).collect())));
    columns.push(("note".into(), Column::Text(trials.iter().map(|r| r.note.clone()).collect())));
    columns
}

fn seeds(plan: &Plan, indices: impl Iterator<Item = usize>) -> Column {
    // A seed above the largest integer of the table appears as the negative number with the same bits.
    Column::Integer(indices.map(|k| i64::from_ne_bytes(plan.study.seeds[k].to_ne_bytes())).collect())
}

/// The trials of the grid.
pub(super) fn trials(plan: &Plan, done: &BTreeMap<Key, TrialResult>) -> Table {
    let n = plan.study.seeds.len();
    let own: Vec<(usize, &TrialResult)> =
        done.iter().filter_map(|(k, r)| if let Key::Grid(k) = k { Some((*k, r)) } else { None }).collect();
    let points: Vec<usize> = own.iter().map(|(k, _)| k / n).collect();
    let mut columns = vec![("trial".to_owned(), Column::Integer(own.iter().map(|(k, _)| integer(*k)).collect()))];
    columns.extend(axis_columns(plan, &points));
    columns.push(("seed".into(), seeds(plan, own.iter().map(|(k, _)| k % n))));
    columns.extend(results(plan, &own.iter().map(|(_, r)| *r).collect::<Vec<_>>()));
    Table { name: "trials".into(), columns }
}

/// The trials that a question needed beside the grid.
pub(super) fn asked(plan: &Plan, asked: &Asked, done: &BTreeMap<Key, TrialResult>) -> Table {
    let mut own: Vec<(usize, f64, usize, &TrialResult)> = Vec::new();
    for (key, r) in done {
        if let Key::Asked { place, value, seed } = key {
            own.push((*place, value.parse().unwrap_or(f64::NAN), *seed, r));
        }
    }
    own.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
    let parameter = if asked.unit.is_empty() { asked.parameter.clone() } else { format!("{}_{}", asked.parameter, asked.unit) };
    let mut columns = Vec::new();
    if asked.places.len() > 1 {
        columns.push(("place".to_owned(), Column::Text(own.iter().map(|t| asked.places[t.0].text.clone()).collect())));
    }
    columns.push((parameter, Column::Real(own.iter().map(|t| t.1).collect())));
    columns.push(("seed".into(), seeds(plan, own.iter().map(|t| t.2))));
    columns.extend(results(plan, &own.iter().map(|t| t.3).collect::<Vec<_>>()));
    Table { name: "question".into(), columns }
}

/// What the failure of each antenna costs, the costliest first.
pub(super) fn failures(plan: &Plan, rankings: &[Vec<Ranking>]) -> Table {
    let (Some(failing), Some(last)) = (&plan.failing, rankings.last()) else {
        return Table { name: "failures".into(), columns: Vec::new() };
    };
    let rows: Vec<(usize, usize, usize)> =
        last.iter().enumerate().flat_map(|(p, r)| r.costs.iter().enumerate().map(move |(k, c)| (p, k, c.antenna))).collect();
    let mut columns = axis_columns(plan, &rows.iter().map(|r| r.0).collect::<Vec<_>>());
    columns.push(("rank".into(), Column::Integer(rows.iter().map(|r| integer(r.1 + 1)).collect())));
    columns.push(("antenna".into(), Column::Text(rows.iter().map(|r| failing.antennas[r.0][r.2].1.clone()).collect())));
    for (name, rankings) in stages(plan).iter().zip(rankings) {
        let cost = |r: &(usize, usize, usize)| rankings[r.0].costs.iter().find(|c| c.antenna == r.2);
        let column =
            |pick: fn(&crate::study::AntennaCost) -> f64| Column::Real(rows.iter().map(|r| cost(r).map_or(f64::NAN, pick)).collect());
        columns.push((format!("{}_cost_{name}", failing.score.name()), column(|c| c.cost)));
        columns.push((format!("{}_cost_error_{name}", failing.score.name()), column(|c| c.error)));
    }
    Table { name: "failures".into(), columns }
}

/// \[stage\]\[score\]\[point\].
pub(super) type AllStatistics = Vec<Vec<Vec<Statistics>>>;

/// The trials of a point of the grid.
fn of_point<'a>(plan: &'a Plan, done: &'a BTreeMap<Key, TrialResult>, point: usize) -> impl Iterator<Item = &'a TrialResult> {
    let n = plan.study.seeds.len();
    done.range(Key::Grid(point * n)..Key::Grid((point + 1) * n)).map(|(_, r)| r)
}

pub(super) fn statistics(plan: &Plan, done: &BTreeMap<Key, TrialResult>) -> AllStatistics {
    let of = |name: &str, k: usize, p: usize| summarize(of_point(plan, done, p).map(|r| stage(r, name)[k]));
    let points = 0..plan.study.setups.len();
    let stage = |name: &&str| (0..N_SCORES).map(|k| points.clone().map(|p| of(name, k, p)).collect()).collect();
    stages(plan).iter().map(stage).collect()
}

pub(super) fn summary(plan: &Plan, stats: &AllStatistics, done: &BTreeMap<Key, TrialResult>) -> Table {
    let points: Vec<usize> = (0..plan.study.setups.len()).collect();
    let mut columns = axis_columns(plan, &points);
    for (name, stage) in stages(plan).iter().zip(stats) {
        // The phase error is finite if the trial has gains.
        let n = stage[Score::PhaseRmsRad as usize].iter().map(|s| integer(s.n)).collect();
        columns.push((format!("trials_{name}"), Column::Integer(n)));
        for (score, at) in Score::ALL.iter().zip(stage) {
            for (k, what) in STATISTICS.iter().enumerate() {
                let values = at.iter().map(|s| values(s)[k]).collect();
                columns.push((format!("{}_{name}_{what}", score.name()), Column::Real(values)));
            }
        }
    }
    if plan.has_after() {
        let share = |p: &usize| summarize(of_point(plan, done, *p).map(|r| f64::from(u8::from(r.accepted == Some(true))))).mean;
        columns.push(("accepted_fraction".into(), Column::Real(points.iter().map(share).collect())));
    }
    Table { name: "summary".into(), columns }
}

/// A value of a table, as it is written in CSV.
pub(super) fn cell(column: &Column, row: usize) -> String {
    match column {
        Column::Real(v) => v[row].to_string(),
        Column::Integer(v) => v[row].to_string(),
        Column::Text(v) => v[row].clone(),
    }
}

/// Number of rows of a table.
pub(super) fn rows(table: &Table) -> usize {
    table.columns.first().map_or(0, |(_, c)| match c {
        Column::Real(v) => v.len(),
        Column::Integer(v) => v.len(),
        Column::Text(v) => v.len(),
    })
}

pub(super) fn csv(table: &Table) -> Result<Vec<u8>> {
    let failed = |e: &dyn std::fmt::Display| Failure::message(format!("writing table {}: {e}", table.name));
    let mut out = csv::Writer::from_writer(Vec::new());
    out.write_record(table.columns.iter().map(|c| &c.0)).map_err(|e| failed(&e))?;
    for row in 0..rows(table) {
        out.write_record(table.columns.iter().map(|c| cell(&c.1, row))).map_err(|e| failed(&e))?;
    }
    out.into_inner().map_err(|e| failed(&e))
}

/// The first rows of a table as objects.
pub(super) fn json(table: &Table, most: usize) -> Value {
    let of = |c: &Column, row: usize| match c {
        Column::Real(v) => serde_json::Number::from_f64(v[row]).map_or(Value::Null, Value::Number),
        Column::Integer(v) => v[row].into(),
        Column::Text(v) => v[row].clone().into(),
    };
    (0..rows(table).min(most)).map(|row| Value::Object(table.columns.iter().map(|(n, c)| (n.clone(), of(c, row))).collect())).collect()
}
