//! Simulations of many rows, block by block, by one process or by several in turn.

use super::engine::Simulator;
use super::scene_noise::integrations;
use crate::progress::{Event, Observer};
use crate::{ChainError, Result, ensure};
use cittert_arrays::{Alone, InTurn, UvCoverage, VisibilitySink};
use std::ops::Range;
use std::sync::Arc;

/// Fewest rows that a process simulates at once.
const FEWEST: usize = 64;

/// The numbers of rows and visibilities of a simulation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Summary {
    /// Rows written.
    pub rows: u64,
    /// Visibilities written.
    pub visibilities: u64,
    /// Visibilities among these that are flagged because they lie outside the grid of the mask.
    pub flagged: u64,
}

impl Simulator<'_> {
    /// Simulate all rows of an iterator and write them to a sink. The caller opens the sink with [`Simulator::header`] and finishes it. The
    /// observer receives `total_rows` for its estimate of the remaining time.
    ///
    /// # Errors
    /// As [`Simulator::block`]; also if the iterator or the sink fails, or the observer asks to stop.
    pub fn run(
        &mut self,
        rows: &mut dyn Iterator<Item = cittert_arrays::Result<UvCoverage>>,
        total_rows: Option<u64>,
        sink: &mut dyn VisibilitySink,
        observer: &dyn Observer,
    ) -> Result<Summary> {
        self.run_in_turn(rows, total_rows, &mut InTurn::new(Arc::new(Alone), Some(sink)), observer)
    }

    /// As [`Simulator::run`], by processes in turn, all of which have the same rows. Noise and visibilities are those of one process. The numbers are those
    /// of all rows in process 0, and 0 in the others.
    ///
    /// # Errors
    /// As [`Simulator::run`].
    pub fn run_in_turn(
        &mut self,
        rows: &mut dyn Iterator<Item = cittert_arrays::Result<UvCoverage>>,
        total_rows: Option<u64>,
        turns: &mut InTurn<'_>,
        observer: &dyn Observer,
    ) -> Result<Summary> {
        let per_row = (self.header.spectrum.n_chan() * self.header.polarizations.len()) as u64;
        observer.event(Event::Phase { name: "simulating", total: total_rows.map(|n| n * per_row), unit: "vis" });
        let (mut summary, mut first_row) = (Summary::default(), 0);
        for coverage in rows {
            let coverage = coverage?;
            for rows in self.passes(&coverage) {
                if turns.processes() > 1 {
                    self.cover(&coverage.rows(rows.clone())?, observer)?;
                }
                for rows in self.shares(rows, turns.processes()) {
                    ensure!(!observer.cancelled(), ChainError::Cancelled);
                    let own = if turns.is_own() { Some(self.block(coverage.rows(rows.clone())?, first_row, observer)?) } else { None };
                    first_row += rows.len() as u64;
                    if let Some(block) = turns.write(own)? {
                        summary.rows += rows.len() as u64;
                        summary.visibilities += block.vis.len() as u64;
                        summary.flagged += block.flags.iter().filter(|f| **f).count() as u64;
                        observer.event(Event::Advance(block.vis.len() as u64));
                    }
                }
            }
        }
        observer.event(Event::Done);
        if summary.flagged > 0 {
            observer.event(Event::Warning(&format!(
                "{} of {} visibilities lie outside the Fourier grid of the scene and are flagged: use smaller cells",
                summary.flagged, summary.visibilities
            )));
        }
        Ok(summary)
    }

    /// The rows of a pass, divided among processes. The noise of an integration may be drawn together.
    fn shares(&self, rows: Range<usize>, processes: usize) -> Vec<Range<usize>> {
        if processes == 1 || self.scene_noise.is_some() {
            return vec![rows];
        }
        let step = rows.len().div_ceil(processes).max(FEWEST);
        rows.clone().step_by(step).map(|start| start..(start + step).min(rows.end)).collect()
    }

    /// The rows that are simulated together: as many as fit, or those of an integration, whose noise is drawn together.
    fn passes(&self, coverage: &UvCoverage) -> Vec<Range<usize>> {
        if self.scene_noise.is_some() {
            return integrations(&coverage.time_jd);
        }
        let (n, step) = (coverage.n_rows(), self.rows_in_a_pass());
        (0..n).step_by(step).map(|start| start..(start + step).min(n)).collect()
    }

    fn rows_in_a_pass(&self) -> usize {
        let values: usize = self.freq_hz.iter().map(Vec::len).sum::<usize>()
            + 2 * self.header.spectrum.n_chan() * self.basis.len().max(self.header.polarizations.len());
        (self.memory.simulated_block() / (16 * values)).max(1)
    }
}
