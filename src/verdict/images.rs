//! What an image itself says about its fit: brightness that no sky has, or that the visibilities do not allow.

use super::finding::Finding;
use super::residuals::Residuals;
use crate::imaging::{CleanProducts, StopReason};
use crate::mem::MemProducts;
use cittert_arrays::{BrightnessUnit, Image, RestoringBeam};
use ndarray::{ArrayView1, Axis};
use rayon::prelude::*;

/// Multiples of the rms of the residual below zero that noise does not reach.
const NEGATIVE: f64 = 7.0;
/// Depth of a negative bowl, in terms of the peak, that disturbs an image.
const BOWL: f64 = 0.1;
/// A positive sky is nowhere brighter in the beam than the mean amplitude of the visibilities, with equal weights. Other weights, which differ
/// by less, and the noise need some room.
const BEYOND: f64 = 2.5;
/// Largest departure of the mean of a thermal image from its pedestal, relative to the pedestal. The visibilities have no zero spacing, so
/// the image keeps the mean that was removed.
const PEDESTAL: f64 = 0.15;
/// A residual whose peak exceeds its rms by this factor holds more than noise.
const LEFT: f64 = 7.0;

/// An image of noise alone has no pixel that departs from its mean level by more than this multiple of the rms of the residual.
const DETECTED: f64 = 6.0;
/// Standard deviations by which the power of visibilities with a source exceeds that of noise.
const POWER: f64 = 5.0;

/// Numbers about the pixels of one image.
#[derive(Debug, Clone, Copy)]
pub struct Levels {
    /// Smallest value.
    pub low: f64,
    /// Largest value.
    pub high: f64,
    /// Mean.
    pub mean: f64,
    /// Root of the mean of the squares.
    pub rms: f64,
    /// Unit of these values.
    pub unit: BrightnessUnit,
    /// Constant that was removed from the scene and is in the values, K.
    pub pedestal_k: Option<f64>,
}

impl Levels {
    /// Those of an image.
    #[must_use]
    pub fn of<P: Copy + Into<f64> + Sync>(image: &Image<P>) -> Self {
        let of_line = |line: ArrayView1<'_, P>| {
            let add = |(low, high, sum, squares): (f64, f64, f64, f64), v: &P| {
                let v = (*v).into();
                (v.min(low), v.max(high), sum + v, squares + v * v)
            };
            line.iter().fold((f64::INFINITY, f64::NEG_INFINITY, 0.0, 0.0), add)
        };
        // The lines are summed in their order, so that the result does not depend on the number of threads.
        let lines: Vec<_> = image.data.lanes(Axis(3)).into_iter().collect::<Vec<_>>().into_par_iter().map(of_line).collect();
        let add = |a: (f64, f64, f64, f64), b: &(f64, f64, f64, f64)| (a.0.min(b.0), a.1.max(b.1), a.2 + b.2, a.3 + b.3);
        let (low, high, sum, squares) = lines.iter().fold((f64::INFINITY, f64::NEG_INFINITY, 0.0, 0.0), add);
        let n = image.data.len() as f64;
        Self { low, high, mean: sum / n, rms: (squares / n).sqrt(), unit: image.unit, pedestal_k: image.pedestal_k }
    }
}

/// What the rules need of an image of total intensity. They are numbers, so that the image itself need not be kept.
#[derive(Debug, Clone, Copy)]
pub struct ImageFacts<'a> {
    /// The restored image, with its pedestal; for methods that need no restoring beam, the image itself.
    pub restored: Levels,
    /// The residual image.
    pub residual: Levels,
    /// Restoring beam of the first output channel.
    pub beam: Option<&'a RestoringBeam>,
    /// Why CLEAN stopped; empty for other methods.
    pub stop: &'a [StopReason],
}

impl<'a> From<&'a CleanProducts> for ImageFacts<'a> {
    fn from(p: &'a CleanProducts) -> Self {
        Self { restored: Levels::of(&p.restored), residual: Levels::of(&p.residual), beam: p.beams.first(), stop: &p.statistics.stop }
    }
}

impl<'a> From<&'a MemProducts> for ImageFacts<'a> {
    fn from(p: &'a MemProducts) -> Self {
        Self { restored: Levels::of(&p.model), residual: Levels::of(&p.residual), beam: p.beams.first(), stop: &[] }
    }
}

/// Findings about an image. `residuals` are those of its model, where they are known.
#[must_use]
pub fn of_image(image: &ImageFacts<'_>, residuals: Option<&Residuals>) -> Vec<Finding> {
    let pedestal = image.restored.pedestal_k.unwrap_or(0.0);
    let kelvin = image.restored.unit == BrightnessUnit::Kelvin;
    let Levels { low, high, mean, .. } = image.restored;
    let rms = image.residual.rms;
    let peak_left = image.residual.high.max(-image.residual.low);
    let unit = image.restored.unit.bunit();
    let mut all = Vec::new();
    if image.stop.contains(&StopReason::Diverged) {
        let says = "CLEAN diverged: its components made the residual larger, and the best state before is kept";
        all.push(Finding::new("diverged", says, "lower --gain or --mgain, give a mask, or use mem"));
    }
    let ran_out = image.stop.iter().any(|s| matches!(s, StopReason::Iterations | StopReason::MajorCycles));
    let unfinished = residuals.is_some_and(|r| r.noise_known && r.typical > 1.2) || peak_left > LEFT * rms;
    if ran_out && unfinished {
        let says = format!(
            "the components ran out while the residual still has a peak of {peak_left:.4e} {unit}, {:.1} times its rms",
            peak_left / rms
        );
        all.push(Finding::new("components_ran_out", says, "raise --niter, with --nsigma 3 as the end, or use mem for extended scenes"));
    }
    if kelvin && low < -(NEGATIVE * rms).max(1.0) {
        let says = format!("the image falls to {low:.1} K, and no brightness temperature is below 0");
        all.push(Finding::new("negative", says, "use mem, which is positive, or check the pedestal and the shortest baselines"));
    } else if !kelvin && low < -(NEGATIVE * rms).max(BOWL * high) {
        let says = format!(
            "the image falls to {low:.4e} {unit}, which is {:.0} % of its peak and {:.1} times the rms of the residual",
            -100.0 * low / high,
            -low / rms
        );
        all.push(Finding::new(
            "negative",
            says,
            "check the shortest baselines and the calibration; a bowl around a source is flux that no baseline measures",
        ));
    }
    let reach = (high - pedestal).max(pedestal - low);
    if let Some(r) = residuals.filter(|r| r.noise_known && reach < DETECTED * rms && r.signal * (r.samples as f64).sqrt() < POWER) {
        let says = format!(
            "nothing is seen but noise: the brightest pixel is {:.1} times the rms of the residual, and the visibilities have {:.3} times the power of their noise",
            reach / rms,
            1.0 + r.signal
        );
        all.push(Finding::new(
            "nothing_seen",
            says,
            "integrate longer, observe a brighter source, or check the unit and the scale of the scene",
        ));
    }
    if kelvin && (mean - pedestal).abs() > PEDESTAL * pedestal && pedestal > 0.0 {
        let says = format!(
            "the image has a mean of {mean:.1} K, and a constant of {pedestal:.1} K was removed from the scene: the constant should be the mean"
        );
        all.push(Finding::new("pedestal", says, "check the pedestal of the set, unless the image shows only a part of the scene"));
    }
    if let (Some(r), Some(beam)) = (residuals, image.beam) {
        let most = r.mean_amplitude / if kelvin { beam.solid_angle_sr() } else { 1.0 };
        if reach > BEYOND * most {
            let says = format!(
                "the image departs by up to {reach:.4e} {unit} from its mean level, and visibilities of this size allow about {most:.4e} {unit}: it holds structure that no baseline measures"
            );
            all.push(Finding::new("beyond_range", says, "use mem, leave out wide --scales, or lower --gain"));
        }
    }
    all
}
