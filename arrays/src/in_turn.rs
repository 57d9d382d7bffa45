//! Rows that several processes make, and one writes.
//!
//! The processes make blocks in turn, or each its part of the rows. Process 0 writes them in the order of the rows, as one process would, into an
//! output that only it has. The others make their next block meanwhile, and wait with it until process 0 takes it, so that none piles up.

use crate::ranks::Ranks;
use crate::{Result, VisibilityBlock, VisibilitySink};
use std::sync::Arc;

/// The output of blocks that processes make in turn.
pub struct InTurn<'a> {
    ranks: Arc<dyn Ranks>,
    /// Only process 0 has one.
    sink: Option<&'a mut dyn VisibilitySink>,
    turn: usize,
}

impl<'a> InTurn<'a> {
    /// Block k, from 0, is made by process k modulo their number. The output of process 0 is `sink`; the others have none.
    #[must_use]
    pub fn new(ranks: Arc<dyn Ranks>, sink: Option<&'a mut dyn VisibilitySink>) -> Self {
        Self { ranks, sink, turn: 0 }
    }

    /// Number of processes.
    #[must_use]
    pub fn processes(&self) -> usize {
        self.ranks.size()
    }

    /// True if this process makes the next block.
    #[must_use]
    pub fn is_own(&self) -> bool {
        self.turn % self.ranks.size() == self.ranks.rank()
    }

    /// Pass on the next block, which the process that makes it gives. Process 0 writes it, and returns what it has written.
    ///
    /// # Errors
    /// An error of the sink.
    pub fn write(&mut self, own: Option<VisibilityBlock>) -> Result<Option<VisibilityBlock>> {
        let from = self.turn % self.ranks.size();
        self.turn += 1;
        let Some(sink) = &mut self.sink else {
            own.iter().for_each(|block| self.ranks.send(0, &block.to_bytes()));
            return Ok(None);
        };
        let block = match own {
            Some(block) => block,
            None => VisibilityBlock::from_bytes(&self.ranks.awaited(from))?,
        };
        sink.write_block(&block)?;
        Ok(Some(block))
    }
}

/// The output of the rows of all processes, each of which has a part of the rows, in their order.
///
/// Process 0 writes its own blocks at once, and those of the others when it finishes. `finish` must be called by all.
pub struct PartsSink {
    ranks: Arc<dyn Ranks>,
    /// Only process 0 has one.
    sink: Option<Box<dyn VisibilitySink>>,
}

impl PartsSink {
    /// The output of process 0 is `sink`; the others have none.
    #[must_use]
    pub fn new(ranks: Arc<dyn Ranks>, sink: Option<Box<dyn VisibilitySink>>) -> Self {
        Self { ranks, sink }
    }
}

impl VisibilitySink for PartsSink {
    fn write_block(&mut self, block: &VisibilityBlock) -> Result<()> {
        match &mut self.sink {
            Some(sink) => sink.write_block(block),
            None => {
                self.ranks.send(0, &block.to_bytes());
                Ok(())
            }
        }
    }

    fn finish(self: Box<Self>) -> Result<()> {
        self.finish_with_notes().map(drop)
    }

    fn finish_with_notes(self: Box<Self>) -> Result<Vec<String>> {
        let Self { ranks, sink } = *self;
        let Some(mut sink) = sink else {
            // No byte: there are no more blocks.
            ranks.send(0, &[]);
            return Ok(Vec::new());
        };
        for from in 1..ranks.size() {
            loop {
                let bytes = ranks.awaited(from);
                if bytes.is_empty() {
                    break;
                }
                sink.write_block(&VisibilityBlock::from_bytes(&bytes)?)?;
            }
        }
        sink.finish_with_notes()
    }
}
