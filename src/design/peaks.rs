//! The highest side lobes of an array, each found on a grid and then to its top.

use super::lobes::{LobeField, LobeGrid, LobeMap};
use super::views::View;
use std::f64::consts::{PI, TAU};

/// A direction and the beam there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lobe {
    /// Direction cosines (l, m) in wavelengths over the unit of the positions.
    pub direction: [f64; 2],
    /// The beam, 1 in its centre.
    pub value: f64,
}

/// The ring around the beam in which side lobes are searched, in wavelengths over the unit of the positions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ring {
    /// Its inner radius: the first minimum of the beam.
    pub inner: f64,
    /// Its outer radius.
    pub outer: f64,
}

/// Steps towards the top of a side lobe.
const CLIMBS: usize = 8;

/// Finds side lobes. It keeps the memory that this needs.
#[derive(Debug, Clone)]
pub struct PeakFinder {
    views: Vec<View>,
    ring: Ring,
    step: f64,
    field: LobeField,
    power: LobeMap,
    seen: Vec<[f64; 2]>,
    /// The same map as a full half plane, with one column or row around it \[m\]\[l\].
    plane: Vec<f64>,
}

fn slope_length(g: [f64; 2]) -> f64 {
    g[0].hypot(g[1]).max(f64::MIN_POSITIVE)
}

impl PeakFinder {
    /// For side lobes that are wider than `step`.
    #[must_use]
    pub fn new(views: &[View], ring: Ring, step: f64) -> Self {
        // The grid has one row and column more, so that lobes at the edge of the ring have neighbours.
        let grid = LobeGrid::new(0.0, ring.outer + 2.0 * step, step);
        let power = LobeMap::zeros(&grid);
        Self { views: views.to_vec(), ring, step, field: LobeField::new(grid), power, seen: Vec::new(), plane: Vec::new() }
    }

    /// All side lobes of at least `share` of the highest, the highest first. The edges of the ring count as lobes where they are high.
    pub fn find(&mut self, xy: &[[f64; 2]], share: f64) -> Vec<Lobe> {
        let n = xy.len() as f64;
        let scale = 1.0 / (n * (n - 1.0));
        self.power.clear();
        for view in &self.views {
            view.project(xy, &mut self.seen);
            self.field.set(&self.seen);
            self.field.add_power(scale * view.weight, &mut self.power);
        }
        let size = self.unfold();
        let at = |i: usize| (i as f64 + 0.5 - (size / 2) as f64) * self.step;
        let inside = |[l, m]: [f64; 2]| (self.ring.inner..=self.ring.outer).contains(&l.hypot(m));
        let offset = 1.0 / (n - 1.0);
        let mut lobes = self.edges(xy);
        let mut highest = lobes.iter().fold(0.0_f64, |a, l| a.max(l.value));
        let half = size / 2;
        for j in half..size - 1 {
            for i in 1..size - 1 {
                let direction = [at(i), at(j)];
                if inside(direction) {
                    highest = highest.max(self.plane[j * size + i] - offset);
                }
            }
        }
        let least = share * highest;
        for j in half..size - 1 {
            for i in 1..size - 1 {
                let value = self.plane[j * size + i];
                // The top of a lobe is higher than its highest point on the grid, by less than a quarter on grids of a fifth of a wavelength.
                if value < 0.75 * (least + offset) {
                    continue;
                }
                let neighbours = [j - 1, j, j + 1].into_iter().flat_map(|j| [i - 1, i, i + 1].map(|i| j * size + i));
                if !neighbours.into_iter().all(|k| self.plane[k] <= value) {
                    continue;
                }
                let (l, m) = (at(i), at(j));
                if !(self.ring.inner - 2.0 * self.step..=self.ring.outer + 2.0 * self.step).contains(&l.hypot(m)) {
                    continue;
                }
                let top = self.climb(xy, [l, m]);
                if inside(top.direction) && top.value >= least {
                    lobes.push(top);
                }
            }
        }
        lobes.retain(|l| l.value >= least);
        lobes.sort_by(|a, b| b.value.total_cmp(&a.value));
        lobes
    }

    /// The highest side lobe.
    pub fn highest(&mut self, xy: &[[f64; 2]]) -> f64 {
        self.find(xy, 0.97).first().map_or(0.0, |l| l.value)
    }

    /// Unfold the map of power into a plane \[m\]\[l\], and return the length of its sides.
    fn unfold(&mut self) -> usize {
        let half = ((self.ring.outer + 2.0 * self.step) / self.step).ceil() as usize;
        let size = 2 * half;
        self.plane.clear();
        self.plane.resize(size * size, 0.0);
        let mut values = Vec::new();
        self.field.apply(&mut self.power, |v| values.push(*v));
        for ([l, m], value) in self.field.grid().directions().zip(values) {
            let (i, j) = ((l / self.step).floor() as isize, (m / self.step).floor() as isize);
            for (i, j) in [(i, j), (-1 - i, -1 - j)] {
                let (x, y) = (i + half as isize, j + half as isize);
                if let (Ok(x), Ok(y)) = (usize::try_from(x), usize::try_from(y))
                    && x < size
                    && y < size
                {
                    self.plane[y * size + x] = value;
                }
            }
        }
        size
    }

    /// The mean beam of all views, its gradient and its second derivatives by the direction.
    fn curvature(&self, xy: &[[f64; 2]], [l, m]: [f64; 2]) -> (f64, [f64; 2], [f64; 3]) {
        let n = xy.len() as f64;
        let scale = 1.0 / (n * (n - 1.0));
        let (mut value, mut slope, mut second) = (-1.0 / (n - 1.0), [0.0; 2], [0.0; 3]);
        for view in &self.views {
            let (mut a, mut d, mut h) = ([0.0; 2], [[0.0; 2]; 2], [[0.0; 2]; 3]);
            let v = view.matrix;
            for p in xy {
                let x = v[0][0] * p[0] + v[0][1] * p[1];
                let y = v[1][0] * p[0] + v[1][1] * p[1];
                let (s, c) = (TAU * (x * l + y * m)).sin_cos();
                a = [a[0] + c, a[1] + s];
                for (d, x) in d.iter_mut().zip([x, y]) {
                    *d = [d[0] - TAU * x * s, d[1] + TAU * x * c];
                }
                for (h, xx) in h.iter_mut().zip([x * x, x * y, y * y]) {
                    *h = [h[0] - TAU * TAU * xx * c, h[1] - TAU * TAU * xx * s];
                }
            }
            let dot = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
            let w = scale * view.weight;
            value += w * dot(a, a);
            slope = [0, 1].map(|i| slope[i] + 2.0 * w * dot(a, d[i]));
            for (k, (i, j)) in [(0, 0), (0, 1), (1, 1)].into_iter().enumerate() {
                second[k] += 2.0 * w * (dot(d[i], d[j]) + dot(a, h[k]));
            }
        }
        (value, slope, second)
    }

    /// From a point of the grid to the top nearby, by Newton steps, and by steps uphill where the beam does not curve downwards on all sides.
    fn climb(&self, xy: &[[f64; 2]], start: [f64; 2]) -> Lobe {
        let mut direction = start;
        let mut best = Lobe { direction, value: f64::NEG_INFINITY };
        for _ in 0..CLIMBS {
            let (value, g, [ll, lm, mm]) = self.curvature(xy, direction);
            if value > best.value {
                best = Lobe { direction, value };
            }
            let det = ll * mm - lm * lm;
            let step = if det > 0.0 && ll < 0.0 {
                [(lm * g[1] - mm * g[0]) / det, (lm * g[0] - ll * g[1]) / det]
            } else {
                g.map(|along| 0.5 * self.step * along / slope_length(g))
            };
            let length = step[0].hypot(step[1]);
            let shrink = (self.step / length).min(1.0);
            direction = [direction[0] + shrink * step[0], direction[1] + shrink * step[1]];
            if length < 1e-6 || (direction[0] - start[0]).hypot(direction[1] - start[1]) > 2.0 * self.step {
                break;
            }
        }
        best
    }

    /// The highest points along the two edges of the ring.
    fn edges(&self, xy: &[[f64; 2]]) -> Vec<Lobe> {
        let mut out = Vec::new();
        for radius in [self.ring.inner, self.ring.outer] {
            let count = (PI * radius / (0.5 * self.step)).ceil().max(8.0) as usize;
            let point = |k: f64| {
                let (s, c) = (PI * k / count as f64).sin_cos();
                [radius * c, radius * s]
            };
            let value = |k: f64| self.mean_beam(xy, point(k));
            let values: Vec<f64> = (0..count).map(|k| value(k as f64)).collect();
            for k in 0..count {
                let (before, now, after) = (values[(k + count - 1) % count], values[k], values[(k + 1) % count]);
                if now >= before && now >= after {
                    // The top of the parabola through three points.
                    let bend = before - 2.0 * now + after;
                    let shift = if bend < 0.0 { 0.5 * (before - after) / bend } else { 0.0 };
                    let k = k as f64 + shift.clamp(-0.5, 0.5);
                    out.push(Lobe { direction: point(k), value: value(k) });
                }
            }
        }
        out
    }

    /// The mean beam of all views.
    fn mean_beam(&self, xy: &[[f64; 2]], direction: [f64; 2]) -> f64 {
        self.views.iter().map(|v| v.weight * super::array_factor::beam(xy, v.direction(direction))).sum()
    }
}
