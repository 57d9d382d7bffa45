//! The paths from the points of a scene to the elements of an array.
//!
//! A point lies at the distance R = 1/kappa from the origin of the layout in the direction s. Its distance from the element at r is
//! d = R sqrt(1 - 2 kappa s.r + kappa^2 r^2), and the excess of the path, d - R, is computed as
//!
//! ```text
//! e = (kappa r^2 - 2 s.r) / (1 + sqrt(1 - 2 kappa s.r + kappa^2 r^2))
//! ```
//!
//! which loses no digits however far the point is: kappa = 0 gives -s.r, the far field, exactly.

use crate::{ChainError, Result, ensure};
use cittert_arrays::{ArrayLayout, ElementPattern, FocusPoint, LayoutFrame, SPEED_OF_LIGHT_M_S};

/// A point of a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Direction cosines to the right, up and along the boresight.
    pub toward: [f64; 3],
    /// 1 / distance from the origin of the layout, 1/m; 0 for the far field.
    pub curvature: f64,
}

impl Point {
    /// The point of a surface in the direction (l, m); `None` behind the horizon.
    #[must_use]
    pub fn on(surface: &super::Surface, l: f64, m: f64) -> Option<Self> {
        let n2 = 1.0 - l * l - m * m;
        (n2 >= 0.0).then(|| Self { toward: [l, m, n2.sqrt()], curvature: surface.curvature(l, m) })
    }
}

impl From<FocusPoint> for Point {
    fn from(p: FocusPoint) -> Self {
        Self { toward: p.direction(), curvature: p.range_m.recip() }
    }
}

/// The path from a point to the element at `r`, m: its excess over that to the origin, and the distance from the origin over that from the element.
#[inline(always)]
#[must_use]
pub fn path(r: [f64; 3], p: Point) -> (f64, f64) {
    let along = p.toward[0] * r[0] + p.toward[1] * r[1] + p.toward[2] * r[2];
    let square = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
    let root = (1.0 - 2.0 * p.curvature * along + p.curvature * p.curvature * square).sqrt();
    ((p.curvature * square - 2.0 * along) / (1.0 + root), root.recip())
}

/// The elements of an array as the points of a scene see them.
#[derive(Debug, Clone)]
pub struct Elements {
    /// Positions in the frame of the boresight, m.
    positions_m: Vec<[f64; 3]>,
    /// Excess of the path from the point to which the visibilities are phased, m.
    reference_m: Vec<f64>,
    /// Power pattern, each element's at its own angle to the point.
    pub(super) pattern: ElementPattern,
    /// Whether the voltages of the pattern are divided by that of an element at the origin, for images that contain its power.
    pub(super) relative: bool,
    /// The frequency of the pattern, Hz, where it is that of one frequency for all channels.
    pub(super) pattern_hz: Option<f64>,
}

impl Elements {
    /// The elements of a layout, with their pattern, for visibilities that are phased to this point (without one, to the boresight).
    ///
    /// # Errors
    /// A layout that stands on the Earth.
    pub fn new(layout: &ArrayLayout, focus: Option<FocusPoint>) -> Result<Self> {
        let text = format!(
            "layout {:?} stands on the Earth and follows the sky: the near field is that of an array in the frame of its boresight (frame = \"boresight\")",
            layout.name
        );
        ensure!(matches!(layout.frame, LayoutFrame::Boresight), ChainError::Incompatible(text));
        let positions_m: Vec<[f64; 3]> = layout.antennas().iter().map(|a| a.position_m).collect();
        // The direction of the boresight is a point at infinity.
        let point = focus.map_or(Point { toward: [0.0, 0.0, 1.0], curvature: 0.0 }, Point::from);
        let reference_m = positions_m.iter().map(|r| path(*r, point).0).collect();
        let elements = Self { positions_m, reference_m, pattern: layout.pattern.clone(), relative: false, pattern_hz: None };
        if let Some(p) = focus {
            elements.check_distance(p.range_m)?;
        }
        Ok(elements)
    }

    /// The same with the pattern at one frequency, Hz, and relative to that of an element at the origin.
    #[must_use]
    pub fn relative_at(mut self, freq_hz: f64) -> Self {
        (self.relative, self.pattern_hz) = (true, Some(freq_hz));
        self
    }

    /// The same with the pattern relative to that of an element at the origin, or not.
    #[must_use]
    pub fn relative(mut self, relative: bool) -> Self {
        self.relative = relative;
        self
    }

    /// Number of elements.
    #[must_use]
    pub fn len(&self) -> usize {
        self.positions_m.len()
    }

    /// True without elements.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.positions_m.is_empty()
    }

    /// Positions, m.
    #[must_use]
    pub fn positions_m(&self) -> &[[f64; 3]] {
        &self.positions_m
    }

    /// Distance of the farthest element from the origin, m.
    #[must_use]
    pub fn reach_m(&self) -> f64 {
        self.positions_m.iter().map(|r| r.iter().map(|x| x * x).sum::<f64>().sqrt()).fold(0.0, f64::max)
    }

    /// Check that a scene at this distance from the origin, m, is in front of all elements.
    ///
    /// # Errors
    /// It is not farther away than the farthest element.
    pub fn check_distance(&self, nearest_m: f64) -> Result<()> {
        let reach = self.reach_m();
        let text = format!(
            "the distance of the scene is {nearest_m} m: expected more than {reach} m, the distance of the farthest element from the origin"
        );
        ensure!(nearest_m > reach, ChainError::Incompatible(text));
        Ok(())
    }

    /// The delay of a point at an element against that of the point to which the visibilities are phased, s, and the amplitude by its distance.
    #[inline(always)]
    #[must_use]
    pub fn delay(&self, element: usize, p: Point) -> (f64, f64) {
        let (excess, amplitude) = path(self.positions_m[element], p);
        ((excess - self.reference_m[element]) / SPEED_OF_LIGHT_M_S, amplitude)
    }

    /// The voltage with which an element sees a point.
    #[must_use]
    pub fn voltage(&self, element: usize, p: Point, freq_hz: f64) -> f64 {
        let freq = self.pattern_hz.unwrap_or(freq_hz);
        let (r, inverse) = (self.positions_m[element], path(self.positions_m[element], p).1);
        let [l, m, n] = [0, 1, 2].map(|k| (p.toward[k] - p.curvature * r[k]) * inverse);
        let seen = if n > 0.0 { self.pattern.voltage(l, m, freq) } else { 0.0 };
        if !self.relative {
            return seen;
        }
        let at_origin = self.pattern.power(p.toward[0], p.toward[1], freq);
        if at_origin > 0.0 { seen / at_origin.sqrt() } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::{Antenna, Site};

    #[test]
    fn the_excess_keeps_its_digits_from_a_metre_to_infinity() {
        let (r, l, m) = ([0.4, -0.3, 0.02], 0.1, -0.05);
        let toward = [l, m, (1.0_f64 - l * l - m * m).sqrt()];
        for range in [1.5, 10.0, 1e3] {
            let d = (0..3).map(|k| (toward[k] * range - r[k]).powi(2)).sum::<f64>().sqrt();
            let (excess, amplitude) = path(r, Point { toward, curvature: 1.0 / range });
            assert!((excess - (d - range)).abs() < 4.0 * f64::EPSILON * range && (amplitude - range / d).abs() < 1e-14);
        }
        let far = -(toward[0] * r[0] + toward[1] * r[1] + toward[2] * r[2]);
        assert_eq!(path(r, Point { toward, curvature: 0.0 }), (far, 1.0));
        assert!((path(r, Point { toward, curvature: 1e-15 }).0 - far).abs() < 1e-15);
    }

    #[test]
    fn an_element_sees_a_point_at_its_own_angle() {
        let antennas = vec![Antenna::new("a", 0, [0.5, 0.0, 0.0]), Antenna::new("b", 1, [0.0, 0.0, 0.0])];
        let mut layout = ArrayLayout::new("t", LayoutFrame::Boresight, antennas).unwrap();
        layout.pattern = "gaussian fwhm_deg=9".parse().unwrap();
        let p = Point { toward: [0.0, 0.0, 1.0], curvature: 0.5 };
        let seen = Elements::new(&layout, None).unwrap();
        let angle = (0.5_f64 / 2.0).atan();
        let power = 0.5_f64.powf((angle / 4.5_f64.to_radians()).powi(2));
        assert!((seen.voltage(0, p, 1e11).powi(2) - power).abs() < 1e-12);
        assert_eq!(seen.voltage(1, p, 1e11), 1.0);
    }

    #[test]
    fn arrays_on_the_earth_and_scenes_within_the_array_are_refused() {
        let antennas = || vec![Antenna::new("a", 0, [0.5, 0.0, 0.0]), Antenna::new("b", 1, [0.0, 0.0, 0.0])];
        let site = Site { latitude_rad: 0.1, longitude_rad: 0.2, altitude_m: 0.0 };
        let e = Elements::new(&ArrayLayout::new("vla", LayoutFrame::EastNorthUp(site), antennas()).unwrap(), None).unwrap_err().to_string();
        assert!(e.contains("stands on the Earth"), "{e}");
        let near = FocusPoint::new(0.0, 0.0, 0.4).unwrap();
        let e = Elements::new(&ArrayLayout::new("mm", LayoutFrame::Boresight, antennas()).unwrap(), Some(near)).unwrap_err().to_string();
        assert!(e.contains("more than 0.5 m"), "{e}");
    }
}
