//! The conditions that a layout must meet: elements on the ground, apart from each other, and a narrow beam.

use super::array_factor::{beam, power_gradient};
use super::freedom::Freedom;
use super::region::Region;
use super::views::View;
use std::f64::consts::PI;

/// Directions of half a circle in which the width of the beam is limited.
const AZIMUTHS: usize = 36;
/// The beam at half of its width may be this much below one half, so that the width between the azimuths is right too.
const BEAM_MARGIN: f64 = 2e-4;

/// Directions of half a circle in which the width is measured, and steps from the centre outwards until the beam is below one half.
const WIDTH_AZIMUTHS: usize = 180;
const WIDTH_STEP: f64 = 0.05;
const WIDTH_STEPS: i32 = 2000;
/// Relative margin of the stricter conditions.
const STRICTER: f64 = 2e-3;

/// Conditions on the positions. Lengths are in the unit of the positions, beam widths in wavelengths over that unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Limits {
    /// Where elements may stand.
    pub region: Region,
    /// The smallest distance of two elements; 0 for none.
    pub spacing: f64,
    /// The largest full width of the beam at half of its maximum, over all azimuths.
    pub beam: Option<f64>,
    /// The views whose mean beam is limited.
    pub views: Vec<View>,
}

/// One condition near its limit: by how much it is violated (negative: what is left), and the gradient by the positions of the elements named.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Violation {
    pub(super) amount: f64,
    pub(super) by_element: Vec<(usize, [f64; 2])>,
}

impl Limits {
    /// The conditions that are violated or within `margin` (a length, relative to the radius of the region) of it.
    pub(super) fn near(&self, xy: &[[f64; 2]], margin: f64) -> Vec<Violation> {
        let mut out = Vec::new();
        let room = margin * self.region.radius;
        for (k, p) in xy.iter().enumerate() {
            out.extend(self.region.violations(*p, room).map(|(amount, d)| Violation { amount, by_element: vec![(k, d)] }));
        }
        if self.spacing > 0.0 {
            for (i, a) in xy.iter().enumerate() {
                for (k, b) in xy.iter().enumerate().skip(i + 1) {
                    let (x, y) = (b[0] - a[0], b[1] - a[1]);
                    let distance = x.hypot(y);
                    if distance < self.spacing + room {
                        // Two elements at one place part along x.
                        let d = if distance > 0.0 { [x / distance, y / distance] } else { [1.0, 0.0] };
                        let by_element = vec![(i, d), (k, [-d[0], -d[1]])];
                        out.push(Violation { amount: self.spacing - distance, by_element });
                    }
                }
            }
        }
        if let Some(width) = self.beam {
            out.extend(self.wide_beam(xy, width, margin));
        }
        out
    }

    /// The azimuths in which the beam is above one half at half of its largest width.
    fn wide_beam(&self, xy: &[[f64; 2]], width: f64, margin: f64) -> Vec<Violation> {
        let n = xy.len() as f64;
        let scale = 1.0 / (n * (n - 1.0));
        let mut by_seen = vec![[0.0; 2]; xy.len()];
        let mut out = Vec::new();
        for k in 0..AZIMUTHS {
            let (s, c) = (PI * k as f64 / AZIMUTHS as f64).sin_cos();
            let direction = [0.5 * width * c, 0.5 * width * s];
            let mut total = vec![[0.0; 2]; xy.len()];
            let mut value = -1.0 / (n - 1.0);
            for view in &self.views {
                let w = scale * view.weight;
                value += w * power_gradient(xy, view.direction(direction), &mut by_seen);
                for (t, g) in total.iter_mut().zip(&by_seen) {
                    *t = [t[0] + w * g[0], t[1] + w * g[1]];
                }
            }
            let amount = value - 0.5 + BEAM_MARGIN;
            if amount > -margin {
                out.push(Violation { amount, by_element: total.into_iter().enumerate().collect() });
            }
        }
        out
    }

    /// The sum of the squares of all violations, with its gradient times `weight` added to `gradient`.
    pub(super) fn penalty(&self, xy: &[[f64; 2]], weight: f64, gradient: &mut [[f64; 2]]) -> f64 {
        let mut sum = 0.0;
        for v in self.near(xy, 0.0) {
            sum += weight * v.amount * v.amount;
            for (k, d) in v.by_element {
                let factor = 2.0 * weight * v.amount;
                gradient[k] = [gradient[k][0] + factor * d[0], gradient[k][1] + factor * d[1]];
            }
        }
        sum
    }

    /// The same conditions a little stricter, for searches that keep to limits only within a small margin.
    #[must_use]
    pub(super) fn stricter(&self) -> Self {
        Self { spacing: self.spacing * (1.0 + STRICTER), beam: self.beam.map(|b| b * (1.0 - STRICTER)), ..self.clone() }
    }

    /// The smallest and the largest full width of the mean beam at half of its maximum over all azimuths, in wavelengths over the aperture.
    #[must_use]
    pub fn width(&self, xy: &[[f64; 2]]) -> [f64; 2] {
        let value = |direction: [f64; 2]| self.views.iter().map(|v| v.weight * beam(xy, v.direction(direction))).sum::<f64>();
        let mut out = [f64::INFINITY, 0.0];
        for k in 0..WIDTH_AZIMUTHS {
            let (s, c) = (PI * k as f64 / WIDTH_AZIMUTHS as f64).sin_cos();
            let at = |r: f64| value([r * c, r * s]);
            // A beam that is wider than the sky of any aperture has no width in this direction.
            let outside = (1..=WIDTH_STEPS).map(|i| WIDTH_STEP * f64::from(i)).find(|r| at(*r) < 0.5);
            let radius = outside.map_or(f64::INFINITY, |mut high| {
                let mut low = high - WIDTH_STEP;
                for _ in 0..40 {
                    let middle = f64::midpoint(low, high);
                    if at(middle) < 0.5 { high = middle } else { low = middle }
                }
                high
            });
            out = [out[0].min(2.0 * radius), out[1].max(2.0 * radius)];
        }
        out
    }

    /// The largest violation; negative or 0 where all conditions are met.
    #[must_use]
    pub fn worst(&self, xy: &[[f64; 2]]) -> f64 {
        self.near(xy, 0.0).iter().map(|v| v.amount).fold(0.0, f64::max)
    }

    /// Move free elements that stand outside to where they may stand.
    pub(super) fn put_inside(&self, freedom: &Freedom, variables: &mut [f64]) {
        for p in variables.as_chunks_mut::<2>().0 {
            if let Some(inside) = self.region.nearest(*p) {
                *p = inside;
            }
        }
        debug_assert_eq!(variables.len(), freedom.variables());
    }
}
