//! Comparisons with independent software, and laws.

mod laws;
mod oracle_absorption;
mod oracle_path;
mod oracle_sky;
mod tables;

/// Rows of an oracle file as text fields, header left out; `None` where the oracle tables
/// are not at hand.
fn oracle(name: &str) -> Option<Vec<Vec<String>>> {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/oracle").join(name);
    let Ok(text) = std::fs::read_to_string(&path) else {
        eprintln!("skipped: no {}", path.display());
        return None;
    };
    let rows: Vec<Vec<String>> =
        text.lines().filter(|line| !line.starts_with('#')).skip(1).map(|line| line.split(',').map(str::to_owned).collect()).collect();
    assert!(!rows.is_empty(), "{name} has no rows");
    Some(rows)
}

fn number(row: &[String], column: usize) -> f64 {
    row[column].parse().unwrap()
}

/// Largest value, and what it belongs to.
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
