//! Tests of simulations through patterns of elements, against sums and integrals that share no code with them.

use super::*;
use crate::fixtures::Recorder;
use crate::progress::Silent;
use crate::random::stream;
use cittert_arrays::pattern::{PatternSample, SampledPattern};
use cittert_arrays::quantity::{Angle, Temperature};
use cittert_arrays::{
    Antenna, ArrayLayout, BrightnessUnit, Image, LayoutFrame, PhaseCenter, Polarization, SkyFrame, SkyGrid, Source, SpectralWindow,
    UvCoverage, VisUnit, VisibilityHeader, VisibilitySet,
};
use ndarray::{Array2, Array4};
use num_complex::Complex64;
use rand::RngExt;
use std::f64::consts::{LN_2, TAU};

const LIGHT: f64 = 299_792_458.0;

/// A header of three channels at 94 GHz for elements of a pattern.
fn header(pattern: ElementPattern, unit: VisUnit) -> VisibilityHeader {
    let antennas = (0..4_u32).map(|k| Antenna::new(format!("A{k}"), k, [0.01 * f64::from(k * k), 0.0, 0.0]));
    let mut layout = ArrayLayout::new("t", LayoutFrame::Boresight, antennas.collect()).unwrap();
    layout.pattern = pattern;
    let spectrum = SpectralWindow::band(94e9, 6e9, 3).unwrap();
    SimulateOptions::default().header(layout, spectrum, PhaseCenter::unprojected("b"), unit)
}

/// Baselines of up to 0.2 m with a small w.
fn coverage() -> UvCoverage {
    let uvw = Array2::from_shape_fn((24, 3), |(r, axis)| {
        let (angle, length) = (2.4 * r as f64, 0.2 * r as f64 / 23.0);
        [length * angle.cos(), length * angle.sin(), 0.01 * (0.7 * r as f64).sin()][axis]
    });
    UvCoverage::new(uvw, vec![0; 24], vec![1; 24], vec![2_460_000.5; 24], vec![1.0; 24], vec![0; 24]).unwrap()
}

/// Power at an angle from the boresight, an angle around it and a frequency.
type Power = fn(f64, f64, f64) -> f64;

/// Each kind with its power at an angle from the boresight (and around it), written out here once more.
fn kinds() -> Vec<(ElementPattern, Power)> {
    let table = |theta: f64, phi: f64| (-30.0 * theta * theta).exp() * (1.0 + 0.2 * theta.sin() * phi.cos());
    let mut samples = Vec::new();
    for t in 0..800 {
        for p in 0..720 {
            let (theta_rad, phi_rad) = (0.001 * f64::from(t), TAU * f64::from(p) / 720.0);
            samples.push(PatternSample { freq_hz: 1e9, theta_rad, phi_rad, power: table(theta_rad, phi_rad) });
        }
    }
    vec![
        ("gaussian fwhm_deg=9".parse().unwrap(), |t, _, _| (-4.0 * LN_2 * (t / 9f64.to_radians()).powi(2)).exp()),
        ("gaussian fwhm_rad=0.2 ref_freq_ghz=90".parse().unwrap(), |t, _, f| (-4.0 * LN_2 * (t * f / 90e9 / 0.2).powi(2)).exp()),
        ("airy diameter_m=0.012 blockage=0.3".parse().unwrap(), |t, _, f| {
            let x = std::f64::consts::PI * 0.012 * t.sin() * f / LIGHT;
            let disc = |x: f64| if x == 0.0 { 1.0 } else { 2.0 * libm::j1(x) / x };
            ((disc(x) - 0.09 * disc(0.3 * x)) / 0.91).powi(2)
        }),
        ("cos exponent=20".parse().unwrap(), |t, _, _| t.cos().powi(20)),
        (ElementPattern::Sampled(SampledPattern::of_samples(&samples).unwrap().into()), |t, p, _| {
            (-30.0 * t * t).exp() * (1.0 + 0.2 * t.sin() * p.cos())
        }),
    ]
}

fn simulate(header: &VisibilityHeader, sky: &SkyModel) -> VisibilitySet {
    simulate_set(header.clone(), &coverage(), sky, &SimulateOptions::default(), &Silent).unwrap()
}

/// The largest difference from the plain sum over directions with their flux, over the total flux.
fn worst(set: &VisibilitySet, points: &[(f64, f64, f64)], power: Power) -> f64 {
    let total: f64 = points.iter().map(|p| p.2.abs()).sum();
    let mut worst = 0.0_f64;
    for ((row, chan, _), v) in set.data.vis.indexed_iter() {
        let f = set.header.spectrum.freq_hz()[chan];
        let uvw = set.data.coverage.uvw_m.row(row);
        let mut sum = Complex64::ZERO;
        for (l, m, flux) in points {
            let n = (1.0 - l * l - m * m).sqrt();
            let seen = flux * power(l.hypot(*m).asin(), m.atan2(*l), f);
            sum += Complex64::from_polar(seen, TAU * f / LIGHT * (uvw[0] * l + uvw[1] * m + uvw[2] * (n - 1.0)));
        }
        worst = worst.max((Complex64::new(v.re.into(), v.im.into()) - sum).norm());
    }
    worst / total
}

#[test]
fn points_and_a_scene_agree_with_plain_sums_for_every_kind() {
    let mut rng = stream(7, "points of a pattern test", 0);
    let points: Vec<(f64, f64, f64)> =
        (0..100).map(|_| (rng.random_range(-0.3..0.3), rng.random_range(-0.3..0.3), rng.random_range(0.1..2.0))).collect();
    let list = SkyModel::of_sources(points.iter().map(|(l, m, s)| Source::point(*l, *m, *s)).collect());
    let grid = SkyGrid::new(64, 64, 6e-3, SkyFrame::Boresight).unwrap();
    let data = Array4::from_shape_fn((1, 1, 64, 64), |(_, _, r, c)| 200.0 + ((r * 31 + c * 17) % 100) as f64);
    let band = SpectralWindow::band(94e9, 6e9, 1).unwrap();
    let image = Image::new(grid.clone(), band, vec![Polarization::I], data, BrightnessUnit::Kelvin).unwrap();
    let cells: Vec<(f64, f64, f64)> = image
        .data
        .indexed_iter()
        .map(|((_, _, r, c), t)| {
            let (l, m) = (grid.l_at(c as f64), grid.m_at(r as f64));
            (l, m, t * grid.cell_sr() / (1.0 - l * l - m * m).sqrt())
        })
        .collect();
    let scene = SkyModel::of_image(image);
    for (pattern, power) in kinds() {
        let of_list = worst(&simulate(&header(pattern.clone(), VisUnit::Jy), &list), &points, power);
        let set = simulate(&header(pattern.clone(), VisUnit::KelvinSr), &scene);
        let of_scene = worst(&set, &cells, power);
        assert!(of_list < 1e-6 && of_scene < 1e-6, "{pattern}: points {of_list:e}, scene {of_scene:e}");
        assert_eq!((set.header.pedestal_k, set.header.layout.pattern), (None, pattern), "the set says what it contains");
    }
}

/// T A over a field that the pattern ends, as an integral in polar coordinates: V = 2 pi T integral A(s) J0(2 pi u s) s / n ds, w = 0.
#[test]
fn a_uniform_scene_gives_the_integral_of_its_pattern_on_every_baseline() {
    let grid = SkyGrid::new(160, 160, 9e-3, SkyFrame::Boresight).unwrap();
    let band = SpectralWindow::band(94e9, 6e9, 1).unwrap();
    let image = Image::new(grid, band, vec![Polarization::I], Array4::from_elem((1, 1, 160, 160), 300.0), BrightnessUnit::Kelvin).unwrap();
    let mut h = header(ElementPattern::None, VisUnit::KelvinSr);
    let mut rows = coverage();
    rows.uvw_m.column_mut(2).fill(0.0);
    rows.uvw_m *= 0.25;
    let options =
        SimulateOptions { element: Element::Gaussian, element_width: Some(Angle(9f64.to_radians())), ..SimulateOptions::default() };
    h.history.clear();
    let set = simulate_set(h, &rows, &SkyModel::of_image(image), &options, &Silent).unwrap();
    let power = |s: f64| (-4.0 * LN_2 * (s.asin() / 9f64.to_radians()).powi(2)).exp();
    let integral = |u: f64| {
        // Simpson's rule.
        let (n, h) = (4000, 0.7 / 4000.0);
        let term = |k: i32| {
            let s = h * f64::from(k);
            let weight = if k == 0 || k == n { 1.0 } else { 2.0 + 2.0 * f64::from(k % 2) };
            weight * power(s) * libm::j0(TAU * u * s) * s / (1.0 - s * s).sqrt()
        };
        300.0 * TAU * h / 3.0 * (0..=n).map(term).sum::<f64>()
    };
    let zero = integral(0.0);
    assert!(
        (set.header.antenna_temperature_k.unwrap() - 300.0).abs() < 0.5,
        "the element sees 300 K: {:?}",
        set.header.antenna_temperature_k
    );
    assert!((zero / 300.0 / 0.0280 - 1.0).abs() < 0.02, "the solid angle of the pattern: {}", zero / 300.0);
    for ((row, chan, _), v) in set.data.vis.indexed_iter() {
        let u = rows.uvw_m[(row, 0)].hypot(rows.uvw_m[(row, 1)]) * set.header.spectrum.freq_hz()[chan] / LIGHT;
        let truth = integral(u);
        assert!((f64::from(v.re) - truth).abs() < 1e-6 * zero && f64::from(v.im).abs() < 1e-6 * zero, "{u}: {v} {truth}");
    }
}

#[test]
fn a_pedestal_before_a_pattern_is_told_and_an_image_with_a_pattern_is_not_dimmed_again() {
    let grid = SkyGrid::new(16, 16, 0.02, SkyFrame::Boresight).unwrap();
    let band = SpectralWindow::band(94e9, 6e9, 1).unwrap();
    let mut image =
        Image::new(grid, band, vec![Polarization::I], Array4::from_elem((1, 1, 16, 16), 300.0), BrightnessUnit::Kelvin).unwrap();
    let pattern: ElementPattern = "gaussian fwhm_deg=9".parse().unwrap();
    let h = header(pattern.clone(), VisUnit::KelvinSr);
    let told = |options: &SimulateOptions| {
        let recorder = Recorder::default();
        simulate_set(h.clone(), &coverage(), &SkyModel::of_image(image.clone()), options, &recorder).unwrap();
        recorder.messages().join("\n")
    };
    assert!(!told(&SimulateOptions::default()).contains("pedestal"));
    let asked = SimulateOptions { pedestal: Pedestal::Kelvin(Temperature(290.0)), ..SimulateOptions::default() };
    assert!(told(&asked).contains("no instrument measures"), "{}", told(&asked));
    let dimmed = simulate(&h, &SkyModel::of_image(image.clone()));
    let plane = pattern.plane(&image.grid, 94e9);
    image.data.indexed_iter_mut().for_each(|((_, _, r, c), t)| *t *= plane[(r, c)]);
    image.pattern = pattern;
    let seen = simulate(&h, &SkyModel::of_image(image));
    let top = dimmed.data.vis[(0, 0, 0)].norm();
    assert!(dimmed.data.vis.iter().zip(&seen.data.vis).all(|(a, b)| (a - b).norm() < 1e-6 * top));
}
