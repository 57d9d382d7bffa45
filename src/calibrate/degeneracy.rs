//! Comparison of gain tables without the phases and scales that calibration cannot determine.
//!
//! A common phase of all antennas is never observable. Where the model is free, a phase gradient over the aperture is not observable
//! either: it shifts the image. Where amplitudes are solved together with the model, their scale is the flux scale. Each of these is
//! removed where the options ask for it. The rest is the error.
//!
//! The gradient is found on the complex ratio of the gains, which has no ambiguity of turns. A search over slopes finds the largest
//! coherent sum. Least squares on the phase of the residual is then repeated until it settles.

use super::lookup::{interval_of, known, nearest_channel};
use crate::linalg::{Cholesky, Matrix};
use crate::{ChainError, Result};
use cittert_arrays::GainTable;
use num_complex::Complex64;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Degeneracies that are removed before the comparison, in addition to the common phase.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CompareOptions {
    /// A phase gradient over the aperture plane, for each interval, channel and feed. It is a shift of the image.
    pub gradient: bool,
    /// One amplitude scale for the whole table: flux scale.
    pub flux_scale: bool,
}

/// The difference of two gain tables.
#[derive(Debug, Clone, PartialEq)]
pub struct GainComparison {
    /// Largest phase difference, rad.
    pub max_abs_phase_rad: f64,
    /// Root mean square phase difference, rad.
    pub rms_phase_rad: f64,
    /// Root mean square relative amplitude difference.
    pub rms_amplitude: f64,
    /// Amplitude scale of the first table divided by that of the second. It is removed if the options say so.
    pub amplitude_scale: f64,
    /// Mean image shift (l, m) of the first table relative to the second, rad, if gradients were removed. For a layout on the Earth it is
    /// the shift at the moment when the plane of the array is seen face on.
    pub shift_rad: Option<(f64, f64)>,
    /// Gains compared.
    pub compared: usize,
    /// Gains flagged in either table or without a partner.
    pub flagged: usize,
}

/// Gain ratios of the antennas of one interval, channel and feed.
pub(super) struct Solution {
    /// Interval, channel and feed in the first table.
    pub(super) at: [usize; 3],
    /// The antennas whose gains are known in both tables.
    pub(super) antennas: Vec<usize>,
    /// Gain of the first table over that of the second \[antenna\].
    pub(super) ratio: Vec<Complex64>,
    place_m: Vec<[f64; 2]>,
}

impl Solution {
    /// Phases of the ratios without the common phase, and without a gradient if `gradient` is true. `slope` is tried first, and then holds the
    /// gradient that was removed, rad/m.
    pub(super) fn phases(&self, gradient: bool, slope: &mut [f64; 2]) -> Vec<f64> {
        let mut turns: Vec<Complex64> = self.ratio.iter().map(|z| z / z.norm()).collect();
        if gradient {
            *slope = remove_gradient(&mut turns, &self.place_m, *slope);
        }
        center(&turns)
    }
}

/// The solutions that two tables have in common: antennas by name, intervals by time, channels by frequency, feeds by name (a joined feed
/// serves all). The number is that of the gains of `found` that are flagged in either table or have no partner.
///
/// # Errors
/// The shapes within a table do not agree, or a feed has no partner.
pub(super) fn solutions(found: &GainTable, truth: &GainTable) -> Result<(Vec<Solution>, usize)> {
    found.check()?;
    truth.check()?;
    let antennas = found.layout.antennas();
    let partner: Vec<Option<usize>> = antennas.iter().map(|a| truth.layout.index_of(&a.name)).collect();
    let channel: Vec<usize> = found.spectrum.freq_hz().iter().map(|f| nearest_channel(truth, *f)).collect();
    let feed: Vec<usize> = (0..found.feeds.len()).map(|f| partner_feed(found, truth, f)).collect::<Result<_>>()?;
    let (mut all, mut without) = (Vec::new(), 0);
    for (t, time_jd) in found.time_jd.iter().enumerate() {
        let other = interval_of(truth, *time_jd);
        for (c, &channel) in channel.iter().enumerate() {
            for (f, &feed) in feed.iter().enumerate() {
                let ratio = |a: usize| Some(known(found, (t, a, c, f))? / known(truth, (other, partner[a]?, channel, feed))?);
                let (both, ratio): (Vec<usize>, Vec<Complex64>) = (0..antennas.len()).filter_map(|a| Some((a, ratio(a)?))).unzip();
                without += antennas.len() - both.len();
                let place_m = both.iter().map(|a| [antennas[*a].position_m[0], antennas[*a].position_m[1]]).collect();
                if !both.is_empty() {
                    all.push(Solution { at: [t, c, f], antennas: both, ratio, place_m });
                }
            }
        }
    }
    Ok((all, without))
}

/// Compare `found` with `truth`: antennas by name, intervals by time, channels by frequency, feeds by name (a joined feed
/// serves all).
///
/// # Errors
/// The shapes within a table do not agree, or no antenna has an unflagged gain in both tables.
pub fn compare_gains(found: &GainTable, truth: &GainTable, options: CompareOptions) -> Result<GainComparison> {
    let (all, flagged) = solutions(found, truth)?;
    let compared: usize = all.iter().map(|s| s.ratio.len()).sum();
    if compared == 0 {
        return Err(ChainError::Incompatible("the gain tables have no unflagged gain of the same antenna in common".into()));
    }
    let log_scale = all.iter().flat_map(|s| &s.ratio).map(|z| z.norm().ln()).sum::<f64>() / compared as f64;
    let scale = log_scale.exp();
    let amplitude = |z: &Complex64| (z.norm() / if options.flux_scale { scale } else { 1.0 } - 1.0).powi(2);
    let amplitude2: f64 = all.iter().flat_map(|s| &s.ratio).map(amplitude).sum();
    let (mut phase2, mut largest) = (0.0, 0.0_f64);
    let (mut shift, mut slope) = ([0.0; 2], [0.0; 2]);
    for s in &all {
        for p in s.phases(options.gradient, &mut slope) {
            phase2 += p * p;
            largest = largest.max(p.abs());
        }
        // A source at l has the phase 2 pi u l on a baseline u = x2 - x1, which is -2 pi x l / lambda on an antenna.
        let wave_m = cittert_arrays::SPEED_OF_LIGHT_M_S / found.spectrum.freq_hz()[s.at[1]];
        (0..2).for_each(|k| shift[k] -= slope[k] * wave_m / TAU / all.len() as f64);
    }
    Ok(GainComparison {
        max_abs_phase_rad: largest,
        rms_phase_rad: (phase2 / compared as f64).sqrt(),
        rms_amplitude: (amplitude2 / compared as f64).sqrt(),
        amplitude_scale: scale,
        shift_rad: options.gradient.then_some((shift[0], shift[1])),
        compared,
        flagged,
    })
}

fn partner_feed(found: &GainTable, truth: &GainTable, feed: usize) -> Result<usize> {
    let name = &found.feeds[feed];
    if let Some(f) = truth.feeds.iter().position(|f| f.eq_ignore_ascii_case(name)) {
        return Ok(f);
    }
    if found.feeds.len() == 1 || truth.feeds.len() == 1 {
        return Ok(0);
    }
    Err(ChainError::Incompatible(format!("feed {name} is not in the other gain table, which has {}", truth.feeds.join(", "))))
}

/// Phases without the common phase. First the phase of the sum is removed, then the mean of the remaining phases.
fn center(residual: &[Complex64]) -> Vec<f64> {
    let mut turn = unit(residual.iter().sum());
    let mut phases = Vec::new();
    for _ in 0..3 {
        phases = residual.iter().map(|z| (z * turn.conj()).arg()).collect();
        turn *= Complex64::from_polar(1.0, phases.iter().sum::<f64>() / phases.len() as f64);
    }
    phases
}

fn unit(z: Complex64) -> Complex64 {
    if z.norm() > 0.0 { z / z.norm() } else { Complex64::new(1.0, 0.0) }
}

fn tilted(residual: &[Complex64], place_m: &[[f64; 2]], slope: [f64; 2]) -> Vec<Complex64> {
    let back = |(z, x): (&Complex64, &[f64; 2])| z * Complex64::from_polar(1.0, -slope[0] * x[0] - slope[1] * x[1]);
    residual.iter().zip(place_m).map(back).collect()
}

/// Mean of the turned gains above which a slope explains them.
const COHERENT: f64 = 0.9;
/// Slopes are searched up to this number of turns over the aperture, which is the number of beams by which the image is shifted.
const NEAR_TURNS: i32 = 8;
/// The same where no slope within `NEAR_TURNS` explains the gains.
const FAR_TURNS: i32 = 48;
/// Antennas that the second search needs. Twelve random phases reach a mean of 0.9 at one of its slopes in about one case of a hundred.
const FEWEST_FAR: usize = 12;

/// Slopes along y that are tried at the same time.
const ABREAST: usize = 4;

/// Turns of the antennas by the slopes of one sign along y: the real and the imaginary parts of each antenna for `ABREAST` slopes that follow each other.
type Turns = [[[f64; ABREAST]; 2]];

/// Antennas that are summed before a sum is given up that can no longer become large enough.
const AT_ONCE: usize = 8;

/// The slope of the largest coherent sum, in steps of a quarter turn over the aperture up to `turns`; `None` where no sum reaches `least`.
fn steepest(residual: &[Complex64], place_m: &[[f64; 2]], (turns, least): (i32, f64)) -> Option<[f64; 2]> {
    let step = [0, 1].map(|k| {
        let (low, high) = place_m.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p[k]), h.max(p[k])));
        if high > low { TAU / 4.0 / (high - low) } else { 0.0 }
    });
    let most = 4 * turns;
    let n = place_m.len().max(1);
    // One list for all slopes along y: threads that each ask for many small ones wait for each other.
    let mut along_y = vec![[[0.0; ABREAST]; 2]; n * (most as usize + 1).div_ceil(ABREAST)];
    along_y.par_chunks_mut(n).enumerate().for_each(|(block, turns)| {
        for ([re, im], p) in turns.iter_mut().zip(place_m) {
            for j in 0..ABREAST {
                let turn = Complex64::from_polar(1.0, -((block * ABREAST + j) as f64) * step[1] * p[1]);
                (re[j], im[j]) = (turn.re, turn.im);
            }
        }
    });
    // The largest sum of the slopes with this index along x, and its index along y.
    let of_x = |(turned, sums): &mut (Vec<Complex64>, Vec<f64>), i: i32| -> (f64, i32) {
        let slope = f64::from(i) * step[0];
        turned.clear();
        turned.extend(residual.iter().zip(place_m).map(|(z, p)| z * Complex64::from_polar(1.0, -slope * p[0])));
        sums.clear();
        sums.resize(2 * most as usize + 1, -1.0);
        for (block, turns) in along_y.chunks(n).enumerate() {
            let Some(both) = coherent(turned, turns, least) else { continue };
            for (j, [up, down]) in (block * ABREAST..=most as usize).zip(both) {
                (sums[most as usize + j], sums[most as usize - j]) = (up, down);
            }
        }
        (-most..).zip(sums).fold((-1.0, 0), |best, (j, sum)| if *sum > best.0 * (1.0 + 1e-12) { (*sum, j) } else { best })
    };
    let room = || (Vec::with_capacity(n), Vec::with_capacity(2 * most as usize + 1));
    let best: Vec<(f64, i32)> = (-most..=most).into_par_iter().map_init(room, of_x).collect();
    let mut slope = None;
    let mut largest = -1.0;
    for (i, (sum, j)) in (-most..).zip(best) {
        if sum > largest * (1.0 + 1e-12) {
            (largest, slope) = (sum, Some([f64::from(i) * step[0], f64::from(j) * step[1]]));
        }
    }
    slope
}

/// Moduli of the sums of turned gains over slopes along y, and over the opposite slopes; `None` where none can reach `least`. The opposite turn is the
/// conjugate one, so that both sums have the same four products.
fn coherent(turned: &[Complex64], turns: &Turns, least: f64) -> Option<[[f64; 2]; ABREAST]> {
    let mut sums = [[0.0; ABREAST]; 4];
    let mut squares = [[0.0; 2]; ABREAST];
    let mut left = turned.len();
    for (turned, turns) in turned.chunks(AT_ONCE).zip(turns.chunks(AT_ONCE)) {
        for (z, [re, im]) in turned.iter().zip(turns) {
            for j in 0..ABREAST {
                sums[0][j] += z.re * re[j];
                sums[1][j] += z.im * im[j];
                sums[2][j] += z.im * re[j];
                sums[3][j] += z.re * im[j];
            }
        }
        let [rr, ii, ir, ri] = sums;
        let square = |re: f64, im: f64| re * re + im * im;
        squares = std::array::from_fn(|j| [square(rr[j] - ii[j], ir[j] + ri[j]), square(rr[j] + ii[j], ir[j] - ri[j])]);
        // Each of the other antennas adds 1 at most.
        left -= turned.len();
        let needed = least - left as f64;
        if needed > 0.0 && squares.as_flattened().iter().all(|s| *s < needed * needed) {
            return None;
        }
    }
    Some(squares.map(|both| both.map(f64::sqrt)))
}

/// Remove the best phase gradient from complex numbers of modulus 1, and return it in rad/m. `guess` is tried before the search.
fn remove_gradient(residual: &mut Vec<Complex64>, place_m: &[[f64; 2]], guess: [f64; 2]) -> [f64; 2] {
    let n = residual.len() as f64;
    let coherence = |slope: [f64; 2]| tilted(residual, place_m, slope).iter().sum::<Complex64>().norm() / n;
    let mut slope = guess;
    if coherence(slope) < COHERENT {
        slope =
            steepest(residual, place_m, (NEAR_TURNS, 0.0)).filter(|s| coherence(*s) > coherence(guess) * (1.0 + 1e-12)).unwrap_or(guess);
        // A strong error can move the image by many beams. Among so many slopes a few antennas agree by chance with one of them.
        if coherence(slope) < COHERENT && residual.len() >= FEWEST_FAR {
            let least = COHERENT * n * (1.0 - 1e-9);
            slope = steepest(residual, place_m, (FAR_TURNS, least)).filter(|s| coherence(*s) > COHERENT).unwrap_or(slope);
        }
    }
    for _ in 0..20 {
        let phases = center(&tilted(residual, place_m, slope));
        let change = plane_fit(&phases, place_m);
        slope = [slope[0] + change[0], slope[1] + change[1]];
        let reach = place_m.iter().map(|p| (p[0] * change[0]).abs() + (p[1] * change[1]).abs()).fold(0.0, f64::max);
        if reach < 1e-12 {
            break;
        }
    }
    *residual = tilted(residual, place_m, slope);
    slope
}

/// Least squares slopes of phases over positions. The slope is zero along a direction in which the positions do not extend.
fn plane_fit(phases: &[f64], place_m: &[[f64; 2]]) -> [f64; 2] {
    let n = phases.len() as f64;
    let mean = [0, 1].map(|k| place_m.iter().map(|p| p[k]).sum::<f64>() / n);
    let mut a = Matrix::zeros(2, 2);
    let mut b = [0.0; 2];
    for (phase, p) in phases.iter().zip(place_m) {
        let d = [p[0] - mean[0], p[1] - mean[1]];
        for i in 0..2 {
            b[i] += d[i] * phase;
            for j in 0..2 {
                a[(i, j)] += d[i] * d[j];
            }
        }
    }
    // A very small damping selects the smallest slope for antennas on a line.
    let trace = a[(0, 0)] + a[(1, 1)];
    (0..2).for_each(|i| a[(i, i)] += 1e-12 * trace);
    Cholesky::new(&a).map_or([0.0; 2], |c| {
        let x = c.solve(&b);
        [x[0], x[1]]
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::closure::testdata::{Scene, T0_JD, cis, random_phases};

    fn table(n: usize, times: usize) -> GainTable {
        let h = Scene::point(n, 1).header();
        let time_jd = (0..times).map(|t| T0_JD + t as f64 * 1e-3).collect();
        GainTable::unity(h.layout, h.spectrum, vec!["I".into()], time_jd, vec![80.0; times]).unwrap()
    }

    fn fill(t: &mut GainTable, gain: impl Fn(usize, usize, [f64; 3]) -> Complex64) {
        let places: Vec<[f64; 3]> = t.layout.antennas().iter().map(|a| a.position_m).collect();
        for ((time, a, _, _), g) in t.gains.indexed_iter_mut() {
            *g = gain(time, a, places[a]);
        }
    }

    const NONE: CompareOptions = CompareOptions { gradient: false, flux_scale: false };
    const ALL: CompareOptions = CompareOptions { gradient: true, flux_scale: true };

    #[test]
    fn a_common_phase_of_each_interval_is_no_difference() {
        let (mut a, mut b) = (table(9, 4), table(9, 4));
        let phase = random_phases(36, 3.0, 1);
        fill(&mut a, |t, p, _| cis(phase[t * 9 + p] + 2.5 * t as f64));
        fill(&mut b, |t, p, _| cis(phase[t * 9 + p]));
        let c = compare_gains(&a, &b, NONE).unwrap();
        assert!(c.max_abs_phase_rad < 1e-12 && c.rms_amplitude < 1e-12 && c.compared == 36, "{c:?}");
    }

    #[test]
    fn steep_gradients_are_unwrapped_and_the_shift_is_told() {
        let (l, m) = (1.1e-3, -0.7e-3);
        let wave = cittert_arrays::SPEED_OF_LIGHT_M_S / 1.4e9;
        let (mut a, b) = (table(20, 2), table(20, 2));
        let error = random_phases(20, 0.2, 7);
        fill(&mut a, |_, p, x| cis(-TAU * (x[0] * l + x[1] * m) / wave + error[p] + 1.0) * 1.3);
        let c = compare_gains(&a, &b, ALL).unwrap();
        assert!(c.rms_phase_rad < 0.12 && c.max_abs_phase_rad < 0.4, "{c:?}");
        let shift = c.shift_rad.unwrap();
        assert!((shift.0 - l).abs() < 3e-5 && (shift.1 - m).abs() < 3e-5, "{shift:?}");
        assert!((c.amplitude_scale - 1.3).abs() < 1e-12 && c.rms_amplitude < 1e-12);
        let c = compare_gains(&a, &b, NONE).unwrap();
        assert!(c.rms_phase_rad > 1.0 && (c.rms_amplitude - 0.3).abs() < 1e-12);
    }

    #[test]
    fn a_shift_by_twenty_beams_is_found_and_random_phases_are_left() {
        let (mut a, b) = (table(20, 1), table(20, 1));
        let places: Vec<[f64; 3]> = a.layout.antennas().iter().map(|x| x.position_m).collect();
        let span = |k: usize| places.iter().map(|p| p[k]).fold(f64::MIN, f64::max) - places.iter().map(|p| p[k]).fold(f64::MAX, f64::min);
        let (sx, sy) = (19.3 * TAU / span(0), -21.7 * TAU / span(1));
        fill(&mut a, |_, _, x| cis(sx * x[0] + sy * x[1]));
        assert!(compare_gains(&a, &b, ALL).unwrap().rms_phase_rad < 1e-9);
        let random = random_phases(20, 3.1, 4);
        fill(&mut a, |_, p, _| cis(random[p]));
        assert!(compare_gains(&a, &b, ALL).unwrap().rms_phase_rad > 0.8);
    }

    #[test]
    fn flagged_and_foreign_antennas_are_counted() {
        let (mut a, b) = (table(6, 1), table(6, 1));
        a.flags[(0, 2, 0, 0)] = true;
        let c = compare_gains(&a, &b, NONE).unwrap();
        assert_eq!((c.compared, c.flagged), (5, 1));
        a.flags.fill(true);
        assert!(compare_gains(&a, &b, NONE).is_err());
    }
}
