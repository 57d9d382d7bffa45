//! Real-time mode: temperatures at the vertices of a mesh on the picture, with interpolation between them.
//!
//! Each square of the picture is split until its four corners show one face of one body, and one face in the mirror, at nearly one
//! temperature. A pixel inside that shows the same faces is interpolated, and one on the ground beside another surface takes the temperature of the
//! nearest corner that shows its own. All other pixels are traced. A vertex is a full ray, with the same tables, reflections and shadowing as in
//! the full model. [`super::smooth`] then smooths the pixels on an edge.

use super::around::Rough;
use super::blocks::{Block, Blocks, SIDE};
use super::face::{Face, Shown};
use super::lattice::{Points, Use};
use super::memory::Memory;
use super::mesh_options::{MeshOptions, TILE};
use super::scratch::Scratch;
use super::tiles::tiles;
use super::tracer::Tracer;
use super::vertex::{Look, Vertex};
use crate::camera::View;
use crate::error::{Result, SceneError};
use ndarray::Array2;
use rayon::prelude::*;

/// Side of the largest squares of ground with several surfaces, pixels.
const GROUND: usize = 4;

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
    blocks: &'a Blocks,
    scratch: &'a mut Scratch,
    corner: (usize, usize),
    vertices: &'a mut [Vertex],
    /// A bit for each vertex that is traced, row by row.
    known: [u64; TILE + 1],
    rays: usize,
}

impl<'a> Tile<'a, '_> {
    /// Place in the picture of a pixel of the tile.
    fn place(&self, column: usize, row: usize) -> (f64, f64) {
        ((self.corner.0 + column) as f64, (self.corner.1 + row) as f64)
    }

    fn block(&self, column: usize, row: usize) -> &'a Block {
        self.blocks.at(self.corner.0 + column, self.corner.1 + row)
    }

    fn vertex(&mut self, column: usize, row: usize) -> Result<Vertex> {
        if let Some(v) = self.known(column, row) {
            return Ok(v);
        }
        let (x, y) = self.place(column, row);
        let v = match self.view.direction(x, y) {
            None => Vertex::default(),
            Some(d) => {
                let points = Points::of_pixel(x, y).using(Use::Nothing);
                self.tracer.vertex(self.view, d, points, self.block(column, row), self.scratch)?
            }
        };
        self.rays += 1;
        self.vertices[row * (TILE + 1) + column] = v;
        self.known[row] |= 1 << column;
        Ok(v)
    }

    /// A vertex that is traced.
    #[inline]
    fn known(&self, column: usize, row: usize) -> Option<Vertex> {
        (self.known[row] >> column & 1 == 1).then(|| self.vertices[row * (TILE + 1) + column])
    }

    /// What a pixel shows; `None` outside the hemisphere.
    fn look(&self, column: usize, row: usize) -> Option<Look<'a>> {
        let (x, y) = self.place(column, row);
        self.view.along(x, y).map(|d| self.tracer.look(self.view, d, self.block(column, row)))
    }

    /// Whether a pixel shows the face of a vertex, and the same face in the mirror.
    fn shows(&self, vertex: &Vertex, column: usize, row: usize) -> Result<bool> {
        if let Some(cover) = self.block(column, row).ground {
            return Ok(vertex.face == Face::of_ground(cover) && vertex.mirrored.is_none_or(Face::is_sky));
        }
        match self.look(column, row) {
            Some(look) => self.tracer.agrees(&look, vertex),
            None => Ok(vertex.face.is_sky()),
        }
    }

    /// Fills a square of ground with several surfaces: a pixel takes the temperature of the nearest corner that shows its surface. The ground is
    /// smooth, so its temperature changes little over a square. Returns false, and fills nothing, if the square is another one.
    fn ground(&mut self, (column, row): (usize, usize), side: usize, c: &[Vertex; 4], spread_k: f64, out: &mut [Vertex]) -> Result<bool> {
        let is_ground = |v: &Vertex| v.is_ground() && v.mirrored.is_none_or(Face::is_sky);
        let alike = |a: &Vertex, b: &Vertex| a.face != b.face || (a.rj_k - b.rj_k).abs() <= spread_k;
        // Corners of one face have another reason to be split: the temperature between them.
        if c.iter().all(|v| v.face == c[0].face) || !c.iter().all(is_ground) {
            return Ok(false);
        }
        if !c.iter().enumerate().all(|(k, a)| c[k + 1..].iter().all(|b| alike(a, b))) {
            return Ok(false);
        }
        for j in 0..side {
            for i in 0..side {
                let known = self.known(column + i, row + j);
                let mut best: Option<(usize, &Vertex)> = None;
                if known.is_none()
                    && let Some(look) = self.look(column + i, row + j)
                {
                    for (k, v) in c.iter().enumerate() {
                        let (x, y) = (k % 2 * side, k / 2 * side);
                        let away = x.abs_diff(i).pow(2) + y.abs_diff(j).pow(2);
                        if look.face == v.face && best.is_none_or(|b| away < b.0) {
                            best = Some((away, v));
                        }
                    }
                    if let Some((_, v)) = best
                        && !self.tracer.agrees(&look, v)?
                    {
                        best = None;
                    }
                }
                out[(row + j) * TILE + column + i] = match (known, best) {
                    (Some(v), _) | (None, Some((_, &v))) => v,
                    (None, None) => self.vertex(column + i, row + j)?,
                };
            }
        }
        Ok(true)
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
        if split && side <= GROUND && self.ground((column, row), side, &c, options.spread_k, out)? {
            return Ok(());
        }
        if split {
            for (dx, dy) in [(0, 0), (half, 0), (0, half), (half, half)] {
                self.square(column + dx, row + dy, half, options, out)?;
            }
            return Ok(());
        }
        // All pixels of most squares are known to show one cover of the ground.
        let even = if side <= SIDE { self.block(column, row).ground } else { None };
        let even = even.is_some_and(|cover| c[0].face == Face::of_ground(cover) && c[0].mirrored.is_none_or(Face::is_sky));
        for j in 0..side {
            let v = j as f64 / side as f64;
            let (left, right) = (c[0].rj_k + v * (c[2].rj_k - c[0].rj_k), c[1].rj_k + v * (c[3].rj_k - c[1].rj_k));
            for i in 0..side {
                // An object in front of the face may lie between the corners.
                let own = self.known(column + i, row + j);
                out[(row + j) * TILE + column + i] = match own {
                    Some(v) => v,
                    None if !even && !self.shows(&c[0], column + i, row + j)? => self.vertex(column + i, row + j)?,
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
        let blocks = self.blocks(view);
        let mut memory = self.memory.take().sized(columns * rows);
        let mut temperature_k = vec![0.0; columns * rows];
        let rays = self.fill_frame(view, &blocks, options, &mut memory, &mut temperature_k)?;
        self.memory.keep(memory);
        let temperature_k = Array2::from_shape_vec((rows, columns), temperature_k)
            .map_err(|e| SceneError::bad_value("shape of the frame", e, "one value for every pixel"))?;
        Ok(Frame { temperature_k, rays })
    }

    /// Bytes of all arrays of a frame of a view while it is made.
    #[must_use]
    pub fn frame_bytes(view: &View) -> usize {
        const TEMPERATURES: usize = 3;
        let pixels = view.grid().n_l * view.grid().n_m;
        let of_pixel = size_of::<Shown>() + size_of::<Face>() + TEMPERATURES * size_of::<f64>();
        pixels * of_pixel + pixels.div_ceil(SIDE * SIDE) * size_of::<Block>()
    }

    /// Computes the temperatures of a frame. Returns the number of rays.
    fn fill_frame(&self, view: &View, blocks: &Blocks, options: &MeshOptions, memory: &mut Memory, out: &mut [f64]) -> Result<usize> {
        let columns = view.grid().n_l;
        let mut rays = self.mesh(view, blocks, options, memory)?;
        let values = std::mem::take(&mut memory.corrections);
        let corrections =
            self.corrections(view, &memory.scattering, options.speckle * self.options.speckle_k, options.near, values, Some(blocks))?;
        rays += corrections.rays;
        // A frame has one plane and channel.
        memory.rj_k.par_chunks_mut(columns).zip(corrections.values.par_chunks(columns * corrections.states)).for_each(|(row, values)| {
            row.iter_mut().zip(values.chunks_exact(corrections.states)).for_each(|(rj_k, correction)| *rj_k += correction[0]);
        });
        let rough = Rough { view, blocks, shown: &memory.shown, corrections: &corrections, rj_k: &memory.rj_k };
        rays += self.smooth_edges(&rough, options, out)?;
        memory.corrections = corrections.values;
        Ok(rays)
    }

    /// Fills the memory of a frame without corrections, tile by tile. Returns the number of rays.
    fn mesh(&self, view: &View, blocks: &Blocks, options: &MeshOptions, memory: &mut Memory) -> Result<usize> {
        let (columns, rows) = (view.grid().n_l, view.grid().n_m);
        let across = columns.div_ceil(TILE);
        let Memory { shown, scattering, rj_k, .. } = memory;
        tiles(shown, columns, 1)
            .into_par_iter()
            .zip(tiles(scattering, columns, 1))
            .zip(tiles(rj_k, columns, 1))
            .enumerate()
            .map_init(
                || (self.scratch(), vec![Vertex::default(); (TILE + 1) * (TILE + 1)], vec![Vertex::default(); TILE * TILE]),
                |(scratch, vertices, out), (k, ((mut shown, mut scattering), mut rj_k))| {
                    let corner = (k % across * TILE, k / across * TILE);
                    let mut tile = Tile { tracer: self, view, blocks, scratch, corner, vertices, known: [0; TILE + 1], rays: 0 };
                    let (wide, high) = ((columns - corner.0).min(TILE), (rows - corner.1).min(TILE));
                    for row in (0..high).step_by(options.step) {
                        for column in (0..wide).step_by(options.step) {
                            tile.square(column, row, options.step, options, out)?;
                        }
                    }
                    for (row, line) in out.chunks_exact(TILE).enumerate().take(high) {
                        for (column, pixel) in line.iter().enumerate().take(wide) {
                            shown[row][column] = pixel.shown();
                            scattering[row][column] = pixel.scattering_face();
                            rj_k[row][column] = pixel.rj_k;
                        }
                    }
                    Ok(tile.rays)
                },
            )
            .sum()
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
