//! Images whose PSF depends on the place: the image with the PSF of each node of the field, weighted by the distance from the node.

use super::optics::Optics;
use super::response::{Path, Response};
use crate::fourier::{MirrorConvolver, Spectrum};
use crate::{Result, ensure};
use cittert_arrays::SkyGrid;
use ndarray::{Array2, ArrayView2, Zip};

/// Bytes of spectra that are kept between frames. Others are computed for each frame.
const KEPT: usize = 1 << 30;

/// A place of the field with its response.
#[derive(Debug)]
struct Node {
    response: Response,
    kept: Option<Spectrum<f64>>,
}

/// All nodes of the field.
#[derive(Debug)]
pub(super) struct FieldOfView {
    convolver: MirrorConvolver<f64>,
    cell_rad: f64,
    dim: (usize, usize),
    /// Nodes along each axis.
    side: usize,
    nodes: Vec<Node>,
}

impl FieldOfView {
    /// # Errors
    /// Pixels that are much coarser than the optics.
    pub(super) fn new(optics: &Optics, paths: &[Path], grid: &SkyGrid, side: usize) -> Result<Self> {
        let dim = (grid.n_m, grid.n_l);
        let side = if optics.varies() { side } else { 1 };
        let convolver = MirrorConvolver::new(dim);
        // The nearer edge of the field is at the distance 1.
        let nearer = 0.5 * dim.0.min(dim.1) as f64;
        let place = |k: usize, n: usize| if side == 1 { 0.0 } else { (k as f64 / (side - 1) as f64 - 0.5) * n as f64 / nearer };
        let keep = side * side * dim.0 * dim.1 * 32 <= KEPT || side == 1;
        let mut nodes = Vec::new();
        for (r, c) in (0..side).flat_map(|r| (0..side).map(move |c| (r, c))) {
            let response = Response { optics: optics.transfer((place(c, dim.1), place(r, dim.0))), paths: paths.to_vec() };
            let kept = if keep { Some(spectrum(&convolver, &response, grid.cell_rad)?) } else { None };
            nodes.push(Node { response, kept });
        }
        ensure!(!nodes.is_empty(), crate::ChainError::Internal("a field without nodes".into()));
        Ok(Self { convolver, cell_rad: grid.cell_rad, dim, side, nodes })
    }

    /// The response in the middle of the field.
    pub(super) fn middle(&self) -> &Response {
        &self.nodes[self.nodes.len() / 2].response
    }

    /// A plane \[m, l\] as the sensor sees it.
    pub(super) fn image(&self, plane: ArrayView2<'_, f64>) -> Result<Array2<f64>> {
        let one = |node: &Node| match &node.kept {
            Some(spectrum) => Ok(self.convolver.convolve(plane, spectrum)),
            None => Ok(self.convolver.convolve(plane, &spectrum(&self.convolver, &node.response, self.cell_rad)?)),
        };
        if let [node] = self.nodes.as_slice() {
            return one(node);
        }
        let mut out = Array2::zeros(self.dim);
        for (k, node) in self.nodes.iter().enumerate() {
            let (r, c) = (k / self.side, k % self.side);
            let (down, across) = (self.hat(r, self.dim.0), self.hat(c, self.dim.1));
            let weights = Array2::from_shape_fn(self.dim, |(y, x)| down[y] * across[x]);
            Zip::from(&mut out).and(&one(node)?).and(&weights).par_for_each(|o, v, w| *o += v * w);
        }
        Ok(out)
    }

    /// Weight of a node along an axis of `n` pixels: 1 at the node, falling to 0 at its neighbours. The nodes at the ends are at the outer edges.
    fn hat(&self, node: usize, n: usize) -> Vec<f64> {
        let step = (self.side - 1) as f64 / n as f64;
        (0..n).map(|k| (1.0 - ((k as f64 + 0.5) * step - node as f64).abs()).max(0.0)).collect()
    }
}

fn spectrum(convolver: &MirrorConvolver<f64>, response: &Response, cell_rad: f64) -> Result<Spectrum<f64>> {
    let sampled = response.sampled(cell_rad)?;
    Ok(convolver.spectrum(|u, v| sampled.at(u, v)))
}
