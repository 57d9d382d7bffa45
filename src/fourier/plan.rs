//! The plan of a transform, which both directions share: the padded grid, the kernels, the corrections and the positions of visibilities.

use super::channels::Channels;
use super::grid_options::GridOptions;
use super::kernel::{Kernel, KernelTable};
use super::line_fft::{LineFfts, good_size};
use super::plane_rows::TILE;
use super::pool::Pool;
use super::real::Real;
use super::stored_columns::StoredColumns;
use super::wplanes::{SLAB, WBasis, WTerm};
use crate::values::need;
use crate::{ChainError, Result};
use cittert_arrays::{Ranks, SPEED_OF_LIGHT_M_S, SkyGrid};
use ndarray::{ArrayView1, ArrayView2, Axis};
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};

/// Oversampling factors of the grid that are compared. The last one is used if the number of visibilities is not known.
const OVERSAMPLING: [f64; 4] = [1.375, 1.5, 1.75, 2.0];

/// Cells (for w: wavelengths) beyond which a position has no digits left for its place between two cells.
const FARTHEST: f64 = 1e12;

static NEXT: AtomicU64 = AtomicU64::new(0);

/// The largest u, v and w of a set. They must be known before the first row is gridded.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct UvwExtent {
    /// Largest |u|, m.
    pub u_m: f64,
    /// Largest |v|, m.
    pub v_m: f64,
    /// Largest |w|, m.
    pub w_m: f64,
}

/// Rows whose places are looked at together.
const ROWS: usize = 4096;

impl UvwExtent {
    /// The extent of these rows \[row, 3\]. Rows that are not finite are left out.
    #[must_use]
    pub fn of(uvw_m: ArrayView2<'_, f64>) -> Self {
        let of_part = |rows: ArrayView2<'_, f64>| {
            let finite = rows.rows().into_iter().filter(|r| r.iter().all(|x| x.is_finite()));
            finite.fold(Self::default(), |e, row| e.union(Self { u_m: row[0].abs(), v_m: row[1].abs(), w_m: row[2].abs() }))
        };
        let parts = uvw_m.axis_chunks_iter(Axis(0), ROWS).into_par_iter();
        parts.map(of_part).reduce(Self::default, Self::union)
    }

    /// The extent of the rows of all processes.
    #[must_use]
    pub fn shared(self, ranks: &dyn Ranks) -> Self {
        let mut all = [self.u_m, self.v_m, self.w_m];
        ranks.largest(&mut all);
        Self { u_m: all[0], v_m: all[1], w_m: all[2] }
    }

    /// The extent with a tenth of room on all sides, because the next rows often need a slightly larger one.
    #[must_use]
    pub fn with_room(self) -> Self {
        Self { u_m: 1.1 * self.u_m, v_m: 1.1 * self.v_m, w_m: 1.1 * self.w_m }
    }

    /// The extent of two sets together.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self { u_m: self.u_m.max(other.u_m), v_m: self.v_m.max(other.v_m), w_m: self.w_m.max(other.w_m) }
    }
}

/// Sizes, kernels and scales for one image and one range of uvw.
#[derive(Debug)]
pub(crate) struct Plan<T: Real> {
    /// Number that no other plan of the process has.
    pub(crate) id: u64,
    pub(crate) grid: SkyGrid,
    /// Number of points of the padded transform along u and v.
    pub(crate) nu: usize,
    pub(crate) nv: usize,
    pub(crate) table: KernelTable<T>,
    /// 1 / (transform of the kernel) for each column and each row of the image.
    pub(crate) correct_l: Vec<f64>,
    pub(crate) correct_m: Vec<f64>,
    pub(crate) w: WTerm<T>,
    /// Number of rows of the half grid that are kept. Row r is v = r - support / 2.
    pub(crate) n_rows: usize,
    pub(crate) columns: StoredColumns,
    pub(crate) channels: Channels<T>,
    pub(crate) divide_by_n: bool,
    pub(crate) fft: LineFfts<T>,
    /// Cells (for w: wavelengths) per metre and Hz.
    pub(crate) scale: [f64; 3],
    /// Largest |l|, |m| and |n - 1| in the image.
    reach: [f64; 3],
    pub(crate) extent: UvwExtent,
    /// Buffers that are kept between passes.
    pub(crate) pool: Pool<T>,
    /// Bytes of the planes of one group, see [`MemoryBudget::image_planes`].
    pub(crate) plane_bytes: usize,
}

/// Estimated time of a transform with the oversampling of `kernel`, in about nanoseconds. The constants come from measured times of the passes
/// on one machine.
fn cost(grid: &SkyGrid, v_reach: f64, kernel: &Kernel, planes: usize, n_vis: f64) -> f64 {
    let (nu, nv) = (kernel.oversampling * grid.n_l as f64, kernel.oversampling * grid.n_m as f64);
    let rows = (v_reach * nv).min(nv);
    let fourier = rows * nu * (4.0 + 0.4 * nu.log2()) + grid.n_l as f64 * nv * (2.0 + 0.2 * nv.log2());
    // A row has fewer nodes than channels, and most nodes need few planes.
    let spread = 0.5 * n_vis * node_cost(kernel.support, (planes as f64 / 2.0).clamp(1.0, 16.0));
    planes as f64 * fourier + spread
}

/// The part of it for one node.
fn node_cost(support: usize, planes: f64) -> f64 {
    let lanes = if support <= 4 { 4.0 } else { support.next_power_of_two() as f64 };
    40.0 + 0.15 * support as f64 * lanes * planes
}

impl<T: Real> Plan<T> {
    /// A plan for about `n_vis` visibilities, if their number is known.
    pub(crate) fn new(grid: &SkyGrid, freq_hz: &[f64], extent: UvwExtent, opts: &GridOptions, n_vis: Option<u64>) -> Result<Self> {
        need("epsilon", opts.epsilon, (1e-13..=0.5).contains(&opts.epsilon), "a relative error from 1e-13 to 0.5")?;
        let positive = !freq_hz.is_empty() && freq_hz.iter().all(|f| f.is_finite() && *f > 0.0);
        need("frequency", format!("{freq_hz:?}"), positive, "positive channel centres in Hz")?;
        // The errors of the two axes, of w and of the channels add in quadrature to half of the requested error, as an rms over the image. The
        // largest error relative to the peak of the image then stays below the requested error too.
        let each = 0.2 * opts.epsilon;
        let hard = || ChainError::bad_option("epsilon", opts.epsilon, "an error that a kernel of 16 cells reaches");
        let f_max = freq_hz.iter().copied().fold(0.0, f64::max);
        let (l, m) = ((grid.n_l / 2) as f64 * grid.cell_rad, (grid.n_m / 2) as f64 * grid.cell_rad);
        let r2 = (l * l + m * m).min(1.0);
        let nu_min = -r2 / (1.0 + (1.0 - r2).sqrt());
        let w_max = extent.w_m * f_max / SPEED_OF_LIGHT_M_S;
        let w = if opts.w_term { WTerm::new(nu_min, w_max, each).ok_or_else(hard)? } else { WTerm::none() };
        let planes = match &w.basis {
            WBasis::Powers { screens, .. } => screens.len(),
            WBasis::Planes { count, .. } => *count,
        };
        // The fraction of the height of the grid that the visibilities reach. It does not depend on the spacing of the grid.
        let v_reach = extent.v_m * f_max / SPEED_OF_LIGHT_M_S * grid.cell_rad;
        let offered = if n_vis.is_some() { &OVERSAMPLING[..] } else { &OVERSAMPLING[OVERSAMPLING.len() - 1..] };
        let price = |k: &Kernel| cost(grid, v_reach, k, planes, n_vis.unwrap_or(0) as f64);
        let kernels = offered.iter().filter_map(|o| Kernel::for_error(each, *o));
        let kernel = kernels.min_by(|a, b| price(a).total_cmp(&price(b))).ok_or_else(hard)?;
        let side = |n: usize| good_size(((kernel.oversampling * n as f64).ceil() as usize).max(2 * kernel.support));
        let (nu, nv) = (side(grid.n_l), side(grid.n_m));
        let scale = [
            grid.l_sign() * grid.cell_rad * nu as f64 / SPEED_OF_LIGHT_M_S,
            grid.cell_rad * nv as f64 / SPEED_OF_LIGHT_M_S,
            1.0 / SPEED_OF_LIGHT_M_S,
        ];
        let reach = [extent.u_m * scale[0].abs(), extent.v_m * scale[1], extent.w_m * scale[2]].map(|x| x * f_max);
        if !reach.iter().all(|x| *x <= FARTHEST) {
            let message =
                format!("uvw up to {extent:?} are {reach:?} cells and wavelengths long: the set is damaged, or its uvw are not in m");
            return Err(ChainError::Incompatible(message));
        }
        let table = KernelTable::new(&kernel, 0.02 * opts.epsilon);
        let columns = StoredColumns::of((nu, grid.n_l), reach[0], &table);
        let top = ((extent.v_m * f_max * scale[1]).ceil().min(nv as f64)) as usize;
        let below = kernel.support / 2;
        Ok(Self {
            id: NEXT.fetch_add(1, Ordering::Relaxed),
            grid: grid.clone(),
            nu,
            nv,
            correct_l: kernel.correction(grid.n_l, nu),
            correct_m: kernel.correction(grid.n_m, nv),
            table,
            w,
            n_rows: (below + top + kernel.support + 1).min(nv + kernel.support),
            columns,
            channels: Channels::new(freq_hz, 0.2 * opts.epsilon),
            divide_by_n: opts.divide_by_n,
            fft: LineFfts::new(nu, nv),
            scale,
            reach: [l, m, if opts.w_term { -nu_min } else { 0.0 }],
            extent,
            pool: Pool::new(opts.memory, grid.n_l * grid.n_m),
            plane_bytes: opts.memory.image_planes(grid.n_l * grid.n_m, n_vis),
        })
    }

    /// Number of channels of a row.
    pub(crate) fn n_chan(&self) -> usize {
        self.channels.n_chan
    }

    /// Largest phase of a row over the image, turns per Hz.
    pub(crate) fn turns_per_hz(&self, uvw: [f64; 3]) -> f64 {
        uvw.iter().zip(self.reach).map(|(x, r)| x.abs() * r).sum::<f64>() / SPEED_OF_LIGHT_M_S
    }

    /// Number of cells below v = 0 that the kernel reaches.
    pub(crate) fn below(&self) -> usize {
        self.table.support / 2
    }

    pub(crate) fn tiles_u(&self) -> usize {
        self.columns.tiles
    }

    pub(crate) fn tiles_v(&self) -> usize {
        self.n_rows.div_ceil(TILE)
    }

    /// Number of slabs of starting planes. The form with powers has one slab.
    pub(crate) fn slabs(&self) -> usize {
        match &self.w.basis {
            WBasis::Powers { .. } => 1,
            WBasis::Planes { count, table, .. } => (count - table.support + 1).div_ceil(SLAB),
        }
    }

    /// Number of planes or screens of the w term.
    pub(crate) fn planes(&self) -> usize {
        match &self.w.basis {
            WBasis::Powers { screens, .. } => screens.len(),
            WBasis::Planes { count, .. } => *count,
        }
    }

    /// Number of planes or screens that a visibility at w (wavelengths) reaches.
    pub(crate) fn planes_of(&self, w: f64) -> usize {
        match &self.w.basis {
            WBasis::Powers { inverse_w, enough, .. } => 1 + enough.iter().filter(|e| (w * inverse_w).abs() > **e).count(),
            WBasis::Planes { table, .. } => table.support,
        }
    }

    /// Estimated time of gridding a node that reaches so many planes, in about nanoseconds, see [`cost`].
    pub(crate) fn node_cost(&self, planes: usize) -> f64 {
        node_cost(self.table.support, planes as f64)
    }

    /// Number of planes that the tile of one slab covers.
    pub(crate) fn slab_depth(&self) -> usize {
        match &self.w.basis {
            WBasis::Powers { screens, .. } => screens.len(),
            WBasis::Planes { table, .. } => table.support + SLAB - 1,
        }
    }

    /// Check the shape of rows, and that their uvw lie within the extent of the plan.
    pub(crate) fn check_rows(&self, uvw_m: ArrayView2<'_, f64>, shape: (usize, usize)) -> Result<()> {
        if uvw_m.ncols() != 3 || shape != (uvw_m.nrows(), self.n_chan()) {
            return Err(cittert_arrays::ArrayError::ShapeMismatch {
                what: "visibilities to grid",
                expected: vec![uvw_m.nrows(), self.n_chan()],
                found: vec![shape.0, shape.1],
            }
            .into());
        }
        let limit = [self.extent.u_m, self.extent.v_m, self.extent.w_m];
        let outside = |row: ArrayView1<'_, f64>| row.iter().zip(limit).any(|(x, limit)| !(x.abs() <= limit));
        let parts = uvw_m.axis_chunks_iter(Axis(0), ROWS).into_par_iter().enumerate();
        let found = parts.find_map_first(|(k, rows)| rows.rows().into_iter().position(outside).map(|r| k * ROWS + r));
        found.map_or(Ok(()), |r| {
            let message = format!("uvw of row {r} is {}, outside the extent of the transform ({limit:?} m)", uvw_m.row(r));
            Err(ChainError::Incompatible(message))
        })
    }
}
