//! The B-tree of version 1 that finds chunks (section III.A.1 of the specification).

use super::raw::{Place, bytes, number};
use std::fs::File;
use std::ops::Range;

/// Nodes may be this many more than chunks.
const MORE_NODES: usize = 1024;
/// Size of the head of a node, bytes.
const HEAD: u64 = 24;

/// A B-tree while the chunks of some rows are looked up in it.
pub(super) struct Tree<'a> {
    file: &'a File,
    chunk: &'a [usize],
    /// Number of chunks on each axis.
    counts: &'a [usize],
    /// The chunks on the first axis that are wanted.
    groups: Range<usize>,
    all: Vec<Place>,
    /// Number of nodes that may still be visited.
    left: usize,
}

impl<'a> Tree<'a> {
    /// The places of `n` chunks: those in these groups along the first axis. `counts` are the numbers of chunks on each axis.
    pub(super) fn places(
        (file, root): (&'a File, u64),
        (chunk, counts): (&'a [usize], &'a [usize]),
        groups: Range<usize>,
        n: usize,
    ) -> Option<Vec<Place>> {
        let mut tree = Tree { file, chunk, counts, groups, all: vec![Place::default(); n], left: 2 * n + MORE_NODES };
        tree.visit(root, None)?;
        Some(tree.all)
    }

    /// Note the chunks below a node, which is below one of level `above`. `None` where the tree is not sound.
    fn visit(&mut self, address: u64, above: Option<u8>) -> Option<()> {
        self.left = self.left.checked_sub(1)?;
        let head = bytes(self.file, address, HEAD)?;
        let address = address.checked_add(HEAD)?;
        let (level, n) = (head[5], number(&head, 6, 2)?);
        // 1 is the kind of nodes of chunks.
        if head[..5] != *b"TREE\x01" || above.is_some_and(|above| level.checked_add(1) != Some(above)) {
            return None;
        }
        // A key: size and filters of a chunk, and its first element on every axis, with one axis more for the bytes of an element.
        let key = 8 + 8 * (self.chunk.len() + 1);
        let entry = key + 8;
        let body = bytes(self.file, address, n * entry as u64 + key as u64)?;
        for k in 0..usize::try_from(n).ok()? {
            let at = k * entry;
            let child = number(&body, at + key, 8)?;
            if level == 0 {
                self.note(&body[at..at + key], child)?;
                continue;
            }
            // What lies below is not before this key, and before the next.
            let row = |at: usize| number(&body, at + 8, 8).and_then(|n| usize::try_from(n).ok()).map(|n| n / self.chunk[0]);
            if row(at)? < self.groups.end && row(at + entry)? >= self.groups.start {
                self.visit(child, Some(level))?;
            }
        }
        Some(())
    }

    fn note(&mut self, key: &[u8], address: u64) -> Option<()> {
        let mut place = 0;
        for (k, (step, count)) in self.chunk.iter().zip(self.counts).enumerate() {
            let at = usize::try_from(number(key, 8 + 8 * k, 8)?).ok()?;
            let index = at / step;
            if at % step != 0 || index >= *count {
                return None;
            }
            if k == 0 {
                if !self.groups.contains(&index) {
                    return Some(());
                }
                place = index - self.groups.start;
            } else {
                place = place * count + index;
            }
        }
        let (bytes, skipped) = (number(key, 0, 4)? as u32, number(key, 4, 4)? as u32);
        let to = self.all.get_mut(place)?;
        if bytes == 0 || *to != Place::default() {
            return None;
        }
        *to = Place { address, bytes, skipped };
        Some(())
    }
}
