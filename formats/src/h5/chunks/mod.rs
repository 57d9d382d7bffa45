//! Rows of a dataset in chunks. The chunks are read as stored, and unpacked, converted and copied to their places in this crate, on all threads.
//!
//! The HDF5 library does this on one thread, value by value, and does not check the size that a filter gives.

mod content;

use super::convert::Form;
use super::places::Places;
use super::sharing::{shared, threads};
use super::unpack::Pipeline;
use bytemuck::{cast, pod_read_unaligned};
use content::{Content, LastAlike, Run};
pub(super) use content::{Runs, Spare, Unpacked};
use hdf5::{Dataset, Dataspace, Hyperslab, SliceOrIndex};
use hdf5_sys::h5::{herr_t, hsize_t};
use hdf5_sys::h5d::{H5Dread, H5Dread_chunk1};
use hdf5_sys::h5i::hid_t;
use hdf5_sys::h5p::H5P_DEFAULT;
use std::borrow::Cow;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

/// Size of the chunks that are unpacked together, bytes; at least one chunk per thread.
const BATCH: usize = 1 << 24;

/// Size of a line of the cache, bytes.
const LINE_BYTES: usize = 64;

/// Size of the rows that are read together as one chunk where a dataset has no chunks, bytes.
const WITHOUT_CHUNKS: usize = 1 << 18;

/// Less than this is read by one thread, bytes.
const ALONE: usize = 1 << 18;

unsafe extern "C" {
    /// Part of the library since 1.10.2, but missing in the bindings.
    fn H5Dget_chunk_storage_size(dataset: hid_t, offset: *const hsize_t, bytes: *mut hsize_t) -> herr_t;
}

/// A dataset whose chunks this crate unpacks.
pub(super) struct Chunks<'a> {
    dataset: &'a Dataset,
    pipeline: Pipeline,
    pub(super) shape: Vec<usize>,
    pub(super) chunk: Vec<usize>,
    /// Size of an element in the file, bytes.
    pub(super) size: usize,
    /// The rows that are wanted, and where their chunks lie in the file, if it is known.
    located: Option<(Range<usize>, Places)>,
    last_alike: LastAlike,
}

/// What a file holds of a chunk.
enum Stored {
    /// Rows as they are, from this one on.
    Rows(Vec<u8>, usize),
    /// The whole chunk as stored, and the mask of the filters that were not applied.
    Packed((Vec<u8>, u32)),
    /// The chunk was never written.
    Never,
}

impl<'a> Chunks<'a> {
    /// For the reading of these rows. `None` where the library must read them: no chunks, or filters that this crate does not know. Of chunks
    /// without filters that are higher than the rows, the library reads only a part, as this crate does where it finds the chunks itself.
    pub(super) fn of(dataset: &'a Dataset, rows: Range<usize>) -> hdf5::Result<Option<Self>> {
        let high = rows.len() / 2;
        let chunks = Self::anywhere(dataset)?.map(|chunks| chunks.located(rows));
        Ok(chunks.filter(|c| c.located.is_some() || !c.pipeline.is_empty() || c.chunk[0] <= high))
    }

    /// Find the chunks of these rows, of which others are then not read.
    pub(super) fn located(self, rows: Range<usize>) -> Self {
        let places = Places::of(self.dataset, (&self.shape, &self.chunk), self.size, &rows);
        Self { located: places.map(|places| (rows, places)).or(self.located), ..self }
    }

    /// Without the places of chunks. `None` where the library must read them.
    pub(super) fn anywhere(dataset: &'a Dataset) -> hdf5::Result<Option<Self>> {
        let filters = dataset.filters();
        let pipeline = if filters.is_empty() { Some(Pipeline::none()) } else { Pipeline::of(&filters) };
        let Some(pipeline) = pipeline else { return Ok(None) };
        let Some(chunk) = dataset.chunk() else { return Self::in_one_piece(dataset) };
        let (shape, file_type) = (dataset.get_shape()?, dataset.dtype()?);
        let size = file_type.size();
        if shape.is_empty() || chunk.len() != shape.len() || chunk.contains(&0) || size == 0 {
            return Err(format!("chunks of {chunk:?} for the shape {shape:?}").into());
        }
        Ok(Some(Self { dataset, pipeline, shape, chunk, size, located: None, last_alike: LastAlike::default() }))
    }

    /// A dataset without chunks: a run of rows is read as if it were one. `None` where it is not known where the values lie.
    fn in_one_piece(dataset: &'a Dataset) -> hdf5::Result<Option<Self>> {
        let (shape, size) = (dataset.get_shape()?, dataset.dtype()?.size());
        let (Some(row), Some(rows)) = (shape.iter().skip(1).try_fold(size, |n, side| n.checked_mul(*side)), shape.first().copied()) else {
            return Ok(None);
        };
        if row == 0 || rows == 0 {
            return Ok(None);
        }
        let mut chunk = shape.clone();
        chunk[0] = (WITHOUT_CHUNKS / row).clamp(1, rows);
        // The library cannot read such a chunk, so that the places must be known.
        let whole = Self { dataset, pipeline: Pipeline::none(), shape, chunk, size, located: None, last_alike: LastAlike::default() };
        let all = whole.located(0..rows);
        Ok(all.located.is_some().then_some(all))
    }

    /// Read these rows into `out` in this form. `out` has exactly their size.
    pub(super) fn read(&self, rows: Range<usize>, (out, form): (&mut [u8], Form)) -> hdf5::Result<()> {
        if out.is_empty() {
            return Ok(());
        }
        let (runs, columns) = (self.runs(), self.columns()?);
        let high = self.chunk[0];
        let mut all = (rows.start / high * high..rows.end).step_by(high).flat_map(|first| (0..columns).map(move |c| (first, c)));
        // To unpack chunks takes longer than to copy a few of their rows.
        let groups = rows.end.div_ceil(high) - rows.start / high;
        let work = if self.pipeline.is_empty() { out.len() } else { self.length()?.saturating_mul(groups * columns) };
        // To start a thread takes as long as to read some 100 kB.
        let threads = if work < ALONE { 1 } else { threads() };
        let at_once = (BATCH / self.length()?.max(1)).max(threads);
        let spare = Spare::default();
        loop {
            let batch: Vec<(usize, usize)> = all.by_ref().take(at_once).collect();
            let Some(last) = batch.last() else { return Ok(()) };
            // The rows that have a part in this batch.
            let part = batch[0].0.max(rows.start)..(last.0 + high).min(rows.end);
            let unpacked = shared(threads, &batch, |(first, column)| self.unpacked((*first, *column), &runs, &spare))?;
            let row = out.len() / rows.len();
            let out = &mut out[(part.start - rows.start) * row..(part.end - rows.start) * row];
            let step = part.len().div_ceil(threads).max(1);
            let pieces: Vec<_> = out.chunks_mut(step * row).zip(part.clone().step_by(step)).map(Mutex::new).collect();
            let placed: hdf5::Result<Vec<()>> = shared(threads, &pieces, |piece| {
                let (bytes, first) = &mut *piece.lock().unwrap_or_else(PoisonError::into_inner);
                unpacked.iter().for_each(|u| self.place(u, *first, (row, form), bytes));
                Ok(())
            });
            placed?;
            spare.give(unpacked);
        }
    }

    /// Size of an unpacked chunk, bytes.
    pub(super) fn length(&self) -> hdf5::Result<usize> {
        let length = self.chunk.iter().try_fold(self.size, |n, c| n.checked_mul(*c));
        length.ok_or_else(|| "chunks larger than memory".into())
    }

    /// Number of chunks side by side in a row of the array.
    pub(super) fn columns(&self) -> hdf5::Result<usize> {
        let mut counts = self.shape.iter().zip(&self.chunk).skip(1).map(|(n, step)| n.div_ceil(*step));
        counts.try_fold(1_usize, |all, n| all.checked_mul(n)).ok_or_else(|| "more chunks than memory holds".into())
    }

    pub(super) fn runs(&self) -> Runs {
        let mut reaches = vec![Vec::new()];
        for (n, step) in self.shape.iter().zip(&self.chunk).skip(1) {
            let ends = [(*step).min(*n), n % step];
            let ends = &ends[..if n % step == 0 || step > n { 1 } else { 2 }];
            reaches = reaches.iter().flat_map(|r: &Vec<usize>| ends.iter().map(|e| r.iter().copied().chain([*e]).collect())).collect();
        }
        reaches.into_iter().map(|r| (r.clone(), self.runs_within(&r))).collect()
    }

    fn runs_within(&self, reach: &[usize]) -> Vec<Run> {
        let mut runs = vec![Run { to: 0, from: 0, n: 1 }];
        for (k, inside) in reach.iter().enumerate() {
            let (n, step) = (self.shape[k + 1], self.chunk[k + 1]);
            // Axes that the chunk spans completely are contiguous.
            if (k + 1..reach.len()).all(|j| self.chunk[j + 1] == self.shape[j + 1]) {
                let behind: usize = self.shape[k + 2..].iter().product();
                runs.iter_mut().for_each(|r| *r = Run { to: r.to * n * behind, from: r.from * step * behind, n: inside * behind });
                break;
            }
            let longer = |r: &Run| (0..*inside).map(|i| Run { to: r.to * n + i, from: r.from * step + i, n: 1 }).collect::<Vec<_>>();
            runs = runs.iter().flat_map(longer).collect();
        }
        runs
    }

    /// Unpack the chunk that begins at row `first` in a column of chunks.
    pub(super) fn unpacked<'r>(&self, (first, column): (usize, usize), runs: &'r Runs, spare: &Spare) -> hdf5::Result<Unpacked<'r>> {
        let (mut rest, mut to, mut stride) = (column, 0, 1);
        let (mut offset, mut reach) = (vec![first as hsize_t; self.shape.len()], vec![0; self.shape.len() - 1]);
        for k in (1..self.shape.len()).rev() {
            let (n, step) = (self.shape[k], self.chunk[k]);
            let at = rest % n.div_ceil(step) * step;
            rest /= n.div_ceil(step);
            (offset[k], reach[k - 1]) = (at as hsize_t, step.min(n - at));
            to += at * stride;
            stride *= n;
        }
        let runs = runs.get(&reach).map_or(&[][..], |r| r);
        let length = self.length()?;
        let whole = |content| Unpacked { first, rows: self.chunk[0], to, runs, content };
        Ok(match self.stored((first, column), &offset, (length, spare))? {
            Stored::Rows(bytes, first) => {
                let rows = bytes.len() / self.wide();
                Unpacked { first, rows, to, runs, content: Content::of(bytes, self.size, spare) }
            }
            Stored::Packed(stored) => match self.last_alike.content(&stored) {
                Some(content) => whole(content),
                None => whole(self.unpack(stored, (length, spare)).map_err(|e| format!("{e}, at {offset:?}"))?),
            },
            Stored::Never => whole(Content::Every(self.unwritten(&offset)?)),
        })
    }

    /// Undo the filters of a chunk of `length` bytes.
    fn unpack(&self, stored: (Vec<u8>, u32), (length, spare): (usize, &Spare)) -> Result<Content, String> {
        let bytes = self.pipeline.unpack((&stored.0, stored.1), (self.size, length), spare.take(length))?;
        let content = Content::of(bytes, self.size, spare);
        self.last_alike.note(stored, &content);
        Ok(content)
    }

    /// Size of a row of an unpacked chunk, bytes.
    fn wide(&self) -> usize {
        self.chunk[1..].iter().product::<usize>() * self.size
    }

    /// What the file holds of the chunk of `length` bytes that begins at row `first` in a column of chunks.
    fn stored(&self, (first, column): (usize, usize), offset: &[hsize_t], (length, spare): (usize, &Spare)) -> hdf5::Result<Stored> {
        let Some((rows, places)) = &self.located else { return self.read_by_library(offset, length) };
        let Some(place) = places.get(first, column).filter(|p| p.bytes > 0) else { return Ok(Stored::Never) };
        let n = stored_size(place.bytes.into(), length, offset)?;
        let unreadable = |e| format!("a chunk that cannot be read ({e}), at {offset:?}");
        if !self.pipeline.is_empty() {
            return Ok(Stored::Packed((places.read(place.address, n, Vec::new()).map_err(unreadable)?, place.skipped)));
        }
        if n != length {
            return Err(format!("{n} bytes stored for a chunk of {length} bytes, at {offset:?}").into());
        }
        let wanted = rows.start.max(first)..rows.end.min(first + self.chunk[0]);
        let wide = length / self.chunk[0];
        let from = place.address.saturating_add(((wanted.start - first) * wide) as u64);
        // Chunks at the ends of the rows have fewer of them. Their memory must serve whole chunks too.
        let memory = spare.take(rows.len().min(self.chunk[0]) * wide);
        Ok(Stored::Rows(places.read(from, wanted.len() * wide, memory).map_err(unreadable)?, wanted.start))
    }

    fn read_by_library(&self, offset: &[hsize_t], length: usize) -> hdf5::Result<Stored> {
        let (id, mut bytes, mut skipped) = (self.dataset.id(), 0, 0);
        // SAFETY: the offset has one number for each axis and outlives the call; the lock of the library is held.
        let size = |bytes: &mut hsize_t| unsafe { H5Dget_chunk_storage_size(id, offset.as_ptr(), bytes) };
        if hdf5::sync::sync(|| size(&mut bytes)) < 0 {
            return Ok(Stored::Never);
        }
        // Other threads read while this one gets its memory.
        let stored = stored_size(bytes, length, offset)?;
        let mut raw = Vec::<u8>::with_capacity(stored);
        let (to, mut now) = (raw.as_mut_ptr().cast(), 0);
        let read = hdf5::sync::sync(|| {
            // SAFETY: as above; the library reads as many bytes as it says.
            size(&mut now) >= 0 && now == bytes && unsafe { H5Dread_chunk1(id, H5P_DEFAULT, offset.as_ptr(), &mut skipped, to) } >= 0
        });
        if !read {
            return Err(format!("a chunk that cannot be read, at {offset:?}").into());
        }
        // SAFETY: the library has written as many bytes as it said before and after, which the memory holds. Zeros that are overwritten take time.
        unsafe { raw.set_len(stored) };
        Ok(Stored::Packed((raw, skipped)))
    }

    /// The bytes of one element of a chunk that was never written: the fill value. The library gives it, because it can tell such a chunk from
    /// a chunk that it cannot find.
    fn unwritten(&self, offset: &[hsize_t]) -> hdf5::Result<Vec<u8>> {
        let corner: Vec<SliceOrIndex> = offset.iter().map(|k| SliceOrIndex::from(*k as usize)).collect();
        let there = self.dataset.space()?.select(Hyperslab::from(corner))?;
        let (here, own) = (Dataspace::try_new(())?, self.dataset.dtype()?);
        let mut element = vec![0; self.size];
        let (id, to) = (self.dataset.id(), element.as_mut_ptr().cast());
        // SAFETY: the buffer holds one element of the type that is given, and one is selected; the lock of the library is held.
        let status = hdf5::sync::sync(|| unsafe { H5Dread(id, own.id(), here.id(), there.id(), H5P_DEFAULT, to) });
        if status < 0 { Err(format!("a chunk that is not found, at {offset:?}").into()) } else { Ok(element) }
    }

    /// Ask the processor to load what a chunk holds of some rows into its cache.
    pub(super) fn ask_for(&self, from: &Unpacked<'_>, rows: &Range<usize>) {
        let Content::Each(all) = &from.content else { return };
        let at = |row: usize| (row.max(from.first) - from.first) * self.wide();
        let bytes = all.get(at(rows.start)..at(rows.end).min(all.len())).unwrap_or_default();
        #[cfg(target_arch = "x86_64")]
        for line in bytes.chunks(LINE_BYTES) {
            use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
            // SAFETY: only a hint, for bytes that exist.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(line.as_ptr().cast()) };
        }
        #[cfg(not(target_arch = "x86_64"))]
        let _ = bytes;
    }

    /// Copy the part of a chunk that lies in the rows from `first` on into `out`, which has `row` bytes per row.
    pub(super) fn place(&self, from: &Unpacked<'_>, first: usize, (row, form): (usize, Form), out: &mut [u8]) {
        let end = first + out.len() / row;
        let wide = self.wide();
        let rows = from.first.max(first)..(from.first + from.rows).min(end);
        if rows.is_empty() {
            return;
        }
        let source = match &from.content {
            Content::Each(all) => Cow::Borrowed(&all[(rows.start - from.first) * wide..(rows.end - from.first) * wide]),
            Content::Every(element) => Cow::Owned(element.repeat(rows.len() * wide / self.size)),
        };
        let source = &source[..];
        let target = &mut out[(rows.start - first) * row..(rows.end - first) * row];
        if form == Form::Floats {
            let to = &mut target[from.to * self.size / 2..];
            match self.size {
                16 => place_rows::<16, 8>((source, wide), (to, row), from.runs, |x| {
                    let [re, im]: [f64; 2] = pod_read_unaligned(x);
                    cast([re as f32, im as f32])
                }),
                _ => place_rows::<8, 4>((source, wide), (to, row), from.runs, |x| (pod_read_unaligned::<f64>(x) as f32).to_ne_bytes()),
            }
            return;
        }
        let to = &mut target[from.to * self.size..];
        match self.size {
            1 => place_rows::<1, 1>((source, wide), (to, row), from.runs, |x| *x),
            2 => place_rows::<2, 2>((source, wide), (to, row), from.runs, |x| *x),
            4 => place_rows::<4, 4>((source, wide), (to, row), from.runs, |x| *x),
            8 => place_rows::<8, 8>((source, wide), (to, row), from.runs, |x| *x),
            16 => place_rows::<16, 16>((source, wide), (to, row), from.runs, |x| *x),
            n => {
                let bytes: Vec<Run> = from.runs.iter().map(|r| Run { to: r.to * n, from: r.from * n, n: r.n * n }).collect();
                place_rows::<1, 1>((source, wide), (to, row), &bytes, |x| *x);
            }
        }
    }
}

/// Number of bytes of a stored chunk that has `length` bytes when it is unpacked.
fn stored_size(bytes: hsize_t, length: usize, offset: &[hsize_t]) -> hdf5::Result<usize> {
    let n = usize::try_from(bytes).unwrap_or(usize::MAX);
    if n == 0 || n > Pipeline::most_stored(length) {
        return Err(format!("{n} bytes stored for a chunk of {length} bytes, at {offset:?}").into());
    }
    Ok(n)
}

/// Copy runs of elements of `N` bytes from rows of `wide` bytes to rows of `row` bytes, where they have `M` bytes.
fn place_rows<const N: usize, const M: usize>(
    (source, wide): (&[u8], usize),
    (target, row): (&mut [u8], usize),
    runs: &[Run],
    change: impl Fn(&[u8; N]) -> [u8; M],
) {
    // Chunks of a few channels of one polarisation have runs of one element, in the order of the chunk.
    if runs.iter().enumerate().all(|(k, r)| r.n == 1 && r.from == k) {
        return match runs.len() {
            1 => place_few::<N, M, 1>((source, wide), (target, row), runs, change),
            2 => place_few::<N, M, 2>((source, wide), (target, row), runs, change),
            4 => place_few::<N, M, 4>((source, wide), (target, row), runs, change),
            8 => place_few::<N, M, 8>((source, wide), (target, row), runs, change),
            _ => source.chunks_exact(wide).zip(target.chunks_mut(row)).for_each(|(from, to)| {
                let (from, to) = (from.as_chunks::<N>().0, to.as_chunks_mut::<M>().0);
                from.iter().zip(runs).for_each(|(f, run)| to[run.to] = change(f));
            }),
        };
    }
    for (from, to) in source.chunks_exact(wide).zip(target.chunks_mut(row)) {
        let (from, to) = (from.as_chunks::<N>().0, to.as_chunks_mut::<M>().0);
        for run in runs {
            let (from, to) = (&from[run.from..run.from + run.n], &mut to[run.to..run.to + run.n]);
            to.iter_mut().zip(from).for_each(|(t, f)| *t = change(f));
        }
    }
}

/// [`place_rows`] of `K` runs of one element, in the order of the chunk. With their number known, the loop over them is unrolled.
fn place_few<const N: usize, const M: usize, const K: usize>(
    (source, wide): (&[u8], usize),
    (target, row): (&mut [u8], usize),
    runs: &[Run],
    change: impl Fn(&[u8; N]) -> [u8; M],
) {
    let places: [usize; K] = std::array::from_fn(|k| runs[k].to);
    for (from, to) in source.chunks_exact(wide).zip(target.chunks_mut(row)) {
        let (from, to) = (from.as_chunks::<N>().0, to.as_chunks_mut::<M>().0);
        let Some(from) = from.first_chunk::<K>() else { return };
        for k in 0..K {
            to[places[k]] = change(&from[k]);
        }
    }
}

#[cfg(test)]
mod tests;
