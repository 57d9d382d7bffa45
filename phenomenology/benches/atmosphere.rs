//! Speed of the sky profile, the sky table and the constant-temperature path.
//!
//! If the variable `PYRTLIB_PYTHON` names a Python that has pyrtlib, the bench also prints the time of pyrtlib for the same profile.

use std::hint::black_box;
use std::io::Write;

use cittert_phenomenology::atmosphere::{Atmosphere, Geometry, PathEnds, PathExtent, PathTable, SkyTable, SkyTableOptions};
use criterion::Criterion;

const FREQS: [f64; 10] = [10.0, 19.0, 35.0, 37.0, 89.0, 94.0, 140.0, 183.0, 220.0, 340.0];
const ZENITHS: [f64; 8] = [0.0, 30.0, 45.0, 60.0, 70.0, 75.0, 80.0, 85.0];

fn sky(c: &mut Criterion) {
    let Ok(air) = Atmosphere::reference("mls", "mpm89") else {
        return;
    };
    // Bar: under 10 ms.
    c.bench_function("sky profile, 10 frequencies x 8 angles", |b| {
        b.iter(|| air.sky(black_box(&FREQS), &ZENITHS, Geometry::Plane));
    });
    let options = SkyTableOptions::default();
    c.bench_function("build sky table, 1 frequency", |b| {
        b.iter(|| SkyTable::for_frequencies(&air, black_box(&[94.0]), &options));
    });
    let Ok(table) = SkyTable::for_frequencies(&air, &[94.0], &options) else {
        return;
    };
    // Bar: under 0.1 s.
    c.bench_function("60000 sky temperatures from the table", |b| {
        b.iter(|| (0..60_000).filter_map(|i| table.rayleigh_jeans_k(0, f64::from(black_box(i)) * 1.5e-3).ok()).sum::<f64>());
    });
}

fn path(c: &mut Criterion) {
    let Ok(air) = Atmosphere::reference("mls", "mpm89") else {
        return;
    };
    let Ok(table) = PathTable::new(&air, &[94.0]) else {
        return;
    };
    // Bar: the constant-temperature form is at least 100 times faster than the integral.
    for height in [0.2, 1.0, 5.0] {
        let Ok(ends) = PathEnds::new(height, 0.0, PathExtent::ZenithDeg(60.0)) else {
            return;
        };
        c.bench_function(&format!("path of {height} km, integral"), |b| {
            b.iter(|| air.path(&[94.0], black_box(&ends)));
        });
        c.bench_function(&format!("path of {height} km, constant temperature"), |b| {
            b.iter(|| table.radiation(0, black_box(&ends)));
        });
    }
}

/// The time of pyrtlib for the same frequencies and angles, if it is there.
fn pyrtlib() {
    let Some(python) = std::env::var_os("PYRTLIB_PYTHON") else {
        return;
    };
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/pyrtlib_sky.py");
    let told = match std::process::Command::new(python).arg(script).output() {
        Ok(output) if output.status.success() => format!("{} s", String::from_utf8_lossy(&output.stdout).trim()),
        Ok(output) => format!("failed: {}", String::from_utf8_lossy(&output.stderr).trim()),
        Err(e) => format!("cannot be run: {e}"),
    };
    // A reader that went away is no error.
    let _ = writeln!(std::io::stdout(), "sky profile, 10 frequencies x 8 angles, by pyrtlib: {told}");
}

fn main() {
    let mut criterion = Criterion::default()
        .sample_size(20)
        .warm_up_time(std::time::Duration::from_millis(300))
        .measurement_time(std::time::Duration::from_secs(1))
        .configure_from_args();
    pyrtlib();
    sky(&mut criterion);
    path(&mut criterion);
    criterion.final_summary();
}
