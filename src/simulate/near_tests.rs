//! Simulations of scenes near the array, against path lengths in space.

use super::*;
use crate::fixtures::positions;
use crate::nearfield::{RangeChoice, RangeMap, Surface};
use crate::progress::Silent;
use cittert_arrays::{
    Antenna, ArrayLayout, BrightnessUnit, Image, LayoutFrame, PhaseCenter, Polarization, SceneRange, SkyFrame, SkyGrid, Source,
    SourceShape, SpectralWindow, UvCoverage, VisUnit, VisibilityHeader, VisibilitySet,
};
use ndarray::{Array2, Array4};
use num_complex::Complex64;
use std::f64::consts::TAU;

const LIGHT: f64 = 299_792_458.0;

fn header(places: &[[f64; 3]], unit: VisUnit) -> VisibilityHeader {
    let antennas = places.iter().enumerate().map(|(k, p)| Antenna::new(format!("A{k}"), k as u32, *p));
    let layout = ArrayLayout::new("t", LayoutFrame::Boresight, antennas.collect()).unwrap();
    let spectrum = SpectralWindow::band(LIGHT / 3.2e-3, 6e9, 3).unwrap();
    SimulateOptions::default().header(layout, spectrum, PhaseCenter::unprojected("b"), unit)
}

/// All pairs, twice.
fn coverage(places: &[[f64; 3]]) -> UvCoverage {
    let n = places.len();
    let pairs: Vec<(usize, usize)> =
        (0..2).flat_map(|_| (0..n).flat_map(|a| (a + 1..n).map(move |b| (a, b))).collect::<Vec<_>>()).collect();
    let uvw = Array2::from_shape_fn((pairs.len(), 3), |(r, k)| places[pairs[r].1][k] - places[pairs[r].0][k]);
    let rows = pairs.len();
    let (a, b) = pairs.into_iter().map(|(a, b)| (a as u32, b as u32)).unzip();
    UvCoverage::new(uvw, a, b, vec![2_460_000.5; rows], vec![1.0; rows], vec![0; rows]).unwrap()
}

fn scene(n: usize, cell: f64) -> Image {
    let grid = SkyGrid::new(n, n, cell, SkyFrame::Boresight).unwrap();
    let data = Array4::from_shape_fn((1, 1, n, n), |(_, _, r, c)| 200.0 + ((r * 7 + c * 3) % 11) as f64 * 10.0);
    Image::new(grid, SpectralWindow::band(9.4e10, 1e9, 1).unwrap(), vec![Polarization::I], data, BrightnessUnit::Kelvin).unwrap()
}

fn simulate(places: &[[f64; 3]], sky: &SkyModel, options: &SimulateOptions, unit: VisUnit) -> VisibilitySet {
    simulate_set(header(places, unit), &coverage(places), sky, options, &Silent).unwrap()
}

fn range(text: &str) -> SimulateOptions {
    SimulateOptions { range: Some(text.parse().unwrap()), ..SimulateOptions::default() }
}

fn wide(v: num_complex::Complex<f32>) -> Complex64 {
    Complex64::new(v.re.into(), v.im.into())
}

/// The visibility of a pair of antennas, from places in space: the sum of T dOmega R^2 / (d_p d_q) exp(-i k (d_q - d_p)).
fn by_paths(image: &Image, distance: impl Fn(f64, f64, f64) -> f64, (p, q): ([f64; 3], [f64; 3]), freq: f64, minus: f64) -> Complex64 {
    let mut sum = Complex64::ZERO;
    for ((row, column), t) in image.plane(0, 0).indexed_iter() {
        let (l, m) = (image.grid.l_at(column as f64), image.grid.m_at(row as f64));
        let n = (1.0 - l * l - m * m).sqrt();
        let r = distance(l, m, n);
        let to = |a: [f64; 3]| ((l * r - a[0]).powi(2) + (m * r - a[1]).powi(2) + (n * r - a[2]).powi(2)).sqrt();
        let (dp, dq) = (to(p), to(q));
        let solid_angle = image.grid.cell_rad * image.grid.cell_rad / n;
        sum += Complex64::from_polar((t - minus) * solid_angle * r * r / (dp * dq), TAU * freq / LIGHT * (dp - dq - (q[2] - p[2])));
    }
    sum
}

#[test]
fn a_warm_scene_on_a_plane_and_a_sphere_is_the_sum_over_its_paths() {
    let places = positions(7, 0.5, 0.02, 3);
    let image = scene(16, 0.015);
    let sky = SkyModel::of_image(image.clone());
    for (text, sphere) in [("10m", false), ("sphere:10m", true), ("31.25m", false)] {
        let set = simulate(&places, &sky, &range(text), VisUnit::KelvinSr);
        let at = if text == "31.25m" { 31.25 } else { 10.0 };
        assert_eq!(
            set.header.near_field.scene,
            Some(if sphere { SceneRange::Sphere { radius_m: at } } else { SceneRange::Plane { distance_m: at } })
        );
        let minus = set.header.pedestal_k.unwrap();
        let distance = |_: f64, _: f64, n: f64| if sphere { at } else { at / n };
        let total = 250.0 * 256.0 * image.grid.cell_sr();
        for row in [0, 5, 13, 30] {
            let (a, b) = (set.data.coverage.ant1[row] as usize, set.data.coverage.ant2[row] as usize);
            for (c, freq) in set.header.spectrum.freq_hz().iter().enumerate() {
                let truth = by_paths(&image, distance, (places[a], places[b]), *freq, minus);
                // Sets hold single precision.
                let error = (wide(set.data.vis[(row, c, 0)]) - truth).norm();
                assert!(error < 1e-7 * truth.norm() + 1e-9 * total, "{text}, row {row}: {error:e}");
            }
        }
    }
}

#[test]
fn far_away_the_set_is_that_of_the_far_field() {
    let places = positions(7, 0.5, 0.02, 3);
    let sky = SkyModel::of_image(scene(16, 0.015));
    let far = simulate(&places, &sky, &SimulateOptions { method: Method::Dft, ..SimulateOptions::default() }, VisUnit::KelvinSr);
    let near = simulate(&places, &sky, &range("1e15m"), VisUnit::KelvinSr);
    let top = far.data.vis.iter().map(|v| v.norm()).fold(0.0, f32::max);
    let worst = far.data.vis.iter().zip(&near.data.vis).map(|(a, b)| (a - b).norm()).fold(0.0, f32::max);
    assert!(worst < 2e-7 * top, "{:e}", worst / top);
}

#[test]
fn a_map_of_distances_gives_what_the_plane_gives_that_it_shows() {
    let places = positions(6, 0.5, 0.0, 3);
    let image = scene(12, 0.02);
    let mut map = image.clone();
    map.unit = BrightnessUnit::Metre;
    for ((_, _, r, c), v) in map.data.indexed_iter_mut() {
        let (l, m) = (image.grid.l_at(c as f64), image.grid.m_at(r as f64));
        *v = 8.0 / (1.0 - l * l - m * m).sqrt();
    }
    let surface = Surface::Map(RangeMap::new("wall.fits", &map).unwrap().into());
    let by_map = simulate(&places, &SkyModel::of_image(image.clone()).at(Some(surface)), &SimulateOptions::default(), VisUnit::KelvinSr);
    let by_plane = simulate(&places, &SkyModel::of_image(image), &range("8m"), VisUnit::KelvinSr);
    let worst = by_map.data.vis.iter().zip(&by_plane.data.vis).map(|(a, b)| (a - b).norm() / b.norm()).fold(0.0, f32::max);
    assert!(worst < 1e-6, "{worst:e}");
    assert_eq!(by_map.header.near_field.scene, Some(SceneRange::map("wall.fits")));
}

#[test]
fn points_are_seen_by_each_element_at_its_own_angle() {
    let places = positions(6, 0.5, 0.0, 9);
    let sky = SkyModel::of_sources(vec![
        Source::point(0.05, -0.08, 2.0),
        Source { spectral_index: -1.0, ref_freq_hz: Some(9e10), ..Source::point(-0.1, 0.02, 1.0) },
    ]);
    let options = SimulateOptions { subchannels: 3, element: Element::CosPower(30.0), ..range("4m") };
    let set = simulate(&places, &sky, &options, VisUnit::Jy);
    let width = set.header.spectrum.width_hz()[1];
    for row in [0, 7, 14] {
        let (p, q) = (places[set.data.coverage.ant1[row] as usize], places[set.data.coverage.ant2[row] as usize]);
        let mut truth = Complex64::ZERO;
        for k in [-1.0, 0.0, 1.0] {
            let freq = set.header.spectrum.freq_hz()[1] + k * width / 3.0;
            for (l, m, s) in [(0.05, -0.08, 2.0), (-0.1, 0.02, 9e10 / freq)] {
                let n = (1.0_f64 - l * l - m * m).sqrt();
                let at = [l / n * 4.0, m / n * 4.0, 4.0];
                let arm = |a: [f64; 3]| {
                    let d = ((at[0] - a[0]).powi(2) + (at[1] - a[1]).powi(2) + at[2] * at[2]).sqrt();
                    (d, (at[2] / d).powi(15))
                };
                let ((dp, vp), (dq, vq), r) = (arm(p), arm(q), 4.0 / n);
                truth += Complex64::from_polar(s * vp * vq * r * r / (dp * dq) / 3.0, TAU * freq / LIGHT * (dp - dq));
            }
        }
        assert!((wide(set.data.vis[(row, 1, 0)]) - truth).norm() < 3e-7, "{row}");
    }
}

#[test]
fn what_has_no_near_field_is_refused() {
    let places = positions(4, 0.5, 0.0, 9);
    let sky = SkyModel::of_image(scene(8, 0.01));
    let refused = |sky: &SkyModel, options: &SimulateOptions| {
        simulate_set(header(&places, VisUnit::Jy), &coverage(&places), sky, options, &Silent).unwrap_err().to_string()
    };
    assert!(refused(&sky, &SimulateOptions { method: Method::Mask, ..range("10m") }).starts_with("method is mask"));
    assert!(refused(&sky, &SimulateOptions { no_w: true, ..range("10m") }).starts_with("no-w"));
    assert!(refused(&sky, &range("0.3m")).contains("farthest element"));
    assert!(refused(&sky, &range("auto")).starts_with("range is auto"));
    let blob = Source { shape: SourceShape::Gaussian { major_rad: 0.01, minor_rad: 0.01, pa_rad: 0.0 }, ..Source::point(0.0, 0.0, 1.0) };
    assert!(refused(&SkyModel::of_sources(vec![blob]), &range("10m")).contains("draw it as an image"));
    assert!("10m".parse::<RangeChoice>().is_ok());
}
