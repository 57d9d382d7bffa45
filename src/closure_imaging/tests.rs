//! Closure imaging of a made-up source with made-up gains.

use super::dft::SmallDft;
use super::field::{co_located, gaussian};
use super::samples::Samples;
use super::*;
use crate::imaging::{DataCounts, ImageSize};
use crate::progress::Silent;
use cittert_arrays::quantity::Angle;
use cittert_arrays::{SkyFrame, SkyGrid};
use ndarray::Array2;
use num_complex::Complex64;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

const CELL: f64 = 2e-11;

/// Pairs, u and v of each, and the run of each moment.
type Coverage = (Vec<(usize, usize)>, Vec<[f64; 2]>, Vec<std::ops::Range<usize>>);

/// Seven stations at ten times over half a turn of the Earth. The first two stations are co-located.
fn coverage() -> Coverage {
    let place = [[0.0, 0.0], [1e5, 0.0], [3.1e9, 1.2e9], [-2.2e9, 3.3e9], [0.7e9, -3.6e9], [-1.1e9, -0.9e9], [2.4e9, -1.9e9]];
    let (mut pairs, mut uv, mut moments) = (Vec::new(), Vec::new(), Vec::new());
    for t in 0..10 {
        let (sin, cos) = (0.31 * f64::from(t)).sin_cos();
        let start = pairs.len();
        for p in 0..place.len() {
            for q in p + 1..place.len() {
                let (x, y) = (place[q][0] - place[p][0], place[q][1] - place[p][1]);
                pairs.push((p, q));
                uv.push([x * cos - y * sin, 0.7 * (x * sin + y * cos)]);
            }
        }
        moments.push(start..pairs.len());
    }
    (pairs, uv, moments)
}

/// Two blobs of 0.7 and 0.3 Jy with noise and antenna gains that are different in every moment.
fn observed(gain_error: f64) -> (SparseSet, SkyGrid, Vec<f64>) {
    let grid = SkyGrid::new(24, 24, CELL, SkyFrame::Boresight).unwrap();
    let blob = |dr: i64, dc: i64, flux: f64| -> Vec<f64> {
        let g = gaussian(&grid, 5.0 * CELL, flux);
        let at = |i: i64| (i / 24 - dr, i % 24 - dc);
        let inside = |(r, c): &(i64, i64)| (0..24).contains(r) && (0..24).contains(c);
        (0..576).map(|i| Some(at(i)).filter(inside).map_or(0.0, |(r, c)| g[(r * 24 + c) as usize])).collect()
    };
    let truth: Vec<f64> = blob(2, 2, 0.7).iter().zip(blob(-4, -5, 0.3)).map(|(a, b)| a + b).collect();
    let (pairs, uv, moments) = coverage();
    let exact = SmallDft::new(&grid, &uv).forward(&truth);
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(8);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let (mut vis, mut sigma) = (exact.clone(), vec![0.0; exact.len()]);
    for m in &moments {
        // The co-located pair measures the total flux, so its amplitudes are calibrated.
        let size = |a: usize, x: f64| if a < 2 { 1.0 } else { (gain_error * x).exp() };
        let gains: Vec<Complex64> = (0..7).map(|a| Complex64::from_polar(size(a, normal()), 9.0 * normal())).collect();
        for k in m.clone() {
            let v = exact[k] * gains[pairs[k].0] * gains[pairs[k].1].conj();
            // Noise of the receivers, and 2 % that does not close.
            sigma[k] = 2e-3_f64.hypot(0.02 * v.norm());
            vis[k] = v + sigma[k] * Complex64::new(normal(), normal());
        }
    }
    let samples = Samples::new(7, pairs, (vis, sigma), moments).unwrap();
    let names = (0..7).map(|a| a.to_string()).collect();
    let times_jd = vec![0.0; 10];
    (SparseSet { samples, uv, times_jd, names, phase_center: 0, counts: DataCounts::default() }, grid, truth)
}

fn options(terms: &str) -> ClosureImagingOptions {
    ClosureImagingOptions {
        terms: Some(terms.parse().unwrap()),
        size: Some(ImageSize::square(24)),
        cell: Some(Angle(CELL)),
        flux: FluxFrom::Given(1.0),
        rounds: 4,
        iterations: 100,
        ..ClosureImagingOptions::default()
    }
}

/// Largest correlation over shifts by whole cells, because closure quantities do not determine the position of the source.
fn shifted_correlation(a: &Array2<f64>, b: &[f64]) -> f64 {
    let mut best = 0.0_f64;
    for dr in -6..=6_i64 {
        for dc in -6..=6_i64 {
            let at = |i: i64| (i / 24 + dr, i % 24 + dc);
            let moved: Vec<f64> = (0..576)
                .map(|i| {
                    Some(at(i)).filter(|(r, c)| (0..24).contains(r) && (0..24).contains(c)).map_or(0.0, |(r, c)| b[(r * 24 + c) as usize])
                })
                .collect();
            best = best.max(correlation(a.as_slice().unwrap(), &moved));
        }
    }
    best
}

#[test]
fn closures_alone_show_the_source_through_any_gains() {
    let (set, _, truth) = observed(0.5);
    for terms in ["cphase,logcamp", "cphase,amp,vis"] {
        let image = reconstruct(&set, SkyFrame::Boresight, &options(terms), &Silent).unwrap();
        let r = shifted_correlation(&image.model, &truth);
        assert!(r > 0.98, "{terms}: {r}");
        for m in image.misfits.iter().filter(|m| m.name.contains("closure")) {
            assert!(m.chi2_per_datum < 1.5, "{terms}: {m:?}");
        }
        assert!((image.model.sum() - 1.0).abs() < 0.05, "{}", image.model.sum());
    }
}

#[test]
fn the_total_flux_is_found_where_short_baselines_see_more() {
    let (mut set, _, _) = observed(0.03);
    let short = co_located(&set, &ClosureImagingControl::default());
    assert_eq!(short.iter().filter(|s| **s).count(), 10);
    // Twice the flux of the image is on scales that only the co-located antennas measure.
    set.samples.scale(&short, 2.0);
    let wishes = ClosureImagingOptions { flux: FluxFrom::Likelihood, gain_error: 0.03, ..options("cphase,amp") };
    let image = reconstruct(&set, SkyFrame::Boresight, &wishes, &Silent).unwrap();
    assert!((image.flux - 1.0).abs() < 0.15, "{} of {:?}", image.flux, image.fluxes_tried);
}

#[test]
fn the_same_seed_gives_the_same_image_and_several_starts_a_spread() {
    let (set, _, _) = observed(0.1);
    let wishes = ClosureImagingOptions { starts: 3, rounds: 2, iterations: 30, ..options("cphase,amp") };
    let a = reconstruct(&set, SkyFrame::Boresight, &wishes, &Silent).unwrap();
    let b = reconstruct(&set, SkyFrame::Boresight, &wishes, &Silent).unwrap();
    assert_eq!(a.model, b.model);
    assert_eq!(a.starts.len(), 3);
    assert!(a.spread.unwrap().iter().any(|s| *s > 0.0));
    assert!(a.starts.iter().all(|s| s.correlation > 0.9), "{:?}", a.starts);
    assert!((a.starts[a.best].correlation - 1.0).abs() < 1e-12);
}
fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    dot(a, b) / (dot(a, a) * dot(b, b)).sqrt()
}
