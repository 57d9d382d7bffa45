//! What an image of a set will take, before a visibility is read: the grid that would be chosen, the sizes of its transform, and the work of one
//! pass over the data.
//!
//! The baselines of some runs of rows, spread over the set, stand for all. They are cut and sorted by the same code that grids them, so the numbers of
//! nodes and multiply-adds are those of the rows that were looked at, and those of the whole set to within what the sample misses.

use super::data::REDUCED_BYTES;
use super::one_pass::OnePass;
use super::opened::share;
use super::options::ImagingOptions;
use super::over_ranks::SMALL_PLANES;
use super::psf::CORE_SIDES;
use super::session::LONG;
use super::size::choose_grid;
use super::survey::Survey;
use super::total_power::TotalPower;
use super::weights::density_sides;
use crate::fourier::{BandSize, GridOptions, Idle, PassWork, Real, Transform, TransformSize, UvwExtent};
use crate::memory::MemoryBudget;
use crate::progress::Observer;
use crate::{ChainError, Result};
use cittert_arrays::{SPEED_OF_LIGHT_M_S, SkyGrid, UvCoverage, VisibilityBlock, VisibilitySource, Weighting, rows_of_block};
use ndarray::{Array2, Axis, concatenate};

/// Rows that are looked at, at most.
const SAMPLED_ROWS: usize = 1 << 16;
/// Number of runs of rows that they are taken in.
const RUNS: usize = 64;

/// Number of places in a set where weights are compared, and of rows at each.
const PLACES: usize = 8;
const ROWS: usize = 2;

/// The baselines of some rows of a set.
#[derive(Debug, Clone)]
pub struct RowSample {
    /// uvw, m \[row, 3\]; 0 for autocorrelations, which are not imaged.
    pub uvw_m: Array2<f64>,
    /// Part of the rows that are imaged.
    pub used: f64,
    /// Rows of the set for each of the sample.
    pub factor: f64,
}

/// The work of one pass over all rows with one transform.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PassCounts {
    /// Visibilities of the product.
    pub visibilities: f64,
    /// Nodes that stand for them.
    pub nodes: f64,
    /// Multiply-adds between channels and nodes.
    pub channel_multiply_adds: f64,
    /// Multiply-adds between nodes and cells.
    pub grid_multiply_adds: f64,
    /// Bytes of the order of the rows on the grid.
    pub sorted_bytes: f64,
    /// How evenly threads share gridding or prediction.
    pub idle: Idle,
}

impl PassCounts {
    /// The work of one of so many processes that share the rows.
    #[must_use]
    pub fn shared(self, ranks: usize) -> Self {
        self.part(1.0 / ranks.max(1) as f64)
    }

    /// The work of a process that grids so many times its share.
    #[must_use]
    pub fn busier(self, by: f64) -> Self {
        Self { nodes: by * self.nodes, grid_multiply_adds: by * self.grid_multiply_adds, sorted_bytes: by * self.sorted_bytes, ..self }
    }

    /// The work of this part of the rows.
    #[must_use]
    pub fn part(mut self, part: f64) -> Self {
        let p = &mut self;
        for x in [&mut p.visibilities, &mut p.nodes, &mut p.channel_multiply_adds, &mut p.grid_multiply_adds, &mut p.sorted_bytes] {
            *x *= part;
        }
        self
    }
}

/// One transform, and one pass with it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Field {
    /// Sizes of the transform.
    pub size: TransformSize,
    /// Work of a pass over the rows, once for each group of planes where these are made in groups.
    pub pass: PassCounts,
    /// Bytes of a real number inside the transform.
    pub real_bytes: usize,
    /// What a process has of it where several make the image by bands of v.
    pub bands: Option<BandSize>,
}

/// What an image of a set will take.
#[derive(Debug, Clone)]
pub struct Outlook {
    /// The image.
    pub grid: SkyGrid,
    /// Number of output channels.
    pub channels_out: usize,
    /// Number of processes that share the set.
    pub processes: usize,
    /// Rows, channels and products of the set.
    pub shape: (u64, usize, usize),
    /// Part of the rows that are imaged.
    pub used: f64,
    /// True where the set stays in memory.
    pub kept: bool,
    /// True where the first pass reads the set in small parts, so that no block of all products is in memory.
    pub in_parts: bool,
    /// Bytes of the file that are then in memory at once.
    pub part_bytes: f64,
    /// True where a dirty image is made while the set is read, if its planes fit into the memory.
    pub one_pass: bool,
    /// The work in each row of tiles of the grid of such an image, in any unit.
    pub tile_work: Vec<f64>,
    /// True where all rows of a block have the same weights, so that one row is held. Found from some rows.
    pub alike: bool,
    /// The budget of memory that decides this.
    pub memory: MemoryBudget,
    /// Rows of a block, and number of blocks.
    pub blocks: (u64, u64),
    /// True where weights need the density of the u-v plane, and true where they differ from those of the data.
    pub weights: (bool, bool),
    /// Columns and rows of half of the density grid, and the part of it that visibilities touch.
    pub density: (usize, usize, f64),
    /// The transform of an output channel.
    pub image: Field,
    /// The small field in which a beam is fitted; none where the image is as small.
    pub core: Option<Field>,
    /// Shortest and longest projected baseline, wavelengths.
    pub uv_range_wl: (f64, f64),
    /// Largest u, v and w of the rows that were looked at, m.
    pub extent: UvwExtent,
}

/// Look at some rows of a set.
///
/// # Errors
/// The source fails, or has no rows.
pub fn sample(source: &mut dyn VisibilitySource) -> Result<(RowSample, Vec<UvCoverage>)> {
    let n_rows = source.n_rows();
    let length = if n_rows <= SAMPLED_ROWS { n_rows } else { SAMPLED_ROWS / RUNS };
    let count = if n_rows <= SAMPLED_ROWS { 1 } else { RUNS };
    let mut parts = Vec::new();
    for k in 0..count {
        // The first and the last row are looked at.
        let start = if count > 1 { (n_rows - length) * k / (count - 1) } else { 0 };
        parts.push(source.read_coverage(start..start + length)?);
    }
    let uvw: Vec<_> = parts.iter().map(|p| p.uvw_m.view()).collect();
    let mut uvw_m = concatenate(Axis(0), &uvw).map_err(|e| ChainError::Internal(e.to_string()))?;
    if uvw_m.nrows() == 0 {
        return Err(ChainError::NoData("the set has no rows".into()));
    }
    let pairs = parts.iter().flat_map(|p| p.ant1.iter().zip(&p.ant2));
    let mut used = 0;
    for (mut row, (a, b)) in uvw_m.rows_mut().into_iter().zip(pairs) {
        if a == b || !row.iter().all(|x| x.is_finite()) {
            row.fill(0.0);
        } else {
            used += 1;
        }
    }
    let n = uvw_m.nrows() as f64;
    Ok((RowSample { uvw_m, used: f64::from(used) / n, factor: n_rows as f64 / n }, parts))
}

/// Whether the rows of some places in a set have the same weights. With `unit` only flags count.
fn weights_are_alike(source: &mut dyn VisibilitySource, unit: bool) -> Result<bool> {
    let n_rows = source.n_rows();
    let mut first: Option<VisibilityBlock> = None;
    for k in 0..PLACES {
        let start = n_rows.saturating_sub(ROWS) * k / (PLACES - 1);
        let block = source.read_rows(start..(start + ROWS).min(n_rows))?;
        let first = first.get_or_insert_with(|| block.clone());
        let (weights, flags) = (first.weights.index_axis(Axis(0), 0), first.flags.index_axis(Axis(0), 0));
        if (!unit && block.weights.outer_iter().any(|w| w != weights)) || block.flags.outer_iter().any(|f| f != flags) {
            return Ok(false);
        }
    }
    Ok(true)
}

impl RowSample {
    /// The transform for these rows, and a pass over the rows of the set with it.
    ///
    /// # Errors
    /// As [`Transform::new`].
    pub fn field<T: Real>(
        &self,
        grid: &SkyGrid,
        freq_hz: &[f64],
        extent: UvwExtent,
        (options, n_vis): (&GridOptions, Option<u64>),
    ) -> Result<Field> {
        let transform = Transform::<T>::expecting(grid, freq_hz, extent, options, n_vis)?;
        let rows = transform.sort(self.uvw_m.view())?;
        let PassWork { nodes, channel_multiply_adds, spread_multiply_adds, .. } = transform.work(&rows);
        let pass = PassCounts {
            visibilities: self.factor * (self.uvw_m.nrows() * freq_hz.len()) as f64,
            nodes: self.factor * nodes,
            channel_multiply_adds: self.factor * channel_multiply_adds,
            grid_multiply_adds: self.factor * spread_multiply_adds,
            sorted_bytes: self.factor * rows.bytes() as f64,
            idle: transform.idle(&rows),
        };
        Ok(Field { size: transform.size(), pass, real_bytes: size_of::<T>(), bands: None })
    }

    /// [`RowSample::field`] in the precision that the imager takes for this error.
    ///
    /// # Errors
    /// As [`Transform::new`].
    pub fn field_for(
        &self,
        grid: &SkyGrid,
        freq_hz: &[f64],
        extent: UvwExtent,
        (options, n_vis): (&GridOptions, Option<u64>),
    ) -> Result<Field> {
        if options.single_precision_suffices() {
            self.field::<f32>(grid, freq_hz, extent, (options, n_vis))
        } else {
            self.field::<f64>(grid, freq_hz, extent, (options, n_vis))
        }
    }
}

impl Outlook {
    /// Look at the header of a set and the baselines of some of its rows. With `visibilities` the set counts as one with so many of them, by more
    /// rows with the same baselines.
    ///
    /// # Errors
    /// An option is out of range, the source fails, or no size can be chosen.
    pub fn of(
        source: &mut dyn VisibilitySource,
        options: &ImagingOptions,
        visibilities: Option<f64>,
        observer: &dyn Observer,
    ) -> Result<(Self, RowSample)> {
        options.check()?;
        let header = source.header().clone();
        let freq_hz = header.spectrum.freq_hz();
        let channels = share(freq_hz.len(), options.channels_out)?;
        let (mut sample, parts) = sample(source)?;
        let found = (source.n_rows() * freq_hz.len()) as f64;
        let stretch = visibilities.map_or(1.0, |n| n / found);
        sample.factor *= stretch;
        let n_rows = (source.n_rows() as f64 * stretch).round() as u64;
        let (low, high) = header.spectrum.range_hz();
        let mut survey = Survey::new(freq_hz.len(), TotalPower::new(&header, options.pol));
        survey.extent = UvwExtent::of(sample.uvw_m.view());
        survey.phase_center = parts.iter().find_map(|p| p.phase_center.first()).map_or(0, |p| usize::from(*p));
        for uvw in sample.uvw_m.rows().into_iter().filter(|uvw| uvw.iter().any(|x| *x != 0.0)) {
            survey.see(uvw[0].hypot(uvw[1]) / SPEED_OF_LIGHT_M_S, (low, high));
        }
        if !survey.total_power.is_empty() {
            survey.total_power.used = ((1.0 - sample.used) * found) as u64;
        }
        let grid = choose_grid(&survey, &header, options, observer)?;
        let memory = options.memory;
        let kept = n_rows.saturating_mul((freq_hz.len() * REDUCED_BYTES) as u64) <= memory.kept_visibilities() as u64;
        let block_rows = rows_of_block(&header, memory.imaging_block(kept)) as u64;
        let range = channels[channels.len() / 2].clone();
        let of_channel = &freq_hz[range.clone()];
        let n_vis = ((n_rows as f64 * sample.used * range.len() as f64) as u64).min(LONG);
        let image = sample.field_for(&grid, of_channel, survey.extent, (&options.grid_options(), Some(n_vis)))?;
        let [side, _] = CORE_SIDES;
        let core = if grid.n_l > side && grid.n_m > side {
            let field = SkyGrid::new(side, side, grid.cell_rad, grid.frame.clone())?;
            Some(sample.field_for(&field, of_channel, survey.extent, (&options.grid_options(), Some(n_vis)))?)
        } else {
            None
        };
        let natural = options.weighting == Weighting::Natural;
        let tapered = options.taper.is_some() || options.inner_taper.is_some();
        let (width, height) = density_sides(&grid, options);
        let part = |reach_m: f64| (2.0 * reach_m * high / SPEED_OF_LIGHT_M_S * grid.cell_rad).min(1.0);
        let in_parts = survey.total_power.is_empty() && source.in_parts().is_some();
        let part_bytes = source.in_parts().map_or(0, |parts| parts.held_bytes()) as f64;
        let one_pass = in_parts && OnePass::of(source, options)?.is_some();
        let tile_work = if one_pass {
            Transform::<f32>::new(&grid, of_channel, survey.extent, &options.grid_options(), n_vis)?
                .work_of_tiles(sample.uvw_m.view(), sample.factor)?
        } else {
            Vec::new()
        };
        let outlook = Self {
            channels_out: channels.len(),
            processes: 1,
            shape: (n_rows, freq_hz.len(), header.polarizations.len()),
            used: sample.used,
            kept,
            in_parts,
            part_bytes,
            one_pass,
            tile_work,
            alike: in_parts && sample.used == 1.0 && weights_are_alike(source, options.unit_weights)?,
            memory,
            blocks: (block_rows, n_rows.div_ceil(block_rows.max(1))),
            weights: (!natural, !natural || tapered),
            density: (width, height / 2 + 1, part(survey.extent.u_m) * part(survey.extent.v_m)),
            image,
            core,
            uv_range_wl: survey.uv_range_wl,
            extent: survey.extent,
            grid,
        };
        Ok((outlook, sample))
    }

    /// Visibilities of the product that is imaged.
    #[must_use]
    pub fn visibilities(&self) -> f64 {
        self.shape.0 as f64 * self.shape.1 as f64
    }

    /// Pixels of one plane of the image.
    #[must_use]
    pub fn pixels(&self) -> f64 {
        self.grid.n_l as f64 * self.grid.n_m as f64
    }

    /// What a process has of the transform of a dirty image that is made while the set is read, and the work of the busiest over its fair share: `Some(None)` where
    /// it has all of it. `None` where no image is made so.
    #[must_use]
    pub fn planes_of_one_pass(&self) -> Option<Option<(BandSize, f64)>> {
        let (image, alone) = (&self.image, self.processes == 1);
        if !self.one_pass || (alone && image.size.groups > 1) {
            return None;
        }
        if alone || image.size.plane_bytes <= SMALL_PLANES as u64 {
            return Some(None);
        }
        image.size.by_owners(&self.tile_work, (self.grid.n_l, image.real_bytes), self.processes).map(Some)
    }

    /// The same set shared by so many processes.
    #[must_use]
    pub fn shared(&self, ranks: usize, memory: MemoryBudget) -> Self {
        let by = |n: u64| n.div_ceil(ranks.max(1) as u64);
        let mut own = self.clone();
        own.shape.0 = by(self.shape.0);
        own.processes = ranks.max(1);
        own.memory = memory;
        own.blocks.1 = own.shape.0.div_ceil(own.blocks.0.max(1));
        own.kept = own.shape.0.saturating_mul((own.shape.1 * REDUCED_BYTES) as u64) <= memory.kept_visibilities() as u64;
        let image = &mut own.image;
        image.bands = image
            .size
            .by_bands((self.grid.n_l, image.real_bytes), ranks)
            .filter(|_| own.kept && image.size.plane_bytes > SMALL_PLANES as u64);
        if image.bands.is_some() {
            image.size.groups = 1;
        }
        for field in std::iter::once(&mut own.image).chain(&mut own.core) {
            field.pass = field.pass.shared(ranks);
        }
        own
    }
}
