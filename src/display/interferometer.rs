//! The interferometer beside the camera: an image of the same scene in the time of one frame.

use crate::imaging::{ImageSize, Imager, ImagingOptions, dirty_image};
use crate::mem::{MemInputs, MemOptions, Uncertainty, mem};
use crate::progress::Silent;
use crate::simulate::{SimulateOptions, SkyModel, TrackOptions, simulate_set};
use crate::values::need;
use crate::{ChainError, Result, ensure};
use cittert_arrays::quantity::{Angle, Duration, Frequency};
use cittert_arrays::{
    ArrayLayout, BrightnessUnit, FigureOptions, Image, LayoutFrame, SPEED_OF_LIGHT_M_S, SkyGrid, SpectralWindow, VisUnit,
};
use ndarray::Array2;
use serde::{Deserialize, Serialize};

/// How the image of the interferometer is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum ArrayImage {
    /// The dirty image.
    #[default]
    Dirty,
    /// Maximum entropy.
    Mem,
}

/// Cells across a fringe of the longest baseline that the fit of the beam needs.
const CELLS: f64 = 4.0;
/// Most cells of the image across a cell of the frame.
const FINEST: usize = 15;

/// An array of antennas that looks along its boresight, and how its images are made.
#[derive(Debug, Clone)]
pub struct Interferometer {
    layout: ArrayLayout,
    spectrum: SpectralWindow,
    grid: SkyGrid,
    kind: ArrayImage,
    integration: Duration,
    simulate: SimulateOptions,
    /// Cells of the image across a cell of the frame, an odd number: frames may be coarser than the beam.
    finer: usize,
}

impl Interferometer {
    /// For scenes on a grid, and frames of the length `integration`. The noise follows from the options and the layout, as in `simulate`.
    ///
    /// # Errors
    /// An array on the Earth, or one whose beam is far smaller than a cell of the grid.
    pub fn new(
        layout: ArrayLayout,
        spectrum: SpectralWindow,
        grid: &SkyGrid,
        kind: ArrayImage,
        integration: Duration,
        simulate: SimulateOptions,
    ) -> Result<Self> {
        let told = || format!("layout {:?} stands on the Earth; a moving camera needs one that looks along its boresight", layout.name);
        ensure!(layout.frame == LayoutFrame::Boresight, ChainError::Incompatible(told()));
        let fringe = SPEED_OF_LIGHT_M_S / spectrum.mean_hz() / layout.extent().longest_m;
        let finer = ((grid.cell_rad * CELLS / fringe).ceil().max(1.0) as usize) | 1;
        let told = || {
            let expected = format!(
                "an angle below {}: the longest baseline of layout {:?} has finer fringes",
                Angle(FINEST as f64 * fringe / CELLS),
                layout.name
            );
            ChainError::bad_option("cell of a frame", Angle(grid.cell_rad), expected)
        };
        ensure!(finer <= FINEST, told());
        Ok(Self { grid: grid.clone(), layout, spectrum, kind, integration, simulate, finer })
    }

    /// The same at a frame rate, whose frames have no time between them.
    ///
    /// # Errors
    /// A rate that is not positive.
    pub fn at_rate(&self, rate_hz: f64) -> Result<Self> {
        need("rate", rate_hz, rate_hz > 0.0 && rate_hz.is_finite(), "frames per second above 0")?;
        Ok(Self { integration: Duration(1.0 / rate_hz), ..self.clone() })
    }

    /// The grid of its images.
    #[must_use]
    pub fn grid(&self) -> &SkyGrid {
        &self.grid
    }

    /// The time of a frame, s.
    #[must_use]
    pub fn frame_s(&self) -> f64 {
        self.integration.si()
    }

    /// Standard deviation of the noise that is expected of brightness averaged over a beam with natural weights, K; 0 without noise.
    ///
    /// # Errors
    /// Antennas without a system temperature or a diameter.
    pub fn nedt_k(&self) -> Result<f64> {
        if !self.simulate.noise {
            return Ok(0.0);
        }
        let bandwidth = Frequency(self.spectrum.width_hz().iter().sum());
        let options =
            FigureOptions { tsys: self.simulate.tsys, bandwidth: Some(bandwidth), time: self.integration, ..FigureOptions::default() };
        let figures = self.layout.figures_with(self.spectrum.mean_hz(), &options)?;
        let told = || format!("layout {:?} states no system temperature or no diameters, so its noise is not known", self.layout.name);
        figures.delta_t_k.ok_or_else(|| ChainError::NoData(told()))
    }

    /// The image of a scene in kelvin, on the grid of the scene. `number` is that of the frame: frames have independent noise.
    ///
    /// # Errors
    /// A step of the simulation or of the imaging fails.
    pub fn frame(&self, scene: &Image, number: u64) -> Result<Array2<f64>> {
        ensure!(scene.unit == BrightnessUnit::Kelvin, ChainError::Internal("a frame that is not in kelvin".into()));
        let track = TrackOptions { integration: self.integration, ..TrackOptions::default() }.plan(&self.layout)?;
        let header = self.simulate.header(self.layout.clone(), self.spectrum.clone(), track.center, VisUnit::KelvinSr);
        // A seed for each frame, far from those of other films.
        let seed = self.simulate.seed.wrapping_add(number.wrapping_mul(0x9E37_79B9_7F4A_7C15));
        let options = SimulateOptions { seed, ..self.simulate.clone() };
        let mut set = simulate_set(header, &track.plan.coverage()?, &SkyModel::of_image(scene.clone()), &options, &Silent)?;
        let imaging = ImagingOptions {
            size: Some(ImageSize { columns: self.grid.n_l * self.finer, rows: self.grid.n_m * self.finer }),
            cell: Some(Angle(self.grid.cell_rad / self.finer as f64)),
            ..ImagingOptions::default()
        };
        if self.kind == ArrayImage::Dirty {
            let mut imager = Imager::new(&mut set, imaging, &Silent)?;
            return Ok(self.on_frame(&dirty_image(&mut imager, false, &Silent)?.plane(0, 0).mapv(f64::from)));
        }
        let options = MemOptions { uncertainty: Uncertainty::None, ..MemOptions::default() };
        // Data without noise have weights without scale, for which maximum entropy takes a small noise.
        let noise = options.believed_noise(&mut set, &Silent)?;
        let mut imager = Imager::new(&mut set, imaging, &Silent)?;
        let plan = options.plan(&imager, MemInputs::default(), noise)?;
        Ok(self.on_frame(&mem(&mut imager, &plan, &Silent)?.model.plane(0, 0).to_owned()))
    }

    /// The mean over the cells of the image in each cell of the frame. The reference pixel n / 2 of both is one direction.
    fn on_frame(&self, image: &Array2<f64>) -> Array2<f64> {
        let (times, half) = (self.finer, self.finer / 2);
        let (rows, columns) = (self.grid.n_m, self.grid.n_l);
        // Column k of the frame is k - n / 2 cells from its reference pixel, and so is the middle of its cells in the image.
        let first = |k: usize, n: usize| (times * n / 2 + times * k) as isize - (times * (n / 2) + half) as isize;
        let last = |k: isize, n: usize| k.clamp(0, n as isize - 1) as usize;
        Array2::from_shape_fn((rows, columns), |(r, c)| {
            let (r0, c0) = (first(r, rows), first(c, columns));
            let cells = (0..times * times)
                .map(|k| image[[last(r0 + (k / times) as isize, times * rows), last(c0 + (k % times) as isize, times * columns)]]);
            cells.sum::<f64>() / (times * times) as f64
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::{Polarization, SkyFrame};
    use ndarray::Array4;

    #[test]
    fn both_images_show_a_warm_spot_where_it_is_and_frames_differ_by_their_noise() {
        let spectrum = SpectralWindow::band(94e9, 2e9, 1).unwrap();
        let grid = SkyGrid::new(64, 64, 2e-3, SkyFrame::Boresight).unwrap();
        let bump = |i: usize, k: usize| (-((i as f64 - 24.0).powi(2) + (k as f64 - 40.0).powi(2)) / 18.0).exp();
        let data = Array4::from_shape_fn((1, 1, 64, 64), |(_, _, m, l)| 250.0 + 100.0 * bump(m, l));
        let scene = Image::new(grid.clone(), spectrum.clone(), vec![Polarization::I], data, BrightnessUnit::Kelvin).unwrap();
        let layout = || ArrayLayout::builtin("mm-y").unwrap();
        let coarse = SkyGrid::new(32, 32, 0.05, SkyFrame::Boresight).unwrap();
        let told = Interferometer::new(layout(), spectrum.clone(), &coarse, ArrayImage::Dirty, Duration(0.1), SimulateOptions::default());
        assert!(told.unwrap_err().to_string().contains("finer fringes"));
        for kind in [ArrayImage::Dirty, ArrayImage::Mem] {
            let noisy = SimulateOptions { noise: true, ..SimulateOptions::default() };
            let camera = Interferometer::new(layout(), spectrum.clone(), &grid, kind, Duration(0.1), noisy).unwrap();
            let image = camera.frame(&scene, 3).unwrap();
            let peak = image.indexed_iter().max_by(|a, b| a.1.total_cmp(b.1)).unwrap().0;
            assert!(peak.0.abs_diff(24) <= 1 && peak.1.abs_diff(40) <= 1, "{kind:?} {peak:?}");
            assert!((image.mean().unwrap() - 250.0).abs() < 10.0, "{kind:?} {}", image.mean().unwrap());
            if kind == ArrayImage::Dirty {
                assert!(image == camera.frame(&scene, 3).unwrap() && image != camera.frame(&scene, 4).unwrap());
            }
        }
    }

    #[test]
    fn cells_of_a_fine_image_fall_into_the_cell_of_the_frame_around_their_direction() {
        let grid = SkyGrid::new(5, 4, 5e-3, SkyFrame::Boresight).unwrap();
        let band = SpectralWindow::band(94e9, 2e9, 1).unwrap();
        let layout = ArrayLayout::builtin("mm-y").unwrap();
        let mut camera = Interferometer::new(layout, band, &grid, ArrayImage::Dirty, Duration(0.1), SimulateOptions::default()).unwrap();
        camera.finer = 3;
        let fine = SkyGrid::new(15, 12, 5e-3 / 3.0, SkyFrame::Boresight).unwrap();
        let image = Array2::from_shape_fn((12, 15), |(r, c)| fine.m_at(r as f64) + 10.0 * fine.l_at(c as f64));
        let found = camera.on_frame(&image);
        for ((r, c), v) in found.indexed_iter().filter(|((r, c), _)| *r > 0 && (1..4).contains(c)) {
            assert!((v - grid.m_at(r as f64) - 10.0 * grid.l_at(c as f64)).abs() < 1e-12, "{r} {c}");
        }
    }

    #[test]
    fn an_array_on_the_earth_is_refused() {
        let grid = SkyGrid::new(64, 64, 2e-3, SkyFrame::Boresight).unwrap();
        let band = SpectralWindow::band(94e9, 2e9, 1).unwrap();
        let layout = ArrayLayout::builtin("vla-d").unwrap();
        let told = Interferometer::new(layout, band, &grid, ArrayImage::Dirty, Duration(0.1), SimulateOptions::default());
        assert!(told.unwrap_err().to_string().contains("boresight"));
    }
}
