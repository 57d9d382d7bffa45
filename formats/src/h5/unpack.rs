//! The filters of an HDF5 chunk, undone: from the bytes in the file to the values, in a buffer of known size.
//!
//! The HDF5 library does not compare the output of a filter with the size of the chunk. Where a damaged or hostile chunk gives less, the
//! library reads beyond its buffer.

use flate2::{Decompress, FlushDecompress, Status};
use hdf5::filters::Filter;
use std::borrow::Cow;

/// The filters of a dataset in the order of writing.
pub(super) struct Pipeline {
    steps: Vec<Step>,
}

#[derive(Clone, Copy, PartialEq)]
enum Step {
    Deflate,
    Lzf,
    Shuffle,
    Fletcher32,
}

/// Size of the checksum at the end of a chunk, bytes.
const CHECKSUM: usize = 4;

impl Pipeline {
    /// `None` where there is no filter, or a filter that only the library knows.
    pub(super) fn of(filters: &[Filter]) -> Option<Self> {
        let step = |f: &Filter| match f {
            Filter::Deflate(_) => Some(Step::Deflate),
            Filter::LZF => Some(Step::Lzf),
            Filter::Shuffle => Some(Step::Shuffle),
            Filter::Fletcher32 => Some(Step::Fletcher32),
            _ => None,
        };
        let steps: Vec<Step> = filters.iter().map(step).collect::<Option<_>>()?;
        // Between two of these filters the size of the data is not known.
        let compressors = steps.iter().filter(|s| matches!(s, Step::Deflate | Step::Lzf)).count();
        (!steps.is_empty() && compressors < 2).then_some(Self { steps })
    }

    /// No filters.
    pub(super) fn none() -> Self {
        Self { steps: Vec::new() }
    }

    /// True where the bytes in the file are the values.
    pub(super) fn is_empty(&self) -> bool {
        self.steps.is_empty()
    }

    /// Largest size in the file of a chunk of `length` bytes.
    pub(super) fn most_stored(length: usize) -> usize {
        length.saturating_mul(2).saturating_add(4096)
    }

    /// Unpack a chunk of `length` bytes with elements of `size` bytes, in empty memory. A filter whose bit is set in `skipped` was not applied.
    pub(super) fn unpack(
        &self,
        (stored, skipped): (&[u8], u32),
        (size, length): (usize, usize),
        mut memory: Vec<u8>,
    ) -> Result<Vec<u8>, String> {
        let mut bytes = Cow::Borrowed(stored);
        for (k, step) in self.steps.iter().enumerate().rev() {
            if k < 32 && skipped >> k & 1 == 1 {
                continue;
            }
            let due = length + CHECKSUM * self.steps[..k].iter().filter(|s| **s == Step::Fletcher32).count();
            bytes = match step {
                Step::Deflate => inflate(&bytes, due, std::mem::take(&mut memory))?.into(),
                Step::Lzf => expand(&bytes, due, std::mem::take(&mut memory))?.into(),
                Step::Shuffle => unshuffle(&bytes, size).into(),
                Step::Fletcher32 => checked(bytes)?,
            };
        }
        if bytes.len() == length { Ok(bytes.into_owned()) } else { Err(format!("a chunk of {} bytes where {length} are due", bytes.len())) }
    }
}

/// Deflate with the header and checksum of zlib (Deutsch & Gailly 1996, RFC 1950).
fn inflate(bytes: &[u8], due: usize, mut out: Vec<u8>) -> Result<Vec<u8>, String> {
    out.resize(due, 0);
    let mut state = Decompress::new(true);
    match state.decompress(bytes, &mut out, FlushDecompress::Finish) {
        Ok(Status::StreamEnd) if state.total_out() == due as u64 => Ok(out),
        Ok(_) => Err(format!("a chunk that does not inflate to {due} bytes")),
        Err(e) => Err(format!("a chunk that does not inflate ({e})")),
    }
}

/// The LZF filter of h5py (Lehmann 2005, LibLZF).
///
/// A byte n below 32 is followed by n + 1 literal bytes. Any other byte begins a copy of earlier output. The length of the copy is 2 plus
/// the upper three bits (plus the next byte where these are 7). The distance is 1 plus the number made of the lower five bits and the
/// following byte.
fn expand(bytes: &[u8], due: usize, mut out: Vec<u8>) -> Result<Vec<u8>, String> {
    out.reserve_exact(due);
    let whole = pieces(bytes, &mut out, due).is_some() && out.len() == due;
    if whole { Ok(out) } else { Err(format!("an LZF chunk that does not unpack to {due} bytes")) }
}

/// `None` where the input ends within a piece, or a piece reaches past the end or before the start of the output.
fn pieces(mut bytes: &[u8], out: &mut Vec<u8>, due: usize) -> Option<()> {
    while let Some((control, rest)) = bytes.split_first() {
        let control = usize::from(*control);
        bytes = rest;
        if control < 32 {
            let (plain, rest) = bytes.split_at_checked(control + 1)?;
            out.extend_from_slice(plain);
            bytes = rest;
        } else {
            let mut next = || bytes.split_off_first().map(|b| usize::from(*b));
            let length = 2 + if control >> 5 == 7 { 7 + next()? } else { control >> 5 };
            let from = out.len().checked_sub(((control & 31) << 8 | next()?) + 1)?;
            copy_behind(out, from, length);
        }
        if out.len() > due {
            return None;
        }
    }
    Some(())
}

/// Append a copy of `length` bytes from `from` on. The source may overlap the appended bytes.
fn copy_behind(out: &mut Vec<u8>, from: usize, length: usize) {
    let end = out.len() + length;
    while out.len() < end {
        let n = (out.len() - from).min(end - out.len());
        out.extend_from_within(from..from + n);
    }
}

/// Undo the shuffle filter, which groups the bytes by their place in the element. Bytes after the last whole element stay as they are.
fn unshuffle(bytes: &[u8], size: usize) -> Vec<u8> {
    match size {
        0 | 1 => bytes.to_vec(),
        2 => planes::<2>(bytes),
        4 => planes::<4>(bytes),
        8 => planes::<8>(bytes),
        16 => planes::<16>(bytes),
        _ => {
            let n = bytes.len() / size;
            let mut out = bytes.to_vec();
            for (k, plane) in bytes[..n * size].chunks_exact(n.max(1)).enumerate() {
                plane.iter().enumerate().for_each(|(i, b)| out[i * size + k] = *b);
            }
            out
        }
    }
}

fn planes<const N: usize>(bytes: &[u8]) -> Vec<u8> {
    let n = bytes.len() / N;
    let plane: [&[u8]; N] = std::array::from_fn(|k| &bytes[k * n..(k + 1) * n]);
    let mut out = vec![0; bytes.len()];
    let (elements, rest) = out.as_chunks_mut::<N>();
    for (i, element) in elements.iter_mut().enumerate() {
        *element = std::array::from_fn(|k| plane[k][i]);
    }
    rest.copy_from_slice(&bytes[n * N..]);
    out
}

/// A chunk without its checksum. A wrong checksum is an error.
fn checked(bytes: Cow<'_, [u8]>) -> Result<Cow<'_, [u8]>, String> {
    let Some((values, sum)) = bytes.split_last_chunk::<CHECKSUM>() else { return Err("a chunk without its checksum".into()) };
    if u32::from_le_bytes(*sum) != fletcher32(values) {
        return Err("a chunk that differs from its checksum".into());
    }
    let n = values.len();
    Ok(match bytes {
        Cow::Borrowed(all) => all[..n].into(),
        Cow::Owned(mut all) => {
            all.truncate(n);
            all.into()
        }
    })
}

/// Checksum of Fletcher (1982) over words of 16 bits, high byte first, as HDF5 stores it.
fn fletcher32(bytes: &[u8]) -> u32 {
    let fold = |s: u32| (s & 0xffff) + (s >> 16);
    let (mut a, mut b) = (0_u32, 0_u32);
    // The sums cannot overflow within this number of words.
    for run in bytes.chunks(720) {
        for word in run.chunks(2) {
            a += u32::from(word[0]) << 8 | word.get(1).map_or(0, |w| u32::from(*w));
            b += a;
        }
        (a, b) = (fold(a), fold(b));
    }
    fold(b) << 16 | fold(a)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    fn deflated(bytes: &[u8]) -> Vec<u8> {
        let mut out = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::new(4));
        out.write_all(bytes).unwrap();
        out.finish().unwrap()
    }

    #[test]
    fn a_chunk_of_another_size_is_refused() {
        let values: Vec<u8> = (0..=255).cycle().take(4000).collect();
        let pipeline = Pipeline::of(&[Filter::Deflate(4)]).unwrap();
        assert_eq!(pipeline.unpack((&deflated(&values), 0), (8, 4000), Vec::new()).unwrap(), values);
        assert_eq!(pipeline.unpack((&values, 1), (8, 4000), Vec::new()).unwrap(), values);
        for (bytes, skipped, due) in [
            (deflated(&values), 0, 3999),
            (deflated(&values), 0, 4001),
            (deflated(&values)[..30].to_vec(), 0, 4000),
            (values.clone(), 0, 4000),
            (values[1..].to_vec(), 1, 4000),
            (Vec::new(), 0, 4000),
        ] {
            let found = pipeline.unpack((&bytes, skipped), (8, due), Vec::new());
            assert!(found.as_ref().is_err_and(|e| e.starts_with("a chunk")), "{found:?}");
        }
        let lzf = Pipeline::of(&[Filter::LZF]).unwrap();
        for bytes in [vec![], vec![7], vec![255; 20], vec![0x1f, 1, 2], vec![0x20, 0xff], vec![0, 1, 0xe0], vec![0, 1, 0x20], vec![0; 9000]]
        {
            assert!(lzf.unpack((&bytes, 0), (8, 4000), Vec::new()).is_err());
        }
        assert_eq!(
            lzf.unpack((&[1, 5, 6, 0x60, 1, 0xe0, 3, 0], 0), (8, 19), Vec::new()).unwrap(),
            [&[5, 6, 5, 6, 5, 6, 5][..], &[5; 12]].concat()
        );
        let sums = Pipeline::of(&[Filter::Fletcher32]).unwrap();
        assert!(
            sums.unpack((&[1, 2, 3], 0), (1, 3), Vec::new()).is_err()
                && sums.unpack((&[1, 2, 3, 0, 0, 0, 0], 0), (1, 3), Vec::new()).is_err()
        );
    }

    #[test]
    fn filters_left_to_the_library_are_told_from_these() {
        assert!(Pipeline::of(&[]).is_none() && Pipeline::of(&[Filter::Shuffle, Filter::NBit]).is_none());
        assert!(Pipeline::of(&[Filter::LZF, Filter::Deflate(1)]).is_none());
        assert!(Pipeline::of(&[Filter::Fletcher32, Filter::Shuffle, Filter::LZF]).is_some());
    }
}
