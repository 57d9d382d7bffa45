//! The exact transform between points and pairs of antennas, and its adjoint.
//!
//! A pair sees a point through the product of two phasors, h_p conj(h_q), one for each element. The visibilities of N elements are therefore the product of
//! matrices H diag(I) H^*, and the image of their weighted sums M is the diagonal of H^* M H. With real and imaginary parts on top of each other both are real
//! matrix products of 4 N^2 multiply-adds for each point and channel, which run at the speed of the processor. No FFT approximates them: they hold at any
//! distance and any angle. Single precision suffices for errors of 1e-5 of the total flux; each tile of points is then summed in it, and the tiles in double
//! precision.

use super::pairs::Pairs;
use super::paths::{Elements, Point};
use super::phasors::{Phasors, TILE};
use crate::fourier::Real;
use crate::memory::MemoryBudget;
use crate::progress::Observer;
use crate::{ChainError, Result, ensure};
use ndarray::linalg::general_mat_mul;
use ndarray::{Array2, ArrayView2, s};
use num_complex::Complex64;
use rayon::prelude::*;

/// Groups of points that are summed at the same time, whatever the number of threads.
const GROUPS: usize = 16;

/// The transform for some elements, points and channels.
#[derive(Debug, Clone)]
pub struct PathTransform {
    elements: Elements,
    points: Vec<Point>,
    freq_hz: Vec<f64>,
    memory: MemoryBudget,
}

impl PathTransform {
    /// For these points and frequencies, Hz.
    ///
    /// # Errors
    /// A point nearer than the farthest element; points or tables of pairs that do not fit into the memory budget.
    pub fn new(elements: Elements, points: Vec<Point>, freq_hz: &[f64], memory: MemoryBudget) -> Result<Self> {
        let nearest = points.iter().map(|p| p.curvature).fold(0.0, f64::max).recip();
        elements.check_distance(nearest)?;
        Pairs::check_memory(freq_hz.len(), elements.len(), memory)?;
        let (needed, has) = (points.len() * size_of::<Point>(), memory.bytes() / 2);
        let text = format!(
            "the {} points of the scene need {} MiB, more than half of the memory budget: use a smaller image, or more memory (--memory)",
            points.len(),
            needed >> 20
        );
        ensure!(needed <= has, ChainError::Incompatible(text));
        Ok(Self { elements, points, freq_hz: freq_hz.to_vec(), memory })
    }

    /// Number of points.
    #[must_use]
    pub fn n_points(&self) -> usize {
        self.points.len()
    }

    /// The elements.
    #[must_use]
    pub fn elements(&self) -> &Elements {
        &self.elements
    }

    /// Multiply-adds of one pass in one direction.
    #[must_use]
    pub fn multiply_adds(&self) -> f64 {
        4.0 * (self.elements.len() as f64).powi(2) * self.points.len() as f64 * self.freq_hz.len() as f64
    }

    /// Points whose phasors are made together.
    #[must_use]
    pub fn points_of_tile() -> usize {
        TILE
    }

    /// Bytes that a pass holds beside the points on so many threads: the tables of pairs, and phasors of a tile in double precision.
    #[must_use]
    pub fn bytes_of_pass(&self, threads: usize) -> usize {
        let (n_chan, n_ant) = (self.freq_hz.len(), self.elements.len());
        let tables = self.groups(Pairs::bytes(n_chan, n_ant)) + 3;
        tables * Pairs::bytes(n_chan, n_ant) + threads * Phasors::<f64>::bytes(n_ant)
    }

    /// Groups of points with a table of so many bytes each.
    fn groups(&self, table: usize) -> usize {
        GROUPS.min(self.memory.bytes() / 4 / table.max(1)).clamp(1, self.points.len().div_ceil(TILE).max(1))
    }

    /// The visibilities of all pairs. `value` gives the flux of a point in a channel.
    ///
    /// # Errors
    /// The observer asks to stop.
    pub fn predict<T: Real>(&self, value: impl Fn(usize, usize) -> f64 + Sync, observer: &dyn Observer) -> Result<Pairs> {
        let (n_chan, n_ant) = (self.freq_hz.len(), self.elements.len());
        let groups = self.groups(Pairs::bytes(n_chan, n_ant));
        let size = self.points.len().div_ceil(groups).next_multiple_of(TILE).max(TILE);
        let sum = |(group, points): (usize, &[Point])| -> Result<Pairs> {
            let mut out = Pairs::zeros(n_chan, n_ant);
            let mut phasors = Phasors::<T>::new(&self.elements, &self.freq_hz);
            let mut bright = Array2::from_elem((2 * n_ant, TILE), T::default());
            let mut product = Array2::from_elem((2 * n_ant, 2 * n_ant), T::default());
            for (tile, points) in points.chunks(TILE).enumerate() {
                ensure!(!observer.cancelled(), ChainError::Cancelled);
                let first = group * size + tile * TILE;
                phasors.load(&self.elements, points);
                for (chan, freq) in self.freq_hz.iter().enumerate() {
                    let top = (0..points.len()).map(|k| value(chan, first + k).abs()).fold(0.0, f64::max);
                    if top == 0.0 {
                        // The recurrence of the phases goes on all the same.
                        phasors.channel((chan, *freq), &self.elements, points);
                        continue;
                    }
                    let h = phasors.channel((chan, *freq), &self.elements, points);
                    let scaled: Vec<T> = (0..points.len()).map(|k| T::of(value(chan, first + k) / top)).collect();
                    let mut bright = bright.slice_mut(s![.., ..points.len()]);
                    for (mut b, h) in bright.rows_mut().into_iter().zip(h.rows()) {
                        b.iter_mut().zip(h).zip(&scaled).for_each(|((b, h), v)| *b = *h * *v);
                    }
                    general_mat_mul(T::one(), &bright, &h.t(), T::default(), &mut product);
                    for p in 0..n_ant {
                        for q in 0..n_ant {
                            let re = product[(p, q)] + product[(n_ant + p, n_ant + q)];
                            let im = product[(n_ant + p, q)] - product[(p, n_ant + q)];
                            out.add(chan, p, q, Complex64::new(re.to64(), im.to64()) * top);
                        }
                    }
                }
            }
            Ok(out)
        };
        let parts = self.points.chunks(size).collect::<Vec<_>>().into_par_iter().enumerate().map(sum).collect::<Result<Vec<_>>>()?;
        let mut all = Pairs::zeros(n_chan, n_ant);
        parts.iter().for_each(|part| all.merge(part));
        Ok(all)
    }

    /// The adjoint \[point\]: the sum over rows of Re(value conj(h_1 conj(h_2))), from their sums for each pair.
    ///
    /// # Errors
    /// The observer asks to stop.
    pub fn adjoint<T: Real>(&self, sums: &Pairs, observer: &dyn Observer) -> Result<Vec<f64>> {
        let (n_chan, n_ant) = (self.freq_hz.len(), self.elements.len());
        let matrices: Vec<(f64, Array2<T>)> = (0..n_chan).into_par_iter().map(|c| hermitian(sums.channel(c))).collect();
        let mut out = vec![0.0; self.points.len()];
        let start = || {
            let block = |rows| Array2::from_elem((rows, TILE), T::default());
            (Phasors::<T>::new(&self.elements, &self.freq_hz), block(2 * n_ant))
        };
        let work = |(phasors, turned): &mut (Phasors<T>, Array2<T>), (out, points): (&mut [f64], &[Point])| -> Result<()> {
            ensure!(!observer.cancelled(), ChainError::Cancelled);
            phasors.load(&self.elements, points);
            for (chan, freq) in self.freq_hz.iter().enumerate() {
                let h = phasors.channel((chan, *freq), &self.elements, points);
                let (scale, matrix) = &matrices[chan];
                if *scale == 0.0 {
                    continue;
                }
                let mut turned = turned.slice_mut(s![.., ..points.len()]);
                general_mat_mul(T::one(), matrix, &h, T::default(), &mut turned);
                let mut sum = vec![T::default(); points.len()];
                for (a, b) in turned.rows().into_iter().zip(h.rows()) {
                    sum.iter_mut().zip(a).zip(b).for_each(|((s, a), b)| *s += *a * *b);
                }
                out.iter_mut().zip(&sum).for_each(|(o, s)| *o += s.to64() * scale);
            }
            Ok(())
        };
        let tiles: Vec<_> = out.chunks_mut(TILE).zip(self.points.chunks(TILE)).collect();
        tiles.into_par_iter().map_init(start, |state, tile| work(state, tile)).collect::<Result<()>>()?;
        Ok(out)
    }

    /// The sum over rows of weight |h_1 h_2|^2 at each point, from the sums of the weights of all channels for each pair \[antenna 1, antenna 2\]. Without a
    /// pattern it is close to the sum of the weights, and equal to it in the far field.
    #[must_use]
    pub fn power(&self, weights: ArrayView2<'_, f64>) -> Vec<f64> {
        let freq = self.freq_hz.iter().sum::<f64>() / self.freq_hz.len().max(1) as f64;
        let n_ant = self.elements.len();
        let tile = |points: &[Point]| {
            let seen = Array2::from_shape_fn((n_ant, points.len()), |(a, k)| {
                let amplitude = self.elements.delay(a, points[k]).1;
                let voltage = if self.elements.pattern.is_none() { 1.0 } else { self.elements.voltage(a, points[k], freq) };
                (amplitude * voltage).powi(2)
            });
            let other = weights.dot(&seen);
            (0..points.len()).map(|k| other.column(k).dot(&seen.column(k))).collect::<Vec<f64>>()
        };
        self.points.par_chunks(TILE).flat_map_iter(tile).collect()
    }
}

/// The Hermitian matrix whose form H^* M H is the real part of the sum over the pairs, with real and imaginary parts in blocks, over its largest element.
fn hermitian<T: Real>(sums: ArrayView2<'_, Complex64>) -> (f64, Array2<T>) {
    let n = sums.nrows();
    let top = sums.iter().map(|v| v.re.abs().max(v.im.abs())).fold(0.0, f64::max);
    let mut out = Array2::from_elem((2 * n, 2 * n), T::default());
    if top == 0.0 || !top.is_finite() {
        return (0.0, out);
    }
    for p in 0..n {
        for q in 0..n {
            let m = (sums[(p, q)] + sums[(q, p)].conj()) * (0.5 / top);
            out[(p, q)] = T::of(m.re);
            out[(n + p, n + q)] = T::of(m.re);
            out[(p, n + q)] = T::of(-m.im);
            out[(n + p, q)] = T::of(m.im);
        }
    }
    (top, out)
}

#[cfg(test)]
#[path = "transform_tests.rs"]
mod tests;
