//! The sum of the visibilities in each cell of the Fourier grid of an image, without a kernel.

use super::imager::Imager;
use crate::Result;
use crate::progress::{Event, Observer};
use crate::values::need;
use cittert_arrays::{SPEED_OF_LIGHT_M_S, UvGrid};
use ndarray::Array3;
use num_complex::Complex64;

/// Size in bytes of a cell: its sum, its weight and its count.
const CELL_BYTES: usize = 32;

impl Imager<'_> {
    /// Sum the visibilities of each output channel in the nearest cell of the Fourier grid, with the imaging weights. The w term is not included.
    ///
    /// # Errors
    /// The grid is larger than the memory budget, or the source fails.
    pub fn cells(&mut self, observer: &dyn Observer) -> Result<UvGrid> {
        let (n_u, n_v, channels) = (self.grid().n_l, self.grid().n_m, self.channels().to_vec());
        let most = self.options().memory.bytes() / CELL_BYTES;
        let value = format!("{n_u} x {n_v} with {} output channels", channels.len());
        let fits = channels.len().saturating_mul(n_u * n_v) <= most;
        need("size", value, fits, format!("at most {most} cells in the memory budget"))?;
        let cell_wl = [1.0 / (n_u as f64 * self.grid().cell_rad), 1.0 / (n_v as f64 * self.grid().cell_rad)];
        let shape = (channels.len(), n_v, n_u);
        let freq_hz = self.header().spectrum.freq_hz().to_vec();
        let mut grid = UvGrid {
            sum: Array3::zeros(shape),
            weights: Array3::zeros(shape),
            counts: Array3::zeros(shape),
            cell_wl,
            spectrum: self.spectrum_out()?,
            polarization: self.options().pol,
            unit: self.header().unit,
            n_outside: 0,
            history: self.header().history.clone(),
        };
        observer.event(Event::Phase { name: "gridding", total: Some(self.survey().counts.total), unit: "vis" });
        self.for_each_weighed(observer, |block| {
            for (k, range) in channels.iter().enumerate() {
                for ((row, chan), w) in block.imaging().indexed_iter().filter(|((_, c), w)| range.contains(c) && **w > 0.0) {
                    let scale = freq_hz[chan] / SPEED_OF_LIGHT_M_S;
                    let (u, v) = (block.uvw_m[(row, 0)] * scale, block.uvw_m[(row, 1)] * scale);
                    let fold = v < 0.0 || (v == 0.0 && u < 0.0);
                    let (u, v) = if fold { (-u, -v) } else { (u, v) };
                    let column = (u / cell_wl[0]).round() + (n_u / 2) as f64;
                    let line = (v / cell_wl[1]).round() + (n_v / 2) as f64;
                    if !(column >= 0.0 && column < n_u as f64 && line >= 0.0 && line < n_v as f64) {
                        grid.n_outside += 1;
                        continue;
                    }
                    let vis = block.vis[(row, chan)];
                    let vis = Complex64::new(f64::from(vis.re), f64::from(if fold { -vis.im } else { vis.im }));
                    let at = (k, line as usize, column as usize);
                    grid.sum[at] += vis * f64::from(*w);
                    grid.weights[at] += f64::from(*w);
                    grid.counts[at] += 1;
                }
            }
            Ok(())
        })?;
        observer.event(Event::Done);
        Ok(grid)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures;
    use crate::imaging::ImagingOptions;
    use crate::progress::Silent;
    use cittert_arrays::{Polarization, VisUnit};

    /// All weight arrives in the grid, and a point at the centre gives its flux in every cell that is hit.
    #[test]
    fn a_point_at_the_centre_fills_every_cell_with_its_flux() {
        let antennas = fixtures::positions(12, 100.0, 0.0, 3);
        let mut set = fixtures::snapshot(&antennas, &[1.0e9, 1.1e9], &[Polarization::I], &[(0.0, 0.0, 2.0)], (0.0, VisUnit::Jy));
        let total: f64 = set.data.weights.iter().map(|w| f64::from(*w)).sum();
        let options = ImagingOptions { size: Some(crate::imaging::ImageSize::square(256)), ..ImagingOptions::default() };
        let mut imager = Imager::new(&mut set, options, &Silent).unwrap();
        let grid = imager.cells(&Silent).unwrap();
        grid.check().unwrap();
        assert!((grid.weights.sum() / total - 1.0).abs() < 1e-6 && grid.n_outside == 0);
        for (sum, w) in grid.sum.iter().zip(&grid.weights).filter(|(_, w)| **w > 0.0) {
            assert!((sum / w - 2.0).norm() < 1e-5);
        }
    }
}
