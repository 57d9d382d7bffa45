//! Tests of bands against numerical integrals and closed forms that share no code with them.

use super::*;
use crate::progress::Silent;
use crate::simulate::{SimulateOptions, Simulator, SkyModel};
use cittert_arrays::{Antenna, ArrayLayout, BandSample, BandTable, LayoutFrame, PhaseCenter, Source, SpectralWindow, UvCoverage, VisUnit};
use ndarray::Array2;
use num_complex::Complex64;
use std::f64::consts::{LN_2, PI, TAU};
use std::sync::Arc;

const LIGHT: f64 = 299_792_458.0;
const CENTER: f64 = 94e9;
const WIDTH: f64 = 1e9;

fn layout() -> ArrayLayout {
    let antennas = (0..3_u32).map(|k| Antenna::new(format!("A{k}"), k, [0.5 * f64::from(k), 0.0, 0.0]));
    ArrayLayout::new("t", LayoutFrame::Boresight, antennas.collect()).unwrap()
}

/// Visibilities of a point of 1 Jy at l = 0.6 on the three baselines: delays of 1, 2 and 1 ns.
fn measured(receivers: &Receivers) -> (Vec<Complex64>, usize) {
    let sky = SkyModel::of_sources(vec![Source::point(0.6, 0.0, 1.0)]);
    let header = SimulateOptions::default().header(
        layout(),
        SpectralWindow::band(CENTER, WIDTH, 1).unwrap(),
        PhaseCenter::unprojected("b"),
        VisUnit::Jy,
    );
    let pairs = [(0, 1), (0, 2), (1, 2)];
    let uvw = Array2::from_shape_fn((3, 3), |(r, axis)| if axis == 0 { 0.5 * f64::from(pairs[r].1 - pairs[r].0) } else { 0.0 });
    let (a, b) = pairs.map(|(a, b)| (a as u32, b as u32)).into_iter().unzip();
    let rows = UvCoverage::new(uvw, a, b, vec![2_460_000.5; 3], vec![1.0; 3], vec![0; 3]).unwrap();
    let mut simulator = Simulator::new(header, &sky, &SimulateOptions::default(), &Silent).unwrap().with_receivers(receivers).unwrap();
    let line = simulator.header().history.last().unwrap().clone();
    let nodes = line.split("up to ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    let block = simulator.block(rows, 0, &Silent).unwrap();
    (block.vis.iter().map(|v| Complex64::new(v.re.into(), v.im.into())).collect(), nodes)
}

/// Responses of two receivers at distances x from the middle of the channel, in its widths.
type Response<'a> = &'a dyn Fn(f64) -> Complex64;

/// int H_p conj(H_q) exp(2 pi i f tau) df over the root of the product of the powers, by a fine rule of midpoints.
fn washed(p: Response<'_>, q: Response<'_>, delay_s: f64) -> Complex64 {
    let (reach, n) = (60.0, 1_200_000);
    let (mut sum, mut pp, mut qq) = (Complex64::ZERO, 0.0, 0.0);
    for k in 0..n {
        let x = reach * ((f64::from(k) + 0.5) / f64::from(n) * 2.0 - 1.0);
        let (p, q) = (p(x), q(x));
        sum += p * q.conj() * Complex64::cis(TAU * (CENTER + x * WIDTH) * delay_s);
        (pp, qq) = (pp + p.norm_sqr(), qq + q.norm_sqr());
    }
    sum / (pp * qq).sqrt()
}

fn delay(pair: usize) -> f64 {
    0.6 * [0.5, 1.0, 0.5][pair] / LIGHT
}

fn with_shape(shape: &BandShape) -> Receivers {
    let mut r = Receivers { shaped: true, ..Receivers::nominal(3) };
    r.of.iter_mut().for_each(|r| r.shape = shape.clone());
    r
}

fn shape(text: &str) -> BandShape {
    text.parse().unwrap()
}

#[test]
fn every_shape_washes_fringes_like_its_integral() {
    // The transfer functions as polynomials of s = -2 i x: Butterworth of orders 2 and 4, Chebyshev of order 3 with 0.5 dB (Weinberg's table).
    let s = |x: f64| Complex64::new(0.0, -2.0 * x);
    let second = |a: f64, s: Complex64| 1.0 / (1.0 + a * s + s * s);
    let shapes: [(&str, Response<'_>); 5] = [
        ("flat", &|x| Complex64::from(f64::from(x.abs() <= 0.5))),
        ("gaussian", &|x| Complex64::from((-2.0 * LN_2 * x * x).exp())),
        ("butterworth:2", &|x| second(2f64.sqrt(), s(x))),
        ("butterworth:4", &|x| second(0.765_366_864_730_18, s(x)) * second(1.847_759_065_022_573_5, s(x))),
        ("chebyshev:3,0.5", &|x| {
            let s = s(x);
            1.0 / (s * s * s + 1.252_912_987 * s * s + 1.534_895_460 * s + 0.715_693_806)
        }),
    ];
    for (text, response) in shapes {
        let (vis, nodes) = measured(&with_shape(&shape(text)));
        for (pair, v) in vis.iter().enumerate() {
            let truth = washed(response, response, delay(pair));
            assert!((v - truth).norm() < 3e-5, "{text}, pair {pair}, {nodes} nodes: {v} {truth}");
        }
        let mut out = with_shape(&shape(text));
        (out.of[1].offset_hz, out.of[1].width, out.of[2].width) = (0.12 * WIDTH, 1.15, 0.9);
        let tuned: [&dyn Fn(f64) -> Complex64; 3] = [&response, &|x| response((x - 0.12) / 1.15), &|x| response(x / 0.9)];
        let (vis, nodes) = measured(&out);
        for (k, (p, q)) in [(0, 1), (0, 2), (1, 2)].into_iter().enumerate() {
            let truth = washed(tuned[p], tuned[q], delay(k));
            assert!((vis[k] - truth).norm() < 5e-5, "{text} out of tune, pair {k}, {nodes} nodes: {} {truth}", vis[k]);
        }
    }
}

#[test]
fn flat_and_gaussian_bands_have_their_closed_forms() {
    let sinc = |t: f64| (PI * WIDTH * t).sin() / (PI * WIDTH * t);
    let gauss = |t: f64| (-(PI * WIDTH * t).powi(2) / (4.0 * LN_2)).exp();
    for (text, closed) in [("flat", &sinc as &dyn Fn(f64) -> f64), ("gaussian", &gauss)] {
        let (vis, nodes) = measured(&with_shape(&shape(text)));
        assert!(nodes <= 48, "{text}: {nodes} nodes");
        for (pair, v) in vis.iter().enumerate() {
            let truth = Complex64::cis(TAU * CENTER * delay(pair)) * closed(delay(pair));
            assert!((v - truth).norm() < 2e-6, "{text}: {v} {truth}");
        }
    }
}

#[test]
fn a_table_washes_like_the_integral_over_its_lines() {
    // A band with a slope, a ripple and a curved phase, over the sky frequency and about the channel; dense and sparse.
    let response = |x: f64| Complex64::from_polar(1.0 + 0.4 * x + 0.1 * (9.0 * x).sin(), 2.0 * x * x);
    for (n, relative) in [(12, false), (12, true), (301, false), (301, true)] {
        let x_of = |k: usize| -0.5 + k as f64 / (n - 1) as f64;
        let at = |x: f64| if relative { x * WIDTH } else { CENTER + x * WIDTH };
        let samples = (0..n).map(|k| BandSample { antenna: None, freq_hz: at(x_of(k)), response: response(x_of(k)) }).collect();
        let table = BandTable::new(samples, relative).unwrap();
        let (vis, nodes) = measured(&with_shape(&BandShape::Table(Arc::new(table))));
        let lines = |x: f64| {
            let place = (x + 0.5) * (n - 1) as f64;
            let k = (place.floor() as usize).min(n - 2);
            let part = place - k as f64;
            if x.abs() > 0.5 { Complex64::ZERO } else { response(x_of(k)) * (1.0 - part) + response(x_of(k + 1)) * part }
        };
        for (pair, v) in vis.iter().enumerate() {
            let truth = washed(&lines, &lines, delay(pair));
            assert!((v - truth).norm() < 3e-5, "{n} samples, pair {pair}, {nodes} nodes: {v} {truth}");
        }
    }
}

#[test]
fn jitter_lowers_the_coherence_by_its_characteristic_function() {
    // 94 GHz sampled with 0.4 ps: exp(-(2 pi f sigma)^2) = 0.9457.
    let mut jitter = Receivers::nominal(3);
    jitter.of.iter_mut().for_each(|r| r.jitter_s = 0.4e-12);
    let (vis, nodes) = measured(&jitter);
    assert_eq!(nodes, 1);
    let loss = (-(TAU * CENTER * 0.4e-12_f64).powi(2)).exp();
    assert!(loss < 0.95 && vis.iter().all(|v| (v.norm() - loss).abs() < 1e-6), "{loss}: {vis:?}");
    jitter.sampler_hz = Some(1e9);
    let loss = (-(TAU * 1e9 * 0.4e-12_f64).powi(2)).exp();
    assert!(measured(&jitter).0.iter().all(|v| (v.norm() - loss).abs() < 1e-6));
    // The mean over many instants of two samplers, drawn from normal numbers at equal steps of their probability.
    let n = 2000;
    let normal = |k: i32| {
        let p = (f64::from(k) + 0.5) / f64::from(n);
        // The inverse of the error function by bisection.
        let (mut low, mut high) = (-8.0, 8.0);
        for _ in 0..60 {
            let mid = 0.5 * (low + high);
            if 0.5 * libm::erfc(-mid / 2f64.sqrt()) < p { low = mid } else { high = mid }
        }
        low
    };
    let mean: f64 = (0..n).map(|k| (TAU * CENTER * 0.4e-12 * normal(k)).cos()).sum::<f64>() / f64::from(n);
    let direct = (-(TAU * CENTER * 0.4e-12_f64).powi(2)).exp();
    assert!((mean * mean - direct).abs() < 2e-4, "{} {direct}", mean * mean);
}

#[test]
fn wrong_shapes_are_refused() {
    let say = |text: &str| text.parse::<BandShape>().unwrap_err();
    assert!(say("box").contains("flat, gaussian"));
    assert!(say("butterworth:x").contains("order"));
    assert!(say("chebyshev:4").contains("ripple"));
    for text in ["butterworth:1", "butterworth:17", "chebyshev:4,0", "missing.csv"] {
        assert!(shape(text).check().is_err(), "{text}");
    }
    for text in ["flat", "gaussian", "butterworth:4", "chebyshev:5,0.5"] {
        assert_eq!(shape(text).to_string(), text);
    }
    assert_eq!(shape("chebyshev:5,0.5dB"), shape("chebyshev:5,0.5"));
}
