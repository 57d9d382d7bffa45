//! Exact transforms between small images and few visibilities.
//!
//! exp(2 pi i (u l + v m)) is a product, and the cells lie symmetrically about the centre: the sum over l needs only the cosine of the even
//! part and the sine of the odd part of a row. Both are stored once. For a few hundred visibilities and up to 128 x 128 cells the two small
//! matrix products stay in cache and are faster than gridding.

use cittert_arrays::SkyGrid;
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Columns that a pass of the product computes at once.
const PANEL: usize = 8;

/// A matrix cut into panels of columns: \[panel, row, PANEL\], zeros where there is no column.
#[derive(Debug, Clone)]
struct Panels {
    rows: usize,
    cols: usize,
    data: Vec<f64>,
}

impl Panels {
    fn new(rows: usize, cols: usize, value: impl Fn(usize, usize) -> f64) -> Self {
        let panels = cols.div_ceil(PANEL);
        let mut data = vec![0.0; panels * rows * PANEL];
        for p in 0..panels {
            for r in 0..rows {
                for c in (0..PANEL).filter(|c| p * PANEL + c < cols) {
                    data[(p * rows + r) * PANEL + c] = value(r, p * PANEL + c);
                }
            }
        }
        Self { rows, cols, data }
    }

    /// Columns with those that fill the last panel.
    fn width(&self) -> usize {
        self.cols.next_multiple_of(PANEL)
    }
}

/// Number of rows of the left factor that are multiplied with a panel together. Their sums are independent, so the processor can compute
/// them at the same time.
const ROWS: usize = 4;

/// Some rows of the left factor times a panel. The loops use plain indices, because iterators are not inlined into functions with target
/// features.
#[inline(always)]
fn rows_times_panel<const N: usize, const FUSED: bool>(left: &[f64], k: usize, panel: &[f64], out: &mut [f64], width: usize) {
    let mut sums = [[0.0; PANEL]; N];
    for i in 0..k {
        let b = &panel[i * PANEL..(i + 1) * PANEL];
        for r in 0..N {
            let a = left[r * k + i];
            for c in 0..PANEL {
                sums[r][c] = if FUSED { a.mul_add(b[c], sums[r][c]) } else { sums[r][c] + a * b[c] };
            }
        }
    }
    for r in 0..N {
        out[r * width..r * width + PANEL].copy_from_slice(&sums[r]);
    }
}

/// out \[n, padded cols\] = left \[n, rows\] times right \[rows, cols\].
#[inline(always)]
fn product_with<const FUSED: bool>(left: &[f64], right: &Panels, out: &mut [f64]) {
    let (k, width) = (right.rows, right.width());
    let n = left.len() / k.max(1);
    let mut p = 0;
    while p * PANEL < width {
        let panel = &right.data[p * k * PANEL..(p + 1) * k * PANEL];
        let mut r = 0;
        while r + ROWS <= n {
            rows_times_panel::<ROWS, FUSED>(&left[r * k..], k, panel, &mut out[r * width + p * PANEL..], width);
            r += ROWS;
        }
        while r < n {
            rows_times_panel::<1, FUSED>(&left[r * k..], k, panel, &mut out[r * width + p * PANEL..], width);
            r += 1;
        }
        p += 1;
    }
}

/// The same for machines with AVX2 and fused multiply-add.
///
/// # Safety
/// The machine has them.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn product_fused(left: &[f64], right: &Panels, out: &mut [f64]) {
    product_with::<true>(left, right, out);
}

fn product(fused: bool, left: &[f64], right: &Panels) -> Vec<f64> {
    let mut out = vec![0.0; left.len() / right.rows.max(1) * right.width()];
    #[cfg(target_arch = "x86_64")]
    if fused {
        // SAFETY: `fused` is true only if the machine was found to have these instructions.
        unsafe { product_fused(left, right, &mut out) };
        return out;
    }
    debug_assert!(!fused);
    product_with::<false>(left, right, &mut out);
    out
}

/// The exact transform of a small image.
#[derive(Debug, Clone)]
pub struct SmallDft {
    n_l: usize,
    n_m: usize,
    n_vis: usize,
    /// cos and sin of 2 pi u l of the columns right of the centre: \[half, n\] for images to visibilities, \[n, half\] back.
    cos_l: Panels,
    sin_l: Panels,
    cos_l_back: Panels,
    sin_l_back: Panels,
    /// exp(2 pi i v m), moved by half a cell to where the grid has its zero \[m, n padded\].
    row_phase: Vec<Complex64>,
    fused: bool,
}

impl SmallDft {
    /// The transform of images on `grid` to baselines `uv` \[n\] in wavelengths; an image has an even number of columns. The w term is
    /// left out, so the field must be small.
    #[must_use]
    pub fn new(grid: &SkyGrid, uv: &[[f64; 2]]) -> Self {
        let (n_l, n_m, n_vis) = (grid.n_l, grid.n_m, uv.len());
        let half = n_l.div_ceil(2);
        let dl = grid.l_at(1.0) - grid.l_at(0.0);
        // Column n_l - 1 - h is at -(h + 1/2), and column n_l - half + h' is on the other side. An odd number of columns has one at 0,
        // which counts once.
        let offset = if n_l % 2 == 0 { 0.5 } else { 0.0 };
        let middle = grid.l_at((n_l as f64 - 1.0) / 2.0);
        let turn = |h: usize, k: usize| TAU * (uv[k][0] * dl * (h as f64 + offset)).rem_euclid(1.0);
        let row_phase = (0..n_m)
            .flat_map(|r| uv.iter().map(move |[u, v]| (r, *u, *v)))
            .map(|(r, u, v)| Complex64::from_polar(1.0, TAU * (u * middle + v * grid.m_at(r as f64)).rem_euclid(1.0)))
            .collect();
        Self {
            n_l,
            n_m,
            n_vis,
            cos_l: Panels::new(half, n_vis, |h, k| turn(h, k).cos()),
            sin_l: Panels::new(half, n_vis, |h, k| turn(h, k).sin()),
            cos_l_back: Panels::new(n_vis, half, |k, h| turn(h, k).cos()),
            sin_l_back: Panels::new(n_vis, half, |k, h| turn(h, k).sin()),
            row_phase,
            fused: fused(),
        }
    }

    fn half(&self) -> usize {
        self.n_l.div_ceil(2)
    }

    /// The pair of columns at distance h from the centre: the one with the larger index, and the one with the smaller index.
    fn columns(&self, h: usize) -> (usize, usize) {
        (self.n_l / 2 + h, (self.n_l - 1) / 2 - h)
    }

    /// Visibilities \[n\] of an image \[m * l\] in flux a cell.
    #[must_use]
    pub fn forward(&self, image: &[f64]) -> Vec<Complex64> {
        let half = self.half();
        let (mut even, mut odd) = (vec![0.0; self.n_m * half], vec![0.0; self.n_m * half]);
        for (r, row) in image.chunks_exact(self.n_l).enumerate() {
            for h in 0..half {
                let (plus, minus) = self.columns(h);
                let (a, b) = (row[plus], if plus == minus { 0.0 } else { row[minus] });
                (even[r * half + h], odd[r * half + h]) = (a + b, a - b);
            }
        }
        let (re, im) = (product(self.fused, &even, &self.cos_l), product(self.fused, &odd, &self.sin_l));
        let width = self.cos_l.width().max(1);
        let mut vis = vec![Complex64::default(); self.n_vis];
        for ((re, im), phase) in re.chunks_exact(width).zip(im.chunks_exact(width)).zip(self.row_phase.chunks_exact(self.n_vis.max(1))) {
            for (((v, x), y), p) in vis.iter_mut().zip(re).zip(im).zip(phase) {
                v.re += p.re * x - p.im * y;
                v.im += p.im * x + p.re * y;
            }
        }
        vis
    }

    /// Gradient with respect to the cells \[m * l\] of a function whose gradient with respect to the visibilities is
    /// `gradient` \[n\], d/dRe + i d/dIm.
    #[must_use]
    pub fn adjoint(&self, gradient: &[Complex64]) -> Vec<f64> {
        // conj(g) exp(2 pi i v m): its real part goes with the cosine, its imaginary part with minus the sine.
        let (mut re, mut im) = (vec![0.0; self.row_phase.len()], vec![0.0; self.row_phase.len()]);
        let n = self.n_vis.max(1);
        for ((re, im), phase) in re.chunks_exact_mut(n).zip(im.chunks_exact_mut(n)).zip(self.row_phase.chunks_exact(n)) {
            for (((re, im), g), p) in re.iter_mut().zip(im).zip(gradient).zip(phase) {
                *re = p.re * g.re + p.im * g.im;
                *im = p.im * g.re - p.re * g.im;
            }
        }
        let (even, odd) = (product(self.fused, &re, &self.cos_l_back), product(self.fused, &im, &self.sin_l_back));
        let width = self.cos_l_back.width();
        let mut image = vec![0.0; self.n_l * self.n_m];
        for (r, row) in image.chunks_exact_mut(self.n_l).enumerate() {
            for h in 0..self.half() {
                let (plus, minus) = self.columns(h);
                let (e, o) = (even[r * width + h], odd[r * width + h]);
                row[plus] = e - o;
                if plus == minus {
                    row[plus] = e;
                } else {
                    row[minus] = e + o;
                }
            }
        }
        image
    }
}

fn fused() -> bool {
    #[cfg(target_arch = "x86_64")]
    return std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma");
    #[cfg(not(target_arch = "x86_64"))]
    return false;
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::SkyFrame;

    fn grid(n_l: usize, n_m: usize) -> SkyGrid {
        SkyGrid::new(n_l, n_m, 2e-11, SkyFrame::Sky { ra_rad: 1.0, dec_rad: 0.2, frame: "icrs".into() }).unwrap()
    }

    fn uv(n: usize) -> Vec<[f64; 2]> {
        (0..n).map(|k| [8e9 * (0.7 * k as f64).sin(), -6e9 * (1.1 * k as f64).cos()]).collect()
    }

    #[test]
    fn it_is_the_naive_sum_on_even_and_odd_grids() {
        for (n_l, n_m, n) in [(8, 6, 13), (7, 5, 8), (32, 32, 3)] {
            let (grid, uv) = (grid(n_l, n_m), uv(n));
            let image: Vec<f64> = (0..n_l * n_m).map(|i| ((i * 7 % 11) as f64) - 2.0).collect();
            let total: f64 = image.iter().map(|x| x.abs()).sum();
            for fused in [false, fused()] {
                let dft = SmallDft { fused, ..SmallDft::new(&grid, &uv) };
                for (v, [u, w]) in dft.forward(&image).iter().zip(&uv) {
                    let mut truth = Complex64::default();
                    for (i, x) in image.iter().enumerate() {
                        let (l, m) = (grid.l_at((i % n_l) as f64), grid.m_at((i / n_l) as f64));
                        truth += Complex64::from_polar(*x, TAU * (u * l + w * m));
                    }
                    assert!((v - truth).norm() < 1e-12 * total, "{n_l} x {n_m}: {v} {truth}");
                }
            }
        }
    }

    #[test]
    fn the_adjoint_is_the_adjoint() {
        for (n_l, n_m, n) in [(8, 6, 13), (7, 5, 9), (16, 16, 1)] {
            let dft = SmallDft::new(&grid(n_l, n_m), &uv(n));
            let x: Vec<f64> = (0..n_l * n_m).map(|i| (i as f64 * 0.37).sin()).collect();
            let y: Vec<Complex64> = (0..n).map(|k| Complex64::from_polar(1.0, 2.2 * k as f64)).collect();
            let (ax, aty) = (dft.forward(&x), dft.adjoint(&y));
            let left: f64 = ax.iter().zip(&y).map(|(a, y)| (a * y.conj()).re).sum();
            let right: f64 = x.iter().zip(&aty).map(|(a, b)| a * b).sum();
            assert!((left - right).abs() < 1e-11, "{left} {right}");
            assert_eq!((aty.len(), ax.len()), (n_l * n_m, n));
        }
    }
}
