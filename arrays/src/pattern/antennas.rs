//! Patterns that differ from antenna to antenna: where each one points, and how wide it is.

use super::element::ElementPattern;
use crate::{ArrayError, Result};
use ndarray::Array2;

/// The pattern of one antenna beside the common one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pointing {
    /// Direction cosine l of the axis of the pattern, rad; 0 for an antenna that points to the phase centre.
    pub l: f64,
    /// Direction cosine m of the axis, rad.
    pub m: f64,
    /// Width over that of the common pattern.
    pub width: f64,
}

impl Pointing {
    /// An antenna that points to the phase centre with the common pattern.
    pub const NOMINAL: Self = Self { l: 0.0, m: 0.0, width: 1.0 };

    /// The direction (l, m, n) in the axes of a pattern that points to this axis: turned by the shortest way from the axis to the middle. `None`
    /// behind the antenna.
    #[must_use]
    pub fn seen(&self, [l, m, n]: [f64; 3]) -> Option<[f64; 2]> {
        let (a, b) = (self.l, self.m);
        let c = (1.0 - a * a - b * b).max(0.0).sqrt();
        // Rodrigues' formula for the turn about (-b, a, 0) that takes (a, b, c) to (0, 0, 1).
        let along = (a * m - b * l) / (1.0 + c);
        let front = a * l + b * m + c * n > 0.0;
        front.then_some([c * l - a * n - b * along, c * m - b * n + a * along])
    }
}

impl Default for Pointing {
    fn default() -> Self {
        Self::NOMINAL
    }
}

/// Where the antennas of an array point, and how wide their patterns are, over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Pointings {
    /// Midpoints of the intervals, Julian date UTC, in ascending order \[time\].
    pub time_jd: Vec<f64>,
    /// \[time, ant\].
    pub antennas: Array2<Pointing>,
    /// Standard deviation of l and of m, rad, where they were measured \[time, ant\].
    pub sigma_rad: Option<Array2<[f64; 2]>>,
}

/// The largest offset of an axis. Beyond it, an antenna looks at something else.
const FARTHEST: f64 = 0.9;

impl Pointings {
    /// All antennas point to the phase centre at all times.
    #[must_use]
    pub fn nominal(time_jd: Vec<f64>, n_ant: usize) -> Self {
        let antennas = Array2::from_elem((time_jd.len(), n_ant), Pointing::NOMINAL);
        Self { time_jd, antennas, sigma_rad: None }
    }

    /// Check the shapes and the numbers, for an array of `n_ant` antennas.
    ///
    /// # Errors
    /// No time, times that do not increase, another number of antennas, an axis more than 64 degrees away, a width that is not positive.
    pub fn check(&self, n_ant: usize) -> Result<()> {
        let ordered =
            !self.time_jd.is_empty() && self.time_jd.iter().all(|t| t.is_finite()) && self.time_jd.windows(2).all(|w| w[1] > w[0]);
        ArrayError::unless(ordered, "times of the pointings", self.time_jd.len(), "one time or more, in ascending order")?;
        ArrayError::unless_shape("pointings", self.antennas.shape(), &[self.time_jd.len(), n_ant])?;
        for ((_, ant), p) in self.antennas.indexed_iter() {
            let off = p.l.hypot(p.m);
            ArrayError::unless(off <= FARTHEST, "pointing offset in rad", format!("{off} of antenna {ant}"), "at most 0.9")?;
            let good = p.width.is_finite() && (0.01..=100.0).contains(&p.width);
            ArrayError::unless(good, "relative width of a pattern", format!("{} of antenna {ant}", p.width), "0.01 to 100")?;
        }
        Ok(())
    }

    /// Index of the interval that is nearest to a time.
    #[must_use]
    pub fn index_at(&self, time_jd: f64) -> usize {
        let after = self.time_jd.partition_point(|t| *t < time_jd).min(self.time_jd.len() - 1);
        if after > 0 && time_jd - self.time_jd[after - 1] <= self.time_jd[after] - time_jd { after - 1 } else { after }
    }

    /// Voltage of the pattern of an antenna at an interval in directions (l, m, n), for a frequency in Hz.
    pub fn voltages<'a>(
        &self,
        common: &ElementPattern,
        (time, ant): (usize, usize),
        freq_hz: f64,
        toward: impl Iterator<Item = [f64; 3]> + 'a,
    ) -> impl Iterator<Item = f64> + 'a {
        let pointing = self.antennas[[time, ant]];
        let pattern = if pointing.width == 1.0 { common.clone() } else { common.widened(pointing.width) };
        toward.map(move |s| pointing.seen(s).map_or(0.0, |[l, m]| pattern.voltage(l, m, freq_hz)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_axis_is_seen_in_the_middle_and_angles_stay() {
        let p = Pointing { l: 0.3, m: -0.2, width: 1.0 };
        let axis = [0.3, -0.2, (1.0_f64 - 0.13).sqrt()];
        let [l, m] = p.seen(axis).unwrap();
        assert!(l.abs() < 1e-15 && m.abs() < 1e-15);
        for s in [[0.1, 0.4], [-0.6, 0.2], [0.0, 0.0]] {
            let n = (1.0_f64 - s[0] * s[0] - s[1] * s[1]).sqrt();
            let [l, m] = p.seen([s[0], s[1], n]).unwrap();
            let cosine = s[0] * axis[0] + s[1] * axis[1] + n * axis[2];
            assert!((l.hypot(m) - (1.0 - cosine * cosine).sqrt()).abs() < 1e-14, "the angle from the axis");
            // Away from the turn, directions across it stay where they are.
        }
        let [l, m] = Pointing { l: 1e-4, m: 0.0, width: 1.0 }.seen([0.0, 0.1, 0.99_f64.sqrt()]).unwrap();
        assert!((l + 1e-4 * 0.99_f64.sqrt()).abs() < 1e-8 && (m - 0.1).abs() < 1e-8, "{l} {m}");
        assert!(Pointing { l: 0.5, m: 0.0, width: 1.0 }.seen([-0.99, 0.0, 0.0199_f64.sqrt()]).is_none());
    }

    #[test]
    fn wider_patterns_are_the_same_pattern_at_a_smaller_angle() {
        let near = [0.02, -0.013];
        for text in ["gaussian fwhm_deg=9", "gaussian fwhm_deg=9 ref_freq_ghz=90", "airy diameter_m=0.02 blockage=0.2", "cos exponent=60"] {
            let pattern: ElementPattern = text.parse().unwrap();
            let wide = pattern.widened(1.5).power(1.5 * near[0], 1.5 * near[1], 94e9);
            let tolerance = if text.starts_with("airy") { 1e-14 } else { 2e-4 };
            assert!((wide - pattern.power(near[0], near[1], 94e9)).abs() < tolerance, "{text}");
            assert!((pattern.voltage(near[0], near[1], 94e9).powi(2) - pattern.power(near[0], near[1], 94e9)).abs() < 1e-15);
        }
        // The first side lobe of a disc has the opposite sign.
        let airy: ElementPattern = "airy diameter_m=1".parse().unwrap();
        assert!(airy.voltage(5.0 / std::f64::consts::PI * 0.299_792_458, 0.0, 1e9) < -0.1);
    }

    #[test]
    fn wrong_tables_are_refused() {
        let mut p = Pointings::nominal(vec![1.0, 2.0], 3);
        p.check(3).unwrap();
        assert!(p.check(4).is_err());
        p.antennas[[1, 2]].width = 0.0;
        assert!(p.check(3).unwrap_err().to_string().contains("antenna 2"));
        assert!(Pointings::nominal(vec![2.0, 1.0], 3).check(3).is_err());
        assert!(Pointings::nominal(vec![], 3).check(3).is_err());
    }
}
