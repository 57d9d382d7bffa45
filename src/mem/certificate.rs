//! A record of the constraints that an image meets, and of the work that it took.

use serde::Serialize;

/// Facts about an image of maximum entropy.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Certificate {
    /// All goals are met.
    pub met: bool,
    /// Why the solver stopped.
    pub stop_reason: &'static str,
    /// Chi squared over the number of real data.
    pub chi2_per_datum: f64,
    /// Number of real data.
    pub data: f64,
    /// Relative violation of the constraint on the flux; 0 where no flux was given.
    pub flux_error: f64,
    /// True where a total flux was given.
    pub flux_constrained: bool,
    /// Total flux that the elements see of the image, Jy or K sr.
    pub model_flux: f64,
    /// Brightness of the flat prior, where elements with a pattern see it: by total power, or fitted to the data; K or Jy/pixel.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub background: Option<f64>,
    /// Entropy (minus the sum of all penalties), Jy or K sr.
    pub entropy: f64,
    /// Length of the gradient of the Lagrangian divided by the sum of the lengths of its two terms, in the metric of the entropy.
    pub kkt_residual: f64,
    /// Lagrange multiplier of chi2 / 2 in units of the mean prior.
    pub lambda: f64,
    /// Steps.
    pub iterations: usize,
    /// Evaluations of the data term, each one pair of transforms.
    pub evaluations: usize,
    /// Convolutions with the beam.
    pub convolutions: usize,
    /// Wall-clock seconds of the solver.
    pub seconds: f64,
    /// Wall-clock seconds of one evaluation of the data term.
    pub seconds_per_evaluation: f64,
}

impl Certificate {
    /// The time of the whole solution in units of one evaluation of the data term.
    #[must_use]
    pub fn time_ratio(&self) -> f64 {
        self.seconds / self.seconds_per_evaluation.max(f64::MIN_POSITIVE)
    }

    /// A sentence about the goals that are not met; `None` if all are met.
    #[must_use]
    pub fn shortfall(&self, chi2_tolerance: f64, flux: f64, kkt: f64) -> Option<String> {
        if self.met {
            return None;
        }
        let mut parts = Vec::new();
        if !((self.chi2_per_datum - 1.0).abs() <= chi2_tolerance) {
            parts.push(format!("chi2/N is {:.4}, not 1 within {chi2_tolerance}", self.chi2_per_datum));
        }
        if !(self.flux_error <= flux) {
            parts.push(format!("the flux is off by {:.2e}", self.flux_error));
        }
        if !(self.kkt_residual <= kkt) {
            parts.push(format!("the KKT residual is {:.2e}, above {kkt:.0e}", self.kkt_residual));
        }
        Some(format!("{} after {} evaluations ({})", parts.join("; "), self.evaluations, self.stop_reason))
    }
}
