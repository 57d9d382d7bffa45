//! The response of the elements in the model of the data: what they see of an image is the image times their power pattern.

use ndarray::{Array2, Zip};

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
            Zip::from(image).and(plane).for_each(|v, r| *v *= f64::from(*r));
        }
    }

    /// Multiply an image in single precision by it.
    pub(super) fn multiply_single(&self, image: &mut Array2<f32>) {
        if let Some(plane) = &self.0 {
            Zip::from(image).and(plane).for_each(|v, r| *v *= r);
        }
    }

    /// Add the response times `factor` to a gradient: the gradient of `factor` times what the elements see in all.
    pub(super) fn add_to(&self, factor: f64, gradient: &mut Array2<f32>) {
        if let Some(plane) = &self.0 {
            Zip::from(gradient).and(plane).for_each(|g, r| *g = (f64::from(*g) + factor * f64::from(*r)) as f32);
        }
    }

    /// Sum of the image times the response.
    #[must_use]
    pub fn total(&self, image: &Array2<f64>) -> f64 {
        match &self.0 {
            None => image.sum(),
            Some(plane) => image.iter().zip(plane).map(|(v, r)| v * f64::from(*r)).sum(),
        }
    }
}
