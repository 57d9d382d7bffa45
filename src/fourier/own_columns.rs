//! The columns of the image that each of several processes transforms, and keeps of all planes.

use super::fft::{BLOCK, columns_to_image, used_rows};
use super::plan::Plan;
use super::plane_rows::TILE;
use super::real::Real;
use cittert_arrays::{Letters, Ranks};
use ndarray::{Array2, s};
use num_complex::{Complex, Complex64};
use std::ops::Range;

/// Bytes that processes exchange at once.
const PART: usize = 1 << 19;

/// A stripe, and how many of its rows a process has.
pub(super) type StripeRows = (usize, usize);

/// The columns of process `rank` of `size`. They begin at a block of columns, so that every column is transformed as one process does it.
pub(super) fn columns_of(n_l: usize, rank: usize, size: usize) -> Range<usize> {
    let blocks = n_l.div_ceil(BLOCK);
    let at = |k: usize| (blocks * k / size * BLOCK).min(n_l);
    at(rank)..at(rank + 1)
}

/// Rows of planes whose pixels processes exchange at once.
pub(super) fn lines_at_once<T: Real>(n_l: usize) -> usize {
    (PART / (n_l * size_of::<Complex<T>>()).max(1)).max(1)
}

/// The columns of this process in the rows that are transformed, summed over all processes.
#[derive(Debug)]
pub(super) struct OwnColumns<T> {
    rank: usize,
    /// Those of each process.
    columns: Vec<Range<usize>>,
    /// \[row, plane, own column\] for each stripe that is complete.
    stripes: Vec<Vec<Complex<T>>>,
}

impl<T: Real> OwnColumns<T> {
    pub(super) fn new(plan: &Plan<T>, (rank, size): (usize, usize)) -> Self {
        Self { rank, columns: (0..size).map(|k| columns_of(plan.grid.n_l, k, size)).collect(), stripes: Vec::new() }
    }

    fn own(&self) -> Range<usize> {
        self.columns[self.rank].clone()
    }

    /// Add the next stripe of every process, as pixels \[row, plane, column\]. The sums are made in double precision and in the order of the
    /// processes, so that they are the same in every run.
    pub(super) fn take(&mut self, plan: &Plan<T>, stripe: &[Complex<T>], ranks: &dyn Ranks) {
        let (own, n_l) = (self.own(), plan.grid.n_l);
        let mut kept = Vec::with_capacity(stripe.len() / n_l * own.len());
        let at_once = lines_at_once::<T>(n_l);
        let (mut given, mut got, mut sums) = (Vec::new(), Vec::new(), Vec::new());
        for part in stripe.chunks(at_once * n_l) {
            if self.columns.len() == 1 {
                part.chunks_exact(n_l).for_each(|line| kept.extend_from_slice(&line[own.clone()]));
                continue;
            }
            given.clear();
            for columns in &self.columns {
                part.chunks_exact(n_l).for_each(|line| given.extend_from_slice(&line[columns.clone()]));
            }
            let n = part.len() / n_l;
            let lengths: Vec<usize> = self.columns.iter().map(|c| n * c.len() * size_of::<Complex<T>>()).collect();
            got.resize(self.columns.len() * n * own.len(), Complex::new(T::default(), T::default()));
            ranks.deal(bytemuck::cast_slice(&given), &lengths, bytemuck::cast_slice_mut(&mut got));
            sums.clear();
            sums.resize(n * own.len(), Complex64::default());
            for of_one in got.chunks_exact(sums.len().max(1)) {
                sums.iter_mut().zip(of_one).for_each(|(sum, v)| *sum += Complex64::new(v.re.to64(), v.im.to64()));
            }
            kept.extend(sums.iter().map(|v| Complex::new(T::of(v.re), T::of(v.im))));
        }
        self.stripes.push(kept);
    }

    /// Add a stripe of every process, as pixels \[row, plane, column\]: of each process, which stripe it is and how many of its rows it has. What several
    /// processes have of a stripe is added up in the order of the calls and of the processes.
    pub(super) fn trade(&mut self, plan: &Plan<T>, (stripe, of_each): (&[Complex<T>], &[Option<StripeRows>]), ranks: &dyn Ranks) {
        let (own, planes, n_l) = (self.own(), plan.planes(), plan.grid.n_l);
        self.stripes.resize_with(plan.tiles_v(), Vec::new);
        let lines: Vec<usize> = of_each.iter().map(|of| of.map_or(0, |(_, rows)| rows * planes)).collect();
        let at_once = lines_at_once::<T>(n_l);
        let (mut given, mut inbox) = (Letters::default(), Letters::default());
        for first in (0..lines.iter().copied().max().unwrap_or(0)).step_by(at_once) {
            let now = |process: usize| first.min(lines[process])..(first + at_once).min(lines[process]);
            let mine = &stripe[now(self.rank).start * n_l..now(self.rank).end * n_l];
            given.set_lengths(
                self.columns.iter().map(|columns| now(self.rank).len() * columns.len() * size_of::<Complex<T>>() / size_of::<u64>()),
            );
            for (columns, letter) in self.columns.iter().zip(given.each_mut()) {
                let places = bytemuck::cast_slice_mut(letter).chunks_exact_mut(columns.len().max(1));
                mine.chunks_exact(n_l).zip(places).for_each(|(line, place)| place.copy_from_slice(&line[columns.clone()]));
            }
            let underway = ranks.give(given);
            ranks.got(&mut inbox);
            for (process, of) in of_each.iter().enumerate() {
                let (Some((s, _)), here) = (of, now(process)) else { continue };
                let from_it = if process == self.rank { underway.letters() } else { &inbox }.of(process);
                let kept = &mut self.stripes[*s];
                kept.resize(used_rows(plan, *s) * planes * own.len(), Complex::new(T::default(), T::default()));
                let places = &mut kept[here.start * own.len()..here.end * own.len()];
                places.iter_mut().zip(bytemuck::cast_slice::<u64, Complex<T>>(from_it)).for_each(|(sum, v)| *sum += v);
            }
            given = underway.back();
        }
    }

    /// The image \[m, l\]: each process transforms its own columns, and all get those of all.
    pub(super) fn image<P: Real>(self, plan: &Plan<T>, ranks: &dyn Ranks) -> Array2<P> {
        let (own, planes) = (self.own(), plan.planes());
        let mut strip = Array2::<T>::zeros((plan.grid.n_m, own.len()));
        let row = |r: usize, p: usize, columns: Range<usize>| {
            let at = ((r % TILE) * planes + p) * own.len();
            &self.stripes[r / TILE][at + columns.start - own.start..at + columns.end - own.start]
        };
        columns_to_image(plan, 0..planes, row, (own.start, strip.view_mut()));
        let columns = self.columns;
        drop(self.stripes);
        let mut image = Array2::zeros((plan.grid.n_m, plan.grid.n_l));
        let at_once = (PART / (plan.grid.n_l * size_of::<T>()).max(1)).max(1);
        for first in (0..plan.grid.n_m).step_by(at_once) {
            let rows = first..(first + at_once).min(plan.grid.n_m);
            let mine: Vec<T> = strip.slice(s![rows.clone(), ..]).iter().copied().collect();
            let of_all = ranks.exchange(bytemuck::cast_slice(&mine).to_vec());
            for (columns, bytes) in columns.iter().zip(&of_all) {
                let values = bytes.chunks_exact(size_of::<T>()).map(bytemuck::pod_read_unaligned::<T>);
                let places = image.slice_mut(s![rows.clone(), columns.clone()]);
                places.into_iter().zip(values).for_each(|(place, v)| *place = P::of(v.to64()));
            }
        }
        image
    }
}
