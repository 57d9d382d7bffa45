//! The nodes of the rows of a block in parts of rows, where they lie in letters to several processes.

use super::channels::compress;
use super::nodes::SetNodes;
use super::plan::Plan;
use super::real::Real;
use super::sort::{Chunk, Row, Span};
use num_complex::Complex;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

/// Nodes of some rows of a chunk that follow each other.
#[derive(Debug)]
struct Piece<'n, T> {
    /// First row, in the block and in the chunk.
    first: usize,
    first_of_chunk: usize,
    rows: &'n [Row],
    /// Which nodes each process has, in the order of the rows, and their places.
    to: Vec<(&'n [Span], &'n mut [Complex<T>])>,
}

/// The nodes of the rows of a block in parts of rows. Each part is set by one thread at a time.
#[derive(Debug)]
pub struct LetterParts<'n, T: Real> {
    plan: &'n Plan<T>,
    step: usize,
    places: Vec<Mutex<Vec<Piece<'n, T>>>>,
}

impl<'n, T: Real> LetterParts<'n, T> {
    /// Parts of `step` rows of these chunks. `spans` and `nodes` are what each process has of each chunk.
    pub(super) fn new(
        plan: &'n Plan<T>,
        (chunks, spans): (&'n [Chunk], &'n [Vec<Vec<Span>>]),
        nodes: Vec<Vec<&'n mut [Complex<T>]>>,
        step: usize,
    ) -> Self {
        let step = step.max(1);
        let n_rows = chunks.last().map_or(0, |c| c.range.end);
        let mut places: Vec<Vec<Piece<'n, T>>> = (0..n_rows.div_ceil(step)).map(|_| Vec::new()).collect();
        for ((chunk, spans), nodes) in chunks.iter().zip(spans).zip(nodes) {
            let mut rest: Vec<(&[Span], &mut [Complex<T>])> = spans.iter().map(Vec::as_slice).zip(nodes).collect();
            let mut first = chunk.range.start;
            while first < chunk.range.end {
                let end = ((first / step + 1) * step).min(chunk.range.end);
                let of_chunk = first - chunk.range.start..end - chunk.range.start;
                let take = |(spans, nodes): &mut (&'n [Span], &'n mut [Complex<T>])| {
                    let own = spans.split_off(..spans.partition_point(|s| (s.row as usize) < of_chunk.end)).unwrap_or_default();
                    (own, nodes.split_off_mut(..own.iter().map(Span::n_nodes).sum()).unwrap_or_default())
                };
                let to = rest.iter_mut().map(take).collect();
                places[first / step].push(Piece { first, first_of_chunk: of_chunk.start, rows: &chunk.rows[of_chunk.clone()], to });
                first = end;
            }
        }
        Self { plan, step, places: places.into_iter().map(Mutex::new).collect() }
    }
}

impl<T: Real> SetNodes<T> for LetterParts<'_, T> {
    fn set(&self, rows: Range<usize>, values: impl Fn(usize, &mut [Complex<T>])) {
        let Some(place) = self.places.get(rows.start / self.step) else { return };
        let zero = Complex::new(T::default(), T::default());
        let (mut vis, mut parts, mut nodes) = (vec![zero; self.plan.n_chan()], Vec::new(), Vec::new());
        for Piece { first, first_of_chunk, rows: of_piece, to } in place.lock().unwrap_or_else(PoisonError::into_inner).iter_mut() {
            let wanted =
                rows.start.clamp(*first, *first + of_piece.len()) - *first..rows.end.clamp(*first, *first + of_piece.len()) - *first;
            let Some(start) = of_piece[wanted.clone()].first().map(|row| row.offset) else { continue };
            nodes.clear();
            for (row, r) in of_piece[wanted.clone()].iter().zip(*first + wanted.start..) {
                let class = &self.plan.channels.classes[row.class];
                values(r - rows.start, &mut vis);
                nodes.resize(row.offset - start + class.n_nodes(), zero);
                compress(class, (&vis, &mut parts), &mut nodes[row.offset - start..]);
            }
            // The nodes of these rows are in the cache.
            for (spans, letter) in to {
                let mut rest = &mut letter[..];
                for span in *spans {
                    let place = rest.split_off_mut(..span.n_nodes()).unwrap_or_default();
                    let r = span.row as usize - *first_of_chunk;
                    if wanted.contains(&r) {
                        let at = of_piece[r].offset - start;
                        place.copy_from_slice(&nodes[at + span.lo as usize..at + span.hi as usize]);
                    }
                }
            }
        }
    }
}
