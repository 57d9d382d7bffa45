//! The study of the frame rate. A slow camera looks longer and has less noise, but its picture moves while it looks; a fast one sees no motion, but noise.

use super::aperture::Aperture;
use super::marked::Marked;
use super::motion::{exposed, speed};
use crate::enhance::{Psf, StepList, enhance};
use crate::fidelity::{CompareOptions, compare};
use crate::progress::{Event, Observer};
use crate::values::need;
use crate::{ChainError, Result, ensure};
use cittert_arrays::Image;
use ndarray::Array2;

/// Pictures of an exposure for each pixel of motion. Near things move faster than the median of the picture.
const PICTURES: f64 = 4.0;
/// Most frames of a rate. The noise of a picture is then known to a thousandth.
const MOST_SEEDS: usize = 1000;
/// Most pictures of which an exposure is made.
const MOST_PICTURES: usize = 65;

/// What is studied.
#[derive(Debug, Clone)]
pub struct RateStudy<'a> {
    /// Frames per second \[rate\].
    pub rates_hz: Vec<f64>,
    /// The time of the frames, s.
    pub at_s: f64,
    /// Frames of each rate, with independent noise.
    pub seeds: usize,
    /// Seed of the first.
    pub seed: u64,
    /// The target whose contrast is measured.
    pub target: Option<Marked>,
    /// Enhancement of the frames.
    pub steps: Option<&'a StepList>,
    /// The PSF that deconvolution takes [default: that of the aperture].
    pub psf: Option<&'a Psf>,
}

/// The figures of one rate, over all of its frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RateRow {
    /// Frames per second.
    pub rate_hz: f64,
    /// Time for which a pixel is looked at, s.
    pub dwell_s: f64,
    /// Standard deviation of the noise that is expected before enhancement, K.
    pub nedt_k: f64,
    /// Standard deviation of the noise after enhancement, K.
    pub noise_k: f64,
    /// Standard deviation of the noise-free frame over that of the noise; infinite without noise.
    pub snr: f64,
    /// Motion of the picture in the time of a frame, pixels of the scene.
    pub blur_pixels: f64,
    /// The same as an angle, rad.
    pub blur_rad: f64,
    /// Mean of the target less that of its surroundings, K.
    pub target_difference_k: Option<f64>,
    /// That difference over the standard deviation of the surroundings.
    pub target_contrast: Option<f64>,
    /// Rms difference from the scene at the middle of the frame, K.
    pub error_k: f64,
    /// Pictures of which the exposure was made.
    pub pictures: usize,
}

/// The result of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct RateFigures {
    /// Rates in rising order.
    pub rows: Vec<RateRow>,
    /// The row with the highest contrast of the target, or without a target the one with the smallest error.
    pub best: usize,
    /// Speed of the picture, pixels per second.
    pub speed_pixels_s: f64,
}

impl RateStudy<'_> {
    fn check(&self, scene: &Image) -> Result<()> {
        ensure!(!self.rates_hz.is_empty(), ChainError::NoData("there is no frame rate to study".into()));
        for rate in &self.rates_hz {
            need("rates", rate, *rate > 0.0 && rate.is_finite(), "frames per second above 0")?;
        }
        need(
            "seeds",
            self.seeds,
            (2..=MOST_SEEDS).contains(&self.seeds),
            format!("2 to {MOST_SEEDS}: the noise is the difference of frames"),
        )?;
        self.target.as_ref().map_or(Ok(()), |target| target.check(&scene.grid))
    }

    /// The figures of all rates. `still` gives the scene in kelvin at a time, and `aperture` the camera of a rate.
    ///
    /// # Errors
    /// No rate, a rate that is not positive, fewer than two seeds, a target outside of the scene, an error of the functions or of a step.
    pub fn run(
        &self,
        still: &dyn Fn(f64) -> Result<Image>,
        aperture: &dyn Fn(f64) -> Result<Aperture>,
        observer: &dyn Observer,
    ) -> Result<RateFigures> {
        let scene = still(self.at_s)?;
        self.check(&scene)?;
        let mut rates = self.rates_hz.clone();
        rates.sort_by(f64::total_cmp);
        rates.dedup();
        observer.event(Event::Phase { name: "frame rates", total: Some(rates.len() as u64), unit: "rates" });
        let mut plane = |t: f64| Ok(still(t)?.plane(0, 0).to_owned());
        let region = self.target.as_ref().map(|target| target.region(&scene.grid));
        let fastest = rates.last().copied().unwrap_or(1.0);
        let speed = speed(&mut plane, self.at_s, 1.0 / fastest, region.as_ref())?;
        let mut rows = Vec::new();
        for rate in rates {
            ensure!(!observer.cancelled(), ChainError::Cancelled);
            let blur = speed / rate;
            let pictures = pictures(speed, rate);
            let mut seen = scene.clone();
            seen.plane_mut(0, 0).assign(&exposed(&mut plane, self.at_s, 1.0 / rate, pictures)?);
            let row = RateRow {
                blur_pixels: blur,
                blur_rad: blur * scene.grid.cell_rad,
                pictures,
                ..self.measure(rate, &seen, &scene, aperture)?
            };
            rows.push(row);
            observer.event(Event::Advance(1));
        }
        observer.event(Event::Done);
        let best = best(&rows);
        Ok(RateFigures { rows, best, speed_pixels_s: speed })
    }

    /// The figures of the frames of one rate, without the motion.
    fn measure(&self, rate_hz: f64, seen: &Image, scene: &Image, aperture: &dyn Fn(f64) -> Result<Aperture>) -> Result<RateRow> {
        let camera = aperture(rate_hz)?;
        let own = if self.psf.is_none() && self.steps.is_some_and(StepList::needs_psf) { camera.psf()? } else { None };
        let psf = self.psf.or(own.as_ref());
        let frame = |k: usize| {
            let frame = camera.frame(seen, &mut camera.begin(self.seed.wrapping_add(k as u64)))?;
            self.steps.map_or(Ok(frame.clone()), |steps| enhance(std::slice::from_ref(&frame), steps, psf))
        };
        let (mut sum, mut squares) = (Array2::<f64>::zeros((0, 0)), Array2::<f64>::zeros((0, 0)));
        let (mut difference, mut contrast, mut error) = (0.0, 0.0, 0.0);
        for k in 0..self.seeds {
            let image = frame(k)?;
            let plane = image.plane(0, 0);
            if k == 0 {
                (sum, squares) = (Array2::zeros(plane.dim()), Array2::zeros(plane.dim()));
            }
            // The mean of the scene is large and the noise small, so squares are taken from the first frame on.
            let about = scene.plane(0, 0).mean().unwrap_or(0.0);
            ndarray::Zip::from(&mut sum).and(&mut squares).and(&plane).for_each(|s, q, v| {
                *s += v - about;
                *q += (v - about).powi(2);
            });
            if let Some(found) = self.target.as_ref().and_then(|target| target.contrast(&scene.grid, &image)) {
                difference += found.difference;
                contrast += found.contrast;
            }
            error += compare(&image, scene, &CompareOptions::default())?.scores.rms_difference.powi(2);
        }
        let n = self.seeds as f64;
        let noise = (&squares - &(&sum * &sum / n)).mean().unwrap_or(0.0).max(0.0) / (n - 1.0);
        // The mean frame still has the noise over the square root of the number of frames.
        let signal = ((sum / n).var(0.0) - noise / n).max(0.0);
        Ok(RateRow {
            rate_hz,
            dwell_s: camera.dwell_s(),
            nedt_k: camera.nedt_k(seen)?,
            noise_k: noise.sqrt(),
            snr: (signal / noise).sqrt(),
            blur_pixels: 0.0,
            blur_rad: 0.0,
            target_difference_k: self.target.as_ref().map(|_| difference / n),
            target_contrast: self.target.as_ref().map(|_| contrast / n),
            error_k: (error / n).sqrt(),
            pictures: 1,
        })
    }
}

/// Pictures of an exposure at a rate where the scene moves with this speed, pixels per second. An odd number holds the picture of the middle.
fn pictures(speed: f64, rate_hz: f64) -> usize {
    ((PICTURES * speed / rate_hz).ceil() as usize | 1).min(MOST_PICTURES)
}

impl RateFigures {
    /// Pictures of which the exposure of another rate would be made.
    #[must_use]
    pub fn pictures_at(&self, rate_hz: f64) -> usize {
        pictures(self.speed_pixels_s, rate_hz)
    }
}

fn best(rows: &[RateRow]) -> usize {
    let merit = |row: &RateRow| row.target_contrast.unwrap_or(-row.error_k);
    (0..rows.len()).max_by(|a, b| merit(&rows[*a]).total_cmp(&merit(&rows[*b]))).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::display::ReceiverOptions;
    use crate::progress::Silent;
    use cittert_arrays::quantity::{Frequency, Temperature};
    use cittert_arrays::{BrightnessUnit, Polarization, SkyFrame, SkyGrid, SpectralWindow};
    use ndarray::Axis;

    const N: usize = 96;

    /// A warm disc of 5 pixels radius at the centre, before a textured background, at a time. Everything moves by `v` columns a second.
    fn still(v: f64) -> impl Fn(f64) -> Result<Image> {
        move |t| {
            let grid = SkyGrid::new(N, N, 1e-3, SkyFrame::Boresight)?;
            let plane = Array2::from_shape_fn((N, N), |(r, c)| {
                let (x, y) = (c as f64 - v * t, r as f64);
                let disc = (5.5 - (x - 48.0).hypot(y - 48.0)).clamp(0.0, 1.0);
                280.0 + 0.5 * (0.3 * x).sin() * (0.2 * y).cos() + 6.0 * disc
            });
            let data = plane.insert_axis(Axis(0)).insert_axis(Axis(0));
            Ok(Image::new(grid, SpectralWindow::band(94e9, 1e9, 1)?, vec![Polarization::I], data, BrightnessUnit::Kelvin)?)
        }
    }

    fn camera(tsys: f64) -> impl Fn(f64) -> Result<Aperture> {
        move |rate| {
            let receivers = ReceiverOptions { tsys: Some(Temperature(tsys)), bandwidth: Frequency(1e9), detectors: Some(96) };
            Aperture::of_receivers(&receivers, rate, &SkyGrid::new(N, N, 1e-3, SkyFrame::Boresight)?)
        }
    }

    fn marked(text: &str) -> Option<Marked> {
        Some(Marked::Disc(text.parse().unwrap()))
    }

    fn study(rates: &[f64]) -> RateStudy<'static> {
        RateStudy { rates_hz: rates.to_vec(), at_s: 0.0, seeds: 12, seed: 5, target: marked("48,48,5"), steps: None, psf: None }
    }

    #[test]
    fn without_motion_the_signal_to_noise_falls_with_the_root_of_the_rate() {
        let found = study(&[1.0, 4.0, 16.0, 64.0]).run(&still(0.0), &camera(400.0), &Silent).unwrap();
        for (k, row) in found.rows.iter().enumerate() {
            // 110,000 numbers of noise are uncertain by 0.3 %.
            assert!((row.noise_k / row.nedt_k - 1.0).abs() < 0.01, "{row:?}");
            assert!((row.nedt_k / found.rows[0].nedt_k / 2_f64.powi(k as i32) - 1.0).abs() < 1e-12);
            assert!((row.snr / found.rows[0].snr * 2_f64.powi(k as i32) - 1.0).abs() < 0.02, "{row:?}");
            assert!((row.blur_pixels, row.pictures) == (0.0, 1));
            assert!((row.error_k / row.nedt_k - 1.0).abs() < 0.02);
        }
        assert_eq!(found.best, 0);
    }

    #[test]
    fn the_blur_falls_with_the_rate_and_the_best_rate_lies_between_blur_and_noise() {
        let rates: Vec<f64> = (0..8).map(|k| 2_f64.powi(k)).collect();
        let found = study(&rates).run(&still(24.0), &camera(400.0), &Silent).unwrap();
        assert!((found.speed_pixels_s / 24.0 - 1.0).abs() < 0.04, "{}", found.speed_pixels_s);
        for row in &found.rows {
            assert!((row.blur_pixels * row.rate_hz / found.speed_pixels_s - 1.0).abs() < 1e-12);
            assert_eq!(row.blur_rad, row.blur_pixels * 1e-3);
        }
        let contrast: Vec<f64> = found.rows.iter().map(|r| r.target_contrast.unwrap()).collect();
        assert!(found.best > 0 && found.best < 7, "{contrast:?}");
        // The contrast rises up to the best rate and falls from there.
        assert!(contrast[0] < 0.8 * contrast[found.best] && contrast[7] < 0.8 * contrast[found.best], "{contrast:?}");
        // At 1 Hz the disc of 11 pixels is spread over 35.
        assert!(found.rows[0].target_difference_k.unwrap() < 0.6 * found.rows[7].target_difference_k.unwrap());
        let plain = RateStudy { target: None, ..study(&rates) }.run(&still(24.0), &camera(400.0), &Silent).unwrap();
        assert!(plain.best > 0 && plain.best < 7 && plain.rows[0].target_contrast.is_none());
    }

    #[test]
    fn enhancement_is_measured_and_wrong_studies_are_refused() {
        let steps: StepList = "median=5".parse().unwrap();
        let both = [None, Some(&steps)]
            .map(|steps| RateStudy { steps, ..study(&[16.0]) }.run(&still(0.0), &camera(400.0), &Silent).unwrap().rows[0]);
        assert!(both[1].noise_k < 0.4 * both[0].noise_k && both[1].nedt_k == both[0].nedt_k, "{both:?}");
        let told = |study: RateStudy<'_>| study.run(&still(0.0), &camera(400.0), &Silent).unwrap_err().to_string();
        assert!(told(study(&[])).contains("no frame rate"));
        assert!(told(study(&[1.0, -2.0])).contains("rates is -2"));
        assert!(told(RateStudy { seeds: 1, ..study(&[1.0]) }).contains("seeds is 1"));
        assert!(told(RateStudy { seeds: 1001, ..study(&[1.0]) }).contains("2 to 1000"));
        assert!(told(RateStudy { target: marked("95,48,5"), ..study(&[1.0]) }).contains("96 x 96 pixels"));
    }
}
