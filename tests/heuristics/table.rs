//! The table of the book.

use rayon::prelude::*;
use std::path::Path;

/// Changes of the result by one constant.
#[derive(Debug, Clone)]
pub struct Row {
    pub name: &'static str,
    pub default: String,
    pub halved: f64,
    pub doubled: f64,
}

/// One constant: its name, its default as text, and how a factor of it changes the tuning.
pub struct Knob<T> {
    pub name: &'static str,
    pub default: String,
    pub set: fn(&mut T, f64),
}

/// The rows of some constants. `result` gives one number for a case with a tuning; the change is the largest absolute difference from
/// the number with the defaults.
pub fn measure<T: Clone + Default + Send + Sync, C: Sync>(
    cases: &[C],
    knobs: &[Knob<T>],
    result: impl Fn(&C, &T) -> f64 + Sync,
) -> Vec<Row> {
    let usual: Vec<f64> = cases.par_iter().map(|c| result(c, &T::default())).collect();
    let worst = |knob: &Knob<T>, factor: f64| {
        let mut tuning = T::default();
        (knob.set)(&mut tuning, factor);
        cases.par_iter().zip(&usual).map(|(c, u)| (result(c, &tuning) - u).abs()).reduce(|| 0.0, f64::max)
    };
    knobs.iter().map(|k| Row { name: k.name, default: k.default.clone(), halved: worst(k, 0.5), doubled: worst(k, 2.0) }).collect()
}

const BEGIN: &str = "<!-- sensitivities -->";
const END: &str = "<!-- end -->";

/// Compare rows with the table of the book: no change may be larger than the book states.
pub fn compare(rows: &[Row]) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/algorithms/heuristics.md");
    let page = std::fs::read_to_string(&path).unwrap();
    let (from, to) = (page.find(BEGIN).unwrap() + BEGIN.len(), page.find(END).unwrap());
    if std::env::var("CITTERT_BLESS").is_ok() {
        let mut table = String::from("\n| Constant | Default | Change when halved | Change when doubled |\n|---|---|---|---|\n");
        for r in rows {
            table += &format!("| `{}` | {} | {} | {} |\n", r.name, r.default, rounded_up(r.halved), rounded_up(r.doubled));
        }
        std::fs::write(&path, format!("{}{table}{}", &page[..from], &page[to..])).unwrap();
        return;
    }
    let stated: Vec<Vec<&str>> = page[from..to].lines().skip(3).map(|l| l.trim_matches('|').split('|').map(str::trim).collect()).collect();
    assert_eq!(stated.len(), rows.len(), "the table has other constants: write it anew with CITTERT_BLESS=1");
    for (row, cells) in rows.iter().zip(&stated) {
        assert_eq!((cells[0].trim_matches('`'), cells[1]), (row.name, row.default.as_str()));
        for (measured, cell) in [(row.halved, cells[2]), (row.doubled, cells[3])] {
            let bound: f64 = cell.parse().unwrap();
            // Other processors round the last digits differently, and these digits decide where an iteration stops.
            assert!(measured <= 1.2 * bound + 2e-3, "{}: {measured}, the book states {bound}", row.name);
        }
    }
}

/// The next larger number of three decimals.
fn rounded_up(x: f64) -> String {
    format!("{:.3}", (x * 1e3).ceil() / 1e3)
}
