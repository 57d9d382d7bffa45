//! What both directions share: the padded grid, the kernels, the corrections and where a visibility falls.

use super::GridOptions;
use super::channels::Channels;
use super::fft::{Plans, good_size};
use super::kernel::{Kernel, KernelTable};
use super::pool::Pool;
use super::real::Real;
use super::wplanes::{SLAB, WBasis, WTerm};
use crate::{ChainError, Result};
use cittert_arrays::{SPEED_OF_LIGHT_M_S, SkyGrid};
use ndarray::ArrayView2;
use std::sync::atomic::{AtomicU64, Ordering};

/// Side of a tile of starting cells.
pub(crate) const TILE: usize = 16;
/// Grids so many times finer than the image needs are compared; the last where the number of visibilities is not known.
const OVERSAMPLING: [f64; 4] = [1.375, 1.5, 1.75, 2.0];

static NEXT: AtomicU64 = AtomicU64::new(0);

/// How far a set reaches in u, v and w: what must be known before the first row is gridded.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct UvwExtent {
    /// Largest |u|, m.
    pub u_m: f64,
    /// Largest |v|, m.
    pub v_m: f64,
    /// Largest |w|, m.
    pub w_m: f64,
}

impl UvwExtent {
    /// Of these rows \[row, 3\]; rows that are not finite are left out.
    #[must_use]
    pub fn of(uvw_m: ArrayView2<'_, f64>) -> Self {
        let mut extent = Self::default();
        for row in uvw_m.rows().into_iter().filter(|r| r.iter().all(|x| x.is_finite())) {
            extent.u_m = extent.u_m.max(row[0].abs());
            extent.v_m = extent.v_m.max(row[1].abs());
            extent.w_m = extent.w_m.max(row[2].abs());
        }
        extent
    }

    /// The larger of two.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self { u_m: self.u_m.max(other.u_m), v_m: self.v_m.max(other.v_m), w_m: self.w_m.max(other.w_m) }
    }
}

/// Sizes, kernels and scales of one image and one range of uvw.
#[derive(Debug)]
pub(crate) struct Plan<T: Real> {
    /// Told from every other plan of the process.
    pub(crate) id: u64,
    pub(crate) grid: SkyGrid,
    /// Points of the padded transform along u and v.
    pub(crate) nu: usize,
    pub(crate) nv: usize,
    pub(crate) table: KernelTable<T>,
    /// 1 / transform of the kernel for each column and each row of the image.
    pub(crate) correct_l: Vec<f64>,
    pub(crate) correct_m: Vec<f64>,
    pub(crate) w: WTerm<T>,
    /// Rows of the half grid that are kept: row r is v = r - support / 2.
    pub(crate) n_rows: usize,
    pub(crate) channels: Channels<T>,
    pub(crate) divide_by_n: bool,
    pub(crate) fft: Plans<T>,
    /// Cells (wavelengths for w) a metre a Hz.
    pub(crate) scale: [f64; 3],
    /// Reach of the image in l, m and n - 1.
    reach: [f64; 3],
    pub(crate) extent: UvwExtent,
    /// Buffers that outlive a pass.
    pub(crate) pool: Pool<T>,
}

/// What a transform costs with a grid so much finer than the image: about nanoseconds, from the times of the passes on one machine.
fn cost(grid: &SkyGrid, v_reach: f64, kernel: &Kernel, planes: usize, n_vis: f64) -> f64 {
    let (nu, nv) = (kernel.oversampling * grid.n_l as f64, kernel.oversampling * grid.n_m as f64);
    let rows = (v_reach * nv).min(nv);
    let fourier = rows * nu * (4.0 + 0.4 * nu.log2()) + grid.n_l as f64 * nv * (2.0 + 0.2 * nv.log2());
    // Few visibilities stand for many channels, and few planes matter to most of them.
    let lanes = if kernel.support <= 4 { 4.0 } else { kernel.support.next_power_of_two() as f64 };
    let spread = 0.5 * n_vis * (40.0 + 0.15 * kernel.support as f64 * lanes * (planes as f64 / 2.0).clamp(1.0, 16.0));
    planes as f64 * fourier + spread
}

impl<T: Real> Plan<T> {
    /// A plan; `n_vis` visibilities are expected where that is known.
    pub(crate) fn new(grid: &SkyGrid, freq_hz: &[f64], extent: UvwExtent, opts: &GridOptions, n_vis: Option<u64>) -> Result<Self> {
        let bad = |value: String, expected: &str| ChainError::BadOption { option: "epsilon", value, expected: expected.into() };
        if !(1e-13..=0.5).contains(&opts.epsilon) {
            return Err(bad(opts.epsilon.to_string(), "a relative error between 1e-12 and 0.1"));
        }
        if freq_hz.is_empty() || freq_hz.iter().any(|f| !(f.is_finite() && *f > 0.0)) {
            let value = format!("{freq_hz:?}");
            return Err(ChainError::BadOption { option: "frequency", value, expected: "positive channel centres in Hz".into() });
        }
        // Errors of the two axes, of w and of the channels add in quadrature to half the request, as rms over an image: so its largest error,
        // relative to its peak, stays below the request too.
        let each = 0.2 * opts.epsilon;
        let hard = || bad(opts.epsilon.to_string(), "an error that a kernel of 16 cells reaches");
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
        // Part of the grid's height that is reached, whatever its spacing.
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
        let top = ((extent.v_m * f_max * scale[1]).ceil().min(nv as f64)) as usize;
        let below = kernel.support / 2;
        Ok(Self {
            id: NEXT.fetch_add(1, Ordering::Relaxed),
            grid: grid.clone(),
            nu,
            nv,
            correct_l: kernel.correction(grid.n_l, nu),
            correct_m: kernel.correction(grid.n_m, nv),
            table: KernelTable::new(&kernel, 0.02 * opts.epsilon),
            w,
            n_rows: (below + top + kernel.support + 1).min(nv + kernel.support),
            channels: Channels::new(freq_hz, 0.2 * opts.epsilon),
            divide_by_n: opts.divide_by_n,
            fft: Plans::new(nu, nv),
            scale,
            reach: [l, m, if opts.w_term { -nu_min } else { 0.0 }],
            extent,
            pool: Pool::default(),
        })
    }

    /// Number of channels of a row.
    pub(crate) fn n_chan(&self) -> usize {
        self.channels.classes.last().map_or(0, super::channels::ChannelClass::n_nodes)
    }

    /// Longest phase over the image of a row, in turns a Hz.
    pub(crate) fn turns_per_hz(&self, uvw: [f64; 3]) -> f64 {
        uvw.iter().zip(self.reach).map(|(x, r)| x.abs() * r).sum::<f64>() / SPEED_OF_LIGHT_M_S
    }

    /// Cells below the grid that the kernel reaches.
    pub(crate) fn below(&self) -> usize {
        self.table.support / 2
    }

    pub(crate) fn tiles_u(&self) -> usize {
        self.nu.div_ceil(TILE)
    }

    pub(crate) fn tiles_v(&self) -> usize {
        self.n_rows.div_ceil(TILE)
    }

    /// Starting planes fall into so many slabs; the powers form has one.
    pub(crate) fn slabs(&self) -> usize {
        match &self.w.basis {
            WBasis::Powers { .. } => 1,
            WBasis::Planes { count, table, .. } => (count - table.support + 1).div_ceil(SLAB),
        }
    }

    /// Planes that the tile of one slab covers.
    pub(crate) fn slab_depth(&self) -> usize {
        match &self.w.basis {
            WBasis::Powers { screens, .. } => screens.len(),
            WBasis::Planes { table, .. } => table.support + SLAB - 1,
        }
    }

    /// n - 1 of a pixel; `None` behind the horizon.
    pub(crate) fn depth_at(&self, row: usize, column: usize) -> Option<f64> {
        let (l, m) = (self.grid.l_at(column as f64), self.grid.m_at(row as f64));
        let r2 = l * l + m * m;
        (r2 < 1.0).then(|| -r2 / (1.0 + (1.0 - r2).sqrt()))
    }

    /// Check that rows lie within what was announced.
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
        for (r, row) in uvw_m.rows().into_iter().enumerate() {
            if row.iter().zip(limit).any(|(x, limit)| !(x.abs() <= limit)) {
                let message = format!("uvw of row {r} is {row}, outside the extent announced to the gridder ({limit:?} m)");
                return Err(ChainError::Incompatible(message));
            }
        }
        Ok(())
    }
}
