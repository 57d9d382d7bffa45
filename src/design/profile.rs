//! A density of baselines in the u-v plane that depends on their length alone.

use crate::values::{bad_value, by_text};
use crate::{ChainError, Result};
use std::fmt;
use std::str::FromStr;

/// Points of the density: length of the baseline in apertures, and density. It is linear between them, and 0 beyond the last.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile(pub Vec<(f64, f64)>);

/// Points of the profiles that have a formula.
const POINTS: usize = 64;

impl Profile {
    /// The same density for all baselines of up to one aperture.
    #[must_use]
    pub fn uniform() -> Self {
        Self::of(|_| 1.0)
    }

    /// A Gaussian with a full width at half maximum in apertures, cut at one aperture.
    #[must_use]
    pub fn gaussian(fwhm: f64) -> Self {
        Self::of(|q| (-4.0 * std::f64::consts::LN_2 * (q / fwhm).powi(2)).exp())
    }

    fn of(density: impl Fn(f64) -> f64) -> Self {
        Self((0..=POINTS).map(|k| k as f64 / POINTS as f64).map(|q| (q, density(q))).collect())
    }

    /// Points that a user gives.
    ///
    /// # Errors
    /// Fewer than two points, lengths that do not grow from 0 to at most 1, densities that are negative or all 0.
    pub fn given(points: Vec<(f64, f64)>) -> Result<Self> {
        let grow = points.windows(2).all(|p| p[0].0 < p[1].0) && points.iter().all(|p| (0.0..=1.0).contains(&p.0));
        let positive = points.iter().all(|p| p.1 >= 0.0 && p.1.is_finite()) && points.iter().any(|p| p.1 > 0.0);
        if points.len() < 2 || !grow || !positive {
            return bad_value(
                "density",
                format!("{points:?}"),
                "at least two pairs of length and density: lengths grow and lie between 0 and 1 aperture, densities are not negative",
            );
        }
        Ok(Self(points))
    }
}

/// A target density as one text.
#[derive(Debug, Clone, PartialEq)]
pub enum Density {
    /// The same density for all baselines.
    Uniform,
    /// A Gaussian of this full width at half maximum, in apertures.
    Gaussian(f64),
    /// Points of length (apertures) and density.
    Given(Vec<(f64, f64)>),
}
by_text!(Density, "string", "uniform, gaussian=FWHM in apertures, or pairs LENGTH:DENSITY with commas between.");

impl fmt::Display for Density {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Uniform => f.write_str("uniform"),
            Self::Gaussian(fwhm) => write!(f, "gaussian={fwhm}"),
            Self::Given(points) => f.write_str(&points.iter().map(|(q, d)| format!("{q}:{d}")).collect::<Vec<_>>().join(",")),
        }
    }
}

impl FromStr for Density {
    type Err = ChainError;

    fn from_str(text: &str) -> Result<Self> {
        let expected = "uniform, gaussian=FWHM in apertures, or pairs LENGTH:DENSITY with commas between";
        let width = |t: &str| t.parse::<f64>().ok().filter(|w| *w > 0.0 && w.is_finite());
        let pair = |t: &str| t.split_once(':').and_then(|(q, d)| Some((q.trim().parse().ok()?, d.trim().parse().ok()?)));
        match text.split_once('=') {
            None if text == "uniform" => Ok(Self::Uniform),
            None if text == "gaussian" => Ok(Self::Gaussian(1.0)),
            Some(("gaussian", w)) if width(w).is_some() => Ok(Self::Gaussian(width(w).unwrap_or(1.0))),
            _ => match text.split(',').map(pair).collect::<Option<Vec<_>>>() {
                Some(points) => Profile::given(points).map(|Profile(points)| Self::Given(points)),
                None => bad_value("density", format!("{text:?}"), expected),
            },
        }
    }
}

impl Density {
    /// Its points.
    #[must_use]
    pub fn profile(&self) -> Profile {
        match self {
            Self::Uniform => Profile::uniform(),
            Self::Gaussian(fwhm) => Profile::gaussian(*fwhm),
            Self::Given(points) => Profile(points.clone()),
        }
    }
}
