//! Real-time mode: temperatures at the vertices of a mesh on the picture, with interpolation between them.
//!
//! Each square of the picture is split until its four corners show one face of one body, and one face in the mirror, at nearly one
//! temperature. A pixel inside that shows the same faces is interpolated. All other pixels are traced. A vertex is a full ray, with the same tables, reflections and
//! shadowing as in the full model. [`super::smooth`] then smooths the pixels on an edge.

use super::face::Face;
use super::lattice::{Points, Use};
use super::mesh_options::{MeshOptions, TILE};
use super::scratch::Scratch;
use super::tracer::Tracer;
use super::vertex::Vertex;
use crate::camera::View;
use crate::error::Result;
use ndarray::Array2;
use rayon::prelude::*;

/// One frame.
#[derive(Debug, Clone)]
pub struct Frame {
    /// Temperature of the first plane and channel, K. // [m, l]
    pub temperature_k: Array2<f64>,
    /// Number of rays sent from the camera.
    pub rays: usize,
}

/// The vertices of a tile. Each is traced when it is needed for the first time.
struct Tile<'a, 'b> {
    tracer: &'a Tracer<'b>,
    view: &'a View,
    scratch: &'a mut Scratch,
    corner: (usize, usize),
    vertices: Vec<Option<Vertex>>,
    rays: usize,
}

impl Tile<'_, '_> {
    fn vertex(&mut self, column: usize, row: usize) -> Result<Vertex> {
        let at = row * (TILE + 1) + column;
        if let Some(v) = self.vertices[at] {
            return Ok(v);
        }
        let (x, y) = ((self.corner.0 + column) as f64, (self.corner.1 + row) as f64);
        let v = match self.view.direction(x, y) {
            None => Vertex::default(),
            Some(d) => self.tracer.vertex(self.view, d, Points::of_pixel(x, y).using(Use::Nothing), self.scratch)?,
        };
        self.rays += 1;
        self.vertices[at] = Some(v);
        Ok(v)
    }

    /// Whether a pixel shows the face of a vertex, and the same face in the mirror.
    fn shows(&self, vertex: &Vertex, column: usize, row: usize) -> Result<bool> {
        let (x, y) = ((self.corner.0 + column) as f64, (self.corner.1 + row) as f64);
        let Some(direction) = self.view.direction(x, y) else { return Ok(vertex.face.is_none()) };
        self.tracer.shows(self.view, direction, vertex)
    }

    /// Fills the square with this corner and side in the tile `out`.
    fn square(&mut self, column: usize, row: usize, side: usize, options: &MeshOptions, out: &mut [Vertex]) -> Result<()> {
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
        let mut split = high - low > options.spread_k || !c[1..].iter().all(|v| v.face == c[0].face && v.mirrored == c[0].mirrored);
        if !split && side > 2 {
            let (middle, mean) = (self.vertex(column + half, row + half)?, 0.25 * c.iter().map(|v| v.rj_k).sum::<f64>());
            split = middle.face != c[0].face || (middle.rj_k - mean).abs() > options.center_fraction * options.spread_k;
        }
        if split {
            for (dx, dy) in [(0, 0), (half, 0), (0, half), (half, half)] {
                self.square(column + dx, row + dy, half, options, out)?;
            }
            return Ok(());
        }
        for j in 0..side {
            let v = j as f64 / side as f64;
            let (left, right) = (c[0].rj_k + v * (c[2].rj_k - c[0].rj_k), c[1].rj_k + v * (c[3].rj_k - c[1].rj_k));
            for i in 0..side {
                // An object in front of the face may lie between the corners.
                let own = self.vertices[(row + j) * (TILE + 1) + column + i];
                out[(row + j) * TILE + column + i] = match own {
                    Some(v) => v,
                    None if !self.shows(&c[0], column + i, row + j)? => self.vertex(column + i, row + j)?,
                    None => Vertex { rj_k: left + i as f64 / side as f64 * (right - left), ..c[0] },
                };
            }
        }
        Ok(())
    }
}

impl Tracer<'_> {
    /// One frame of a view, computed on a mesh.
    ///
    /// # Errors
    /// An option outside its range, a camera above the tables of the sky, or a ray that leaves the tables of the air.
    pub fn frame(&self, view: &View, options: &MeshOptions) -> Result<Frame> {
        options.check()?;
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
                            tile.square(column, row, options.step, options, &mut out)?;
                        }
                    }
                    Ok((out, tile.rays))
                },
            )
            .collect::<Result<_>>()?;
        let mut pixels = Vec::with_capacity(rows * columns);
        for row in 0..rows {
            for tile in &tiles[row / TILE * across..(row / TILE + 1) * across] {
                let left = columns - pixels.len() % columns;
                pixels.extend_from_slice(&tile.0[row % TILE * TILE..][..left.min(TILE)]);
            }
        }
        let mut rays: usize = tiles.iter().map(|t| t.1).sum();
        let faces: Vec<Face> = pixels.iter().map(Vertex::scattering_face).collect();
        let corrections = self.corrections(view, &faces, options.speckle * self.options.speckle_k)?;
        rays += corrections.rays;
        for (k, pixel) in pixels.iter_mut().enumerate() {
            pixel.rj_k += corrections.of(k).map_or(0.0, |c| c[0]);
        }
        let mut rj_k: Vec<f64> = pixels.iter().map(|p| p.rj_k).collect();
        if options.antialias {
            rays += self.smooth_edges(view, &options.edges, &pixels, &corrections, &mut rj_k)?;
        }
        rj_k.par_chunks_mut(columns).for_each(|row| row.iter_mut().for_each(|t| *t = self.scaled(0, 0, *t)));
        let temperature_k = Array2::from_shape_fn((rows, columns), |(row, column)| rj_k[row * columns + column]);
        Ok(Frame { temperature_k, rays })
    }
}

/// Difference between a frame and a full picture: the map and its root mean square, both in K.
///
/// Returns `None` if the shapes differ.
#[must_use]
pub fn error_map(frame: &Frame, full: ndarray::ArrayView2<'_, f64>) -> Option<(Array2<f64>, f64)> {
    if frame.temperature_k.dim() != full.dim() {
        return None;
    }
    let map = &frame.temperature_k - &full;
    let mean = map.iter().map(|d| d * d).sum::<f64>() / map.len().max(1) as f64;
    Some((map, mean.sqrt()))
}
