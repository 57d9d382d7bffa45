//! Where elements may stand: a disc or polygons, without keep-out zones.

use super::polygon::Polygon;

/// The ground on which elements may stand.
#[derive(Debug, Clone, PartialEq)]
pub struct Region {
    /// Radius of the disc about the centre in which all elements stand.
    pub radius: f64,
    /// Polygons of which an element must be in at least one; none for the whole disc.
    pub inside: Vec<Polygon>,
    /// Polygons in which no element may stand.
    pub outside: Vec<Polygon>,
}

impl Region {
    /// A disc about the centre.
    #[must_use]
    pub fn disc(radius: f64) -> Self {
        Self { radius, inside: Vec::new(), outside: Vec::new() }
    }

    /// How far a point violates each rule that it comes within `margin` of violating (negative: the distance that is left), with the direction in
    /// which the violation grows.
    pub(super) fn violations(&self, p: [f64; 2], margin: f64) -> impl Iterator<Item = (f64, [f64; 2])> {
        let r = p[0].hypot(p[1]);
        let rim = (r - self.radius, if r > 0.0 { [p[0] / r, p[1] / r] } else { [0.0; 2] });
        let nearest = self.inside.iter().map(|q| q.depth(p)).min_by(|a, b| a.0.total_cmp(&b.0));
        let zones = self.outside.iter().map(move |q| {
            let (depth, [x, y]) = q.depth(p);
            (-depth, [-x, -y])
        });
        std::iter::once(rim).chain(nearest).chain(zones).filter(move |(v, _)| *v > -margin)
    }

    /// True where an element may stand, within `tolerance`.
    #[must_use]
    pub fn contains(&self, p: [f64; 2], tolerance: f64) -> bool {
        self.violations(p, -tolerance).next().is_none()
    }

    /// The point itself, or one nearby where an element may stand. `None` if a few steps along the rules do not lead there.
    #[must_use]
    pub fn nearest(&self, mut p: [f64; 2]) -> Option<[f64; 2]> {
        for _ in 0..20 {
            let Some((v, d)) = self.violations(p, 0.0).max_by(|a, b| a.0.total_cmp(&b.0)) else { return Some(p) };
            // A little further than the edge, so that rounding does not leave the point outside.
            let step = v * (1.0 + 1e-9) + 1e-12 * self.radius;
            p = [p[0] - step * d[0], p[1] - step * d[1]];
        }
        None
    }
}
