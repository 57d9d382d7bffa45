//! The nodes of the rows of a block, which stay in memory while the rows are predicted and gridded by bands.

use super::channels::{ChannelClass, compress};
use super::gridder::{Gridder, turn_nodes};
use super::plan::Plan;
use super::real::Real;
use super::sort::Row;
use super::sorted_rows::{FoldedRows, SortedRows};
use crate::{ChainError, Result, ensure};
use num_complex::Complex;
use rayon::prelude::*;
use std::ops::{AddAssign, Range};
use std::sync::{Arc, Mutex, PoisonError};

/// The nodes of the rows of one block: the visibilities of few channels, which stand for those of all.
#[derive(Debug)]
pub struct Nodes<T: Real> {
    plan: Arc<Plan<T>>,
    /// Those of each chunk of rows.
    pub(super) chunks: Vec<Vec<Complex<T>>>,
}

impl<T: Real> Nodes<T> {
    pub(super) fn of(plan: Arc<Plan<T>>, rows: &FoldedRows) -> Self {
        let chunks = rows.chunks.iter().map(|c| plan.pool.take(c.n_nodes)).collect();
        Self { plan, chunks }
    }

    /// Check that they are nodes of these rows and of this plan.
    pub(super) fn check(&self, plan: &Plan<T>, rows: &FoldedRows) -> Result<()> {
        rows.check(plan)?;
        let same = self.plan.id == plan.id && self.chunks.iter().map(Vec::len).eq(rows.chunks.iter().map(|c| c.n_nodes));
        ensure!(same, ChainError::Incompatible("nodes of some rows were given for others".into()));
        Ok(())
    }

    /// Set the nodes of all rows to those of the same visibilities \[chan\].
    ///
    /// # Errors
    /// They are nodes of other rows.
    pub fn set_equal(&mut self, rows: &FoldedRows, vis: &[Complex<T>]) -> Result<()> {
        self.check(&self.plan, rows)?;
        let n_chan = self.plan.n_chan();
        ensure!(vis.len() == n_chan, ChainError::Incompatible(format!("{} channels for a transform of {n_chan}", vis.len())));
        let mut parts = Vec::new();
        let of_class = |class: &ChannelClass<T>| {
            let mut nodes = vec![Complex::new(T::default(), T::default()); class.n_nodes()];
            compress(class, (vis, &mut parts), &mut nodes);
            nodes
        };
        let classes: Vec<Vec<Complex<T>>> = self.plan.channels.classes.iter().map(of_class).collect();
        rows.chunks.par_iter().zip(&mut self.chunks).for_each(|(chunk, nodes)| {
            for row in &chunk.rows {
                let equal = &classes[row.class];
                nodes[row.offset..row.offset + equal.len()].copy_from_slice(equal);
            }
        });
        Ok(())
    }

    /// The nodes in parts of `step` rows, which may be set in any order and on any thread.
    ///
    /// # Errors
    /// They are nodes of other rows.
    pub fn in_parts<'n>(&'n mut self, rows: &'n FoldedRows, step: usize) -> Result<NodeParts<'n, T>> {
        self.check(&self.plan, rows)?;
        let step = step.max(1);
        let n_rows = rows.chunks.last().map_or(0, |c| c.range.end);
        let mut places: Vec<Vec<Piece<'n, T>>> = (0..n_rows.div_ceil(step)).map(|_| Vec::new()).collect();
        for (chunk, nodes) in rows.chunks.iter().zip(&mut self.chunks) {
            let (mut rest, mut first) = (nodes.as_mut_slice(), chunk.range.start);
            while first < chunk.range.end {
                let end = ((first / step + 1) * step).min(chunk.range.end);
                let of_chunk = first - chunk.range.start..end - chunk.range.start;
                let node_of = |row: usize| chunk.rows.get(row).map_or(chunk.n_nodes, |row| row.offset);
                let (start, n) = (node_of(of_chunk.start), node_of(of_chunk.end) - node_of(of_chunk.start));
                let (nodes, after) = rest.split_at_mut(n);
                places[first / step].push(Piece { first, rows: &chunk.rows[of_chunk], start, nodes });
                (rest, first) = (after, end);
            }
        }
        Ok(NodeParts { plan: &self.plan, step, places: places.into_iter().map(Mutex::new).collect() })
    }

    /// Change predicted visibilities: `turn` receives those of one row \[chan\] and replaces them by the values to be gridded. What it returns is summed.
    ///
    /// # Errors
    /// They are nodes of other rows.
    pub fn turn<S: Default + AddAssign + Send>(
        &mut self,
        rows: &SortedRows,
        turn: impl Fn(usize, &mut [Complex<T>]) -> S + Sync,
    ) -> Result<S> {
        self.check(&self.plan, rows)?;
        Ok(turn_nodes(&self.plan, rows, &mut self.chunks, turn))
    }
}

impl<T: Real> Gridder<T> {
    /// Add the nodes of sorted rows.
    ///
    /// # Errors
    /// The rows were sorted by another transform, or the nodes are those of other rows.
    pub fn add_nodes(&mut self, rows: &SortedRows, nodes: &Nodes<T>) -> Result<()> {
        nodes.check(&self.plan, rows)?;
        self.spread(rows, &nodes.chunks)
    }

    /// Add sorted rows that all have the same weighted visibilities \[chan\], as those of a beam where all rows have the same weights.
    ///
    /// # Errors
    /// The rows were sorted by another transform, or have another number of channels.
    pub fn add_equal(&mut self, rows: &SortedRows, vis: &[Complex<T>]) -> Result<()> {
        rows.check(&self.plan)?;
        let mut nodes = Nodes::of(Arc::clone(&self.plan), rows);
        nodes.set_equal(rows, vis)?;
        self.add_nodes(rows, &nodes)
    }
}

/// Nodes of some rows of a chunk that follow each other.
#[derive(Debug)]
struct Piece<'n, T: Real> {
    /// First row, in the block.
    first: usize,
    rows: &'n [Row],
    /// Index of the first node, in the chunk.
    start: usize,
    nodes: &'n mut [Complex<T>],
}

/// The nodes of the rows of a block in parts of rows. Each part is set by one thread at a time.
#[derive(Debug)]
pub struct NodeParts<'n, T: Real> {
    plan: &'n Plan<T>,
    step: usize,
    places: Vec<Mutex<Vec<Piece<'n, T>>>>,
}

/// The nodes of the rows of a block in parts of rows.
pub trait SetNodes<T: Real>: Sync {
    /// Set the nodes of rows that lie between two multiples of the step. `values` writes the weighted visibilities of a row, counted from the first of
    /// these, into a slice \[chan\].
    fn set(&self, rows: Range<usize>, values: impl Fn(usize, &mut [Complex<T>]));
}

impl<T: Real> SetNodes<T> for NodeParts<'_, T> {
    fn set(&self, rows: Range<usize>, values: impl Fn(usize, &mut [Complex<T>])) {
        let Some(place) = self.places.get(rows.start / self.step) else { return };
        let (mut vis, mut parts) = (vec![Complex::new(T::default(), T::default()); self.plan.n_chan()], Vec::new());
        for piece in place.lock().unwrap_or_else(PoisonError::into_inner).iter_mut() {
            for (r, row) in (piece.first..).zip(piece.rows).filter(|(r, _)| rows.contains(r)) {
                let class = &self.plan.channels.classes[row.class];
                values(r - rows.start, &mut vis);
                let first = row.offset - piece.start;
                compress(class, (&vis, &mut parts), &mut piece.nodes[first..first + class.n_nodes()]);
            }
        }
    }
}

impl<T: Real> Drop for Nodes<T> {
    fn drop(&mut self) {
        self.plan.pool.give(std::mem::take(&mut self.chunks));
    }
}
