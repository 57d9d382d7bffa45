//! How finely sky, surfaces and air are tabulated.

use crate::error::{Result, SceneError};

/// Accuracy of the tables of a tracer.
///
/// Half or twice any of these values changes the scenes that ship by less than 0.02 K rms (test
/// `half_or_twice_an_option_changes_a_picture_little`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TableOptions {
    /// Largest interpolation error of a surface that mirrors, K, for radiation of 300 K. The default is far below the noise of any
    /// radiometer, and such tables cost little.
    pub mirror_k: f64,
    /// Largest interpolation error of a surface of facets, K. Every entry of such a table is an integral over slopes.
    pub facets_k: f64,
    /// Largest number of intervals of a table of facets. It limits the time for a surface whose error falls slowly near grazing
    /// incidence. [`super::SurfaceTable::error_k`] gives the error that is left.
    pub facet_intervals: usize,
    /// Number of intervals of a sky table between zenith and horizon. The sky changes fastest within 1 degree of the horizon.
    pub sky_intervals: usize,
    /// Largest error of the sky of a spherical Earth before it is tabulated, K.
    pub sky_k: f64,
    /// Greatest rise of a piece of a path that has one temperature, km. In 0.2 km the temperature of air falls by 1.3 K, and an opaque
    /// piece is wrong by at most half of that.
    pub path_rise_km: f64,
}

impl Default for TableOptions {
    fn default() -> Self {
        Self { mirror_k: 0.003, facets_k: 0.05, facet_intervals: 256, sky_intervals: 1024, sky_k: 2e-3, path_rise_km: 0.2 }
    }
}

impl TableOptions {
    /// Checks the ranges.
    ///
    /// # Errors
    /// [`SceneError::BadValue`] for a value outside its range.
    pub fn check(&self) -> Result<()> {
        for (what, value) in [("tables.mirror_k", self.mirror_k), ("tables.facets_k", self.facets_k), ("tables.sky_k", self.sky_k)] {
            SceneError::unless((1e-3..=10.0).contains(&value), what, value, "1e-3 to 10 K")?;
        }
        let (facets, sky, rise) = (self.facet_intervals, self.sky_intervals, self.path_rise_km);
        SceneError::unless((64..=4096).contains(&facets), "tables.facet_intervals", facets, "64 to 4096")?;
        SceneError::unless((16..=65536).contains(&sky), "tables.sky_intervals", sky, "16 to 65536")?;
        SceneError::unless((0.01..=30.0).contains(&rise), "tables.path_rise_km", rise, "0.01 to 30 km")
    }
}
