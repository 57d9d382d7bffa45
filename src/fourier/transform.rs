//! A transform for one image, one set of channels and one range of uvw. It serves many passes in both directions.

use super::band_degridder::BandDegridder;
use super::band_gridder::BandGridder;
use super::bands::Bands;
use super::degridder::Degridder;
use super::grid_options::GridOptions;
use super::gridder::Gridder;
use super::nodes::Nodes;
use super::owners::Owners;
use super::plan::{Plan, UvwExtent};
use super::plane_groups::plane_groups;
use super::plane_rows::PlaneRows;
use super::real::Real;
use super::schedule::Idle;
use super::shared_gridder::SharedGridder;
use super::sorted_rows::{FoldedRows, SortedRows};
use super::tile_work::{self, SampleOfRows};
use super::wplanes::WBasis;
use crate::Result;
use cittert_arrays::{Ranks, SkyGrid};
use ndarray::ArrayView2;
use std::sync::Arc;

/// Makes gridders and predictors that share their kernels, their buffers and their sorted rows.
#[derive(Debug, Clone)]
pub struct Transform<T: Real> {
    pub(super) plan: Arc<Plan<T>>,
}

/// The arithmetic and the memory traffic of one pass over some rows, for comparison with the peak rates of a machine.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PassWork {
    /// Multiply-adds between nodes and cells.
    pub spread_multiply_adds: f64,
    /// Number of nodes.
    pub nodes: f64,
    /// Size of the nodes in bytes.
    pub node_bytes: f64,
    /// Multiply-adds between the channels of the rows and their nodes.
    pub channel_multiply_adds: f64,
    /// Multiply-adds of the transforms between planes and image: 2.5 n log2 n for a transform of n points.
    pub fourier_multiply_adds: f64,
    /// Bytes that these transforms move. Each plane is read twice and written once.
    pub fourier_bytes: f64,
}

impl<T: Real> Transform<T> {
    /// A transform between an image and about `n_vis` visibilities. Their number determines the oversampling of the grid.
    ///
    /// # Errors
    /// No kernel reaches epsilon, or a frequency is not positive.
    pub fn new(grid: &SkyGrid, freq_hz: &[f64], extent: UvwExtent, opts: &GridOptions, n_vis: u64) -> Result<Self> {
        Self::expecting(grid, freq_hz, extent, opts, Some(n_vis))
    }

    /// [`Transform::new`] where the number of visibilities may not be known.
    pub(crate) fn expecting(grid: &SkyGrid, freq_hz: &[f64], extent: UvwExtent, opts: &GridOptions, n_vis: Option<u64>) -> Result<Self> {
        Ok(Self { plan: Arc::new(Plan::new(grid, freq_hz, extent, opts, n_vis)?) })
    }

    /// Sort rows with these uvw in m \[row, 3\] by their position on the grid.
    ///
    /// # Errors
    /// A uvw is not finite or lies outside the extent of the transform.
    pub fn sort(&self, uvw_m: ArrayView2<'_, f64>) -> Result<SortedRows> {
        SortedRows::new(&self.plan, uvw_m)
    }

    /// An empty gridder.
    #[must_use]
    pub fn gridder(&self) -> Gridder<T> {
        Gridder::on(Arc::clone(&self.plan))
    }

    /// The bands of v in which this process and those that share the set make their image. `None` where the planes of a band would not fit into their
    /// share of the memory budget, or where visibilities alias over the edge of the grid.
    #[must_use]
    pub fn bands(&self, ranks: &dyn Ranks) -> Option<Bands> {
        Bands::of(&self.plan, (ranks.rank(), ranks.size()))
    }

    /// Rows with these uvw in m \[row, 3\] whose nodes are made here, while the processes that share the set sort them. They serve [`Transform::nodes`] and
    /// [`SharedGridder::letters`].
    ///
    /// # Errors
    /// As [`Transform::sort`].
    pub fn fold(&self, uvw_m: ArrayView2<'_, f64>) -> Result<FoldedRows> {
        FoldedRows::new(&self.plan, uvw_m)
    }

    /// An empty gridder of several processes, each of which holds a part of the planes. `sample` are some of the rows of this process, from which all processes
    /// together share rows of tiles and work evenly. `None` where visibilities alias over the edge of the grid, or where the part of a process does not fit into the
    /// share of the memory budget.
    ///
    /// # Errors
    /// As [`Transform::sort`].
    pub fn shared_gridder(&self, sample: SampleOfRows<'_>, ranks: &dyn Ranks) -> Result<Option<SharedGridder<T>>> {
        let plan = &self.plan;
        let work = tile_work::of_all(plan, sample, ranks)?;
        let bytes = |o: &Owners| PlaneRows::<T>::bytes_of_rows(o.most_rows(plan.table.support), plan.planes(), plan.columns.width);
        let owners = Owners::new(plan, &work, ranks).filter(|o| bytes(o) <= plan.plane_bytes);
        let mut without = [f64::from(u8::from(owners.is_none()))];
        ranks.largest(&mut without);
        Ok(owners.filter(|_| without[0] == 0.0).map(|owners| SharedGridder::on(Arc::clone(plan), owners)))
    }

    /// About how long the nodes in each row of tiles take, in any unit, of rows m \[row, 3\] that each stand for `each`.
    ///
    /// # Errors
    /// As [`Transform::sort`].
    pub fn work_of_tiles(&self, sample: ArrayView2<'_, f64>, each: f64) -> Result<Vec<f64>> {
        let mut work = vec![0.0; self.plan.tiles_v()];
        tile_work::add_nodes(&self.plan, &self.fold(sample)?, each, &mut work);
        Ok(work)
    }

    /// An empty gridder by bands.
    #[must_use]
    pub fn band_gridder(&self, bands: &Bands) -> BandGridder<T> {
        BandGridder::on(Arc::clone(&self.plan), bands)
    }

    /// A predictor of the image `plane` \[m, l\] by bands.
    ///
    /// # Errors
    /// The image has another shape than the grid, or a pixel is not finite.
    pub fn band_degridder<P: Real>(&self, bands: &Bands, plane: ArrayView2<'_, P>) -> Result<BandDegridder<T>> {
        BandDegridder::on(Arc::clone(&self.plan), bands, plane)
    }

    /// Nodes of rows that were folded or sorted by this transform, with any content.
    #[must_use]
    pub fn nodes(&self, rows: &FoldedRows) -> Nodes<T> {
        Nodes::of(Arc::clone(&self.plan), rows)
    }

    /// Number of groups in which planes are made that do not fit into their share of the memory together.
    #[must_use]
    pub fn groups_of_planes(&self) -> usize {
        plane_groups(&self.plan, self.plan.plane_bytes).len()
    }

    /// Bytes of all planes together.
    #[must_use]
    pub fn plane_bytes(&self) -> usize {
        PlaneRows::<T>::bytes(self.plan.n_rows, self.plan.planes(), self.plan.columns.with_pixels)
    }

    /// A predictor of the image `plane` \[m, l\].
    ///
    /// # Errors
    /// The image has another shape than the grid, or a pixel is not finite.
    pub fn degridder<P: Real>(&self, plane: ArrayView2<'_, P>) -> Result<Degridder<T>> {
        Degridder::on(Arc::clone(&self.plan), plane)
    }

    /// How threads share a pass over these rows.
    #[must_use]
    pub fn idle(&self, rows: &SortedRows) -> Idle {
        rows.idle(self.plan.tiles_v())
    }

    /// The arithmetic and the memory traffic of one pass over these rows.
    #[must_use]
    pub fn work(&self, rows: &SortedRows) -> PassWork {
        let plan = &self.plan;
        let planes = plan.planes();
        let cells = (plan.table.support * plan.table.lanes * 2) as f64;
        let mut work = PassWork::default();
        for row in rows.chunks.iter().flat_map(|c| &c.rows) {
            let freq = &plan.channels.classes[row.class].freq_hz;
            work.nodes += freq.len() as f64;
            work.node_bytes += (freq.len() * 2 * size_of::<T>()) as f64;
            work.channel_multiply_adds +=
                if row.class + 1 < plan.channels.classes.len() { (freq.len() * plan.n_chan()) as f64 } else { 0.0 };
            work.spread_multiply_adds += freq.iter().map(|f| cells * plan.planes_of(row.uvw[2] * f) as f64).sum::<f64>();
        }
        let (nu, nv) = (plan.nu as f64, plan.nv as f64);
        let transforms = |count: f64, n: f64| count * 2.5 * n * n.log2();
        let columns = plan.grid.n_l as f64 * if matches!(plan.w.basis, WBasis::Powers { .. }) { 0.5 } else { 1.0 };
        work.fourier_multiply_adds = planes as f64 * (transforms(plan.n_rows as f64, nu) + transforms(columns, nv));
        // The planes are read, and rows of pixels are written and read again.
        let cells = plan.columns.width + 2 * plan.grid.n_l;
        work.fourier_bytes = planes as f64 * plan.n_rows as f64 * (cells * 2 * size_of::<T>()) as f64;
        work
    }
}
