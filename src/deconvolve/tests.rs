//! Compares the deconvolvers with plain versions of the same algorithms and with known components.

use super::minor::Peak;
use super::*;
use crate::fixtures::Noise;
use ndarray::{ArcArray2, Array2};

/// A beam with wide side lobes all over the image.
fn beam(n_m: usize, n_l: usize) -> Array2<f64> {
    let mut noise = Noise(7);
    let mut waves: Vec<(f64, f64)> = (0..200).map(|_| (noise.next() * 1.2, noise.next() * 1.2)).collect();
    waves.push((0.0, 0.3));
    let mut psf = Array2::from_shape_fn((n_m, n_l), |(i, j)| {
        let (y, x) = (i as f64 - (n_m / 2) as f64, j as f64 - (n_l / 2) as f64);
        waves.iter().map(|(a, b)| (a * x + b * y).cos()).sum::<f64>() / waves.len() as f64
    });
    psf[(n_m / 2, n_l / 2)] = 1.0;
    psf
}

fn single(psf: &Array2<f64>) -> Array2<f64> {
    psf.mapv(|v| f64::from(v as f32))
}

/// The beam around (row, column), as far as it reaches.
fn shifted(psf: &Array2<f64>, row: usize, column: usize) -> Array2<f64> {
    let (n_m, n_l) = psf.dim();
    Array2::from_shape_fn((n_m, n_l), |(i, j)| {
        psf.get(((i + n_m / 2).wrapping_sub(row), (j + n_l / 2).wrapping_sub(column))).copied().unwrap_or(0.0)
    })
}

fn dirty(psf: &Array2<f64>, sources: &[(usize, usize, f64)]) -> Array2<f64> {
    sources.iter().fold(Array2::zeros(psf.dim()), |sum, (i, j, f)| sum + shifted(psf, *i, *j) * *f)
}

fn shared(psf: &Array2<f64>) -> ArcArray2<f32> {
    psf.mapv(|v| v as f32).into_shared()
}

/// The first pixel with the largest value within the mask.
fn peak_of_plain(image: &Array2<f64>, mask: Option<&Array2<bool>>, negative: bool) -> Option<Peak> {
    let size = |v: f64| if negative { v.abs() } else { v };
    let inside = image.indexed_iter().filter(|(at, v)| size(**v) > 0.0 && mask.is_none_or(|m| m[*at]));
    let best = inside.reduce(|a, b| if size(*b.1) > size(*a.1) { b } else { a });
    best.map(|((row, column), value)| Peak { value: *value, row, column })
}

/// Högbom's algorithm in its plainest form, in double precision.
fn plain(psf: &Array2<f64>, residual: &mut Array2<f64>, mask: Option<&Array2<bool>>, limits: &MinorLimits) -> Vec<Component> {
    let mut out = Vec::new();
    while out.len() < limits.iterations {
        let Some(Peak { value, row, column }) = peak_of_plain(residual, mask, limits.negative) else { break };
        if value.abs() <= limits.level {
            break;
        }
        let flux = limits.gain * value;
        *residual -= &(shifted(psf, row, column) * flux);
        out.push(Component { row, column, flux, scale_px: 0.0 });
    }
    out
}

fn run(
    name: &str,
    psf: &Array2<f64>,
    image: &Array2<f64>,
    mask: Option<&Array2<bool>>,
    limits: MinorLimits,
) -> (MinorReport, Array2<f64>, Array2<f64>) {
    let mut d = (by_name(name).unwrap().make)(&shared(psf), &Scales::default(), &CleanTuning::default()).unwrap();
    let mut residual = image.mapv(|v| v as f32);
    let report = d.minor(Minor { residual: &mut residual, mask, limits }).unwrap();
    let mut model = Array2::zeros(image.dim());
    d.draw(&report.components, &mut model);
    (report, residual.mapv(f64::from), model)
}

const LIMITS: MinorLimits = MinorLimits { gain: 0.1, level: 0.0, iterations: 400, negative: true };

#[test]
fn lazy_tiles_give_the_components_of_the_plain_algorithm() {
    // The sides are not multiples of the tile, with and without a mask and negative components.
    let psf = single(&beam(90, 110));
    let image = single(&dirty(&psf, &[(20, 30, 1.0), (70, 95, -0.6), (45, 50, 0.3), (0, 0, 0.5), (89, 3, 0.2)]));
    let mask = Array2::from_shape_fn(image.dim(), |(i, j)| (i + j) % 7 != 0);
    // Each component rounds a pixel of at most 1, and its product with the beam, to single precision: 2^-25 each, with random signs. This is five
    // times the standard deviation after all of them.
    let rounding = 5.0 * (2.0 * LIMITS.iterations as f64 / 3.0).sqrt() * 2.0_f64.powi(-25);
    for (mask, negative) in [(None, true), (Some(&mask), true), (None, false), (Some(&mask), false)] {
        let limits = MinorLimits { negative, ..LIMITS };
        let mut residual = image.clone();
        let expected = plain(&psf, &mut residual, mask, &limits);
        let (report, left, model) = run("hogbom", &psf, &image, mask, limits);
        assert_eq!(report.components.len(), expected.len());
        for (a, b) in report.components.iter().zip(&expected) {
            assert_eq!((a.row, a.column), (b.row, b.column));
            assert!((a.flux - b.flux).abs() < limits.gain * rounding, "{} {}", a.flux, b.flux);
        }
        assert!(left.iter().zip(&residual).all(|(a, b)| (a - b).abs() < rounding));
        assert!((model.sum() - expected.iter().map(|c| c.flux).sum::<f64>()).abs() < LIMITS.iterations as f64 * limits.gain * rounding);
    }
}

#[test]
fn a_source_on_the_grid_leaves_exactly_one_minus_gain_to_the_n() {
    let psf = beam(64, 64);
    let image = dirty(&psf, &[(40, 21, 3.0)]);
    for name in ["hogbom", "clark"] {
        for n in [1, 7, 40] {
            let (report, left, _) = run(name, &psf, &image, None, MinorLimits { iterations: n, ..LIMITS });
            assert_eq!(report.components.len(), n);
            let expected = 3.0 * 0.9_f64.powi(n as i32);
            // Each of the n subtractions may round a value of at most 3 to single precision, 2^-25 of it relative to 1.
            assert!((left[(40, 21)] - expected).abs() < 3.0 * f64::from(f32::EPSILON), "{name} {n}: {} {expected}", left[(40, 21)]);
        }
    }
}

#[test]
fn the_level_the_iterations_and_the_empty_image_stop_a_cycle() {
    let psf = beam(64, 64);
    let image = dirty(&psf, &[(40, 21, 3.0), (12, 50, 1.0)]);
    for entry in &TABLE {
        let (r, left, _) = run(entry.name, &psf, &image, None, MinorLimits { level: 0.5, iterations: 10_000, ..LIMITS });
        assert_eq!(r.stop, MinorStop::Level, "{}", entry.name);
        assert!(left.iter().all(|v| v.abs() <= 0.5 + 1e-7), "{}", entry.name);
        let (r, ..) = run(entry.name, &psf, &image, None, MinorLimits { iterations: 5, ..LIMITS });
        assert_eq!((r.stop, r.components.len()), (MinorStop::Iterations, 5), "{}", entry.name);
        let (r, ..) = run(entry.name, &psf, &Array2::zeros((64, 64)), None, LIMITS);
        assert_eq!((r.stop, r.components.len()), (MinorStop::Nothing, 0), "{}", entry.name);
        let nowhere = Array2::from_elem((64, 64), false);
        let (r, ..) = run(entry.name, &psf, &image, Some(&nowhere), LIMITS);
        assert_eq!(r.components.len(), 0, "{}", entry.name);
    }
}

#[test]
fn clark_agrees_with_hogbom_where_both_are_done() {
    let psf = beam(96, 80);
    let sources = [(40, 21, 3.0), (12, 50, 1.0), (80, 70, 0.5)];
    let image = dirty(&psf, &sources);
    let limits = MinorLimits { level: 0.01, iterations: 10_000, ..LIMITS };
    for name in ["hogbom", "clark"] {
        let (_, _, model) = run(name, &psf, &image, None, limits);
        for (i, j, f) in sources {
            assert!((model[(i, j)] - f).abs() < 0.05, "{name} at {i} {j}: {} {f}", model[(i, j)]);
        }
    }
}

#[test]
fn a_residual_that_grows_is_stopped_at_its_best() {
    // With a side lobe of -1.5, every component adds more to the residual than it removes.
    let mut psf = Array2::zeros((40, 40));
    psf[(20, 20)] = 1.0;
    psf[(20, 25)] = -1.5;
    let mut image = Array2::zeros((40, 40));
    image[(20, 5)] = 1.0;
    let (r, left, model) = run("hogbom", &psf, &image, None, MinorLimits { gain: 0.9, ..LIMITS });
    assert_eq!(r.stop, MinorStop::Diverged);
    assert!(left.iter().all(|v| v.abs() <= 1.0 + 1e-7));
    assert!((model.sum() - r.components.iter().map(|c| c.flux).sum::<f64>()).abs() < 1e-12);
}

#[test]
fn multiscale_takes_an_extended_source_with_few_wide_components() {
    let n = 96;
    let psf = Array2::from_shape_fn((n, n), |(i, j)| {
        let r2 = (i as f64 - 48.0).powi(2) + (j as f64 - 48.0).powi(2);
        (-r2 / 8.0).exp() - 0.005 * (-r2 / 800.0).exp()
    }) / 0.995;
    let blob = Array2::from_shape_fn((n, n), |(i, j)| (-((i as f64 - 44.0).powi(2) + (j as f64 - 52.0).powi(2)) / 160.0).exp());
    let engine = crate::fourier::Convolver::<f64>::new((n, n), n / 2 + 1);
    let image = engine.convolve(blob.view(), &engine.kernel(psf.view()));
    let top = image.iter().copied().fold(0.0, f64::max);
    let limits = MinorLimits { level: 0.05 * top, iterations: 3000, ..LIMITS };
    let (r, _, model) = run("multiscale", &psf, &image, None, limits);
    assert_eq!(r.stop, MinorStop::Level);
    let wide: f64 = r.components.iter().filter(|c| c.scale_px > 0.0).map(|c| c.flux).sum();
    assert!(wide > 0.7 * blob.sum(), "{wide} of {}", blob.sum());
    let error = (&model - &blob).iter().map(|v| v * v).sum::<f64>().sqrt() / blob.iter().map(|v| v * v).sum::<f64>().sqrt();
    assert!(error < 0.15, "{error}");
}

#[test]
fn bad_beams_masks_and_names_are_refused() {
    let make = by_name("hogbom").unwrap().make;
    assert!(make(&ArcArray2::zeros((8, 8)), &Scales::default(), &CleanTuning::default()).is_err());
    assert!(by_name("magic").unwrap_err().to_string().contains("hogbom, clark, multiscale"));
    let psf = beam(16, 16);
    let mut d = make(&shared(&psf), &Scales::default(), &CleanTuning::default()).unwrap();
    let mut residual = Array2::zeros((16, 15));
    assert!(d.minor(Minor { residual: &mut residual, mask: None, limits: LIMITS }).is_err());
    let scales = Scales { widths_px: vec![-1.0], ..Scales::default() };
    assert!((by_name("multiscale").unwrap().make)(&shared(&psf), &scales, &CleanTuning::default()).is_err());
}
