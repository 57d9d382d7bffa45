//! A table of numbers: CSV for stdout, rows for `--json`, curves for `--plot`.

use crate::cli::context::Outcome;
use crate::cli::failure::{Failure, Result};
use crate::cli::options::OutputArgs;
use crate::plot::{CurveOptions, Series, curves};
use clap::Args;
use serde_json::{Map, Value};
use std::path::PathBuf;

/// `--plot`, for every table.
#[derive(Debug, Args)]
pub(super) struct PlotArgs {
    /// Draw the table into this PNG.
    #[arg(long, value_name = "PNG")]
    plot: Option<PathBuf>,
    /// Replace a picture that exists.
    #[arg(long, requires = "plot")]
    overwrite: bool,
}

impl PlotArgs {
    fn output(&self) -> Option<OutputArgs> {
        self.plot.as_ref().map(|p| OutputArgs { output: p.clone(), overwrite: self.overwrite })
    }

    /// Refuse a picture that cannot be written before the table is made.
    ///
    /// # Errors
    /// As [`OutputArgs::check`].
    pub(super) fn check(&self) -> Result<()> {
        self.output().map_or(Ok(()), |o| o.check(&o.output))
    }
}

/// What stands in one place of a table.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Cell {
    /// A name.
    Text(String),
    /// A number.
    Number(f64),
    /// Yes or no.
    Flag(bool),
    /// Nothing.
    Absent,
}

impl From<f64> for Cell {
    fn from(x: f64) -> Self {
        Self::Number(x)
    }
}

impl From<&str> for Cell {
    fn from(x: &str) -> Self {
        Self::Text(x.to_owned())
    }
}

impl Cell {
    fn text(&self) -> String {
        match self {
            Self::Text(t) => t.clone(),
            Self::Number(x) if *x == 0.0 || (1e-5..1e15).contains(&x.abs()) => format!("{x}"),
            Self::Number(x) => format!("{x:e}"),
            Self::Flag(f) => f.to_string(),
            Self::Absent => String::new(),
        }
    }

    fn json(&self) -> Value {
        match self {
            Self::Text(t) => Value::from(t.as_str()),
            Self::Number(x) => Value::from(*x),
            Self::Flag(f) => Value::from(*f),
            Self::Absent => Value::Null,
        }
    }
}

/// Rows under named columns; the first columns are what was asked for, the others what came out.
#[derive(Debug)]
pub(super) struct Table {
    inputs: Vec<&'static str>,
    outputs: Vec<&'static str>,
    rows: Vec<Vec<Cell>>,
}

/// What `--plot` draws.
#[derive(Debug, Clone, Copy)]
pub(super) struct Picture<'a> {
    /// Title.
    pub(super) title: &'a str,
    /// Columns drawn upwards.
    pub(super) columns: &'a [&'static str],
    /// Their common label.
    pub(super) label: &'a str,
}

/// Labels of columns that can stand on the x axis.
const X_LABELS: &[(&str, &str)] = &[
    ("freq_ghz", "frequency [GHz]"),
    ("zenith_deg", "zenith angle [deg]"),
    ("angle_deg", "angle from the normal [deg]"),
    ("scattered_deg", "angle of scattering [deg]"),
    ("incidence_deg", "angle of incidence [deg]"),
    ("azimuth_deg", "azimuth between the planes [deg]"),
    ("pressure_hpa", "pressure [hPa]"),
    ("temperature_k", "temperature [K]"),
    ("vapour_g_m3", "vapour density [g/m3]"),
    ("cloud_g_m3", "liquid water [g/m3]"),
    ("ice_g_m3", "ice [g/m3]"),
    ("rain_mm_h", "rain rate [mm/h]"),
    ("salinity_psu", "salinity [psu]"),
    ("moisture", "water fraction"),
    ("density_kg_m3", "dry density [kg/m3]"),
    ("observer_km", "height of the observer [km]"),
    ("target_km", "height of the target [km]"),
    ("length_km", "length of the path [km]"),
];

/// Most lines of one picture.
const MAX_LINES: usize = 12;

impl Table {
    /// An empty table.
    pub(super) fn new(inputs: &[&'static str], outputs: &[&'static str]) -> Self {
        Self { inputs: inputs.to_vec(), outputs: outputs.to_vec(), rows: Vec::new() }
    }

    /// Add a row: a cell for each input, then one for each output.
    pub(super) fn push(&mut self, inputs: Vec<Cell>, outputs: impl IntoIterator<Item = f64>) {
        let mut row = inputs;
        row.extend(outputs.into_iter().map(Cell::Number));
        debug_assert_eq!(row.len(), self.inputs.len() + self.outputs.len());
        self.rows.push(row);
    }

    /// Print as CSV and JSON, and draw if that was asked for.
    ///
    /// # Errors
    /// A picture that cannot be drawn or written.
    pub(super) fn finish(self, plot: &PlotArgs, picture: &Picture<'_>) -> Result<Outcome> {
        let outcome = Outcome::new(self.json(), self.csv()?);
        let Some(out) = plot.output() else { return Ok(outcome) };
        out.check(&out.output)?;
        out.write(&out.output, &self.draw(picture)?)?;
        Ok(outcome.wrote(&out.output))
    }

    fn columns(&self) -> impl Iterator<Item = &'static str> + '_ {
        self.inputs.iter().chain(&self.outputs).copied()
    }

    fn csv(&self) -> Result<String> {
        let mut out = csv::Writer::from_writer(Vec::new());
        let fault = |e: csv::Error| Failure::message(format!("the table cannot be written as CSV: {e}"));
        out.write_record(self.columns()).map_err(fault)?;
        for row in &self.rows {
            out.write_record(row.iter().map(Cell::text)).map_err(fault)?;
        }
        let bytes = out.into_inner().map_err(|e| Failure::message(e.to_string()))?;
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    }

    fn json(&self) -> Value {
        let rows: Vec<Value> = self
            .rows
            .iter()
            .map(|row| Value::Object(self.columns().zip(row).map(|(name, cell)| (name.to_owned(), cell.json())).collect::<Map<_, _>>()))
            .collect();
        serde_json::json!({ "rows": rows })
    }

    /// Number of different values in a column of inputs.
    fn variety(&self, column: usize) -> usize {
        let mut seen: Vec<String> = self.rows.iter().map(|r| r[column].text()).collect();
        seen.sort_unstable();
        seen.dedup();
        seen.len()
    }

    fn draw(&self, picture: &Picture<'_>) -> Result<Vec<u8>> {
        let drawable = |name: &str| X_LABELS.iter().find(|(n, _)| *n == name).map(|(_, label)| *label);
        let variety: Vec<usize> = (0..self.inputs.len()).map(|i| self.variety(i)).collect();
        // The longest list is the x axis; the first of equals.
        let along = (0..self.inputs.len()).filter(|i| drawable(self.inputs[*i]).is_some()).max_by_key(|i| (variety[*i], usize::MAX - i));
        let Some(x) = along else { return Err(Failure::message("the table has no column to draw along")) };
        let others: Vec<usize> = (0..self.inputs.len()).filter(|i| *i != x && variety[*i] > 1).collect();
        let mut lines: Vec<(Vec<String>, Series)> = Vec::new();
        for row in &self.rows {
            for name in picture.columns {
                let Some(y) = self.columns().position(|c| c == *name) else { continue };
                let (Cell::Number(px), Cell::Number(py)) = (&row[x], &row[y]) else { continue };
                let mut key: Vec<String> = others.iter().map(|o| self.named(*o, &row[*o])).collect();
                if picture.columns.len() > 1 {
                    key.insert(0, (*name).to_owned());
                }
                match lines.iter_mut().find(|(k, _)| *k == key) {
                    Some((_, line)) => line.points.push((*px, *py)),
                    None => {
                        let line = Series { name: key.join(", "), points: vec![(*px, *py)], errors: Vec::new() };
                        lines.push((key, line));
                    }
                }
                if lines.len() > MAX_LINES {
                    return Err(Failure::usage(format!(
                        "the picture would have more than {MAX_LINES} lines; give fewer values for --plot"
                    )));
                }
            }
        }
        let mut series: Vec<Series> = lines.into_iter().map(|(_, s)| s).collect();
        for line in &mut series {
            line.points.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        let spread = |pick: fn(&(f64, f64)) -> f64| {
            let values = series.iter().flat_map(|s| &s.points).map(pick).filter(|v| *v != 0.0);
            let (lo, hi) = values.fold((f64::INFINITY, 0.0_f64), |(lo, hi), v| (lo.min(v), hi.max(v)));
            if lo > 0.0 { hi / lo } else { 1.0 }
        };
        let options = CurveOptions {
            title: picture.title.to_owned(),
            x_label: drawable(self.inputs[x]).unwrap_or_default().to_owned(),
            y_label: picture.label.to_owned(),
            log_x: spread(|p| p.0) > 20.0 && !self.inputs[x].ends_with("_deg"),
            log_y: spread(|p| p.1) > 100.0,
            markers: variety[x] <= 60,
            ..CurveOptions::default()
        };
        Ok(curves(&series, &options)?)
    }

    fn named(&self, column: usize, cell: &Cell) -> String {
        match cell {
            Cell::Text(t) => t.clone(),
            _ => format!("{} {}", self.inputs[column], cell.text()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        let mut t = Table::new(&["model", "freq_ghz"], &["tau_np"]);
        for (model, f, tau) in [("a", 10.0, 1e-7), ("a", 22.235, 0.5), ("b,c", 10.0, 2.0), ("b,c", 22.235, 3.0)] {
            t.push(vec![model.into(), f.into()], [tau]);
        }
        t
    }

    #[test]
    fn csv_and_json_hold_the_same() {
        let t = table();
        assert_eq!(t.csv().unwrap(), "model,freq_ghz,tau_np\na,10,1e-7\na,22.235,0.5\n\"b,c\",10,2\n\"b,c\",22.235,3\n");
        assert_eq!(t.json()["rows"][2]["model"], "b,c");
        assert_eq!(t.json()["rows"][1]["freq_ghz"], 22.235);
    }

    #[test]
    fn a_picture_has_a_line_for_each_model() {
        let png = table().draw(&Picture { title: "t", columns: &["tau_np"], label: "depth [Np]" }).unwrap();
        let picture = image::load_from_memory(&png).unwrap();
        assert!(picture.width() > 400);
        let many = Picture { title: "t", columns: &["tau_np"; 1], label: "" };
        let mut t = Table::new(&["model", "freq_ghz"], &["tau_np"]);
        for i in 0..13 {
            t.push(vec![format!("m{i}").as_str().into(), 1.0.into()], [1.0]);
        }
        assert!(t.draw(&many).unwrap_err().to_string().contains("more than 12 lines"));
    }
}
