//! Nodes of rows on their way to the processes that grid them.
//!
//! The nodes of a row are cut where their tiles belong to another process. Each part travels with the place of its row, so that the process that gets it can
//! sort it as if it had read the row itself. Messages consist of words of 8 bytes, so that their nodes are gridded where they lie.

use super::nodes::Nodes;
use super::owners::Owners;
use super::plan::Plan;
use super::real::{Real, fused};
use super::sort::{Chunk, Row, Span, tile_of};
use super::sorted_rows::{MOST_CHUNKS, SortedRows};
use crate::{ChainError, Result, ensure};
use bytemuck::{Pod, Zeroable, cast_slice, cast_slice_mut};
use cittert_arrays::Ranks;
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
pub type Given<T> = (SortedRows, Nodes<T>, T);

/// The rows and nodes that a process grids: its own, and those that it got from others.
pub(super) struct Traded<T: Real> {
    pub(super) rows: SortedRows,
    own: Option<Nodes<T>>,
    got: Vec<u64>,
    /// Where the nodes of each chunk lie that others gave.
    places: Vec<Range<usize>>,
}

impl<T: Real> Traded<T> {
    /// The nodes of each chunk.
    pub(super) fn nodes(&self) -> Vec<&[Complex<T>]> {
        let own = self.own.iter().flat_map(|nodes| &nodes.chunks).map(Vec::as_slice);
        own.chain(self.places.iter().map(|at| cast_slice(&self.got[at.clone()]))).collect()
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

/// Give the nodes of folded rows to the processes that own their tiles, and get those of the tiles of this process. All processes call it together. One that has no
/// rows left gives none.
///
/// # Errors
/// The nodes are those of other rows, or a message is damaged.
pub(super) fn trade<T: Real>(plan: &Plan<T>, owners: &Owners, given: Option<Given<T>>, ranks: &dyn Ranks) -> Result<Traded<T>> {
    let (mut chunks, mut own) = (Vec::new(), None);
    if let Some((rows, mut nodes, factor)) = given {
        nodes.check(plan, &rows)?;
        if factor != T::one() {
            nodes.chunks.par_iter_mut().flatten().for_each(|v| *v = v.scale(factor));
        }
        (chunks, own) = (rows.chunks, Some(nodes));
    }
    let of_each: Vec<Vec<Vec<Span>>> = chunks.par_iter().map(|chunk| spans(plan, owners, chunk)).collect();
    let nodes = own.as_ref().map_or(&[][..], |nodes| &nodes.chunks);
    let (message, lengths) = message(owners, (&chunks, nodes), &of_each);
    let (got, lengths) = ranks.trade(message, &lengths);
    let cut_own = |(chunk, spans): (Chunk, Vec<Vec<Span>>)| Chunk::of_spans(plan, chunk.rows, chunk.n_nodes, &spans[owners.rank()]);
    let mut made = chunks.into_par_iter().zip(of_each).map(cut_own).collect::<Result<Vec<_>>>()?;
    let (mut pieces, mut first) = (Vec::new(), 0);
    for length in lengths {
        pieces.extend(pieces_of::<T>(&got, first..first + length, MOST_CHUNKS.div_ceil(owners.size()))?);
        first += length;
    }
    made.par_extend(pieces.par_iter().map(|(parts, _)| chunk_of(plan, parts)).collect::<Result<Vec<_>>>()?);
    let places = pieces.into_iter().map(|(_, nodes)| nodes).collect();
    Ok(Traded { rows: SortedRows::of_chunks(plan, made), own, got, places })
}

/// What this process gives to each other one, in words, and how many words that are.
fn message<T: Real>(
    owners: &Owners,
    (chunks, nodes): (&[Chunk], &[Vec<Complex<T>>]),
    of_each: &[Vec<Vec<Span>>],
) -> (Vec<u64>, Vec<usize>) {
    let to = |process: usize| of_each.iter().filter(move |_| process != owners.rank()).map(move |spans| &spans[process]);
    let n_nodes = |spans: &[Span]| spans.iter().map(Span::n_nodes).sum::<usize>();
    let counts = |process: usize| (to(process).map(Vec::len).sum::<usize>(), to(process).map(|s| n_nodes(s)).sum::<usize>());
    let length = |process: usize| {
        let (parts, nodes) = counts(process);
        if process == owners.rank() { 0 } else { COUNTS + parts * PART + nodes * node::<T>() }
    };
    let lengths: Vec<usize> = (0..owners.size()).map(length).collect();
    let mut all = vec![0; lengths.iter().sum()];
    let mut rest = &mut all[..];
    let mut take = |n: usize| rest.split_off_mut(..n).unwrap_or_default();
    let mut places: Vec<(usize, &[Span], &mut [u64])> = Vec::new();
    let mut node_places: Vec<&mut [u64]> = Vec::new();
    for process in (0..owners.size()).filter(|process| *process != owners.rank()) {
        let (parts, nodes) = counts(process);
        take(COUNTS).copy_from_slice(&[parts as u64, nodes as u64]);
        to(process).enumerate().for_each(|(chunk, spans)| places.push((chunk, spans, take(spans.len() * PART))));
        to(process).for_each(|spans| node_places.push(take(n_nodes(spans) * node::<T>())));
    }
    places.into_par_iter().zip(node_places).for_each(|((chunk, spans, parts), mut to)| {
        let (chunk, nodes) = (&chunks[chunk], &nodes[chunk]);
        for (span, part) in spans.iter().zip(cast_slice_mut::<u64, Part>(parts)) {
            let row = &chunk.rows[span.row as usize];
            *part = Part { uvw: row.uvw, class: row.class as u32, lo: span.lo, hi: span.hi, conjugate: u32::from(row.conjugate) };
            let own: &[u64] = cast_slice(&nodes[row.node(span.lo as usize)..row.node(span.hi as usize)]);
            to.split_off_mut(..own.len()).unwrap_or_default().copy_from_slice(own);
        }
    });
    (all, lengths)
}

/// The parts of a message that lies `at` some words, divided among at most `most` chunks, with the words of their nodes.
fn pieces_of<T: Real>(words: &[u64], at: Range<usize>, most: usize) -> Result<Vec<(&[Part], Range<usize>)>> {
    let message = words.get(at.clone()).ok_or_else(damaged)?;
    let Some(([n_parts, n_nodes], rest)) = message.split_first_chunk::<COUNTS>() else {
        // A process gives nothing to itself.
        return if message.is_empty() { Ok(Vec::new()) } else { Err(damaged()) };
    };
    let words = (*n_parts as usize).checked_mul(PART).ok_or_else(damaged)?;
    let (parts, nodes) = rest.split_at_checked(words).ok_or_else(damaged)?;
    let parts: &[Part] = cast_slice(parts);
    let count = |parts: &[Part]| parts.iter().map(|p| p.hi.saturating_sub(p.lo) as usize).sum::<usize>();
    ensure!(count(parts) == *n_nodes as usize && count(parts) * node::<T>() == nodes.len(), damaged());
    let mut first = at.end - nodes.len();
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

/// About how long the nodes of some rows take in each row of tiles, times `each`.
pub(super) fn add_work_of_tiles<T: Real>(plan: &Plan<T>, rows: &SortedRows, each: f64, sums: &mut [f64]) {
    let (half, below, period) = (plan.table.support as f64 / 2.0, plan.below() as f64, plan.nv as f64);
    let costs: Vec<f64> = (0..=plan.planes().max(plan.slab_depth())).map(|planes| each * plan.node_cost(planes)).collect();
    for row in rows.chunks.iter().flat_map(|chunk| &chunk.rows) {
        for f in &plan.channels.classes[row.class].freq_hz {
            if let Some(sum) = sums.get_mut(tile_of(row.uvw[1] * f, half, below, period).0) {
                *sum += costs[plan.planes_of(row.uvw[2] * f)];
            }
        }
    }
}
