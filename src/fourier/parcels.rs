//! Nodes of rows on their way to the processes that grid them.
//!
//! The nodes of a row are cut where their tiles belong to another process. Each part travels with the place of its row, so that the process that gets it can
//! sort it as if it had read the row itself. Messages consist of words of 8 bytes, so that their nodes are gridded where they lie.

use super::nodes::Nodes;
use super::owners::Owners;
use super::plan::Plan;
use super::real::{Real, fused};
use super::sort::{Chunk, Row, Span, tile_of};
use super::sorted_rows::{FoldedRows, MOST_CHUNKS, SortedRows};
use crate::{ChainError, Result, ensure};
use bytemuck::{Pod, Zeroable, cast_slice, cast_slice_mut};
use cittert_arrays::{Gifts, Ranks};
use num_complex::Complex;
use rayon::prelude::*;
use std::ops::Range;

/// Some nodes of a row.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Part {
    /// Cells along u and v and wavelengths along w, per Hz.
    uvw: [f64; 3],
    /// The class of the channels of the row, and its first node and the one after its last.
    class: u32,
    lo: u32,
    hi: u32,
    /// 1 if the grid holds the conjugate of the visibilities.
    conjugate: u32,
}

/// Words of a part, of a node, and of the numbers of parts and nodes at the front of a message.
const PART: usize = size_of::<Part>() / size_of::<u64>();
const COUNTS: usize = 2;
const fn node<T>() -> usize {
    size_of::<Complex<T>>() / size_of::<u64>()
}

/// Fewest parts of a chunk that is not the last of its message.
const LEAST: usize = 256;

/// Rows that are folded, their nodes, and by what these are multiplied first.
pub type Given<T> = (FoldedRows, Nodes<T>, T);

/// The rows and nodes that a process grids: its own, and those that it got from others.
pub(super) struct Traded {
    pub(super) rows: SortedRows,
    /// The messages of all processes, and where the nodes of each chunk lie in them.
    messages: Vec<Vec<u64>>,
    places: Vec<(usize, Range<usize>)>,
}

impl Traded {
    /// The nodes of each chunk.
    pub(super) fn nodes<T: Real>(&self) -> Vec<&[Complex<T>]> {
        self.places.iter().map(|(from, at)| cast_slice(&self.messages[*from][at.clone()])).collect()
    }
}

/// The nodes of the rows of a chunk that each process grids.
#[inline(always)]
fn spans_of_each<T: Real>(plan: &Plan<T>, owners: &Owners, chunk: &Chunk) -> Vec<Vec<Span>> {
    let mut spans = vec![Vec::new(); owners.size()];
    let (half, below, period) = (plan.table.support as f64 / 2.0, plan.below() as f64, plan.nv as f64);
    // The tiles of nodes in the order of their frequencies follow each other, so that few of them need be known.
    let in_order: Vec<bool> =
        plan.channels.classes.iter().map(|c| c.freq_hz.is_sorted() || c.freq_hz.is_sorted_by(|a, b| a >= b)).collect();
    for (row, number) in chunk.rows.iter().zip(0..) {
        let freq = &plan.channels.classes[row.class].freq_hz;
        let tile = |k: usize| tile_of(row.uvw[1] * freq[k], half, below, period).0;
        let last = tile(freq.len() - 1);
        let mut lo = 0;
        while lo < freq.len() {
            let first = tile(lo);
            let run = owners.run(first);
            let hi = match in_order[row.class] {
                true if run.contains(&last) => freq.len(),
                true => first_outside(lo + 1..freq.len(), |k| run.contains(&tile(k))),
                false => (lo + 1..freq.len()).find(|k| !run.contains(&tile(*k))).unwrap_or(freq.len()),
            };
            spans[owners.of(first)].push(Span { row: number, lo: lo as u32, hi: hi as u32 });
            lo = hi;
        }
    }
    spans
}

/// The first number that is not inside, where all that follow it are not inside either.
#[inline(always)]
fn first_outside(numbers: Range<usize>, inside: impl Fn(usize) -> bool) -> usize {
    let Range { start: mut low, end: mut high } = numbers;
    while low < high {
        let middle = low + (high - low) / 2;
        if inside(middle) { low = middle + 1 } else { high = middle }
    }
    low
}

// As for the cutting of rows: the machine rounds numbers by an instruction.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn spans_avx2<T: Real>(plan: &Plan<T>, owners: &Owners, chunk: &Chunk) -> Vec<Vec<Span>> {
    spans_of_each(plan, owners, chunk)
}

fn spans<T: Real>(plan: &Plan<T>, owners: &Owners, chunk: &Chunk) -> Vec<Vec<Span>> {
    #[cfg(target_arch = "x86_64")]
    if fused() {
        // SAFETY: the machine has just been found to have AVX2 and FMA.
        return unsafe { spans_avx2(plan, owners, chunk) };
    }
    spans_of_each(plan, owners, chunk)
}

/// Begin to give the nodes of folded rows to the processes that own their tiles; this one gives itself a message too. All processes call it as often. One that has no
/// rows left gives none.
///
/// # Errors
/// The nodes are those of other rows.
pub(super) fn give<T: Real>(plan: &Plan<T>, owners: &Owners, given: Option<Given<T>>, ranks: &dyn Ranks) -> Result<Gifts> {
    let Some((rows, mut nodes, factor)) = given else { return Ok(ranks.give(vec![Vec::new(); owners.size()])) };
    nodes.check(plan, &rows)?;
    if factor != T::one() {
        nodes.chunks.par_iter_mut().flatten().for_each(|v| *v = v.scale(factor));
    }
    let of_each: Vec<Vec<Vec<Span>>> = rows.chunks.par_iter().map(|chunk| spans(plan, owners, chunk)).collect();
    let message = |process: usize| message((&rows.chunks, &nodes.chunks), &of_each, process);
    Ok(ranks.give((0..owners.size()).map(message).collect()))
}

/// Get the nodes of the tiles of this process.
///
/// # Errors
/// A message is damaged.
pub(super) fn got<T: Real>(plan: &Plan<T>, gifts: Gifts, ranks: &dyn Ranks) -> Result<Traded> {
    let messages = ranks.got(gifts);
    let (mut pieces, mut places) = (Vec::new(), Vec::new());
    for (from, words) in messages.iter().enumerate() {
        for (parts, nodes) in pieces_of::<T>(words, MOST_CHUNKS.div_ceil(messages.len()))? {
            pieces.push(parts);
            places.push((from, nodes));
        }
    }
    let made = pieces.par_iter().map(|parts| chunk_of(plan, parts)).collect::<Result<Vec<_>>>()?;
    Ok(Traded { rows: SortedRows::of_chunks(plan, made), messages, places })
}

/// What this process gives to one, in words.
fn message<T: Real>((chunks, nodes): (&[Chunk], &[Vec<Complex<T>>]), of_each: &[Vec<Vec<Span>>], process: usize) -> Vec<u64> {
    let n_nodes = |spans: &[Span]| spans.iter().map(Span::n_nodes).sum::<usize>();
    let spans = || of_each.iter().map(|of_chunk| &of_chunk[process]);
    let (n_parts, n_all) = (spans().map(Vec::len).sum::<usize>(), spans().map(|s| n_nodes(s)).sum::<usize>());
    let mut all = vec![0; COUNTS + n_parts * PART + n_all * node::<T>()];
    let mut rest = &mut all[..];
    let mut take = |n: usize| rest.split_off_mut(..n).unwrap_or_default();
    take(COUNTS).copy_from_slice(&[n_parts as u64, n_all as u64]);
    let parts: Vec<&mut [u64]> = spans().map(|spans| take(spans.len() * PART)).collect();
    let node_places: Vec<&mut [u64]> = spans().map(|spans| take(n_nodes(spans) * node::<T>())).collect();
    let sources: Vec<_> = chunks.iter().zip(nodes).zip(spans()).collect();
    sources.into_par_iter().zip(parts).zip(node_places).for_each(|((((chunk, nodes), spans), parts), mut to)| {
        for (span, part) in spans.iter().zip(cast_slice_mut::<u64, Part>(parts)) {
            let row = &chunk.rows[span.row as usize];
            *part = Part { uvw: row.uvw, class: row.class as u32, lo: span.lo, hi: span.hi, conjugate: u32::from(row.conjugate) };
            let own: &[u64] = cast_slice(&nodes[row.node(span.lo as usize)..row.node(span.hi as usize)]);
            to.split_off_mut(..own.len()).unwrap_or_default().copy_from_slice(own);
        }
    });
    all
}

/// The parts of a message, divided among at most `most` chunks, with the words of their nodes.
fn pieces_of<T: Real>(message: &[u64], most: usize) -> Result<Vec<(&[Part], Range<usize>)>> {
    let Some(([n_parts, n_nodes], rest)) = message.split_first_chunk::<COUNTS>() else {
        // A process that has no rows left sends nothing.
        return if message.is_empty() { Ok(Vec::new()) } else { Err(damaged()) };
    };
    let words = (*n_parts as usize).checked_mul(PART).ok_or_else(damaged)?;
    let (parts, nodes) = rest.split_at_checked(words).ok_or_else(damaged)?;
    let parts: &[Part] = cast_slice(parts);
    let count = |parts: &[Part]| parts.iter().map(|p| p.hi.saturating_sub(p.lo) as usize).sum::<usize>();
    ensure!(count(parts) == *n_nodes as usize && count(parts) * node::<T>() == nodes.len(), damaged());
    let mut first = message.len() - nodes.len();
    let each = parts.len().div_ceil(most.max(1)).max(LEAST);
    let divide = |parts| {
        let start = first;
        first += count(parts) * node::<T>();
        (parts, start..first)
    };
    Ok(parts.chunks(each).map(divide).collect())
}

/// The rows of the parts of a message as a chunk, with the keys of its runs.
fn chunk_of<T: Real>(plan: &Plan<T>, parts: &[Part]) -> Result<(Chunk, Vec<u64>)> {
    let (mut rows, mut spans, mut n_nodes) = (Vec::with_capacity(parts.len()), Vec::with_capacity(parts.len()), 0_usize);
    for (Part { uvw, class, lo, hi, conjugate }, number) in parts.iter().zip(0..) {
        let class_nodes = plan.channels.classes.get(*class as usize).map_or(0, |class| class.n_nodes());
        ensure!(lo < hi && *hi as usize <= class_nodes, damaged());
        let offset = n_nodes.wrapping_sub(*lo as usize);
        rows.push(Row { uvw: *uvw, class: *class as usize, offset, conjugate: *conjugate != 0 });
        let span = Span { row: number, lo: *lo, hi: *hi };
        n_nodes += span.n_nodes();
        spans.push(span);
    }
    Chunk::of_spans(plan, rows, n_nodes, &spans)
}

fn damaged() -> ChainError {
    ChainError::Internal("a message from another process does not have the nodes that it should".into())
}
