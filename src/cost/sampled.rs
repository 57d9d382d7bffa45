//! The stages of `simulate` and `predict`: the visibilities of images and lists of sources.

use super::held::{DOUBLE, SINGLE};
use super::stage::{Forecast, Stage};
use super::term::Term;
use super::traced::Traced;
use super::waves::Waves;
use crate::imaging::Field;

/// A value of a block: visibility, weight, number of samples and flag.
pub(super) const RAW: f64 = 17.0;
/// A value while it is simulated: its sum in double precision.
const SUM: f64 = 16.0;
/// A row of the whole observation: the output keeps little more than the number of its time and its antennas.
const ROW: f64 = 3.0;
/// Buffers of an output that is written block after block, once they are full.
pub(super) const WRITER: f64 = 12e6;
/// A row of a block: its coverage three times over.
const COVERAGES: f64 = 150.0;
/// Bytes of a value and of the columns of a row in a file. Weights and flags that are alike take almost nothing.
pub(super) const STORED: f64 = 8.05;
pub(super) const STORED_ROW: f64 = 100.0;

/// What is simulated or predicted.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SampledWork {
    /// Rows.
    pub rows: f64,
    /// Channels, with their sub-channels, and products.
    pub channels: f64,
    /// Channels that are written.
    pub channels_out: f64,
    /// Products.
    pub products: f64,
    /// Rows of a block.
    pub block_rows: f64,
    /// The transform of a plane of the scene and a pass over all rows with it, and the number of planes; none without an image.
    pub image: Option<(Field, f64)>,
    /// Pixels of a plane of the scene.
    pub pixels: f64,
    /// Sources of a list.
    pub sources: f64,
    /// Pixels of a scene that is summed exactly, each like a source.
    pub exact: f64,
    /// Spherical waves from the images and the sources of a scene near the array, and how many points each has; none in the far field.
    pub near: Vec<(Waves, f64)>,
}

impl SampledWork {
    /// The same for so many of the rows.
    #[must_use]
    pub fn of_rows(&self, rows: f64) -> Self {
        let part = rows / self.rows.max(1.0);
        let image = self.image.map(|(field, planes)| (Field { pass: field.pass.part(part), ..field }, planes));
        Self { rows, image, near: self.near.clone(), ..*self }
    }

    fn values(&self) -> f64 {
        self.rows * self.channels_out * self.products
    }

    fn stage(&self, name: &'static str) -> Stage {
        let values = self.values();
        let block = self.block_rows.min(self.rows);
        let per_block = block * (self.channels * SUM * self.products + self.channels_out * self.products * RAW)
            + self.rows * ROW
            // What was written before the last block lies in the buffers.
            + WRITER * (1.0 - block / self.rows.max(1.0));
        let scene = self.image.as_ref().map_or(0.0, |(field, planes)| {
            let s = &field.size;
            let nodes = field.pass.nodes * block / self.rows.max(1.0) * 2.0 * field.real_bytes as f64;
            planes * (s.plane_bytes as f64 + self.pixels * DOUBLE) + s.column_bytes as f64 + nodes
        });
        let mut stage = Stage::new(name, per_block + scene + self.pixels * (SINGLE + DOUBLE));
        if let Some((field, planes)) = &self.image {
            let (p, s, wide) = (&field.pass, &field.size, field.real_bytes as f64 / SINGLE);
            stage = stage.doing([
                (Term::Sort, planes * p.nodes),
                (Term::Subtract, planes * p.visibilities),
                (Term::Unfold, planes * p.channel_multiply_adds * wide),
                (Term::NodeBack, planes * p.nodes),
                (Term::Gather, planes * p.grid_multiply_adds * wide),
                (Term::FromImage, planes * s.point_logs * wide),
                (Term::FromImagePoint, planes * s.points * wide),
            ]);
        }
        stage.doing([
            (Term::Simulate, values),
            (Term::Turn, (self.sources + self.exact) * self.rows),
            (Term::Source, (self.sources + self.exact) * self.rows * self.channels),
            (Term::WriteValue, values),
            (Term::WriteRow, self.rows),
        ])
    }

    fn output(&self) -> f64 {
        self.values() * STORED + self.rows * STORED_ROW
    }
}

/// The forecast of a simulation of a scene whose image takes so much.
#[must_use]
pub fn simulate(work: &SampledWork, scene: &Traced) -> Forecast {
    let start = Stage::new("start", 0.0).doing([(Term::Command, 1.0)]);
    let bytes = scene.bytes.max(work.pixels * (SINGLE + DOUBLE));
    let scene = Stage { timed_s: scene.setup_s + scene.trace_s, ..Stage::new("scene", bytes) };
    let mut stages = vec![start, scene];
    stages.extend(work.near.iter().map(|(waves, points)| waves.simulated(*points)));
    stages.push(work.stage("simulate"));
    Forecast { stages, output_bytes: work.output(), ..Forecast::default() }
}

/// The forecast of a prediction on the rows of a set in this format.
#[must_use]
pub fn predict(work: &SampledWork, format: super::InputFormat) -> Forecast {
    let mut forecast = simulate(work, &Traced::default());
    let read =
        Stage { read_bytes: work.output(), ..Stage::new("read", work.block_rows.min(work.rows) * work.channels_out * work.products * RAW) };
    forecast.stages.insert(1, read.doing([(format.term(), work.values()), (Term::ReadRow, work.rows)]));
    if let Some(last) = forecast.stages.last_mut() {
        last.name = "predict";
        last.bytes += work.block_rows.min(work.rows) * (work.channels_out * work.products * RAW + COVERAGES);
    }
    forecast
}
