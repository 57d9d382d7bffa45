//! Compares the fast transforms with the direct sum, and each with its adjoint.

use super::fixtures::{image_to_vis, image_to_vis_exact, vis_to_image, vis_to_image_exact};
use super::*;
use crate::fixtures::Noise;
use cittert_arrays::{SkyFrame, SkyGrid};
use ndarray::Array2;
use num_complex::{Complex, Complex64};

pub(super) struct Case {
    pub(super) grid: SkyGrid,
    pub(super) plane: Array2<f64>,
    pub(super) uvw: Array2<f64>,
    pub(super) freq: Vec<f64>,
    pub(super) vis: Array2<Complex64>,
    pub(super) weights: Array2<f64>,
}

/// Random rows that fill the grid `reach` times over, and random pixels.
pub(super) fn case(
    (n_l, n_m): (usize, usize),
    cell: f64,
    frame: SkyFrame,
    (rows, chans): (usize, usize),
    (reach, w_m): (f64, f64),
) -> Case {
    let mut noise = Noise(n_l as u64 * 31 + n_m as u64);
    let grid = SkyGrid::new(n_l, n_m, cell, frame).unwrap();
    let freq: Vec<f64> = (0..chans).map(|c| 1.0e9 + 2.0e7 * c as f64).collect();
    let longest = reach * 0.5 / cell * 0.3;
    let uvw = Array2::from_shape_fn((rows, 3), |(_, k)| noise.next() * if k < 2 { longest } else { w_m });
    let plane = Array2::from_shape_fn((n_m, n_l), |_| noise.next());
    let vis = Array2::from_shape_fn((rows, chans), |_| Complex64::new(noise.next(), noise.next()));
    let weights = Array2::from_shape_fn((rows, chans), |_| noise.next() + 1.0);
    Case { grid, plane, uvw, freq, vis, weights }
}

pub(super) fn sky() -> SkyFrame {
    SkyFrame::Sky { ra_rad: 0.0, dec_rad: 0.0, frame: "icrs".into() }
}

pub(super) fn relative<'a, I: Iterator<Item = (f64, f64)> + 'a>(pairs: I) -> f64 {
    let (e, t) = pairs.fold((0.0, 0.0), |(e, t), (a, b)| (e + (a - b) * (a - b), t + b * b));
    (e / t).sqrt()
}

/// Errors of both directions against the direct sum.
fn errors(c: &Case, opts: &GridOptions) -> (f64, f64) {
    let flags = (opts.w_term, opts.divide_by_n);
    let vis = image_to_vis(&c.grid, c.plane.view(), c.uvw.view(), &c.freq, opts).unwrap();
    let exact = image_to_vis_exact(&c.grid, c.plane.view(), c.uvw.view(), &c.freq, flags);
    let to_vis = relative(vis.iter().zip(&exact).flat_map(|(a, b)| [(a.re, b.re), (a.im, b.im)]));
    let image = vis_to_image(&c.grid, c.uvw.view(), &c.freq, c.vis.view(), c.weights.view(), opts).unwrap();
    let exact = vis_to_image_exact(&c.grid, c.uvw.view(), &c.freq, (c.vis.view(), c.weights.view()), flags);
    (to_vis, relative(image.iter().copied().zip(exact.iter().copied())))
}

fn assert_errors(c: &Case, opts: &GridOptions) {
    let (to_vis, to_image) = errors(c, opts);
    assert!(to_vis <= opts.epsilon, "to visibilities: {to_vis:e} for {opts:?}");
    assert!(to_image <= opts.epsilon, "to image: {to_image:e} for {opts:?}");
}

#[test]
fn errors_stay_below_every_requested_epsilon_with_and_without_w() {
    // A field of 0.05 rad with w up to 900 wavelengths: the phase of the w term turns by about half a turn.
    let c = case((24, 20), 0.002, sky(), (40, 3), (0.9, 200.0));
    for digits in 2..=12 {
        for w_term in [false, true] {
            assert_errors(&c, &GridOptions { epsilon: 10f64.powi(-digits), w_term, divide_by_n: false, ..GridOptions::default() });
        }
    }
}

#[test]
fn sizes_of_all_kinds_and_both_frames() {
    for (size, frame) in [
        ((18, 18), sky()),
        ((15, 25), sky()),
        ((27, 10), SkyFrame::Boresight),
        ((2, 3), SkyFrame::Boresight),
        ((17, 31), sky()),
        ((50, 36), sky()),
    ] {
        let c = case(size, 0.004, frame, (30, 2), (0.9, 100.0));
        for epsilon in [1e-4, 1e-8, 1e-12] {
            assert_errors(&c, &GridOptions { epsilon, w_term: true, divide_by_n: true, ..GridOptions::default() });
        }
    }
}

#[test]
fn wide_fields_take_many_planes_and_stay_exact() {
    // Half width 0.6: the corners lie at r^2 = 0.72, and w (n - 1) turns more than a hundred times.
    let c = case((30, 30), 0.04, sky(), (60, 2), (0.9, 80.0));
    for epsilon in [1e-3, 1e-5, 1e-7, 1e-11] {
        assert_errors(&c, &GridOptions { epsilon, w_term: true, divide_by_n: false, ..GridOptions::default() });
    }
}

#[test]
fn pixels_behind_the_horizon_count_for_nothing() {
    let c = case((30, 30), 0.06, SkyFrame::Boresight, (20, 1), (0.9, 3.0));
    assert_errors(&c, &GridOptions { epsilon: 1e-6, w_term: true, divide_by_n: true, ..GridOptions::default() });
    let image = vis_to_image(&c.grid, c.uvw.view(), &c.freq, c.vis.view(), c.weights.view(), &GridOptions::default()).unwrap();
    assert_eq!(image[(0, 0)], 0.0);
}

#[test]
fn baselines_far_outside_the_grid_alias_as_in_the_direct_sum() {
    let c = case((20, 24), 0.002, sky(), (40, 2), (7.3, 10.0));
    assert_errors(&c, &GridOptions { epsilon: 1e-6, w_term: true, divide_by_n: false, ..GridOptions::default() });
}

#[test]
fn many_channels_are_represented_by_few_without_loss() {
    let c = case((24, 24), 0.001, sky(), (12, 48), (0.4, 150.0));
    for epsilon in [1e-3, 1e-5, 1e-9, 1e-12] {
        assert_errors(&c, &GridOptions { epsilon, w_term: true, divide_by_n: false, ..GridOptions::default() });
    }
}

/// Visibilities in the precision of a transform.
pub(super) fn rounded<T: Real>(vis: &Array2<Complex64>) -> Array2<Complex<T>> {
    vis.mapv(|v| Complex::new(T::of(v.re), T::of(v.im)))
}

/// |<A x, y> - <x, A* y>| over |A x| |y|, in the precision of `T`.
fn adjoint_error<T: Real>(c: &Case, opts: &GridOptions) -> f64 {
    let extent = UvwExtent::of(c.uvw.view());
    let vis = rounded::<T>(&c.vis);
    let mut a = Array2::from_elem(c.vis.dim(), Complex::<T>::default());
    let d = Degridder::<T>::new(&c.grid, c.plane.view(), &c.freq, extent, opts, None).unwrap();
    d.predict(c.uvw.view(), a.view_mut()).unwrap();
    let mut g = Gridder::<T>::new(&c.grid, &c.freq, extent, opts).unwrap();
    g.add(c.uvw.view(), vis.view()).unwrap();
    let b: Array2<f64> = g.finish();
    let left: f64 = a.iter().zip(&vis).map(|(a, v)| a.re.to64() * v.re.to64() + a.im.to64() * v.im.to64()).sum();
    let right: f64 = b.iter().zip(&c.plane).map(|(b, x)| b * x).sum();
    let norm = |z: &Array2<Complex<T>>| z.iter().map(|z| z.re.to64().powi(2) + z.im.to64().powi(2)).sum::<f64>().sqrt();
    (left - right).abs() / (norm(&a) * norm(&vis))
}

/// In exact arithmetic the two directions are adjoint for every epsilon, so only rounding sets the limit: 2^-53 and 2^-24, times about
/// sqrt(operations) for a sum of a few hundred roundings of either sign. Single precision also rounds the phases of the w term, which is
/// the same in both directions.
#[test]
fn the_two_directions_are_adjoint() {
    for w_m in [0.0, 40.0, 4000.0] {
        let c = case((24, 18), 0.004, sky(), (50, 12), (0.8, w_m));
        for epsilon in [1e-3, 1e-5, 1e-7] {
            let opts = GridOptions { epsilon, w_term: true, divide_by_n: true, ..GridOptions::default() };
            let error = adjoint_error::<f64>(&c, &opts);
            assert!(error <= 1e-13, "{error:e} for {opts:?}, w {w_m}");
            if opts.single_precision_suffices() {
                let error = adjoint_error::<f32>(&c, &opts);
                assert!(error <= 20.0 * f64::from(f32::EPSILON), "{error:e} for {opts:?}, w {w_m}");
            }
        }
    }
}

#[test]
fn blocks_and_the_whole_give_the_same_and_so_do_conjugate_rows() {
    let c = case((20, 20), 0.004, sky(), (64, 3), (0.8, 300.0));
    let opts = GridOptions { epsilon: 1e-9, ..GridOptions::default() };
    let extent = UvwExtent::of(c.uvw.view());
    let mut whole = Gridder::<f64>::new(&c.grid, &c.freq, extent, &opts).unwrap();
    whole.add(c.uvw.view(), c.vis.view()).unwrap();
    let whole = whole.finish();
    let mut parts = Gridder::<f64>::new(&c.grid, &c.freq, extent, &opts).unwrap();
    for start in (0..64).step_by(10) {
        let end = (start + 10).min(64);
        let (uvw, vis) = (c.uvw.slice(ndarray::s![start..end, ..]), c.vis.slice(ndarray::s![start..end, ..]));
        // Reversed rows with conjugate visibilities are the same data.
        parts.add(uvw.mapv(|x| -x).view(), vis.mapv(|v| v.conj()).view()).unwrap();
    }
    let parts = parts.finish();
    assert!(relative(parts.iter().copied().zip(whole.iter().copied())) < 1e-13);
}

#[test]
fn bad_input_is_an_error_with_the_value() {
    let c = case((8, 8), 0.01, sky(), (3, 2), (0.5, 1.0));
    let opts = GridOptions::default();
    let mut uvw = c.uvw.clone();
    uvw[(1, 0)] = f64::NAN;
    let e = vis_to_image(&c.grid, uvw.view(), &c.freq, c.vis.view(), c.weights.view(), &opts).unwrap_err();
    assert!(e.to_string().contains("row 1"), "{e}");
    let mut plane = c.plane.clone();
    plane[(2, 3)] = f64::INFINITY;
    assert!(image_to_vis(&c.grid, plane.view(), c.uvw.view(), &c.freq, &opts).unwrap_err().to_string().contains("row 2"));
    for epsilon in [0.0, -1.0, f64::NAN, 1e-15, 1.0] {
        let opts = GridOptions { epsilon, ..opts };
        assert!(image_to_vis(&c.grid, c.plane.view(), c.uvw.view(), &c.freq, &opts).is_err());
    }
    assert!(image_to_vis(&c.grid, c.plane.view(), c.uvw.view(), &[], &opts).is_err());
    let mut g = Gridder::<f64>::new(&c.grid, &c.freq, UvwExtent { u_m: 0.1, v_m: 0.1, w_m: 0.1 }, &opts).unwrap();
    assert!(g.add(c.uvw.view(), c.vis.view()).is_err());
}
