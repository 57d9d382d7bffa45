//! The transform against path lengths that are measured with a ruler.

use super::*;
use crate::fixtures::{Noise, positions};
use crate::nearfield::Surface;
use crate::progress::Silent;
use cittert_arrays::{Antenna, ArrayLayout, ElementPattern, FocusPoint, LayoutFrame, SPEED_OF_LIGHT_M_S};

const WAVELENGTH_M: f64 = 3.2e-3;

fn layout(places: &[[f64; 3]], pattern: &str) -> ArrayLayout {
    let antennas = places.iter().enumerate().map(|(k, p)| Antenna::new(format!("a{k}"), k as u32, *p)).collect();
    let mut layout = ArrayLayout::new("test", LayoutFrame::Boresight, antennas).unwrap();
    layout.pattern = pattern.parse().unwrap();
    layout
}

fn freqs(n: usize) -> Vec<f64> {
    let mid = SPEED_OF_LIGHT_M_S / WAVELENGTH_M;
    (0..n).map(|c| mid + 2.5e8 * (c as f64 - 0.5 * (n as f64 - 1.0))).collect()
}

/// The voltage product and the phase of a pair, from the places of the point and of the antennas in space.
fn seen(at: [f64; 3], p: [f64; 3], q: [f64; 3], freq: f64, pattern: &ElementPattern) -> Complex64 {
    let arm = |r: [f64; 3]| {
        let d = [at[0] - r[0], at[1] - r[1], at[2] - r[2]];
        let length = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
        (length, pattern.voltage(d[0] / length, d[1] / length, freq))
    };
    let range = (at[0] * at[0] + at[1] * at[1] + at[2] * at[2]).sqrt();
    let ((dp, vp), (dq, vq)) = (arm(p), arm(q));
    let k = std::f64::consts::TAU * freq / SPEED_OF_LIGHT_M_S;
    // exp(-i k (d_q - d_p)), phased to the boresight at infinity.
    Complex64::from_polar(vp * vq * range * range / (dp * dq), k * (dp - dq - (q[2] - p[2])))
}

struct Scene {
    points: Vec<Point>,
    places: Vec<[f64; 3]>,
    flux: Vec<f64>,
}

fn scene(n: usize, range_m: f64) -> Scene {
    let mut noise = Noise(7);
    let half = 7.0_f64.to_radians().sin();
    let surface = Surface::Plane(range_m);
    let lm: Vec<(f64, f64)> = (0..n).map(|_| (half * noise.next(), half * noise.next())).collect();
    let points: Vec<Point> = lm.iter().map(|(l, m)| Point::on(&surface, *l, *m).unwrap()).collect();
    let place = |(l, m): &(f64, f64)| {
        let n = (1.0 - l * l - m * m).sqrt();
        [l / n * range_m, m / n * range_m, range_m]
    };
    Scene { places: lm.iter().map(place).collect(), points, flux: (0..n).map(|_| noise.next()).collect() }
}

#[test]
fn visibilities_are_the_sum_over_paths() {
    // D = 1 m at 3.2 mm: 10 m, and 0.05 times the far-field distance 2 D^2 / lambda = 625 m.
    let places = positions(14, 0.5, 0.03, 5);
    for (range, pattern) in [(10.0, "none"), (31.25, "none"), (10.0, "gaussian fwhm_deg=9"), (10.0, "airy diameter_m=0.02"), (1.5, "none")]
    {
        let layout = layout(&places, pattern);
        let scene = scene(700, range);
        let freq = freqs(40);
        let transform =
            PathTransform::new(Elements::new(&layout, None).unwrap(), scene.points.clone(), &freq, MemoryBudget::default()).unwrap();
        let table = transform.predict::<f64>(|_, k| scene.flux[k], &Silent).unwrap();
        let single = transform.predict::<f32>(|_, k| scene.flux[k], &Silent).unwrap();
        let total: f64 = scene.flux.iter().map(|v| v.abs()).sum();
        for (c, p, q) in [(0, 0, 1), (3, 2, 13), (39, 4, 9), (31, 13, 0), (33, 5, 5)] {
            let truth: Complex64 =
                scene.places.iter().zip(&scene.flux).map(|(at, s)| seen(*at, places[p], places[q], freq[c], &layout.pattern) * s).sum();
            let error = (table.at(c, p, q) - truth).norm() / total;
            assert!(error < 1e-11, "{range} m, {pattern}: {error:e}");
            assert!((single.at(c, p, q) - truth).norm() < 1e-6 * total, "{range} m, {pattern}");
        }
    }
}

#[test]
fn at_infinity_the_sum_is_that_of_the_far_field_to_rounding() {
    let places = positions(9, 0.5, 0.1, 6);
    let scene = scene(300, 1e3);
    let freq = freqs(3);
    let elements = Elements::new(&layout(&places, "none"), None).unwrap();
    for curvature in [0.0, 1e-16] {
        let points = scene.points.iter().map(|p| Point { curvature, ..*p }).collect();
        let transform = PathTransform::new(elements.clone(), points, &freq, MemoryBudget::default()).unwrap();
        let table = transform.predict::<f64>(|_, k| scene.flux[k], &Silent).unwrap();
        for (p, q) in [(0, 1), (3, 8)] {
            let far: Complex64 = (scene.points.iter().zip(&scene.flux))
                .map(|(x, s)| {
                    let [l, m, n] = x.toward;
                    let b = [0, 1, 2].map(|k| places[q][k] - places[p][k]);
                    Complex64::from_polar(
                        *s,
                        std::f64::consts::TAU * (b[0] * l + b[1] * m + b[2] * (n - 1.0)) * freq[1] / SPEED_OF_LIGHT_M_S,
                    )
                })
                .sum();
            assert!((table.at(1, p, q) - far).norm() < 1e-11, "{curvature}: {:e}", (table.at(1, p, q) - far).norm());
        }
    }
}

#[test]
fn image_and_visibilities_are_adjoint_and_do_not_depend_on_the_threads() {
    let places = positions(11, 0.5, 0.0, 8);
    let scene = scene(600, 10.0);
    let freq = freqs(5);
    let focus = FocusPoint::new(0.02, -0.01, 10.0).unwrap();
    let elements = Elements::new(&layout(&places, "gaussian fwhm_deg=12"), Some(focus)).unwrap();
    let transform = PathTransform::new(elements, scene.points.clone(), &freq, MemoryBudget::default()).unwrap();
    let mut sums = Pairs::zeros(5, 11);
    let mut noise = Noise(3);
    for c in 0..5 {
        (0..11).for_each(|p| (p + 1..11).for_each(|q| sums.add(c, p, q, Complex64::new(noise.next(), noise.next()))));
    }
    let one = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            (transform.adjoint::<f64>(&sums, &Silent).unwrap(), transform.predict::<f64>(|_, k| scene.flux[k], &Silent).unwrap())
        })
    };
    let (image, vis) = one(1);
    assert!(one(3) == (image.clone(), vis.clone()), "the same bytes for any number of threads");
    let left: f64 = image.iter().zip(&scene.flux).map(|(a, b)| a * b).sum();
    let mut right = 0.0;
    for c in 0..5 {
        for p in 0..11 {
            right += (p + 1..11).map(|q| (sums.at(c, p, q).conj() * vis.at(c, p, q)).re).sum::<f64>();
        }
    }
    assert!((left - right).abs() < 1e-12 * right.abs().max(1.0), "{left} {right}");
    // The power at a point is the sum of |h_1 h_2|^2 over the pairs.
    let weights = ndarray::Array2::from_shape_fn((11, 11), |(p, q)| if p < q { (p + 2 * q) as f64 } else { 0.0 });
    let power = transform.power(weights.view());
    let alone = PathTransform::new(transform.elements().clone(), vec![scene.points[17]], &freq[2..3], MemoryBudget::default()).unwrap();
    let point = alone.predict::<f64>(|_, _| 1.0, &Silent).unwrap();
    let truth: f64 = weights.indexed_iter().map(|((p, q), w)| w * point.at(0, p, q).norm_sqr()).sum();
    assert!((power[17] / truth - 1.0).abs() < 1e-12);
}

#[test]
fn a_request_to_stop_ends_the_work() {
    let places = positions(5, 0.5, 0.0, 8);
    let recorder = crate::fixtures::Recorder::default();
    recorder.cancel();
    let elements = Elements::new(&layout(&places, "none"), None).unwrap();
    let transform = PathTransform::new(elements, scene(10, 10.0).points, &freqs(1), MemoryBudget::default()).unwrap();
    assert!(matches!(transform.predict::<f64>(|_, _| 1.0, &recorder), Err(ChainError::Cancelled)));
    assert!(matches!(transform.adjoint::<f64>(&Pairs::zeros(1, 5), &recorder), Err(ChainError::Cancelled)));
}
