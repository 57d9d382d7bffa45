//! Tables, curves and the page of a finished study.

use super::plan::Plan;
use crate::cli::context::Context;
use crate::cli::failure::{Failure, Result};
use crate::cli::text::number;
use crate::plot::report::{Figure, Report, Section, Table, page};
use crate::plot::{CurveOptions, Picture, Series, curves};
use crate::study::{COLUMNS, Quality, Statistics, TrialResult, summarize};
use cittert_formats::atomic::write_file;
use cittert_formats::{Column, Table as Columns, write_tables};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;

/// Names of the statistics in tables.
const STATISTICS: [&str; 5] = ["mean", "std", "median", "p16", "p84"];
/// Largest number of points of the summary in the page and in JSON. The CSV file has all points.
const MOST_SHOWN: usize = 200;

fn values(s: &Statistics) -> [f64; 5] {
    [s.mean, s.std, s.median, s.p16, s.p84]
}

/// Write everything into the folder. Returns the summary for `--json`.
///
/// # Errors
/// An error of the file system.
pub(super) fn write(folder: &Path, plan: &Plan, done: &BTreeMap<usize, TrialResult>, config: &Path, context: &Context) -> Result<Value> {
    let trials = trials(plan, done);
    let stats = statistics(plan, done);
    let summary = summary(plan, &stats);
    write_file(&folder.join("trials.csv"), true, &csv(&trials, done.len())?)?;
    write_file(&folder.join("summary.csv"), true, &csv(&summary, plan.study.setups.len())?)?;
    // The history has no command line, so that a study has the same bytes in any folder and with any number of threads.
    let history = [format!("cittert {} study: {}", env!("CARGO_PKG_VERSION"), plan.title)];
    write_tables(&folder.join("study.h5"), &[trials, summary.clone()], &history, true)?;
    let figures = pictures(plan, &stats)?;
    for (name, figure) in &figures {
        write_file(&folder.join(name), true, &figure.png)?;
    }
    let html = report(plan, done, &summary, figures.into_iter().map(|f| f.1).collect(), (config, context));
    write_file(&folder.join("report.html"), true, html.as_bytes())?;
    Ok(json(&summary, shown(plan)))
}

/// Columns of the axes for the given points.
fn axis_columns(plan: &Plan, points: &[usize]) -> Vec<(String, Column)> {
    let grid = &plan.study.grid;
    let column = |(k, axis): (usize, &crate::study::Axis)| {
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

fn has_after(plan: &Plan) -> bool {
    plan.study.setups.iter().any(|s| s.selfcal.is_some())
}

fn stages(plan: &Plan) -> &'static [&'static str] {
    if has_after(plan) { &["before", "after"] } else { &["before"] }
}

fn stage(r: &TrialResult, name: &str) -> [f64; 5] {
    let none = Quality::of([f64::NAN; 5]);
    if name == "before" { r.before.values() } else { r.after.unwrap_or(none).values() }
}

fn trials(plan: &Plan, done: &BTreeMap<usize, TrialResult>) -> Columns {
    let integer = |x: usize| i64::try_from(x).unwrap_or(i64::MAX);
    let places: Vec<(usize, u64)> = done.keys().map(|k| plan.study.place(*k)).collect();
    let points: Vec<usize> = places.iter().map(|p| p.0).collect();
    let mut columns = vec![("trial".to_owned(), Column::Integer(done.keys().map(|k| integer(*k)).collect()))];
    columns.extend(axis_columns(plan, &points));
    columns.push(("seed".into(), Column::Integer(places.iter().map(|p| i64::from_ne_bytes(p.1.to_ne_bytes())).collect())));
    for name in stages(plan) {
        for (k, c) in COLUMNS.iter().enumerate() {
            columns.push((format!("{}_{name}", c.name), Column::Real(done.values().map(|r| stage(r, name)[k]).collect())));
        }
    }
    columns.push(("rounds".into(), Column::Integer(done.values().map(|r| integer(r.rounds)).collect())));
    columns.push(("note".into(), Column::Text(done.values().map(|r| r.note.clone()).collect())));
    Columns { name: "trials".into(), columns }
}

/// \[stage\]\[column\]\[point\].
type AllStatistics = Vec<Vec<Vec<Statistics>>>;

fn statistics(plan: &Plan, done: &BTreeMap<usize, TrialResult>) -> AllStatistics {
    let n = plan.study.seeds.len();
    let of = |name: &str, k: usize, p: usize| summarize(done.range(p * n..(p + 1) * n).map(|(_, r)| stage(r, name)[k]));
    stages(plan)
        .iter()
        .map(|name| (0..COLUMNS.len()).map(|k| (0..plan.study.setups.len()).map(|p| of(name, k, p)).collect()).collect())
        .collect()
}

fn summary(plan: &Plan, stats: &AllStatistics) -> Columns {
    let points: Vec<usize> = (0..plan.study.setups.len()).collect();
    let mut columns = axis_columns(plan, &points);
    for (name, stage) in stages(plan).iter().zip(stats) {
        // The phase error is finite if the trial has gains.
        let n = stage[4].iter().map(|s| i64::try_from(s.n).unwrap_or(i64::MAX)).collect();
        columns.push((format!("trials_{name}"), Column::Integer(n)));
        for (c, at) in COLUMNS.iter().zip(stage) {
            for (k, what) in STATISTICS.iter().enumerate() {
                columns.push((format!("{}_{name}_{what}", c.name), Column::Real(at.iter().map(|s| values(s)[k]).collect())));
            }
        }
    }
    Columns { name: "summary".into(), columns }
}

/// A value of a table, as it is written in CSV.
fn cell(column: &Column, row: usize) -> String {
    match column {
        Column::Real(v) => v[row].to_string(),
        Column::Integer(v) => v[row].to_string(),
        Column::Text(v) => v[row].clone(),
    }
}

/// Number of rows of the summary: its points.
fn shown(plan: &Plan) -> usize {
    plan.study.setups.len().min(MOST_SHOWN)
}

fn csv(table: &Columns, rows: usize) -> Result<Vec<u8>> {
    let failed = |e: &dyn std::fmt::Display| Failure::message(format!("writing table {}: {e}", table.name));
    let mut out = csv::Writer::from_writer(Vec::new());
    out.write_record(table.columns.iter().map(|c| &c.0)).map_err(|e| failed(&e))?;
    for row in 0..rows {
        out.write_record(table.columns.iter().map(|c| cell(&c.1, row))).map_err(|e| failed(&e))?;
    }
    out.into_inner().map_err(|e| failed(&e))
}

fn json(summary: &Columns, rows: usize) -> Value {
    let real = |x: f64| serde_json::Number::from_f64(x).map_or(Value::Null, Value::Number);
    let of = |c: &Column, row: usize| match c {
        Column::Real(v) => real(v[row]),
        Column::Integer(v) => v[row].into(),
        Column::Text(v) => v[row].clone().into(),
    };
    (0..rows).map(|row| Value::Object(summary.columns.iter().map(|(n, c)| (n.clone(), of(c, row))).collect())).collect()
}

/// One picture for each column: the median over the seeds with the 16th and 84th percentile, against the first axis. Each stage and each
/// combination of the other axes has a line.
fn pictures(plan: &Plan, stats: &AllStatistics) -> Result<Vec<(String, Figure)>> {
    let Some(axis) = plan.study.grid.axes.first() else { return Ok(Vec::new()) };
    let grid = &plan.study.grid;
    let others = grid.n_points() / axis.values.len();
    let x = |k: usize| axis.values[k].number.unwrap_or(k as f64 + 1.0);
    let xs: Vec<f64> = (0..axis.values.len()).map(x).collect();
    let log_x =
        xs.iter().all(|v| *v > 0.0) && xs.iter().copied().fold(0.0, f64::max) > 50.0 * xs.iter().copied().fold(f64::INFINITY, f64::min);
    let names: Vec<String> = axis.values.iter().enumerate().map(|(k, v)| format!("{} {}", k + 1, v.text)).collect();
    let x_label = match (axis.is_numeric(), axis.unit.as_str()) {
        (true, "") => axis.name.clone(),
        (true, unit) => format!("{} [{unit}]", axis.name),
        _ => format!("{}: {}", axis.name, names.join(", ")),
    };
    let mut out = Vec::new();
    for (c, column) in COLUMNS.iter().enumerate() {
        let mut series = Vec::new();
        // More than a dozen lines cannot be distinguished.
        for other in 0..others.min(6) {
            for (name, stage) in stages(plan).iter().zip(stats) {
                let at: Vec<Statistics> = (0..xs.len()).map(|k| stage[c][k * others + other]).collect();
                let rest: Vec<String> = grid.point(other)[1..].iter().map(|v| v.text.clone()).collect();
                series.push(Series {
                    name: std::iter::once(format!("{name} self-calibration")).chain(rest).collect::<Vec<_>>().join(", "),
                    points: xs.iter().zip(&at).map(|(x, s)| (*x, s.median)).collect(),
                    errors: at.iter().map(|s| (s.median - s.p16, s.p84 - s.median)).collect(),
                });
            }
        }
        let y_label = if column.name == "residual_rms" { format!("{} [{}]", column.label, plan.unit) } else { column.label.to_owned() };
        let options =
            CurveOptions { title: plan.title.clone(), x_label: x_label.clone(), y_label, log_x, log_y: true, ..CurveOptions::default() };
        // A column without a single positive number (no gains, no errors) has no picture.
        if let Ok(png) = curves(&series, &options).and_then(Picture::png) {
            let caption =
                format!("{}: median over {} seeds, bars from the 16th to the 84th percentile.", column.label, plan.study.seeds.len());
            let name = format!("{}.png", column.name);
            out.push((name.clone(), Figure { png, caption, file: name }));
        }
    }
    Ok(out)
}

fn report(plan: &Plan, done: &BTreeMap<usize, TrialResult>, summary: &Columns, figures: Vec<Figure>, from: (&Path, &Context)) -> String {
    let fact = |n: &str, v: String| (n.to_owned(), v);
    let medians: Vec<&(String, Column)> = summary
        .columns
        .iter()
        .filter(|c| !c.0.ends_with("_mean") && !c.0.ends_with("_std") && !c.0.contains("_p16") && !c.0.contains("_p84"))
        .collect();
    let text = |c: &Column, row: usize| match c {
        Column::Real(v) => number(v[row]),
        other => cell(other, row),
    };
    let rows = (0..shown(plan)).map(|r| medians.iter().map(|c| text(&c.1, r)).collect());
    let mut notes: BTreeMap<&str, usize> = BTreeMap::new();
    done.values().filter(|r| !r.note.is_empty()).for_each(|r| *notes.entry(&r.note).or_default() += 1);
    page(&Report {
        title: plan.title.clone(),
        facts: vec![
            fact("cittert", env!("CARGO_PKG_VERSION").into()),
            fact("configuration", from.0.display().to_string()),
            fact("points", plan.study.setups.len().to_string()),
            fact("seeds", plan.study.seeds.len().to_string()),
            fact("trials", done.len().to_string()),
        ],
        highlights: figures,
        sections: vec![Section {
            title: "Medians".into(),
            text: "Every number of every trial is in trials.csv and study.h5, all statistics in summary.csv.".into(),
            commands: vec![from.1.command_line.clone()],
            table: Table { head: medians.iter().map(|c| c.0.clone()).collect(), rows: rows.collect() },
            messages: notes.iter().take(20).map(|(note, n)| format!("{n} trials: {note}")).collect(),
            ..Section::default()
        }],
        ..Report::default()
    })
}
