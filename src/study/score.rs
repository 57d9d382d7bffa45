//! The scores of a trial: how good its image and its gains are.

use super::base::{Reference, Seen};
use crate::fidelity::{error_over_grey_card, fidelity_index};
use serde::{Deserialize, Serialize};

/// Number of scores of an image.
pub const N_SCORES: usize = 7;

/// One number of a trial, with the name that it has in tables.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
pub enum Score {
    /// Peak of the restored image over the rms of the residual.
    DynamicRange,
    /// Peak of the image over its rms off the source.
    OffSourceDynamicRange,
    /// Rms of the difference from the reference over the rms of the reference.
    Nrmse,
    /// Rms of the difference from the reference over that of a grey card: 0 is perfect, 1 is a flat image.
    ErrorOverGreyCard,
    /// Fidelity index.
    Fidelity,
    /// Rms of the residual image, in its unit.
    ResidualRms,
    /// Rms phase error of the gains, in rad.
    PhaseRmsRad,
}

impl Score {
    /// All of them, in the order of [`Quality::values`].
    pub const ALL: [Self; N_SCORES] = [
        Self::DynamicRange,
        Self::OffSourceDynamicRange,
        Self::Nrmse,
        Self::ErrorOverGreyCard,
        Self::Fidelity,
        Self::ResidualRms,
        Self::PhaseRmsRad,
    ];

    /// Name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::DynamicRange => "dynamic_range",
            Self::OffSourceDynamicRange => "off_source_dynamic_range",
            Self::Nrmse => "nrmse",
            Self::ErrorOverGreyCard => "error_over_grey_card",
            Self::Fidelity => "fidelity",
            Self::ResidualRms => "residual_rms",
            Self::PhaseRmsRad => "phase_rms_rad",
        }
    }

    /// Label of an axis, and name in sentences.
    #[must_use]
    pub fn label(self) -> &'static str {
        match self {
            Self::DynamicRange => "dynamic range",
            Self::OffSourceDynamicRange => "off-source dynamic range",
            Self::Nrmse => "NRMSE",
            Self::ErrorOverGreyCard => "error over grey card",
            Self::Fidelity => "fidelity index",
            Self::ResidualRms => "residual rms",
            Self::PhaseRmsRad => "gain phase error, rms [rad]",
        }
    }

    /// True where a larger number is a better image.
    #[must_use]
    pub fn larger_is_better(self) -> bool {
        matches!(self, Self::DynamicRange | Self::OffSourceDynamicRange | Self::Fidelity)
    }
}

/// The quality of an image and its gains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quality {
    /// Peak of the restored image (without a constant that was added back) divided by the rms of the residual, as for `clean` and `mem`.
    pub dynamic_range: f64,
    /// Peak of the image divided by its rms off the source. If the source fills nine tenths of the image, the rms of the residual is used.
    pub off_source_dynamic_range: f64,
    /// Rms of the difference from the image of error-free data (for maximum entropy: from the scene), divided by the rms of that image.
    pub nrmse: f64,
    /// The same difference, divided by the rms of that image less its mean.
    pub error_over_grey_card: f64,
    /// Fidelity index against the same image.
    pub fidelity: f64,
    /// Rms of the residual image, in its unit.
    pub residual_rms: f64,
    /// Rms phase error of the gains, rad, after a common phase of each integration is removed.
    pub phase_rms_rad: f64,
}

impl Quality {
    /// The numbers in the order of [`Score::ALL`].
    #[must_use]
    pub fn values(&self) -> [f64; N_SCORES] {
        Score::ALL.map(|s| self.of(s))
    }

    /// One number.
    #[must_use]
    pub fn of(&self, score: Score) -> f64 {
        match score {
            Score::DynamicRange => self.dynamic_range,
            Score::OffSourceDynamicRange => self.off_source_dynamic_range,
            Score::Nrmse => self.nrmse,
            Score::ErrorOverGreyCard => self.error_over_grey_card,
            Score::Fidelity => self.fidelity,
            Score::ResidualRms => self.residual_rms,
            Score::PhaseRmsRad => self.phase_rms_rad,
        }
    }

    /// The reverse of [`Quality::values`].
    #[must_use]
    pub fn from_values(v: [f64; N_SCORES]) -> Self {
        Self {
            dynamic_range: v[0],
            off_source_dynamic_range: v[1],
            nrmse: v[2],
            error_over_grey_card: v[3],
            fidelity: v[4],
            residual_rms: v[5],
            phase_rms_rad: v[6],
        }
    }
}

/// The scores of an image against its reference.
pub(super) fn quality(seen: &Seen, reference: &Reference, phase_rms_rad: f64) -> Quality {
    let image = &seen.image;
    let rms = |sum: f64, n: usize| (sum / n.max(1) as f64).sqrt();
    let (mut off, mut n_off, mut error, mut power) = (0.0, 0_usize, 0.0, 0.0);
    for ((v, t), on) in image.iter().zip(&reference.image).zip(&reference.on_source) {
        error += (v - t) * (v - t);
        power += t * t;
        if !on {
            off += v * v;
            n_off += 1;
        }
    }
    let residual_rms = seen.residual_rms;
    let noise = if 10 * n_off > image.len() { rms(off, n_off) } else { residual_rms };
    let peak = image.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let over = |peak: f64, noise: f64| if noise > 0.0 { peak / noise } else { f64::INFINITY };
    let pixels: Vec<(f64, f64)> = image.iter().copied().zip(reference.image.iter().copied()).collect();
    Quality {
        dynamic_range: over(seen.restored_peak, residual_rms),
        off_source_dynamic_range: over(peak, noise),
        nrmse: (error / power).sqrt(),
        error_over_grey_card: error_over_grey_card(&pixels),
        fidelity: fidelity_index(&pixels),
        residual_rms,
        phase_rms_rad,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imaging::ImagingOptions;
    use ndarray::Array2;

    /// An image with structure, and the scores of another image against it.
    fn against(image: impl Fn(&Array2<f64>) -> Array2<f64>, pedestal: f64) -> Quality {
        let truth = Array2::from_shape_fn((20, 20), |(r, c)| pedestal + if (5..9).contains(&r) && c > 11 { 3.0 } else { 0.0 });
        let on_source = truth.mapv(|v| v > pedestal);
        let image = image(&truth);
        let restored_peak = image.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let reference = Reference { image: truth, on_source, imaging: ImagingOptions::default(), beam: None };
        quality(&Seen { image, restored_peak, residual_rms: 0.5 }, &reference, 0.0)
    }

    #[test]
    fn a_flat_image_is_no_better_than_a_grey_card_and_a_perfect_one_has_no_error() {
        for pedestal in [0.0, 290.0] {
            let flat = against(|t| Array2::from_elem(t.dim(), t.mean().unwrap()), pedestal);
            assert!((flat.error_over_grey_card - 1.0).abs() < 1e-12, "{flat:?}");
            assert_eq!(against(Clone::clone, pedestal).error_over_grey_card, 0.0);
        }
        // The constant hides the error from the NRMSE.
        assert!(against(|t| Array2::from_elem(t.dim(), 290.3), 290.0).nrmse < 0.01);
    }

    #[test]
    fn the_two_dynamic_ranges_differ_in_their_noise() {
        let q = against(|t| t.mapv(|v| if v > 0.0 { 4.0 } else { 0.1 }), 0.0);
        assert!((q.dynamic_range - 8.0).abs() < 1e-12 && (q.off_source_dynamic_range - 40.0).abs() < 1e-9, "{q:?}");
    }

    #[test]
    fn every_score_has_its_place_and_its_name() {
        let v = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];
        assert_eq!(Quality::from_values(v).values(), v);
        for score in Score::ALL {
            assert_eq!(serde_json::to_value(score).unwrap(), score.name());
        }
    }
}
