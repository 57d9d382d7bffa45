//! Images of brightness on a grid of direction cosines.

use crate::{ArrayError, ElementPattern, NearField, PhaseCenter, Polarization, RestoringBeam, Result, SpectralWindow};
use ndarray::{Array2, Array4, ArrayView2, ArrayViewMut2, Zip, s};
use serde::{Deserialize, Serialize};

/// Frame of an image: it decides in which direction l grows along the x axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum SkyFrame {
    /// Around a celestial phase centre: l grows to the east, to the left of the picture (CDELT1 < 0).
    Sky {
        /// Right ascension of the centre, rad.
        ra_rad: f64,
        /// Declination of the centre, rad.
        dec_rad: f64,
        /// Name of the frame: `icrs` or `fk5`.
        frame: String,
    },
    /// Around a boresight: l grows to the right as seen from the sensor (CDELT1 > 0).
    Boresight,
}

impl SkyFrame {
    /// True for coordinates of equinox B1950 (FK4). They differ from those of J2000 and ICRS by 0.6 degrees.
    #[must_use]
    pub fn is_b1950(&self) -> bool {
        matches!(self, Self::Sky { frame, .. } if frame.eq_ignore_ascii_case("fk4"))
    }
}

/// A grid of direction cosines (l, m) in the orthographic (SIN) projection, with square cells.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SkyGrid {
    /// Number of cells along l (x, columns).
    pub n_l: usize,
    /// Number of cells along m (y, rows).
    pub n_m: usize,
    /// Size of a cell, rad (as a direction cosine).
    pub cell_rad: f64,
    /// Orientation and centre.
    pub frame: SkyFrame,
}

/// Largest side of an image.
const LARGEST_SIDE: usize = 65_536;

impl SkyGrid {
    /// A grid of `n_l` by `n_m` cells.
    ///
    /// # Errors
    /// A side below 2 or above 65,536, a cell that is not positive, a corner beyond the horizon (l^2 + m^2 > 1 on an axis).
    pub fn new(n_l: usize, n_m: usize, cell_rad: f64, frame: SkyFrame) -> Result<Self> {
        for n in [n_l, n_m] {
            ArrayError::unless((2..=LARGEST_SIDE).contains(&n), "image size", n, "2 to 65536 pixels a side")?;
        }
        ArrayError::unless(cell_rad.is_finite() && cell_rad > 0.0, "cell in rad", cell_rad, "a positive, finite angle")?;
        let half = cell_rad * (n_l.max(n_m) / 2) as f64;
        ArrayError::unless(
            half <= 1.0,
            "half width of the image as a direction cosine",
            format_args!("{half:.4}"),
            "at most 1 (the horizon): use a smaller cell or size",
        )?;
        Ok(Self { n_l, n_m, cell_rad, frame })
    }

    /// The frame in which a set with this phase centre is imaged.
    #[must_use]
    pub fn frame_of(center: &PhaseCenter) -> SkyFrame {
        match center.ra_dec_rad() {
            Some((ra_rad, dec_rad)) => SkyFrame::Sky { ra_rad, dec_rad, frame: center.frame.clone() },
            None => SkyFrame::Boresight,
        }
    }

    /// +1 where l grows with the column, -1 where it falls.
    #[must_use]
    pub fn l_sign(&self) -> f64 {
        match self.frame {
            SkyFrame::Sky { .. } => -1.0,
            SkyFrame::Boresight => 1.0,
        }
    }

    /// Direction cosine l of a (fractional) column: 0 at column n_l / 2.
    #[must_use]
    pub fn l_at(&self, column: f64) -> f64 {
        self.l_sign() * (column - (self.n_l / 2) as f64) * self.cell_rad
    }

    /// Direction cosine m of a (fractional) row: 0 at row n_m / 2.
    #[must_use]
    pub fn m_at(&self, row: f64) -> f64 {
        (row - (self.n_m / 2) as f64) * self.cell_rad
    }

    /// Fractional column of l.
    #[must_use]
    pub fn column_of(&self, l: f64) -> f64 {
        self.l_sign() * l / self.cell_rad + (self.n_l / 2) as f64
    }

    /// Fractional row of m.
    #[must_use]
    pub fn row_of(&self, m: f64) -> f64 {
        m / self.cell_rad + (self.n_m / 2) as f64
    }

    /// Solid angle of a cell at the centre, sr.
    #[must_use]
    pub fn cell_sr(&self) -> f64 {
        self.cell_rad * self.cell_rad
    }
}

/// Unit of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum BrightnessUnit {
    /// Brightness temperature.
    Kelvin,
    /// Flux density in each pixel.
    JyPerPixel,
    /// Flux density in each beam.
    JyPerBeam,
    /// A ratio: dirty beams, masks.
    One,
    /// Metres: range maps.
    Metre,
    /// Unknown or other.
    Other,
}

impl BrightnessUnit {
    /// BUNIT as in FITS.
    #[must_use]
    pub fn bunit(self) -> &'static str {
        match self {
            Self::Kelvin => "K",
            Self::JyPerPixel => "Jy/pixel",
            Self::JyPerBeam => "Jy/beam",
            Self::Metre => "m",
            Self::One | Self::Other => "",
        }
    }
}

impl ElementPattern {
    /// Power response at the pixels of a grid \[m, l\].
    #[must_use]
    pub fn plane(&self, grid: &SkyGrid, freq_hz: f64) -> Array2<f64> {
        Array2::from_shape_fn((grid.n_m, grid.n_l), |(row, column)| self.power(grid.l_at(column as f64), grid.m_at(row as f64), freq_hz))
    }
}

/// Brightness \[chan, pol, m, l\], in double precision unless another one is named.
#[derive(Debug, Clone, PartialEq)]
pub struct Image<P = f64> {
    /// Where the pixels are.
    pub grid: SkyGrid,
    /// Channels of the image (one for a multi-frequency image).
    pub spectrum: SpectralWindow,
    /// Polarisations.
    pub polarizations: Vec<Polarization>,
    /// Values \[chan, pol, m, l\].
    pub data: Array4<P>,
    /// Unit of the values.
    pub unit: BrightnessUnit,
    /// Beam of each channel; empty where there is none.
    pub beams: Vec<RestoringBeam>,
    /// Name of the object or scene.
    pub object: String,
    /// Telescope name.
    pub telescope: String,
    /// Mid-time of the observation, Julian date UTC, where known.
    pub time_jd: Option<f64>,
    /// Constant that was removed from the scene and is already added back in `data`, K.
    pub pedestal_k: Option<f64>,
    /// Power pattern of the elements that the values contain: they are brightness times it. `None`: they are brightness.
    pub pattern: ElementPattern,
    /// Power pattern of the elements that dimmed what was measured, of an image of brightness without it. Where it is small, the values are not measured.
    pub seen_through: ElementPattern,
    /// Where the scene of the visibilities lies, and the point to which they were phased.
    pub near_field: NearField,
    /// History of the image, oldest first.
    pub history: Vec<String>,
}

impl<P> Image<P> {
    /// An image without beam, names or history.
    ///
    /// # Errors
    /// Data that is not \[chan, pol, m, l\].
    pub fn new(
        grid: SkyGrid,
        spectrum: SpectralWindow,
        polarizations: Vec<Polarization>,
        data: Array4<P>,
        unit: BrightnessUnit,
    ) -> Result<Self> {
        let expected = [spectrum.n_chan(), polarizations.len(), grid.n_m, grid.n_l];
        ArrayError::unless_shape("image", data.shape(), &expected)?;
        Ok(Self {
            grid,
            spectrum,
            polarizations,
            data,
            unit,
            beams: Vec::new(),
            object: String::new(),
            telescope: String::new(),
            time_jd: None,
            pedestal_k: None,
            pattern: ElementPattern::None,
            seen_through: ElementPattern::None,
            near_field: NearField::default(),
            history: Vec::new(),
        })
    }

    /// One plane \[m, l\].
    #[must_use]
    pub fn plane(&self, chan: usize, pol: usize) -> ArrayView2<'_, P> {
        self.data.slice(s![chan, pol, .., ..])
    }

    /// One plane \[m, l\], to change.
    pub fn plane_mut(&mut self, chan: usize, pol: usize) -> ArrayViewMut2<'_, P> {
        self.data.slice_mut(s![chan, pol, .., ..])
    }
}

impl From<Image<f32>> for Image {
    fn from(image: Image<f32>) -> Self {
        Self {
            data: Zip::from(&image.data).par_map_collect(|v| f64::from(*v)),
            grid: image.grid,
            spectrum: image.spectrum,
            polarizations: image.polarizations,
            unit: image.unit,
            beams: image.beams,
            object: image.object,
            telescope: image.telescope,
            time_jd: image.time_jd,
            pedestal_k: image.pedestal_k,
            pattern: image.pattern,
            seen_through: image.seen_through,
            near_field: image.near_field,
            history: image.history,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn l_grows_to_the_left_on_the_sky_and_to_the_right_at_a_boresight() {
        let sky = SkyGrid::new(8, 8, 1e-3, SkyFrame::Sky { ra_rad: 0.0, dec_rad: 0.0, frame: "icrs".into() }).unwrap();
        let bore = SkyGrid::new(8, 8, 1e-3, SkyFrame::Boresight).unwrap();
        assert_eq!(sky.l_at(3.0), 1e-3);
        assert_eq!(bore.l_at(5.0), 1e-3);
        assert_eq!(sky.column_of(sky.l_at(2.5)), 2.5);
        assert_eq!(bore.row_of(bore.m_at(6.0)), 6.0);
    }

    #[test]
    fn a_plane_holds_the_power_of_a_pattern_at_each_pixel() {
        let grid = SkyGrid::new(6, 4, 0.01, SkyFrame::Boresight).unwrap();
        let pattern: ElementPattern = "gaussian fwhm_rad=0.05".parse().unwrap();
        let plane = pattern.plane(&grid, 1e9);
        assert_eq!((plane.dim(), plane[[2, 3]]), ((4, 6), 1.0));
        assert_eq!(plane[[0, 5]], pattern.power(grid.l_at(5.0), grid.m_at(0.0), 1e9));
    }

    #[test]
    fn impossible_sizes_are_refused() {
        for (n, cell) in [(0, 1e-3), (1, 1e-3), (1_000_000, 1e-9), (512, 0.0), (512, f64::NAN), (512, 0.1)] {
            assert!(SkyGrid::new(n, n, cell, SkyFrame::Boresight).is_err(), "{n} {cell}");
        }
    }
}
