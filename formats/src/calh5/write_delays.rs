//! Gain tables written as delays.

use super::delays::{extents, windows};
use super::names::CONVENTION_KEYWORD;
use super::write::{Extras, begin, write_data};
use crate::{FormatError, Result};
use cittert_arrays::GainTable;
use ndarray::{Array1, Array2, Array3, Array4};
use num_complex::Complex64;
use std::f64::consts::TAU;
use std::path::Path;

/// Largest rounding error of a gain against the gain of its delay, in modulus and in phase (rad).
const ROUNDING: f64 = 1e-4;

/// Write a table of gains as delays, one for each antenna, interval, feed and spectral window.
///
/// # Errors
/// Gains that are not the gains of a delay, because the modulus is not 1 or the phase is not 0 at frequency 0 (the error names the antenna
/// and what would be lost); or as [`super::write_gains`].
pub fn write_delays(path: &Path, table: &GainTable, overwrite: bool) -> Result<()> {
    table.check().map_err(|e| FormatError::values(path, e))?;
    let table = &table.with_each_feed();
    let windows = windows(&table.spectrum);
    let (n_time, n_ant, _, n_feed) = table.gains.dim();
    let shape = (n_time, n_ant, windows.len(), n_feed);
    let mut delays = Array4::zeros(shape);
    let mut flags = Array4::from_elem(shape, true);
    let mut quality = table.quality.as_ref().map(|_| Array4::zeros(shape));
    for ((time, ant, w, feed), delay) in delays.indexed_iter_mut() {
        let good: Vec<usize> = windows[w].iter().copied().filter(|c| !table.flags[(time, ant, *c, feed)]).collect();
        if let (Some(to), Some(from)) = (&mut quality, &table.quality) {
            to[(time, ant, w, feed)] = windows[w].iter().map(|c| from[(time, ant, *c, feed)]).sum::<f64>() / windows[w].len() as f64;
        }
        if good.is_empty() {
            continue;
        }
        let freq: Vec<f64> = good.iter().map(|c| table.spectrum.freq_hz()[*c]).collect();
        let gains: Vec<Complex64> = good.iter().map(|c| table.gains[(time, ant, *c, feed)]).collect();
        *delay = delay_of(&freq, &gains).map_err(|found| {
            let antenna = &table.layout.antennas()[ant].name;
            let place = format!("antenna {antenna}, interval {time}, feed {}, window {w}", table.feeds[feed]);
            let expected = "gains that are those of a delay, which is all that a table of delays keeps (write gains instead)";
            FormatError::malformed(path, place, expected, found)
        })?;
        flags[(time, ant, w, feed)] = false;
    }
    let total = table.total_quality.as_ref().map(|t| {
        Array3::from_shape_fn((n_time, windows.len(), n_feed), |(i, w, f)| {
            windows[w].iter().map(|c| t[(i, *c, f)]).sum::<f64>() / windows[w].len() as f64
        })
    });
    let out = begin(path, table, overwrite)?;
    out.text("Header/cal_type", "delay")?;
    out.scalar("Header/wide_band", true)?;
    // A table with a range for each window has no channels.
    out.scalar("Header/Nfreqs", 1i64)?;
    out.scalar("Header/Nspws", windows.len() as i64)?;
    out.array("Header/spw_array", Array1::from_iter(0..windows.len() as i64).view())?;
    let (centre, width) = extents(&table.spectrum);
    let ranges = Array2::from_shape_fn((windows.len(), 2), |(w, end)| centre[w] + (end as f64 - 0.5) * width[w]);
    out.array("Header/freq_range", ranges.view())?;
    out.text(&format!("Header/extra_keywords/{CONVENTION_KEYWORD}"), "minus")?;
    write_data(&out, "Data/delays", delays.view(), &Extras { flags, quality, total })?;
    out.finish()
}

/// The delay in s of gains at increasing or decreasing frequencies. The error says why the gains are not those of a delay.
fn delay_of(freq: &[f64], gains: &[Complex64]) -> std::result::Result<f64, String> {
    if let Some(g) = gains.iter().find(|g| (g.norm() - 1.0).abs() > ROUNDING || !g.is_finite()) {
        return Err(format!("an amplitude of {}", g.norm()));
    }
    if freq.len() < 2 {
        return Err("one channel, which shows no delay".into());
    }
    // The unwrapped phases give the slope. The phase at the middle of the band then refines the delay.
    let mut phase = vec![gains[0].arg()];
    for pair in gains.windows(2) {
        phase.push(phase[phase.len() - 1] + (pair[1] * pair[0].conj()).arg());
    }
    let (f, p) = (Array1::from(freq.to_vec()), Array1::from(phase));
    let (mean_f, mean_p) = (f.mean().unwrap_or(0.0), p.mean().unwrap_or(0.0));
    let (df, dp) = (f - mean_f, p - mean_p);
    let coarse = -(&df * &dp).sum() / (&df * &df).sum() / TAU;
    let left = |delay: f64| freq.iter().zip(gains).map(move |(f, g)| g * Complex64::from_polar(1.0, (TAU * f * delay) % TAU));
    let delay = coarse - left(coarse).sum::<Complex64>().arg() / (TAU * mean_f);
    let worst = left(delay).map(|g| g.arg().abs()).fold(0.0, f64::max);
    if worst > ROUNDING {
        return Err(format!("a delay of {coarse:.6e} s with a phase of its own: {worst:.3} rad are left"));
    }
    Ok(delay)
}
