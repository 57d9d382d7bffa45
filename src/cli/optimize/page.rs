//! The page of a search: the layout, its side lobes, and the path there.

use crate::cli::context::Context;
use crate::cli::failure::Result;
use crate::cli::picture;
use crate::design::{PeakFinder, Problem, Searched};
use crate::plot::report::{Figure, Report, Section, Table, page as html};
use crate::plot::{CurveOptions, Series, Style, curves};
use cittert_arrays::ArrayLayout;
use cittert_arrays::quantity::Length;

/// Directions from which the tops of side lobes are searched are this far apart.
const STEP: f64 = 0.1;
/// Side lobes that are drawn, as a share of the highest.
const SHOWN: f64 = 0.25;

/// The page as HTML.
pub(super) fn page(layout: &ArrayLayout, problem: &Problem, found: &Searched, aperture_m: f64, context: &Context) -> Result<String> {
    let figures = problem.evaluator()?.figures(&found.best.xy)?;
    let told: Vec<String> = figures.iter().map(|(name, value)| format!("{name} {value:.5}")).collect();
    let mut finder = PeakFinder::new(&problem.setting.views, problem.setting.ring, STEP);
    let lobes = finder.find(&found.best.xy, SHOWN);
    let tops = lobes.iter().map(|l| (l.direction[0].hypot(l.direction[1]), l.value)).collect();
    let figure = |png: Vec<u8>, caption: &str| Figure { png, caption: caption.into(), file: String::new() };
    let report = Report {
        title: layout.name.clone(),
        verdict: vec![format!(
            "{} elements in {}: {} after {} attempts (found by attempt {}).",
            layout.n_ant(),
            Length(aperture_m),
            told.join(", "),
            found.attempts,
            found.best.attempt + 1
        )],
        highlights: vec![
            figure(picture::layout(layout)?, "The layout."),
            figure(path(found)?, "The score of each attempt, and the best so far."),
            figure(lobe_picture(tops)?, "The tops of the side lobes of the mean beam, by their distance from the beam."),
        ],
        sections: vec![Section {
            title: "Figures".into(),
            table: Table {
                head: vec!["figure".into(), "value".into()],
                rows: figures.iter().map(|(name, value)| vec![(*name).to_owned(), format!("{value:.6}")]).collect(),
            },
            commands: vec![context.command_line.clone()],
            ..Section::default()
        }],
        facts: vec![("History".into(), context.history())],
        ..Report::default()
    };
    Ok(html(&report))
}

/// Scores against attempts.
fn path(found: &Searched) -> Result<Vec<u8>> {
    let points: Vec<(f64, f64)> = found.scores.iter().enumerate().map(|(k, s)| (k as f64 + 1.0, *s)).collect();
    let best = points.iter().scan(f64::INFINITY, |best, (k, s)| {
        *best = best.min(*s);
        Some((*k, *best))
    });
    let series = [
        Series { name: "best so far".into(), points: best.collect(), errors: Vec::new() },
        Series { name: "attempt".into(), points: points.clone(), errors: Vec::new() },
    ];
    let options = CurveOptions {
        title: "The search".into(),
        x_label: "Attempt".into(),
        y_label: "Score".into(),
        styles: vec![Style { color: 0, line: true, dots: false }, Style { color: 1, line: false, dots: true }],
        ..CurveOptions::default()
    };
    Ok(curves(&series, &options)?.png()?)
}

fn lobe_picture(tops: Vec<(f64, f64)>) -> Result<Vec<u8>> {
    let series = Series { name: String::new(), points: tops, errors: Vec::new() };
    let options = CurveOptions {
        title: "Side lobes".into(),
        x_label: "Distance from the beam (wavelengths over the aperture)".into(),
        y_label: "Side lobe over main lobe".into(),
        styles: vec![Style { color: 0, line: false, dots: true }],
        ..CurveOptions::default()
    };
    Ok(curves(&[series], &options)?.png()?)
}
