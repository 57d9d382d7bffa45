//! The side lobes of a beam: what lies beyond the first minimum of its main lobe, out to the edge of a field.
//!
//! The beam is evaluated on a grid of directions. Newton's method then climbs from the highest grid points to the tops of their lobes, so
//! that the peak does not depend on where the grid points fall.

use super::main_lobe::Beam;
use super::psf::{Curve, Psf};
use std::f64::consts::PI;

/// Grid points per beam.
const PER_BEAM: f64 = 4.0;
/// Directions in which the end of the main lobe is searched, over half a turn.
pub(super) const RAYS: usize = 180;
/// Steps per beam in that search.
pub(super) const RAY_STEPS: f64 = 8.0;
/// Lobes of at least this fraction of the highest grid point are climbed. A top is at most 0.18 beams from a grid point, where it has fallen by
/// less than a tenth.
const CLIMBED: f64 = 0.85;
/// Most lobes that are climbed.
const MOST_CLIMBED: usize = 24;
/// Rays on which the bottom of the first minimum is found: those where it is deepest.
const DEEPEST: usize = 3;
/// The beam outside its main lobe, over its peak.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SideLobes {
    /// Largest absolute value.
    pub peak: f64,
    /// Smallest value: the deepest negative lobe.
    pub lowest: f64,
    pub rms: f64,
}

/// Where the main lobe ends along a ray: its distance in beams, and the value of the beam there (1 where the field ends before).
#[derive(Debug, Clone, Copy)]
pub(super) struct Edge {
    pub beams: f64,
    pub value: f64,
}

/// The directions of a field, from which those of the main lobe are still to be taken out.
pub(super) struct Field {
    /// Steps of the grid, direction cosines.
    pub step_x: [f64; 2],
    pub step_y: [f64; 2],
    /// Grid points from the centre to the edge. The grid has rows 0..=half and columns -half..=half, as the beam is even.
    pub half: i64,
    /// Directions of the rays as direction cosines per beam.
    pub rays: Vec<[f64; 2]>,
    /// Number of steps to the edge of the field along a ray.
    pub ray_end: usize,
    /// For each grid point its distance in beams and its ray; no distance where it is beyond the field or the sky.
    places: Vec<(f64, usize)>,
    beam: [f64; 3],
    radius: f64,
}

impl Field {
    /// Most grid points from the centre to the edge of a field.
    pub(super) const MOST_POINTS: f64 = 4000.0;

    /// Out to a distance from the centre (a direction cosine); `None` where that is so many beams that the sums would take minutes.
    pub(super) fn within(beam: &Beam, radius: f64) -> Option<Self> {
        let points = (radius.min(1.0) / Self::step(beam)).ceil();
        (points <= Self::MOST_POINTS).then(|| Self::new([beam.minor_rad, beam.minor_rad, 0.0], points as i64, radius))
    }

    /// Distance of the grid points of a field, a direction cosine.
    pub(super) fn step(beam: &Beam) -> f64 {
        beam.minor_rad / PER_BEAM
    }

    /// So many grid points from the centre to each side, with the corners, as far as the horizon.
    pub(super) fn of_cells(beam: &Beam, half: i64) -> Self {
        Self::new([beam.minor_rad, beam.minor_rad, 0.0], half, 1.0)
    }

    fn new(beam: [f64; 3], half: i64, radius: f64) -> Self {
        let [minor, major, pa] = beam;
        let (sin_pa, cos_pa) = pa.sin_cos();
        let (unit_x, unit_y) = ([cos_pa, -sin_pa].map(|v| v * minor), [sin_pa, cos_pa].map(|v| v * major));
        let rays = (0..RAYS)
            .map(|k| {
                let (s, c) = (PI * k as f64 / RAYS as f64).sin_cos();
                [0, 1].map(|i| c * unit_x[i] + s * unit_y[i])
            })
            .collect();
        let mut places = Vec::with_capacity(((half + 1) * (2 * half + 1)) as usize);
        for j in 0..=half {
            for i in -half..=half {
                let (x, y) = (i as f64 / PER_BEAM, j as f64 / PER_BEAM);
                let r = (0..2).map(|k| (x * unit_x[k] + y * unit_y[k]).powi(2)).sum::<f64>().sqrt();
                // The same turn for a direction and its opposite.
                let ray = (y.atan2(x).rem_euclid(PI) / PI * RAYS as f64).floor() as usize % RAYS;
                places.push((if r > radius || r > 1.0 { f64::NAN } else { x.hypot(y) }, ray));
            }
        }
        let ray_end = (half as f64 / PER_BEAM * RAY_STEPS) as usize;
        Self { step_x: unit_x.map(|v| v / PER_BEAM), step_y: unit_y.map(|v| v / PER_BEAM), half, rays, ray_end, places, beam, radius }
    }

    /// The direction at a number of beams along a ray.
    pub(super) fn on_ray(&self, ray: usize, beams: f64) -> [f64; 2] {
        self.rays[ray].map(|v| v * beams)
    }

    /// Where the main lobe ends on each ray: where the beam first stops falling. `value` gives the beam on a ray after so many steps.
    pub(super) fn edges(&self, value: impl Fn(usize, usize) -> f64) -> Vec<Edge> {
        let end = |ray: usize| {
            let mut last = 1.0;
            for step in 1..=self.ray_end {
                let next = value(ray, step);
                if next > last {
                    return Edge { beams: (step - 1) as f64 / RAY_STEPS, value: last };
                }
                last = next;
            }
            // No minimum within the field.
            Edge { beams: self.ray_end as f64 / RAY_STEPS, value: 1.0 }
        };
        (0..RAYS).map(end).collect()
    }

    /// Side lobes of the values on the grid, row by row, beyond the edges of the main lobe. `curve` gives the beam and its derivatives in any
    /// direction.
    pub(super) fn lobes(&self, values: &[f64], edges: &[Edge], curve: impl Fn(f64, f64) -> Curve) -> SideLobes {
        let beyond = |distance: f64, ray: usize| distance > edges[ray].beams.max(edges[(ray + 1) % RAYS].beams);
        let (mut peak, mut lowest, mut sum, mut count) = (0.0_f64, 0.0_f64, 0.0, 0_usize);
        for (v, (distance, ray)) in values.iter().zip(&self.places) {
            if beyond(*distance, *ray) {
                peak = peak.max(v.abs());
                lowest = lowest.min(*v);
                sum += v * v;
                count += 1;
            }
        }
        for [l, m] in self.highest(values, peak, |k| beyond(self.places[k].0, self.places[k].1)) {
            if let Some((top, at)) = self.climb([l, m], &curve)
                && self.place(at).is_some_and(|(distance, ray)| beyond(distance, ray))
            {
                peak = peak.max(top.abs());
                lowest = lowest.min(top);
            }
        }
        // The first minimum itself belongs to the side lobes. In a beam like that of a filled disc it is the deepest of them.
        let mut order: Vec<usize> = (0..edges.len()).collect();
        order.sort_by(|a, b| edges[*a].value.total_cmp(&edges[*b].value));
        for ray in order.into_iter().take(DEEPEST).filter(|r| edges[*r].value < 0.0) {
            let bottom = self.bottom(ray, edges[ray], &curve);
            peak = peak.max(-bottom);
            lowest = lowest.min(bottom);
        }
        SideLobes { peak: peak.min(1.0), lowest, rms: if count == 0 { 0.0 } else { (sum / count as f64).sqrt() } }
    }

    /// Tops of the positive lobes that reach a level, beyond the edges of the main lobe, one of each lobe and its opposite. `rows` holds the values on
    /// the grid, \[j\]\[i\].
    pub(super) fn tops<'a>(
        &'a self,
        rows: &'a [Vec<f64>],
        edges: &'a [Edge],
        level: f64,
        curve: impl Fn(f64, f64) -> Curve + 'a,
    ) -> impl Iterator<Item = (f64, [f64; 2])> + 'a {
        let (half, width) = (self.half, 2 * self.half + 1);
        let beyond = |distance: f64, ray: usize| distance > edges[ray].beams.max(edges[(ray + 1) % RAYS].beams);
        let at = move |i: i64, j: i64| {
            let (i, j) = if j < 0 { (-i, -j) } else { (i, j) };
            if i.abs() > half || j > half { f64::NEG_INFINITY } else { rows[j as usize][(i + half) as usize] }
        };
        // Of two equal neighbours the first is the top.
        let is_top = move |i: i64, j: i64, v: f64| {
            let before = [(-1, -1), (0, -1), (1, -1), (-1, 0)].into_iter().all(|(a, b)| v > at(i + a, j + b));
            before && [(1, 0), (-1, 1), (0, 1), (1, 1)].into_iter().all(|(a, b)| v >= at(i + a, j + b))
        };
        let points = (0..=half).flat_map(move |j| (-half..=half).map(move |i| (i, j))).filter(|(i, j)| *j > 0 || *i > 0);
        points.filter_map(move |(i, j)| {
            let (v, (distance, ray)) = (at(i, j), self.places[(j * width + i + half) as usize]);
            if v < CLIMBED * level || !beyond(distance, ray) || !is_top(i, j, v) {
                return None;
            }
            let start = [0, 1].map(|k| i as f64 * self.step_x[k] + j as f64 * self.step_y[k]);
            self.climb(start, &curve).filter(|(top, _)| *top >= level)
        })
    }

    /// Grid points close to the peak, the highest first, no two of them neighbours.
    fn highest(&self, values: &[f64], peak: f64, beyond: impl Fn(usize) -> bool) -> Vec<[f64; 2]> {
        let mut order: Vec<usize> = (0..values.len()).filter(|k| values[*k].abs() >= CLIMBED * peak && beyond(*k)).collect();
        order.sort_by(|a, b| values[*b].abs().total_cmp(&values[*a].abs()));
        let width = 2 * self.half + 1;
        let mut taken: Vec<[i64; 2]> = Vec::new();
        for k in order {
            let at = [k as i64 % width - self.half, k as i64 / width];
            if taken.len() < MOST_CLIMBED && taken.iter().all(|t| (t[0] - at[0]).abs().max((t[1] - at[1]).abs()) > 1) {
                taken.push(at);
            }
        }
        taken.iter().map(|[i, j]| [0, 1].map(|k| *i as f64 * self.step_x[k] + *j as f64 * self.step_y[k])).collect()
    }

    /// The top (or bottom) of the lobe at a grid point by Newton's method; `None` where the surface does not bend like a lobe, or the top is
    /// farther away than the next grid points.
    fn climb(&self, start: [f64; 2], curve: impl Fn(f64, f64) -> Curve) -> Option<(f64, [f64; 2])> {
        let [mut l, mut m] = start;
        let reach = [0, 1].map(|k| self.step_x[k].abs() + self.step_y[k].abs());
        for _ in 0..12 {
            let c = curve(l, m);
            let [ll, lm, mm] = c.hessian;
            let determinant = ll * mm - lm * lm;
            // At a maximum of a positive lobe the second derivatives are negative, at the bottom of a negative one positive.
            if !(determinant > 0.0 && ll * c.value < 0.0) {
                return None;
            }
            let step = [(mm * c.gradient[0] - lm * c.gradient[1]) / determinant, (ll * c.gradient[1] - lm * c.gradient[0]) / determinant];
            (l, m) = (l - step[0], m - step[1]);
            if (l - start[0]).abs() > reach[0] || (m - start[1]).abs() > reach[1] {
                return None;
            }
            if step[0].hypot(step[1]) < 1e-9 * self.beam[0] {
                return Some((curve(l, m).value, [l, m]));
            }
        }
        None
    }

    /// The value at the first minimum of a ray, by Newton's method along the ray.
    fn bottom(&self, ray: usize, edge: Edge, curve: impl Fn(f64, f64) -> Curve) -> f64 {
        let (mut beams, [a, b]) = (edge.beams, self.rays[ray]);
        let mut best = edge.value;
        for _ in 0..6 {
            let c = curve(beams * a, beams * b);
            best = best.min(c.value);
            let slope = a * c.gradient[0] + b * c.gradient[1];
            let bend = a * a * c.hessian[0] + 2.0 * a * b * c.hessian[1] + b * b * c.hessian[2];
            let next = beams - slope / bend;
            if !(bend > 0.0 && (next - edge.beams).abs() <= 1.0 / RAY_STEPS) {
                break;
            }
            beams = next;
        }
        best
    }

    /// Distance in beams and ray of a direction of the field.
    fn place(&self, [l, m]: [f64; 2]) -> Option<(f64, usize)> {
        let [minor, major, pa] = self.beam;
        let (sin_pa, cos_pa) = pa.sin_cos();
        let (x, y) = ((l * cos_pa - m * sin_pa) / minor, (l * sin_pa + m * cos_pa) / major);
        let r = l.hypot(m);
        let edge = self.half as f64 / PER_BEAM;
        let inside = r <= self.radius && r <= 1.0 && x.abs() <= edge && y.abs() <= edge;
        inside.then(|| (x.hypot(y), (y.atan2(x).rem_euclid(PI) / PI * RAYS as f64).floor() as usize % RAYS))
    }
}

impl SideLobes {
    /// Side lobes of a beam in a field.
    pub(super) fn of(psf: &Psf, field: &Field) -> Self {
        let edges = field.edges(|ray, step| {
            let [l, m] = field.on_ray(ray, step as f64 / RAY_STEPS);
            psf.at(l, m)
        });
        let values: Vec<f64> = psf.on_grid(field.step_x, field.step_y, field.half).into_iter().flatten().collect();
        field.lobes(&values, &edges, |l, m| psf.curve(l, m))
    }
}
