//! How well images predict baselines that they were not made from.
//!
//! An image has more pixels than a small array has visibilities. It can therefore explain every visibility to the noise and be wrong, for example
//! where two antennas are swapped. Baselines that are left out of the image tell: a second image, made in the same way from the other
//! baselines, predicts them only if it is right where they look.
//!
//! # Reference
//! Stone 1974, J. R. Stat. Soc. B 36, 111 (cross-validation).

use super::finding::Finding;
use crate::Result;
use crate::calibrate::{Accuracy, ApplyOptions, HeldOut, JudgeOptions, Prediction, SkyPrediction, Without, ends_all};
use crate::mem::noise_from_hands;
use crate::progress::{Event, Observer, Quiet};
use crate::simulate::SkyModel;
use cittert_arrays::VisibilitySource;

/// The part of the power of baselines that an image may leave unexplained. It is below 0.07 for all but 2 of 110 random images that came out right, and above
/// 0.13 for those of swapped antennas that fit their data.
const MISFIT: f64 = 0.1;
/// Standard deviations by which the noise cannot explain it.
const SIGMAS: f64 = 3.0;
/// Antennas keep at least so many baselines.
const LEAST: usize = 2;
/// A small array has too few baselines to leave enough of them out: an image without more than this multiple of the fraction that was asked for is
/// no longer like the image of all.
const MOST: f64 = 1.5;

/// How well the baselines that were left out of an image are predicted by it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CrossCheck {
    /// Number of baselines that were left out.
    pub baselines: usize,
    /// The part of their power, beyond that of the noise, that the image does not predict.
    pub misfit: f64,
    /// Standard deviation of the misfit that the noise makes.
    pub sigma: f64,
}

impl CrossCheck {
    /// Leave a fraction of the baselines out, make a model of the others by `make`, and predict those that were left out. `None` where the
    /// noise of the set is not known, where it has too few baselines, or where no image can be made without them.
    ///
    /// # Errors
    /// The data cannot be read, or [`crate::ChainError::Cancelled`].
    pub fn of(
        data: &mut dyn VisibilitySource,
        fraction: f64,
        make: &mut dyn FnMut(&mut dyn VisibilitySource) -> Result<SkyModel>,
        accuracy: Accuracy,
        observer: &dyn Observer,
    ) -> Result<Option<Self>> {
        let hands = noise_from_hands(data)?;
        let noise = if hands.weights_are_counts { hands.factor } else { hands.factor.or(Some(1.0)) };
        let Some(noise) = noise.filter(|n| *n > 0.0) else { return Ok(None) };
        let held = HeldOut::draw(data, &JudgeOptions { fraction, ..JudgeOptions::default() }, LEAST)?;
        let Some(held) = held.filter(|h| h.fraction() <= MOST * fraction) else { return Ok(None) };
        observer.event(Event::Note(&format!("imaging again without {} baselines, to see whether they are predicted", held.n_baselines())));
        let header = data.header().clone();
        let sky = match make(&mut Without::new(data, Some(&held))) {
            Ok(sky) => sky,
            Err(e) if ends_all(&e, &*data.ranks()) => return Err(e),
            Err(_) => return Ok(None),
        };
        let quiet = Quiet(observer);
        let values = data.n_rows().saturating_mul(header.spectrum.n_chan() * header.polarizations.len());
        let mut predicted = SkyPrediction::new(&header, &sky, accuracy, &quiet)?.expecting(values);
        let prediction = Prediction::of(data, &held, &mut predicted, None, ApplyOptions::default(), noise)?;
        Ok(Some(Self { baselines: held.n_baselines(), misfit: prediction.misfit(), sigma: prediction.misfit_sigma() }))
    }

    /// The finding, if the baselines are predicted badly.
    #[must_use]
    pub fn finding(&self) -> Option<Finding> {
        (self.misfit > MISFIT + SIGMAS * self.sigma).then(|| {
            let says = format!(
                "an image without {} of the baselines leaves {:.0} % of their power unexplained: parts of the image that fit the data are wrong all the same",
                self.baselines,
                100.0 * self.misfit.min(10.0)
            );
            let next = "check names, positions and calibration of the antennas; a mask, a smaller image, mem, or more baselines help where these are right";
            Finding::new("not_predicted", says, next)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_noise_cannot_explain_is_a_finding() {
        let check = |misfit, sigma| CrossCheck { baselines: 12, misfit, sigma }.finding();
        assert_eq!(check(0.05, 0.0), None);
        assert_eq!(check(0.9, 0.3), None);
        let found = check(0.4, 0.05).unwrap();
        assert!(found.name == "not_predicted" && found.says.contains("12 of the baselines leaves 40 %"), "{found:?}");
    }
}
