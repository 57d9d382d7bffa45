//! Compares passes that share a transform, its buffers and its rows with the direct sum.

use super::fixtures::{image_to_vis_exact, vis_to_image_exact};
use super::tests::{Case, case, relative, rounded, sky};
use super::*;
use ndarray::Array2;
use num_complex::{Complex, Complex64};
use rayon::prelude::*;

/// One thread or two.
fn on_threads<R: Send>(n: usize, work: impl FnOnce() -> R + Send) -> R {
    rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap().install(work)
}

/// Image of weight (V - model) by one fused pass.
fn residual<T: Real>(c: &Case, transform: &Transform<T>, rows: &SortedRows) -> Array2<f64> {
    let model = transform.degridder(c.plane.view()).unwrap();
    let mut g = transform.gridder();
    let seen = rounded::<T>(&c.vis);
    let power: f64 = g
        .add_residual(rows, &model, |r, vis| {
            let mut power = 0.0;
            for (k, v) in vis.iter_mut().enumerate() {
                *v = (seen[(r, k)] - *v).scale(T::of(c.weights[(r, k)]));
                power += v.norm_sqr().to64();
            }
            power
        })
        .unwrap();
    assert!(power > 0.0);
    g.finish()
}

fn exact_residual(c: &Case, w_term: bool) -> Array2<f64> {
    let model = image_to_vis_exact(&c.grid, c.plane.view(), c.uvw.view(), &c.freq, (w_term, false));
    let left = &c.vis - &model;
    vis_to_image_exact(&c.grid, c.uvw.view(), &c.freq, (left.view(), c.weights.view()), (w_term, false))
}

/// The test covers every digit of accuracy, with and without w, 1 and 2 threads, coarse grids (many visibilities expected) and fine ones
/// (few). Each case runs twice, so that the second pass uses the buffers of the first.
#[test]
fn fused_passes_reach_every_epsilon() {
    let c = case((24, 20), 0.002, sky(), (40, 3), (0.9, 200.0));
    for w_term in [true, false] {
        let exact = exact_residual(&c, w_term);
        for digits in 2..=12 {
            let options = GridOptions { epsilon: 10f64.powi(-digits), w_term, divide_by_n: false, ..GridOptions::default() };
            for (n_vis, threads) in [(1, 1), (1 << 40, 2)] {
                on_threads(threads, || {
                    let extent = UvwExtent::of(c.uvw.view());
                    let transform = Transform::<f64>::new(&c.grid, &c.freq, extent, &options, n_vis).unwrap();
                    let rows = transform.sort(c.uvw.view()).unwrap();
                    for _ in 0..2 {
                        let error = relative(residual(&c, &transform, &rows).iter().copied().zip(exact.iter().copied()));
                        // The model is rounded in the prediction and again in the gridding.
                        assert!(error <= 2.0 * options.epsilon, "{error:e} for {options:?}, {n_vis} visibilities");
                    }
                });
            }
        }
    }
}

/// Single precision, which is the default of the imager: the error is at most that of the request in both directions, plus 2^-23 times the growth
/// of rounding in sums of some thousand terms (30). Random visibilities do not cancel against the model, so that the residual is as large as they are.
#[test]
fn fused_passes_in_single_precision_reach_every_epsilon_that_selects_it() {
    for (size, cell, rows, w_m) in [((24, 20), 0.002, (40, 3), 200.0), ((50, 36), 0.004, (60, 12), 100.0), ((30, 30), 0.03, (60, 4), 80.0)]
    {
        let c = case(size, cell, sky(), rows, (0.9, w_m));
        for w_term in [true, false] {
            let exact = exact_residual(&c, w_term);
            for epsilon in [1e-2, 1e-3, 1e-4, 1e-5] {
                let options = GridOptions { epsilon, w_term, ..GridOptions::default() };
                assert!(options.single_precision_suffices());
                for n_vis in [1, 1 << 40] {
                    let transform = Transform::<f32>::new(&c.grid, &c.freq, UvwExtent::of(c.uvw.view()), &options, n_vis).unwrap();
                    let sorted = transform.sort(c.uvw.view()).unwrap();
                    let error = relative(residual(&c, &transform, &sorted).iter().copied().zip(exact.iter().copied()));
                    assert!(error <= 2.0 * epsilon + 30.0 * f64::from(f32::EPSILON), "{error:e} for {options:?}, {size:?}");
                }
            }
        }
    }
}

/// A model that explains the data leaves only the rounding of single precision: 2^-24 for each of some hundred roundings of either sign, and the
/// error of the transform.
#[test]
fn the_residual_of_the_true_model_is_rounding_in_single_precision() {
    let mut c = case((40, 36), 0.003, sky(), (80, 6), (0.9, 60.0));
    c.vis = image_to_vis_exact(&c.grid, c.plane.view(), c.uvw.view(), &c.freq, (true, false));
    let whole = vis_to_image_exact(&c.grid, c.uvw.view(), &c.freq, (c.vis.view(), c.weights.view()), (true, false));
    let size = |a: &Array2<f64>| a.iter().map(|v| v * v).sum::<f64>().sqrt();
    for epsilon in [1e-3, 1e-5] {
        let options = GridOptions { epsilon, ..GridOptions::default() };
        let transform = Transform::<f32>::new(&c.grid, &c.freq, UvwExtent::of(c.uvw.view()), &options, 1 << 40).unwrap();
        let rows = transform.sort(c.uvw.view()).unwrap();
        let left = size(&residual(&c, &transform, &rows)) / size(&whole);
        assert!(left <= epsilon + 30.0 * f64::from(f32::EPSILON), "{left:e} for {epsilon:e}");
    }
}

/// Sides with small prime factors and sides without, fields that need planes of w and fields that do not.
#[test]
fn fused_passes_on_sizes_of_all_kinds() {
    for (size, cell, w_m) in [((30, 27), 0.004, 100.0), ((50, 36), 0.001, 10.0), ((128, 100), 0.01, 60.0), ((17, 31), 0.03, 80.0)] {
        let c = case(size, cell, sky(), (50, 12), (0.9, w_m));
        let exact = exact_residual(&c, true);
        for (epsilon, n_vis) in [(1e-5, 1 << 40), (1e-5, 1), (1e-9, 1 << 40)] {
            let options = GridOptions { epsilon, w_term: true, divide_by_n: false, ..GridOptions::default() };
            let transform = Transform::<f64>::new(&c.grid, &c.freq, UvwExtent::of(c.uvw.view()), &options, n_vis).unwrap();
            let rows = transform.sort(c.uvw.view()).unwrap();
            let error = relative(residual(&c, &transform, &rows).iter().copied().zip(exact.iter().copied()));
            assert!(error <= 2.0 * epsilon, "{error:e} for {epsilon:e}, {size:?}, {n_vis} visibilities");
        }
    }
}

#[test]
fn the_two_directions_of_a_transform_are_adjoint() {
    for (w_m, threads) in [(0.0, 1), (40.0, 2), (4000.0, 2)] {
        let c = case((24, 18), 0.004, sky(), (50, 12), (0.8, w_m));
        on_threads(threads, || {
            let options = GridOptions { epsilon: 1e-6, ..GridOptions::default() };
            let transform = Transform::<f64>::new(&c.grid, &c.freq, UvwExtent::of(c.uvw.view()), &options, 1 << 40).unwrap();
            let rows = transform.sort(c.uvw.view()).unwrap();
            let mut a = Array2::from_elem(c.vis.dim(), Complex64::default());
            transform.degridder(c.plane.view()).unwrap().predict(c.uvw.view(), a.view_mut()).unwrap();
            let mut g = transform.gridder();
            g.add_sorted(&rows, |r, vis| vis.iter_mut().zip(c.vis.row(r)).for_each(|(v, x)| *v = *x)).unwrap();
            let b: Array2<f64> = g.finish();
            let left: f64 = a.iter().zip(&c.vis).map(|(a, v)| a.re * v.re + a.im * v.im).sum();
            let right: f64 = b.iter().zip(&c.plane).map(|(b, x)| b * x).sum();
            let scale = a.iter().map(|a| a.norm_sqr()).sum::<f64>().sqrt() * c.vis.iter().map(|v| v.norm_sqr()).sum::<f64>().sqrt();
            assert!((left - right).abs() <= 1e-12 * scale, "{left} {right} {w_m}");
        });
    }
}

/// Nodes that are set in parts, in any order, and those of rows with the same visibilities, are those that rows give one by one.
#[test]
fn nodes_in_parts_and_of_equal_rows_give_the_same_image() {
    for (n_rows, step) in [(1, 4), (700, 32), (700, 9), (5000, 1000)] {
        let c = case((24, 18), 0.004, sky(), (n_rows, 12), (0.8, 40.0));
        let transform = Transform::<f32>::new(
            &c.grid,
            &c.freq,
            UvwExtent::of(c.uvw.view()),
            &GridOptions { epsilon: 1e-5, ..GridOptions::default() },
            6,
        )
        .unwrap();
        let rows = transform.sort(c.uvw.view()).unwrap();
        let of_row = |r: usize, out: &mut [Complex<f32>]| {
            out.iter_mut().zip(c.vis.row(r)).for_each(|(o, v)| *o = Complex::new(v.re as f32, v.im as f32));
        };
        let mut one_by_one = transform.gridder();
        one_by_one.add_sorted(&rows, of_row).unwrap();
        let mut nodes = transform.nodes(&rows);
        {
            let parts = nodes.in_parts(&rows, step).unwrap();
            let starts: Vec<usize> = (0..n_rows).step_by(step).collect();
            starts.into_par_iter().rev().for_each(|start| {
                // A part may come in pieces.
                let (middle, end) = ((start + step / 2).min(n_rows), (start + step).min(n_rows));
                parts.set(middle..end, |k, out| of_row(middle + k, out));
                parts.set(start..middle, |k, out| of_row(start + k, out));
            });
        }
        let mut in_parts = transform.gridder();
        in_parts.add_nodes(&rows, &nodes).unwrap();
        assert_eq!(in_parts.finish::<f32>(), one_by_one.finish::<f32>(), "{n_rows} {step}");
        let (mut each, mut equal) = (transform.gridder(), transform.gridder());
        each.add_sorted(&rows, |_, out| of_row(0, out)).unwrap();
        let mut first = vec![Complex::default(); 12];
        of_row(0, &mut first);
        equal.add_equal(&rows, &first).unwrap();
        assert_eq!(equal.finish::<f32>(), each.finish::<f32>(), "{n_rows} {step}");
        assert!(transform.gridder().add_equal(&rows, &first[1..]).is_err());
    }
}

#[test]
fn rows_of_another_transform_are_refused() {
    let c = case((8, 8), 0.01, sky(), (3, 2), (0.5, 1.0));
    let new = || Transform::<f64>::new(&c.grid, &c.freq, UvwExtent::of(c.uvw.view()), &GridOptions::default(), 6).unwrap();
    let (one, other) = (new(), new());
    let rows = one.sort(c.uvw.view()).unwrap();
    let e = other.gridder().add_sorted(&rows, |_, _| ()).unwrap_err();
    assert!(e.to_string().contains("sort them with the transform that grids them"), "{e}");
    let model = other.degridder(c.plane.view()).unwrap();
    assert!(one.gridder().add_residual(&rows, &model, |_, _| 0.0).is_err());
}

/// Crowded tiles, tiles over the edge of the grid, few and many slabs of w: the image has the same bytes.
#[test]
fn any_number_of_threads_gives_the_same_image() {
    for (cell, wide, w_max) in [(0.002, (0.9, 40.0), 0.0), (0.002, (0.05, 40.0), 30.0), (0.02, (0.9, 400.0), 60.0)] {
        let grid = (96, 80);
        let mut c = case(grid, cell, sky(), (9000, 3), wide);
        c.uvw.column_mut(2).mapv_inplace(|w| if w_max > 0.0 { w.clamp(-w_max, w_max) } else { 0.0 });
        let options = GridOptions { epsilon: 1e-4, ..GridOptions::default() };
        let images: Vec<Array2<f64>> = [1, 2, 3, 5]
            .map(|threads| {
                on_threads(threads, || {
                    let transform = Transform::<f32>::new(&c.grid, &c.freq, UvwExtent::of(c.uvw.view()), &options, 1 << 20).unwrap();
                    let rows = transform.sort(c.uvw.view()).unwrap();
                    residual(&c, &transform, &rows)
                })
            })
            .into();
        assert!(images[1..].iter().all(|i| i == images[0]), "cell {cell}");
    }
}
