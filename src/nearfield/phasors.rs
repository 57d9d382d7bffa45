//! The phasors of all elements towards a few points, channel after channel.

use super::paths::{Elements, Point};
use crate::fourier::Real;
use crate::fourier::phasor::{cos_sin_turns, uniform_step};
use ndarray::{Array2, ArrayView2, s};

/// Points whose phasors are held together: those of a hundred elements stay in the second cache.
pub(super) const TILE: usize = 256;
/// Channels after which the recurrence of the phases starts again. Its error stays below 32 roundings.
const RESTART: usize = 32;

/// Phasors a exp(2 pi i f delay) of all elements, times their voltage.
pub(super) struct Phasors<T> {
    n_ant: usize,
    len: usize,
    step_hz: Option<f64>,
    /// \[element, point\].
    delay_s: Array2<f64>,
    amplitude: Array2<f64>,
    re: Array2<f64>,
    im: Array2<f64>,
    step_re: Array2<f64>,
    step_im: Array2<f64>,
    voltage: Option<Array2<f64>>,
    /// Real parts of all elements, then imaginary parts \[2 elements, point\].
    stacked: Array2<T>,
}

impl<T: Real> Phasors<T> {
    /// For elements and channels at these frequencies, Hz.
    pub(super) fn new(elements: &Elements, freq_hz: &[f64]) -> Self {
        let n_ant = elements.len();
        let plane = || Array2::zeros((n_ant, TILE));
        Self {
            n_ant,
            len: 0,
            step_hz: uniform_step(freq_hz),
            delay_s: plane(),
            amplitude: plane(),
            re: plane(),
            im: plane(),
            step_re: plane(),
            step_im: plane(),
            voltage: (!elements.pattern.is_none()).then(plane),
            stacked: Array2::from_elem((2 * n_ant, TILE), T::default()),
        }
    }

    /// Bytes of the phasors of so many elements, and of their product with the fluxes or sums of the points.
    pub(super) fn bytes(n_ant: usize) -> usize {
        const PLANES: usize = 7;
        const STACKED: usize = 4;
        n_ant * TILE * (PLANES * size_of::<f64>() + STACKED * size_of::<T>())
    }

    /// Take other points, at most [`TILE`].
    pub(super) fn load(&mut self, elements: &Elements, points: &[Point]) {
        self.len = points.len().min(TILE);
        for element in 0..self.n_ant {
            let (mut delay, mut amplitude) = (self.delay_s.row_mut(element), self.amplitude.row_mut(element));
            for (k, p) in points.iter().take(TILE).enumerate() {
                (delay[k], amplitude[k]) = elements.delay(element, *p);
            }
            if let Some(step) = self.step_hz {
                let (mut re, mut im) = (self.step_re.row_mut(element), self.step_im.row_mut(element));
                for k in 0..self.len {
                    (re[k], im[k]) = cos_sin_turns(delay[k] * step);
                }
            }
        }
    }

    /// The phasors of a channel \[2 elements, point\]. Channels come in order, from the first.
    pub(super) fn channel(&mut self, (chan, freq_hz): (usize, f64), elements: &Elements, points: &[Point]) -> ArrayView2<'_, T> {
        let len = self.len;
        if let Some(voltage) = &mut self.voltage
            && (chan == 0 || (elements.pattern_hz.is_none() && elements.pattern.varies_with_frequency()))
        {
            for element in 0..self.n_ant {
                for (k, p) in points.iter().take(len).enumerate() {
                    voltage[(element, k)] = elements.voltage(element, *p, freq_hz);
                }
            }
        }
        for element in 0..self.n_ant {
            let (mut re, mut im) = (self.re.row_mut(element), self.im.row_mut(element));
            let (Some(re), Some(im)) = (re.as_slice_mut(), im.as_slice_mut()) else { continue };
            if self.step_hz.is_none() || chan % RESTART == 0 {
                let (delay, amplitude) = (self.delay_s.row(element), self.amplitude.row(element));
                for k in 0..len {
                    let (cos, sin) = cos_sin_turns(delay[k] * freq_hz);
                    (re[k], im[k]) = (amplitude[k] * cos, amplitude[k] * sin);
                }
            } else {
                let (step_re, step_im) = (self.step_re.row(element), self.step_im.row(element));
                if let (Some(a), Some(b)) = (step_re.as_slice(), step_im.as_slice()) {
                    for k in 0..len {
                        (re[k], im[k]) = (re[k] * a[k] - im[k] * b[k], re[k] * b[k] + im[k] * a[k]);
                    }
                }
            }
            for (row, part) in [(element, &*re), (self.n_ant + element, &*im)] {
                let mut out = self.stacked.row_mut(row);
                match &self.voltage {
                    None => out.iter_mut().zip(&part[..len]).for_each(|(o, x)| *o = T::of(*x)),
                    Some(v) => out.iter_mut().zip(part[..len].iter().zip(v.row(element))).for_each(|(o, (x, v))| *o = T::of(x * v)),
                }
            }
        }
        self.stacked.slice(s![.., ..len])
    }
}
