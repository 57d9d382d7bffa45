//! The error of residuals without visibilities, and CLEAN that goes deep where it is small.

use super::major::{CleanOptions, CleanStatistics, StopReason};
use super::trust::Trust;
use super::*;
use crate::deconvolve::{CleanTuning, Component, by_name};
use crate::fixtures::{Noise, positions, snapshot};
use crate::fourier::Convolver;
use crate::progress::Silent;
use cittert_arrays::quantity::Angle;
use cittert_arrays::{Polarization, VisUnit, VisibilitySet};
use ndarray::Array2;

const SIDE: usize = 96;
const CELL: f64 = 1e-3;

/// Sources (l, m, flux): one of 1 Jy far from the centre, and fainter ones everywhere.
fn sources(seed: u64) -> Vec<(f64, f64, f64)> {
    let mut noise = Noise(seed);
    let reach = 0.42 * SIDE as f64 * CELL;
    let faint = (0..12).map(|k| (reach * noise.next(), reach * noise.next(), 0.3 / (1.0 + f64::from(k)))).collect::<Vec<_>>();
    faint.into_iter().chain([(0.8 * reach, -0.7 * reach, 1.0)]).collect()
}

/// An array that is not in one plane: its w term changes the beam over the image.
fn set(seed: u64, height_m: f64, sigma: f64) -> VisibilitySet {
    snapshot(&positions(27, 0.6, height_m, seed), &[90e9, 96e9], &[Polarization::I], &sources(seed), (sigma, VisUnit::Jy))
}

fn options(weighting: Weighting) -> ImagingOptions {
    ImagingOptions { size: Some(ImageSize::square(SIDE)), cell: Some(Angle(CELL)), weighting, ..ImagingOptions::default() }
}

/// The ratio that one bright source shows predicts the errors of many fainter ones, to a factor that the margin covers.
#[test]
fn the_error_of_one_source_predicts_that_of_many() {
    for (seed, height) in [(1, 0.2), (2, 0.5), (3, 0.0), (4, 1.0)] {
        let mut set = set(seed, height, 0.0);
        let mut imager = Imager::new(&mut set, options(Weighting::Natural), &Silent).unwrap();
        let psf = imager.psf(0, &Silent).unwrap();
        let dirty = imager.dirty(0, &Silent).unwrap();
        let beam_px = 2.0;
        let engine = Convolver::<f64>::new((SIDE, SIDE), SIDE);
        let kernel = engine.kernel(psf.view());
        let hogbom = by_name("hogbom").unwrap();
        let deconvolver = (hogbom.make)(&psf.mapv(|v| v as f32).into_shared(), &Default::default(), &CleanTuning::default()).unwrap();
        let all: Vec<Component> = sources(seed)
            .iter()
            .map(|(l, m, flux)| Component::point((m / CELL) as usize + SIDE / 2, ((l / CELL) + SIDE as f64 / 2.0) as usize, *flux))
            .map(|c| Component { row: c.row.min(SIDE - 1), column: c.column.min(SIDE - 1), ..c })
            .collect();
        let (one, many) = (&all[all.len() - 1..], &all[..all.len() - 1]);
        let mut trust = Trust::new(psf.mapv(|v| v as f32).view(), beam_px, &CleanTuning { trust_margin: 1.0, ..CleanTuning::default() });
        let mut residuals = |components: &[Component]| {
            let mut model = Array2::zeros((SIDE, SIDE));
            deconvolver.draw(components, &mut model);
            let approximate = &dirty - &engine.convolve(model.view(), &kernel);
            let exact = imager.residual(0, model.view(), &Silent).unwrap().image;
            let norm = trust.norm(&*deconvolver, components, (SIDE, SIDE));
            (approximate.mapv(|v| v as f32), exact.mapv(|v| v as f32), norm)
        };
        let (approximate, exact, norm) = residuals(one);
        let (later, exactly, of_many) = residuals(many);
        assert!((norm - 1.0).abs() < 1e-12, "{norm}");
        assert_eq!(trust.level(norm), None);
        trust.expect(&approximate, norm);
        trust.measure(&exact);
        let predicted = trust.level(of_many).unwrap();
        let error = f64::from((&later - &exactly).iter().fold(0.0_f32, |a, v| a.max(v.abs())));
        assert!(error < 2.0 * predicted, "{seed}: an error of {error}, and {predicted} predicted");
        // A prediction that is far too large would make every cycle short. The side lobes at the edge of the beam are its least value.
        let edge = psf.indexed_iter().filter(|((i, j), _)| i.abs_diff(SIDE / 2).max(j.abs_diff(SIDE / 2)) >= 36);
        let edge = edge.fold(0.0_f64, |a, (_, v)| a.max(v.abs()));
        assert!(predicted < (5.0 * error).max(1.001 * edge * of_many), "{seed}: an error of {error}, and {predicted} predicted");
    }
}

fn run(set: &VisibilitySet, (weighting, algorithm): (Weighting, &str), nsigma: f64, trust_margin: f64) -> CleanStatistics {
    let mut set = set.clone();
    let mut imager = Imager::new(&mut set, options(weighting), &Silent).unwrap();
    let tuning = CleanTuning { trust_margin, ..CleanTuning::default() };
    let algorithm = by_name(algorithm).unwrap().into();
    let opts = CleanOptions { algorithm, niter: 5000, nsigma, tuning, ..CleanOptions::default() };
    clean(&mut imager, &opts, &Silent).unwrap().statistics
}

const KINDS: [(Weighting, &str); 3] = [(Weighting::Natural, "hogbom"), (Weighting::Uniform, "clark"), (Weighting::Natural, "clark")];
/// A margin that no error reaches: every cycle ends with the visibilities.
const NEVER: f64 = 1e12;

/// The side lobes of these small arrays are far above what the margin allows.
#[test]
fn no_cycle_goes_deeper_than_its_error_allows() {
    for (seed, height, sigma) in [(11, 0.01, 0.02), (12, 0.3, 0.0), (13, 0.0, 0.1), (14, 0.05, 0.0)] {
        for kind in KINDS {
            let set = set(seed, height, sigma);
            let [always, trusting] = [NEVER, CleanTuning::default().trust_margin].map(|margin| run(&set, kind, 3.0, margin));
            assert!(trusting.residual_rms < 1.02 * always.residual_rms, "{seed} {kind:?}: {trusting:?} {always:?}");
            assert!((trusting.model_flux - always.model_flux).abs() < 0.02 * always.model_flux.abs(), "{seed} {kind:?}");
        }
    }
}

/// Cycles that go deep on a residual which is wrong there take fewer passes, and the exact residuals after them correct what they did.
#[test]
fn cycles_that_trust_too_much_are_corrected() {
    let mut passes = (0, 0);
    for kind in KINDS {
        let set = set(13, 0.0, 0.1);
        let [always, blind] = [NEVER, 0.05].map(|margin| run(&set, kind, 4.0, margin));
        assert!(always.stop == blind.stop && always.stop == [StopReason::Noise], "{kind:?}: {blind:?} {always:?}");
        passes = (passes.0 + always.major_cycles, passes.1 + blind.major_cycles);
        assert!(blind.residual_rms < 1.05 * always.residual_rms, "{kind:?}: {blind:?} {always:?}");
    }
    assert!(passes.1 < passes.0, "{passes:?}");
}
