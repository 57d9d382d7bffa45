//! Motion of the scene.

use crate::ensure;
use crate::values::by_text;
use cittert_arrays::quantity::Angle;
use std::fmt;
use std::str::FromStr;

/// Motion of the scene, as it is written: `2mrad/s` along the columns, or `2mrad/s:90deg` in another direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Angle in a second, rad.
    pub speed: Angle,
    /// Direction from the columns of the image towards its rows, rad.
    pub direction: Angle,
}
by_text!(Motion, "string", "An angle a second and a direction, such as \"2mrad/s:90deg\".");

impl Motion {
    /// Angle in a second along columns and rows, rad.
    pub(super) fn components(self) -> (f64, f64) {
        let (sin, cos) = self.direction.si().sin_cos();
        (self.speed.si() * cos, self.speed.si() * sin)
    }
}

impl FromStr for Motion {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (speed, direction) = text.split_once(':').unwrap_or((text, "0deg"));
        let angle =
            speed.trim().strip_suffix("/s").ok_or_else(|| format!("{text:?} has no /s: write an angle a second such as 2mrad/s:90deg"))?;
        let read = |part: &str| part.parse::<Angle>().map_err(|e| format!("{e} (write 2mrad/s:90deg)"));
        let (speed, direction) = (read(angle)?, read(direction)?);
        ensure!(speed.si() >= 0.0, format!("{text:?} is below 0: give the direction after a colon, as in 2mrad/s:180deg"));
        Ok(Self { speed, direction })
    }
}

impl fmt::Display for Motion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/s:{}", self.speed, self.direction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn motion_is_read_and_written() {
        let motion: Motion = "2mrad/s:90deg".parse().unwrap();
        let (x, y) = motion.components();
        assert!(x.abs() < 1e-18 && (y - 2e-3).abs() < 1e-15);
        assert_eq!(motion.to_string().parse::<Motion>().unwrap(), motion);
        assert!("2mrad".parse::<Motion>().unwrap_err().contains("/s") && "2/s".parse::<Motion>().is_err());
    }
}
