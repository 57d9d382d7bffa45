//! The array factor on a grid of directions, and the gradient of a function of it.
//!
//! The directions are those of a square grid, so the phasor of an antenna in direction (l, m) is the product of one that depends on l and one that
//! depends on m. The directions (l, m) and (l, -m) share their products: with a = 2 pi l x and b = 2 pi m y,
//! cos(a +- b) = cos a cos b -+ sin a sin b and sin(a +- b) = sin a cos b +- cos a sin b. One antenna therefore costs two multiplications and
//! additions in each direction. Of the directions (l, m) and (-l, -m), in which the power is the same, the grid has one.

use super::array_factor::phasors;
use super::kernels::{self, LANES, Phasor, Row};
use std::ops::Range;

/// The directions of a ring around the beam: l = (i + 1/2) step and m = +-(j + 1/2) step.
#[derive(Debug, Clone)]
pub struct LobeGrid {
    /// Distance of neighbouring directions, in wavelengths over the unit of the positions.
    pub step: f64,
    /// The columns of each row that lie in the ring \[i\].
    columns: Vec<Range<usize>>,
    /// Blocks of [`LANES`] columns.
    blocks: usize,
}

impl LobeGrid {
    /// The directions at a distance of `inner` to `outer` from the beam.
    #[must_use]
    pub fn new(inner: f64, outer: f64, step: f64) -> Self {
        let rows = (outer / step).ceil().max(1.0) as usize;
        let at = |i: usize| (i as f64 + 0.5) * step;
        let first = |i: usize, radius: f64| (0..rows).find(|j| at(i).hypot(at(*j)) >= radius).unwrap_or(rows);
        let columns = (0..rows).map(|i| first(i, inner)..first(i, outer)).collect();
        Self { step, columns, blocks: rows.div_ceil(LANES) }
    }

    fn rows(&self) -> usize {
        self.columns.len()
    }

    fn at(&self, i: usize) -> f64 {
        (i as f64 + 0.5) * self.step
    }

    /// Number of directions.
    #[must_use]
    pub fn len(&self) -> usize {
        self.columns.iter().map(|c| 2 * c.len()).sum()
    }

    /// True where the ring is thinner than the grid.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// One number for each direction of a grid, for m > 0 and m < 0 \[i\]\[j\].
#[derive(Debug, Clone)]
pub struct LobeMap {
    plus: Vec<f64>,
    minus: Vec<f64>,
    width: usize,
}

impl LobeMap {
    /// Zeros for all directions of a grid.
    #[must_use]
    pub fn zeros(grid: &LobeGrid) -> Self {
        let width = grid.blocks * LANES;
        Self { plus: vec![0.0; grid.rows() * width], minus: vec![0.0; grid.rows() * width], width }
    }

    /// Set all numbers to zero.
    pub fn clear(&mut self) {
        self.plus.fill(0.0);
        self.minus.fill(0.0);
    }
}

/// The array factor of some antennas on a grid, and the memory that this needs.
#[derive(Debug, Clone)]
pub struct LobeField {
    grid: LobeGrid,
    /// Phasors along l \[i\]\[antenna\].
    across: [Vec<f64>; 2],
    /// Phasors along m \[block\]\[antenna\]\[lane\].
    up: [Vec<f64>; 2],
    re: LobeMap,
    im: LobeMap,
}

impl LobeField {
    /// Memory for a grid.
    #[must_use]
    pub fn new(grid: LobeGrid) -> Self {
        let (re, im) = (LobeMap::zeros(&grid), LobeMap::zeros(&grid));
        Self { grid, across: Default::default(), up: Default::default(), re, im }
    }

    /// The grid.
    #[must_use]
    pub fn grid(&self) -> &LobeGrid {
        &self.grid
    }

    /// Compute the array factor of antennas at `xy`.
    pub fn set(&mut self, xy: &[[f64; 2]]) {
        let (n, g) = (xy.len(), &self.grid);
        for part in 0..2 {
            self.across[part].resize(g.rows() * n, 0.0);
            self.up[part].resize(g.blocks * n * LANES, 0.0);
        }
        for (k, p) in xy.iter().enumerate() {
            for (i, (c, s)) in phasors(p[0], g.step, g.rows()).enumerate() {
                (self.across[0][i * n + k], self.across[1][i * n + k]) = (c, s);
            }
            for (j, (c, s)) in phasors(p[1], g.step, g.blocks * LANES).enumerate() {
                let at = (j / LANES * n + k) * LANES + j % LANES;
                (self.up[0][at], self.up[1][at]) = (c, s);
            }
        }
        for i in 0..g.rows() {
            let blocks = blocks_of(&g.columns[i]);
            let (from, to) = (i * self.re.width + blocks.start * LANES, i * self.re.width + blocks.end * LANES);
            let row = Row {
                across: [&self.across[0][i * n..(i + 1) * n], &self.across[1][i * n..(i + 1) * n]],
                up: [&self.up[0][blocks.start * n * LANES..], &self.up[1][blocks.start * n * LANES..]],
            };
            let out =
                [&mut self.re.plus[from..to], &mut self.im.plus[from..to], &mut self.re.minus[from..to], &mut self.im.minus[from..to]];
            kernels::sum(&row, out);
        }
    }

    /// Add weight |AF|^2 to a map of power, in the directions of the grid.
    pub fn add_power(&self, weight: f64, power: &mut LobeMap) {
        let width = power.width;
        for (i, columns) in self.grid.columns.iter().enumerate() {
            let row = i * width + columns.start..i * width + columns.end;
            for (out, re, im) in [(&mut power.plus, &self.re.plus, &self.im.plus), (&mut power.minus, &self.re.minus, &self.im.minus)] {
                for (o, (re, im)) in out[row.clone()].iter_mut().zip(re[row.clone()].iter().zip(&im[row.clone()])) {
                    *o += weight * (re * re + im * im);
                }
            }
        }
    }

    /// The gradient by the positions that were given to [`LobeField::set`], of a function whose derivatives by |AF|^2 are `by_power`.
    /// It is added to `gradient`.
    pub fn add_gradient(&self, by_power: &LobeMap, gradient: &mut [[f64; 2]]) {
        let (n, g, width) = (gradient.len(), &self.grid, self.re.width);
        let mut sums: [Vec<f64>; 8] = std::array::from_fn(|_| vec![0.0; width]);
        for i in 0..g.rows() {
            let blocks = blocks_of(&g.columns[i]);
            let columns = blocks.start * LANES..blocks.end * LANES;
            for j in columns.clone() {
                let (at, m) = (i * width + j, g.at(j));
                let (p, q) = (by_power.plus[at], by_power.minus[at]);
                let (rp, ip, rm, im) = (p * self.re.plus[at], p * self.im.plus[at], q * self.re.minus[at], q * self.im.minus[at]);
                let values = [rp + rm, rp - rm, ip + im, ip - im];
                for (s, v) in values.into_iter().enumerate() {
                    (sums[s][j], sums[s + 4][j]) = (v, m * v);
                }
            }
            let sums: [&[f64]; 8] = std::array::from_fn(|s| &sums[s][columns.clone()]);
            let row = Row {
                across: [&self.across[0][i * n..(i + 1) * n], &self.across[1][i * n..(i + 1) * n]],
                up: [&self.up[0][blocks.start * n * LANES..], &self.up[1][blocks.start * n * LANES..]],
            };
            kernels::gradient(&row, sums, g.at(i), gradient);
        }
    }

    /// Change every number of a map in the directions of the grid.
    pub fn apply(&self, map: &mut LobeMap, mut change: impl FnMut(&mut f64)) {
        for (i, columns) in self.grid.columns.iter().enumerate() {
            let row = i * map.width + columns.start..i * map.width + columns.end;
            map.plus[row.clone()].iter_mut().for_each(&mut change);
            map.minus[row].iter_mut().for_each(&mut change);
        }
    }
}

impl LobeGrid {
    /// The directions, in the order in which [`LobeField::apply`] goes through them.
    pub fn directions(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        self.columns.iter().enumerate().flat_map(move |(i, columns)| {
            let along = move |sign: f64| columns.clone().map(move |j| [self.at(i), sign * self.at(j)]);
            along(1.0).chain(along(-1.0))
        })
    }
}

/// One antenna of a field at a new place, and its phasors there and at the old place.
#[derive(Debug, Clone, Default)]
pub struct MovedAntenna {
    /// Along l, new and old \[i\].
    across: Vec<[Phasor; 2]>,
    /// Along m: cosine and sine at the new place, then at the old \[j\].
    up: [Vec<f64>; 4],
}

impl MovedAntenna {
    /// Of an antenna that moves from one place to another.
    pub fn set(&mut self, grid: &LobeGrid, to: [f64; 2], from: [f64; 2]) {
        let along = |x: f64| phasors(x, grid.step, grid.rows()).map(|(c, s)| [c, s]);
        self.across.clear();
        self.across.extend(along(to[0]).zip(along(from[0])).map(|(new, old)| [new, old]));
        for (side, y) in [to[1], from[1]].into_iter().enumerate() {
            let (c, s) = phasors(y, grid.step, grid.blocks * LANES).unzip();
            (self.up[2 * side], self.up[2 * side + 1]) = (c, s);
        }
    }
}

impl LobeField {
    /// Number of rows of the grid.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.grid.rows()
    }

    /// Add the power of row `i`, as it would be if an antenna moved, to the two halves of a row of power.
    pub fn add_row_power(&self, i: usize, moved: &MovedAntenna, weight: f64, power: &mut [Vec<f64>; 2]) {
        let blocks = blocks_of(&self.grid.columns[i]);
        let (j, at) = (blocks.start * LANES..blocks.end * LANES, i * self.re.width);
        let row = at + j.start..at + j.end;
        let parts = [&self.re.plus, &self.im.plus, &self.re.minus, &self.im.minus].map(|p| &p[row.clone()]);
        let up: [&[f64]; 4] = std::array::from_fn(|k| &moved.up[k][j.clone()]);
        let [plus, minus] = power;
        kernels::moved_power(parts, moved.across[i], up, weight, [&mut plus[j.clone()], &mut minus[j]]);
    }

    /// The highest of a row of power in the directions of the grid.
    #[must_use]
    pub fn row_peak(&self, i: usize, power: &[Vec<f64>; 2]) -> f64 {
        power.iter().flat_map(|p| &p[self.grid.columns[i].clone()]).copied().fold(0.0, f64::max)
    }

    /// A row of zeros.
    #[must_use]
    pub fn row_of_zeros(&self) -> [Vec<f64>; 2] {
        [vec![0.0; self.re.width], vec![0.0; self.re.width]]
    }

    /// Move an antenna.
    pub fn move_antenna(&mut self, moved: &MovedAntenna) {
        for i in 0..self.grid.rows() {
            let blocks = blocks_of(&self.grid.columns[i]);
            let (j, at) = (blocks.start * LANES..blocks.end * LANES, i * self.re.width);
            let row = at + j.start..at + j.end;
            let up: [&[f64]; 4] = std::array::from_fn(|k| &moved.up[k][j.clone()]);
            let (re, im) = (&mut self.re, &mut self.im);
            let parts = [&mut re.plus[row.clone()], &mut im.plus[row.clone()], &mut re.minus[row.clone()], &mut im.minus[row.clone()]];
            kernels::move_row(parts, moved.across[i], up);
        }
    }
}

/// The blocks that contain some columns.
fn blocks_of(columns: &Range<usize>) -> Range<usize> {
    if columns.is_empty() { 0..0 } else { columns.start / LANES..columns.end.div_ceil(LANES) }
}
