//! Gridded visibilities as HDF5.
//!
//! Datasets `sum` (compound r, i), `weights` and `counts`, each \[chan, v, u\]; `cell_wl` (u, v); `freq_hz`, `channel_width_hz`; texts
//! `polarization`, `unit`, `history`; the number `n_outside`.

use crate::h5::H5Out;
use crate::{FormatError, Result};
use cittert_arrays::UvGrid;
use ndarray::ArrayView1;
use std::path::Path;

/// Write a grid.
///
/// # Errors
/// Arrays of different shapes, an existing output that may not be overwritten, or an error of the file system.
pub fn write_grid(path: &Path, grid: &UvGrid, overwrite: bool) -> Result<()> {
    grid.check().map_err(|e| FormatError::values(path, e))?;
    let out = H5Out::create(path, overwrite)?;
    out.array("sum", grid.sum.view())?;
    out.array("weights", grid.weights.view())?;
    out.array("counts", grid.counts.view())?;
    out.array("cell_wl", ArrayView1::from(&grid.cell_wl))?;
    out.array("freq_hz", ArrayView1::from(grid.spectrum.freq_hz()))?;
    out.array("channel_width_hz", ArrayView1::from(grid.spectrum.width_hz()))?;
    out.text("polarization", grid.polarization.name())?;
    out.text("unit", grid.unit.name())?;
    out.text("history", &grid.history.join("\n"))?;
    out.scalar("n_outside", grid.n_outside)?;
    out.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::{Polarization, SpectralWindow, VisUnit};
    use ndarray::Array3;
    use num_complex::Complex64;

    #[test]
    fn a_grid_is_written_whole_and_not_over_another() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("g.h5");
        let mut grid = UvGrid {
            sum: Array3::zeros((2, 4, 4)),
            weights: Array3::ones((2, 4, 4)),
            counts: Array3::zeros((2, 4, 4)),
            cell_wl: [10.0, 20.0],
            spectrum: SpectralWindow::band(1e9, 1e6, 2).unwrap(),
            polarization: Polarization::I,
            unit: VisUnit::Jy,
            n_outside: 3,
            history: vec!["made".into()],
        };
        grid.sum[[1, 2, 3]] = Complex64::new(1.0, -2.0);
        write_grid(&path, &grid, false).unwrap();
        let file = crate::h5::open(&path, "").unwrap();
        let sum: Array3<Complex64> = file.require("sum").unwrap().read().unwrap();
        assert_eq!(sum, grid.sum);
        assert_eq!(file.list("cell_wl", 2).unwrap(), [10.0, 20.0]);
        assert_eq!(file.require_real("n_outside").unwrap(), 3.0);
        assert!(write_grid(&path, &grid, false).is_err());
        grid.weights = Array3::ones((1, 4, 4));
        assert!(write_grid(&path, &grid, true).is_err());
    }
}
