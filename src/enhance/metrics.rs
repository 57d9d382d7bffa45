//! Figures of an image before and after its enhancement.

use super::border::{line, mean};
use super::edge_response::{EdgeResponse, Edges};
use super::target::{Target, TargetContrast};
use crate::Result;
use crate::fidelity::{CompareOptions, Fidelity, compare};
use cittert_arrays::{Image, SkyGrid};
use ndarray::{ArrayView2, s};

/// Figures of the first plane of an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Metrics {
    /// Mean of all pixels.
    pub mean: f64,
    /// Standard deviation of the noise, see [`noise_level`].
    pub noise: f64,
    /// Standard deviation of all pixels over that of the noise; infinite without noise.
    pub snr: f64,
    /// The mean profile across the steepest edges, where there are enough.
    pub edge: Option<EdgeResponse>,
    /// The marked target.
    pub target: Option<TargetContrast>,
    /// The scores against the truth.
    pub truth: Option<Fidelity>,
}

/// What images are measured against: the places of edges, a target and the truth.
#[derive(Debug, Clone)]
pub struct Measure<'a> {
    grid: SkyGrid,
    edges: Edges,
    target: Option<Target>,
    truth: Option<&'a Image>,
}

impl<'a> Measure<'a> {
    /// A measure for images of the field of `image`. The edges are those of the truth, where there is one, or of `image`.
    ///
    /// # Errors
    /// A target that is not in the image.
    pub fn new(image: &Image, target: Option<Target>, truth: Option<&'a Image>) -> Result<Self> {
        target.map_or(Ok(()), |target| target.check(&image.grid))?;
        Ok(Self { grid: image.grid.clone(), edges: Edges::of(truth.unwrap_or(image)), target, truth })
    }

    /// The figures of an image.
    ///
    /// # Errors
    /// A truth of another part of the sky, or one that is 0 everywhere.
    pub fn metrics(&self, image: &Image) -> Result<Metrics> {
        let plane = image.plane(0, 0);
        let truth = self.truth.map(|truth| compare(image, truth, &CompareOptions::default()).map(|c| c.scores)).transpose()?;
        let spacing = (self.grid.cell_rad / image.grid.cell_rad).round().max(1.0) as usize;
        let noise = noise_level(plane, spacing);
        Ok(Metrics {
            mean: mean(plane),
            noise,
            snr: plane.std(0.0) / noise,
            edge: self.edges.response(image),
            target: self.target.and_then(|target| target.contrast(&self.grid, image)),
            truth,
        })
    }
}

/// Standard deviation of the noise of a plane, from the difference of two Laplacians, which does not see slopes and curvatures; a minority of edges
/// hardly changes its median. Only every `spacing`th pixel counts, with the reference pixel n / 2 among them: after an upsampling by 3, these are the old
/// pixels. 0 for a plane of fewer than three such pixels.
///
/// # Reference
/// Immerkaer 1996, Comput. Vis. Image Underst. 64, 300, with the median in place of the mean.
#[must_use]
pub fn noise_level(plane: ArrayView2<'_, f64>, spacing: usize) -> f64 {
    let (first_m, first_l) = (plane.nrows() / 2 % spacing, plane.ncols() / 2 % spacing);
    let plane = plane.slice(s![first_m..;spacing, first_l..;spacing]).as_standard_layout().into_owned();
    let (n_m, n_l) = plane.dim();
    let (rows, columns) = (n_m.saturating_sub(2), n_l.saturating_sub(2));
    let mut all = Vec::with_capacity(rows * columns);
    for r in 0..rows {
        let (a, b, d) = (line(&plane, r), line(&plane, r + 1), line(&plane, r + 2));
        let second = |row: &[f64], c: usize| row[c] - 2.0 * row[c + 1] + row[c + 2];
        // The squares of the weights add up to 36.
        all.extend((0..columns).map(|c| ((second(a, c) - 2.0 * second(b, c) + second(d, c)) / 6.0).abs()));
    }
    if all.is_empty() {
        return 0.0;
    }
    let middle = all.len() / 2;
    // The median of the absolute value of a normal variable of standard deviation 1.
    *all.select_nth_unstable_by(middle, f64::total_cmp).1 / 0.674_489_750_196_082
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::enhance::samples::noise;
    use ndarray::Array2;

    #[test]
    fn the_noise_is_found_under_slopes_and_edges() {
        let scene = Array2::from_shape_fn((128, 128), |(r, c)| 0.02 * (r * r) as f64 + 3.0 * c as f64 + if r > c { 80.0 } else { 0.0 });
        let found = noise_level((&scene + &(noise(128, 128, 1) * 0.7)).view(), 1);
        // The 16,000 correlated differences give about 2 %; those that meet the edge are 3 % of all.
        assert!((found / 0.7 - 1.0).abs() < 0.08, "{found}");
        assert!(noise_level(scene.view(), 1) < 1e-9);
        assert_eq!(noise_level(scene.slice(ndarray::s![..2, ..]), 1), 0.0);
    }

    #[test]
    fn an_upsampled_plane_has_the_noise_of_its_old_pixels() {
        let plane = noise(96, 96, 2);
        let fine = crate::enhance::lanczos(plane.view(), 2, 3, crate::enhance::Placing::Reference);
        let (old, new) = (noise_level(plane.view(), 1), noise_level(fine.view(), 2));
        assert!((new / old - 1.0).abs() < 1e-9, "{old} {new}");
    }
}
