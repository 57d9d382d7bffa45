//! Many channels of one baseline are represented by fewer frequencies, the nodes. This is possible because the phase of a pixel is linear in
//! frequency.
//!
//! Along the channels of one row, the fringe of a pixel is exp(i X t). Here t runs from -1 to 1 over the band, and |X| is at most half of
//! the phase difference between the ends of the band, at the corner of the image. Interpolation from P Chebyshev nodes gives such a function
//! to a given error if P is somewhat larger than X. A row of C channels with a small phase difference is therefore gridded as P < C
//! visibilities at the nodes, and it is predicted from the nodes. The interpolation matrix is real and depends only on the frequencies. Its
//! transpose is used in the other direction, so the two directions are adjoint to rounding.
//!
//! # Reference
//! Trefethen 2013, Approximation Theory and Approximation Practice, ch. 5 (barycentric interpolation) and 8 (its convergence).

use super::known::Known;
use super::real::{Real, fused};
use super::wplanes::remainder;
use num_complex::Complex;
use std::f64::consts::PI;

/// One set of nodes for the channels of a row.
#[derive(Debug, Clone)]
pub(crate) struct ChannelClass<T> {
    /// Frequencies of the nodes, Hz.
    pub(crate) freq_hz: Vec<f64>,
    /// Largest half phase difference over the band, rad, for which the class is accurate.
    turn: f64,
    /// Interpolation from the nodes to the channels, and its transpose; `None` if the nodes are the channels.
    matrices: Option<[Matrix<T>; 2]>,
    n_chan: usize,
}

/// A real matrix \[input, output\]. The outputs are in groups of eight, of which the last is filled up with zeros.
#[derive(Debug, Clone)]
struct Matrix<T> {
    rows: Vec<[T; 8]>,
    groups: usize,
}

/// All classes, in the order of their number of nodes. The last class has the channels themselves as nodes.
#[derive(Debug, Clone)]
pub(crate) struct Channels<T> {
    pub(crate) classes: Vec<ChannelClass<T>>,
    half_band_hz: f64,
    pub(crate) n_chan: usize,
}

/// The numbers of nodes for which a class is made.
const NODES: [usize; 18] = [2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 20, 24, 28, 32, 40, 48, 64];

impl<T: Real> Channels<T> {
    /// The classes for these channels, with a relative error of at most `epsilon`.
    pub(crate) fn new(freq_hz: &[f64], epsilon: f64) -> Self {
        let n_chan = freq_hz.len();
        let (lo, hi) = freq_hz.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), f| (a.min(*f), b.max(*f)));
        let (mid, half) = (0.5 * (lo + hi), 0.5 * (hi - lo));
        let mut classes = Vec::new();
        for n in NODES {
            // The matrix costs n operations for each channel, and each visibility less saves about a hundred. If fewer than a fifth of the
            // visibilities are saved, the class is not faster.
            if half > 0.0 && 5 * n <= 4 * n_chan {
                classes.push(interpolated(n, freq_hz, (mid, half), epsilon));
            }
        }
        classes.push(ChannelClass { freq_hz: freq_hz.to_vec(), turn: f64::INFINITY, matrices: None, n_chan });
        Self { classes, half_band_hz: half, n_chan }
    }

    /// The class for a row whose largest phase over the image is `turns_per_hz`.
    pub(crate) fn class_for(&self, turns_per_hz: f64) -> usize {
        let turn = 2.0 * PI * turns_per_hz * self.half_band_hz;
        self.classes.iter().position(|c| turn <= c.turn).unwrap_or(self.classes.len() - 1)
    }
}

/// The largest half phase difference over the band for which so many nodes are accurate enough, rad.
fn largest_turn(n: usize, epsilon: f64) -> f64 {
    // The error of interpolation at Chebyshev nodes is at most twice that of the truncated series (Trefethen, thm 8.2).
    let (mut lo, mut hi) = (0.0, n as f64);
    for _ in 0..40 {
        let x = 0.5 * (lo + hi);
        if 2.0 * remainder(n, x) <= epsilon {
            lo = x;
        } else {
            hi = x;
        }
    }
    lo
}

fn interpolated<T: Real>(n: usize, freq_hz: &[f64], (mid, half): (f64, f64), epsilon: f64) -> ChannelClass<T> {
    static TURNS: Known<(usize, u64), f64> = Known::new();
    let turn = TURNS.get((n, epsilon.to_bits()), || largest_turn(n, epsilon));
    let nodes: Vec<f64> = (0..n).map(|j| (PI * (j as f64 + 0.5) / n as f64).cos()).collect();
    let bary: Vec<f64> = (0..n).map(|j| (PI * (j as f64 + 0.5) / n as f64).sin() * if j % 2 == 0 { 1.0 } else { -1.0 }).collect();
    let mut matrix = vec![0.0; n * freq_hz.len()];
    for (c, f) in freq_hz.iter().enumerate() {
        let x = (f - mid) / half;
        if let Some(hit) = nodes.iter().position(|t| (x - t).abs() < 1e-14) {
            matrix[hit * freq_hz.len() + c] = 1.0;
            continue;
        }
        let sum: f64 = nodes.iter().zip(&bary).map(|(t, b)| b / (x - t)).sum();
        for j in 0..n {
            matrix[j * freq_hz.len() + c] = bary[j] / (x - nodes[j]) / sum;
        }
    }
    let n_chan = freq_hz.len();
    let to_channels = Matrix::new((n, n_chan), |j, c| matrix[j * n_chan + c]);
    let to_nodes = Matrix::new((n_chan, n), |c, j| matrix[j * n_chan + c]);
    let freq = nodes.iter().map(|t| mid + half * t).collect();
    ChannelClass { freq_hz: freq, turn, matrices: Some([to_channels, to_nodes]), n_chan }
}

impl<T: Real> Matrix<T> {
    fn new((inputs, outputs): (usize, usize), element: impl Fn(usize, usize) -> f64) -> Self {
        let groups = outputs.div_ceil(8);
        let mut rows = vec![[T::default(); 8]; inputs * groups];
        for i in 0..inputs {
            for o in 0..outputs {
                rows[i * groups + o / 8][o % 8] = T::of(element(i, o));
            }
        }
        Self { rows, groups }
    }

    /// The product of an input with the matrix. `parts` is working memory for its real and its imaginary part.
    #[inline(always)]
    fn times<const FUSED: bool>(&self, input: &[Complex<T>], parts: &mut Parts<T>, output: &mut [Complex<T>]) {
        parts.resize(self.groups, [[T::default(); 8]; 2]);
        let mut group = 0;
        while group < self.groups {
            // Four groups at once: each input is loaded for all of them, and their sums fit into the registers.
            if self.groups - group >= 4 {
                self.times_groups::<4, FUSED>(group, input, parts);
                group += 4;
            } else {
                self.times_groups::<1, FUSED>(group, input, parts);
                group += 1;
            }
        }
        for (out, [re, im]) in output.chunks_mut(8).zip(parts) {
            for ((o, re), im) in out.iter_mut().zip(re).zip(im) {
                *o = Complex::new(*re, *im);
            }
        }
    }

    /// The outputs of `N` groups. They go through memory: the compiler keeps vectors whole up to there.
    #[inline(always)]
    fn times_groups<const N: usize, const FUSED: bool>(&self, group: usize, input: &[Complex<T>], parts: &mut Parts<T>) {
        let (mut re, mut im) = ([[T::default(); 8]; N], [[T::default(); 8]; N]);
        for (v, row) in input.iter().zip(self.rows.chunks_exact(self.groups)) {
            let row = &row[group..group + N];
            for g in 0..N {
                for i in 0..8 {
                    re[g][i] = v.re.fma::<FUSED>(row[g][i], re[g][i]);
                    im[g][i] = v.im.fma::<FUSED>(row[g][i], im[g][i]);
                }
            }
        }
        for (part, (re, im)) in parts[group..group + N].iter_mut().zip(re.into_iter().zip(im)) {
            *part = [re, im];
        }
    }
}

/// Real and imaginary parts of groups of eight numbers \[group, re | im\].
pub(super) type Parts<T> = Vec<[[T; 8]; 2]>;

impl<T: Real> ChannelClass<T> {
    /// Number of nodes.
    pub(crate) fn n_nodes(&self) -> usize {
        self.freq_hz.len()
    }

    /// Sum the visibilities of the channels onto the nodes: the adjoint of the interpolation. The parts are working memory.
    #[inline(always)]
    fn compress<const FUSED: bool>(&self, (vis, parts): (&[Complex<T>], &mut Parts<T>), nodes: &mut [Complex<T>]) {
        debug_assert_eq!((vis.len(), nodes.len()), (self.n_chan, self.n_nodes()));
        match &self.matrices {
            Some([_, to_nodes]) => to_nodes.times::<FUSED>(vis, parts, nodes),
            None => nodes.copy_from_slice(vis),
        }
    }

    /// Interpolate the visibilities of the nodes to the channels. The parts are working memory.
    #[inline(always)]
    fn expand<const FUSED: bool>(&self, (nodes, parts): (&[Complex<T>], &mut Parts<T>), vis: &mut [Complex<T>]) {
        debug_assert_eq!((vis.len(), nodes.len()), (self.n_chan, self.n_nodes()));
        match &self.matrices {
            Some([to_channels, _]) => to_channels.times::<FUSED>(nodes, parts, vis),
            None => vis.copy_from_slice(nodes),
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn compress_avx2<T: Real>(class: &ChannelClass<T>, vis: (&[Complex<T>], &mut Parts<T>), nodes: &mut [Complex<T>]) {
    class.compress::<true>(vis, nodes);
}

/// The visibilities of the channels summed onto the nodes.
pub(super) fn compress<T: Real>(class: &ChannelClass<T>, vis: (&[Complex<T>], &mut Parts<T>), nodes: &mut [Complex<T>]) {
    #[cfg(target_arch = "x86_64")]
    if fused() {
        // SAFETY: the machine has just been found to have AVX2 and FMA.
        unsafe { compress_avx2(class, vis, nodes) };
        return;
    }
    class.compress::<false>(vis, nodes);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn expand_avx2<T: Real>(class: &ChannelClass<T>, nodes: (&[Complex<T>], &mut Parts<T>), vis: &mut [Complex<T>]) {
    class.expand::<true>(nodes, vis);
}

pub(super) fn expand<T: Real>(class: &ChannelClass<T>, nodes: (&[Complex<T>], &mut Parts<T>), vis: &mut [Complex<T>]) {
    #[cfg(target_arch = "x86_64")]
    if fused() {
        // SAFETY: the machine has just been found to have AVX2 and FMA.
        unsafe { expand_avx2(class, nodes, vis) };
        return;
    }
    class.expand::<false>(nodes, vis);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_class_reproduces_the_fringes_it_promises() {
        let freq: Vec<f64> = (0..64).map(|c| 1.3e9 + 2e6 * f64::from(c)).collect();
        for epsilon in [1e-3, 1e-6, 1e-11] {
            let channels = Channels::<f64>::new(&freq, epsilon);
            for class in &channels.classes {
                let turns_per_hz = (class.turn.min(200.0)) / (2.0 * PI * channels.half_band_hz);
                let fringe = |f: f64| Complex::from_polar(1.0, 2.0 * PI * turns_per_hz * (f - 1.363e9));
                let nodes: Vec<Complex<f64>> = class.freq_hz.iter().map(|f| fringe(*f)).collect();
                let mut vis = vec![Complex::default(); 64];
                class.expand::<false>((&nodes, &mut Vec::new()), &mut vis);
                let worst = vis.iter().zip(&freq).map(|(v, f)| (v - fringe(*f)).norm()).fold(0.0, f64::max);
                assert!(worst <= epsilon.max(2e-13), "{} nodes: {worst:e} for {epsilon:e}", class.n_nodes());
            }
            assert!(channels.classes.len() > 8);
        }
    }
}
