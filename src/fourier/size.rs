//! The sizes of a transform, from which its time and its memory follow.

use super::bands::Sides;
use super::fft::BLOCK;
use super::owners::{Owners, shared};
use super::plane_groups::plane_groups;
use super::plane_rows::PlaneRows;
use super::real::Real;
use super::transform::Transform;
use super::wplanes::WBasis;
use num_complex::Complex;

/// The sizes of a transform between an image and its visibilities.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TransformSize {
    /// Points of the padded grid along u and along v.
    pub padded: (usize, usize),
    /// Columns of it that visibilities reach. Several processes that share the planes store these.
    pub width: usize,
    /// Rows of the half grid that are kept.
    pub rows: usize,
    /// Planes of the w term.
    pub planes: usize,
    /// Groups that the planes are made in; 1 where all are in memory together.
    pub groups: usize,
    /// Cells that the kernel covers along an axis.
    pub support: usize,
    /// Bytes of the planes of one group.
    pub group_bytes: u64,
    /// The same, and those of the group before where that has another size: on the way to visibilities and back its memory, once freed, has holes that the
    /// next group does not fit into.
    pub plane_bytes: u64,
    /// Bytes of the transformed columns that wait for the pass over rows, on the way from an image to the planes of one group.
    pub column_bytes: u64,
    /// Bytes of all buffers of such columns. Groups of another size have buffers of their own.
    pub column_buffers: u64,
    /// Bytes that planes may take.
    pub plane_limit: u64,
    /// Points of all planes that pass through a transform: those of the rows, and those of the columns of the image.
    pub points: f64,
    /// The same, each with log2 of the length of its transform.
    pub point_logs: f64,
}

/// The sizes of a transform that several processes share by bands of v.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BandSize {
    /// Number of processes.
    pub processes: usize,
    /// Most bytes of planes that a process holds.
    pub bytes: f64,
    /// Bytes of the columns that a process keeps of all rows.
    pub own_bytes: f64,
    /// Bytes of the columns of all processes in the rows that one transforms, which it gives away.
    pub all_bytes: f64,
    /// As in [`TransformSize`], for one process.
    pub points: f64,
    /// As in [`TransformSize`], for one process.
    pub point_logs: f64,
}

impl TransformSize {
    /// The sizes for so many processes that hold rows of tiles with so much `work` and grid while they read, and an image of `n_l` columns. `None` where they do
    /// not. Also the work of the busiest process over its fair share.
    #[must_use]
    pub fn by_owners(&self, work: &[f64], (n_l, real_bytes): (usize, usize), processes: usize) -> Option<(BandSize, f64)> {
        let (planes, support) = (self.planes, self.support);
        let sides = Sides { padded: self.padded, width: self.width, n_l, rows: self.rows, planes, support, cell_bytes: 2 * real_bytes };
        sides.bands(processes)?;
        let owners = Owners::of_tiles(shared(work, processes), (0, processes));
        let rows = owners.most_rows(support);
        let bytes = rows * planes * self.width * sides.cell_bytes;
        let by = processes as f64;
        let size = BandSize {
            processes,
            bytes: bytes as f64,
            own_bytes: sides.own_bytes(processes) as f64,
            all_bytes: sides.own_bytes(1) as f64 * rows as f64 / self.rows as f64,
            points: self.points / by,
            point_logs: self.point_logs / by,
        };
        (processes > 1 && bytes as u64 <= self.plane_limit).then(|| (size, owners.busiest(work)))
    }

    /// The sizes for so many processes and an image of `n_l` columns; `None` where they do not share the transform. Each process transforms the rows of its own
    /// visibilities, and its share of the columns.
    #[must_use]
    pub fn by_bands(&self, (n_l, real_bytes): (usize, usize), processes: usize) -> Option<BandSize> {
        let (rows, planes, support) = (self.rows, self.planes, self.support);
        let sides = Sides { padded: self.padded, width: self.width, n_l, rows, planes, support, cell_bytes: 2 * real_bytes };
        let bytes = sides.bytes(&sides.bands(processes)?, processes);
        let of_rows = (planes * rows * self.padded.0) as f64;
        let (points, logs) = (self.points - of_rows, self.point_logs - of_rows * (self.padded.0 as f64).log2());
        let by = processes as f64;
        (processes > 1 && bytes as u64 <= self.plane_limit).then_some(BandSize {
            processes,
            bytes: bytes as f64,
            own_bytes: sides.own_bytes(processes) as f64,
            all_bytes: sides.own_bytes(1) as f64,
            points: self.points - points + points / by,
            point_logs: self.point_logs - logs + logs / by,
        })
    }
}

impl<T: Real> Transform<T> {
    /// The sizes of this transform.
    #[must_use]
    pub fn size(&self) -> TransformSize {
        let plan = &self.plan;
        let (nu, nv, n_l) = (plan.nu, plan.nv, plan.grid.n_l);
        let groups = plane_groups(plan, plan.plane_bytes);
        let at_once = groups.iter().map(|g| g.len()).max().unwrap_or(1);
        let least = groups.iter().map(|g| g.len()).min().unwrap_or(1);
        let held = at_once + if least < at_once { least } else { 0 };
        let plane_bytes = |planes: usize| PlaneRows::<T>::bytes(plan.n_rows, planes, plan.columns.with_pixels) as u64;
        let column_bytes = |planes: usize| (planes * plan.n_rows * n_l.next_multiple_of(BLOCK) * size_of::<Complex<T>>()) as u64;
        // Two columns share a transform where screens are real.
        let columns = n_l as f64 * if matches!(plan.w.basis, WBasis::Powers { .. }) { 0.5 } else { 1.0 };
        let (of_rows, of_columns) = (plan.n_rows as f64 * nu as f64, columns * nv as f64);
        let planes = plan.planes() as f64;
        TransformSize {
            padded: (nu, nv),
            width: plan.columns.width,
            rows: plan.n_rows,
            planes: plan.planes(),
            groups: groups.len(),
            support: plan.table.support,
            group_bytes: plane_bytes(at_once),
            plane_bytes: plane_bytes(held),
            column_bytes: column_bytes(at_once),
            column_buffers: column_bytes(held),
            plane_limit: plan.plane_bytes as u64,
            points: planes * (of_rows + of_columns),
            point_logs: planes * (of_rows * (nu as f64).log2() + of_columns * (nv as f64).log2()),
        }
    }
}
