//! Whole runs of CLEAN: automatic masks, several output channels, and a deconvolver that makes the image worse.

use super::*;
use crate::Result;
use crate::deconvolve::{CleanTuning, Component, Deconvolver, Entry, Minor, MinorReport, MinorStop, Scales, by_name};
use crate::fixtures::{positions, snapshot};
use crate::progress::Silent;
use cittert_arrays::quantity::Angle;
use cittert_arrays::{Polarization, SkyFrame, SkyGrid, VisUnit, VisibilitySet};
use major::{CleanOptions, StopReason};
use ndarray::ArcArray2;

const SOURCES: [(f64, f64, f64); 2] = [(0.012, 0.005, 1.0), (-0.004, 0.009, 0.4)];

fn points(sigma: f64) -> VisibilitySet {
    snapshot(&positions(24, 0.5, 0.01, 3), &[94e9, 95e9], &[Polarization::I], &SOURCES, (sigma, VisUnit::Jy))
}

fn options(n: usize) -> ImagingOptions {
    ImagingOptions { size: Some(ImageSize::square(n)), cell: Some(Angle(1e-3)), weighting: Weighting::Natural, ..ImagingOptions::default() }
}

/// Without a mask a deep CLEAN takes components from noise everywhere. The automatic mask restricts it to the sources.
#[test]
fn auto_mask_keeps_components_at_the_sources() {
    let far = |auto_mask: Option<f64>| {
        let mut set = points(0.2);
        let mut imager = Imager::new(&mut set, options(64), &Silent).unwrap();
        let opts = CleanOptions { niter: 1500, nsigma: 0.0, auto_mask, ..CleanOptions::default() };
        let out = clean(&mut imager, &opts, &Silent).unwrap();
        let away = |l: f64, m: f64| SOURCES.iter().all(|s| (s.0 - l).hypot(s.1 - m) > 8e-3);
        let flux: f64 = out.components.iter().filter(|c| !away(c.l, c.m)).map(|c| c.flux).sum();
        (out.components.iter().filter(|c| away(c.l, c.m)).count(), flux)
    };
    let (everywhere, _) = far(None);
    let (masked, flux) = far(Some(6.0));
    assert!(everywhere > 100, "{everywhere}");
    assert_eq!(masked, 0);
    // 276 baselines of 2 channels with noise of 0.2 in each real part: 0.2 / sqrt(552) for a point.
    assert!((flux - 1.4).abs() < 5.0 * 0.2 / 552_f64.sqrt(), "{flux}");
}

#[test]
fn every_output_channel_is_cleaned_by_itself() {
    for joint in [false, true] {
        let mut set = points(0.01);
        let imaging = ImagingOptions { channels_out: 2, weighting: Weighting::Uniform, joint_weights: joint, ..options(64) };
        let mut imager = Imager::new(&mut set, imaging, &Silent).unwrap();
        let opts = CleanOptions { niter: 2000, nsigma: 4.0, algorithm: by_name("clark").unwrap().into(), ..CleanOptions::default() };
        let out = clean(&mut imager, &opts, &Silent).unwrap();
        assert_eq!(out.statistics.stop, [StopReason::Noise; 2]);
        assert_eq!(out.restored.data.shape(), [2, 1, 64, 64]);
        assert_eq!(out.beams.len(), 2);
        assert!(out.beams[1].bmaj_rad < out.beams[0].bmaj_rad, "the beam shrinks with the wavelength: {:?}", out.beams);
        for channel in 0..2 {
            let flux: f64 = out.components.iter().filter(|c| c.channel == channel).map(|c| c.flux).sum();
            assert!((flux - 1.4).abs() < 0.02, "{channel}: {flux}");
        }
    }
}

/// Adds the negative of the residual to the model.
struct Wrong;

impl Deconvolver for Wrong {
    fn minor(&mut self, _cycle: Minor<'_>) -> Result<MinorReport> {
        let (row, column) = (32, 32);
        let components = vec![Component { row, column, flux: -5.0, scale_px: 0.0 }];
        Ok(MinorReport { stop: MinorStop::Level, components })
    }
}

fn wrong(_: &ArcArray2<f32>, _: &Scales, _: &CleanTuning) -> Result<Box<dyn Deconvolver>> {
    Ok(Box::new(Wrong))
}

static WRONG: Entry = Entry { name: "wrong", make: wrong };

#[test]
fn a_run_that_does_harm_is_stopped_and_the_best_state_kept() {
    let mut set = points(0.01);
    let mut imager = Imager::new(&mut set, options(64), &Silent).unwrap();
    let out = clean(&mut imager, &CleanOptions { algorithm: (&WRONG).into(), ..CleanOptions::default() }, &Silent).unwrap();
    assert_eq!(out.statistics.stop, [StopReason::Diverged]);
    assert!(out.model.data.iter().all(|v| *v == 0.0) && out.components.is_empty());
    let apart = out.residual.data.iter().zip(&out.dirty.data).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(apart < 1e-9, "{apart}");
}

/// The middle of the beam gives the same restoring beam as the whole beam.
#[test]
fn the_core_of_the_beam_has_its_main_lobe() {
    for weighting in [Weighting::Natural, Weighting::Uniform] {
        let mut set = points(0.0);
        let imaging = ImagingOptions { weighting, ..options(200) };
        let mut imager = Imager::new(&mut set, imaging, &Silent).unwrap();
        let (core, whole) = (imager.psf_core(0, &Silent).unwrap().unwrap(), imager.psf(0, &Silent).unwrap());
        assert_eq!((core.nrows(), whole.nrows()), (32, 200));
        let (a, b) = (imager.beam_of(core.view()).unwrap(), imager.beam_of(whole.view()).unwrap());
        assert!((a.bmaj_rad / b.bmaj_rad - 1.0).abs() < 1e-4 && (a.bmin_rad / b.bmin_rad - 1.0).abs() < 1e-4, "{a:?} {b:?}");
        assert!((a.bpa_rad - b.bpa_rad).abs() < 1e-3, "{a:?} {b:?}");
    }
}

/// Density cells that are wider by a factor are those of an image that is smaller by this factor.
#[test]
fn super_uniform_weights_are_those_of_a_smaller_image() {
    let weights = |n: usize, super_uniform: f64| {
        let grid = SkyGrid::new(n, n, 1e-3, SkyFrame::Boresight).unwrap();
        let options = ImagingOptions { weighting: Weighting::Uniform, super_uniform, ..ImagingOptions::default() };
        let mut w = ImageWeights::new(&grid, &options);
        let mut set = points(0.0);
        let mut imager = Imager::new(&mut set, self::options(32), &Silent).unwrap();
        let freq = [94e9, 95e9];
        let mut seen = Vec::new();
        imager
            .for_each_weighed(&Silent, |block| {
                w.add(block, &(0..2), &freq);
                Ok(())
            })
            .unwrap();
        w.finish();
        for u in [0.0, 37.0, -80.0, 120.0] {
            seen.push(w.factor(u, 0.5 * u + 3.0));
        }
        seen
    };
    assert_eq!(weights(64, 4.0), weights(16, 1.0));
    assert_ne!(weights(64, 4.0), weights(64, 1.0));
}

/// Natural weights decrease towards long baselines, nearly as a Gaussian. With a Gaussian taper of FWHM theta the beam therefore has a FWHM
/// near sqrt(theta^2 + own^2). A taper of the short baselines makes the beam sharper.
#[test]
fn tapers_widen_and_sharpen_the_beam() {
    let fwhm = |taper_rad: Option<f64>, inner_taper_rad: Option<f64>| {
        let mut set = points(0.0);
        let (taper, inner_taper) = (taper_rad.map(Angle), inner_taper_rad.map(Angle));
        let mut imager = Imager::new(&mut set, ImagingOptions { taper, inner_taper, ..options(96) }, &Silent).unwrap();
        let psf = imager.psf(0, &Silent).unwrap();
        let b = imager.beam_of(psf.view()).unwrap();
        (b.bmaj_rad * b.bmin_rad).sqrt()
    };
    let own = fwhm(None, None);
    // With a stronger taper the beam depends on the few shortest baselines, and is not a Gaussian.
    let tapered = fwhm(Some(own), None);
    assert!((tapered / (2_f64.sqrt() * own) - 1.0).abs() < 0.1, "{own} {tapered}");
    assert!(fwhm(None, Some(2.0 * own)) < own);
}
