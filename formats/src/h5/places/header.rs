//! The index of the chunks of a dataset, from its object header.

use super::raw::{SIGNATURE, bytes, number};
use std::fs::File;

/// Most blocks of an object header.
const MOST_BLOCKS: usize = 64;

/// Where an index begins, and what its parts need.
pub(super) enum Index {
    /// The root of a B-tree of version 1.
    Tree(u64),
    Array(ArrayAt),
}

/// The head of an extensible array.
pub(super) struct ArrayAt {
    pub(super) address: u64,
}

/// True where addresses count from the first byte of the file and have 64 bits.
pub(super) fn plain(file: &File) -> Option<bool> {
    let head = bytes(file, 0, 48)?;
    let (widths, base) = match head[8] {
        0 => (13, 24),
        1 => (13, 28),
        2 | 3 => (9, 12),
        _ => return None,
    };
    Some(head[..8] == *SIGNATURE && head[widths] == 8 && head[widths + 1] == 8 && number(&head, base, 8)? == 0)
}

/// The index in the layout message of the object header at this address, if the chunks are as the library says.
pub(super) fn index_of(file: &File, address: u64, of: (&[usize], usize)) -> Option<Index> {
    let head = bytes(file, address, 64)?;
    let newer = head[..4] == *b"OHDR";
    // The head of a message: its kind and size, flags, and in newer headers perhaps its place among the others.
    let (first, of_message) = if newer {
        let flags = usize::from(head[5]);
        let (at, wide) = (6 + 16 * (flags >> 5 & 1) + 4 * (flags >> 4 & 1), 1 << (flags & 3));
        ((address.checked_add((at + wide) as u64)?, number(&head, at, wide)?), 4 + 2 * (flags >> 2 & 1))
    } else if head[0] == 1 {
        ((address.checked_add(16)?, number(&head, 8, 4)?), 8)
    } else {
        return None;
    };
    let mut blocks = vec![first];
    for k in 0..MOST_BLOCKS {
        let (from, n) = *blocks.get(k)?;
        let block = bytes(file, from, n)?;
        let mut rest = &block[..];
        while rest.len() >= of_message {
            let (kind, n) = if newer { (rest[0].into(), number(rest, 1, 2)?) } else { (number(rest, 0, 2)?, number(rest, 2, 2)?) };
            let end = of_message + usize::try_from(n).ok()?;
            let body = rest.get(of_message..end)?;
            match kind {
                8 => return layout(body, of),
                // Continuation. Newer blocks have a signature and a checksum.
                16 => {
                    let (at, n) = (number(body, 0, 8)?, number(body, 8, 8)?);
                    blocks.push(if newer { (at.checked_add(4)?, n.checked_sub(8)?) } else { (at, n) });
                }
                _ => {}
            }
            rest = &rest[end..];
        }
    }
    None
}

/// The index of a layout message.
fn layout(body: &[u8], (chunk, size): (&[usize], usize)) -> Option<Index> {
    let same = |from: usize, wide: usize| {
        let sides = chunk.iter().chain([&size]).enumerate();
        sides.into_iter().all(|(k, n)| number(body, from + wide * k, wide) == Some(*n as u64))
    };
    let axes = chunk.len() + 1;
    match *body.first_chunk::<5>()? {
        // Of chunks, in version 3: the number of axes, the address, and the sides of a chunk.
        [3, 2, n, ..] if usize::from(n) == axes && same(11, 4) => number(body, 3, 8).map(Index::Tree),
        // In version 4: no special treatment of chunks at the edge; number of axes; size of the sides; the sides; kind 4 with five numbers that are in its head too.
        [4, 2, 0, n, wide] if usize::from(n) == axes && (1..=8).contains(&wide) && same(5, wide.into()) => {
            let at = 5 + usize::from(wide) * axes;
            let address = number(body, at + 6, 8)?;
            (body.get(at) == Some(&4)).then_some(Index::Array(ArrayAt { address }))
        }
        _ => None,
    }
}
