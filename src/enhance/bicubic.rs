//! Bicubic upsampling.

use super::resample::{Kernel, Placing, resample};
use super::step::{Given, Step};
use crate::Result;
use ndarray::{Array2, ArrayView2};

#[derive(Debug)]
struct Bicubic {
    factor: usize,
    slope: f64,
}

impl Step for Bicubic {
    fn apply(&self, frame: Array2<f64>) -> Result<Array2<f64>> {
        Ok(bicubic(frame.view(), self.factor, self.slope, Placing::Reference))
    }

    fn factor(&self) -> usize {
        self.factor
    }
}

pub(super) fn make(given: &Given<'_>) -> Result<Box<dyn Step>> {
    Ok(Box::new(Bicubic { factor: given.whole(0), slope: given.number(1) }))
}

/// A plane \[m, l\] with `factor` times as many pixels along each axis, by cubic convolution whose kernel has the slope `slope` at distance 1:
/// -0.5 continues parabolas exactly, -0.75 (OpenCV) is sharper.
///
/// # Reference
/// Keys 1981, IEEE Trans. ASSP 29, 1153, whose slope is -0.5.
#[must_use]
pub fn bicubic(plane: ArrayView2<'_, f64>, factor: usize, slope: f64, placing: Placing) -> Array2<f64> {
    let value = |x: f64| match x {
        x if x < 1.0 => ((slope + 2.0) * x - (slope + 3.0)) * x * x + 1.0,
        x if x < 2.0 => slope * (((x - 5.0) * x + 8.0) * x - 4.0),
        _ => 0.0,
    };
    resample(plane, factor, &Kernel { reach: 2, value }, placing)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::s;

    #[test]
    fn the_slope_of_keys_continues_parabolas() {
        let plane = Array2::from_shape_fn((12, 11), |(r, c)| (r * r) as f64 - 2.0 * (c * c) as f64 + (r * c) as f64);
        let out = bicubic(plane.view(), 3, -0.5, Placing::Edges);
        let at = |(r, c): (usize, usize)| {
            let (y, x) = ((r as f64 + 0.5) / 3.0 - 0.5, (c as f64 + 0.5) / 3.0 - 0.5);
            y * y - 2.0 * x * x + y * x
        };
        // Away from the border, where the reflected frame is no parabola.
        let inner = out.slice(s![6..30, 6..27]);
        assert!(inner.indexed_iter().all(|((r, c), v)| (v - at((r + 6, c + 6))).abs() < 1e-10));
    }
}
