//! Nodes of rows on their way to the processes that grid them.
//!
//! The nodes of a row are cut where their tiles belong to another process. Each part travels with the place of its row, so that the process that gets it can
//! sort it as if it had read the row itself. Messages consist of words of 8 bytes, so that their nodes are gridded where they lie.

use super::letter_parts::LetterParts;
use super::owners::Owners;
use super::plan::Plan;
use super::real::{Real, fused};
use super::sort::{Chunk, Row, Span, tile_of};
use super::sorted_rows::{FoldedRows, MOST_CHUNKS, SortedRows};
use crate::{ChainError, Result, ensure};
use bytemuck::{Pod, Zeroable, cast_slice, cast_slice_mut};
use cittert_arrays::Letters;
use num_complex::Complex;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;

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

/// The rows and nodes that a process grids: its own, and those that it got from others.
pub(super) struct Traded<'a, T> {
    pub(super) rows: SortedRows,
    /// The nodes of each chunk.
    pub(super) nodes: Vec<&'a [Complex<T>]>,
}

/// Some parts of a letter, and their nodes.
type Piece<'a, T> = (&'a [Part], &'a [Complex<T>]);

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

/// Letters for the nodes of folded rows, to the processes that own their tiles; this one has a letter for itself too. Nodes are written where they lie in the
/// letters, so that they need no other memory.
#[derive(Debug)]
pub struct OpenLetters<T: Real> {
    plan: Arc<Plan<T>>,
    rows: FoldedRows,
    /// Of each chunk, the nodes of its rows that each process grids.
    spans: Vec<Vec<Vec<Span>>>,
    pub(super) letters: Letters,
}

impl<T: Real> OpenLetters<T> {
    /// Letters in the memory of others that have arrived. The nodes have any value.
    ///
    /// # Errors
    /// The rows were folded by another transform.
    pub(super) fn new(plan: Arc<Plan<T>>, owners: &Owners, rows: FoldedRows, mut letters: Letters) -> Result<Self> {
        rows.check(&plan)?;
        let spans: Vec<Vec<Vec<Span>>> = rows.chunks.par_iter().map(|chunk| self::spans(&plan, owners, chunk)).collect();
        let of = |process: usize| spans.iter().map(move |of_chunk| &of_chunk[process][..]);
        letters.set_lengths((0..owners.size()).map(|process| words::<T>(of(process))));
        for (process, letter) in letters.each_mut().enumerate() {
            write_parts::<T>(&rows.chunks, &of(process).collect::<Vec<_>>(), letter);
        }
        Ok(Self { plan, rows, spans, letters })
    }

    /// The nodes in parts of `step` rows, which may be set in any order and on any thread.
    pub fn in_parts(&mut self, step: usize) -> LetterParts<'_, T> {
        let mut rest: Vec<&mut [Complex<T>]> = self.letters.each_mut().map(|letter| nodes_mut(letter)).collect();
        let nodes_of = |of_chunk: &Vec<Vec<Span>>| {
            let taken = rest.iter_mut().zip(of_chunk).map(|(rest, spans)| rest.split_off_mut(..n_nodes(spans)).unwrap_or_default());
            taken.collect::<Vec<_>>()
        };
        let nodes = self.spans.iter().map(nodes_of).collect();
        LetterParts::new(&self.plan, (&self.rows.chunks, &self.spans), nodes, step)
    }

    /// Multiply the nodes.
    pub(super) fn scale(&mut self, factor: T) {
        let of_letters: Vec<&mut [Complex<T>]> = self.letters.each_mut().map(|letter| nodes_mut(letter)).collect();
        of_letters.into_par_iter().flatten().for_each(|v| *v = v.scale(factor));
    }
}

/// The nodes of a letter whose parts have been written.
fn nodes_mut<T: Real>(letter: &mut [u64]) -> &mut [Complex<T>] {
    let n_parts = letter[0] as usize;
    cast_slice_mut(&mut letter[COUNTS + n_parts * PART..])
}

/// The nodes of the tiles of this process, from the letters that it gave and those that it got.
///
/// # Errors
/// A letter is damaged.
pub(super) fn traded<'a, T: Real>(plan: &Plan<T>, (given, got): (&'a Letters, &'a Letters), owners: &Owners) -> Result<Traded<'a, T>> {
    let (mut pieces, mut nodes) = (Vec::new(), Vec::new());
    for from in 0..owners.size() {
        let letter = if from == owners.rank() { given } else { got }.of(from);
        for (parts, of_parts) in pieces_of(letter, MOST_CHUNKS.div_ceil(owners.size()))? {
            pieces.push(parts);
            nodes.push(of_parts);
        }
    }
    let made = pieces.par_iter().map(|parts| chunk_of(plan, parts)).collect::<Result<Vec<_>>>()?;
    Ok(Traded { rows: SortedRows::of_chunks(plan, made), nodes })
}

fn n_nodes(spans: &[Span]) -> usize {
    spans.iter().map(Span::n_nodes).sum()
}

/// The length of a letter with these spans of each chunk, words.
fn words<'s, T>(spans: impl Iterator<Item = &'s [Span]>) -> usize {
    COUNTS + spans.map(|spans| spans.len() * PART + n_nodes(spans) * node::<T>()).sum::<usize>()
}

/// Write a letter with these spans of each chunk, but for its nodes.
fn write_parts<T>(chunks: &[Chunk], spans: &[&[Span]], letter: &mut [u64]) {
    let n_parts = spans.iter().map(|spans| spans.len()).sum::<usize>();
    let (head, rest) = letter.split_at_mut(COUNTS);
    head.copy_from_slice(&[n_parts as u64, (rest.len() - n_parts * PART) as u64 / node::<T>() as u64]);
    let mut rest = cast_slice_mut::<u64, Part>(&mut rest[..n_parts * PART]);
    let places: Vec<&mut [Part]> = spans.iter().map(|spans| rest.split_off_mut(..spans.len()).unwrap_or_default()).collect();
    chunks.par_iter().zip(spans).zip(places).for_each(|((chunk, spans), parts)| {
        for (span, part) in spans.iter().zip(parts) {
            let row = &chunk.rows[span.row as usize];
            *part = Part { uvw: row.uvw, class: row.class as u32, lo: span.lo, hi: span.hi, conjugate: u32::from(row.conjugate) };
        }
    });
}

/// The parts of a letter, divided among at most `most` chunks, with their nodes.
fn pieces_of<T: Real>(letter: &[u64], most: usize) -> Result<Vec<Piece<'_, T>>> {
    let Some(([n_parts, n_nodes], rest)) = letter.split_first_chunk::<COUNTS>() else {
        // A process that has no rows left sends nothing.
        return if letter.is_empty() { Ok(Vec::new()) } else { Err(damaged()) };
    };
    let words = (*n_parts as usize).checked_mul(PART).ok_or_else(damaged)?;
    let (parts, nodes) = rest.split_at_checked(words).ok_or_else(damaged)?;
    let parts: &[Part] = cast_slice(parts);
    let count = |parts: &[Part]| parts.iter().map(|p| p.hi.saturating_sub(p.lo) as usize).sum::<usize>();
    ensure!(count(parts) == *n_nodes as usize && count(parts) * node::<T>() == nodes.len(), damaged());
    let mut rest: &[Complex<T>] = cast_slice(nodes);
    let each = parts.len().div_ceil(most.max(1)).max(LEAST);
    let divide = |parts| (parts, rest.split_off(..count(parts)).unwrap_or_default());
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
