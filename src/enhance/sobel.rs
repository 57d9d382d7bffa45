//! Sharpening of edges only, guided by the Sobel gradient.

use super::border::{by_rows, line, reflect};
use super::smooth::gaussian;
use super::step::{Given, Step};
use crate::Result;
use ndarray::{Array2, ArrayView2, Zip};

/// An edge stands out where its gradient is above this multiple of the median gradient, which is that of the noise where edges are few.
const ABOVE_NOISE: f64 = 3.0;

#[derive(Debug)]
struct Guided {
    sigma: f64,
    amount: f64,
    edge: Option<f64>,
}

impl Step for Guided {
    fn apply(&self, frame: Array2<f64>) -> Result<Array2<f64>> {
        Ok(sobel_guided(frame.view(), self.sigma, self.amount, self.edge))
    }
}

pub(super) fn make(given: &Given<'_>) -> Result<Box<dyn Step>> {
    Ok(Box::new(Guided { sigma: given.number(0), amount: given.number(1), edge: given.optional(2) }))
}

/// The gradient along m and along l, in units of brightness a pixel, from the 3 x 3 masks of Sobel divided by 8.
///
/// # Reference
/// Sobel & Feldman 1968; Gonzalez & Woods 2018, Digital Image Processing, 4th ed., section 10.2.
#[must_use]
pub fn gradient(plane: ArrayView2<'_, f64>) -> (Array2<f64>, Array2<f64>) {
    let plane = plane.as_standard_layout().into_owned();
    let (n_m, n_l) = plane.dim();
    let of = |weights: [[f64; 3]; 3]| {
        by_rows((n_m, n_l), |r, out| {
            for (k, weights) in weights.iter().enumerate() {
                let row = line(&plane, reflect(r as isize + k as isize - 1, n_m));
                for (c, o) in out.iter_mut().enumerate() {
                    let beside = |d: isize| row[reflect(c as isize + d, n_l)];
                    *o += weights[0] * beside(-1) + weights[1] * row[c] + weights[2] * beside(1);
                }
            }
        })
    };
    let (one, two) = (0.125, 0.25);
    (of([[-one, -two, -one], [0.0; 3], [one, two, one]]), of([[-one, 0.0, one], [-two, 0.0, two], [-one, 0.0, one]]))
}

/// The length of the [`gradient`].
#[must_use]
pub fn gradient_length(plane: ArrayView2<'_, f64>) -> Array2<f64> {
    let (down, across) = gradient(plane);
    Zip::from(&down).and(&across).map_collect(|a, b| a.hypot(*b))
}

/// Unsharp masking whose amount rises with the gradient g as g^2 / (g^2 + edge^2), so that noise in flat parts is not sharpened. `edge` is in
/// units of brightness a pixel; without it, it is three times the median gradient.
///
/// # Reference
/// Own definition: the difference of unsharp masking, weighted with the Sobel gradient.
#[must_use]
pub fn sobel_guided(plane: ArrayView2<'_, f64>, sigma: f64, amount: f64, edge: Option<f64>) -> Array2<f64> {
    let lengths = gradient_length(plane);
    let edge = edge.unwrap_or_else(|| {
        let mut all: Vec<f64> = lengths.iter().copied().collect();
        let middle = all.len() / 2;
        ABOVE_NOISE * *all.select_nth_unstable_by(middle, f64::total_cmp).1
    });
    let soft = gaussian(plane, sigma);
    Zip::from(&plane).and(&soft).and(&lengths).map_collect(|v, s, g| {
        let share = if *g > 0.0 { g * g / (g * g + edge * edge) } else { 0.0 };
        v + amount * share * (v - s)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::enhance::samples::{noise, rms};
    use crate::enhance::unsharp::unsharp;
    use ndarray::s;

    #[test]
    fn a_slope_has_its_gradient() {
        let plane = Array2::from_shape_fn((8, 9), |(r, c)| 3.0 * r as f64 - 4.0 * c as f64);
        let (down, across) = gradient(plane.view());
        let inner = s![1..7, 1..8];
        assert!(down.slice(inner).iter().all(|v| (v - 3.0).abs() < 1e-12) && across.slice(inner).iter().all(|v| (v + 4.0).abs() < 1e-12));
    }

    #[test]
    fn edges_are_sharpened_as_by_unsharp_and_noise_hardly() {
        let edge = Array2::from_shape_fn((48, 48), |(_, c)| if c < 24 { 250.0 } else { 300.0 });
        let plane = &edge + &noise(48, 48, 12);
        let (guided, plain) = (sobel_guided(plane.view(), 1.5, 1.0, None), unsharp(plane.view(), 1.5, 1.0, 0.0));
        let flat = s![.., ..16];
        let added = |out: &Array2<f64>| rms((out - &plane).slice(flat).to_owned());
        assert!(added(&guided) < 0.3 * added(&plain), "{} {}", added(&guided), added(&plain));
        let step = |out: &Array2<f64>| out[[20, 24]] - out[[20, 23]] - (plane[[20, 24]] - plane[[20, 23]]);
        assert!(step(&guided) > 0.95 * step(&plain));
    }
}
