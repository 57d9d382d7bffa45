//! The shapes of an analytic scene.

use serde::{Deserialize, Serialize};

/// What a shape does to the brightness beneath it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, tag = "type", rename_all = "lowercase")]
pub enum Shape {
    /// A filled rectangle.
    Rectangle {
        /// Centre (l, m), deg.
        center_deg: [f64; 2],
        /// Full width and height, deg.
        size_deg: [f64; 2],
        /// Turned counter-clockwise (from +l towards +m), deg.
        #[serde(default)]
        angle_deg: f64,
        /// Temperature at the centre, K.
        temperature_k: f64,
        /// Change along its width, K from edge to edge.
        #[serde(default)]
        ramp_k: f64,
    },
    /// A filled ellipse.
    Ellipse {
        /// Centre (l, m), deg.
        center_deg: [f64; 2],
        /// Full axes, deg.
        size_deg: [f64; 2],
        /// Turned counter-clockwise, deg.
        #[serde(default)]
        angle_deg: f64,
        /// Temperature, K.
        temperature_k: f64,
    },
    /// A Gaussian added to what lies beneath.
    Gaussian {
        /// Centre (l, m), deg.
        center_deg: [f64; 2],
        /// Full widths at half maximum, deg.
        fwhm_deg: [f64; 2],
        /// Turned counter-clockwise, deg.
        #[serde(default)]
        angle_deg: f64,
        /// Peak, K; may be negative.
        add_k: f64,
    },
}

impl Shape {
    /// The word that selects the shape in TOML.
    #[must_use]
    pub fn type_name(&self) -> &'static str {
        match self {
            Self::Rectangle { .. } => "rectangle",
            Self::Ellipse { .. } => "ellipse",
            Self::Gaussian { .. } => "gaussian",
        }
    }

    fn geometry(&self) -> ([f64; 2], [f64; 2], f64) {
        match *self {
            Self::Rectangle { center_deg, size_deg, angle_deg, .. } | Self::Ellipse { center_deg, size_deg, angle_deg, .. } => {
                (center_deg, size_deg, angle_deg)
            }
            Self::Gaussian { center_deg, fwhm_deg, angle_deg, .. } => (center_deg, fwhm_deg, angle_deg),
        }
    }

    /// The error in the numbers, if there is one.
    pub(crate) fn check(&self) -> Result<(), &'static str> {
        let (center, size, angle) = self.geometry();
        if center.iter().chain([&angle]).any(|v| !v.is_finite()) || size.iter().any(|s| !(s.is_finite() && *s > 0.0)) {
            return Err("finite centre and angle, positive sizes");
        }
        match *self {
            Self::Rectangle { temperature_k, ramp_k, .. } if !(temperature_k - ramp_k.abs() / 2.0 >= 0.0 && temperature_k.is_finite()) => {
                Err("a temperature of 0 K or more everywhere")
            }
            Self::Ellipse { temperature_k, .. } if !(temperature_k >= 0.0 && temperature_k.is_finite()) => {
                Err("a temperature of 0 K or more")
            }
            Self::Gaussian { add_k, .. } if !add_k.is_finite() => Err("a finite peak"),
            _ => Ok(()),
        }
    }

    /// The temperature at direction cosines (l, m) over a temperature `under`.
    pub(crate) fn paint(&self, under: f64, l: f64, m: f64) -> f64 {
        let (center, size, angle) = self.geometry();
        let (sin, cos) = angle.to_radians().sin_cos();
        let (dl, dm) = (l - center[0].to_radians(), m - center[1].to_radians());
        // Fractions of the full size along the shape's own axes.
        let x = (dl * cos + dm * sin) / size[0].to_radians();
        let y = (dm * cos - dl * sin) / size[1].to_radians();
        match *self {
            Self::Rectangle { temperature_k, ramp_k, .. } if x.abs() <= 0.5 && y.abs() <= 0.5 => temperature_k + ramp_k * x,
            Self::Ellipse { temperature_k, .. } if x.hypot(y) <= 0.5 => temperature_k,
            Self::Gaussian { add_k, .. } => under + add_k * (-4.0 * std::f64::consts::LN_2 * (x * x + y * y)).exp(),
            _ => under,
        }
    }
}
