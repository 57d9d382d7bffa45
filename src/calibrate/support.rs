//! A test whether the closure phases support the model, or whether the data could be noise.
//!
//! Self-calibration against a point makes any noise look like a point, since the solved antenna phases align the noise with the model.
//! Antenna phases do not change closure phases. On each triangle the product of the three sums of data times conjugate model has mean
//! zero if the data are noise, and a positive real part if they hold the model, whatever the antenna phases. Under noise the products of
//! different triangles are uncorrelated even if they share a baseline. Their sum over its standard deviation is therefore a significance.
//!
//! A model that was made from the data cannot be tested against the same noise. A second test needs no model: the samples are divided
//! alternately into two halves, and the triangle products of one half are correlated with those of the other. The phases of the model
//! cancel.

use super::normal::NormalEquations;
use super::normal_sums::Cell;
use crate::closure::{n_pairs, pair_index};
use num_complex::Complex64;
use rayon::prelude::*;

/// Significance below which the data do not support the model, in standard deviations of noise. The value is above the usual 3, because
/// sums over few triangles have wide tails, and products of two halves have wider ones.
const MODEL_LIMIT: f64 = 4.0;
const HALVES_LIMIT: f64 = 10.0;
/// Largest number of triangles that are used. If there are more, every n-th interval is used.
const MOST_TRIANGLES: usize = 20_000_000;
/// Closure phases with a larger standard deviation do not enter the misfit of the model, rad.
const CERTAIN_RAD: f64 = 0.5;

/// The comparison of the closure phases of a set with those of a model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClosureSupport {
    /// True where the model was not made from these data, so that it does not share their noise.
    pub independent_model: bool,
    /// Significance of the model in the closure phases, in standard deviations of pure noise. Too large for a model that is
    /// not independent.
    pub model_sigmas: f64,
    /// Significance of any signal in the closure phases, from two halves of the data; `None` where intervals hold single samples.
    pub halves_sigmas: Option<f64>,
    /// Rms difference between the closure phases of data and model beyond noise, rad; `None` where no closure phase is certain enough.
    pub misfit_rad: Option<f64>,
    /// Triangles (of all intervals) that were used.
    pub triangles: usize,
    /// Noise of the samples over the noise of the weights.
    pub noise_scale: f64,
}

impl ClosureSupport {
    /// False where the closure phases are those of noise. The significance of a model that was made from the data counts only where two
    /// halves cannot be compared.
    #[must_use]
    pub fn is_signal(&self) -> bool {
        let model = self.model_sigmas >= MODEL_LIMIT && (self.independent_model || self.halves_sigmas.is_none());
        model || self.halves_sigmas.is_some_and(|z| z >= HALVES_LIMIT)
    }

    /// A sentence for the user if the closure phases are those of noise.
    #[must_use]
    pub fn noise_warning(&self) -> Option<String> {
        (!self.is_signal()).then(|| {
            let halves = self.halves_sigmas.map_or(String::new(), |z| format!(", any signal at {z:.1}"));
            format!(
                "the closure phases do not support the model: they show it at {:.1} sigma{halves}; the data may be noise, and what \
                 self-calibration makes of noise looks like the model it started from",
                self.model_sigmas
            )
        })
    }

    /// A sentence for the user if the closure phases of the model clearly differ from those of the data (more than 0.5 rad rms).
    #[must_use]
    pub fn misfit_warning(&self) -> Option<String> {
        self.misfit_rad.filter(|m| *m > 0.5).map(|m| {
            format!("the model does not explain the closure phases: they differ by {m:.2} rad rms beyond noise; more of the source may be missing from it")
        })
    }
}

#[derive(Default, Clone, Copy)]
struct Sums {
    model: f64,
    model_var: f64,
    halves: f64,
    halves_var: f64,
    /// Sum of 1 - cos over the triangles with little noise, its expected value for noise alone, and the number of these triangles.
    bend: f64,
    bend_noise: f64,
    bend_weight: f64,
    triangles: usize,
}

impl Sums {
    fn plus(self, o: Self) -> Self {
        Self {
            model: self.model + o.model,
            model_var: self.model_var + o.model_var,
            halves: self.halves + o.halves,
            halves_var: self.halves_var + o.halves_var,
            bend: self.bend + o.bend,
            bend_noise: self.bend_noise + o.bend_noise,
            bend_weight: self.bend_weight + o.bend_weight,
            triangles: self.triangles + o.triangles,
        }
    }
}

impl NormalEquations {
    /// Compare the closure phases of the data with those of the model, which is taken to be independent of them.
    #[must_use]
    pub fn closure_support(&self) -> ClosureSupport {
        let n = self.header.layout.n_ant();
        let scale2 = self.noise_scale2();
        let blocks: Vec<&[Cell]> = self.intervals.values().flat_map(|i| i.cells.chunks(n_pairs(n).max(1))).collect();
        let each = n * n.saturating_sub(1) * n.saturating_sub(2) / 6;
        let step = (blocks.len() * each / MOST_TRIANGLES).max(1);
        let chosen: Vec<&[Cell]> = blocks.into_iter().step_by(step).collect();
        let parts: Vec<Sums> = chosen.par_iter().map(|cells| triangles(n, cells, scale2)).collect();
        let s = parts.into_iter().fold(Sums::default(), Sums::plus);
        let ratio = |x: f64, var: f64, power: f64| if var > 0.0 { x / (var.sqrt() * scale2.powf(power)) } else { 0.0 };
        ClosureSupport {
            independent_model: true,
            model_sigmas: ratio(s.model, s.model_var, 1.5),
            halves_sigmas: (s.halves_var > 0.0).then(|| ratio(s.halves, s.halves_var, 3.0)),
            misfit_rad: (s.bend_weight > 0.0).then(|| (2.0 * (s.bend - s.bend_noise).max(0.0) / s.bend_weight).sqrt()),
            triangles: s.triangles,
            noise_scale: scale2.sqrt(),
        }
    }

    /// Variance of the samples within the cells over that of the weights; 1 where too few cells hold several samples.
    pub(crate) fn noise_scale2(&self) -> f64 {
        let (mut scatter, mut freedom) = (0.0, 0.0);
        for c in self.intervals.values().flat_map(|i| &i.cells).filter(|c| c.n > 1 && c.mm > 0.0) {
            scatter += (c.vv - c.vm.norm_sqr() / c.mm).max(0.0);
            freedom += 2.0 * f64::from(c.n - 1);
        }
        if freedom >= 30.0 && scatter > 0.0 { scatter / freedom } else { 1.0 }
    }
}

fn triangles(n: usize, cells: &[Cell], scale2: f64) -> Sums {
    let mut s = Sums::default();
    let at = |p: usize, q: usize| &cells[pair_index(n, p, q)];
    for a in 0..n {
        for b in (a + 1..n).filter(|b| at(a, *b).mm > 0.0) {
            let x = at(a, b);
            for c in (b + 1..n).filter(|c| at(a, *c).mm > 0.0 && at(b, *c).mm > 0.0) {
                let (y, z) = (at(b, c), at(a, c));
                let product = x.vm * y.vm * z.vm.conj();
                s.model += product.re;
                // Each sum has variance mm in each of its two parts: 2 mm 2 mm 2 mm, half of it in the real part.
                s.model_var += 4.0 * x.mm * y.mm * z.mm;
                s.triangles += 1;
                if [x, y, z].iter().all(|c| c.half_mm > 0.0 && c.half_mm < c.mm) {
                    let rest = |c: &Cell| c.vm - c.half_vm;
                    let one: Complex64 = x.half_vm * y.half_vm * z.half_vm.conj();
                    let two: Complex64 = rest(x) * rest(y) * rest(z).conj();
                    s.halves += (one * two.conj()).re;
                    s.halves_var += 32.0 * [x, y, z].iter().map(|c| c.half_mm * (c.mm - c.half_mm)).product::<f64>();
                }
                let variance: f64 = [x, y, z].iter().map(|c| scale2 * c.mm / c.vm.norm_sqr()).sum();
                if variance < CERTAIN_RAD * CERTAIN_RAD {
                    // All triangles with a small standard deviation have equal weights, so that a bright triangle does not hide
                    // disagreement of the others.
                    s.bend += 1.0 - product.re / product.norm();
                    s.bend_noise += 1.0 - (-variance / 2.0).exp();
                    s.bend_weight += 1.0;
                }
            }
        }
    }
    s
}

#[cfg(test)]
mod tests {
    use super::super::{PointModel, SolutionInterval, SolveOptions};
    use super::*;
    use crate::closure::testdata::{Scene, cis, random_phases};
    use crate::progress::Silent;

    fn support(scene: &Scene, phases: bool, options: &SolveOptions) -> ClosureSupport {
        let phase = random_phases(scene.n_ant, if phases { 3.1 } else { 0.0 + 1e-12 }, scene.seed + 7);
        let mut data = scene.set(|_, a, _, _| cis(phase[a]));
        let mut point = PointModel { flux: 1.0, l: 0.0, m: 0.0 };
        NormalEquations::of(&mut data, &mut point, options, &Silent).unwrap().closure_support()
    }

    #[test]
    fn noise_is_told_from_a_source_of_snr_20_per_antenna() {
        for (n, times, solint) in
            [(6, 1, SolutionInterval::Infinite), (10, 12, SolutionInterval::Seconds(30.0)), (27, 4, SolutionInterval::Infinite)]
        {
            let options = SolveOptions { solint, ..SolveOptions::default() };
            let (mut noise_passes, mut source_fails) = (0, 0);
            for seed in 0..100 {
                // All samples of the n - 1 baselines of an antenna together give a signal to noise ratio of 20.
                let sigma = ((n - 1) as f64 * f64::from(times)).sqrt() / 20.0;
                let source = Scene { sigma, seed, ..Scene::point(n, times as usize) };
                let noise = Scene { sources: Vec::new(), ..source.clone() };
                noise_passes += usize::from(support(&noise, false, &options).is_signal());
                let s = support(&source, true, &options);
                source_fails += usize::from(!s.is_signal() || s.misfit_warning().is_some());
            }
            assert!(noise_passes <= 1 && source_fails == 0, "{n} antennas: {noise_passes} {source_fails}");
        }
    }

    #[test]
    fn weights_without_a_scale_do_not_fool_the_test() {
        let options = SolveOptions { solint: SolutionInterval::Infinite, ..SolveOptions::default() };
        for seed in 0..20 {
            let mut noise = Scene { sources: Vec::new(), sigma: 1.0, seed, ..Scene::point(8, 20) }.set(|_, _, _, _| cis(0.0));
            noise.data.weights.fill(1e4);
            let mut point = PointModel { flux: 1.0, l: 0.0, m: 0.0 };
            let s = NormalEquations::of(&mut noise, &mut point, &options, &Silent).unwrap().closure_support();
            assert!(!s.is_signal() && (s.noise_scale / 100.0 - 1.0).abs() < 0.1, "{s:?}");
        }
    }

    #[test]
    fn a_point_does_not_explain_a_resolved_triple() {
        let scene = Scene { sigma: 0.05, sources: vec![(0.0, 0.0, 1.0), (3e-4, 1e-4, 0.9), (-1e-4, 4e-4, 0.8)], ..Scene::point(12, 2) };
        let s = support(&scene, true, &SolveOptions { solint: SolutionInterval::Integration, ..SolveOptions::default() });
        assert!(s.misfit_rad.unwrap() > 0.5, "{s:?}");
    }
}
