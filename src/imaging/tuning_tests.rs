//! How much the constants of CLEAN matter: each is halved and doubled on three scenes and two layouts.

use super::major::CleanOptions;
use super::*;
use crate::deconvolve::{CleanTuning, by_name};
use crate::fixtures::{Noise, positions, snapshot};
use crate::progress::Silent;
use cittert_arrays::{Polarization, VisUnit, VisibilitySet};
use ndarray::Array2;
use rayon::prelude::*;

const SIDE: usize = 64;
const CELL: f64 = 1e-3;

/// A Y of 21 antennas.
fn y_shape() -> Vec<[f64; 3]> {
    let arm = |a: usize| (1..=7).map(move |k| (std::f64::consts::TAU * (a as f64 + 0.1) / 3.0, 0.5 * (k as f64 / 7.0).powf(1.7)));
    (0..3).flat_map(arm).map(|(angle, r)| [r * angle.cos(), r * angle.sin(), 0.0]).collect()
}

/// Points, a Gaussian of 12 cells FWHM, and a ring of 12 cells radius with a point in it.
fn scenes() -> [Vec<(f64, f64, f64)>; 3] {
    let points = vec![(0.012, 0.005, 1.0), (-0.004, 0.009, 0.4), (-0.0153, -0.0122, 0.2)];
    let mut noise = Noise(11);
    let blob = (0..400).map(|_| {
        let mut normal = || (0..12).map(|_| noise.next()).sum::<f64>() / 2.0;
        (5.1e-3 * normal(), 5.1e-3 * normal(), 1.0 / 400.0)
    });
    let turn = |k: usize| std::f64::consts::TAU * k as f64 / 120.0;
    let ring = (0..120).map(|k| (0.012 * turn(k).cos(), 0.012 * turn(k).sin(), 1.0 / 120.0));
    [points, blob.collect(), ring.chain([(0.002, -0.003, 0.3)]).collect()]
}

/// One set with the image of its truth: the sources convolved with the restoring beam.
struct Case {
    set: VisibilitySet,
    truth: Array2<f64>,
}

fn options() -> ImagingOptions {
    ImagingOptions {
        size: Some(ImageSize::square(SIDE)),
        cell: Some(cittert_arrays::quantity::Angle(CELL)),
        weighting: Weighting::Natural,
        ..ImagingOptions::default()
    }
}

fn cases() -> Vec<Case> {
    let layouts = [positions(24, 0.5, 0.0, 3), y_shape()];
    let all = layouts.iter().flat_map(|layout| scenes().map(|sources| (layout.clone(), sources)));
    all.map(|(layout, sources)| {
        let mut set = snapshot(&layout, &[94e9, 100e9], &[Polarization::I], &sources, (0.02, VisUnit::Jy));
        let mut imager = Imager::new(&mut set, options(), &Silent).unwrap();
        let psf = imager.psf(0, &Silent).unwrap();
        let (beam, grid) = (imager.beam_of(psf.view()).unwrap(), imager.grid().clone());
        let (sin, cos) = beam.bpa_rad.sin_cos();
        let truth = Array2::from_shape_fn((SIDE, SIDE), |(i, j)| {
            let at = |(l, m, flux): &(f64, f64, f64)| {
                let (l, m) = (grid.l_at(j as f64) - l, grid.m_at(i as f64) - m);
                let (a, b) = ((l * sin + m * cos) / beam.bmaj_rad, (l * cos - m * sin) / beam.bmin_rad);
                flux * (-4.0 * std::f64::consts::LN_2 * (a * a + b * b)).exp()
            };
            sources.iter().map(at).sum::<f64>()
        });
        Case { set, truth }
    })
    .collect()
}

fn rms(a: &Array2<f64>) -> f64 {
    (a.iter().map(|v| v * v).sum::<f64>() / a.len() as f64).sqrt()
}

/// Rms error of the restored image, relative to the rms of the truth.
fn error(case: &Case, algorithm: &str, tuning: CleanTuning) -> f64 {
    let mut set = case.set.clone();
    let mut imager = Imager::new(&mut set, options(), &Silent).unwrap();
    let algorithm = by_name(algorithm).unwrap().into();
    let opts = CleanOptions { algorithm, niter: 1500, nsigma: 4.0, auto_mask: Some(5.0), max_major: 20, tuning, ..CleanOptions::default() };
    let out = clean(&mut imager, &opts, &Silent).unwrap();
    rms(&(&out.restored.plane(0, 0) - &case.truth)) / rms(&case.truth)
}

/// The limits of `CleanTuning`'s documentation.
#[test]
fn halving_and_doubling_each_constant_stays_within_its_limit() {
    type Change = fn(&mut CleanTuning, f64);
    let table: [(&str, &str, f64, Change); 15] = [
        ("side_lobe_margin", "hogbom", 0.01, |t, x| t.side_lobe_margin *= x),
        ("main_lobe_fwhm", "hogbom", 0.01, |t, x| t.main_lobe_fwhm *= x),
        ("mask_growth", "hogbom", 0.01, |t, x| t.mask_growth *= x),
        ("major_divergence", "hogbom", 0.01, |t, x| t.major_divergence = 1.0 + (t.major_divergence - 1.0) * x),
        ("minor_divergence", "hogbom", 0.01, |t, x| t.minor_divergence = 1.0 + (t.minor_divergence - 1.0) * x),
        ("trust_margin", "hogbom", 0.01, |t, x| t.trust_margin *= x),
        ("clark_active", "clark", 0.01, |t, x| t.clark_active = (t.clark_active as f64 * x) as usize),
        ("clark_patch", "clark", 0.01, |t, x| t.clark_patch *= x),
        ("clark_patch_least", "clark", 0.01, |t, x| t.clark_patch_least = (t.clark_patch_least as f64 * x) as usize),
        ("first_scale", "multiscale", 0.30, |t, x| t.first_scale *= x),
        ("scale_ratio", "multiscale", 0.30, |t, x| t.scale_ratio = 1.0 + (t.scale_ratio - 1.0) * x),
        ("largest_scale", "multiscale", 0.40, |t, x| t.largest_scale = (t.largest_scale * x).min(0.5)),
        ("least_measured", "multiscale", 0.30, |t, x| t.least_measured = (t.least_measured * x).min(0.9)),
        ("hole_edge", "multiscale", 0.01, |t, x| t.hole_edge *= x),
        ("hand_over", "multiscale", 0.25, |t, x| t.hand_over = 1.0 - (1.0 - t.hand_over) * x),
    ];
    let cases = cases();
    let usual = |algorithm: &str| cases.par_iter().map(|c| error(c, algorithm, CleanTuning::default())).collect::<Vec<f64>>();
    let usual = [("hogbom", usual("hogbom")), ("clark", usual("clark")), ("multiscale", usual("multiscale"))];
    let mut report = Vec::new();
    for (name, algorithm, limit, change) in table {
        let before = &usual.iter().find(|u| u.0 == algorithm).unwrap().1;
        for factor in [0.5, 2.0] {
            let mut tuning = CleanTuning::default();
            change(&mut tuning, factor);
            tuning.check().unwrap();
            let after: Vec<f64> = cases.par_iter().map(|c| error(c, algorithm, tuning)).collect();
            let worst = before.iter().zip(&after).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            report.push((name, factor, worst, limit));
        }
    }
    assert!(report.iter().all(|r| r.2 <= r.3), "{usual:?}\n{report:#?}");
}

#[test]
fn constants_out_of_range_are_refused_by_name() {
    let say = |tuning: CleanTuning| tuning.check().unwrap_err().to_string();
    assert!(say(CleanTuning { hand_over: 1.0, ..CleanTuning::default() }).starts_with("hand_over is 1"));
    assert!(say(CleanTuning { scale_ratio: 1.0, ..CleanTuning::default() }).contains("above 1"));
    assert!(say(CleanTuning { side_lobe_margin: f64::NAN, ..CleanTuning::default() }).contains("side_lobe_margin is NaN"));
    CleanTuning::default().check().unwrap();
}
