//! Compares gridding by several processes, each of which holds a part of the planes, with gridding at once.

use super::band_tests::{BLOCK, at_once, transform};
use super::tests::{Case, case, relative, sky};
use super::*;
use crate::fixtures::as_processes;
use cittert_arrays::{Alone, Ranks};
use ndarray::{Array2, s};
use num_complex::Complex;

/// Rows of a part.
const STEP: usize = 5;

/// The image of a process and of those that share the rows with it. The first process has no rows, and so the fewest blocks.
fn shared<T: Real>(c: &Case, options: &GridOptions, ranks: &dyn Ranks) -> Array2<f64> {
    let (n, transform) = (c.uvw.nrows(), transform::<T>(c, options));
    let (rank, size) = (ranks.rank(), ranks.size());
    let part = if size == 1 { 0..n } else { n * rank.saturating_sub(1) / (size - 1)..n * rank / (size - 1) };
    let rows = c.uvw.slice(s![part.clone(), ..]);
    let sample = SampleOfRows { spread: (rows, 1.0), block: (rows, 1) };
    let mut gridder = transform.shared_gridder(sample, ranks).unwrap().unwrap();
    for round in 0..n.div_ceil(BLOCK) {
        let first = (part.start + round * BLOCK).min(part.end);
        let block = first..(first + BLOCK).min(part.end);
        if block.is_empty() {
            gridder.add(None, ranks).unwrap();
            continue;
        }
        let rows = transform.fold(c.uvw.slice(s![block.clone(), ..])).unwrap();
        let mut letters = gridder.letters(rows).unwrap();
        let half = |v: Complex<f64>| Complex::new(T::of(0.5 * v.re), T::of(0.5 * v.im));
        // The rows of a part may come in several pieces and in any order.
        let parts = letters.in_parts(STEP);
        for start in (0..block.len()).step_by(STEP).rev() {
            let end = (start + STEP).min(block.len());
            let middle = (start + 2).min(end);
            for piece in [middle..end, start..middle] {
                let fill = |r: usize, out: &mut [Complex<T>]| {
                    out.iter_mut().zip(c.vis.row(first + piece.start + r)).for_each(|(o, v)| *o = half(*v));
                };
                parts.set(piece.clone(), fill);
            }
        }
        drop(parts);
        gridder.add(Some((letters, T::of(2.0))), ranks).unwrap();
    }
    gridder.finish(ranks).unwrap()
}

/// Powers of w, planes of w and no w; rows that stay in the tiles of one process and rows that cross many; more processes than rows of tiles; and most
/// visibilities in one row of tiles, which every process grids.
#[test]
fn processes_with_parts_of_the_planes_make_the_image_of_one() {
    for (sides, w_m, chans, flat) in
        [((24, 60), 0.0, 3, 1.0), ((33, 175), 40.0, 40, 1.0), ((130, 145), 400.0, 3, 1.0), ((51, 350), 40.0, 40, 0.02)]
    {
        let mut c = case(sides, 0.004, sky(), (90, chans), (0.8, w_m));
        c.uvw.slice_mut(s![..80, 1]).mapv_inplace(|v| flat * v);
        for (epsilon, w_term) in [(1e-5, true), (1e-4, false)] {
            let options = GridOptions { epsilon, w_term, ..GridOptions::default() };
            let expected = at_once(&c, &transform::<f32>(&c, &options));
            let mut images = vec![shared::<f32>(&c, &options, &Alone)];
            for size in [2, 3, 5] {
                let of_each = as_processes(size, |ranks| shared::<f32>(&c, &options, &*ranks));
                assert!(of_each.iter().all(|image| *image == of_each[0]));
                images.extend(of_each.into_iter().take(1));
            }
            for image in images {
                let error = relative(image.iter().copied().zip(expected.iter().copied()));
                assert!(error <= 16.0 * f64::from(f32::EPSILON), "{error:e} for {:?}, {options:?}", c.grid);
            }
        }
        let options = GridOptions { epsilon: 1e-9, ..GridOptions::default() };
        let expected = at_once(&c, &transform::<f64>(&c, &options));
        let image = as_processes(3, |ranks| shared::<f64>(&c, &options, &*ranks)).remove(0);
        assert!(relative(image.iter().copied().zip(expected.iter().copied())) <= 16.0 * f64::EPSILON);
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bits_from_shared_planes() {
    let c = case((130, 160), 0.004, sky(), (300, 20), (0.8, 40.0));
    let image = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| shared::<f32>(&c, &GridOptions::default(), &Alone))
    };
    let one = image(1);
    assert!([2, 5].into_iter().all(|n| image(n) == one));
}
