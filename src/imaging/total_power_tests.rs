//! Tests of autocorrelations as the zero spacing of images.

use super::*;
use crate::corrupt::{AmplitudeError, CorruptOptions, Error, Variation, corrupt, corrupted_header};
use crate::fixtures::{Recorder, positions};
use crate::mem::{MemInputs, MemOptions, MemProducts, Uncertainty, mem};
use crate::progress::Silent;
use crate::simulate::{SimulateOptions, SkyModel, TrackOptions, simulate_set};
use cittert_arrays::quantity::{Duration, Temperature};
use cittert_arrays::{
    Antenna, ArrayLayout, BrightnessUnit, ElementPattern, Image, LayoutFrame, Polarization, SkyFrame, SkyGrid, SpectralWindow, UvCoverage,
    VisUnit, VisibilityBlock, VisibilitySet,
};
use ndarray::{Array2, Array4};

const PIXELS: usize = 64;
const CELL: f64 = 6e-3;

fn grid() -> SkyGrid {
    SkyGrid::new(PIXELS, PIXELS, CELL, SkyFrame::Boresight).unwrap()
}

/// 264 K with a warm and a cold object: neither side of the frame is like the mean.
fn scene() -> Image {
    let g = grid();
    let bump = |l: f64, m: f64, l0: f64, m0: f64, width: f64| (-((l - l0).powi(2) + (m - m0).powi(2)) / (width * width)).exp();
    let data = Array4::from_shape_fn((1, 1, PIXELS, PIXELS), |(_, _, r, c)| {
        let (l, m) = (g.l_at(c as f64), g.m_at(r as f64));
        264.0 + 60.0 * bump(l, m, 0.03, 0.01, 0.06) - 90.0 * bump(l, m, -0.05, -0.03, 0.04)
    });
    Image::new(g, SpectralWindow::band(94e9, 8e9, 1).unwrap(), vec![Polarization::I], data, BrightnessUnit::Kelvin).unwrap()
}

/// What 40 elements within 0.2 m measure, no two of them closer than the shortest baseline that a level needs.
fn observed(pattern: ElementPattern, autos: bool) -> VisibilitySet {
    let antennas = positions(40, 0.1, 0.0, 5)
        .into_iter()
        .enumerate()
        .map(|(k, p)| Antenna { diameter_m: pattern.is_none().then_some(0.01), ..Antenna::new(format!("E{k}"), k as u32, p) });
    let mut layout = ArrayLayout::new("t", LayoutFrame::Boresight, antennas.collect()).unwrap();
    layout.pattern = pattern;
    let options = SimulateOptions {
        autos,
        no_antenna_temperature: true,
        pedestal: crate::simulate::Pedestal::None,
        tsys: Some(Temperature(600.0)),
        ..SimulateOptions::default()
    };
    let planned = TrackOptions { integration: Duration(1.0), ..TrackOptions::default() }.plan(&layout).unwrap();
    let rows = planned.plan.with_autocorrelations(autos).coverage().unwrap();
    let header = options.header(layout, SpectralWindow::band(94e9, 8e9, 4).unwrap(), planned.center, VisUnit::KelvinSr);
    simulate_set(header, &rows, &SkyModel::of_image(scene()), &options, &Silent).unwrap()
}

fn pattern() -> ElementPattern {
    "gaussian fwhm_deg=9".parse().unwrap()
}

fn imaging() -> ImagingOptions {
    ImagingOptions { size: Some("64".parse().unwrap()), cell: Some("6mrad".parse().unwrap()), ..ImagingOptions::default() }
}

/// Mean of an image over what the elements see.
fn mean(image: &Image, pattern: &ElementPattern) -> f64 {
    let power = if pattern.is_none() { Array2::ones((PIXELS, PIXELS)) } else { pattern.plane(&image.grid, 94e9) };
    let of = |at: (usize, usize)| power[at] / (1.0 - image.grid.l_at(at.1 as f64).powi(2) - image.grid.m_at(at.0 as f64).powi(2)).sqrt();
    let (mut sum, mut weight) = (0.0, 0.0);
    for (at, t) in image.plane(0, 0).indexed_iter() {
        (sum, weight) = (sum + of(at) * t, weight + of(at));
    }
    sum / weight
}

fn entropy(set: &mut VisibilitySet) -> (MemProducts, Vec<String>, MeanFrom) {
    let recorder = Recorder::default();
    let options = MemOptions { uncertainty: Uncertainty::None, ..MemOptions::default() };
    let noise = options.believed_noise(set, &recorder).unwrap();
    let mut imager = Imager::new(set, imaging(), &recorder).unwrap();
    imager.say_mean(&recorder);
    let from = imager.mean_from();
    let plan = options.plan(&imager, MemInputs::default(), noise).unwrap();
    (mem(&mut imager, &plan, &recorder).unwrap(), recorder.messages(), from)
}

#[test]
fn maximum_entropy_has_the_mean_of_the_scene_within_half_a_kelvin_with_autocorrelations() {
    for pattern in [pattern(), ElementPattern::None] {
        let truth = mean(&scene(), &pattern);
        let (made, said, from) = entropy(&mut observed(pattern.clone(), true));
        let found = mean(&made.model, &pattern);
        assert!((found - truth).abs() < 0.5, "{pattern}: {found} {truth}");
        assert!(made.certificates[0].flux_constrained, "{:?}", made.certificates[0]);
        assert!(made.certificates[0].met, "{:?}", made.certificates[0]);
        assert_eq!(from, MeanFrom::Autocorrelations);
        if pattern.is_none() {
            continue;
        }
        assert!(said.iter().any(|m| m.contains("640 autocorrelations") || m.contains("160 autocorrelations")), "{said:?}");
        let (_, said, from) = entropy(&mut observed(pattern, false));
        assert_eq!(from, MeanFrom::Unknown);
        assert!(said.iter().any(|m| m.contains("mean of the scene is unknown")), "{said:?}");
    }
}

#[test]
fn dirty_images_have_the_mean_of_the_scene_with_a_pattern_or_without() {
    for pattern in [pattern(), ElementPattern::None] {
        let mut set = observed(pattern.clone(), true);
        let mut imager = Imager::new(&mut set, imaging(), &Silent).unwrap();
        let zero = imager.zero_spacing(0).unwrap();
        let total: f64 = {
            let g = grid();
            let power = if pattern.is_none() { Array2::ones((PIXELS, PIXELS)) } else { pattern.plane(&g, 94e9) };
            power
                .indexed_iter()
                .map(|(at, a)| a * g.cell_sr() / (1.0 - g.l_at(at.1 as f64).powi(2) - g.m_at(at.0 as f64).powi(2)).sqrt())
                .sum()
        };
        let truth = mean(&scene(), &pattern);
        assert!((zero.value / total - truth).abs() < 4.0 * zero.sigma / total + 1e-3, "{zero:?} {truth}");
        assert!(zero.is_sure() && (0.5..2.0).contains(&zero.scatter) && zero.antennas == 40, "{zero:?}");
        let image = dirty_image(&mut imager, true, &Silent).unwrap();
        // The mean over the frame of T A.
        let plane = image.plane(0, 0);
        let found = plane.iter().map(|v| f64::from(*v)).sum::<f64>() / plane.len() as f64;
        let seen = scene();
        let power = if pattern.is_none() { Array2::ones((PIXELS, PIXELS)) } else { pattern.plane(&seen.grid, 94e9) };
        let wanted = seen.plane(0, 0).iter().zip(&power).map(|(t, a)| t * a).sum::<f64>() / plane.len() as f64;
        assert!((found - wanted).abs() < 4.0, "{pattern}: {found} {wanted}");
    }
}

#[test]
fn autocorrelations_without_a_statement_of_the_receivers_are_left_out_as_before() {
    let mut with = observed(pattern(), true);
    let antennas = with.header.layout.antennas().iter().map(|a| Antenna { receiver: None, ..a.clone() }).collect();
    with.header.layout = ArrayLayout::new("t", LayoutFrame::Boresight, antennas).unwrap();
    with.header.layout.pattern = pattern();
    let mut without = with.clone();
    let cross: Vec<usize> = (0..with.data.n_rows()).filter(|r| with.data.coverage.ant1[*r] != with.data.coverage.ant2[*r]).collect();
    let mut block = with.data.rows(0..0).unwrap();
    cross.iter().for_each(|r| block.append(&with.data.rows(*r..r + 1).unwrap()).unwrap());
    without.data = block;
    let image = |set: &mut VisibilitySet| {
        let recorder = Recorder::default();
        let mut imager = Imager::new(set, imaging(), &recorder).unwrap();
        (imager.dirty(0, &Silent).unwrap(), imager.survey().counts.autocorrelations, imager.mean_from(), recorder.messages())
    };
    let ((a, n, from, said), (b, none, ..)) = (image(&mut with), image(&mut without));
    assert_eq!((n, none, from), (160, 0, MeanFrom::Unknown));
    assert!(said.iter().any(|m| m.contains("160 are autocorrelations")), "{said:?}");
    assert!((&a - &b).iter().all(|d| d.abs() < 1e-7 * a[(32, 32)].abs()));
}

#[test]
fn amplitudes_that_are_not_calibrated_are_told_and_a_radiometer_counts_instead() {
    let mut set = observed(pattern(), true);
    let errors = CorruptOptions {
        seed: 3,
        errors: vec![Error::Amplitude(AmplitudeError { rms: 0.3, variation: Variation::Constant })],
        per_feed: false,
    };
    let empty = VisibilityBlock::zeros(UvCoverage::empty(), 4, 1);
    let mut out = VisibilitySet::new(corrupted_header(&set.header, &errors), empty).unwrap();
    corrupt(&mut set, &mut out, &errors, &Silent).unwrap();
    let recorder = Recorder::default();
    let imager = Imager::new(&mut out, imaging(), &recorder).unwrap();
    imager.say_mean(&recorder);
    let zero = imager.zero_spacing(0).unwrap();
    assert!(!zero.is_calibrated() && !zero.is_sure() && zero.sigma > 0.05 * zero.value, "{zero:?}");
    assert!(recorder.messages().iter().any(|m| m.contains("not calibrated")), "{:?}", recorder.messages());
    out.header.antenna_temperature_k = Some(250.0);
    let mut imager = Imager::new(&mut out, imaging(), &Silent).unwrap();
    let one = pattern().plane(imager.grid(), 94e9) * imager.grid().cell_sr();
    let found = Background::of((&mut imager, 0), &one, None, &Silent).unwrap().unwrap();
    let stated = 250.0 * pattern().solid_angle_sr(94e9).unwrap() / one.sum();
    assert!((found.level / stated - 1.0).abs() < 1e-9, "{found:?} {stated}");
}
