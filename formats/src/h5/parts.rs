//! Rows of visibilities, weights and flags in small parts, each handed over while it is in cache.
//!
//! Every chunk is read and unpacked once. A few rows are then gathered from all chunks that they lie in. The arrays of a whole block would leave
//! the cache before they are used, and their memory would have to be cleared by the system first.

use super::chunks::{Chunks, Runs, Spare, Unpacked};
use super::convert::{Form, form_as};
use cittert_arrays::RowPart;
use hdf5::{Dataset, H5Type};
use num_complex::Complex;
use std::ops::Range;
use std::sync::atomic::Ordering::{AcqRel, Acquire, Relaxed, Release};
use std::sync::atomic::{AtomicBool, AtomicUsize};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// Size of the chunks of a dataset that lie side by side, bytes. Datasets with more are read in blocks of rows.
const MOST_ABREAST: usize = 1 << 25;
/// Size of the values in the file that are unpacked together, bytes. Chunks of most files are higher, and two of those that follow each other are then
/// in memory.
const WINDOW: usize = 1 << 21;

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
    fn of<T: H5Type>(dataset: &'a Dataset, rows: Option<&Range<usize>>) -> hdf5::Result<Option<Self>> {
        let (Some(form), Some(chunks)) = (form_as::<T>(dataset)?, Chunks::anywhere(dataset)?) else { return Ok(None) };
        let chunks = match rows {
            Some(rows) => chunks.located(rows.clone()),
            None => chunks,
        };
        let (abreast, length) = (chunks.columns()?, chunks.length()?);
        if abreast.saturating_mul(length) > MOST_ABREAST {
            return Ok(None);
        }
        let stored_row = chunks.shape[1..].iter().product::<usize>() * chunks.size;
        Ok(Some(Self { runs: chunks.runs(), form, abreast, stored_row, chunks }))
    }

    fn three([vis, weights, flags]: Three<'a>, rows: Option<&Range<usize>>) -> hdf5::Result<Option<[Self; 3]>> {
        let (vis, weights, flags) = (Self::of::<Complex<f32>>(vis, rows)?, Self::of::<f32>(weights, rows)?, Self::of::<i8>(flags, rows)?);
        Ok(vis.zip(weights).zip(flags).map(|((v, w), f)| [v, w, f]))
    }

    /// First rows of the chunks that these rows lie in.
    fn firsts(&self, rows: &Range<usize>) -> impl Iterator<Item = usize> + use<> {
        let high = self.chunks.chunk[0];
        (rows.start / high * high..rows.end).step_by(high)
    }

    /// Gather rows into `out`, which has exactly their size. `filled` are the bytes of the element that fills `out`, if one does.
    fn gather(&self, kept: &[Arc<Group<'_>>], rows: &Range<usize>, (out, filled): (&mut [u8], &mut Vec<u8>)) {
        let size = self.chunks.size;
        let inside = || kept.iter().flat_map(|group| group.chunks.iter().filter_map(OnceLock::get));
        let first = inside().next().and_then(Unpacked::every).filter(|_| self.form == Form::Stored);
        if let Some(value) = first.filter(|value| inside().all(|u| u.every() == Some(*value))) {
            if filled != value {
                out.chunks_exact_mut(size).for_each(|o| o.copy_from_slice(value));
                filled.clear();
                filled.extend_from_slice(value);
            }
            return;
        }
        filled.clear();
        let row = out.len() / rows.len();
        // A part has a few rows of every chunk, too few for the processor to see where it goes on.
        let mut ahead = inside().skip(1);
        for unpacked in inside() {
            if let Some(next) = ahead.next() {
                self.chunks.ask_for(next, rows);
            }
            self.chunks.place(unpacked, rows.start, (row, self.form), out);
        }
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
    Column::three(datasets, None).is_ok_and(|c| c.is_some())
}

/// Number of rows that are unpacked together.
fn window_rows(columns: &[Column<'_>; 3]) -> usize {
    let stored_row: usize = columns.iter().map(|c| c.stored_row).sum();
    (WINDOW / stored_row.max(1)).max(1)
}

/// Bytes of the chunks that are in memory at once while many rows are read; 0 if these datasets cannot be read in parts.
pub(super) fn held(datasets: Three<'_>) -> usize {
    let Ok(Some(columns)) = Column::three(datasets, None) else { return 0 };
    let window = window_rows(&columns);
    // Another thread unpacks what comes next.
    let next = usize::from(rayon::current_num_threads() > 1);
    let of = |column: &Column<'_>| {
        let high = column.chunks.chunk[0];
        let groups = (window.div_ceil(high) + 1 + next).min(column.chunks.shape[0].div_ceil(high));
        groups * high * column.stored_row
    };
    columns.iter().map(of).sum()
}

/// The chunks that begin at one row of a dataset.
struct Group<'r> {
    first: usize,
    chunks: Vec<OnceLock<Unpacked<'r>>>,
    /// Number of chunks that are not unpacked yet.
    missing: AtomicUsize,
}

/// The groups of a dataset that some rows lie in. A group is dropped when the last window over it is done.
struct Groups<'r> {
    high: usize,
    /// First row of the first group.
    start: usize,
    all: Vec<Mutex<Option<Arc<Group<'r>>>>>,
    /// Number of windows over each group that are not done.
    windows: Vec<AtomicUsize>,
}

impl<'r> Groups<'r> {
    fn new(column: &Column<'_>, rows: &Range<usize>, windows: &[Range<usize>]) -> Self {
        let high = column.chunks.chunk[0];
        let firsts: Vec<usize> = column.firsts(rows).collect();
        let over = |first: &usize| windows.iter().filter(|w| w.start < first + high && w.end > *first).count();
        let group = |first: &usize| {
            let chunks = (0..column.abreast).map(|_| OnceLock::new()).collect();
            Mutex::new(Some(Arc::new(Group { first: *first, chunks, missing: AtomicUsize::new(column.abreast) })))
        };
        let windows = firsts.iter().map(|f| AtomicUsize::new(over(f))).collect();
        Self { high, start: rows.start / high * high, all: firsts.iter().map(group).collect(), windows }
    }

    /// Indices of the groups that these rows lie in.
    fn of(&self, rows: &Range<usize>) -> Range<usize> {
        (rows.start - self.start) / self.high..(rows.end - self.start).div_ceil(self.high)
    }

    fn get(&self, k: usize) -> Option<Arc<Group<'r>>> {
        self.all[k].lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Drop the groups that only this window still needed. Their memory serves the next ones.
    fn done(&self, window: &Range<usize>, spare: &Spare) {
        for k in self.of(window) {
            if self.windows[k].fetch_sub(1, AcqRel) == 1 {
                let group = self.all[k].lock().unwrap_or_else(PoisonError::into_inner).take();
                let chunks = group.and_then(Arc::into_inner).map(|group| group.chunks).unwrap_or_default();
                spare.give(chunks.into_iter().filter_map(OnceLock::into_inner));
            }
        }
    }
}

/// What a thread does next.
enum Step {
    /// Unpack a chunk: the dataset, the group, and the place in the group.
    Unpack(usize, usize, usize),
    /// Gather rows of a window.
    Gather(usize, Range<usize>),
}

/// Ends the other threads where one fails.
struct Stop<'s>(&'s AtomicBool);

impl Drop for Stop<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.store(true, Relaxed);
        }
    }
}

/// One reading of rows by several threads. Each takes the next step of the list; to gather rows it waits for the chunks that other threads still
/// unpack, which come before it in the list.
struct Reading<'a, 'r> {
    columns: &'r [Column<'a>; 3],
    range: Range<usize>,
    windows: Vec<Range<usize>>,
    /// Number of steps of each window that still gather.
    left: Vec<AtomicUsize>,
    groups: [Groups<'r>; 3],
    spare: [Spare; 3],
    steps: Vec<Step>,
    next: AtomicUsize,
    stop: AtomicBool,
    failed: Mutex<Option<(usize, hdf5::Error)>>,
}

impl<'a, 'r> Reading<'a, 'r> {
    fn new(columns: &'r [Column<'a>; 3], range: Range<usize>, step: usize) -> Self {
        let size = (window_rows(columns) / step).max(1) * step;
        let windows: Vec<Range<usize>> = range.clone().step_by(size).map(|s| s..(s + size).min(range.end)).collect();
        let groups: [Groups<'_>; 3] = std::array::from_fn(|k| Groups::new(&columns[k], &range, &windows));
        let mut steps = Vec::new();
        let mut next = [0; 3];
        for (w, window) in windows.iter().enumerate() {
            for (k, groups) in groups.iter().enumerate() {
                let end = groups.of(window).end;
                steps.extend((next[k]..end).flat_map(|g| (0..columns[k].abreast).map(move |c| Step::Unpack(k, g, c))));
                next[k] = next[k].max(end);
            }
            steps.extend(window.clone().step_by(step).map(|s| Step::Gather(w, s..(s + step).min(window.end))));
        }
        let left = windows.iter().map(|w| AtomicUsize::new(w.len().div_ceil(step))).collect();
        let (next, stop, failed) = (AtomicUsize::new(0), AtomicBool::new(false), Mutex::new(None));
        Self { columns, range, windows, left, groups, spare: Default::default(), steps, next, stop, failed }
    }

    /// Do steps until none is left.
    fn run(&self, take: &(dyn Fn(RowPart<'_>) + Sync)) {
        let _stop = Stop(&self.stop);
        let mut buffers = Buffers::default();
        while !self.stop.load(Relaxed) {
            match self.steps.get(self.next.fetch_add(1, Relaxed)) {
                None => return,
                Some(Step::Unpack(k, g, c)) => self.unpack((*k, *g, *c)),
                Some(Step::Gather(w, rows)) => {
                    let Some(kept) = self.chunks_of(rows) else { return };
                    self.gather(&kept, rows, &mut buffers, take);
                    drop(kept);
                    if self.left[*w].fetch_sub(1, AcqRel) == 1 {
                        self.groups.iter().zip(&self.spare).for_each(|(g, spare)| g.done(&self.windows[*w], spare));
                    }
                }
            }
        }
    }

    fn unpack(&self, (k, g, c): (usize, usize, usize)) {
        let (column, Some(group)) = (&self.columns[k], self.groups[k].get(g)) else { return };
        match column.chunks.unpacked((group.first, c), &column.runs, &self.spare[k]) {
            Ok(unpacked) => {
                let _ = group.chunks[c].set(unpacked);
                group.missing.fetch_sub(1, Release);
            }
            Err(e) => {
                self.failed.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert((k, e));
                self.stop.store(true, Relaxed);
            }
        }
    }

    /// The groups of each dataset that these rows lie in, all unpacked. `None` where a thread has failed.
    fn chunks_of(&self, rows: &Range<usize>) -> Option<[Vec<Arc<Group<'r>>>; 3]> {
        let kept: [Vec<_>; 3] = std::array::from_fn(|k| self.groups[k].of(rows).filter_map(|g| self.groups[k].get(g)).collect());
        for group in kept.iter().flatten() {
            while group.missing.load(Acquire) > 0 {
                if self.stop.load(Relaxed) {
                    return None;
                }
                std::thread::yield_now();
            }
        }
        Some(kept)
    }

    fn gather(&self, kept: &[Vec<Arc<Group<'r>>>; 3], rows: &Range<usize>, b: &mut Buffers, take: &(dyn Fn(RowPart<'_>) + Sync)) {
        let n: usize = self.columns[0].chunks.shape[1..].iter().product();
        let len = rows.len() * n;
        if b.vis.len() != len {
            b.vis.resize(len, Complex::default());
            b.weights.resize(len, 0.0);
            b.stored_flags.resize(len, 0);
            b.flags.resize(len, false);
            b.filled.iter_mut().for_each(Vec::clear);
        }
        let [vis, weights, flags] = &mut b.filled;
        self.columns[0].gather(&kept[0], rows, (bytemuck::cast_slice_mut(&mut b.vis), vis));
        self.columns[1].gather(&kept[1], rows, (bytemuck::cast_slice_mut(&mut b.weights), weights));
        let before = (!flags.is_empty()).then(|| flags.clone());
        self.columns[2].gather(&kept[2], rows, (bytemuck::cast_slice_mut(&mut b.stored_flags), flags));
        if before.as_ref() != Some(flags) {
            b.flags.iter_mut().zip(&b.stored_flags).for_each(|(f, stored)| *f = *stored != 0);
        }
        let place = rows.start - self.range.start..rows.end - self.range.start;
        take(RowPart { rows: place, vis: &b.vis, weights: &b.weights, flags: &b.flags });
    }
}

/// Read rows and give them to `take` in parts of `step` rows, in any order and on any thread. With the error is the index of the dataset.
pub(super) fn read(
    datasets: Three<'_>,
    range: Range<usize>,
    step: usize,
    take: &(dyn Fn(RowPart<'_>) + Sync),
) -> Result<(), (usize, hdf5::Error)> {
    if range.is_empty() {
        return Ok(());
    }
    let columns =
        Column::three(datasets, Some(&range)).map_err(|e| (0, e))?.ok_or_else(|| (0, "values that can only be read as a whole".into()))?;
    let reading = Reading::new(&columns, range, step.max(1));
    // The threads are not those of the pool: the work of the pool may wait for what a reader reads.
    std::thread::scope(|scope| {
        for _ in 1..rayon::current_num_threads().min(reading.steps.len()) {
            scope.spawn(|| reading.run(take));
        }
        reading.run(take);
    });
    let failed = reading.failed.into_inner().unwrap_or_else(PoisonError::into_inner);
    failed.map_or(Ok(()), Err)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::{Array3, s};

    type Filters = fn(hdf5::DatasetBuilder) -> hdf5::DatasetBuilder;

    /// Parts of any size hold what was written, each row once, for chunks of any shape, with and without filters, and without chunks.
    #[test]
    fn parts_hold_every_row_once() {
        let folder = tempfile::tempdir().unwrap();
        let shape = (97, 6, 2);
        let at = |(i, j, k): (usize, usize, usize)| (i * 40 + j * 5 + k) as f64;
        let vis = Array3::from_shape_fn(shape, |p| Complex::new(at(p), -0.5 * at(p)));
        // Half of the weights are the same, and most flags.
        let weights = Array3::from_shape_fn(shape, |p| if p.0 < 50 { 3.0_f32 } else { at(p) as f32 });
        let flags = Array3::from_shape_fn(shape, |(i, j, _)| i == 60 && j == 2);
        let filters: [Filters; 3] = [|b| b, |b| b.lzf(), |b| b.shuffle().deflate(2)];
        let chunks = [Some((10_usize, 2, 1)), Some((97, 6, 2)), Some((7, 6, 2)), Some((16, 4, 1)), Some((1, 6, 1)), None];
        for (n, chunk) in chunks.into_iter().enumerate() {
            for (f, filters) in filters.iter().enumerate().take(if chunk.is_some() { 3 } else { 1 }) {
                let path = folder.path().join(format!("x{n}{f}.h5"));
                let file = hdf5::File::create(&path).unwrap();
                // The three datasets have chunks of different heights.
                let low = chunk.map(|chunk| (chunk.0.div_ceil(2), chunk.1, chunk.2));
                let with = |chunk: Option<(usize, usize, usize)>| {
                    let builder = filters(file.new_dataset_builder());
                    chunk.map_or_else(|| builder.clone().no_chunk(), |chunk| builder.clone().chunk(chunk))
                };
                let v = with(chunk).empty::<Complex<f64>>().shape(shape).create("v").unwrap();
                v.write(&vis).unwrap();
                let w = with(low).empty::<f32>().shape(shape).create("w").unwrap();
                w.write(&weights).unwrap();
                let g = with(chunk).empty::<bool>().shape(shape).create("f").unwrap();
                g.write(&flags).unwrap();
                drop((v, w, g, file));
                let file = hdf5::File::open(&path).unwrap();
                let [v, w, g] = ["v", "w", "f"].map(|name| file.dataset(name).unwrap());
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
