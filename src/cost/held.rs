//! The arrays that an image of a set holds in memory. The sizes are those of the code that makes the arrays.

use crate::fourier::{BandSize, good_size};
use crate::imaging::{Field, Outlook};

/// A visibility that stays in memory.
const VALUE: f64 = 8.0;
/// Its weight, where not all rows have the same.
const WEIGHT: f64 = 4.0;
/// Its imaging weight, where that differs.
const IMAGING: f64 = 4.0;
/// The uvw of a row.
const UVW: f64 = 24.0;
/// The coverage of a row while it is read: uvw, antennas, time, integration and phase centre.
pub(super) const COVERAGE: f64 = 50.0;
/// A value of a block of all products: visibility, weight, number of samples and flag.
const RAW: f64 = 17.0;
/// The place of a row on its way to another process.
const PART: f64 = 40.0;
/// A row that is sorted, without its runs.
const SORTED_ROW: f64 = 48.0;
/// The runs of a row while they are sorted, over those that are sorted: the keys of the runs, and their places on the grid once more.
const SORTING: f64 = 0.95;
/// A pixel in single and in double precision.
pub(super) const SINGLE: f64 = 4.0;
pub(super) const DOUBLE: f64 = 8.0;
/// What an outlook holds on so many threads.
#[derive(Clone, Copy)]
pub(super) struct Held<'a> {
    pub(super) outlook: &'a Outlook,
    pub(super) threads: usize,
}

impl Held<'_> {
    pub(super) fn rows(self) -> f64 {
        self.outlook.shape.0 as f64
    }

    fn block_rows(self) -> f64 {
        self.rows().min(self.outlook.blocks.0 as f64)
    }

    /// Blocks of all products that are in memory together: one is read while another is worked on.
    pub(super) fn raw(self) -> f64 {
        let (_, channels, products) = self.outlook.shape;
        let several = self.threads > 1 && self.outlook.blocks.1 > 1;
        let blocks = if several { 2.0 } else { 1.0 };
        blocks * self.block_rows() * (RAW * (channels * products) as f64 + COVERAGE)
    }

    /// A visibility and its weight in memory.
    fn value(self) -> f64 {
        VALUE + if self.outlook.alike { 0.0 } else { WEIGHT }
    }

    /// The reduced rows that stay in memory, with or without imaging weights.
    pub(super) fn data(self, weighed: bool) -> f64 {
        let o = self.outlook;
        let value = self.value() + if weighed && o.weights.1 { IMAGING } else { 0.0 };
        if o.kept { o.visibilities() * value + self.rows() * UVW } else { 0.0 }
    }

    /// What stays in memory of the rows of an image that is made while they are read: their places and weights.
    pub(super) fn weights_only(self) -> f64 {
        let o = self.outlook;
        if o.kept { o.visibilities() * (self.value() - VALUE) + self.rows() * UVW } else { 0.0 }
    }

    /// What is in memory while the rows of such an image are read and gridded, beside what stays and the planes. `traded`: their nodes are on their way to other
    /// processes.
    pub(super) fn reading_to_grid(self, traded: bool) -> f64 {
        let (o, field) = (self.outlook, &self.outlook.image);
        let ahead = if o.kept { self.rows() * COVERAGE } else { self.block_rows() * COVERAGE };
        let nodes = field.pass.nodes * 2.0 * field.real_bytes as f64;
        // The planes have taken the place of what the first block was sorted in, so that the next one takes new memory.
        let of_block = field.pass.sorted_bytes + SORTING * self.runs(field) + nodes;
        // While a process gets the nodes of a block, it still has what it gave of this block and of the next one.
        let of_trade = if traded { 2.0 * nodes + 3.0 * self.rows() * PART } else { 0.0 };
        ahead + self.of_file() + (of_block + of_trade) * self.block_rows() / self.rows().max(1.0)
    }

    /// What is in memory of a file while rows are read: chunks of which parts are gathered, or blocks.
    fn of_file(self) -> f64 {
        let o = self.outlook;
        if o.in_parts { o.part_bytes + self.block_rows() * COVERAGE } else { self.raw() }
    }

    /// What reading holds beside the rows that stay.
    pub(super) fn reading(self) -> f64 {
        let o = self.outlook;
        let reduced = if o.kept { 0.0 } else { self.block_rows() * (o.shape.1 as f64 * (self.value() + IMAGING) + UVW) };
        reduced + self.of_file()
    }

    /// What a later pass holds beside the rows that stay: nothing, or the blocks that are read again and the density that weighs them.
    pub(super) fn streaming(self) -> f64 {
        if self.outlook.kept {
            return 0.0;
        }
        let reduced = self.block_rows() * (self.outlook.shape.1 as f64 * (self.value() + IMAGING) + UVW);
        self.of_file() + reduced + self.density()
    }

    /// The cells of the density that visibilities touch.
    pub(super) fn density(self) -> f64 {
        let o = self.outlook;
        let (width, height, part) = o.density;
        if !o.weights.0 {
            return 0.0;
        }
        // The system gives memory in pages.
        (part * (width * height) as f64 * DOUBLE).min(o.visibilities() * 4096.0) * o.channels_out as f64
    }

    /// The rows in the order of the grid: of all blocks where they are kept, and otherwise of one.
    fn sorted(self, field: &Field) -> f64 {
        let all = field.pass.sorted_bytes;
        if self.outlook.kept { all.min(self.outlook.memory.sorted_rows() as f64) } else { all / self.outlook.blocks.1.max(1) as f64 }
    }

    /// What the transform to an image of so many bytes holds: its planes and the image, or those of a band, or the columns of a process and the image.
    pub(super) fn transform(self, field: &Field, image: f64) -> f64 {
        let of_bands = |b: BandSize| b.bytes.max(b.own_bytes + image / b.processes as f64 + image);
        field.bands.map_or(field.size.group_bytes as f64 + image, of_bands)
    }

    /// The bands by which residuals are made, and the bytes of the nodes of all rows, which are predicted before the first is gridded.
    pub(super) fn residual_bands(self) -> Option<(BandSize, f64)> {
        let image = &self.outlook.image;
        let nodes = image.pass.nodes * 2.0 * image.real_bytes as f64;
        image.bands.filter(|b| b.bytes + nodes <= 2.0 * image.size.plane_bytes as f64).map(|b| (b, nodes))
    }

    /// The nodes of one block.
    fn nodes(self, field: &Field) -> f64 {
        field.pass.nodes / self.outlook.blocks.1.max(1) as f64 * 2.0 * field.real_bytes as f64
    }

    /// Everything but planes and images in a pass with this field.
    pub(super) fn pass(self, field: &Field) -> f64 {
        self.data(true) + self.streaming() + self.sorted(field) + self.nodes(field)
    }

    /// Bytes of the runs of all rows.
    fn runs(self, field: &Field) -> f64 {
        (field.pass.sorted_bytes - SORTED_ROW * self.rows()).max(0.0)
    }

    /// What sorting a block holds beyond its sorted rows. Planes have no memory yet.
    pub(super) fn sorting_bytes(self, field: &Field) -> f64 {
        SORTING * self.runs(field) / self.outlook.blocks.1.max(1) as f64
    }

    /// Bytes of the sets of planes that stay in memory between passes, at most two.
    pub(super) fn planes_between(self, sets: f64) -> f64 {
        let (size, memory) = (&self.outlook.image.size, self.outlook.memory);
        let keep = memory.kept_planes_of(self.outlook.pixels() as usize) as f64;
        let planes = size.plane_bytes as f64;
        if self.outlook.image.bands.is_none() && size.groups == 1 && planes <= keep { sets * planes } else { 0.0 }
    }
}

/// Points of the padded transform of a convolution with a kernel that reaches so far, and the bytes of half of its spectrum and of its rows.
pub(super) fn convolution((n_l, n_m): (usize, usize), reach: usize, real_bytes: f64) -> (f64, f64, f64) {
    let (p_m, p_l) = (good_size(n_m + reach.min(n_m)), good_size(n_l + reach.min(n_l)));
    let half = (p_l / 2 + 1) as f64;
    (p_m as f64 * p_l as f64, half * p_m as f64 * 2.0 * real_bytes, half * n_m as f64 * 2.0 * real_bytes)
}
