//! The table of the book.

use rayon::prelude::*;
use std::path::Path;

/// Changes of the result by one constant.
#[derive(Debug, Clone)]
pub struct Row {
    pub name: &'static str,
    pub default: String,
    pub halved: Change,
    pub doubled: Change,
}

/// Absolute change of the result over the cases.
#[derive(Debug, Clone, Copy)]
pub struct Change {
    pub median: f64,
    pub largest: f64,
}

impl Change {
    fn of(mut each: Vec<f64>) -> Self {
        each.sort_by(f64::total_cmp);
        Self { median: 0.5 * (each[(each.len() - 1) / 2] + each[each.len() / 2]), largest: each[each.len() - 1] }
    }
}

/// The sensitivities of one algorithm, and its results with the defaults in all cases.
pub struct Group {
    pub name: &'static str,
    pub usual: Vec<f64>,
    pub rows: Vec<Row>,
}

/// One constant: its name, its default as text, and how a factor of it changes the tuning.
pub struct Knob<T> {
    pub name: &'static str,
    pub default: String,
    pub set: fn(&mut T, f64),
}

/// True where the table is to be written: then every constant meets every case. Otherwise each constant meets one of the cases, a different
/// one from constant to constant, which takes a sixth of the time.
fn writes() -> bool {
    std::env::var("CITTERT_BLESS").is_ok()
}

/// The rows of some constants. `result` gives one number for a case with a tuning; the change is the largest absolute difference from
/// the number with the defaults.
pub fn measure<T: Clone + Default + Send + Sync, C: Sync>(
    name: &'static str,
    cases: &[C],
    knobs: &[Knob<T>],
    result: impl Fn(&C, &T) -> f64 + Sync,
) -> Group {
    let usual: Vec<f64> = cases.par_iter().map(|c| result(c, &T::default())).collect();
    let row = |(number, knob): (usize, &Knob<T>)| {
        let worst = |factor: f64| {
            let mut tuning = T::default();
            (knob.set)(&mut tuning, factor);
            let chosen = cases.par_iter().zip(&usual).enumerate().filter(|(k, _)| writes() || *k == number % cases.len());
            Change::of(chosen.map(|(_, (c, u))| (result(c, &tuning) - u).abs()).collect())
        };
        Row { name: knob.name, default: knob.default.clone(), halved: worst(0.5), doubled: worst(2.0) }
    };
    let rows = knobs.par_iter().enumerate().map(row).collect();
    Group { name, usual, rows }
}

const BEGIN: &str = "<!-- sensitivities -->";
const END: &str = "<!-- end -->";

/// Compare the groups with the tables of the book: no change may be larger than the book states.
pub fn compare(cases: &[&str], groups: &[Group]) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/algorithms/heuristics.md");
    let page = std::fs::read_to_string(&path).unwrap();
    let (from, to) = (page.find(BEGIN).unwrap() + BEGIN.len(), page.find(END).unwrap());
    let rows: Vec<&Row> = groups.iter().flat_map(|g| &g.rows).collect();
    if writes() {
        let mut table = format!("\n| Error with the defaults | {} |\n|---|{}\n", cases.join(" | "), "---|".repeat(cases.len()));
        for g in groups {
            let each: Vec<String> = g.usual.iter().map(|x| format!("{x:.3}")).collect();
            table += &format!("| {} | {} |\n", g.name, each.join(" | "));
        }
        table +=
            "\n| Constant | Default | Change when halved: median, largest | Change when doubled: median, largest |\n|---|---|---|---|\n";
        for r in &rows {
            table += &format!("| `{}` | {} | {} | {} |\n", r.name, r.default, cell(r.halved), cell(r.doubled));
        }
        std::fs::write(&path, format!("{}{table}{}", &page[..from], &page[to..])).unwrap();
        return;
    }
    let stated: Vec<Vec<&str>> =
        page[from..to].lines().filter(|l| l.starts_with("| `")).map(|l| l.trim_matches('|').split('|').map(str::trim).collect()).collect();
    assert_eq!(stated.len(), rows.len(), "the table has other constants: write it anew with CITTERT_BLESS=1");
    for (row, cells) in rows.iter().zip(&stated) {
        assert_eq!((cells[0].trim_matches('`'), cells[1]), (row.name, row.default.as_str()));
        for (measured, cell) in [(row.halved.largest, cells[2]), (row.doubled.largest, cells[3])] {
            let bound: f64 = cell.split(", ").nth(1).unwrap().parse().unwrap();
            // Other processors round the last digits differently, and these digits decide where an iteration stops.
            assert!(measured <= 1.2 * bound + 5e-3, "{}: {measured}, the book states {bound}", row.name);
        }
    }
}

/// Both numbers, the next larger ones of three decimals.
fn cell(x: Change) -> String {
    let up = |x: f64| (x * 1e3).ceil() / 1e3;
    format!("{:.3}, {:.3}", up(x.median), up(x.largest))
}
