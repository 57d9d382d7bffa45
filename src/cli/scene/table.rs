//! A table of numbers: CSV for stdout, rows for `--json`, curves for `--plot`.

use crate::cli::context::Outcome;
use crate::cli::failure::{Failure, Result};
use crate::cli::options::OutputArgs;
use crate::plot::{CurveOptions, Series, curves};
use clap::Args;
use serde::Serialize;
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};

/// `--plot`, for every table.
#[derive(Debug, Args)]
pub(super) struct PlotArgs {
    /// Draw the table into this PNG file.
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

    /// Refuse a picture that cannot be written before the table is computed.
    ///
    /// # Errors
    /// As [`OutputArgs::claim`].
    pub(super) fn claim(&self, inputs: impl IntoIterator<Item = impl AsRef<Path>>) -> Result<()> {
        self.output().map_or(Ok(()), |o| o.claim([&o.output], inputs))
    }
}

/// One cell of a table.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub(super) enum Cell {
    /// A name.
    Text(String),
    /// A number.
    Number(f64),
    /// Yes or no.
    Flag(bool),
    /// No value.
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
}

/// Rows under named columns. The first columns are the inputs of a row, the others its results.
#[derive(Debug, Default)]
pub(super) struct Table {
    n_inputs: usize,
    columns: Vec<&'static str>,
    rows: Vec<Vec<Cell>>,
}

/// The picture that `--plot` draws.
#[derive(Debug, Clone, Copy)]
pub(super) struct Picture<'a> {
    /// Title.
    pub(super) title: &'a str,
    /// Columns of the y axis.
    pub(super) columns: &'a [&'static str],
    /// Label of the y axis.
    pub(super) label: &'a str,
}

/// Columns that may be the x axis, with their labels.
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

/// Largest number of lines in one picture.
const MAX_LINES: usize = 12;

/// The text of a CSV file with these records.
///
/// # Errors
/// A record that CSV cannot hold.
pub(super) fn csv_text(records: impl IntoIterator<Item = impl Serialize>) -> Result<String> {
    let failed = |e: &dyn std::fmt::Display| Failure::message(format!("the table cannot be written as CSV: {e}"));
    let mut writer = csv::Writer::from_writer(Vec::new());
    for record in records {
        writer.serialize(record).map_err(|e| failed(&e))?;
    }
    String::from_utf8(writer.into_inner().map_err(|e| failed(&e))?).map_err(|e| failed(&e))
}

impl Table {
    /// Add a row of named inputs and results. The first row fixes the columns of the table.
    ///
    /// # Errors
    /// A row with other columns than the first.
    pub(super) fn push(
        &mut self,
        inputs: impl IntoIterator<Item = (&'static str, Cell)>,
        results: impl IntoIterator<Item = (&'static str, f64)>,
    ) -> Result<()> {
        let (mut columns, mut row): (Vec<_>, Vec<_>) = inputs.into_iter().unzip();
        let n_inputs = columns.len();
        for (name, value) in results {
            columns.push(name);
            row.push(Cell::Number(value));
        }
        if self.rows.is_empty() {
            (self.n_inputs, self.columns) = (n_inputs, columns);
        } else if columns != self.columns {
            return Err(Failure::message(format!("a row has the columns {columns:?}, expected {:?}", self.columns)));
        }
        self.rows.push(row);
        Ok(())
    }

    /// Print as CSV and JSON, and draw the picture that `--plot` asks for.
    ///
    /// # Errors
    /// A picture that cannot be drawn or written.
    pub(super) fn finish(self, plot: &PlotArgs, picture: &Picture<'_>) -> Result<Outcome> {
        let outcome = Outcome::new(self.json(), self.csv()?);
        let Some(out) = plot.output() else { return Ok(outcome) };
        out.write(&out.output, &self.draw(picture)?)?;
        Ok(outcome.wrote(&out.output))
    }

    fn csv(&self) -> Result<String> {
        let names = self.columns.iter().map(|c| (*c).to_owned()).collect::<Vec<_>>();
        csv_text(std::iter::once(names).chain(self.rows.iter().map(|row| row.iter().map(Cell::text).collect())))
    }

    fn json(&self) -> Value {
        let object = |row: &Vec<Cell>| self.columns.iter().zip(row).map(|(name, cell)| ((*name).to_owned(), json!(cell))).collect();
        json!({ "rows": self.rows.iter().map(object).collect::<Vec<Map<_, _>>>() })
    }

    /// Number of different values in a column.
    fn variety(&self, column: usize) -> usize {
        let mut seen: Vec<String> = self.rows.iter().map(|r| r[column].text()).collect();
        seen.sort_unstable();
        seen.dedup();
        seen.len()
    }

    fn draw(&self, picture: &Picture<'_>) -> Result<Vec<u8>> {
        let label_of = |column: usize| X_LABELS.iter().find(|(name, _)| *name == self.columns[column]).map(|(_, label)| *label);
        let variety: Vec<usize> = (0..self.n_inputs).map(|i| self.variety(i)).collect();
        // The longest list is the x axis, and of equally long lists the first.
        let along = (0..self.n_inputs).filter_map(|i| Some((i, label_of(i)?))).max_by_key(|(i, _)| (variety[*i], usize::MAX - i));
        let Some((x, x_label)) = along else { return Err(Failure::message("the table has no column to draw along")) };
        let others: Vec<usize> = (0..self.n_inputs).filter(|i| *i != x && variety[*i] > 1).collect();
        let mut series: Vec<Series> = Vec::new();
        for row in &self.rows {
            for name in picture.columns {
                let Some(y) = self.columns.iter().position(|c| c == name) else {
                    return Err(Failure::message(format!("the table has no column {name:?} to draw")));
                };
                // A missing value has no place in the picture.
                let (Cell::Number(px), Cell::Number(py)) = (&row[x], &row[y]) else { continue };
                let column = (picture.columns.len() > 1).then(|| (*name).to_owned());
                let key = column.into_iter().chain(others.iter().map(|o| self.named(*o, &row[*o]))).collect::<Vec<_>>().join(", ");
                match series.iter_mut().find(|s| s.name == key) {
                    Some(line) => line.points.push((*px, *py)),
                    None => series.push(Series { name: key, points: vec![(*px, *py)], errors: Vec::new() }),
                }
                if series.len() > MAX_LINES {
                    let why = format!("the picture would have more than {MAX_LINES} lines; give fewer values for --plot");
                    return Err(Failure::usage(why));
                }
            }
        }
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
            x_label: x_label.to_owned(),
            y_label: picture.label.to_owned(),
            log_x: spread(|p| p.0) > 20.0 && !self.columns[x].ends_with("_deg"),
            log_y: spread(|p| p.1) > 100.0,
            markers: variety[x] <= 60,
            ..CurveOptions::default()
        };
        Ok(curves(&series, &options)?.png()?)
    }

    fn named(&self, column: usize, cell: &Cell) -> String {
        match cell {
            Cell::Text(t) => t.clone(),
            _ => format!("{} {}", self.columns[column], cell.text()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn push(t: &mut Table, model: &str, freq_ghz: f64, tau: f64) {
        t.push([("model", model.into()), ("freq_ghz", freq_ghz.into())], [("tau_np", tau)]).unwrap();
    }

    fn table() -> Table {
        let mut t = Table::default();
        for (model, f, tau) in [("a", 10.0, 1e-7), ("a", 22.235, 0.5), ("b,c", 10.0, 2.0), ("b,c", 22.235, 3.0)] {
            push(&mut t, model, f, tau);
        }
        t
    }

    #[test]
    fn csv_and_json_hold_the_same() {
        let mut t = table();
        assert_eq!(t.csv().unwrap(), "model,freq_ghz,tau_np\na,10,1e-7\na,22.235,0.5\n\"b,c\",10,2\n\"b,c\",22.235,3\n");
        assert_eq!(t.json()["rows"][2]["model"], "b,c");
        assert_eq!(t.json()["rows"][1]["freq_ghz"], 22.235);
        let e = t.push([("model", "a".into())], [("tau_np", 1.0)]).unwrap_err().to_string();
        assert!(e.contains("expected [\"model\", \"freq_ghz\", \"tau_np\"]"), "{e}");
    }

    #[test]
    fn a_picture_has_a_line_for_each_model() {
        let picture = Picture { title: "t", columns: &["tau_np"], label: "depth [Np]" };
        let png = table().draw(&picture).unwrap();
        assert!(image::load_from_memory(&png).unwrap().width() > 400);
        let mut t = Table::default();
        (0..13).for_each(|i| push(&mut t, &format!("m{i}"), 1.0, 1.0));
        assert!(t.draw(&picture).unwrap_err().to_string().contains("more than 12 lines"));
        assert!(table().draw(&Picture { columns: &["tau_db"], ..picture }).is_err());
    }
}
