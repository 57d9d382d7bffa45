//! Tests of predicted maps of noise against the scatter of many images.

use super::*;
use crate::memory::MemoryBudget;
use crate::progress::Silent;
use crate::simulate::{SimulateOptions, SkyModel, TrackOptions, simulate_set};
use cittert_arrays::quantity::{Duration, Temperature};
use cittert_arrays::{
    Antenna, ArrayLayout, BrightnessUnit, Image, LayoutFrame, Polarization, SkyFrame, SkyGrid, SpectralWindow, VisUnit, VisibilitySet,
    Weighting,
};
use ndarray::{Array2, Array4};

const DRAWS: usize = 700;
const SIZE: usize = 24;

/// Integrations of nine elements that see 200 K with a small body of 20,000 K, which is most of what they see.
fn observed(scene_noise: bool, times: usize) -> VisibilitySet {
    let antennas = (0..9_u32).map(|k| {
        let (a, r) = (2.4 * f64::from(k), 0.012 * f64::from(k + 1).sqrt());
        Antenna::new(format!("E{k}"), k, [r * a.cos(), r * a.sin(), 0.0])
    });
    let mut layout = ArrayLayout::new("t", LayoutFrame::Boresight, antennas.collect()).unwrap();
    layout.pattern = "gaussian fwhm_deg=16".parse().unwrap();
    let grid = SkyGrid::new(64, 64, 9e-3, SkyFrame::Boresight).unwrap();
    let data =
        Array4::from_shape_fn((1, 1, 64, 64), |(_, _, r, c)| if (36..41).contains(&r) && (24..29).contains(&c) { 20_000.0 } else { 200.0 });
    let band = SpectralWindow::band(94e9, 1e9, 1).unwrap();
    let scene = Image::new(grid, band.clone(), vec![Polarization::I], data, BrightnessUnit::Kelvin).unwrap();
    let options = SimulateOptions { autos: true, scene_noise, tsys: Some(Temperature(150.0)), seed: 11, ..SimulateOptions::default() };
    let track = TrackOptions { integration: Duration(1e-3), duration: Some(Duration(1e-3 * times as f64)), ..TrackOptions::default() };
    let planned = track.plan(&layout).unwrap();
    let rows = planned.plan.with_autocorrelations(true).coverage().unwrap();
    let header = options.header(layout, band, planned.center, VisUnit::KelvinSr);
    simulate_set(header, &rows, &SkyModel::of_image(scene), &options, &Silent).unwrap()
}

fn imaging(weighting: Weighting) -> ImagingOptions {
    ImagingOptions {
        size: Some(SIZE.to_string().parse().unwrap()),
        cell: Some("14mrad".parse().unwrap()),
        weighting,
        background: BackgroundChoice::None,
        ..ImagingOptions::default()
    }
}

/// Standard deviation over the integrations of a set, and the predicted map, both in flux a beam.
fn measured_and_predicted(set: &VisibilitySet, weighting: Weighting) -> (Array2<f64>, Array2<f64>, DeltaT) {
    let rows = 9 * 10 / 2;
    let (mut sum, mut squares) = (Array2::<f64>::zeros((SIZE, SIZE)), Array2::<f64>::zeros((SIZE, SIZE)));
    let draws = set.data.n_rows() / rows;
    for k in 0..draws {
        let mut one = VisibilitySet::new(set.header.clone(), set.data.rows(k * rows..(k + 1) * rows).unwrap()).unwrap();
        let image = Imager::new(&mut one, imaging(weighting), &Silent).unwrap().dirty(0, &Silent).unwrap();
        squares += &image.mapv(|v| v * v);
        sum += &image;
    }
    let n = draws as f64;
    let mean = sum / n;
    let measured = ((squares / n - &mean * &mean) * (n / (n - 1.0))).mapv(f64::sqrt);
    let mut one = VisibilitySet::new(set.header.clone(), set.data.rows(0..rows).unwrap()).unwrap();
    let products = Products::read(&mut one, Polarization::I, MemoryBudget::default()).unwrap();
    let mut imager = Imager::new(&mut one, imaging(weighting), &Silent).unwrap();
    let beam = imager.restoring_beam(0, &Silent).unwrap().unwrap();
    let made = delta_t(&mut imager, &products, &[beam], &Silent).unwrap();
    let predicted = made.image.plane(0, 0).mapv(|v| f64::from(v) * beam.solid_angle_sr());
    (measured, predicted, made)
}

#[test]
fn the_predicted_noise_of_a_scene_is_that_of_its_images() {
    let set = observed(true, DRAWS);
    for weighting in [Weighting::Natural, Weighting::Uniform] {
        let (measured, predicted, made) = measured_and_predicted(&set, weighting);
        assert!(made.of_fields && made.step == 1);
        let ratio = &predicted / &measured;
        // Each pixel has 1 / sqrt(2 x 700) = 2.7 % of its own; blocks of pixels must agree better.
        for r in ratio.iter() {
            assert!((r - 1.0).abs() < 5.0 / (2.0 * DRAWS as f64).sqrt(), "{weighting:?}: {r}");
        }
        for block in ratio.exact_chunks((6, 6)) {
            assert!((block.mean().unwrap() - 1.0).abs() < 0.05, "{weighting:?}: {}", block.mean().unwrap());
        }
        let mean = ratio.mean().unwrap();
        assert!((mean - 1.0).abs() < 0.03, "{weighting:?}: {mean}");
        // The noise follows the brightness, so that a number for the whole field would be wrong.
        let (least, most) = predicted.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), v| (a.min(*v), b.max(*v)));
        assert!(most > 1.5 * least, "{weighting:?}: {least} to {most}");
    }
}

#[test]
fn the_predicted_noise_of_receivers_is_the_same_over_the_field() {
    let set = observed(false, DRAWS);
    let (measured, predicted, made) = measured_and_predicted(&set, Weighting::Uniform);
    assert!(!made.of_fields);
    let ratio = (&predicted / &measured).mean().unwrap();
    assert!((ratio - 1.0).abs() < 0.03, "{ratio}");
    assert!(predicted.iter().all(|v| (v / predicted[(0, 0)] - 1.0).abs() < 1e-6));
}
