//! Draws the pictures of the pages on physics: results of cittert as lines, results of independent software as dots.
//!
//! `cargo run --example figures` writes them into docs/algorithms/img. It reads the reference tables in tests/oracle. `cargo run --release
//! --example figures tracer` measures the time of the tracer and draws it, and `figures scenes` draws the scenes that ship.

mod atmosphere;
mod dielectrics;
mod measured;
mod scenes;
mod surfaces;
mod tracer;
mod volume;

use cittert::plot::{CurveOptions, Series, Style, curves};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use std::collections::BTreeMap;
use std::error::Error;
use std::path::{Path, PathBuf};

/// Points of a line.
pub(crate) type Points = Vec<(f64, f64)>;
/// The result of drawing.
pub(crate) type Drawn<T = ()> = Result<T, Box<dyn Error>>;

fn main() -> Drawn {
    if std::env::args().any(|a| a == "tracer") {
        return tracer::draw();
    }
    if std::env::args().any(|a| a == "scenes") {
        return scenes::draw();
    }
    atmosphere::draw()?;
    dielectrics::draw()?;
    surfaces::draw()?;
    volume::draw()?;
    measured::draw()
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// A row of a reference table.
pub(crate) struct Row(BTreeMap<String, String>);

impl Row {
    pub(crate) fn text(&self, column: &str) -> &str {
        self.0.get(column).map_or("", String::as_str)
    }

    pub(crate) fn number(&self, column: &str) -> f64 {
        self.text(column).parse().unwrap_or(f64::NAN)
    }

    /// True if every column has the given text. Numbers are compared by value.
    pub(crate) fn is(&self, wanted: &[(&str, &str)]) -> bool {
        wanted.iter().all(|(column, text)| {
            let found = self.text(column);
            found == *text || matches!((found.parse::<f64>(), text.parse::<f64>()), (Ok(a), Ok(b)) if a == b)
        })
    }
}

/// A reference table.
pub(crate) fn oracle(name: &str) -> Drawn<Vec<Row>> {
    let path: PathBuf = root().join("tests/oracle").join(name);
    let mut reader = csv::Reader::from_path(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    let rows = reader.deserialize().collect::<Result<Vec<BTreeMap<String, String>>, _>>()?;
    Ok(rows.into_iter().map(Row).collect())
}

/// Points (x, y) of the rows that have the wanted values, in order of x.
pub(crate) fn pick(rows: &[Row], wanted: &[(&str, &str)], x: &str, y: &str) -> Points {
    let mut points: Points = rows.iter().filter(|r| r.is(wanted)).map(|r| (r.number(x), r.number(y))).collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    points
}

/// Values at equal steps.
pub(crate) fn linear(from: f64, to: f64, count: usize) -> Vec<f64> {
    (0..count).map(|i| from + (to - from) * i as f64 / (count - 1) as f64).collect()
}

/// Values at equal ratios.
pub(crate) fn logarithmic(from: f64, to: f64, count: usize) -> Vec<f64> {
    linear(from.ln(), to.ln(), count).into_iter().map(f64::exp).collect()
}

/// The same picture, compressed better, because the repository keeps every version of it.
fn small(png: &[u8]) -> Drawn<Vec<u8>> {
    let picture = image::load_from_memory(png)?.to_rgb8();
    let mut out = Vec::new();
    let encoder = PngEncoder::new_with_quality(&mut out, CompressionType::Best, FilterType::NoFilter);
    encoder.write_image(&picture, picture.width(), picture.height(), ExtendedColorType::Rgb8)?;
    Ok(out)
}

/// A picture of lines with dots in the same colours.
pub(crate) struct Figure {
    options: CurveOptions,
    series: Vec<Series>,
    colors: usize,
}

impl Figure {
    pub(crate) fn new(title: &str, x_label: &str, y_label: &str) -> Self {
        let options = CurveOptions {
            title: title.into(),
            x_label: x_label.into(),
            y_label: y_label.into(),
            width: 760,
            height: 440,
            ..CurveOptions::default()
        };
        Self { options, series: Vec::new(), colors: 0 }
    }

    pub(crate) fn log(mut self, x: bool, y: bool) -> Self {
        (self.options.log_x, self.options.log_y) = (x, y);
        self
    }

    /// Add a line with results of cittert.
    pub(crate) fn ours(&mut self, name: &str, points: Points) {
        self.add(name, points, Style { color: self.colors, line: true, dots: false });
        self.colors += 1;
    }

    /// Add dots with results of other software, in the colour of the line before them.
    pub(crate) fn theirs(&mut self, points: Points) {
        self.add("", points, Style { color: self.colors.saturating_sub(1), line: false, dots: true });
    }

    fn add(&mut self, name: &str, points: Points, style: Style) {
        self.series.push(Series { name: name.into(), points, errors: Vec::new() });
        self.options.styles.push(style);
    }

    pub(crate) fn save(&self, name: &str) -> Drawn {
        if self.series.iter().any(|s| s.points.is_empty()) {
            return Err(format!("{name}: a line or its reference has no points").into());
        }
        let png = small(&curves(&self.series, &self.options)?.png()?)?;
        std::fs::write(root().join("docs/algorithms/img").join(format!("{name}.png")), png)?;
        Ok(())
    }
}
