//! The corrections for scattered objects on a mesh of the picture.
//!
//! What a rough surface scatters besides open sky varies slowly from pixel to pixel, because many directions contribute to each pixel. So the
//! many rays of [`super::scatter`] are sent for the corners of squares of the picture. A square that shows one face, and on which the
//! correction is nearly linear, is interpolated; any other is split, down to single pixels. Squares at the foot of an object, where its image
//! is sharp, are split because they show two faces.
//!
//! The diffuse lobe of a matt surface is so wide that its correction changes slowly on the whole face: squares are larger there, and a pixel
//! next to another face takes the correction of a near pixel of its own face.

use super::blocks::Blocks;
use super::face::Face;
use super::lattice::Points;
use super::mesh_options::TILE;
use super::scratch::Scratch;
use super::tiles::{fill, tiles};
use super::tracer::Tracer;
use crate::camera::View;
use crate::error::Result;
use crate::space::Ray;
use rayon::prelude::*;
use std::ops::Range;

/// Side of the largest squares of faces with facets, or that mirror what scatters, pixels; a power of two.
const STEP: usize = 8;
/// Largest difference between the corners of a square, as a multiple of `speckle_k`. Beyond it the image of an object may have an edge between
/// the corners that the centre does not show.
const SPREAD: f64 = 25.0;
/// Largest difference between the centre of a square and the mean of its corners, as a multiple of `speckle_k`: twice its standard deviation if the
/// correction is linear and each value has the noise of one.
const CENTER: f64 = 2.24;

/// Corrections of all pixels.
pub(super) struct Corrections {
    /// RJ, K; empty if no surface scatters. // [m, l][chan, pol]
    pub values: Vec<f64>,
    pub states: usize,
    /// Number of rays sent from the camera.
    pub rays: usize,
}

impl Corrections {
    /// The correction of a pixel. // [chan, pol]
    pub(super) fn of(&self, pixel: usize) -> Option<&[f64]> {
        self.values.get(pixel * self.states..(pixel + 1) * self.states)
    }
}

/// The squares of a tile.
struct Squares<'a, 'b> {
    tracer: &'a Tracer<'b>,
    view: &'a View,
    blocks: Option<&'a Blocks>,
    /// The scattering face of each pixel of the picture.
    faces: &'a [Face],
    columns: usize,
    rows: usize,
    corner: (usize, usize),
    scratch: &'a mut Scratch,
    /// Corrections of the nodes that are known. // [m, l][chan, pol]
    nodes: &'a mut [f64],
    /// A bit for each node that is known, row by row.
    known: [u64; TILE + 1],
    /// Whether each cover scatters by its diffuse lobe and not by facets.
    matt: &'a [bool],
    /// Columns or rows up to which a pixel of a matt face takes the correction of another.
    near: usize,
    rays: usize,
}

impl Squares<'_, '_> {
    fn face(&self, column: usize, row: usize) -> Face {
        self.faces[row * self.columns + column]
    }

    /// Whether all pixels from the first of two columns and rows up to the second, but not including it, show a face.
    #[inline]
    fn all_show(&self, face: Face, columns: [usize; 2], rows: [usize; 2]) -> bool {
        (rows[0]..rows[1]).all(|r| self.faces[r * self.columns + columns[0]..r * self.columns + columns[1]].iter().all(|f| *f == face))
    }

    /// Where `nodes` holds the correction of a pixel of the picture.
    fn place(&self, column: usize, row: usize) -> Range<usize> {
        let (at, states) = ((row - self.corner.1) * (TILE + 1) + column - self.corner.0, self.scratch.sums.len());
        at * states..(at + 1) * states
    }

    /// Computes the correction at a pixel of the picture, if it is not known. Returns where `nodes` holds it.
    fn node(&mut self, column: usize, row: usize) -> Result<Range<usize>> {
        let place = self.place(column, row);
        if self.known[row - self.corner.1] >> (column - self.corner.0) & 1 == 1 {
            return Ok(place);
        }
        let (x, y) = (column as f64, row as f64);
        if let Some(direction) = self.view.direction(x, y) {
            let (ray, reference) = (Ray::from_unit(self.view.position, direction), self.view.reference(direction));
            let block = self.blocks.map(|blocks| blocks.at(column, row));
            let first = block.map_or_else(|| self.tracer.spot(&ray), |block| self.tracer.spot_in(&ray, block))?;
            let mirrored = block.zip(first.as_ref()).and_then(|(block, spot)| block.mirrored_at(spot));
            self.tracer.follow_from(ray, first, mirrored, reference, Points::of_pixel(x, y), self.scratch)?;
            self.rays += 1;
        } else {
            self.scratch.corrections.fill(0.0);
        }
        self.known[row - self.corner.1] |= 1 << (column - self.corner.0);
        self.nodes[place.clone()].copy_from_slice(&self.scratch.corrections);
        Ok(place)
    }

    /// Whether a face scatters by its diffuse lobe and not by facets.
    fn is_matt(&self, face: Face) -> bool {
        face.cover(&self.tracer.scene.covers).is_some_and(|cover| self.matt[cover as usize])
    }

    /// Where `nodes` holds the correction of a known pixel near a pixel of a matt face.
    fn near(&self, column: usize, row: usize) -> Option<Range<usize>> {
        let face = self.face(column, row);
        if !self.is_matt(face) {
            return None;
        }
        let (left, low) = self.corner;
        let first = column.saturating_sub(self.near).max(left) - left;
        let last = (column + self.near).min(left + TILE).min(self.columns - 1) - left;
        let window = (u64::MAX << first) & (u64::MAX >> (63 - last));
        // Distance squared, row and column of the best one: of equally near ones, the first in the picture.
        let mut best: Option<(usize, usize, usize)> = None;
        // Rows from the pixel outwards, until no farther pixel can be nearer.
        for away in 0..=self.near {
            if best.is_some_and(|b| b.0 < away * away) {
                break;
            }
            let above = Some(row + away).filter(|r| away > 0 && *r <= (low + TILE).min(self.rows - 1));
            for r in row.checked_sub(away).filter(|r| *r >= low).into_iter().chain(above) {
                let mut known = self.known[r - low] & window;
                while known != 0 {
                    let c = left + known.trailing_zeros() as usize;
                    known &= known - 1;
                    let found = (away * away + c.abs_diff(column).pow(2), r, c);
                    if best.is_none_or(|b| found < b) && self.face(c, r) == face {
                        best = Some(found);
                    }
                }
            }
        }
        best.map(|(_, r, c)| self.place(c, r))
    }

    /// Fills the square with this corner and side in the tile `out`.
    fn square(&mut self, column: usize, row: usize, side: usize, out: &mut [f64]) -> Result<()> {
        let (right, top) = ((column + side).min(self.columns), (row + side).min(self.rows));
        if column >= right || row >= top || self.all_show(Face::SKY, [column, right], [row, top]) {
            return Ok(());
        }
        let (last_column, last_row) = ((column + side).min(self.columns - 1), (row + side).min(self.rows - 1));
        let face = self.face(column, row);
        let pure = (side <= STEP || self.is_matt(face)) && self.all_show(face, [column, last_column + 1], [row, last_row + 1]);
        let states = self.scratch.sums.len();
        let corner = self.corner;
        let place = |c: usize, r: usize| ((r - corner.1) * TILE + c - corner.0) * states;
        if side == 1 || (pure && side <= self.near) {
            let near = match self.near(column, row) {
                None if side == 1 => Some(self.node(column, row)?),
                near => near,
            };
            if let Some(correction) = near {
                let correction = &self.nodes[correction];
                for r in row..top {
                    let line = &mut out[place(column, r)..place(right, r)];
                    match correction {
                        [only] => line.fill(*only),
                        all => line.chunks_exact_mut(states).for_each(|pixel| pixel.copy_from_slice(all)),
                    }
                }
                return Ok(());
            }
        }
        let corners = if pure { self.corners([column, last_column], [row, last_row], side)? } else { None };
        let Some(corners) = corners else {
            let half = side / 2;
            for (dx, dy) in [(0, 0), (half, 0), (0, half), (half, half)] {
                self.square(column + dx, row + dy, half, out)?;
            }
            return Ok(());
        };
        let [a, b, c, d] = corners.map(|place| &self.nodes[place]);
        for r in row..top {
            let v = (r - row) as f64 / (last_row - row).max(1) as f64;
            for x in column..right {
                let u = (x - column) as f64 / (last_column - column).max(1) as f64;
                for (k, out) in out[place(x, r)..place(x, r) + states].iter_mut().enumerate() {
                    *out = (1.0 - v) * (a[k] + u * (b[k] - a[k])) + v * (c[k] + u * (d[k] - c[k]));
                }
            }
        }
        Ok(())
    }

    /// Where `nodes` holds the corrections at the corners, if they agree well enough with each other and with the centre.
    fn corners(&mut self, columns: [usize; 2], rows: [usize; 2], side: usize) -> Result<Option<[Range<usize>; 4]>> {
        let [c0, c1] = columns;
        let [r0, r1] = rows;
        let corners = [self.node(c0, r0)?, self.node(c1, r0)?, self.node(c0, r1)?, self.node(c1, r1)?];
        let limit_k = self.scratch.speckle_k;
        let steep = |k: usize| {
            let of = corners.iter().map(|n| self.nodes[n.start + k]);
            of.clone().fold(f64::NEG_INFINITY, f64::max) - of.fold(f64::INFINITY, f64::min) > SPREAD * limit_k
        };
        let states = self.scratch.sums.len();
        if (0..states).any(steep) {
            return Ok(None);
        }
        // A square cut by the border of the picture has its centre there.
        if c1 - c0 == side && r1 - r0 == side {
            let center = self.node(c0 + side / 2, r0 + side / 2)?;
            let mean = |k: usize| 0.25 * corners.iter().map(|n| self.nodes[n.start + k]).sum::<f64>();
            if (0..states).any(|k| (self.nodes[center.start + k] - mean(k)).abs() > CENTER * limit_k) {
                return Ok(None);
            }
        }
        Ok(Some(corners))
    }
}

impl Tracer<'_> {
    /// The corrections of a picture whose pixels show these faces; the sky stands for all that scatters nothing. Their rms noise is
    /// `speckle_k`. A pixel of a matt face takes the correction of another one up to `near` columns or rows away. `values` is memory for the result. The blocks of the view, where they are
    /// known, save time.
    pub(super) fn corrections(
        &self,
        view: &View,
        faces: &[Face],
        speckle_k: f64,
        near: usize,
        mut values: Vec<f64>,
        blocks: Option<&Blocks>,
    ) -> Result<Corrections> {
        let (columns, rows) = (view.grid().n_l, view.grid().n_m);
        let states = self.freqs_ghz.len() * self.antenna.len();
        if faces.iter().all(|f| f.is_sky()) {
            values.clear();
            return Ok(Corrections { values, states, rays: 0 });
        }
        let across = columns.div_ceil(TILE);
        values.resize(rows * columns * states, 0.0);
        let matt: Vec<bool> = self.surfaces.iter().map(|t| t[0].diffuse().is_some() && t[0].facets().is_none()).collect();
        let rays = tiles(&mut values, columns, states)
            .into_par_iter()
            .enumerate()
            .map_init(
                || {
                    let scratch = Scratch { speckle_k, ..self.scratch() };
                    (scratch, vec![0.0; (TILE + 1) * (TILE + 1) * states], vec![0.0; TILE * TILE * states])
                },
                |(scratch, nodes, out), (k, mut lines)| {
                    let corner = (k % across * TILE, k / across * TILE);
                    let mut squares = Squares {
                        tracer: self,
                        view,
                        blocks,
                        faces,
                        columns,
                        rows,
                        corner,
                        scratch,
                        nodes,
                        known: [0; TILE + 1],
                        matt: &matt,
                        near,
                        rays: 0,
                    };
                    out.fill(0.0);
                    squares.square(corner.0, corner.1, TILE, out)?;
                    fill(&mut lines, out, states);
                    Ok(squares.rays)
                },
            )
            .sum::<Result<usize>>()?;
        Ok(Corrections { values, states, rays })
    }
}
