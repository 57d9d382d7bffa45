//! The report of a run: its verdict, its pictures and its numbers.

use super::command::Done;
use super::config::Config;
use super::labels::{grouped, rows};
use super::verdict::{Results, image_name, step_of, verdict};
use crate::cli::context::Context;
use crate::cli::failure::{Context as _, Result};
use crate::plot::report::{Figure, Finding, Report, Section, Table, page as html};
use serde_json::Value;
use std::path::Path;

/// The page of a run whose files are in `folder`.
///
/// # Errors
/// A picture that cannot be read.
pub(super) fn page(config: &Config, path: &Path, done: &[Done], folder: &Path, context: &Context) -> Result<String> {
    let results = Results(done);
    let findings = all_findings(done, &results);
    let mut report = Report { title: config.title.clone(), verdict: verdict(config, &results, &findings), findings, ..Report::default() };
    let highlights = highlights(done, &results);
    for name in &highlights {
        if let Some((png, caption)) = done.iter().filter_map(|d| d.step.picture.as_ref()).find(|p| p.0 == *name) {
            report.highlights.push(figure(folder, png, caption)?);
        }
    }
    for d in done {
        // The warning of a finding says the same as the finding.
        let own = findings_of(d);
        let new = d.warnings.iter().filter(|w| !own.iter().any(|f| w.contains(&f.says)));
        report.warnings.extend(new.map(|w| format!("{}: {w}", capital(&d.step.title))));
        if !report.sections.iter().any(|s| s.title == d.step.section) {
            report.sections.push(Section { title: d.step.section.into(), ..Section::default() });
        }
        let Some(section) = report.sections.iter_mut().find(|s| s.title == d.step.section) else { continue };
        section.commands.push(d.command.clone());
        // Each picture stands on the page once.
        if let Some((png, caption)) = d.step.picture.as_ref().filter(|p| !highlights.contains(&p.0)) {
            section.figures.push(figure(folder, png, caption)?);
        }
    }
    for section in &mut report.sections {
        section.tables = tables(done, &section.title);
    }
    let total: f64 = done.iter().map(|d| d.seconds).sum();
    let mut slowest: Vec<&Done> = done.iter().filter(|d| !d.step.key.is_empty()).collect();
    slowest.sort_by(|a, b| b.seconds.total_cmp(&a.seconds));
    let fact = |name: &str, value: String| (name.to_owned(), value);
    let time: Vec<String> = slowest.iter().take(3).map(|d| format!("{} {:.1} s", d.step.title, d.seconds)).collect();
    report.facts = vec![
        fact("Program", format!("cittert {}", env!("CARGO_PKG_VERSION"))),
        fact("Configuration", path.display().to_string()),
        fact("Command", context.command_line.clone()),
        fact("Seed", config.seed.to_string()),
        fact("Time", format!("{total:.1} s; the longest steps: {}", time.join(", "))),
        fact("All numbers", "metrics.json, in the folder of this page".into()),
    ];
    Ok(html(&report))
}

fn figure(folder: &Path, png: &str, caption: &str) -> Result<Figure> {
    let file = folder.join(png);
    let bytes = std::fs::read(&file).context(format!("reading {}", file.display()))?;
    Ok(Figure { png: bytes, caption: caption.to_owned(), file: png.to_owned() })
}

/// The three pictures to see first: the truth or the best image, with errors and after self-calibration; or scene, dirty and best image.
fn highlights(done: &[Done], results: &Results<'_>) -> Vec<String> {
    let made = |name: &str| done.iter().filter_map(|d| d.step.picture.as_ref()).any(|p| p.0 == name);
    let picture_of = |best: &str| {
        let own = format!("clean-{best}-image.png");
        if best == "mem" {
            "mem-model.png".into()
        } else if made(&own) {
            own
        } else {
            "clean-image.png".to_owned()
        }
    };
    let best = results.best().map(|b| picture_of(&b)).unwrap_or_default();
    let first = if made("scene-convolved.png") { "scene-convolved.png" } else { "clean-image.png" };
    let wanted = if made("selfcal-image.png") || made("corrupted-image.png") {
        vec![first.to_owned(), "corrupted-image.png".into(), "selfcal-image.png".into()]
    } else {
        vec!["scene.png".to_owned(), "dirty.png".into(), best]
    };
    wanted.into_iter().filter(|name| made(name)).collect()
}

fn capital(text: &str) -> String {
    let mut chars = text.chars();
    chars.next().map(|c| c.to_uppercase().collect::<String>() + chars.as_str()).unwrap_or_default()
}

/// The findings of all steps: those of the best image and of self-calibration come first. Data with errors that were injected on purpose have none: what
/// the errors do is in the verdict.
fn all_findings(done: &[Done], results: &Results<'_>) -> Vec<Finding> {
    let best = results.best().map(|b| step_of(&b)).unwrap_or_default();
    let mut steps: Vec<&Done> = done.iter().filter(|d| d.step.key != "clean.corrupted").collect();
    steps.sort_by_key(|d| match d.step.key.as_str() {
        key if key == best => 0,
        "selfcal" => 1,
        _ => 2,
    });
    steps.into_iter().flat_map(findings_of).collect()
}

/// What a step found, from the objects of its array `findings`.
fn findings_of(d: &Done) -> Vec<Finding> {
    let text = |f: &Value, key: &str| f.get(key).and_then(Value::as_str).unwrap_or_default().to_owned();
    let all = d.json.get("findings").and_then(Value::as_array).map(Vec::as_slice).unwrap_or_default();
    let finding = |f: &Value| Finding { step: d.step.title.clone(), says: text(f, "says"), next: text(f, "next") };
    all.iter().map(finding).filter(|f| !f.says.is_empty()).collect()
}

/// The tables of a section: one for each command, with a column for each of its steps.
fn tables(done: &[Done], section: &str) -> Vec<(String, Table)> {
    let mut groups: Vec<(&str, Vec<&Done>)> = Vec::new();
    for d in done.iter().filter(|d| d.step.section == section && !d.step.key.is_empty()) {
        // Gains and images have different numbers, so they are not compared in one table.
        let command = if d.step.key == "compare.gains" { "gains" } else { d.step.words.first().map_or("", String::as_str) };
        match groups.iter_mut().find(|g| g.0 == command) {
            Some(group) => group.1.push(d),
            None => groups.push((command, vec![d])),
        }
    }
    let several = groups.len() > 1;
    groups
        .into_iter()
        .map(|(command, steps)| (if several { title(command) } else { String::new() }, table(command, &steps)))
        .filter(|t| !t.1.rows.is_empty())
        .collect()
}

/// The heading of the table of a command.
fn title(command: &str) -> String {
    match command {
        "simulate" => "Simulation",
        "mask" => "Cells of the Fourier grid",
        "beam" => "Dirty beam",
        "dirty" => "Dirty image",
        "clean" => "CLEAN",
        "mem" => "Maximum entropy",
        "corrupt" => "Injected errors",
        "selfcal" => "Self-calibration",
        "compare" => "Image against the truth",
        "gains" => "Gains against the truth",
        other => other,
    }
    .to_owned()
}

/// The numbers of some steps of one command, a column for each step.
fn table(command: &str, steps: &[&Done]) -> Table {
    let command = if command == "gains" { "compare" } else { command };
    let columns: Vec<Vec<(&str, String)>> = steps.iter().map(|d| rows(command, &d.json)).collect();
    let mut labels: Vec<&str> = Vec::new();
    columns.iter().flatten().for_each(|(label, _)| {
        if !labels.contains(label) {
            labels.push(label);
        }
    });
    let cell = |column: &[(&str, String)], label: &str| column.iter().find(|r| r.0 == label).map(|r| r.1.clone()).unwrap_or_default();
    let rows =
        labels.iter().map(|label| std::iter::once((*label).to_owned()).chain(columns.iter().map(|c| cell(c, label))).collect()).collect();
    let head = if steps.len() > 1 {
        let name = |d: &&Done| d.step.key.rsplit_once('.').map_or(d.step.key.clone(), |(_, name)| image_name(name));
        std::iter::once(String::new()).chain(steps.iter().map(name)).collect()
    } else {
        Vec::new()
    };
    Table { head, rows }
}

/// A line or two for the terminal.
pub(super) fn summary(done: &[Done]) -> String {
    let mut lines = Vec::new();
    for d in done {
        let get = |k: &str| d.json.get(k).and_then(Value::as_f64);
        if let (Some(reason), Some(n)) = (d.json.get("stop_reason").and_then(Value::as_str), get("iterations")) {
            lines.push(format!("{}: {} iterations, {reason}", d.step.title, grouped(n)));
        }
        if let (Some(nrmse), Some(card)) = (get("nrmse"), get("error_over_grey_card")) {
            lines.push(format!("{}: NRMSE {nrmse:.4}, error over grey card {card:.4}", d.step.title));
        }
    }
    lines.join("\n")
}
