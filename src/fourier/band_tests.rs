//! Compares gridding by bands with gridding at once: one process with several numbers of bands, and several processes.

use super::bands::{banded_bytes, bands, split};
use super::plane_rows::PlaneRows;
use super::tests::{Case, case, relative, rounded, sky};
use super::*;
use crate::fixtures::as_processes;
use cittert_arrays::{Alone, Ranks};
use ndarray::{Array2, s};
use std::ops::Range;
use std::sync::Arc;

/// Rows of a block.
const BLOCK: usize = 17;

fn transform<T: Real>(c: &Case, options: &GridOptions) -> Transform<T> {
    Transform::new(&c.grid, &c.freq, UvwExtent::of(c.uvw.view()), options, 1 << 40).unwrap()
}

/// Call `add` for each block of some rows, with the first row and the sorted rows.
fn blocks<T: Real>(c: &Case, transform: &Transform<T>, rows: &Range<usize>, mut add: impl FnMut(usize, &SortedRows)) {
    for start in rows.clone().step_by(BLOCK) {
        let block = start..(start + BLOCK).min(rows.end);
        add(start, &transform.sort(c.uvw.slice(s![block, ..])).unwrap());
    }
}

fn at_once<T: Real>(c: &Case, transform: &Transform<T>) -> Array2<f64> {
    let (mut gridder, vis) = (transform.gridder(), rounded::<T>(&c.vis));
    blocks(c, transform, &(0..c.uvw.nrows()), |first, rows| {
        gridder.add_sorted(rows, |r, out| out.iter_mut().zip(vis.row(first + r)).for_each(|(o, v)| *o = *v)).unwrap();
    });
    gridder.finish()
}

fn by_bands<T: Real>(
    c: &Case,
    transform: &Transform<T>,
    mut gridder: BandGridder<T>,
    (rows, ranks): (Range<usize>, &dyn Ranks),
) -> Array2<f64> {
    let vis = rounded::<T>(&c.vis);
    for _ in 0..gridder.bands() {
        blocks(c, transform, &rows, |first, rows| {
            gridder.add_sorted(rows, |r, out| out.iter_mut().zip(vis.row(first + r)).for_each(|(o, v)| *o = *v)).unwrap();
        });
        gridder.close(ranks);
    }
    gridder.finish(ranks)
}

fn compare<T: Real>(c: &Case, options: &GridOptions) {
    let one = transform::<T>(c, options);
    let expected = at_once(c, &one);
    // Sums are made in another order. Each of them is wrong by a few roundings.
    let bound = 16.0 * if size_of::<T>() == 4 { f64::from(f32::EPSILON) } else { f64::EPSILON };
    let check = |image: &Array2<f64>, what: &str| {
        let error = relative(image.iter().copied().zip(expected.iter().copied()));
        assert!(error <= bound, "{what}: {error:e} for {:?}, {options:?}", c.grid);
    };
    for count in [1, 2, 3, 1000] {
        let bands = split(one.plan.tiles_v(), count);
        let gridder = BandGridder::on(Arc::clone(&one.plan), bands, (0, 1));
        check(&by_bands(c, &one, gridder, (0..c.uvw.nrows(), &Alone)), &format!("{count} bands"));
    }
    for size in [2, 3, 5] {
        let n = c.uvw.nrows();
        let images = as_processes(size, |ranks| {
            let own = transform::<T>(c, options);
            let gridder = own.band_gridder(&*ranks).unwrap();
            let rows = n * ranks.rank() / size..n * (ranks.rank() + 1) / size;
            by_bands(c, &own, gridder, (rows, &*ranks))
        });
        check(&images[0], &format!("{size} processes"));
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
            let gridder = BandGridder::on(Arc::clone(&one.plan), split(one.plan.tiles_v(), 3), (0, 1));
            by_bands(&c, &one, gridder, (0..300, &Alone))
        })
    };
    let one = image(1);
    assert!([2, 5].into_iter().all(|n| image(n) == one));
}

#[test]
fn each_of_several_processes_holds_its_share_of_the_planes() {
    let c = case((1024, 1024), 0.000_4, sky(), (2, 1), (0.9, 0.0));
    let plan = &transform::<f32>(&c, &GridOptions::default()).plan;
    let all = PlaneRows::<f32>::bytes(plan.n_rows, plan.planes(), plan.nu) as f64;
    for processes in [2, 4, 8] {
        let share = banded_bytes(plan, &bands(plan, processes).unwrap(), processes) as f64 / all;
        // A band has whole stripes, and one stripe of the next band.
        let whole = 2.0 / plan.tiles_v() as f64;
        assert!(share <= 1.0 / processes as f64 + whole, "{share} for {processes} processes");
    }
}

#[test]
fn visibilities_over_the_edge_of_the_grid_are_not_gridded_by_bands() {
    let mut c = case((24, 60), 0.004, sky(), (40, 3), (0.8, 40.0));
    assert!(transform::<f64>(&c, &GridOptions::default()).band_gridder(&Alone).is_some());
    c.uvw.column_mut(1).mapv_inplace(|v| 8.0 * v);
    assert!(transform::<f64>(&c, &GridOptions::default()).band_gridder(&Alone).is_none());
}
