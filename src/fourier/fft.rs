//! Two-dimensional transforms between the image and the half grid of visibilities.
//!
//! Visibilities are folded to v >= 0, so a plane is a band of rows along u. The rows are transformed one by one, and only the columns of the
//! image are kept, in the place of each row. Then blocks of columns are gathered, transformed, corrected and summed over all planes while they are in cache. Rows that
//! no visibility reaches are not transformed. With real screens, two columns share one complex transform.

use super::line_fft::apart;
use super::plan::Plan;
use super::plane_rows::{PlaneRows, TILE};
use super::real::{Real, cis_of_all};
use super::wplanes::WBasis;
use crate::pages::zeros;
use ndarray::{Array2, ArrayView2, ArrayViewMut2, Axis};
use num_complex::Complex;
use rayon::prelude::*;
use std::ops::Range;

/// Number of columns that are transformed together. They are a few cache lines of each row.
pub(super) const BLOCK: usize = 16;

/// Real or complex screens of one plane on a block of columns \[m, column\].
enum Screens<T> {
    /// Values of (n - 1 - nu_mid) / nu_half.
    Powers(Vec<T>),
    /// Values of n - 1 - nu_mid. The phase at w is w times as many turns.
    Planes(Vec<f64>),
}

/// The columns of the image that one task processes.
struct Columns<'a, T: Real> {
    plan: &'a Plan<T>,
    first: usize,
    width: usize,
    screens: Screens<T>,
    depths: Vec<f64>,
}

/// n - 1 of the pixels of a block of columns; NaN behind the horizon \[m, column\].
fn depths<T: Real>(plan: &Plan<T>, first: usize, width: usize) -> Vec<f64> {
    let l2: [f64; BLOCK] = std::array::from_fn(|c| if c < width { plan.grid.l_at((first + c) as f64).powi(2) } else { f64::NAN });
    let mut depths = vec![0.0; plan.grid.n_m * BLOCK];
    let (lines, half) = (depths.as_chunks_mut::<BLOCK>().0, plan.grid.n_m / 2);
    for (i, line) in lines.iter_mut().enumerate().take(half + 1) {
        let m2 = plan.grid.m_at(i as f64).powi(2);
        for (depth, l2) in line.iter_mut().zip(&l2) {
            let r2 = l2 + m2;
            let root = (1.0 - r2).sqrt();
            *depth = if r2 < 1.0 { -r2 / (1.0 + root) } else { f64::NAN };
        }
    }
    // Rows as far on the other side of m = 0 have the same.
    for i in half + 1..lines.len() {
        lines[i] = lines[2 * half - i];
    }
    depths
}

/// The product of all factors of these pixels that do not depend on the plane; 0 behind the horizon \[m, column\].
fn factors<T: Real>(plan: &Plan<T>, first: usize, depths: &[f64]) -> Vec<f64> {
    let mut factors = vec![0.0; depths.len()];
    let along_l: [f64; BLOCK] = std::array::from_fn(|c| plan.correct_l.get(first + c).copied().unwrap_or(0.0));
    let lines = factors.as_chunks_mut::<BLOCK>().0.iter_mut().zip(depths.as_chunks::<BLOCK>().0);
    for ((factors, depths), along_m) in lines.zip(&plan.correct_m) {
        for ((factor, depth), along_l) in factors.iter_mut().zip(depths).zip(&along_l) {
            let n = if plan.divide_by_n { 1.0 + depth } else { 1.0 };
            *factor = along_m * along_l / n;
        }
        if let WBasis::Planes { correction, .. } = &plan.w.basis {
            let mut sum = [0.0; BLOCK];
            for coefficient in correction.iter().rev() {
                sum.iter_mut().zip(depths).for_each(|(s, depth)| *s = *s * plan.w.scaled(*depth) + coefficient);
            }
            factors.iter_mut().zip(sum).for_each(|(f, s)| *f *= s);
        }
        factors.iter_mut().zip(depths).for_each(|(f, depth)| *f = if depth.is_nan() { 0.0 } else { *f });
    }
    factors
}

/// Multiply the sum of all planes \[m, l\] by the factors of its pixels.
pub(crate) fn correct<T: Real>(plan: &Plan<T>, image: &mut Array2<T>) {
    image.axis_chunks_iter_mut(Axis(1), BLOCK).into_par_iter().enumerate().for_each(|(b, mut block)| {
        let factor = factors(plan, b * BLOCK, &depths(plan, b * BLOCK, block.ncols()));
        for (mut line, factor) in block.rows_mut().into_iter().zip(factor.chunks_exact(BLOCK)) {
            line.iter_mut().zip(factor).for_each(|(v, f)| *v = T::of(v.to64() * f));
        }
    });
}

/// An image \[m, l\] times the factors of its pixels.
pub(crate) fn corrected<T: Real, P: Real>(plan: &Plan<T>, image: ArrayView2<'_, P>) -> Array2<T> {
    let mut out = zeros(image.dim());
    out.axis_chunks_iter_mut(Axis(1), BLOCK).into_par_iter().enumerate().for_each(|(b, mut block)| {
        let factor = factors(plan, b * BLOCK, &depths(plan, b * BLOCK, block.ncols()));
        for ((i, mut line), factor) in block.rows_mut().into_iter().enumerate().zip(factor.chunks_exact(BLOCK)) {
            for (c, (o, f)) in line.iter_mut().zip(factor).enumerate() {
                *o = T::of(image[(i, b * BLOCK + c)].to64() * f);
            }
        }
    });
    out
}

impl<'a, T: Real> Columns<'a, T> {
    fn new(plan: &'a Plan<T>, first: usize) -> Self {
        let width = BLOCK.min(plan.grid.n_l - first);
        let depths = depths(plan, first, width);
        let inside = depths.iter().map(|depth| if depth.is_nan() { plan.w.nu_mid } else { *depth });
        let screens = match &plan.w.basis {
            WBasis::Powers { .. } => Screens::Powers(inside.map(|depth| T::of(plan.w.scaled(depth))).collect()),
            WBasis::Planes { .. } => Screens::Planes(inside.map(|depth| depth - plan.w.nu_mid).collect()),
        };
        Self { plan, first, width, screens, depths }
    }

    /// The factors of the pixels.
    fn factors(&self) -> Vec<f64> {
        factors(self.plan, self.first, &self.depths)
    }

    /// Real screen of a power \[m, column\].
    fn power_screen(&self, plane: usize, out: &mut [T]) {
        if let (WBasis::Powers { screens, .. }, Screens::Powers(x)) = (&self.plan.w.basis, &self.screens) {
            let coefficients: Vec<T> = screens[plane].iter().rev().map(|c| T::of(*c)).collect();
            for (o, x) in out.chunks_exact_mut(BLOCK).zip(x.chunks_exact(BLOCK)) {
                let mut sum = [T::default(); BLOCK];
                for c in &coefficients {
                    for (s, x) in sum.iter_mut().zip(x) {
                        *s = *s * *x + *c;
                    }
                }
                o.copy_from_slice(&sum);
            }
        }
    }

    /// Phase screen of a plane of constant w \[m, column\]. The phase of the visibility is +w (n - 1). The direction to the image uses the conjugate.
    fn phase_screen(&self, plane: usize, out: &mut [Complex<T>]) {
        if let (WBasis::Planes { first, step, .. }, Screens::Planes(x)) = (&self.plan.w.basis, &self.screens) {
            cis_of_all(first + plane as f64 * step, x, out);
        }
    }

    /// Index in the transform along v of a row of the image.
    fn index_m(&self, i: usize) -> usize {
        let (nv, half) = (self.plan.nv, self.plan.grid.n_m / 2);
        if i < half { i + nv - half } else { i - half }
    }

    /// Indices in the transform along v of a row of the half grid and of its mirror image.
    fn index_v(&self, r: usize) -> (usize, usize) {
        let nv = self.plan.nv;
        let within = |j: usize| if j < nv { j } else { j % nv };
        let j = within(r + nv - self.plan.below());
        (j, within(nv - j))
    }
}

/// i^k z.
fn quarter_turns<T: Real>(z: Complex<T>, k: usize) -> Complex<T> {
    match k & 3 {
        0 => z,
        1 => Complex::new(-z.im, z.re),
        2 => -z,
        _ => Complex::new(z.im, -z.re),
    }
}

/// The place of the pixels of a row and a plane in a stripe whose rows are transformed: \[block of columns, plane, row, column\]. What a block of columns
/// needs of a stripe is therefore contiguous.
struct Place {
    planes: usize,
    row: usize,
    plane: usize,
}

impl Place {
    /// Those of the block of columns that begins at `first`.
    fn of(&self, first: usize, width: usize) -> Range<usize> {
        let at = first * self.planes * TILE + (self.plane * TILE + self.row) * width;
        at..at + width
    }
}

/// Transform the planes from `first_plane` on with exp(-2 pi i ...), apply their screens, and add them to `image` \[m, l\]. All planes together
/// are corrected too; a sum of groups is corrected when it is complete. The transform overwrites the planes. Their memory is returned for the
/// next use.
pub(crate) fn planes_to_image<T: Real>(plan: &Plan<T>, mut rows: PlaneRows<T>, first_plane: usize, image: &mut Array2<T>) -> PlaneRows<T> {
    let (planes, width) = (rows.planes, rows.width);
    rows.stripes_mut().into_par_iter().enumerate().for_each_init(
        || (Line::new(plan), vec![Complex::default(); TILE * planes * plan.grid.n_l]),
        |(line, columns), (s, stripe)| {
            for (at, row) in stripe.chunks_exact(width).take(used_rows(plan, s) * planes).enumerate() {
                let place = Place { planes, row: at / planes, plane: at % planes };
                for (b, block) in line.pixels_of(plan, row).chunks(BLOCK).enumerate() {
                    columns[place.of(b * BLOCK, block.len())].copy_from_slice(block);
                }
            }
            stripe[..columns.len()].copy_from_slice(columns);
        },
    );
    let held = rows.stripes_mut();
    let stripes: Vec<&[Complex<T>]> = held.iter().map(|s| s.as_slice()).collect();
    let row = |r: usize, plane: usize, columns: Range<usize>| {
        &stripes[r / TILE][Place { planes, row: r % TILE, plane }.of(columns.start, columns.len())]
    };
    columns_to_image(plan, first_plane..first_plane + planes, row, (0, image.view_mut()));
    rows
}

/// Number of rows of a stripe that the half grid has.
pub(super) fn used_rows<T: Real>(plan: &Plan<T>, stripe: usize) -> usize {
    plan.n_rows.saturating_sub(stripe * TILE).min(TILE)
}

/// A row of the padded grid, which is transformed along u.
struct Line<T> {
    padded: Vec<Complex<T>>,
    scratch: Vec<Complex<T>>,
    pixels: Vec<Complex<T>>,
}

impl<T: Real> Line<T> {
    fn new(plan: &Plan<T>) -> Self {
        let zeros = |n: usize| vec![Complex::default(); n];
        let scratch = plan.fft.rows.iter().map(|fft| fft.get_inplace_scratch_len()).max().unwrap_or(0);
        Self { padded: zeros(plan.nu), scratch: zeros(scratch), pixels: zeros(plan.grid.n_l) }
    }

    /// The pixels of the image in a stored row, in order.
    fn pixels_of(&mut self, plan: &Plan<T>, stored: &[Complex<T>]) -> &[Complex<T>] {
        plan.columns.widen(stored, &mut self.padded);
        plan.fft.rows[0].process_with_scratch(&mut self.padded, &mut self.scratch);
        let half = plan.grid.n_l / 2;
        let (before, after) = self.pixels.split_at_mut(half);
        before.copy_from_slice(&self.padded[plan.nu - half..]);
        after.copy_from_slice(&self.padded[..after.len()]);
        &self.pixels
    }

    /// Transform the pixels that `put` puts into an empty row with [`put_pixels`], and store the part of the row that is kept.
    fn store(&mut self, plan: &Plan<T>, put: impl FnOnce(&mut [Complex<T>]), stored: &mut [Complex<T>]) {
        self.padded.fill(Complex::default());
        put(&mut self.padded);
        plan.fft.rows[1].process_with_scratch(&mut self.padded, &mut self.scratch);
        plan.columns.narrow(&self.padded, stored);
    }
}

/// The pixels \[line, column\] of stored rows \[line, u\].
pub(super) fn rows_to_pixels<T: Real>(plan: &Plan<T>, stored: &[Complex<T>]) -> Vec<Complex<T>> {
    let (width, n_l) = (plan.columns.width, plan.grid.n_l);
    let mut all = vec![Complex::default(); stored.len() / width * n_l];
    let lines = stored.par_chunks_exact(width).zip(all.par_chunks_exact_mut(n_l));
    lines.for_each_init(|| Line::new(plan), |line, (row, out)| out.copy_from_slice(line.pixels_of(plan, row)));
    all
}

/// Transform pixels \[line, column\] to rows \[line, u\], and store what visibilities reach of them.
pub(super) fn pixels_to_rows<T: Real>(plan: &Plan<T>, pixels: &[Complex<T>], stored: &mut [Complex<T>]) {
    let lines = pixels.par_chunks_exact(plan.grid.n_l).zip(stored.par_chunks_exact_mut(plan.columns.width));
    lines.for_each_init(|| Line::new(plan), |line, (pixels, out)| line.store(plan, |row| put_pixels(plan, pixels, 0, row), out));
}

/// Transform columns of the planes along v, apply their screens, and add them to columns of the image \[m, l\], of which the first is `first`. `row` gives
/// columns of a row of the half grid in a plane, counted from the first plane. All planes together are corrected too.
pub(super) fn columns_to_image<'r, T: Real>(
    plan: &Plan<T>,
    planes: Range<usize>,
    row: impl Fn(usize, usize, Range<usize>) -> &'r [Complex<T>] + Sync,
    (first, mut image): (usize, ArrayViewMut2<'_, T>),
) {
    let (first_plane, planes) = (planes.start, planes.len());
    let buffers = || (vec![T::default(); plan.grid.n_m * BLOCK], Work::new(plan, 0));
    image.axis_chunks_iter_mut(Axis(1), BLOCK).into_par_iter().enumerate().for_each_init(buffers, |(sum, work), (b, mut block)| {
        let columns = Columns::new(plan, first + b * BLOCK);
        sum.fill(T::default());
        for p in 0..planes {
            let own = columns.first..columns.first + columns.width;
            work.gather(&columns, |r| row(r, p, own.clone()), first_plane + p);
            work.transform(plan, 0);
            work.accumulate(&columns, first_plane + p, sum);
        }
        if planes == plan.planes() {
            sum.iter_mut().zip(columns.factors()).for_each(|(v, f)| *v = T::of(v.to64() * f));
        }
        for (mut out, sum) in block.rows_mut().into_iter().zip(sum.chunks_exact(BLOCK)) {
            out.iter_mut().zip(sum).for_each(|(o, v)| *o += *v);
        }
    });
}

/// A group of planes of an image \[m, l\]: apply screens, and corrections if the image is still `raw`, and transform with exp(+2 pi i ...).
pub(crate) fn image_to_planes<T: Real, P: Real>(
    plan: &Plan<T>,
    image: ArrayView2<'_, P>,
    (raw, group): (bool, Range<usize>),
) -> PlaneRows<T> {
    let planes = group.len();
    let n_rows = plan.n_rows;
    let blocks = image_to_columns(plan, image, (raw, group), 0..plan.grid.n_l.div_ceil(BLOCK));
    let mut rows = plan.pool.take_planes(n_rows, planes, plan.columns.with_pixels);
    rows.stripes_mut().into_par_iter().enumerate().for_each_init(
        || Line::new(plan),
        |line, (s, stripe)| {
            for (at, stored) in stripe.chunks_exact_mut(plan.columns.with_pixels).enumerate() {
                let (r, p) = (s * TILE + at / planes, at % planes);
                if r >= n_rows {
                    break;
                }
                let put = |row: &mut [Complex<T>]| {
                    for (b, block) in blocks.iter().enumerate() {
                        let from = (p * n_rows + r) * BLOCK;
                        put_pixels(plan, &block[from..from + BLOCK], b * BLOCK, row);
                    }
                };
                line.store(plan, put, stored);
            }
        },
    );
    plan.pool.give(blocks);
    rows
}

/// Put pixels of the columns from `first` on into a row of the padded grid. What lies beyond the image is left out.
fn put_pixels<T: Real>(plan: &Plan<T>, pixels: &[Complex<T>], first: usize, row: &mut [Complex<T>]) {
    let (nu, n_l) = (plan.nu, plan.grid.n_l);
    for (c, v) in (first..n_l).zip(pixels) {
        row[(c + nu - n_l / 2) % nu] = *v;
    }
}

/// Blocks of columns of an image \[m, l\], transformed along v for a group of planes: \[plane, row, column\] each. `raw` as in [`image_to_planes`].
pub(super) fn image_to_columns<T: Real, P: Real>(
    plan: &Plan<T>,
    image: ArrayView2<'_, P>,
    (raw, group): (bool, Range<usize>),
    blocks: Range<usize>,
) -> Vec<Vec<Complex<T>>> {
    let (first_plane, planes, n_rows) = (group.start, group.len(), plan.n_rows);
    let buffers = || (vec![T::default(); plan.grid.n_m * BLOCK], Work::new(plan, 1));
    blocks
        .into_par_iter()
        .map_init(buffers, |(pixels, work), b| {
            let columns = Columns::new(plan, b * BLOCK);
            pixels.fill(T::default());
            let factor = raw.then(|| columns.factors());
            for i in 0..plan.grid.n_m {
                for c in 0..columns.width {
                    let v = image[(i, columns.first + c)].to64();
                    pixels[i * BLOCK + c] = T::of(factor.as_ref().map_or(v, |f| v * f[i * BLOCK + c]));
                }
            }
            let mut out = plan.pool.take(planes * n_rows * BLOCK);
            for (p, out) in out.chunks_exact_mut(n_rows * BLOCK).enumerate() {
                work.spread(&columns, first_plane + p, pixels);
                work.transform(plan, 1);
                work.collect(&columns, first_plane + p, out);
            }
            out
        })
        .collect()
}

/// Buffers of one task of the pass over columns.
struct Work<T> {
    /// Columns along v \[column, v\]. With real screens, two columns share a transform \[pair of columns, v\].
    z: Vec<Complex<T>>,
    /// From one column to the next.
    stride: usize,
    scratch: Vec<Complex<T>>,
    screen: Vec<T>,
    phases: Vec<Complex<T>>,
    paired: bool,
}

impl<T: Real> Work<T> {
    fn new(plan: &Plan<T>, direction: usize) -> Self {
        let paired = matches!(plan.w.basis, WBasis::Powers { .. });
        let stride = apart::<Complex<T>>(plan.nv);
        Self {
            z: vec![Complex::default(); stride * if paired { BLOCK / 2 } else { BLOCK }],
            stride,
            scratch: vec![Complex::default(); plan.fft.columns[direction].get_inplace_scratch_len()],
            screen: vec![T::default(); if paired { plan.grid.n_m * BLOCK } else { 0 }],
            phases: vec![Complex::default(); if paired { 0 } else { plan.grid.n_m * BLOCK }],
            paired,
        }
    }

    fn transform(&mut self, plan: &Plan<T>, direction: usize) {
        for column in self.z.chunks_exact_mut(self.stride) {
            plan.fft.columns[direction].process_with_scratch(&mut column[..plan.nv], &mut self.scratch);
        }
    }

    /// Copy the rows of the half grid into columns. Paired columns are completed by symmetry: the transform of half of each row plus half of
    /// its mirrored conjugate is the real part.
    fn gather<'r>(&mut self, columns: &Columns<'_, T>, row: impl Fn(usize) -> &'r [Complex<T>], plane: usize)
    where
        T: 'r,
    {
        let (nv, stride) = (columns.plan.nv, self.stride);
        let half = T::of(0.5);
        self.z.fill(Complex::default());
        for r in 0..columns.plan.n_rows {
            let (at, mirror) = columns.index_v(r);
            let values = row(r);
            if self.paired {
                for (q, pair) in values.chunks(2).enumerate() {
                    let turn = |z: Complex<T>| quarter_turns(z, 3 * plane).scale(half);
                    let a = turn(pair[0]);
                    let b = pair.get(1).map_or(Complex::default(), |b| turn(*b));
                    let z = &mut self.z[q * stride..q * stride + nv];
                    z[at] += Complex::new(a.re - b.im, a.im + b.re);
                    z[mirror] += Complex::new(a.re + b.im, b.re - a.im);
                }
            } else {
                for (c, v) in values.iter().enumerate() {
                    self.z[c * stride + at] += *v;
                }
            }
        }
    }

    /// Multiply the transformed columns by their screen and add them to the sum over planes.
    fn accumulate(&mut self, columns: &Columns<'_, T>, plane: usize, sum: &mut [T]) {
        let stride = self.stride;
        columns.power_screen(plane, &mut self.screen);
        columns.phase_screen(plane, &mut self.phases);
        for (i, sum) in sum.chunks_exact_mut(BLOCK).enumerate() {
            let at = columns.index_m(i);
            match &columns.screens {
                Screens::Powers(_) => {
                    let screen = &self.screen[i * BLOCK..(i + 1) * BLOCK];
                    for (q, (s, screen)) in sum.chunks_exact_mut(2).zip(screen.chunks_exact(2)).enumerate() {
                        let z = self.z[q * stride + at];
                        s[0] += z.re * screen[0];
                        s[1] += z.im * screen[1];
                    }
                }
                Screens::Planes(_) => {
                    for (c, (s, phase)) in sum.iter_mut().zip(&self.phases[i * BLOCK..]).enumerate() {
                        let z = self.z[c * stride + at];
                        *s += z.re * phase.re + z.im * phase.im;
                    }
                }
            }
        }
    }

    /// Multiply the pixels by their screen and write them into the columns.
    fn spread(&mut self, columns: &Columns<'_, T>, plane: usize, pixels: &[T]) {
        let stride = self.stride;
        self.z.fill(Complex::default());
        columns.power_screen(plane, &mut self.screen);
        columns.phase_screen(plane, &mut self.phases);
        for (i, pixels) in pixels.chunks_exact(BLOCK).enumerate() {
            let at = columns.index_m(i);
            match &columns.screens {
                Screens::Powers(_) => {
                    let screen = &self.screen[i * BLOCK..(i + 1) * BLOCK];
                    for (q, (p, screen)) in pixels.chunks_exact(2).zip(screen.chunks_exact(2)).enumerate() {
                        self.z[q * stride + at] = Complex::new(p[0] * screen[0], p[1] * screen[1]);
                    }
                }
                Screens::Planes(_) => {
                    for (c, (p, phase)) in pixels.iter().zip(&self.phases[i * BLOCK..]).enumerate() {
                        self.z[c * stride + at] = phase.scale(*p);
                    }
                }
            }
        }
    }

    /// Copy the transformed columns into rows of the half grid \[row, column\]. The two columns of a pair are separated by their symmetry.
    fn collect(&self, columns: &Columns<'_, T>, plane: usize, out: &mut [Complex<T>]) {
        let stride = self.stride;
        let half = T::of(0.5);
        for (r, out) in out.chunks_exact_mut(BLOCK).enumerate() {
            let (at, mirror) = columns.index_v(r);
            if self.paired {
                for (q, pair) in out.chunks_exact_mut(2).enumerate() {
                    let (a, b) = (self.z[q * stride + at], self.z[q * stride + mirror]);
                    let first = Complex::new(a.re + b.re, a.im - b.im).scale(half);
                    let second = Complex::new(a.im + b.im, b.re - a.re).scale(half);
                    pair[0] = quarter_turns(first, plane);
                    pair[1] = quarter_turns(second, plane);
                }
            } else {
                for (c, o) in out.iter_mut().enumerate() {
                    *o = self.z[c * stride + at];
                }
            }
        }
    }
}
