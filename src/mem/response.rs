//! The response of the elements in the model of the data: what they see of an image is the image times their power pattern.

use ndarray::{Array2, Axis, Zip};
use rayon::prelude::*;

/// The power pattern at the pixels of an image \[m, l\]; 1 everywhere where there is none.
#[derive(Debug, Clone, Default)]
pub struct Response(Option<Array2<f32>>);

impl Response {
    /// Of a pattern \[m, l\].
    #[must_use]
    pub fn of(pattern: &Array2<f64>) -> Self {
        Self(Some(pattern.mapv(|v| v as f32)))
    }

    /// True if it is 1 everywhere.
    #[must_use]
    pub fn is_one(&self) -> bool {
        self.0.is_none()
    }

    /// The values \[m, l\], if they are not all 1.
    pub(super) fn plane(&self) -> Option<&Array2<f32>> {
        self.0.as_ref()
    }

    /// Multiply an image by it.
    pub fn multiply(&self, image: &mut Array2<f64>) {
        if let Some(plane) = &self.0 {
            Zip::from(image).and(plane).par_for_each(|v, r| *v *= f64::from(*r));
        }
    }

    /// Multiply an image in single precision by it.
    pub(super) fn multiply_single(&self, image: &mut Array2<f32>) {
        if let Some(plane) = &self.0 {
            Zip::from(image).and(plane).par_for_each(|v, r| *v *= r);
        }
    }

    /// Add the response times `factor` to a gradient: the gradient of `factor` times what the elements see in all.
    pub(super) fn add_to(&self, factor: f64, gradient: &mut Array2<f32>) {
        if let Some(plane) = &self.0 {
            Zip::from(gradient).and(plane).par_for_each(|g, r| *g = (f64::from(*g) + factor * f64::from(*r)) as f32);
        }
    }

    /// Sum of the image times the response.
    #[must_use]
    pub fn total(&self, image: &Array2<f64>) -> f64 {
        match &self.0 {
            None => in_lines(image.axis_iter(Axis(0)).into_par_iter().map(|line| line.sum())),
            Some(plane) => {
                let lines = image.axis_iter(Axis(0)).into_par_iter().zip(plane.axis_iter(Axis(0)));
                in_lines(lines.map(|(line, plane)| line.iter().zip(plane).map(|(v, r)| v * f64::from(*r)).sum()))
            }
        }
    }
}

/// The sum of the sums of lines, in their order.
fn in_lines(sums: impl IndexedParallelIterator<Item = f64>) -> f64 {
    sums.collect::<Vec<f64>>().iter().sum()
}
