//! The text of a shape.

use super::shape::{MadeShape, ShapeKind};
use super::table::SHAPES;
use crate::values::by_text;
use cittert_arrays::quantity::Length;
use std::fmt;
use std::str::FromStr;

/// A shape as it is written, such as `circle=1.2m` or `rectangle=1.2m:80cm`.
#[derive(Debug, Clone)]
pub struct Aperture {
    kind: &'static ShapeKind,
    sizes: Vec<Length>,
}
by_text!(Aperture, "string", "A shape with its lengths, such as \"circle=1.2m\".");

impl Aperture {
    /// The shape itself.
    ///
    /// # Errors
    /// Lengths that make no shape.
    pub fn shape(&self) -> MadeShape {
        let sizes: Vec<f64> = self.sizes.iter().map(|s| s.si()).collect();
        (self.kind.make)(&sizes).map_err(|why| format!("{self}: {why}, write {}={}", self.kind.name, self.kind.sizes))
    }
}

impl PartialEq for Aperture {
    fn eq(&self, other: &Self) -> bool {
        self.kind.name == other.kind.name && self.sizes == other.sizes
    }
}

impl fmt::Display for Aperture {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.kind.name)?;
        for (k, size) in self.sizes.iter().enumerate() {
            write!(f, "{}{size}", if k == 0 { "=" } else { ":" })?;
        }
        Ok(())
    }
}

impl FromStr for Aperture {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, sizes) = text.trim().split_once('=').unwrap_or((text.trim(), ""));
        let known = || SHAPES.iter().map(|s| format!("{}={}", s.name, s.sizes)).collect::<Vec<_>>().join(", ");
        let kind = SHAPES.iter().find(|s| s.name == name.trim());
        let kind = kind.ok_or_else(|| format!("there is no shape {:?}; the shapes are {}", name.trim(), known()))?;
        let sizes: Result<Vec<Length>, _> = sizes.split(':').filter(|s| !s.trim().is_empty()).map(str::parse).collect();
        let aperture = Self { kind, sizes: sizes.map_err(|e| format!("{name}: {e}"))? };
        aperture.shape()?;
        Ok(aperture)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Area of a shape from its spans, by the midpoint rule over `n` lines.
    fn area(text: &str, n: usize) -> f64 {
        let shape = text.parse::<Aperture>().unwrap().shape().unwrap();
        let (half_x, half_y) = shape.half_box_m();
        let step = 2.0 * half_y / n as f64;
        let line = |k: usize| {
            let spans = shape.spans(-half_y + (k as f64 + 0.5) * step);
            assert!(spans.iter().all(|s| s.0 <= s.1 && s.0 >= -half_x - 1e-12 && s.1 <= half_x + 1e-12), "{text}: {spans:?}");
            assert!(spans.windows(2).all(|w| w[0].1 <= w[1].0));
            spans.iter().map(|s| s.1 - s.0).sum::<f64>()
        };
        (0..n).map(line).sum::<f64>() * step
    }

    #[test]
    fn every_shape_has_its_area_and_lies_in_its_box_and_its_circle() {
        let known = [
            ("circle=1.2m", std::f64::consts::PI * 0.36),
            ("rectangle=1.2m:80cm", 0.96),
            ("hexagon=2m", 1.5 * 3.0_f64.sqrt()),
            ("polygon=0m:0m:3m:0m:0m:2m", 3.0),
            ("polygon=-1m:-1m:1m:-1m:1m:1m:0m:0m:-1m:1m", 3.0),
        ];
        for (text, expected) in known {
            assert!((area(text, 20_000) / expected - 1.0).abs() < 1e-6, "{text}: {}", area(text, 20_000));
            let (aperture, again) = (text.parse::<Aperture>().unwrap(), text.parse::<Aperture>().unwrap().to_string());
            assert_eq!(again.parse::<Aperture>().unwrap(), aperture);
            let shape = aperture.shape().unwrap();
            let (half_x, half_y) = shape.half_box_m();
            assert!(shape.radius_m() >= half_x.max(half_y) - 1e-12 && shape.radius_m() <= half_x.hypot(half_y) + 1e-12, "{text}");
        }
        assert!(SHAPES.iter().all(|kind| known.iter().any(|(text, _)| text.starts_with(kind.name))));
    }

    #[test]
    fn a_wrong_shape_says_what_is_expected() {
        let message = |text: &str| text.parse::<Aperture>().unwrap_err();
        assert!(message("disc=1m").contains("circle=DIAMETER"));
        assert!(message("circle=1").contains("no unit"));
        assert!(message("circle").contains("circle=DIAMETER") && message("circle=1m:2m").contains("2 lengths"));
        assert!(message("circle=-1m").contains("above 0"));
        assert!(message("polygon=0m:0m:1m:0m").contains("three"));
        assert!(message("polygon=0m:0m:1m:0m:2m:0m").contains("area"));
    }
}
