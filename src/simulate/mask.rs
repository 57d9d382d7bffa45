//! The u-v mask of an array on the grid of the FFT, and visibilities that are sampled with it.
//!
//! The FFT of a scene of N cells of size d has N cells of 1 / (N d) wavelengths. Method `mask` gives each visibility the value of the nearest
//! cell, which is the traditional way to simulate aperture-plane imagers. The uvw of the set are not changed: with several channels, no baseline
//! in metres could be at the centre of a cell in every channel. The error of the method comes from the shift to the centre of the cell. It grows
//! with the distance from the phase centre: for shifts that are evenly distributed over the cell, a source at l is reduced by
//! sinc(l / width of the frame).

use crate::fourier;
use crate::{ChainError, Result, ensure};
use cittert_arrays::{SPEED_OF_LIGHT_M_S, SkyGrid, SpectralWindow, UvCoverage};
use ndarray::{Array2, ArrayView2, Axis};
use num_complex::Complex64;

/// The cell (column, row) of the Fourier grid nearest to (u, v) in wavelengths, with u = 0 at n / 2. `None` if it is outside the grid.
fn nearest_cell(n_u: usize, n_v: usize, cell_rad: f64, u: f64, v: f64) -> Option<(usize, usize)> {
    let index = |n: usize, x: f64| {
        let k = (x * n as f64 * cell_rad).round() + (n / 2) as f64;
        (k >= 0.0 && k < n as f64).then_some(k as usize)
    };
    Some((index(n_u, u)?, index(n_v, v)?))
}

/// The FFT of a plane, sampled at the nearest cell.
pub(crate) struct MaskPlane {
    cell_rad: f64,
    /// Visibilities \[v, u\], zero at the middle.
    cells: Array2<Complex64>,
}

impl MaskPlane {
    /// Transform a plane \[m, l\].
    pub(crate) fn new(grid: &SkyGrid, plane: &Array2<f64>) -> Result<Self> {
        Ok(Self { cell_rad: grid.cell_rad, cells: fourier::image_to_uv_grid(grid, plane.view())? })
    }

    pub(crate) fn bytes(&self) -> usize {
        16 * self.cells.len()
    }

    /// Values \[row, freq\]. `outside(row, freq)` is called for each visibility outside the grid; its value is 0.
    pub(crate) fn predict(&self, uvw_m: ArrayView2<'_, f64>, freq_hz: &[f64], mut outside: impl FnMut(usize, usize)) -> Array2<Complex64> {
        let (n_v, n_u) = self.cells.dim();
        let mut out = Array2::zeros((uvw_m.nrows(), freq_hz.len()));
        for ((row, f), value) in out.indexed_iter_mut() {
            let k = freq_hz[f] / SPEED_OF_LIGHT_M_S;
            match nearest_cell(n_u, n_v, self.cell_rad, uvw_m[[row, 0]] * k, uvw_m[[row, 1]] * k) {
                Some((u, v)) => *value = self.cells[[v, u]],
                None => outside(row, f),
            }
        }
        out
    }
}

/// The number of visibilities of an array in each cell of the Fourier grid, over a band. Each visibility counts at (u, v) and, because the scene
/// is real, at (-u, -v).
#[derive(Debug, Clone, PartialEq)]
pub struct UvMask {
    /// Number of visibilities in each cell \[v, u\]. u = 0 is column n / 2; u increases to the right, v upwards.
    pub counts: Array2<u32>,
    /// Width of a cell along u, wavelengths.
    pub cell_u: f64,
    /// Height of a cell along v, wavelengths.
    pub cell_v: f64,
    /// Size of the image cell, rad.
    pub image_cell_rad: f64,
    /// Number of visibilities. A visibility and its conjugate count as one.
    pub samples: u64,
    /// Number of these that are outside the grid.
    pub outside: u64,
    /// Longest baseline in the band, wavelengths.
    pub longest_wavelengths: f64,
    /// The band.
    pub spectrum: SpectralWindow,
}

impl UvMask {
    /// An empty mask for images on `grid` in the channels of `spectrum`.
    fn empty(grid: &SkyGrid, spectrum: SpectralWindow) -> Self {
        let cell = |n: usize| 1.0 / (n as f64 * grid.cell_rad);
        Self {
            counts: Array2::zeros((grid.n_m, grid.n_l)),
            cell_u: cell(grid.n_l),
            cell_v: cell(grid.n_m),
            image_cell_rad: grid.cell_rad,
            samples: 0,
            outside: 0,
            longest_wavelengths: 0.0,
            spectrum,
        }
    }

    /// Count the rows of a block in every channel. Autocorrelations are left out.
    fn add(&mut self, coverage: &UvCoverage) {
        let (n_v, n_u) = self.counts.dim();
        let pairs = coverage.ant1.iter().zip(&coverage.ant2);
        for (uvw, _) in coverage.uvw_m.axis_iter(Axis(0)).zip(pairs).filter(|(_, (a, b))| a != b) {
            for freq in self.spectrum.freq_hz() {
                let k = freq / SPEED_OF_LIGHT_M_S;
                let (u, v) = (uvw[0] * k, uvw[1] * k);
                self.longest_wavelengths = self.longest_wavelengths.max(u.hypot(v));
                self.samples += 1;
                let cells = [nearest_cell(n_u, n_v, self.image_cell_rad, u, v), nearest_cell(n_u, n_v, self.image_cell_rad, -u, -v)];
                self.outside += u64::from(cells == [None, None]);
                for (u, v) in cells.into_iter().flatten() {
                    let count = &mut self.counts[[v, u]];
                    *count = count.saturating_add(1);
                }
            }
        }
    }

    /// Number of cells with at least one visibility.
    #[must_use]
    pub fn cells_hit(&self) -> usize {
        self.counts.iter().filter(|c| **c > 0).count()
    }

    /// Number of filled cells divided by the number of cells of the grid whose centres lie within the longest baseline; 0 without samples.
    #[must_use]
    pub fn disc_fraction(&self) -> f64 {
        let (n_v, n_u) = self.counts.dim();
        // The radius is larger by half a cell: the centre of the cell with the longest baseline may lie beyond that baseline.
        let (a, b) = (self.longest_wavelengths / self.cell_u + 0.5, self.longest_wavelengths / self.cell_v + 0.5);
        let within = |((v, u), _): &((usize, usize), &u32)| {
            let (x, y) = (*u as f64 - (n_u / 2) as f64, *v as f64 - (n_v / 2) as f64);
            (x / a).powi(2) + (y / b).powi(2) <= 1.0
        };
        let (cells, hit) =
            self.counts.indexed_iter().filter(within).fold((0_u64, 0_u64), |(n, hit), (_, c)| (n + 1, hit + u64::from(*c > 0)));
        if self.samples == 0 || cells == 0 { 0.0 } else { hit as f64 / cells as f64 }
    }

    /// Number of filled cells divided by the number of all cells.
    #[must_use]
    pub fn grid_fraction(&self) -> f64 {
        self.cells_hit() as f64 / self.counts.len() as f64
    }

    /// Mean number of visibilities in a filled cell. It is 1 if no two visibilities share a cell, and 0 without visibilities.
    #[must_use]
    pub fn visibilities_per_cell(&self) -> f64 {
        let hits: f64 = self.counts.iter().map(|c| f64::from(*c)).sum();
        let cells = self.cells_hit();
        if cells == 0 { 0.0 } else { hits / cells as f64 }
    }
}

/// The mask of all rows of an iterator.
///
/// # Errors
/// The iterator fails, or no row is a baseline between two antennas.
pub fn uv_mask(
    grid: &SkyGrid,
    spectrum: &SpectralWindow,
    rows: &mut dyn Iterator<Item = cittert_arrays::Result<UvCoverage>>,
) -> Result<UvMask> {
    let mut mask = UvMask::empty(grid, spectrum.clone());
    for coverage in rows {
        mask.add(&coverage?);
    }
    ensure!(mask.samples > 0, ChainError::NoData("the coverage holds no baseline between two antennas".into()));
    Ok(mask)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::dft::image_dft;
    use cittert_arrays::SkyFrame;

    fn coverage(uv: &[(f64, f64)]) -> UvCoverage {
        let n = uv.len();
        let uvw = Array2::from_shape_fn((n, 3), |(r, k)| [uv[r].0, uv[r].1, 0.0][k]);
        UvCoverage::new(uvw, vec![0; n], vec![1; n], vec![0.0; n], vec![1.0; n], vec![0; n]).unwrap()
    }

    #[test]
    fn hits_fill_and_redundancy_of_a_known_pattern() {
        // At 299.792458 MHz a metre is a wavelength; 16 cells of 1/64 rad make u-v cells of 4 wavelengths.
        let grid = SkyGrid::new(16, 16, 1.0 / 64.0, SkyFrame::Boresight).unwrap();
        let spectrum = SpectralWindow::new(vec![299_792_458.0], vec![1e6]).unwrap();
        let rows = coverage(&[(4.0, 0.0), (4.5, 0.5), (0.0, 8.0), (500.0, 0.0)]);
        let mut mask = uv_mask(&grid, &spectrum, &mut std::iter::once(Ok(rows))).unwrap();
        assert_eq!((mask.cell_u, mask.cell_v, mask.samples, mask.outside), (4.0, 4.0, 4, 1));
        assert_eq!(mask.counts[[8, 9]], 2);
        assert_eq!(mask.counts[[8, 7]], 2, "the conjugate");
        assert_eq!((mask.counts[[10, 8]], mask.counts[[6, 8]]), (1, 1));
        assert_eq!(mask.cells_hit(), 4);
        assert!((mask.visibilities_per_cell() - 1.5).abs() < 1e-15);
        assert!((mask.grid_fraction() - 4.0 / 256.0).abs() < 1e-15);
        // Within 8 wavelengths (two cells and a half): 21 cells.
        mask.longest_wavelengths = 8.0;
        assert!((mask.disc_fraction() - 4.0 / 21.0).abs() < 1e-15, "{}", mask.disc_fraction());
    }

    #[test]
    fn sampled_values_are_the_exact_sums_at_the_cell_centres() {
        for (frame, n_l, n_m) in [
            (SkyFrame::Boresight, 12, 9),
            (SkyFrame::Sky { ra_rad: 0.0, dec_rad: 0.0, frame: "icrs".into() }, 12, 10),
            (SkyFrame::Sky { ra_rad: 0.0, dec_rad: 0.0, frame: "icrs".into() }, 7, 8),
        ] {
            let grid = SkyGrid::new(n_l, n_m, 1.0 / 64.0, frame).unwrap();
            let plane = Array2::from_shape_fn((n_m, n_l), |(r, c)| ((3 * r + 5 * c) % 7) as f64);
            let mask = MaskPlane::new(&grid, &plane).unwrap();
            let (du, dv) = (64.0 / n_l as f64, 64.0 / n_m as f64);
            let centres = coverage(&[(0.0, 0.0), (3.0 * du, -2.0 * dv), (-2.0 * du, 3.0 * dv), (-3.0 * du, -4.0 * dv)]);
            let near = coverage(&[(0.4 * du, 0.4 * dv), (2.6 * du, -2.4 * dv), (-1.6 * du, 3.4 * dv), (-3.3 * du, -4.0 * dv)]);
            let truth = image_dft(&grid, plane.view(), centres.uvw_m.view(), &[299_792_458.0], false).unwrap();
            let mut outside = 0;
            let vis = mask.predict(near.uvw_m.view(), &[299_792_458.0], |_, _| outside += 1);
            assert_eq!(outside, 0);
            for (a, b) in vis.iter().zip(&truth) {
                assert!((a - b).norm() < 1e-11, "{a} {b}");
            }
        }
    }
}
