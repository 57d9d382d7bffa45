//! Rows of visibilities, weights and flags in small parts, each handed over while it is in cache.
//!
//! Every chunk is read and unpacked once. A few rows are then gathered from all chunks that they lie in. The arrays of a whole block would leave
//! the cache before they are used, and their memory would have to be cleared by the system first.

use super::chunks::{Chunks, Runs, Unpacked, shared};
use super::convert::{Form, form_as};
use cittert_arrays::RowPart;
use hdf5::{Dataset, H5Type};
use num_complex::Complex;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::sync::{Mutex, PoisonError};

/// Size of the chunks of a dataset that lie side by side, bytes. Datasets with more are read in blocks of rows.
const MOST_ABREAST: usize = 1 << 25;
/// Size of the values in the file that are unpacked together, bytes.
const WINDOW: usize = 1 << 23;

/// The datasets of visibilities, weights and flags, with the same shape.
pub(crate) type Three<'a> = [&'a Dataset; 3];

/// A dataset whose chunks are unpacked here.
struct Column<'a> {
    chunks: Chunks<'a>,
    runs: Runs,
    form: Form,
    /// Number of chunks side by side.
    abreast: usize,
    /// Size of a row in the file, bytes.
    stored_row: usize,
}

impl<'a> Column<'a> {
    /// `None` where the library must read the dataset, or where a row of its chunks is too large.
    fn of<T: H5Type>(dataset: &'a Dataset) -> hdf5::Result<Option<Self>> {
        let (Some(form), Some(chunks)) = (form_as::<T>(dataset)?, Chunks::of(dataset, usize::MAX)?) else { return Ok(None) };
        let (abreast, length) = (chunks.columns()?, chunks.length()?);
        if abreast.saturating_mul(length) > MOST_ABREAST {
            return Ok(None);
        }
        let stored_row = chunks.shape[1..].iter().product::<usize>() * chunks.size;
        Ok(Some(Self { runs: chunks.runs(), form, abreast, stored_row, chunks }))
    }

    fn three([vis, weights, flags]: Three<'a>) -> hdf5::Result<Option<[Self; 3]>> {
        let (vis, weights, flags) = (Self::of::<Complex<f32>>(vis)?, Self::of::<f32>(weights)?, Self::of::<i8>(flags)?);
        Ok(vis.zip(weights).zip(flags).map(|((v, w), f)| [v, w, f]))
    }

    /// First rows of the chunks that these rows lie in.
    fn firsts(&self, rows: &Range<usize>) -> impl Iterator<Item = usize> + use<> {
        let high = self.chunks.chunk[0];
        (rows.start / high * high..rows.end).step_by(high)
    }

    fn overlaps(&self, chunk: &Unpacked<'_>, rows: &Range<usize>) -> bool {
        chunk.first < rows.end && chunk.first + self.chunks.chunk[0] > rows.start
    }

    /// Gather rows into `out`, which has exactly their size. `filled` are the bytes of the element that fills `out`, if one does.
    fn gather(&self, kept: &[Unpacked<'_>], rows: &Range<usize>, (out, filled): (&mut [u8], &mut Vec<u8>)) {
        let size = self.chunks.size;
        let inside = || kept.iter().filter(|u| self.overlaps(u, rows));
        let first = inside().next().and_then(|u| u.every(size)).filter(|_| self.form == Form::Stored);
        if let Some(value) = first.filter(|value| inside().all(|u| u.every(size) == Some(*value))) {
            if filled != value {
                out.chunks_exact_mut(size).for_each(|o| o.copy_from_slice(value));
                filled.clear();
                filled.extend_from_slice(value);
            }
            return;
        }
        filled.clear();
        let row = out.len() / rows.len();
        inside().for_each(|u| self.chunks.place(u, rows.start, (row, self.form), out));
    }
}

/// The rows of one part, and the elements that fill its arrays.
#[derive(Default)]
struct Buffers {
    vis: Vec<Complex<f32>>,
    weights: Vec<f32>,
    stored_flags: Vec<i8>,
    flags: Vec<bool>,
    filled: [Vec<u8>; 3],
}

/// True if these datasets can be read in parts.
pub(super) fn can(datasets: Three<'_>) -> bool {
    Column::three(datasets).is_ok_and(|c| c.is_some())
}

/// Read rows and give them to `take` in parts of `step` rows, in any order and on any thread. With the error is the index of the dataset.
pub(super) fn read(
    datasets: Three<'_>,
    range: Range<usize>,
    step: usize,
    take: &(dyn Fn(RowPart<'_>) + Sync),
) -> Result<(), (usize, hdf5::Error)> {
    let of_vis = |e| (0, e);
    let columns = Column::three(datasets).map_err(of_vis)?.ok_or_else(|| (0, "values that can only be read as a whole".into()))?;
    let n: usize = columns[0].chunks.shape[1..].iter().product();
    let step = step.max(1);
    let stored_row: usize = columns.iter().map(|c| c.stored_row).sum();
    let window = (WINDOW / stored_row.max(1) / step).max(1) * step;
    let threads = rayon::current_num_threads();
    let spare = Mutex::new(Vec::<Buffers>::new());
    let mut kept: [Vec<Unpacked<'_>>; 3] = Default::default();
    for start in range.clone().step_by(window) {
        let rows = start..(start + window).min(range.end);
        let mut missing = Vec::new();
        for (k, (column, kept)) in columns.iter().zip(&mut kept).enumerate() {
            // Chunks are kept in the order of their rows.
            let past = kept.iter().take_while(|u| !column.overlaps(u, &rows)).count();
            kept.drain(..past);
            let next = kept.last().map_or(0, |u| u.first + 1);
            missing.extend(column.firsts(&rows).filter(|f| *f >= next).flat_map(|f| (0..column.abreast).map(move |c| (k, f, c))));
        }
        let wrong = AtomicUsize::new(0);
        let unpacked = shared(threads, &missing, |(k, first, c)| {
            let column = &columns[*k];
            column.chunks.unpacked(*first, *c, &column.runs).inspect_err(|_| wrong.store(*k, Relaxed))
        });
        let unpacked = unpacked.map_err(|e| (wrong.load(Relaxed), e))?;
        missing.iter().zip(unpacked).for_each(|((k, ..), u)| kept[*k].push(u));
        let parts: Vec<Range<usize>> = rows.clone().step_by(step).map(|s| s..(s + step).min(rows.end)).collect();
        shared(threads, &parts, |part| {
            let lock = || spare.lock().unwrap_or_else(PoisonError::into_inner);
            let taken = lock().pop();
            let mut b = taken.unwrap_or_default();
            let len = part.len() * n;
            if b.vis.len() != len {
                b.vis.resize(len, Complex::default());
                b.weights.resize(len, 0.0);
                b.stored_flags.resize(len, 0);
                b.flags.resize(len, false);
                b.filled.iter_mut().for_each(Vec::clear);
            }
            let [vis, weights, flags] = &mut b.filled;
            columns[0].gather(&kept[0], part, (bytemuck::cast_slice_mut(&mut b.vis), vis));
            columns[1].gather(&kept[1], part, (bytemuck::cast_slice_mut(&mut b.weights), weights));
            let before = (!flags.is_empty()).then(|| flags.clone());
            columns[2].gather(&kept[2], part, (bytemuck::cast_slice_mut(&mut b.stored_flags), flags));
            if before.as_ref() != Some(flags) {
                b.flags.iter_mut().zip(&b.stored_flags).for_each(|(f, stored)| *f = *stored != 0);
            }
            take(RowPart { rows: part.start - range.start..part.end - range.start, vis: &b.vis, weights: &b.weights, flags: &b.flags });
            lock().push(b);
            Ok(())
        })
        .map_err(of_vis)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::{Array3, s};

    type Filters = fn(hdf5::DatasetBuilder) -> hdf5::DatasetBuilder;

    /// Parts of any size hold what was written, each row once, for chunks of any shape, with and without filters.
    #[test]
    fn parts_hold_every_row_once() {
        let folder = tempfile::tempdir().unwrap();
        let file = hdf5::File::create(folder.path().join("x.h5")).unwrap();
        let shape = (97, 6, 2);
        let at = |(i, j, k): (usize, usize, usize)| (i * 40 + j * 5 + k) as f64;
        let vis = Array3::from_shape_fn(shape, |p| Complex::new(at(p), -0.5 * at(p)));
        // Half of the weights are the same, and most flags.
        let weights = Array3::from_shape_fn(shape, |p| if p.0 < 50 { 3.0_f32 } else { at(p) as f32 });
        let flags = Array3::from_shape_fn(shape, |(i, j, _)| i == 60 && j == 2);
        let filters: [Filters; 3] = [|b| b, |b| b.lzf(), |b| b.shuffle().deflate(2)];
        for (n, chunk) in [(10_usize, 2, 1), (97, 6, 2), (7, 6, 2), (16, 4, 1), (1, 6, 1)].into_iter().enumerate() {
            for (f, filters) in filters.iter().enumerate() {
                let made = |name: &str| format!("{name}{n}{f}");
                // The three datasets have chunks of different heights.
                let low = (chunk.0.div_ceil(2), chunk.1, chunk.2);
                let v = filters(file.new_dataset_builder()).empty::<Complex<f64>>().shape(shape).chunk(chunk).create(&*made("v")).unwrap();
                v.write(&vis).unwrap();
                let w = filters(file.new_dataset_builder()).empty::<f32>().shape(shape).chunk(low).create(&*made("w")).unwrap();
                w.write(&weights).unwrap();
                let g = filters(file.new_dataset_builder()).empty::<bool>().shape(shape).chunk(chunk).create(&*made("f")).unwrap();
                g.write(&flags).unwrap();
                assert!(can([&v, &w, &g]));
                for (range, step) in [(0..97, 97), (0..97, 10), (3..88, 1), (50..61, 4), (20..20, 5)] {
                    let seen = Mutex::new(vec![0; range.len()]);
                    let check = |part: RowPart<'_>| {
                        let rows = range.start + part.rows.start..range.start + part.rows.end;
                        assert!(part.rows.start.is_multiple_of(step) && (rows.len() == step || rows.end == range.end));
                        part.rows.for_each(|r| seen.lock().unwrap()[r] += 1);
                        let of = s![rows, .., ..];
                        assert!(part.vis.iter().zip(vis.slice(of)).all(|(a, b)| *a == Complex::new(b.re as f32, b.im as f32)));
                        assert!(part.weights.iter().eq(weights.slice(of)) && part.flags.iter().eq(flags.slice(of)));
                        assert_eq!((part.vis.len(), part.flags.len()), (part.weights.len(), part.weights.len()));
                    };
                    read([&v, &w, &g], range.clone(), step, &check).unwrap();
                    assert!(seen.into_inner().unwrap().iter().all(|n| *n == 1), "{chunk:?} {range:?} {step}");
                }
            }
        }
    }

    #[test]
    fn values_that_the_library_must_convert_are_not_read_in_parts() {
        let folder = tempfile::tempdir().unwrap();
        let file = hdf5::File::create(folder.path().join("x.h5")).unwrap();
        let v = file.new_dataset::<Complex<f32>>().chunk((4, 3, 1)).shape((8, 3, 1)).create("v").unwrap();
        let w = file.new_dataset::<i32>().chunk((4, 3, 1)).shape((8, 3, 1)).create("w").unwrap();
        let f = file.new_dataset::<bool>().chunk((4, 3, 1)).shape((8, 3, 1)).create("f").unwrap();
        let flat = file.new_dataset::<f32>().shape((8, 3, 1)).create("flat").unwrap();
        let good = file.new_dataset::<f32>().chunk((4, 3, 1)).shape((8, 3, 1)).create("good").unwrap();
        assert!(!can([&v, &w, &f]) && !can([&v, &flat, &f]) && can([&v, &good, &f]));
        assert_eq!(read([&v, &w, &f], 0..8, 2, &|_| ()).unwrap_err().0, 0);
    }
}
