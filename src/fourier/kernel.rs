//! The spreading kernel exp(beta (sqrt(1 - x^2) - 1)) and its grid correction.
//!
//! A visibility is spread over `support` cells of a grid that is `oversampling` times finer than the image needs. The error of a kernel is the
//! size of its aliases at the edge of the image. It is computed from the Fourier transform of the kernel. The support is the smallest one
//! whose error stays below the requested error, with the beta of the smallest error.
//!
//! # Reference
//! Barnett, Magland & af Klinteberg 2019, SIAM J. Sci. Comput. 41, C479 (the kernel);
//! Arras, Reinecke, Westermann & Ensslin 2021, A&A 646, A58 (its use for visibilities).

use super::known::Known;
use super::real::Real;
use super::series::{fit, gauss_legendre, horner};
use std::sync::OnceLock;

/// Widest support in cells.
pub(crate) const WIDEST: usize = 16;

/// A kernel whose error is at most the requested one.
#[derive(Debug, Clone, PartialEq)]
pub struct Kernel {
    /// Number of cells that it covers.
    pub support: usize,
    /// Shape parameter.
    pub beta: f64,
    /// Number of cells of the grid for each cell that the image needs.
    pub oversampling: f64,
    /// Relative error from the aliases at the edge of the image, as an rms over the positions between cells.
    pub error: f64,
    /// Quadrature nodes on half of the support, in units of half the support, and their weights times the kernel.
    nodes: Vec<(f64, f64)>,
}

/// Gauss-Legendre nodes and weights on (0, 1) that are accurate enough for a support. They are computed once, since every search tries dozens
/// of kernels.
fn quadrature(support: usize) -> &'static [(f64, f64)] {
    static ALL: [OnceLock<Vec<(f64, f64)>>; WIDEST + 1] = [const { OnceLock::new() }; WIDEST + 1];
    // The integrand has up to 3.5 * support / 2 periods on half the support. This gives about pi nodes for each period, and some more.
    ALL[support].get_or_init(|| gauss_legendre(6 * support + 32).into_iter().filter(|(x, _)| *x > 0.0).collect())
}

impl Kernel {
    /// `support` is at most [`WIDEST`].
    fn new(support: usize, beta: f64, oversampling: f64) -> Self {
        let mut kernel = Self { support, beta, oversampling, error: 0.0, nodes: quadrature(support).to_vec() };
        let half = support as f64 / 2.0;
        for k in 0..kernel.nodes.len() {
            kernel.nodes[k].1 *= kernel.at(kernel.nodes[k].0 * half);
        }
        kernel.error = kernel.aliases();
        kernel
    }

    /// The narrowest kernel whose error at this oversampling is at most `epsilon`, or `None` if there is none.
    #[must_use]
    pub fn for_error(epsilon: f64, oversampling: f64) -> Option<Self> {
        static KNOWN: Known<(u64, u64), Option<Kernel>> = Known::new();
        KNOWN.get((epsilon.to_bits(), oversampling.to_bits()), || Self::search(epsilon, oversampling))
    }

    fn search(epsilon: f64, oversampling: f64) -> Option<Self> {
        // The error of a kernel of s cells is about exp(-pi s sqrt(1 - 1 / oversampling)), so much narrower kernels need not be tried.
        let reach = -epsilon.ln() / (std::f64::consts::PI * (1.0 - 1.0 / oversampling).sqrt());
        let first = (reach as usize).saturating_sub(2).clamp(2, WIDEST);
        (first..=WIDEST).map(|support| Self::best(support, oversampling)).find(|k| k.error <= epsilon)
    }

    /// The kernel with the beta of the smallest error, found by golden section around the estimate of Barnett et al. 2019, eq. 4.5.
    fn best(support: usize, oversampling: f64) -> Self {
        const GOLDEN: f64 = 0.618_033_988_749_894_9;
        let estimate = std::f64::consts::PI * support as f64 * (1.0 - 0.5 / oversampling);
        let (mut lo, mut hi) = (0.85 * estimate, 1.05 * estimate);
        let at = |beta| Self::new(support, beta, oversampling);
        let (mut a, mut b) = (at(hi - GOLDEN * (hi - lo)), at(lo + GOLDEN * (hi - lo)));
        for _ in 0..9 {
            if a.error < b.error {
                (hi, b) = (b.beta, a);
                a = at(hi - GOLDEN * (hi - lo));
            } else {
                (lo, a) = (a.beta, b);
                b = at(lo + GOLDEN * (hi - lo));
            }
        }
        if a.error < b.error { a } else { b }
    }

    /// The kernel at a distance in cells.
    #[must_use]
    pub fn at(&self, cells: f64) -> f64 {
        let x = 2.0 * cells / self.support as f64;
        let inside = 1.0 - x * x;
        if inside <= 0.0 { 0.0 } else { (self.beta * (inside.sqrt() - 1.0)).exp() }
    }

    /// Its Fourier transform, the integral of the kernel times cos(2 pi f x), with f in cycles per cell.
    #[must_use]
    pub fn transform(&self, frequency: f64) -> f64 {
        let half = self.support as f64 / 2.0;
        let angle = std::f64::consts::TAU * frequency * half;
        self.nodes.iter().map(|(x, w)| w * (angle * x).cos()).sum::<f64>() * 2.0 * half
    }

    /// Rms of the aliases relative to the signal, at the position in the image where it is largest.
    fn aliases(&self) -> f64 {
        let edge = 0.5 / self.oversampling;
        let worst = [0.0, 0.9 * edge, edge].into_iter().map(|x| {
            let power: f64 = [-3.0, -2.0, -1.0, 1.0, 2.0, 3.0].into_iter().map(|k| self.transform(x + k).powi(2)).sum();
            power.sqrt() / self.transform(x).abs()
        });
        worst.fold(0.0, f64::max)
    }

    /// 1 / (transform of the kernel) for the `n` pixels along one side of the image, in a transform of `padded` points.
    pub(crate) fn correction(&self, n: usize, padded: usize) -> Vec<f64> {
        // The transform is even, so only one half is computed.
        let half: Vec<f64> = (0..=n / 2).map(|k| 1.0 / self.transform(k as f64 / padded as f64)).collect();
        (0..n).map(|i| half[i.abs_diff(n / 2)]).collect()
    }
}

/// The kernel as one polynomial for each cell of its support, in the order in which the inner loops read it.
#[derive(Debug, Clone)]
pub(crate) struct KernelTable<T> {
    /// Cells covered.
    pub(crate) support: usize,
    /// `support` rounded up to 4, 8 or 16.
    pub(crate) lanes: usize,
    /// Coefficients \[power, lane\], highest power first, in the variable 2 z - 1.
    pub(crate) coefficients: Vec<T>,
}

impl<T: Real> KernelTable<T> {
    /// Fit each cell of the support to `tolerance`. With 24 coefficients the error is that of rounding, so more are never used.
    pub(crate) fn new(kernel: &Kernel, tolerance: f64) -> Self {
        let support = kernel.support;
        let lanes = if support <= 4 { 4 } else { support.next_power_of_two() };
        let tap = |j: usize, x: f64| kernel.at(j as f64 - support as f64 / 2.0 + (x + 1.0) / 2.0);
        let worst = |n: usize| {
            let errors = (0..support).flat_map(|j| {
                let c = fit(n, |x| tap(j, x));
                (0..=16).map(move |i| f64::from(i) / 8.0 - 1.0).map(move |x| (horner(&c, x) - tap(j, x)).abs())
            });
            errors.fold(0.0, f64::max)
        };
        let n = (2..24).find(|n| worst(*n) <= tolerance).unwrap_or(24);
        let mut coefficients = vec![T::default(); n * lanes];
        for j in 0..support {
            for (power, c) in fit(n, |x| tap(j, x)).into_iter().enumerate() {
                coefficients[(n - 1 - power) * lanes + j] = T::of(c);
            }
        }
        Self { support, lanes, coefficients }
    }

    /// Values on the `L` lanes for a visibility whose first cell lies `z` above the lower end of the kernel, with `z` in \[0, 1\].
    #[inline(always)]
    pub(crate) fn eval<const L: usize, const FUSED: bool>(&self, z: T) -> [T; L] {
        let x = z + z - T::one();
        let mut out = [T::default(); L];
        let (rows, _) = self.coefficients.as_chunks::<L>();
        for row in rows {
            for k in 0..L {
                out[k] = out[k].fma::<FUSED>(x, row[k]);
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_support_grows_by_about_one_cell_a_digit_and_the_error_is_met() {
        let mut last = 0;
        for digits in 2..=12 {
            let k = Kernel::for_error(10f64.powi(-digits), 2.0).unwrap();
            assert!(k.error <= 10f64.powi(-digits));
            assert!(k.support >= last && k.support <= digits as usize + 3, "{digits}: {}", k.support);
            last = k.support;
        }
    }

    #[test]
    fn the_polynomials_follow_the_kernel() {
        let k = Kernel::for_error(1e-10, 2.0).unwrap();
        let table = KernelTable::<f64>::new(&k, 1e-12);
        for i in 0..100 {
            let z = f64::from(i) / 100.0;
            let taps = table.eval::<16, false>(z);
            for (j, tap) in taps.iter().enumerate() {
                let expected = if j < k.support { k.at(j as f64 - k.support as f64 / 2.0 + z) } else { 0.0 };
                assert!((tap - expected).abs() < 2e-12, "{j} {z}");
            }
        }
    }

    #[test]
    fn the_transform_at_zero_is_the_integral() {
        let k = Kernel::for_error(1e-6, 2.0).unwrap();
        let steps = 200_000;
        let h = k.support as f64 / f64::from(steps);
        let sum: f64 = (0..steps).map(|i| k.at((f64::from(i) + 0.5) * h - k.support as f64 / 2.0) * h).sum();
        assert!((k.transform(0.0) - sum).abs() < 1e-9 * sum);
    }
}
