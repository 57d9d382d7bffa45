//! Clark's CLEAN: it finds components among the brightest pixels only, and then subtracts all of them by one exact convolution.
//!
//! A histogram of the residual gives the cut. Pixels above the cut are active. Components are found among the active pixels, and only active
//! pixels near a component are updated, with the inner patch of the beam. The error of this update is at most the component times the largest
//! value of the beam outside the patch. The cut is therefore never below this fraction of the peak. The convolution by FFT then gives the
//! exact residual.
//!
//! # Reference
//! Clark 1980, A&A 89, 377.

use super::minor::{
    Component, Deconvolver, Minor, MinorLimits, MinorReport, MinorStop, Scales, check_beam, check_cycle, largest_where, peak_size,
};
use super::tile_loops::largest;
use super::tiled_beam::TiledBeam;
use super::tuning::CleanTuning;
use crate::Result;
use ndarray::{ArcArray2, Array2, ArrayView1, Axis};
use rayon::prelude::*;

/// Number of bins of the histogram. They have even steps of the logarithm over four decades below the peak.
const BINS: usize = 400;
const DECADES: f64 = 4.0;
/// Bits of a number in single precision behind those that are counted first: 64 steps in each factor of two.
const KEY_SHIFT: u32 = 17;

struct Clark {
    beam: TiledBeam,
    /// Half width of the patch in pixels, and the largest |beam| outside the patch.
    patch: usize,
    outside: f64,
    tuning: CleanTuning,
}

pub(super) fn make(psf: &ArcArray2<f32>, _opts: &Scales, tuning: &CleanTuning) -> Result<Box<dyn Deconvolver>> {
    check_beam(psf.view())?;
    let (n_m, n_l) = psf.dim();
    let side = n_m.max(n_l);
    let patch = ((tuning.clark_patch * side as f64) as usize).max(tuning.clark_patch_least).min(side);
    let far = |at: usize, n: usize| at.abs_diff(n / 2) > patch;
    let outside = largest_where(psf.view(), |(i, j)| far(i, n_m) || far(j, n_l));
    Ok(Box::new(Clark { beam: TiledBeam::new(psf)?, patch, outside: outside.into(), tuning: *tuning }))
}

impl Deconvolver for Clark {
    fn minor(&mut self, cycle: Minor<'_>) -> Result<MinorReport> {
        check_cycle(&cycle, self.beam.shape())?;
        let Minor { residual, mask, limits } = cycle;
        // The spectrum of the beam is made for this cycle only, because the next image of a major cycle needs the memory.
        let mut spectrum = None;
        let mut taken: Vec<Component> = Vec::new();
        let mut peak = peak_size(residual.view(), mask, limits.negative);
        let stop = loop {
            if let Some(stop) = limits.reached(peak, taken.len()) {
                break stop;
            }
            let cut = self.cut(residual, mask, peak, &limits);
            let mut active = Active::new(residual, mask, cut, limits.negative);
            let found = self.among(&mut active, cut, &limits, limits.iterations - taken.len());
            self.beam.subtract(&found, &mut spectrum, residual);
            let after = peak_size(residual.view(), mask, limits.negative);
            if !(after <= self.tuning.minor_divergence * peak) {
                // To add the components again changes the last digits only. A copy of the residual would take the memory of an image.
                let back: Vec<Component> = found.into_iter().map(|c| Component { flux: -c.flux, ..c }).collect();
                self.beam.subtract(&back, &mut spectrum, residual);
                break MinorStop::Diverged;
            }
            taken.extend(found);
            peak = after;
        };
        Ok(MinorReport { stop, components: taken })
    }
}

impl Clark {
    /// The level above which pixels are active.
    fn cut(&self, residual: &Array2<f32>, mask: Option<&Array2<bool>>, peak: f64, limits: &MinorLimits) -> f64 {
        let crowded = crowded((residual, mask, limits.negative), peak, self.tuning.clark_active);
        // The cut stays below the peak, so that at least one component can be found. The bound on the beam outside the patch is
        // ineffective for a grating lobe, which is as high as the main lobe.
        crowded.max(limits.level).max(peak * self.outside.min(0.9)).min(0.95 * peak)
    }

    /// Find components among the active pixels until their peak is at the cut.
    fn among(&self, active: &mut Active, cut: f64, limits: &MinorLimits, most: usize) -> Vec<Component> {
        let mut out = Vec::new();
        while out.len() < most {
            let Some((k, row)) = active.peak() else { break };
            let value = active.values[k];
            if value.abs() <= cut {
                break;
            }
            let flux = limits.gain * value;
            let (row, column) = (active.rows[row].row, active.columns[k] as usize);
            self.subtract(active, row, column, flux);
            out.push(Component::point(row, column, flux));
        }
        out
    }

    fn subtract(&self, active: &mut Active, row: usize, column: usize, flux: f64) {
        let (n_m, n_l) = self.beam.shape();
        let first = active.rows.partition_point(|r| r.row + self.patch < row);
        // Column of the beam for column 0 of the image. A negative number wraps to a number that is larger than any column. The beam is 0 outside
        // its array.
        let shift = (n_l / 2).wrapping_sub(column);
        let rows = active.rows[first..].iter_mut().zip(&mut active.peaks[first..]);
        for (r, peak) in rows.take_while(|(r, _)| r.row <= row + self.patch) {
            let Some(line) = (r.row + n_m / 2).checked_sub(row).filter(|b| *b < n_m) else { continue };
            let line = self.beam.line(line);
            let mut best = (0.0, r.lo);
            for (k, (c, v)) in (r.lo..r.hi).zip(active.columns[r.lo..r.hi].iter().zip(&mut active.values[r.lo..r.hi])) {
                *v -= flux * f64::from(line.get((*c as usize).wrapping_add(shift)).copied().unwrap_or(0.0));
                let size = if active.negative { v.abs() } else { *v };
                if size > best.0 {
                    best = (size, k);
                }
            }
            (*peak, r.peak_at) = best;
        }
    }
}

/// The lowest edge of a bin above which at most `most` pixels lie. The edges have even steps of the logarithm below the peak.
fn crowded((residual, mask, negative): (&Array2<f32>, Option<&Array2<bool>>, bool), peak: f64, most: usize) -> f64 {
    let edge = |k: usize| peak * 10f64.powf(-DECADES * k as f64 / BINS as f64);
    // The largest number in single precision that is not above an edge: the same pixels lie above both.
    let single = |k: usize| {
        let rounded = edge(k) as f32;
        if f64::from(rounded) > edge(k) { rounded.next_down() } else { rounded }
    };
    let size = |v: f32| if negative { v.abs() } else { v };
    let above = |level: f32, each: &mut dyn FnMut(f32), (i, row): (usize, ArrayView1<'_, f32>)| {
        for (j, v) in row.iter().enumerate() {
            if size(*v) > level && mask.is_none_or(|m| m[(i, j)]) {
                each(size(*v));
            }
        }
    };
    // The leading bits of positive numbers have their order. They are counted first, because a logarithm of each pixel takes longer than all else.
    let key = |v: f32| v.to_bits() >> KEY_SHIFT;
    let (least, top) = (single(BINS), key(peak as f32));
    let step = |v: f32| top.saturating_sub(key(v)) as usize;
    let rows = || residual.axis_iter(Axis(0)).into_par_iter().enumerate();
    let count = |mut steps: Vec<usize>, row: (usize, ArrayView1<'_, f32>)| {
        above(least, &mut |v| steps[step(v)] += 1, row);
        steps
    };
    let plus = |mut a: Vec<usize>, b: Vec<usize>| {
        a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        a
    };
    let none = || vec![0; step(least) + 1];
    let mut sums = rows().fold(none, count).reduce(none, plus);
    let mut sum = 0;
    for n in &mut sums {
        sum += *n;
        *n = sum;
    }
    let exactly = |level: f32| {
        let of_row = |row| {
            let mut n = 0;
            above(level, &mut |_| n += 1, row);
            n
        };
        rows().map(of_row).sum::<usize>()
    };
    let holds = |k: &usize| {
        let at = step(single(*k));
        let before = if at == 0 { 0 } else { sums[at - 1] };
        before <= most && (sums[at] <= most || exactly(single(*k)) <= most)
    };
    edge((1..=BINS).take_while(holds).count())
}

/// Active pixels, row by row.
struct Active {
    columns: Vec<u32>,
    values: Vec<f64>,
    rows: Vec<ActiveRow>,
    /// Size of the peak of each row, apart from the rows: all are looked at for each component.
    peaks: Vec<f64>,
    negative: bool,
}

struct ActiveRow {
    row: usize,
    lo: usize,
    hi: usize,
    peak_at: usize,
}

impl Active {
    fn new(residual: &Array2<f32>, mask: Option<&Array2<bool>>, cut: f64, negative: bool) -> Self {
        let bright = |(i, line): (usize, ArrayView1<'_, f32>)| -> Vec<(u32, f64)> {
            let size = |v: f32| f64::from(if negative { v.abs() } else { v });
            let inside = |j: usize| mask.is_none_or(|m| m[(i, j)]);
            line.iter().enumerate().filter(|(j, v)| size(**v) > cut && inside(*j)).map(|(j, v)| (j as u32, f64::from(*v))).collect()
        };
        let lines: Vec<Vec<(u32, f64)>> = residual.axis_iter(Axis(0)).into_par_iter().enumerate().map(bright).collect();
        let mut active = Self { columns: Vec::new(), values: Vec::new(), rows: Vec::new(), peaks: Vec::new(), negative };
        for (row, line) in lines.into_iter().enumerate().filter(|(_, line)| !line.is_empty()) {
            let lo = active.values.len();
            let mut best = (0.0, lo);
            for (column, v) in line {
                let size = if negative { v.abs() } else { v };
                if size > best.0 {
                    best = (size, active.values.len());
                }
                active.columns.push(column);
                active.values.push(v);
            }
            active.rows.push(ActiveRow { row, lo, hi: active.values.len(), peak_at: best.1 });
            active.peaks.push(best.0);
        }
        active
    }

    /// Index of the peak and of its row.
    fn peak(&self) -> Option<(usize, usize)> {
        let top = largest(&self.peaks);
        let row = self.peaks.iter().position(|peak| *peak == top).filter(|_| top > 0.0)?;
        Some((self.rows[row].peak_at, row))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cut_is_that_of_the_logarithm_of_each_pixel() {
        let mut noise = crate::fixtures::Noise(5);
        for (sigma, peak) in [(1.0, 1.0_f32), (1e-3, 0.3), (1e-2, 5e-7), (0.2, 3e4)] {
            let mut residual = Array2::from_shape_fn((70, 90), |_| peak * (sigma * noise.next() as f32).clamp(-0.99, 0.99));
            residual[(3, 4)] = -peak;
            let mask = Array2::from_shape_fn((70, 90), |(i, j)| (i + 2 * j) % 5 != 0 || (i, j) == (3, 4));
            for most in [1, 10, 300, 2000, 10_000] {
                for mask in [None, Some(&mask)] {
                    let peak = f64::from(peak);
                    let mut bins = [0; BINS];
                    for (at, v) in residual.indexed_iter().filter(|(_, v)| f64::from(v.abs()) > peak * 1e-4) {
                        let bin = -(f64::from(v.abs()) / peak).log10() / DECADES * BINS as f64;
                        bins[(bin as usize).min(BINS - 1)] += usize::from(mask.is_none_or(|m| m[at]));
                    }
                    let sums = bins.iter().scan(0, |sum, n| {
                        *sum += n;
                        Some(*sum)
                    });
                    let expected = peak * 10f64.powf(-DECADES * sums.take_while(|sum| *sum <= most).count() as f64 / BINS as f64);
                    assert_eq!(crowded((&residual, mask, true), peak, most), expected, "{sigma} {peak} {most}");
                }
            }
        }
    }
}
