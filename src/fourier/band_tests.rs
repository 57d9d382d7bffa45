//! Compares gridding by bands with gridding at once: one process with several numbers of bands, and several processes.

use super::bands::{Sides, split};
use super::plane_rows::PlaneRows;
use super::tests::{Case, case, relative, rounded, sky};
use super::*;
use crate::fixtures::as_processes;
use cittert_arrays::{Alone, Ranks};
use ndarray::{Array2, s};
use num_complex::Complex;
use std::collections::BTreeMap;
use std::ops::Range;

/// Rows of a block.
pub(super) const BLOCK: usize = 17;

pub(super) fn transform<T: Real>(c: &Case, options: &GridOptions) -> Transform<T> {
    Transform::new(&c.grid, &c.freq, UvwExtent::of(c.uvw.view()), options, 1 << 40).unwrap()
}

/// So many bands of one process.
fn in_bands<T: Real>(transform: &Transform<T>, count: usize) -> Bands {
    let alone = Bands::of(&transform.plan, (0, 1)).unwrap();
    Bands { tiles: split(transform.plan.tiles_v(), count), ..alone }
}

/// Call `add` for each block of some rows, with the first row and the sorted rows.
pub(super) fn blocks<T: Real>(c: &Case, transform: &Transform<T>, rows: &Range<usize>, mut add: impl FnMut(usize, &SortedRows)) {
    for start in rows.clone().step_by(BLOCK) {
        let block = start..(start + BLOCK).min(rows.end);
        add(start, &transform.sort(c.uvw.slice(s![block, ..])).unwrap());
    }
}

pub(super) fn at_once<T: Real>(c: &Case, transform: &Transform<T>) -> Array2<f64> {
    let (mut gridder, vis) = (transform.gridder(), rounded::<T>(&c.vis));
    blocks(c, transform, &(0..c.uvw.nrows()), |first, rows| {
        gridder.add_sorted(rows, |r, out| out.iter_mut().zip(vis.row(first + r)).for_each(|(o, v)| *o = *v)).unwrap();
    });
    gridder.finish()
}

fn by_bands<T: Real>(c: &Case, transform: &Transform<T>, bands: &Bands, (rows, ranks): (Range<usize>, &dyn Ranks)) -> Array2<f64> {
    let (vis, mut gridder) = (rounded::<T>(&c.vis), transform.band_gridder(bands));
    for _ in 0..bands.count() {
        blocks(c, transform, &rows, |first, rows| {
            gridder.add_sorted(rows, |r, out| out.iter_mut().zip(vis.row(first + r)).for_each(|(o, v)| *o = *v)).unwrap();
        });
        gridder.close(ranks);
    }
    gridder.finish(ranks)
}

/// Replaces predicted visibilities by weighted residuals, and gives the sum of their squares.
fn subtract<T: Real>(c: &Case, row: usize, vis: &mut [Complex<T>]) -> f64 {
    let mut power = 0.0;
    for (k, v) in vis.iter_mut().enumerate() {
        *v = (Complex::new(T::of(c.vis[(row, k)].re), T::of(c.vis[(row, k)].im)) - *v).scale(T::of(c.weights[(row, k)]));
        power += v.norm_sqr().to64();
    }
    power
}

fn residual_at_once<T: Real>(c: &Case, transform: &Transform<T>) -> (f64, Array2<f64>) {
    let (model, mut gridder, mut power) = (transform.degridder(c.plane.view()).unwrap(), transform.gridder(), 0.0);
    blocks(c, transform, &(0..c.uvw.nrows()), |first, rows| {
        power += gridder.add_residual(rows, &model, |r, vis| subtract(c, first + r, vis)).unwrap();
    });
    (power, gridder.finish())
}

fn residual_by_bands<T: Real>(
    c: &Case,
    transform: &Transform<T>,
    bands: &Bands,
    (rows, ranks): (Range<usize>, &dyn Ranks),
) -> (f64, Array2<f64>) {
    let mut model = transform.band_degridder(bands, c.plane.view()).unwrap();
    let (mut nodes, mut power) = (BTreeMap::new(), 0.0);
    for _ in 0..bands.count() {
        model.open(ranks);
        blocks(c, transform, &rows, |first, rows| {
            model.add_to(rows, nodes.entry(first).or_insert_with(|| transform.nodes(rows))).unwrap();
        });
    }
    blocks(c, transform, &rows, |first, rows| {
        let nodes = nodes.get_mut(&first).unwrap();
        power += nodes.turn(rows, |r, vis| subtract(c, first + r, vis)).unwrap();
    });
    let mut gridder = transform.band_gridder(bands);
    for _ in 0..bands.count() {
        blocks(c, transform, &rows, |first, rows| gridder.add_nodes(rows, &nodes[&first]).unwrap());
        gridder.close(ranks);
    }
    let mut power = [power];
    ranks.sum(&mut power);
    (power[0], gridder.finish(ranks))
}

fn compare<T: Real>(c: &Case, options: &GridOptions) {
    let one = transform::<T>(c, options);
    let (expected, (power, expected_residual)) = (at_once(c, &one), residual_at_once(c, &one));
    // Sums are made in another order. Each of them is wrong by a few roundings.
    let bound = 16.0 * if size_of::<T>() == 4 { f64::from(f32::EPSILON) } else { f64::EPSILON };
    let check = |image: &Array2<f64>, (found, residual): &(f64, Array2<f64>), what: &str| {
        for (image, expected) in [(image, &expected), (residual, &expected_residual)] {
            let error = relative(image.iter().copied().zip(expected.iter().copied()));
            assert!(error <= bound, "{what}: {error:e} for {:?}, {options:?}", c.grid);
        }
        assert!((found / power - 1.0).abs() <= 1e-12, "{what}: {found} {power}");
    };
    for count in [1, 2, 3, 1000] {
        let (bands, all) = (in_bands(&one, count), 0..c.uvw.nrows());
        let image = by_bands(c, &one, &bands, (all.clone(), &Alone));
        check(&image, &residual_by_bands(c, &one, &bands, (all, &Alone)), &format!("{count} bands"));
    }
    for size in [2, 3, 5] {
        let n = c.uvw.nrows();
        let images = as_processes(size, |ranks| {
            let own = transform::<T>(c, options);
            let bands = own.bands(&*ranks).unwrap();
            let rows = n * ranks.rank() / size..n * (ranks.rank() + 1) / size;
            (by_bands(c, &own, &bands, (rows.clone(), &*ranks)), residual_by_bands(c, &own, &bands, (rows, &*ranks)))
        });
        check(&images[0].0, &images[0].1, &format!("{size} processes"));
        assert!(images.iter().all(|image| image == &images[0]), "{size} processes");
    }
}

/// Powers of w, planes of w and no w; squares, odd sides and wide fields; bands of frequencies in which a row stays in a band of v, and bands in which it
/// crosses many.
#[test]
fn bands_give_the_image_of_all_at_once() {
    for (sides, w_m, chans) in
        [((24, 60), 0.0, 3), ((33, 75), 40.0, 40), ((130, 45), 400.0, 3), ((64, 128), 40.0, 1), ((51, 150), 40.0, 40)]
    {
        let c = case(sides, 0.004, sky(), (90, chans), (0.8, w_m));
        compare::<f64>(&c, &GridOptions { epsilon: 1e-9, ..GridOptions::default() });
        compare::<f32>(&c, &GridOptions { epsilon: 1e-5, ..GridOptions::default() });
        compare::<f64>(&c, &GridOptions { epsilon: 1e-4, w_term: false, ..GridOptions::default() });
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bits_by_bands() {
    let c = case((130, 60), 0.004, sky(), (300, 20), (0.8, 40.0));
    let image = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let one = transform::<f32>(&c, &GridOptions::default());
            by_bands(&c, &one, &in_bands(&one, 3), (0..300, &Alone))
        })
    };
    let one = image(1);
    assert!([2, 5].into_iter().all(|n| image(n) == one));
}

#[test]
fn each_of_several_processes_holds_its_share_of_the_padded_planes() {
    let c = case((1024, 1024), 0.000_4, sky(), (2, 1), (0.9, 0.0));
    let plan = &transform::<f32>(&c, &GridOptions::default()).plan;
    let sides = Sides::of(plan);
    let all = PlaneRows::<f32>::bytes(plan.n_rows, plan.planes(), plan.nu) as f64;
    for processes in [2, 4, 8] {
        let share = sides.bytes(&sides.bands(processes).unwrap(), processes) as f64 / all;
        // A band has whole stripes, and one stripe of the next band.
        let whole = 2.0 / plan.tiles_v() as f64;
        assert!(share <= 1.0 / processes as f64 + whole, "{share} for {processes} processes");
    }
}

#[test]
fn visibilities_over_the_edge_of_the_grid_are_not_gridded_by_bands() {
    let mut c = case((24, 60), 0.004, sky(), (40, 3), (0.8, 40.0));
    assert!(transform::<f64>(&c, &GridOptions::default()).bands(&Alone).is_some());
    c.uvw.column_mut(1).mapv_inplace(|v| 8.0 * v);
    assert!(transform::<f64>(&c, &GridOptions::default()).bands(&Alone).is_none());
}
