//! `compare` for pointing offsets: those that were found against those that are true.

use super::context::Outcome;
use super::failure::{Failure, Result};
use super::text::angle;
use cittert_formats::read_pointings;
use std::path::Path;

/// Compare two tables of pointings. Each true offset is compared with the one found at the nearest time for the antenna of that name.
///
/// # Errors
/// A file that is no table of pointings, or tables without a common antenna.
pub(super) fn compare(found: &Path, truth: &Path) -> Result<Outcome> {
    let (names, pointings) = read_pointings(found)?;
    let (true_names, truths) = read_pointings(truth)?;
    let (mut errors, mut offsets, mut most, mut over, mut n) = (0.0, 0.0, 0.0_f64, 0.0, 0_usize);
    let mut missing = 0;
    for ((time, ant), t) in truths.antennas.indexed_iter() {
        let Some(index) = names.iter().position(|name| *name == true_names[ant]) else {
            missing += 1;
            continue;
        };
        let at = [pointings.index_at(truths.time_jd[time]), index];
        let f = pointings.antennas[at];
        let d = [f.l - t.l, f.m - t.m];
        errors += d[0] * d[0] + d[1] * d[1];
        offsets += t.l * t.l + t.m * t.m;
        most = most.max(d[0].hypot(d[1]));
        if let Some(sigma) = &pointings.sigma_rad {
            let s = sigma[at];
            over += (d[0] / s[0]).powi(2) + (d[1] / s[1]).powi(2);
        }
        n += 1;
    }
    if n == 0 {
        return Err(Failure::message(format!("{} and {} have no antenna in common", found.display(), truth.display())));
    }
    let rms = |sum: f64| (sum / (2 * n) as f64).sqrt();
    let over_sigma = pointings.sigma_rad.as_ref().map(|_| rms(over));
    let json = serde_json::json!({
        "rms_error_rad": rms(errors), "max_error_rad": most, "rms_truth_rad": rms(offsets), "rms_error_over_sigma": over_sigma,
        "n_compared": n, "n_missing": missing,
    });
    let mut text = format!(
        "pointing errors  rms {} along each axis, largest {}\ntrue offsets     rms {}\noffsets          {n} compared, {missing} missing",
        angle(rms(errors)),
        angle(most),
        angle(rms(offsets))
    );
    if let Some(x) = over_sigma {
        text += &format!("\nuncertainty      the errors are {x:.2} of the stated standard deviations (rms)");
    }
    Ok(Outcome::new(json, text))
}
