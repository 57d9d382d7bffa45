//! Conversion of rows in memory to rows of a Measurement Set, with the changes of sign.

use super::export::{Plan, Window};
use super::fields::Pointing;
use crate::{FormatError, Result};
use cittert_arrays::{SPEED_OF_LIGHT_M_S, VisibilityBlock};
use ndarray::ArrayView3;
use num_complex::Complex;
use std::f64::consts::TAU;
use std::path::Path;

/// Numbers of data that could not be written unchanged.
#[derive(Debug, Default, Clone, Copy)]
pub(super) struct Counts {
    bad_weights: u64,
    bad_values: u64,
}

impl Counts {
    pub(super) fn notes(self) -> Vec<String> {
        let mut notes = Vec::new();
        if self.bad_weights > 0 {
            notes.push(format!("{} weights were negative or not finite: written as 0 and flagged", self.bad_weights));
        }
        if self.bad_values > 0 {
            notes.push(format!("{} visibilities were not finite: written as 0 and flagged", self.bad_values));
        }
        notes
    }
}

/// Columns of one window of a block, with the cells in sequence: \[row\], \[row, 3\], \[row, pol\] or \[row, chan, pol\].
#[derive(Debug, Default)]
pub(super) struct Values {
    pub(super) ant1: Vec<i32>,
    pub(super) ant2: Vec<i32>,
    pub(super) uvw: Vec<f64>,
    pub(super) vis: Vec<Complex<f32>>,
    pub(super) extras: Vec<Vec<Complex<f32>>>,
    pub(super) flags: Vec<bool>,
    pub(super) weights: Vec<f32>,
    pub(super) weight: Vec<f32>,
    pub(super) sigma: Vec<f32>,
    pub(super) flag_row: Vec<bool>,
    pub(super) weights_vary: bool,
}

/// Changes to one row for the file.
struct Turn {
    /// True where the antennas are exchanged. The products are then exchanged too, and the baseline changes its sign.
    exchange: bool,
    /// The phase of this w (m) is removed.
    stop_w_m: f64,
}

/// One spectral window of a block, with everything needed to write it.
#[derive(Debug)]
pub(super) struct Job<'a, 'e> {
    pub(super) path: &'a Path,
    pub(super) block: &'a VisibilityBlock,
    /// The columns beside the data.
    pub(super) extras: &'a [ArrayView3<'e, Complex<f32>>],
    pub(super) plan: &'a Plan,
    pub(super) window: &'a Window,
    /// Channel centres of the header, Hz.
    pub(super) freq_hz: &'a [f64],
}

impl Job<'_, '_> {
    /// The columns of the window.
    ///
    /// # Errors
    /// A row whose antennas must be exchanged in a set that has only one of the cross products.
    pub(super) fn values(&self, pointing: &[Pointing], counts: &mut Counts) -> Result<Values> {
        let (c, plan) = (&self.block.coverage, self.plan);
        let n = self.block.n_rows() * self.window.channels.len() * plan.products.len();
        let mut out = Values { extras: self.extras.iter().map(|_| Vec::with_capacity(n)).collect(), ..Values::default() };
        out.vis.reserve(n);
        for (row, pointing) in pointing.iter().enumerate() {
            let (a, b) = (plan.antenna_rows[c.ant1[row] as usize], plan.antenna_rows[c.ant2[row] as usize]);
            let turn = Turn { exchange: a > b, stop_w_m: if pointing.stop_w { c.uvw_m[[row, 2]] } else { 0.0 } };
            if turn.exchange && plan.products.iter().any(|p| p.exchanged.is_none()) {
                let what = format!(
                    "row {row} has antenna {a} before {b}: exchanging them needs both cross products, and the set has only one of them"
                );
                return Err(FormatError::unsupported(self.path, what));
            }
            out.ant1.push(a.min(b));
            out.ant2.push(a.max(b));
            out.uvw.extend(baseline([0, 1, 2].map(|k| c.uvw_m[[row, k]]), &turn, pointing.turn_rad));
            self.push_data(&mut out, row, &turn, counts);
            for (column, extra) in out.extras.iter_mut().zip(self.extras) {
                for chan in &self.window.channels {
                    for product in &plan.products {
                        let v = extra[[row, *chan, source(product, &turn)]];
                        let v = if finite(v) { v } else { Complex::default() };
                        column.push(turn.visibility(v, self.freq_hz[*chan], plan.factor[*chan]));
                    }
                }
            }
        }
        Ok(out)
    }

    fn push_data(&self, out: &mut Values, row: usize, turn: &Turn, counts: &mut Counts) {
        let (block, plan) = (self.block, self.plan);
        let begin = out.weights.len();
        for chan in &self.window.channels {
            let factor = plan.factor[*chan];
            for product in &plan.products {
                let i = (row, *chan, source(product, turn));
                let (mut vis, mut flag) = (block.vis[i], block.flags[i]);
                if !finite(vis) {
                    (vis, flag) = (Complex::default(), true);
                    counts.bad_values += 1;
                }
                let mut weight = (f64::from(block.weights[i]) * plan.weight_factor / (factor * factor)) as f32;
                if !(weight >= 0.0 && weight.is_finite()) {
                    (weight, flag) = (0.0, true);
                    counts.bad_weights += 1;
                }
                out.vis.push(turn.visibility(vis, self.freq_hz[*chan], factor));
                out.flags.push(flag);
                out.weights.push(weight);
            }
        }
        out.summarise(begin, plan.products.len());
    }
}

impl Values {
    /// WEIGHT, SIGMA and FLAG_ROW of the row whose data begin at `begin`.
    fn summarise(&mut self, begin: usize, n_pol: usize) {
        let (weights, flags) = (&self.weights[begin..], &self.flags[begin..]);
        self.flag_row.push(flags.iter().all(|f| *f));
        for pol in 0..n_pol {
            let column = || weights.iter().skip(pol).step_by(n_pol).copied();
            let used = column().zip(flags.iter().skip(pol).step_by(n_pol)).filter(|(w, f)| !**f && *w > 0.0).map(|(w, _)| w);
            let (sum, n) = used.fold((0.0_f64, 0_u32), |(s, n), w| (s + f64::from(w), n + 1));
            let first = weights[pol];
            // The mean of equal weights is exactly that weight, because sums of up to 2^29 f32 are exact in f64.
            let mean = if n > 0 { (sum / f64::from(n)) as f32 } else { first };
            self.weights_vary |= column().any(|w| w != first);
            self.weight.push(mean);
            self.sigma.push(if mean > 0.0 { mean.sqrt().recip() } else { 0.0 });
        }
    }
}

fn finite(v: Complex<f32>) -> bool {
    v.re.is_finite() && v.im.is_finite()
}

fn source(product: &super::export::Product, turn: &Turn) -> usize {
    if turn.exchange { product.exchanged.unwrap_or(product.from) } else { product.from }
}

impl Turn {
    /// The visibility for the file. It is conjugated for the convention of the file, and once more where the antennas are exchanged.
    fn visibility(&self, v: Complex<f32>, freq_hz: f64, factor: f64) -> Complex<f32> {
        let mut v = v;
        if self.stop_w_m != 0.0 {
            let phase = -TAU * (self.stop_w_m * freq_hz / SPEED_OF_LIGHT_M_S).fract();
            let turned = Complex::new(f64::from(v.re), f64::from(v.im)) * Complex::cis(phase);
            v = Complex::new(turned.re as f32, turned.im as f32);
        }
        if factor != 1.0 {
            v = Complex::new((f64::from(v.re) * factor) as f32, (f64::from(v.im) * factor) as f32);
        }
        if self.exchange { v } else { v.conj() }
    }
}

/// uvw for the file: rotated about w by the position angle of the frame, and negated unless the antennas are exchanged.
fn baseline(uvw: [f64; 3], turn: &Turn, angle: f64) -> [f64; 3] {
    let (sin, cos) = angle.sin_cos();
    let turned = if angle == 0.0 { uvw } else { [uvw[0] * cos - uvw[1] * sin, uvw[0] * sin + uvw[1] * cos, uvw[2]] };
    if turn.exchange { turned } else { turned.map(|x| 0.0 - x) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_exchanged_baseline_is_the_same_measurement() {
        // V(-u) = conj V(u): on the disk both forms must predict the same visibility of a source.
        let (uvw, l) = ([30.0, -4.0, 2.0], 0.01);
        let vis = |u: f64| Complex::cis((TAU * u * l) as f32);
        for exchange in [false, true] {
            let turn = Turn { exchange, stop_w_m: 0.0 };
            // In memory the row is antenna 1 to 2, or with its antennas the other way round: the same convention either way.
            let disk = baseline(uvw, &turn, 0.0);
            let got = turn.visibility(vis(uvw[0]), 1.0, 1.0);
            let want = vis(disk[0]);
            assert!((got - want).norm() < 1e-6, "{exchange}");
        }
    }

    #[test]
    fn the_phase_of_w_is_taken_off() {
        let turn = Turn { exchange: true, stop_w_m: 7.25 };
        let freq = 1.5e8;
        let v = Complex::cis((TAU * 7.25 * freq / SPEED_OF_LIGHT_M_S) as f32);
        assert!((turn.visibility(v, freq, 1.0) - Complex::new(1.0, 0.0)).norm() < 1e-5);
    }

    #[test]
    fn weight_and_sigma_are_of_the_channels_in_use() {
        let mut v =
            Values { weights: vec![4.0, 1.0, 8.0, 1.0, 0.0, 1.0], flags: vec![false, true, false, true, false, true], ..Values::default() };
        v.summarise(0, 2);
        assert_eq!((v.weight, v.flag_row, v.weights_vary), (vec![6.0, 1.0], vec![false], true));
        assert_eq!(v.sigma, [6.0_f32.sqrt().recip(), 1.0]);
    }
}
