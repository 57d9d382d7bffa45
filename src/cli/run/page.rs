//! The report of a run: its pictures and numbers in their order.

use super::command::Done;
use super::config::Config;
use crate::cli::context::Context;
use crate::cli::failure::{Context as _, Result};
use crate::cli::text::number;
use crate::plot::report::{Figure, Report, Section, Table, page as html};
use serde_json::Value;
use std::path::Path;

/// Pictures at the top of the report, in this order, if the run made them.
const HIGHLIGHTS: [&str; 7] =
    ["scene.png", "dirty.png", "clean-image.png", "clean-multiscale-image.png", "mem-model.png", "corrupted-like.png", "selfcal-like.png"];

/// The page of a run whose files are in `folder`.
///
/// # Errors
/// A picture that cannot be read.
pub(super) fn page(config: &Config, path: &Path, done: &[Done], folder: &Path, context: &Context) -> Result<String> {
    let mut report = Report { title: config.title.clone(), ..Report::default() };
    let fact = |name: &str, value: String| (name.to_owned(), value);
    report.facts = vec![
        fact("cittert", env!("CARGO_PKG_VERSION").into()),
        fact("configuration", path.display().to_string()),
        fact("seed", config.seed.to_string()),
        fact("layout", config.layout.name.clone()),
        fact("scene", config.scene.options.file.as_ref().map(|f| f.display().to_string()).unwrap_or_default()),
        fact("command", context.command_line.clone()),
    ];
    for name in HIGHLIGHTS {
        if let Some((png, caption)) = done.iter().filter_map(|d| d.step.picture.as_ref()).find(|p| p.0 == name) {
            report.highlights.push(figure(folder, png, caption)?);
        }
    }
    for d in done {
        if !report.sections.iter().any(|s| s.title == d.step.section) {
            report.sections.push(Section { title: d.step.section.into(), ..Section::default() });
        }
        let Some(section) = report.sections.iter_mut().find(|s| s.title == d.step.section) else { continue };
        section.commands.push(d.command.clone());
        section.messages.extend(d.warnings.iter().cloned());
        if let Some((png, caption)) = &d.step.picture {
            section.figures.push(figure(folder, png, caption)?);
        }
        if !d.step.key.is_empty() {
            rows(&d.step.title, &d.json, &mut section.table);
        }
    }
    let total: f64 = done.iter().map(|d| d.seconds).sum();
    report.sections.push(Section {
        title: "Time".into(),
        text: format!("{total:.1} s in all."),
        table: Table {
            head: vec!["step".into(), "seconds".into()],
            rows: done.iter().map(|d| vec![d.step.title.clone(), format!("{:.2}", d.seconds)]).collect(),
        },
        ..Section::default()
    });
    Ok(html(&report))
}

fn figure(folder: &Path, png: &str, caption: &str) -> Result<Figure> {
    let file = folder.join(png);
    let png = std::fs::read(&file).context(format!("reading {}", file.display()))?;
    Ok(Figure { png, caption: caption.to_owned() })
}

/// One row for each plain number or text of a step's results.
fn rows(title: &str, json: &Value, table: &mut Table) {
    let Value::Object(map) = json else { return };
    for (key, value) in map {
        let text = match value {
            Value::Number(n) => n.as_f64().map_or_else(|| n.to_string(), number),
            Value::String(s) if key != "output" => s.clone(),
            _ => continue,
        };
        table.rows.push(vec![title.to_owned(), key.clone(), text]);
    }
}

/// A line or two for the terminal.
pub(super) fn summary(done: &[Done]) -> String {
    let mut lines = Vec::new();
    for d in done {
        let get = |k: &str| d.json.get(k).and_then(Value::as_f64);
        if let (Some(reason), Some(n)) = (d.json.get("stop_reason").and_then(Value::as_str), get("iterations")) {
            lines.push(format!("{}: {n} iterations, {reason}", d.step.title));
        }
        if let (Some(nrmse), Some(card)) = (get("nrmse"), get("error_over_grey_card")) {
            lines.push(format!("{}: NRMSE {nrmse:.4}, error over grey card {card:.4}", d.step.title));
        }
    }
    lines.join("\n")
}
