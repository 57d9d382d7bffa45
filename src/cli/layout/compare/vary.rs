//! How the quality of the image changes with the number of elements, with the bandwidth and with lost elements.
//!
//! Each value is a fresh observation of the scene by a part of the layout, with the image of maximum entropy and the comparison of the layout itself.

use super::args::CompareArgs;
use super::design::Design;
use super::score::Score;
use crate::cli::failure::{Context as _, Result};
use crate::cli::run::labels::{brightness, digits, grouped};
use crate::plot::report::{Figure, Section, Table};
use crate::plot::{CurveOptions, Series, curves};
use crate::random::stream;
use cittert_arrays::quantity::Frequency;
use cittert_arrays::{ArrayLayout, FigureOptions};
use rand::seq::SliceRandom;
use serde_json::{Value, json};
use std::path::Path;

/// Fractions of the elements that stay, drawn at random.
const STAY: [f64; 4] = [0.25, 0.5, 0.75, 1.0];
/// Numbers of the most costly elements that are lost.
const LOST: [usize; 4] = [0, 1, 2, 4];
/// Fractions of the channels.
const CHANNELS: [f64; 3] = [0.25, 0.5, 1.0];
/// Fewest elements of which images are made.
const FEWEST: usize = 4;

/// What changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum What {
    Elements,
    Bandwidth,
    Lost,
}

pub(super) const ALL: [What; 3] = [What::Elements, What::Bandwidth, What::Lost];

impl What {
    /// Key in the results, and beginning of the names of files.
    pub(super) fn key(self) -> &'static str {
        match self {
            Self::Elements => "elements",
            Self::Bandwidth => "bandwidth",
            Self::Lost => "lost",
        }
    }

    pub(super) fn title(self) -> &'static str {
        match self {
            Self::Elements => "Quality against the number of elements",
            Self::Bandwidth => "Quality against the bandwidth",
            Self::Lost => "Quality against lost elements",
        }
    }

    fn text(self) -> &'static str {
        match self {
            Self::Elements => "Elements are taken out at random, those of the smaller numbers also from the larger ones.",
            Self::Bandwidth => "The band is narrower around the same centre, with channels of the same width.",
            Self::Lost => "The elements whose loss raises the peak side lobe most are lost first.",
        }
    }

    fn x_label(self) -> &'static str {
        match self {
            Self::Elements => "Number of elements",
            Self::Bandwidth => "Bandwidth (GHz)",
            Self::Lost => "Number of lost elements",
        }
    }
}

/// One observation of a part of a layout.
#[derive(Debug, Clone)]
pub(super) struct Variant {
    /// Value on the x axis.
    pub(super) x: f64,
    /// Name of its layout file in the folder of the layout, without the ending; none for the layout itself.
    pub(super) name: Option<String>,
    pub(super) layout: ArrayLayout,
    pub(super) channels: usize,
    pub(super) bandwidth: Option<Frequency>,
}

impl Variant {
    /// Its layout file in the comparison.
    pub(super) fn layout_file(&self, design: &str) -> String {
        format!("{design}/{}.toml", if self.has_own_layout() { self.name.as_deref().unwrap_or("layout") } else { "layout" })
    }

    /// Whether its layout differs from that of the design.
    pub(super) fn has_own_layout(&self) -> bool {
        self.name.as_ref().is_some_and(|name| !name.starts_with("channels"))
    }

    /// What it is, in the title of a step.
    pub(super) fn told(&self) -> &str {
        self.name.as_deref().unwrap_or("all")
    }
}

/// The quality of the image of one variant.
#[derive(Debug, Clone)]
pub(super) struct Point {
    pub(super) x: f64,
    pub(super) score: Score,
}

/// The variants of a layout; less than two where there is nothing to vary.
///
/// # Errors
/// The figures of the layout without single elements cannot be computed.
pub(super) fn variants(what: What, design: &Design, args: &CompareArgs) -> Result<Vec<Variant>> {
    let (layout, f, n) = (&design.layout, &args.figures, design.layout.n_ant());
    let whole = |x: f64| Variant { x, name: None, layout: layout.clone(), channels: f.channels, bandwidth: f.bandwidth };
    let part = |x: f64, name: String, kept: &[usize]| -> Result<Variant> {
        let antennas = kept.iter().map(|k| layout.antennas()[*k].clone()).collect();
        let part = ArrayLayout::from_data(format!("{} {name}", layout.name), layout.frame, antennas).context(&design.given)?;
        Ok(Variant { layout: part, name: Some(name), ..whole(x) })
    };
    match what {
        What::Elements => {
            let mut order: Vec<usize> = (0..n).collect();
            order.shuffle(&mut stream(args.observed.seed, "elements of a comparison", 0));
            let mut counts: Vec<usize> = STAY.iter().map(|s| (s * n as f64).round() as usize).filter(|k| *k >= FEWEST.min(n)).collect();
            counts.dedup();
            let one = |count: usize| {
                let mut kept = order[..count].to_vec();
                kept.sort_unstable();
                if count == n { Ok(whole(n as f64)) } else { part(count as f64, format!("elements-{count}"), &kept) }
            };
            counts.into_iter().map(one).collect()
        }
        What::Bandwidth => {
            let Some(width) = f.bandwidth else { return Ok(Vec::new()) };
            let mut counts: Vec<usize> = CHANNELS.iter().map(|c| ((c * f.channels as f64).round() as usize).max(1)).collect();
            counts.dedup();
            let of = |count: usize| {
                let narrow = Frequency(width.si() * count as f64 / f.channels as f64);
                let name = (count < f.channels).then(|| format!("channels-{count}"));
                Variant { name, channels: count, bandwidth: Some(narrow), ..whole(narrow.si() / 1e9) }
            };
            Ok(counts.into_iter().map(of).collect())
        }
        What::Lost => {
            if n < FEWEST + 1 {
                return Ok(Vec::new());
            }
            let options = FigureOptions { within: f.within, aperture: f.aperture, ..FigureOptions::default() };
            let ranking = layout.figures_with_losses(args.freq.si(), &options, false).context(&design.given)?.ranking;
            let one = |lost: usize| {
                let gone: Vec<usize> = ranking.iter().take(lost).map(|r| r.0).collect();
                let kept: Vec<usize> = (0..n).filter(|k| !gone.contains(k)).collect();
                if lost == 0 { Ok(whole(0.0)) } else { part(lost as f64, format!("lost-{lost}"), &kept) }
            };
            LOST.into_iter().filter(|lost| n - lost >= FEWEST).map(one).collect()
        }
    }
}

/// The names of all files that variants leave in the folder of a layout.
pub(super) fn names(design: &Design) -> Vec<String> {
    let n = design.layout.n_ant();
    let counts = STAY.iter().map(|s| format!("elements-{}", (s * n as f64).round()));
    let lost = LOST.iter().map(|l| format!("lost-{l}"));
    counts.chain(lost).map(|name| format!("{}/{name}.toml", design.name)).collect()
}

/// The picture of one kind of variation.
pub(super) fn file(what: What) -> String {
    format!("{}.png", what.key())
}

/// The section of the page: a table and a plot, with a column and a line for each layout.
///
/// # Errors
/// The picture cannot be written.
pub(super) fn section(what: What, designs: &[Design], points: &[Vec<Point>], folder: &Path) -> Result<Section> {
    let series: Vec<Series> = designs
        .iter()
        .zip(points)
        .map(|(d, p)| Series {
            name: d.name.clone(),
            points: p.iter().map(|p| (p.x, p.score.over_grey_card)).collect(),
            errors: Vec::new(),
        })
        .collect();
    let options = CurveOptions {
        title: what.title().into(),
        x_label: what.x_label().into(),
        y_label: "Error over grey card".into(),
        markers: true,
        ..CurveOptions::default()
    };
    let png = curves(&series, &options)?.png()?;
    let file = file(what);
    std::fs::write(folder.join(&file), &png).context(format!("writing {file}"))?;
    let mut values: Vec<f64> = points.iter().flatten().map(|p| p.x).collect();
    values.sort_by(f64::total_cmp);
    values.dedup();
    let cell = |p: &[Point], x: f64| match p.iter().find(|p| p.x.to_bits() == x.to_bits()) {
        Some(p) => format!("{} ({})", digits(p.score.over_grey_card), brightness(p.score.rms, &p.score.unit)),
        None => "-".into(),
    };
    let x_text = |x: f64| if what == What::Bandwidth { digits(x) } else { grouped(x) };
    let rows = values.iter().map(|x| std::iter::once(x_text(*x)).chain(points.iter().map(|p| cell(p, *x))).collect()).collect();
    let head = std::iter::once(what.x_label().to_owned()).chain(designs.iter().map(|d| d.name.clone())).collect();
    let caption = format!("{}: error over grey card of the image of maximum entropy.", what.title());
    Ok(Section {
        title: what.title().into(),
        text: format!("{} The table has the error over grey card of the image of maximum entropy, and its rms error.", what.text()),
        figures: vec![Figure { png, caption, file }],
        table: Table { head, rows },
        ..Section::default()
    })
}

/// The points of one layout as JSON.
pub(super) fn json(points: &[Point]) -> Value {
    let one = |p: &Point| json!({ "x": p.x, "error_over_grey_card": p.score.over_grey_card, "nrmse": p.score.nrmse, "rms_difference": p.score.rms, "unit": p.score.unit });
    points.iter().map(one).collect()
}
