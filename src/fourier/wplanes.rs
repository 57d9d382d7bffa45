//! The w term exp(2 pi i w (n - 1)) as a short sum. Each term is a function of w times a function of the pixel.
//!
//! The phase at the middle of the range of n - 1 is applied to the visibility. The rest is exp(i t y), with t in \[-1, 1\] along w and
//! |y| <= X over the image. It has two forms:
//!
//! - In small fields the terms are powers of t, each with a real screen over the image. The screens are those of the Chebyshev
//!   (Jacobi-Anger) expansion, collected by power, so fewer terms are needed than in a Taylor series. A visibility with a small w needs only
//!   the first few powers.
//! - In wide fields the terms are planes of constant w, with the spreading kernel along w (improved w-stacking). The error of the sum over the
//!   planes is that of the kernel. A visibility contributes to as many planes as the kernel is wide.
//!
//! # Reference
//! Arras, Reinecke, Westermann & Ensslin 2021, A&A 646, A58, sect. 3 (planes);
//! Abramowitz & Stegun 1964, 9.1.44-45 (Jacobi-Anger).

use super::kernel::{Kernel, KernelTable};
use super::real::Real;
use super::series::{fit_to, horner};
use std::f64::consts::TAU;

/// Largest number of powers of t.
pub(crate) const MOST_TERMS: usize = 20;
/// Number of starting planes that one tile covers in the form with planes. With more, a tile would not fit into the cache.
pub(crate) const SLAB: usize = 4;

/// The w term of one image and one range of w.
#[derive(Debug, Clone)]
pub(crate) struct WTerm<T> {
    /// Middle of n - 1 over the image.
    pub(crate) nu_mid: f64,
    /// Half the range of n - 1; positive.
    pub(crate) nu_half: f64,
    /// The terms of the sum.
    pub(crate) basis: WBasis<T>,
}

/// The form of the sum.
#[derive(Debug, Clone)]
pub(crate) enum WBasis<T> {
    /// Powers of t = w / w_max.
    Powers {
        /// 1 / w_max, in 1/wavelengths. It is 0 if all w are 0.
        inverse_w: f64,
        /// Largest |t| for which 1, 2, ... powers are accurate enough. There is one entry less than there are screens.
        enough: Vec<f64>,
        /// Polynomial of each power's screen in (n - 1 - nu_mid) / nu_half, constant first.
        screens: Vec<Vec<f64>>,
    },
    /// Planes w_q = first + q step.
    Planes {
        /// w of plane 0, wavelengths.
        first: f64,
        /// Distance between planes, wavelengths.
        step: f64,
        /// Number of planes.
        count: usize,
        /// The kernel along w, always on 16 lanes.
        table: KernelTable<T>,
        /// Polynomial of 1 / (transform of the kernel) in (n - 1 - nu_mid) / nu_half, constant first.
        correction: Vec<f64>,
    },
}

impl<T: Real> WTerm<T> {
    /// One plane, for a transform without the w term.
    pub(crate) fn none() -> Self {
        let basis = WBasis::Powers { inverse_w: 0.0, enough: Vec::new(), screens: vec![vec![1.0]] };
        Self { nu_mid: 0.0, nu_half: 1.0, basis }
    }

    /// The w term for n - 1 in \[`nu_min`, 0\] and |w| <= `w_max` wavelengths, to a relative error of `epsilon`.
    /// `None` if no kernel is accurate enough.
    pub(crate) fn new(nu_min: f64, w_max: f64, epsilon: f64) -> Option<Self> {
        let nu_half = (-nu_min / 2.0).max(f64::MIN_POSITIVE);
        let largest = TAU * w_max * nu_half;
        let kernel = Kernel::for_error(epsilon, 2.0)?;
        let terms = (1..=MOST_TERMS).find(|p| remainder(*p, largest) <= epsilon);
        let basis = match terms {
            Some(terms) if terms <= kernel.support + 2 => powers(terms, largest, w_max, epsilon),
            _ => planes(&kernel, nu_half, w_max, epsilon),
        };
        Some(Self { nu_mid: -nu_half, nu_half, basis })
    }

    /// Where a value of n - 1 lies in its range over the image, -1 to 1.
    pub(crate) fn scaled(&self, depth: f64) -> f64 {
        (depth - self.nu_mid) / self.nu_half
    }

    /// Number of planes or screens.
    #[cfg(test)]
    fn count(&self) -> usize {
        match &self.basis {
            WBasis::Powers { screens, .. } => screens.len(),
            WBasis::Planes { count, .. } => *count,
        }
    }
}

/// Bound on the error of the Jacobi-Anger series with `terms` terms, for |t| <= 1 and |y| <= largest.
pub(super) fn remainder(terms: usize, largest: f64) -> f64 {
    (terms..terms + 12).map(|k| 2.0 * bessel(k, largest).abs()).sum()
}

/// J_k(x).
fn bessel(k: usize, x: f64) -> f64 {
    libm::jn(i32::try_from(k).unwrap_or(i32::MAX), x)
}

fn powers<T>(terms: usize, largest: f64, w_max: f64, epsilon: f64) -> WBasis<T> {
    // chebyshev[k][p]: coefficient of t^p in T_k.
    let mut chebyshev = vec![vec![0.0; terms + 1]; terms.max(2)];
    (chebyshev[0][0], chebyshev[1][1]) = (1.0, 1.0);
    for k in 2..terms {
        for p in 0..=k.min(terms) {
            let raised = if p > 0 { 2.0 * chebyshev[k - 1][p - 1] } else { 0.0 };
            chebyshev[k][p] = raised - chebyshev[k - 2][p];
        }
    }
    let screen = |p: usize, y: f64| -> f64 {
        let orders = (p..terms).step_by(2);
        let term = |k: usize| {
            let sign = if (k - p).is_multiple_of(4) { 1.0 } else { -1.0 };
            let twice = if k == 0 { 1.0 } else { 2.0 };
            sign * twice * bessel(k, y) * chebyshev[k][p]
        };
        orders.map(term).sum()
    };
    let screens: Vec<Vec<f64>> = (0..terms).map(|p| fit_to(0.02 * epsilon, 40, |x| screen(p, x * largest))).collect();
    let peaks: Vec<f64> =
        screens.iter().map(|s| (0..=32).map(|i| horner(s, f64::from(i) / 16.0 - 1.0).abs()).fold(0.0, f64::max)).collect();
    let left_out = |n: usize, t: f64| -> f64 { (n..terms).map(|p| peaks[p] * t.powi(p as i32)).sum() };
    let enough = (1..terms).map(|n| bisect(|t| left_out(n, t) <= 0.5 * epsilon)).collect();
    let inverse_w = if w_max > 0.0 { 1.0 / w_max } else { 0.0 };
    WBasis::Powers { inverse_w, enough, screens }
}

/// The largest t in \[0, 1\] for which `holds` is true, given that it holds up to some t.
fn bisect(holds: impl Fn(f64) -> bool) -> f64 {
    let (mut lo, mut hi) = (0.0, 1.0);
    for _ in 0..40 {
        let mid = 0.5 * (lo + hi);
        if holds(mid) {
            lo = mid;
        } else {
            hi = mid;
        }
    }
    lo
}

fn planes<T: Real>(kernel: &Kernel, nu_half: f64, w_max: f64, epsilon: f64) -> WBasis<T> {
    let edge = 0.5 / kernel.oversampling;
    let step = edge / nu_half;
    let half = kernel.support as f64 / 2.0;
    let below = kernel.support / 2;
    let last_start = (2.0 * w_max / step - half).ceil().max(0.0) as usize + below;
    let correction = fit_to(0.02 * epsilon, 40, |x| 1.0 / kernel.transform(x * edge));
    let narrow = KernelTable::new(kernel, 0.05 * epsilon);
    WBasis::Planes {
        first: -w_max - below as f64 * step,
        step,
        count: last_start + kernel.support + 1,
        table: on_sixteen_lanes(&narrow),
        correction,
    }
}

fn on_sixteen_lanes<T: Real>(table: &KernelTable<T>) -> KernelTable<T> {
    let mut coefficients = Vec::with_capacity(table.coefficients.len() / table.lanes * 16);
    for row in table.coefficients.chunks_exact(table.lanes) {
        coefficients.extend_from_slice(row);
        coefficients.resize(coefficients.len() + 16 - table.lanes, T::default());
    }
    KernelTable { support: table.support, lanes: 16, coefficients }
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_complex::Complex64;

    /// The sum over as many powers as the thresholds require.
    fn sum_of_powers(term: &WTerm<f64>, w: f64, x: f64) -> Complex64 {
        let WBasis::Powers { inverse_w, enough, screens } = &term.basis else { panic!("powers expected") };
        let t = w * inverse_w;
        let used = 1 + enough.iter().filter(|e| t.abs() > **e).count();
        let sum = (0..used).map(|p| Complex64::I.powu(p as u32) * t.powi(p as i32) * horner(&screens[p], x)).sum::<Complex64>();
        sum * Complex64::from_polar(1.0, TAU * w * term.nu_mid)
    }

    #[test]
    fn powers_of_w_give_the_phase_of_the_w_term() {
        let (nu_min, w_max) = (-1.5e-6, 1.4e5);
        for epsilon in [1e-3, 1e-5, 1e-8] {
            let term = WTerm::<f64>::new(nu_min, w_max, epsilon).unwrap();
            let mut worst = 0.0_f64;
            for i in 0..=40 {
                for j in 0..=20 {
                    let (w, x) = (w_max * (f64::from(i) / 20.0 - 1.0), f64::from(j) / 10.0 - 1.0);
                    let exact = Complex64::from_polar(1.0, TAU * w * (term.nu_mid + x * term.nu_half));
                    worst = worst.max((sum_of_powers(&term, w, x) - exact).norm());
                }
            }
            assert!(worst < 2.0 * epsilon, "{epsilon:e}: {worst:e}");
        }
    }

    #[test]
    fn wide_fields_take_planes() {
        let term = WTerm::<f64>::new(-0.1, 1000.0, 1e-5).unwrap();
        assert!(matches!(term.basis, WBasis::Planes { .. }) && (400..440).contains(&term.count()), "{}", term.count());
        assert_eq!(WTerm::<f64>::new(-0.1, 0.0, 1e-5).unwrap().count(), 1);
    }
}
