//! The extensible array that finds chunks of a dataset whose first axis may grow (section VII.D of the specification).
//!
//! The first elements lie in an index block. The others lie in data blocks, which grow: super block k stands for 2^(k/2) data blocks of 2^((k+1)/2) times the
//! smallest number of elements. The index block has the addresses of the data blocks of the first super blocks, and of the other super blocks.

use super::header::ArrayAt;
use super::raw::{Place, bytes, number};
use std::fs::File;

/// An address that leads nowhere: of what was never written.
const NOWHERE: u64 = u64::MAX;
/// Size of the start of each block: signature, version, kind, and the address of the head.
const START: usize = 14;

/// An array while chunks are looked up in it.
pub(super) struct Array<'a> {
    file: &'a File,
    head: u64,
    /// 0 for chunks without filters, 1 for others.
    kind: u8,
    /// Size of an element, bytes.
    element: usize,
    /// Size of the numbers that say where a block begins.
    offset: usize,
    /// Elements in the index block, of the smallest data block, and of a page.
    first: usize,
    least: usize,
    page: usize,
    /// Number of super blocks whose data blocks the index block lists.
    direct: u32,
    /// Number of addresses of data blocks in the index block.
    listed: usize,
    index: Vec<u8>,
}

/// Some elements that lie one after the other.
struct Run {
    /// The first of them, and their number.
    from: usize,
    n: usize,
    /// Their bytes; `None` where they were never written.
    bytes: Option<Vec<u8>>,
}

impl<'a> Array<'a> {
    /// The places of `n` chunks from the one with the index `from` on. A chunk without filters has `length` bytes.
    pub(super) fn places((file, at): (&'a File, &ArrayAt), length: u32, from: usize, n: usize) -> Option<Vec<Place>> {
        let array = Self::open(file, at.address)?;
        let mut all = Vec::with_capacity(n);
        while all.len() < n {
            let next = from + all.len();
            let run = array.run(next)?;
            let count = (run.from + run.n - next).min(n - all.len());
            match run.bytes {
                None => all.resize(all.len() + count, Place::default()),
                Some(bytes) => {
                    let elements = bytes.chunks_exact(array.element).skip(next - run.from).take(count);
                    for element in elements {
                        all.push(array.place(element, length)?);
                    }
                }
            }
        }
        (all.len() == n).then_some(all)
    }

    fn open(file: &'a File, head: u64) -> Option<Self> {
        let start = bytes(file, head, 72)?;
        let kind = start[5];
        if start[..5] != *b"EAHD\0" || kind > 1 {
            return None;
        }
        let [element, bits, first, least, pointers, page_bits] = std::array::from_fn(|k| usize::from(start[6 + k]));
        let sizes = if kind == 0 { 8..=8 } else { 13..=20 };
        // The library writes powers of two, and lists the data blocks of at least one super block.
        if !sizes.contains(&element)
            || bits > 63
            || !least.is_power_of_two()
            || !pointers.is_power_of_two()
            || pointers < 2
            || page_bits > 16
        {
            return None;
        }
        let direct = 2 * pointers.ilog2();
        let supers = (1 + bits).checked_sub(least.ilog2() as usize)?;
        let listed = 2 * (pointers - 1);
        let others = supers.checked_sub(direct as usize)?;
        let size = START + first * element + 8 * (listed + others);
        let index = bytes(file, number(&start, 60, 8)?, size as u64)?;
        let offset = bits.div_ceil(8);
        let array = Self { file, head, kind, element, offset, first, least, page: 1 << page_bits, direct, listed, index };
        array.is_block(&array.index, b"EAIB").then_some(array)
    }

    /// True for the start of a block of this array.
    fn is_block(&self, bytes: &[u8], signature: &[u8; 4]) -> bool {
        bytes.starts_with(signature) && bytes.get(4..6) == Some(&[0, self.kind]) && number(bytes, 6, 8) == Some(self.head)
    }

    /// Elements that lie together with the one of this index.
    fn run(&self, index: usize) -> Option<Run> {
        let Some(rest) = index.checked_sub(self.first) else {
            let bytes = self.index.get(START..START + self.first * self.element)?;
            return Some(Run { from: 0, n: self.first, bytes: Some(bytes.to_vec()) });
        };
        let block = (rest / self.least + 1).ilog2();
        let (blocks, n) = (1_usize << (block / 2), self.least << block.div_ceil(2));
        // Elements before this super block.
        let before = ((1_usize << block) - 1) * self.least;
        let (of_block, within) = ((rest - before) / n, (rest - before) % n);
        let from = index - within;
        let (address, written) = if block < self.direct {
            // Data blocks before this super block.
            let earlier: usize = (0..block).map(|k| 1_usize << (k / 2)).sum();
            let at = START + self.first * self.element + 8 * (earlier + of_block);
            (number(&self.index, at, 8)?, Vec::new())
        } else {
            let at = START + self.first * self.element + 8 * (self.listed + (block - self.direct) as usize);
            let address = number(&self.index, at, 8)?;
            if address == NOWHERE {
                return Some(Run { from: index - (rest - before), n: blocks * n, bytes: None });
            }
            self.in_super_block(address, (of_block, blocks), n)?
        };
        if address == NOWHERE {
            return Some(Run { from, n, bytes: None });
        }
        let start = START + self.offset;
        if n <= self.page {
            let bytes = bytes(self.file, address, (start + n * self.element) as u64)?;
            let sound = self.is_block(&bytes, b"EADB");
            return sound.then(|| Run { from, n, bytes: Some(bytes[start..].to_vec()) });
        }
        // A large data block: its start with a checksum, and pages, each with a checksum.
        if !self.is_block(&bytes(self.file, address, start as u64)?, b"EADB") {
            return None;
        }
        let page = within / self.page;
        // The bits of the pages of all data blocks of a super block follow each other.
        let bit = of_block * (n / self.page) + page;
        if written.get(bit / 8)? & 0x80 >> (bit % 8) == 0 {
            return Some(Run { from: from + page * self.page, n: self.page, bytes: None });
        }
        let at = address.checked_add((start + 4 + page * (self.page * self.element + 4)) as u64)?;
        let bytes = bytes(self.file, at, (self.page * self.element) as u64)?;
        Some(Run { from: from + page * self.page, n: self.page, bytes: Some(bytes) })
    }

    /// The address of a data block of `n` elements, the one of this number among those of a super block, and bits for the pages that are written.
    fn in_super_block(&self, address: u64, (of_block, blocks): (usize, usize), n: usize) -> Option<(u64, Vec<u8>)> {
        let masks = if n > self.page { blocks * (n / self.page).div_ceil(8) } else { 0 };
        let start = START + self.offset;
        let bytes = bytes(self.file, address, (start + masks + 8 * blocks) as u64)?;
        let address = number(&bytes, start + masks + 8 * of_block, 8)?;
        let written = bytes[start..start + masks].to_vec();
        self.is_block(&bytes, b"EASB").then_some((address, written))
    }

    fn place(&self, element: &[u8], length: u32) -> Option<Place> {
        let address = number(element, 0, 8)?;
        if address == NOWHERE {
            return Some(Place::default());
        }
        if self.kind == 0 {
            return Some(Place { address, bytes: length, skipped: 0 });
        }
        let wide = self.element - 12;
        let stored = u32::try_from(number(element, 8, wide)?).ok().filter(|n| *n > 0)?;
        Some(Place { address, bytes: stored, skipped: number(element, 8 + wide, 4)? as u32 })
    }
}
