//! Real-time mode: temperatures at the vertices of a mesh on the picture, interpolated between.
//!
//! Squares of the picture are split until their four corners see one face of one body at nearly one temperature. The pixels
//! inside that show the same face by their first hit are interpolated, all others are traced. Tables of sky, surfaces, facets and air are those of the full
//! model, and so are reflections and shadowing: a vertex is a full ray. Pixels on an edge are then smoothed by
//! [`super::smooth`].

use super::follow::Scratch;
use super::tracer::{Seen, Tracer};
use crate::atmosphere::PhysicsError;
use crate::camera::View;
use crate::error::{Result, SceneError};
use crate::geometry::{At, Ray};
use crate::vector::Vec3;
use ndarray::Array2;
use rayon::prelude::*;

/// Side of the squares a thread works on, pixels; a power of two.
const TILE: usize = 32;

/// How a mesh is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeshOptions {
    /// Side of the largest squares, pixels: 1, 2, 4, 8, 16 or 32.
    pub step: usize,
    /// Spread of the corners above which a square is split, K.
    pub spread_k: f64,
    /// Whether pixels on an edge are the mean of four rays.
    pub antialias: bool,
}

impl Default for MeshOptions {
    fn default() -> Self {
        Self { step: 4, spread_k: 6.0, antialias: true }
    }
}

/// One frame.
#[derive(Debug, Clone)]
pub struct Frame {
    /// Temperature of the first plane and channel, K. // [m, l]
    pub temperature_k: Array2<f64>,
    /// Rays sent from the sensor.
    pub rays: usize,
}

/// What is on view: a face of a body of a region and its surface; `None` is the sky.
pub(super) type Face = Option<(Option<u32>, (u32, u8), u32)>;

/// A vertex or pixel: what is seen there and how warm it is.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Vertex {
    /// What is seen.
    pub face: Face,
    /// First plane and channel, RJ, K.
    pub rj_k: f64,
}

/// Vertices of a tile, traced when first asked for.
struct Tile<'a, 'b> {
    tracer: &'a Tracer<'b>,
    view: &'a View,
    scratch: &'a mut Scratch,
    corner: (usize, usize),
    vertices: Vec<Option<Vertex>>,
    rays: usize,
}

impl Tile<'_, '_> {
    fn vertex(&mut self, column: usize, row: usize) -> Result<Vertex, PhysicsError> {
        let at = row * (TILE + 1) + column;
        if let Some(v) = self.vertices[at] {
            return Ok(v);
        }
        let (x, y) = ((self.corner.0 + column) as f64, (self.corner.1 + row) as f64);
        let v = match self.view.direction(x, y) {
            None => Vertex::default(),
            Some(d) => self.tracer.vertex(self.view, d, self.scratch)?,
        };
        self.rays += 1;
        self.vertices[at] = Some(v);
        Ok(v)
    }

    /// Whether a pixel shows the face of a vertex, by the first hit alone.
    fn shows(&self, vertex: &Vertex, column: usize, row: usize) -> bool {
        let (x, y) = ((self.corner.0 + column) as f64, (self.corner.1 + row) as f64);
        let Some(direction) = self.view.direction(x, y) else { return vertex.face.is_none() };
        self.tracer.face(self.view, direction) == vertex.face
    }

    /// Fills the square of a side from a corner; `out` holds the tile.
    fn square(&mut self, column: usize, row: usize, side: usize, spread_k: f64, out: &mut [Vertex]) -> Result<(), PhysicsError> {
        if side == 1 {
            out[row * TILE + column] = self.vertex(column, row)?;
            return Ok(());
        }
        let c = [
            self.vertex(column, row)?,
            self.vertex(column + side, row)?,
            self.vertex(column, row + side)?,
            self.vertex(column + side, row + side)?,
        ];
        let high = c.iter().map(|v| v.rj_k).fold(f64::NEG_INFINITY, f64::max);
        let low = c.iter().map(|v| v.rj_k).fold(f64::INFINITY, f64::min);
        let half = side / 2;
        let mut split = high - low > spread_k || !c[1..].iter().all(|v| v.face == c[0].face);
        if !split && side > 2 {
            // What is mirrored may be smaller than a square; a look at the middle finds most of it.
            let (middle, mean) = (self.vertex(column + half, row + half)?, 0.25 * c.iter().map(|v| v.rj_k).sum::<f64>());
            split = middle.face != c[0].face || (middle.rj_k - mean).abs() > 0.5 * spread_k;
        }
        if split {
            for (dx, dy) in [(0, 0), (half, 0), (0, half), (half, half)] {
                self.square(column + dx, row + dy, half, spread_k, out)?;
            }
            return Ok(());
        }
        for j in 0..side {
            let v = j as f64 / side as f64;
            let (left, right) = (c[0].rj_k + v * (c[2].rj_k - c[0].rj_k), c[1].rj_k + v * (c[3].rj_k - c[1].rj_k));
            for i in 0..side {
                // What stands before the face between its corners must not be lost.
                let own = self.vertices[(row + j) * (TILE + 1) + column + i];
                out[(row + j) * TILE + column + i] = match own {
                    Some(v) => v,
                    None if !self.shows(&c[0], column + i, row + j) => self.vertex(column + i, row + j)?,
                    None => Vertex { face: c[0].face, rj_k: left + i as f64 / side as f64 * (right - left) },
                };
            }
        }
        Ok(())
    }
}

impl Tracer<'_> {
    /// A full ray along a direction of a view.
    #[inline]
    pub(super) fn vertex(&self, view: &View, direction: Vec3, scratch: &mut Scratch) -> Result<Vertex, PhysicsError> {
        let seen = self.follow(view.position, direction, view.reference(direction), scratch)?;
        Ok(Vertex { face: seen.map(|s: Seen| (s.region, s.face, s.cover)), rj_k: scratch.sums[0] })
    }

    /// What a direction of a view shows, by the first hit alone.
    #[inline]
    pub(super) fn face(&self, view: &View, direction: Vec3) -> Face {
        self.spot(&Ray::from_unit(view.position, direction)).map(|s| (s.region, s.face, s.cover))
    }

    /// One frame of a view by mesh.
    ///
    /// # Errors
    /// A step that is not a power of two up to 32, a spread below 0, or a ray that leaves the tables of the air.
    pub fn frame(&self, view: &View, options: &MeshOptions) -> Result<Frame> {
        if !(options.step.is_power_of_two() && options.step <= TILE && options.spread_k >= 0.0) {
            return Err(SceneError::BadValue {
                what: "mesh of the real-time mode".into(),
                value: format!("step {} and spread {} K", options.step, options.spread_k),
                expected: "a step of 1, 2, 4, 8, 16 or 32 pixels and a spread of 0 K or more",
            });
        }
        self.check_height(view.position)?;
        let (columns, rows) = (view.grid().n_l, view.grid().n_m);
        let (across, down) = (columns.div_ceil(TILE), rows.div_ceil(TILE));
        let tiles: Vec<(Vec<Vertex>, usize)> = (0..across * down)
            .into_par_iter()
            .map_init(
                || self.scratch(),
                |scratch, k| {
                    let corner = (k % across * TILE, k / across * TILE);
                    let vertices = vec![None; (TILE + 1) * (TILE + 1)];
                    let mut tile = Tile { tracer: self, view, scratch, corner, vertices, rays: 0 };
                    let mut out = vec![Vertex::default(); TILE * TILE];
                    let (wide, high) = ((columns - corner.0).min(TILE), (rows - corner.1).min(TILE));
                    for row in (0..high).step_by(options.step) {
                        for column in (0..wide).step_by(options.step) {
                            tile.square(column, row, options.step, options.spread_k, &mut out)?;
                        }
                    }
                    Ok((out, tile.rays))
                },
            )
            .collect::<Result<_, PhysicsError>>()
            .map_err(|e| SceneError::air(At(0), e))?;
        let mut pixels = Vec::with_capacity(rows * columns);
        for row in 0..rows {
            for tile in &tiles[row / TILE * across..(row / TILE + 1) * across] {
                let left = columns - pixels.len() % columns;
                pixels.extend_from_slice(&tile.0[row % TILE * TILE..][..left.min(TILE)]);
            }
        }
        let mut rays = tiles.iter().map(|t| t.1).sum();
        let mut rj_k: Vec<f64> = pixels.iter().map(|p| p.rj_k).collect();
        if options.antialias {
            rays += self.smooth_edges(view, &pixels, &mut rj_k).map_err(|e| SceneError::air(At(0), e))?;
        }
        rj_k.par_chunks_mut(columns).for_each(|row| row.iter_mut().for_each(|t| *t = self.scaled(0, 0, *t)));
        let temperature_k = Array2::from_shape_fn((rows, columns), |(row, column)| rj_k[row * columns + column]);
        Ok(Frame { temperature_k, rays })
    }
}

/// Difference of a frame to a full picture: the map in K and its root mean square.
///
/// `None` if the shapes differ.
#[must_use]
pub fn error_map(frame: &Frame, full: ndarray::ArrayView2<'_, f64>) -> Option<(Array2<f64>, f64)> {
    if frame.temperature_k.dim() != full.dim() {
        return None;
    }
    let map = &frame.temperature_k - &full;
    let mean = map.iter().map(|d| d * d).sum::<f64>() / map.len().max(1) as f64;
    Some((map, mean.sqrt()))
}
