//! Writes the files of a finished study.

use super::answers::Answers;
use super::failures::{Ranking, rankings};
use super::journal::{WRITER, of_results};
use super::plan::Plan;
use super::tables::{AllStatistics, asked, cell, csv, failures, json, rows, stages, statistics, summary, trials};
use super::trials::Trials;
use super::{pictures, sentence};
use crate::cli::context::Context;
use crate::cli::failure::Result;
use crate::cli::quality::{self, Verdict};
use crate::cli::text::number;
use crate::plot::report::{Figure, Report, Section, Table, page};
use crate::study::{Answer, Place, Question, Score, Statistics};
use cittert_formats::atomic::{LIST, write_file};
use cittert_formats::{Column, Table as Columns, write_tables};
use serde_json::{Value, json as object};
use std::collections::BTreeMap;
use std::path::Path;

/// Largest number of rows of a table in the page and in JSON. The CSV files have all rows.
const MOST_SHOWN: usize = 200;

/// What a study found.
pub(super) struct Findings {
    /// The contents of metrics.json.
    pub(super) metrics: Value,
    /// The answers, one sentence each.
    pub(super) sentences: Vec<String>,
    /// How the results compare with the quality that the configuration states.
    pub(super) verdict: Verdict,
}

/// Write everything into the folder.
///
/// # Errors
/// An error of the file system.
pub(super) fn write(
    folder: &Path,
    plan: &Plan,
    all: &Trials<'_>,
    answers: &[Answers],
    config: &Path,
    context: &Context,
) -> Result<Findings> {
    let done = &all.done;
    let stats = statistics(plan, done);
    let summary = summary(plan, &stats, done);
    let mut tables = vec![trials(plan, done), summary.clone()];
    let mut figures = pictures::scores(plan, &stats)?;
    let mut metrics = object!({
        "title": plan.title, "version": env!("CARGO_PKG_VERSION"), "points": plan.study.setups.len(), "seeds": plan.study.seeds.len(),
        "trials": done.len(), "summary": json(&summary, MOST_SHOWN),
    });
    let mut sentences = Vec::new();
    if let Some(question) = &plan.asked {
        tables.push(asked(plan, question, done));
        let n = plan.study.seeds.len();
        sentences.extend(answers.iter().enumerate().map(|(p, a)| sentence::answer(question, p, a, n)));
        let one = |(p, a): (usize, &Answers)| {
            let q = &question.question;
            let bound = if q.bound.at_least { "at_least" } else { "at_most" };
            object!({
                "place": question.places[p].text, "parameter": question.parameter, "unit": question.unit, "keep": q.bound.score.name(),
                bound: q.bound.limit, "fraction": q.fraction, "from": q.from, "to": q.to, "sentence": sentences[p],
                "before": of_stage(&a.before, q), "after": a.after.as_ref().map(|a| of_stage(a, q)),
            })
        };
        metrics["answers"] = answers.iter().enumerate().map(one).collect();
    }
    if let Some(failing) = &plan.failing {
        let ranked: Vec<Vec<Ranking>> = stages(plan).iter().map(|s| rankings(plan, all, *s == "after")).collect();
        let table = failures(plan, &ranked);
        let last = ranked.last().map_or(&[][..], Vec::as_slice);
        for (p, r) in last.iter().enumerate() {
            let names: Vec<&str> = r.costs.iter().map(|c| failing.antennas[p][c.antenna].1.as_str()).collect();
            sentences.push(sentence::ranking(failing.score, r, &names, &plan.study.grid.place(p), plan.has_after()));
        }
        metrics["failures"] = object!({ "sentences": sentences, "ranking": json(&table, MOST_SHOWN) });
        figures.extend(pictures::failures(plan, last));
        tables.push(table);
    }
    let flat = flat_points(plan, &stats);
    let told = |(stage, points): (&String, &Vec<usize>)| {
        let places: Vec<String> = points.iter().map(|p| plan.study.grid.place(*p)).collect();
        sentence::flat(stage, &places, plan.study.setups.len())
    };
    sentences.extend(flat.iter().filter_map(told));
    metrics["no_better_than_flat"] = object!(flat);
    let verdict = quality::judge(&plan.quality, &metrics);
    metrics["quality"] = verdict.json.clone();
    let names = tables.iter().map(|t| format!("{}.csv", t.name)).chain(figures.iter().map(|f| f.0.clone()));
    let list = of_results(names.chain(["metrics.json", "study.h5", "report.html"].map(str::to_owned)));
    write_file(&folder.join(LIST), true, list.text(WRITER).as_bytes())?;
    for table in &tables {
        write_file(&folder.join(format!("{}.csv", table.name)), true, &csv(table)?)?;
    }
    write_file(&folder.join("metrics.json"), true, &serde_json::to_vec_pretty(&metrics)?)?;
    // The history has no command line, so that a study has the same bytes in any folder and with any number of threads.
    let history = [format!("cittert {} study: {}", env!("CARGO_PKG_VERSION"), plan.title)];
    write_tables(&folder.join("study.h5"), &tables, &history, true)?;
    for (name, figure) in &figures {
        write_file(&folder.join(name), true, &figure.png)?;
    }
    let found = Findings { metrics, sentences, verdict };
    let html = report(plan, all, (&tables, &found), figures.into_iter().map(|f| f.1).collect(), (config, context));
    write_file(&folder.join("report.html"), true, html.as_bytes())?;
    Ok(found)
}

/// The points at which the median image is no better than a flat one, for each stage.
fn flat_points(plan: &Plan, stats: &AllStatistics) -> BTreeMap<String, Vec<usize>> {
    let of = |stage: &Vec<Vec<Statistics>>| {
        let errors = stage[Score::ErrorOverGreyCard as usize].iter().enumerate();
        errors.filter(|(_, s)| s.median >= 1.0).map(|(p, _)| p).collect()
    };
    stages(plan).iter().zip(stats).map(|(name, stage)| ((*name).to_owned(), of(stage))).collect()
}

fn of_stage(a: &Answer, q: &Question) -> Value {
    let number = |p: Option<Place>| p.and_then(Place::number);
    object!({
        "value": sentence::value(a, q), "low": number(a.limit.low), "high": number(a.limit.high), "outside": sentence::outside(a),
        "rising": a.rising, "contradictions": a.contradictions, "seeds_needed": a.seeds_needed,
    })
}

/// A table for the page. Of statistics it has the medians.
fn shown(table: &Columns) -> Table {
    let other = |name: &str| name.ends_with("_mean") || name.ends_with("_std") || name.contains("_p16") || name.contains("_p84");
    let columns: Vec<&(String, Column)> = table.columns.iter().filter(|c| !other(&c.0)).collect();
    let text = |c: &Column, row: usize| match c {
        Column::Real(v) => number(v[row]),
        other => cell(other, row),
    };
    let rows = (0..rows(table).min(MOST_SHOWN)).map(|r| columns.iter().map(|c| text(&c.1, r)).collect());
    Table { rows: rows.collect(), head: columns.iter().map(|c| c.0.clone()).collect() }
}

fn report(
    plan: &Plan,
    all: &Trials<'_>,
    (tables, found): (&[Columns], &Findings),
    figures: Vec<Figure>,
    from: (&Path, &Context),
) -> String {
    let fact = |n: &str, v: String| (n.to_owned(), v);
    let mut notes: BTreeMap<&str, usize> = BTreeMap::new();
    all.done.values().filter(|r| !r.note.is_empty()).for_each(|r| *notes.entry(&r.note).or_default() += 1);
    let mut sections = Vec::new();
    for table in tables {
        let (title, text) = match table.name.as_str() {
            "summary" => ("Medians", "Every number of every trial is in trials.csv and study.h5, all statistics in summary.csv."),
            "failures" => ("Failed antennas", "How much worse the score is without each antenna, with its standard error over the seeds."),
            _ => continue,
        };
        sections.push(Section { title: title.into(), text: text.into(), table: shown(table), ..Section::default() });
    }
    if !found.verdict.text.is_empty() {
        let messages = found.verdict.text.lines().map(str::to_owned).collect();
        sections.push(Section { title: "Quality".into(), messages, ..Section::default() });
    }
    sections.push(Section {
        title: "Command and messages".into(),
        commands: vec![from.1.command_line.clone()],
        messages: notes.iter().take(20).map(|(note, n)| format!("{n} trials: {note}")).collect(),
        ..Section::default()
    });
    page(&Report {
        title: plan.title.clone(),
        facts: vec![
            fact("cittert", env!("CARGO_PKG_VERSION").into()),
            fact("configuration", from.0.display().to_string()),
            fact("points", plan.study.setups.len().to_string()),
            fact("seeds", plan.study.seeds.len().to_string()),
            fact("trials", all.done.len().to_string()),
        ],
        verdict: found.sentences.clone(),
        highlights: figures,
        sections,
        ..Report::default()
    })
}
