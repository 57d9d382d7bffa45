//! Comparisons with independent software, and laws.

mod delay;
mod laws;
mod oracle_absorption;
mod oracle_delay;
mod oracle_path;
mod oracle_sky;
mod tables;

/// Rows of an oracle table as text fields.
fn oracle(name: &str) -> Vec<Vec<String>> {
    crate::oracle_tests::Table::open(name).rows.iter().map(|row| row.iter().map(str::to_owned).collect()).collect()
}

fn number(row: &[String], column: usize) -> f64 {
    row[column].parse().unwrap()
}

/// The largest value, and the name of its case.
#[derive(Default)]
struct Worst {
    value: f64,
    what: String,
}

impl Worst {
    fn see(&mut self, value: f64, what: impl FnOnce() -> String) {
        if value.is_nan() || value > self.value {
            *self = Self { value, what: what() };
        }
    }

    fn within(&self, name: &str, limit: f64) {
        println!("{name}: worst {:.3e} ({}), limit {limit:.1e}", self.value, self.what);
        assert!(self.value <= limit, "{name}: {} > {limit} ({})", self.value, self.what);
    }
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    0.5 * (values[(n - 1) / 2] + values[n / 2])
}
