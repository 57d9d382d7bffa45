//! The joint solution of a scene that fills the frame of elements with a pattern, from phases of which nothing is known.

use super::*;
use crate::fixtures::{Recorder, in_processes, positions};
use crate::imaging::{ImageSize, ImagingOptions, Weighting};
use crate::mem::Prior;
use crate::simulate::{SimulateOptions, SkyModel, TrackOptions, simulate_set};
use cittert_arrays::quantity::{Angle, Duration, Temperature};
use cittert_arrays::{
    Antenna, ArrayLayout, BrightnessUnit, ElementPattern, Image, LayoutFrame, Polarization, SkyFrame, SkyGrid, SpectralWindow, VisUnit,
    VisibilitySet, VisibilitySource,
};
use ndarray::{Array2, Array4};
use num_complex::Complex32;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

const SIDE: usize = 64;
const CELL: f64 = 6e-3;
const ELEMENTS: usize = 40;

/// Warm ground with roofs, a road and a cold sheet of metal, beyond the edges of the frame.
fn scene() -> Array2<f64> {
    Array2::from_shape_fn((SIDE, SIDE), |(i, j)| {
        let within = |a: (usize, usize), b: (usize, usize)| (a.0..b.0).contains(&i) && (a.1..b.1).contains(&j);
        match () {
            () if within((22, 18), (30, 24)) || within((38, 34), (46, 40)) => 200.0,
            () if within((26, 38), (34, 48)) => 300.0,
            () if i.abs_diff(j + 4) < 3 => 240.0,
            () => 265.0 + 5.0 * ((i / 11 + j / 9) % 3) as f64,
        }
    })
}

/// The scene through Gaussian elements of 9 degrees, with noise and with these phases of the elements.
fn observed(phases: &[f64], sigma: f64) -> VisibilitySet {
    let antennas = (0_u32..)
        .zip(positions(ELEMENTS, 0.1, 0.0, 5))
        .map(|(k, [x, y, _])| Antenna { diameter_m: Some(0.006), ..Antenna::new(format!("E{k}"), k, [x, y, 0.0]) });
    let mut layout = ArrayLayout::new("t", LayoutFrame::Boresight, antennas.collect()).unwrap();
    layout.pattern = "gaussian fwhm_deg=9".parse().unwrap();
    let grid = SkyGrid::new(SIDE, SIDE, CELL, SkyFrame::Boresight).unwrap();
    let scene = scene();
    let data = Array4::from_shape_fn((1, 1, SIDE, SIDE), |(_, _, i, j)| scene[(i, j)]);
    let one = SpectralWindow::band(94e9, 8e9, 1).unwrap();
    let image = Image::new(grid, one, vec![Polarization::I], data, BrightnessUnit::Kelvin).unwrap();
    let options = SimulateOptions { tsys: Some(Temperature(600.0)), ..SimulateOptions::default() };
    let track = TrackOptions { integration: Duration(1.0), ..TrackOptions::default() }.plan(&layout).unwrap();
    let header = options.header(layout, SpectralWindow::band(94e9, 16e9, 8).unwrap(), track.center, VisUnit::KelvinSr);
    let sky = SkyModel::of_image(image);
    let mut set = simulate_set(header, &track.plan.coverage().unwrap(), &sky, &options, &Recorder::default()).unwrap();
    let (noise, mut rng) = (Normal::new(0.0, sigma as f32).unwrap(), ChaCha8Rng::seed_from_u64(8));
    for ((row, _, _), v) in set.data.vis.indexed_iter_mut() {
        let (p, q) = (set.data.coverage.ant1[row] as usize, set.data.coverage.ant2[row] as usize);
        *v = (*v + Complex32::new(noise.sample(&mut rng), noise.sample(&mut rng)))
            * Complex32::from_polar(1.0, (phases[p] - phases[q]) as f32);
    }
    set.data.weights.fill((1.0 / (sigma * sigma)) as f32);
    set
}

/// The scene that a maker finds, K.
fn found(phases: &[f64], sigma: f64, told: &Recorder) -> Array2<f64> {
    found_in(&mut observed(phases, sigma), 1e-5, told)
}

/// The scene that a maker finds in a set, with transforms of this error.
fn found_in(set: &mut dyn VisibilitySource, epsilon: f64, told: &Recorder) -> Array2<f64> {
    let imaging = ImagingOptions {
        epsilon,
        size: Some(ImageSize::square(SIDE)),
        cell: Some(Angle(CELL)),
        weighting: Weighting::Natural,
        ..ImagingOptions::default()
    };
    let solve = SolveOptions { feeds: FeedGroups::Joined, solint: SolutionInterval::Infinite, ..SolveOptions::default() };
    let mut maker = JointMaker::new(imaging, JointOptions { solve, prior: Prior::Auto, mask: None, goals: JointGoals::default() });
    let plan = schedule(GainMode::Phase, SolutionInterval::Infinite, 1, false)[0];
    maker.update(set, &plan, told).unwrap();
    let grid = SkyGrid::new(SIDE, SIDE, CELL, SkyFrame::Boresight).unwrap();
    let image = &maker.solution().unwrap().state.image;
    Array2::from_shape_fn((SIDE, SIDE), |(i, j)| {
        let (l, m) = (grid.l_at(j as f64), grid.m_at(i as f64));
        image[(i, j)] * (1.0 - l * l - m * m).sqrt() / grid.cell_sr()
    })
}

/// The rms error within the half-power width, K.
fn error(image: &Array2<f64>) -> f64 {
    let grid = SkyGrid::new(SIDE, SIDE, CELL, SkyFrame::Boresight).unwrap();
    let pattern: ElementPattern = "gaussian fwhm_deg=9".parse().unwrap();
    let power = pattern.plane(&grid, 94e9);
    let scene = scene();
    let squares: Vec<f64> = power.indexed_iter().filter(|(_, a)| **a >= 0.5).map(|(at, _)| (image[at] - scene[at]).powi(2)).collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

#[test]
fn a_scene_that_fills_the_frame_comes_back_where_it_is_through_unknown_phases() {
    let sigma = 0.01;
    let floor = error(&found(&[0.0; ELEMENTS], sigma, &Recorder::default()));
    let grey = error(&Array2::from_elem((SIDE, SIDE), 265.0));
    assert!(floor < 0.6 * grey, "{floor} {grey}");
    for seed in [1, 2] {
        let phases = crate::closure::testdata::random_phases(ELEMENTS, std::f64::consts::PI, seed);
        let told = Recorder::default();
        let error = error(&found(&phases, sigma, &told));
        assert!(error < 1.2 * floor, "seed {seed}: {error}, with phases of 0 {floor}, grey {grey}");
        assert!(told.messages().concat().contains("position of the scene"), "{:?}", told.messages());
    }
}

/// The steps of the image are taken in single precision and end before they have converged, so a last digit can grow.
#[test]
fn several_processes_find_as_good_a_scene() {
    let set = observed(&crate::closure::testdata::random_phases(ELEMENTS, std::f64::consts::PI, 1), 0.01);
    let run = |source: &mut dyn VisibilitySource| found_in(source, 9e-6, &Recorder::default());
    let one = in_processes(1, &set, run).remove(0);
    let all = in_processes(2, &set, run);
    assert_eq!(all[0], all[1], "the same bits in all processes");
    assert!((error(&one) / error(&all[0]) - 1.0).abs() < 0.02, "{} {}", error(&one), error(&all[0]));
    let worst = one.iter().zip(&all[0]).fold(0.0_f64, |d, (a, b)| d.max((a - b).abs()));
    assert!(worst < 0.2 * error(&one), "{worst} K");
}
