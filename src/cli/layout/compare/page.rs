//! The page and the table of a comparison.

use super::args::CompareArgs;
use super::design::Design;
use super::pictures::Row;
use super::ranking::Ranking;
use super::score::Score;
use super::steps::{IMAGES, Pixels, finest};
use crate::cli::context::Context;
use crate::cli::layout::figures::heading;
use crate::cli::run::command::Done;
use crate::cli::run::labels::{angle, brightness, digits, grouped, length};
use crate::plot::report::{Report, Section, Table, page as html};
use std::fmt::Write;

/// One row of the table: its label, and the text of each layout; none where the figure is unknown.
type Line = (&'static str, fn(&Design) -> Option<String>);

const LINES: [Line; 19] = [
    ("Elements", |d| Some(grouped(d.extent.n_antennas as f64))),
    ("Shortest and longest baseline", |d| Some(format!("{} to {}", length(d.extent.shortest_m), length(d.extent.longest_m)))),
    ("Main lobe (Gaussian fit)", |d| Some(format!("{} x {}", angle(d.figures.bmaj_rad), angle(d.figures.bmin_rad)))),
    ("Width at half power (circle of the same area)", |d| Some(angle(d.figures.half_power_equivalent_rad))),
    ("Peak side lobe", |d| Some(format!("{:.1} dB", d.figures.psl_within_db))),
    ("Range of the side lobes", |d| Some(format!("{} wavelengths over {}", d.figures.within, length(d.figures.aperture.diameter_m)))),
    ("Rms of the side lobes", |d| Some(format!("{} %", digits(100.0 * d.figures.rms_sidelobe_within)))),
    ("Peak side lobe of the whole field", |d| Some(format!("{:.1} dB", d.figures.psl_db))),
    ("u-v cells filled", |d| Some(format!("{} %", digits(100.0 * d.figures.uv_fill)))),
    ("Width of a u-v cell", |d| Some(length(d.figures.uv_fill_cell_m))),
    ("Different baselines", |d| Some(grouped(d.figures.unique_baselines as f64))),
    ("Redundancy", |d| Some(digits(d.figures.redundancy))),
    ("Evenness, radial and azimuthal", |d| {
        Some(format!("{}, {}", digits(d.figures.radial_uniformity), digits(d.figures.azimuthal_uniformity)))
    }),
    ("Largest hole of the u-v plane", |d| Some(length(d.figures.largest_hole_m))),
    ("Largest structure that is seen", |d| Some(angle(d.figures.largest_scale_rad))),
    ("Alias-free field", |d| (!d.figures.ghosts.steps.is_empty()).then(|| angle(d.figures.ghosts.alias_free_field_rad))),
    ("Cable from element to element", |d| Some(length(d.layout.cable_m()))),
    ("Noise in a beam", |d| d.figures.delta_t_k.map(|t| format!("{} K", digits(t)))),
    ("Noise of a point source", |d| d.figures.point_source_jy.map(|s| brightness(s, "Jy"))),
];

/// A column for each layout, a row for each figure that one of them has, and for each kind of image.
pub(super) fn table(designs: &[Design], scores: &[Vec<Score>]) -> Table {
    let mut rows = Vec::new();
    let mut add = |label: String, cells: Vec<Option<String>>| {
        if cells.iter().any(Option::is_some) {
            rows.push(std::iter::once(label).chain(cells.into_iter().map(|c| c.unwrap_or_else(|| "-".into()))).collect());
        }
    };
    for (label, text) in LINES {
        add(label.to_owned(), designs.iter().map(text).collect());
    }
    for made in &IMAGES {
        let name = made.title.to_lowercase().replace("clean", "CLEAN");
        let of = |s: &Vec<Score>, text: fn(&Score) -> String| s.iter().find(|s| s.key == made.key).map(text);
        add(format!("Rms error, {name}"), scores.iter().map(|s| of(s, |s| brightness(s.rms, &s.unit))).collect());
        add(format!("NRMSE, {name}"), scores.iter().map(|s| of(s, |s| digits(s.nrmse))).collect());
        add(format!("Error over grey card, {name}"), scores.iter().map(|s| of(s, |s| digits(s.over_grey_card))).collect());
    }
    Table { head: std::iter::once(String::new()).chain(designs.iter().map(|d| d.name.clone())).collect(), rows }
}

/// The table for a terminal.
pub(super) fn text(table: &Table) -> String {
    let lines: Vec<&Vec<String>> = std::iter::once(&table.head).chain(&table.rows).collect();
    let columns = table.head.len();
    let width = |k: usize| lines.iter().filter_map(|l| l.get(k)).map(|c| c.chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut out = String::new();
    for line in lines {
        let mut row = String::new();
        for (cell, width) in line.iter().zip(&widths) {
            // Writing to a String cannot fail.
            let _ = write!(row, "{cell:width$}  ");
        }
        out += row.trim_end();
        out.push('\n');
    }
    out.trim_end().to_owned()
}

/// Everything that the page tells.
pub(super) struct Told<'a> {
    pub(super) args: &'a CompareArgs,
    pub(super) designs: &'a [Design],
    pub(super) ranking: &'a Ranking,
    pub(super) table: Table,
    pub(super) rows: Vec<Row>,
    /// The sections of what varies.
    pub(super) curves: Vec<Section>,
    pub(super) done: &'a [Done],
    pub(super) pixels: Option<Pixels>,
}

/// The warnings of all steps. One that several steps give is told once, because parts of a layout repeat those of the layout.
fn warnings(done: &[Done]) -> Vec<String> {
    let mut told: Vec<(&str, &str, usize)> = Vec::new();
    for (title, warning) in done.iter().flat_map(|d| d.warnings.iter().map(|w| (d.step.title.as_str(), w.as_str()))) {
        match told.iter_mut().find(|t| t.1 == warning) {
            Some((.., others)) => *others += 1,
            None => told.push((title, warning, 0)),
        }
    }
    let text = |(title, warning, others): (&str, &str, usize)| match others {
        0 => format!("{title}: {warning}"),
        1 => format!("{title}, and one other: {warning}"),
        n => format!("{title}, and {n} others: {warning}"),
    };
    told.into_iter().map(text).collect()
}

/// The page as HTML.
pub(super) fn page(told: Told<'_>, context: &Context) -> String {
    let Told { args, designs, ranking, table, rows, curves, done, pixels } = told;
    let names: Vec<&str> = designs.iter().map(|d| d.name.as_str()).collect();
    let mut verdict = vec![ranking.reason.clone()];
    verdict.push(format!("{} layouts are compared: {}.", designs.len(), names.join(", ")));
    let o = &args.observed;
    if let (Some(p), Some(scene), Some(d)) = (pixels, &o.scene, finest(designs)) {
        let noise = if o.noise { format!("the noise of {} and the seed {}", args.figures.time, o.seed) } else { "no noise".into() };
        verdict.push(format!(
            "All image {} with {noise}, on {} x {} pixels of {}{}.",
            scene.display(),
            p.size.columns,
            p.size.rows,
            angle(p.cell.si()),
            if o.cell.is_none() { format!(", which suit the finest layout, {}", d.name) } else { String::new() }
        ));
    }
    let heading = heading(args.freq, &args.figures, None);
    let all = Section { title: "Figures".into(), text: format!("Figures {}.", heading.trim_end_matches(':')), table, ..Section::default() };
    let mut sections = vec![all];
    let of = |title: &str| done.iter().filter(|d| d.step.section == title).map(|d| d.command.clone()).collect();
    for section in curves {
        sections.push(Section { commands: of(&section.title), ..section });
    }
    for row in rows {
        let commands = of(&row.title);
        sections.push(Section { title: row.title, text: row.text, figures: row.figures, commands, ..Section::default() });
    }
    let warnings = warnings(done);
    let fact = |name: &str, value: String| (name.to_owned(), value);
    let seconds: f64 = done.iter().map(|d| d.seconds).sum();
    let facts = vec![
        fact("Program", format!("cittert {}", env!("CARGO_PKG_VERSION"))),
        fact("Command", context.command_line.clone()),
        fact("Time of the images", format!("{seconds:.1} s")),
        fact("All numbers", "comparison.json, in the folder of this page".into()),
    ];
    let title = format!("{} layouts at {}", designs.len(), args.freq);
    html(&Report { title, verdict, warnings, sections, facts, ..Report::default() })
}
