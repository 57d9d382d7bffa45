//! Maximum entropy through elements with a pattern: the image is the scene, not what the elements see of it.

use super::{MemInputs, MemOptions, MemProducts, SmoothnessChoice, Uncertainty, mem};
use crate::fixtures::{Recorder, positions};
use crate::imaging::{Imager, ImagingOptions};
use crate::progress::Observer;
use crate::simulate::{SimulateOptions, SkyModel, TrackOptions, simulate_set};
use cittert_arrays::quantity::{Duration, Temperature};
use cittert_arrays::{
    Antenna, ArrayLayout, BrightnessUnit, ElementPattern, Image, LayoutFrame, Polarization, SkyFrame, SkyGrid, SpectralWindow, VisUnit,
    VisibilitySet,
};
use ndarray::Array4;
use num_complex::Complex32;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

const PIXELS: usize = 64;
const CELL: f64 = 6e-3;

/// What 40 elements within 0.2 m, as close as 6 mm, measure at 94 GHz of a scene in kelvin through Gaussian elements of 9 degrees.
fn observed(value: impl Fn(f64, f64) -> f64) -> (VisibilitySet, Image) {
    let places = positions(40, 0.1, 0.0, 5);
    let antennas = (0..40_u32).map(|k| {
        let [x, y, _] = places[k as usize];
        let near = if k == 0 { [places[1][0] + 0.006, places[1][1], 0.0] } else { [x, y, 0.0] };
        Antenna { diameter_m: Some(0.006), ..Antenna::new(format!("E{k}"), k, near) }
    });
    let mut layout = ArrayLayout::new("t", LayoutFrame::Boresight, antennas.collect()).unwrap();
    layout.pattern = "gaussian fwhm_deg=9".parse().unwrap();
    let grid = SkyGrid::new(PIXELS, PIXELS, CELL, SkyFrame::Boresight).unwrap();
    let spectrum = SpectralWindow::band(94e9, 8e9, 4).unwrap();
    let data = Array4::from_shape_fn((1, 1, PIXELS, PIXELS), |(_, _, r, c)| value(grid.l_at(c as f64), grid.m_at(r as f64)));
    let one = SpectralWindow::band(94e9, 8e9, 1).unwrap();
    let scene = Image::new(grid, one, vec![Polarization::I], data, BrightnessUnit::Kelvin).unwrap();
    let options = SimulateOptions { tsys: Some(Temperature(600.0)), ..SimulateOptions::default() };
    let track = TrackOptions { integration: Duration(1.0), ..TrackOptions::default() }.plan(&layout).unwrap();
    let header = options.header(layout, spectrum, track.center, VisUnit::KelvinSr);
    let recorder = Recorder::default();
    let set = simulate_set(header, &track.plan.coverage().unwrap(), &SkyModel::of_image(scene.clone()), &options, &recorder).unwrap();
    (set, scene)
}

fn imaged(set: &mut VisibilitySet, options: &MemOptions, observer: &dyn Observer) -> MemProducts {
    let imaging = ImagingOptions { size: Some("64".parse().unwrap()), cell: Some("6mrad".parse().unwrap()), ..ImagingOptions::default() };
    let noise = options.believed_noise(set, observer).unwrap();
    let mut imager = Imager::new(set, imaging, observer).unwrap();
    let plan = options.plan(&imager, MemInputs::default(), noise).unwrap();
    mem(&mut imager, &plan, observer).unwrap()
}

/// The rms difference where the pattern is at least `least`.
fn rms(image: &Image, scene: &Image, least: f64) -> f64 {
    let pattern: ElementPattern = "gaussian fwhm_deg=9".parse().unwrap();
    let power = pattern.plane(&scene.grid, 94e9);
    let squares =
        |(at, a): ((usize, usize), &f64)| (*a >= least).then(|| (image.data[[0, 0, at.0, at.1]] - scene.data[[0, 0, at.0, at.1]]).powi(2));
    let inside: Vec<f64> = power.indexed_iter().filter_map(squares).collect();
    (inside.iter().sum::<f64>() / inside.len() as f64).sqrt()
}

/// 264 K with a warm and a cold object.
fn scene(l: f64, m: f64) -> f64 {
    let bump = |l0: f64, m0: f64, width: f64| (-((l - l0).powi(2) + (m - m0).powi(2)) / (width * width)).exp();
    264.0 + 40.0 * bump(0.03, 0.01, 0.03) - 50.0 * bump(-0.05, -0.03, 0.02)
}

#[test]
fn a_scene_comes_back_in_kelvin_with_an_uncertainty_that_grows_outwards() {
    let (mut set, scene) = observed(scene);
    let recorder = Recorder::default();
    let options = MemOptions { uncertainty: Uncertainty::Beam, ..MemOptions::default() };
    let made = imaged(&mut set, &options, &recorder);
    let (found, grey) = (rms(&made.model, &scene, 0.5), {
        let mut flat = scene.clone();
        flat.data.fill(264.0);
        rms(&flat, &scene, 0.5)
    });
    assert!(found < 0.35 * grey, "{found} K, and a grey card has {grey} K");
    assert!(recorder.messages().iter().any(|m| m.contains("gaussian") && m.contains("total power")), "{:?}", recorder.messages());
    assert!(made.model.pattern.is_none() && made.restored.pattern.is_none() && !made.residual.pattern.is_none());
    assert!(rms(&made.restored, &scene, 0.5) < 0.6 * grey, "{}", rms(&made.restored, &scene, 0.5));
    let sigma = made.uncertainty.unwrap();
    let power = set.header.layout.pattern.plane(&scene.grid, 94e9);
    let mean = |from: f64, to: f64| {
        let inside: Vec<f64> =
            power.indexed_iter().filter(|(_, a)| (from..to).contains(*a)).map(|(at, _)| sigma.data[[0, 0, at.0, at.1]]).collect();
        inside.iter().sum::<f64>() / inside.len() as f64
    };
    let [inner, middle, outer] = [mean(0.5, 2.0), mean(0.1, 0.5), mean(0.0, 0.01)];
    assert!(inner < middle && middle < outer && outer > 1.1 * inner, "{inner} {middle} {outer}");
}

#[test]
fn a_uniform_background_comes_back_within_a_tenth_of_a_kelvin() {
    let (mut set, scene) = observed(|_, _| 300.0);
    for total_power in [true, false] {
        if !total_power {
            set.header.antenna_temperature_k = None;
        }
        let recorder = Recorder::default();
        let made = imaged(&mut set, &MemOptions { uncertainty: Uncertainty::None, ..MemOptions::default() }, &recorder);
        let level = made.certificates[0].background.unwrap();
        assert!((level - 300.0).abs() < 0.1, "{level} {total_power}");
        assert!(rms(&made.model, &scene, 0.0) < 0.5, "{}", rms(&made.model, &scene, 0.0));
    }
}

#[test]
fn both_solvers_and_a_known_zero_spacing_find_the_same_scene() {
    let (mut set, _) = observed(scene);
    let zero = set.header.antenna_temperature_k.unwrap() * set.header.layout.pattern.solid_angle_sr(94e9).unwrap();
    let mut images = Vec::new();
    for solver in [super::Method::QuasiNewton, super::Method::Vtess] {
        let options = MemOptions {
            solver,
            zero_spacing: Some(format!("{zero}Ksr").parse().unwrap()),
            uncertainty: Uncertainty::None,
            smoothness: SmoothnessChoice::None,
            ..MemOptions::default()
        };
        let made = imaged(&mut set, &options, &Recorder::default());
        let c = &made.certificates[0];
        assert!(c.met && (c.model_flux / zero - 1.0).abs() < 2e-3, "{solver:?}: {c:?}");
        images.push(made.model);
    }
    assert!(rms(&images[0], &images[1], 0.0) < 0.5, "{}", rms(&images[0], &images[1], 0.0));
}

/// A noisy observation of a scene with edges, which fills the frame.
fn noisy() -> (VisibilitySet, Image) {
    let board = |l: f64, m: f64| if (l / 0.03).floor() as i64 % 2 == (m / 0.04).floor() as i64 % 2 { 275.0 } else { 250.0 };
    let (mut set, scene) = observed(board);
    let noise = Normal::new(0.0, 0.04).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    set.data.vis.mapv_inplace(|v| v + Complex32::new(noise.sample(&mut rng), noise.sample(&mut rng)));
    set.data.weights.fill(1.0 / (0.04 * 0.04));
    (set, scene)
}

#[test]
fn a_smooth_scene_is_expected_where_the_data_ask_for_it() {
    let (mut set, scene) = noisy();
    let mut found = Vec::new();
    for smoothness in [SmoothnessChoice::None, SmoothnessChoice::Auto] {
        let recorder = Recorder::default();
        let options = MemOptions { smoothness, uncertainty: Uncertainty::Probes(20), ..MemOptions::default() };
        let made = imaged(&mut set, &options, &recorder);
        assert!(made.certificates[0].met || smoothness == SmoothnessChoice::None, "{:?}", made.certificates[0]);
        let said = recorder.messages().iter().any(|m| m.contains("smooth scene that varies"));
        assert_eq!(said, smoothness == SmoothnessChoice::Auto, "{:?}", recorder.messages());
        found.push((rms(&made.model, &scene, 0.5), made.uncertainty.unwrap()));
    }
    assert!(found[1].0 < 0.9 * found[0].0, "{} {}", found[0].0, found[1].0);
    // The uncertainty is that of the errors, and both ways to it agree.
    let options = MemOptions { uncertainty: Uncertainty::Beam, ..MemOptions::default() };
    let beam = imaged(&mut set, &options, &Recorder::default()).uncertainty.unwrap();
    let middle = |image: &Image| image.data[[0, 0, PIXELS / 2, PIXELS / 2]];
    let stated = rms(&beam, &Image { data: &beam.data * 0.0, ..beam.clone() }, 0.5);
    assert!((0.5..2.0).contains(&(stated / found[1].0)), "{stated} {}", found[1].0);
    assert!((0.6..1.6).contains(&(middle(&beam) / middle(&found[1].1))), "{} {}", middle(&beam), middle(&found[1].1));
}

#[test]
fn points_on_a_black_sky_are_not_smooth() {
    let points = |l: f64, m: f64| if (l / 0.036).fract() == 0.0 && (m / 0.042).fract() == 0.0 { 40_000.0 } else { 3.0 };
    let (mut set, _) = observed(points);
    let recorder = Recorder::default();
    imaged(&mut set, &MemOptions { uncertainty: Uncertainty::None, niter: 20, ..MemOptions::default() }, &recorder);
    assert!(!recorder.messages().iter().any(|m| m.contains("smooth scene")), "{:?}", recorder.messages());
}

#[test]
fn an_impossible_smoothness_is_refused() {
    assert!("-3K".parse::<SmoothnessChoice>().map_or(true, |s| MemOptions { smoothness: s, ..MemOptions::default() }.check().is_err()));
    assert!("high".parse::<SmoothnessChoice>().is_err());
}
