//! The stages that every image of a set has, and those of `dirty`, `beam` and `grid`.

use super::held::{DOUBLE, Held, SINGLE};
use super::stage::{Forecast, Stage};
use super::term::Term;
use crate::imaging::{Field, Outlook};

/// The format of the visibilities.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InputFormat {
    /// UVH5.
    Uvh5,
    /// UVFITS.
    Uvfits,
    /// A Measurement Set.
    Ms,
}

impl InputFormat {
    pub(super) fn term(self) -> Term {
        match self {
            Self::Uvh5 => Term::ReadUvh5,
            Self::Uvfits => Term::ReadUvfits,
            Self::Ms => Term::ReadMs,
        }
    }
}

/// Bytes of a value in a file: a complex number, its number of samples and its flag, which hardly take anything.
const STORED: f64 = 8.0;
/// Bytes of the columns of a row in a file.
const STORED_ROW: f64 = 80.0;

impl Held<'_> {
    fn values(self) -> f64 {
        self.outlook.visibilities() * self.outlook.shape.2 as f64
    }

    /// Bytes of the files that a pass reads.
    pub(super) fn file(self) -> f64 {
        self.values() * STORED + self.outlook.shape.0 as f64 * STORED_ROW
    }

    /// The start of the program.
    pub(super) fn start(self) -> Stage {
        Stage::new("start", 0.0).doing([(Term::Command, 1.0)])
    }

    /// The first pass, which reads and reduces the set.
    pub(super) fn read(self, format: InputFormat) -> Stage {
        let stage = Stage::new("read", self.data(false) + self.reading());
        Stage { read_bytes: self.file(), ..stage }.doing([(format.term(), self.values()), (Term::ReadRow, self.outlook.shape.0 as f64)])
    }

    /// The values that a later pass reads again.
    fn again(self) -> (Term, f64) {
        (Term::Again, if self.outlook.kept { 0.0 } else { self.values() })
    }

    /// What a later pass over the weights reads again: of rows with the same weights only their places.
    fn weights_again(self) -> (Term, f64) {
        (Term::Again, if self.outlook.alike { 0.0 } else { self.again().1 })
    }

    /// Bytes of the files that such a pass reads.
    fn file_again(self) -> f64 {
        match (self.outlook.kept, self.outlook.alike) {
            (true, _) => 0.0,
            (false, true) => self.rows() * STORED_ROW,
            (false, false) => self.file(),
        }
    }

    /// The density, the factor of each of its cells, and the weights.
    pub(super) fn weigh(self) -> Stage {
        let (n, (_, _, part)) = (self.outlook.visibilities(), self.outlook.density);
        let cells = part * (self.outlook.density.0 * self.outlook.density.1) as f64 * self.outlook.channels_out as f64;
        let density = if self.outlook.weights.0 { 1.0 } else { 0.0 };
        let passes = density + if self.outlook.weights.1 { 1.0 } else { 0.0 };
        let bytes = (self.data(false) + 2.0 * self.density()).max(self.data(true) + self.density());
        let stage = Stage::new("weights", bytes + if self.outlook.kept { 0.0 } else { self.streaming() - self.density() });
        let again = self.weights_again();
        Stage { read_bytes: passes * self.file_again(), summed_bytes: self.density(), ..stage }.doing([
            (Term::Density, density * n),
            (Term::Cell, density * cells),
            (Term::Weigh, if self.outlook.weights.1 { n } else { 0.0 }),
            (again.0, passes * again.1),
        ])
    }

    /// Sorting: once for all passes where the order is kept.
    pub(super) fn sorting(self, field: &Field, passes: f64) -> (Term, f64) {
        let stays = self.outlook.kept && field.pass.sorted_bytes <= self.outlook.memory.sorted_rows() as f64;
        let times = if stays { passes.min(1.0) } else { passes };
        (Term::Sort, times * field.pass.nodes * self.outlook.channels_out as f64)
    }

    /// Blocks with which groups of planes are each made again.
    fn remade(self, field: &Field) -> f64 {
        if field.size.groups > 1 { self.outlook.blocks.1 as f64 } else { 1.0 }
    }

    /// `passes` passes from visibilities to an image.
    pub(super) fn gridded(self, field: &Field, passes: f64) -> Vec<(Term, f64)> {
        let n = passes * self.outlook.channels_out as f64;
        let (p, s, groups) = (&field.pass, &field.size, field.size.groups as f64);
        let wide = field.real_bytes as f64 / SINGLE;
        let (points, logs) = field.bands.map_or((s.points, s.point_logs), |b| (b.points, b.point_logs));
        vec![
            (Term::Fill, n * p.visibilities),
            (Term::Row, n * self.rows()),
            (Term::Fold, n * p.channel_multiply_adds * wide),
            (Term::Node, n * p.nodes * groups),
            (Term::Spread, n * p.grid_multiply_adds * wide * p.idle.at(self.threads)),
            (Term::ToImage, n * logs * self.remade(field) * wide),
            (Term::ToImagePoint, n * points * self.remade(field) * wide),
            (self.again().0, n * self.again().1),
        ]
    }

    /// `passes` passes from an image to visibilities.
    pub(super) fn predicted(self, field: &Field, passes: f64) -> Vec<(Term, f64)> {
        let n = passes * self.outlook.channels_out as f64;
        let (p, s, groups) = (&field.pass, &field.size, field.size.groups as f64);
        let wide = field.real_bytes as f64 / SINGLE;
        let (points, logs) = self.residual_bands().map_or((s.points, s.point_logs), |(b, _)| (b.points, b.point_logs));
        vec![
            (Term::Subtract, n * p.visibilities),
            (Term::RowBack, n * self.rows()),
            (Term::Unfold, n * p.channel_multiply_adds * wide),
            (Term::NodeBack, n * p.nodes * groups),
            (Term::Gather, n * p.grid_multiply_adds * wide * p.idle.at(self.threads)),
            (Term::FromImage, n * logs * self.remade(field) * wide),
            (Term::FromImagePoint, n * points * self.remade(field) * wide),
        ]
    }

    /// Bytes of one image with all output channels.
    pub(super) fn plane(self, pixel: f64) -> f64 {
        self.outlook.pixels() * pixel
    }

    /// An image or a beam on a field, with its sorting. `beside` are the bytes that are held beside it.
    pub(super) fn imaged(self, name: &'static str, field: &Field, (sorts, beside): (bool, f64)) -> Stage {
        let pixels = if field == &self.outlook.image { self.outlook.pixels() } else { 0.0 };
        // A transform in double precision is rounded to an image in single precision.
        let image = pixels * if field.real_bytes == 8 { SINGLE + DOUBLE } else { SINGLE };
        let stage = Stage::new(name, self.pass(field) + self.transform(field, image).max(self.sorting_bytes(field)) + beside);
        let read_bytes = if self.outlook.kept { 0.0 } else { self.file() };
        let sorting = if sorts { vec![self.sorting(field, 1.0)] } else { Vec::new() };
        let summed_bytes = summed(field, pixels * SINGLE, 1.0);
        Stage { read_bytes, summed_bytes, ..stage }.doing(sorting).doing(self.gridded(field, 1.0))
    }

    /// A beam on a field. Rows with the same weights have the same visibilities, which are folded once.
    pub(super) fn beam(self, field: &Field, beside: f64) -> Stage {
        let equal = self.outlook.alike && !self.outlook.weights.1;
        let mut stage = Stage { read_bytes: self.file_again(), ..self.imaged("beam", field, (true, beside)) };
        stage.work.retain(|(term, _)| match term {
            Term::Fill | Term::Fold => !equal,
            Term::Again => !self.outlook.alike,
            _ => true,
        });
        stage
    }

    /// Residuals of models: from the image, minus the data, and back. `beside` are the images that are held beside the passes.
    pub(super) fn residuals(self, passes: f64, beside: f64) -> Stage {
        let field = &self.outlook.image;
        let planes = field.size.plane_bytes as f64;
        let (image, columns) = (self.plane(field.real_bytes as f64), field.size.column_bytes as f64);
        // The buffers of the columns are kept for the next model, as far as they may.
        let kept_columns = (field.size.column_buffers as f64).min(self.outlook.memory.kept_buffers() as f64);
        let result = image + kept_columns;
        let at_once = if field.size.groups > 1 {
            // Planes in groups serve one direction after the other, and the corrected model stays meanwhile.
            image + (planes + result.max(columns)).max(self.plane(DOUBLE))
        } else {
            let model = self.plane(DOUBLE) + columns + planes.max(self.planes_between(2.0));
            model.max(2.0 * planes + kept_columns).max(planes.max(self.planes_between(2.0)) + result)
        };
        let held = self.residual_bands().map_or(at_once, |(b, nodes)| {
            let model = self.plane(DOUBLE) + b.own_bytes;
            model.max(nodes + b.own_bytes + b.bytes).max(nodes + self.transform(field, image))
        });
        let stage = Stage::new("major cycles", self.pass(field) + beside + held);
        let read_bytes = if self.outlook.kept { 0.0 } else { passes * self.file() };
        let resort = self.sorting(field, passes);
        let sorted_before = self.sorting(field, 1.0).1;
        let again = if resort.1 > sorted_before { resort.1 } else { 0.0 };
        let transforms = if self.residual_bands().is_some() { 2.0 } else { 1.0 };
        let summed_bytes = passes * summed(field, self.plane(SINGLE), transforms);
        Stage { read_bytes, summed_bytes, ..stage }
            .doing([(resort.0, again)])
            .doing(self.predicted(field, passes))
            .doing(self.gridded(field, passes))
    }

    /// Writing so many images.
    pub(super) fn write(self, images: f64, bytes: f64) -> Stage {
        let pixels = images * self.outlook.pixels() * self.outlook.channels_out as f64;
        Stage { whole: true, ..Stage::new("write", bytes) }.doing([(Term::WritePixel, pixels)])
    }
}

/// The bytes that processes would sum as doubles where they sum images of so many bytes. By bands they exchange the columns of each of some `transforms` instead,
/// and pieces of the image: once, and as they are, so that a byte takes a quarter of the time.
fn summed(field: &Field, image: f64, transforms: f64) -> f64 {
    field.bands.map_or(image, |b| (transforms * b.all_bytes + image) / 4.0)
}

/// Bytes of a FITS file of so many images.
pub(super) fn fits(outlook: &Outlook, images: f64) -> f64 {
    images * (outlook.pixels() * outlook.channels_out as f64 * SINGLE + 11_520.0)
}

/// The forecast of a dirty image: its restoring beam is fitted in a small field first.
#[must_use]
pub fn dirty(outlook: &Outlook, format: InputFormat, threads: usize) -> Forecast {
    let held = Held { outlook, threads };
    if let Some(shared) = outlook.planes_of_one_pass() {
        return held.in_one_pass(format, shared);
    }
    let beam = held.beam(outlook.core.as_ref().unwrap_or(&outlook.image), 0.0);
    let sorts = outlook.core.is_some();
    let image = held.imaged("image", &outlook.image, (sorts, (outlook.channels_out - 1) as f64 * held.plane(SINGLE)));
    let written = held.pass(&outlook.image) + held.planes_between(1.0) + held.plane(SINGLE) * outlook.channels_out as f64;
    Forecast {
        stages: vec![held.start(), held.read(format), held.weigh(), beam, image, held.write(1.0, written)],
        output_bytes: fits(outlook, 1.0),
        groups_of_planes: outlook.image.size.groups,
        assumptions: Vec::new(),
    }
}

/// The forecast of gridded visibilities: a sum in double precision, a weight and a count for each cell.
#[must_use]
pub fn grid(outlook: &Outlook, format: InputFormat, threads: usize) -> Forecast {
    const CELL: f64 = 28.0;
    let held = Held { outlook, threads };
    let cells = outlook.pixels() * outlook.channels_out as f64;
    let stage = Stage::new("cells", held.data(true) + held.streaming() + CELL * cells);
    let read_bytes = if outlook.kept { 0.0 } else { held.file() };
    let stage = Stage { read_bytes, ..stage }.doing([(Term::Put, outlook.visibilities()), held.again(), (Term::WriteCell, cells)]);
    Forecast { stages: vec![held.start(), held.read(format), held.weigh(), stage], output_bytes: CELL * cells, ..Forecast::default() }
}

/// The forecast of a beam.
#[must_use]
pub fn beam(outlook: &Outlook, format: InputFormat, threads: usize) -> Forecast {
    let held = Held { outlook, threads };
    let image = held.beam(&outlook.image, (outlook.channels_out - 1) as f64 * held.plane(SINGLE));
    let written = held.pass(&outlook.image) + held.planes_between(1.0) + held.plane(SINGLE) * outlook.channels_out as f64;
    Forecast {
        stages: vec![held.start(), held.read(format), held.weigh(), image, held.write(1.0, written)],
        output_bytes: fits(outlook, 1.0),
        groups_of_planes: outlook.image.size.groups,
        assumptions: Vec::new(),
    }
}
