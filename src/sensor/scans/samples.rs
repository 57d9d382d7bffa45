//! The samples of an image: a block of detectors that steps over rows and columns.

use ndarray::Array2;

/// Rows and columns of samples, and when which detector takes each of them.
#[derive(Debug, Clone)]
pub(in crate::sensor) struct Samples {
    /// Number of rows: those of the image, and more where lines are arcs.
    pub(in crate::sensor) rows: usize,
    /// Number of columns: those of the image.
    pub(in crate::sensor) columns: usize,
    /// Rows and columns of the block of detectors.
    block: (usize, usize),
    /// Time of a sample, s.
    pub(in crate::sensor) dwell_s: f64,
    /// Time from one position of the block to the next along a line, and from line to line, s.
    period_s: (f64, f64),
    /// What the block moves along columns and rows during a sample, in samples.
    pub(in crate::sensor) moved: (f64, f64),
    /// How far each column of a line lies below its middle, in samples \[column\]; empty for straight lines.
    pub(in crate::sensor) sag: Vec<f64>,
}

impl Samples {
    /// A block of detectors over rows and columns of samples, line after line, in the frame time and its part in which detectors look.
    pub(super) fn stepped((rows, columns): (usize, usize), block: (usize, usize), frame_s: f64, efficiency: f64) -> Self {
        let (down, across) = (rows.div_ceil(block.0), columns.div_ceil(block.1));
        let line_s = frame_s / down as f64;
        let dwell_s = line_s * efficiency / across as f64;
        Self { rows, columns, block, dwell_s, period_s: (dwell_s, line_s), moved: (0.0, 0.0), sag: Vec::new() }
    }

    /// Number of detectors.
    pub(in crate::sensor) fn detectors(&self) -> usize {
        self.block.0 * self.block.1
    }

    /// The detector of a sample.
    pub(in crate::sensor) fn detector(&self, row: usize, column: usize) -> usize {
        (row % self.block.0) * self.block.1 + column % self.block.1
    }

    /// Time from the begin of the frame to that of a sample, s.
    pub(in crate::sensor) fn start_s(&self, row: usize, column: usize) -> f64 {
        (row / self.block.0) as f64 * self.period_s.1 + (column / self.block.1) as f64 * self.period_s.0
    }

    /// Time from the begin of the frame to the middle of a sample, s.
    pub(in crate::sensor) fn middle_s(&self, row: usize, column: usize) -> f64 {
        self.start_s(row, column) + 0.5 * self.dwell_s
    }

    /// The samples of a detector in the order of time.
    pub(in crate::sensor) fn of_detector(&self, detector: usize) -> impl Iterator<Item = (usize, usize)> + '_ {
        let (row, column) = (detector / self.block.1, detector % self.block.1);
        let rows = (row..self.rows).step_by(self.block.0);
        rows.flat_map(move |r| (column..self.columns).step_by(self.block.1).map(move |c| (r, c)))
    }

    /// The image of samples: where lines are arcs, the mean of the two lines around each pixel, weighted by their distance.
    pub(in crate::sensor) fn gridded(&self, samples: Array2<f64>, rows: usize) -> Array2<f64> {
        self.mixed(samples, rows, |w| w)
    }

    /// Variances of the pixels from those of independent samples.
    pub(in crate::sensor) fn gridded_variance(&self, samples: Array2<f64>, rows: usize) -> Array2<f64> {
        self.mixed(samples, rows, |w| w * w)
    }

    fn mixed(&self, samples: Array2<f64>, rows: usize, power: fn(f64) -> f64) -> Array2<f64> {
        if self.sag.is_empty() {
            return samples;
        }
        Array2::from_shape_fn((rows, self.columns), |(r, c)| {
            let line = (r as f64 + self.sag[c]).min((self.rows - 1) as f64);
            let below = line.floor() as usize;
            let part = line - below as f64;
            let at = |row: usize| samples[[row.min(self.rows - 1), c]];
            power(1.0 - part) * at(below) + power(part) * at(below + 1)
        })
    }
}
