//! Tests of patterns that differ from antenna to antenna, against plain sums that share no code with them.

use super::*;
use crate::progress::Silent;
use crate::random::stream;
use cittert_arrays::pattern::{Pointing, Pointings};
use cittert_arrays::{
    Antenna, ArrayLayout, BrightnessUnit, Image, LayoutFrame, PhaseCenter, Polarization, SkyFrame, SkyGrid, Source, SourceShape,
    SpectralWindow, UvCoverage, VisUnit, VisibilityBlock, VisibilityHeader,
};
use ndarray::{Array2, Array4};
use num_complex::Complex64;
use rand::RngExt;
use std::f64::consts::{LN_2, PI, TAU};

const LIGHT: f64 = 299_792_458.0;
const TIMES: [f64; 3] = [2_460_000.5, 2_460_000.51, 2_460_000.52];

fn header(pattern: &str, unit: VisUnit) -> VisibilityHeader {
    let antennas = (0..4_u32).map(|k| Antenna::new(format!("A{k}"), k, [0.01 * f64::from(k * k), 0.0, 0.0]));
    let mut layout = ArrayLayout::new("t", LayoutFrame::Boresight, antennas.collect()).unwrap();
    layout.pattern = pattern.parse().unwrap();
    SimulateOptions::default().header(layout, SpectralWindow::band(94e9, 6e9, 3).unwrap(), PhaseCenter::unprojected("b"), unit)
}

/// All pairs at three times, with baselines of up to 0.2 m and a small w.
fn coverage() -> UvCoverage {
    let pairs = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];
    let uvw = Array2::from_shape_fn((18, 3), |(r, axis)| {
        let (angle, length) = (2.4 * r as f64, 0.2 * r as f64 / 17.0);
        [length * angle.cos(), length * angle.sin(), 0.01 * (0.7 * r as f64).sin()][axis]
    });
    let (a, b) = (0..18).map(|r| pairs[r % 6]).unzip();
    UvCoverage::new(uvw, a, b, (0..18).map(|r| TIMES[r / 6]).collect(), vec![1.0; 18], vec![0; 18]).unwrap()
}

/// Offsets of some degrees, and widths that differ by tenths.
fn pointings() -> Pointings {
    let mut rng = stream(3, "pointings of a test", 0);
    let mut p = Pointings::nominal(TIMES.to_vec(), 4);
    p.antennas.mapv_inplace(|_| Pointing {
        l: rng.random_range(-0.1..0.1),
        m: rng.random_range(-0.1..0.1),
        width: rng.random_range(0.8..1.25),
    });
    // The third time is like the second one.
    let second = p.antennas.row(1).to_owned();
    p.antennas.row_mut(2).assign(&second);
    p
}

/// Voltage at an angle from the axis, for a relative width and a frequency.
type Voltage = fn(f64, f64, f64) -> f64;

fn kinds() -> [(&'static str, Voltage); 4] {
    [
        ("gaussian fwhm_deg=9", |t, w, _| (-2.0 * LN_2 * (t / w / 9f64.to_radians()).powi(2)).exp()),
        ("gaussian fwhm_rad=0.2 ref_freq_ghz=90", |t, w, f| (-2.0 * LN_2 * (t * f / w / 90e9 / 0.2).powi(2)).exp()),
        ("airy diameter_m=0.012 blockage=0.3", |t, w, f| {
            let x = PI * 0.012 / w * t.sin() * f / LIGHT;
            let disc = |x: f64| if x == 0.0 { 1.0 } else { 2.0 * libm::j1(x) / x };
            (disc(x) - 0.09 * disc(0.3 * x)) / 0.91
        }),
        ("cos exponent=20", |t, w, _| t.cos().powf(10.0 / (w * w))),
    ]
}

/// The largest difference from the plain sum over directions with their flux, over the total flux.
fn worst(block: &VisibilityBlock, freq_hz: &[f64], points: &[(f64, f64, f64)], voltage: Voltage) -> f64 {
    let p = pointings();
    let total: f64 = points.iter().map(|p| p.2.abs()).sum();
    let mut worst = 0.0_f64;
    for ((row, chan, _), v) in block.vis.indexed_iter() {
        let (f, uvw) = (freq_hz[chan], block.coverage.uvw_m.row(row));
        let time = TIMES.iter().position(|t| *t == block.coverage.time_jd[row]).unwrap();
        let mut sum = Complex64::ZERO;
        for (l, m, flux) in points {
            let n = (1.0 - l * l - m * m).sqrt();
            let e = |ant: u32| {
                let a = p.antennas[[time, ant as usize]];
                let c = (1.0 - a.l * a.l - a.m * a.m).sqrt();
                // The angle between two directions by their cross product, which is exact for small angles.
                let cross = [m * c - n * a.m, n * a.l - l * c, l * a.m - m * a.l];
                let sine = cross.iter().map(|x| x * x).sum::<f64>().sqrt();
                voltage(sine.atan2(l * a.l + m * a.m + n * c), a.width, f)
            };
            let seen = flux * e(block.coverage.ant1[row]) * e(block.coverage.ant2[row]);
            sum += Complex64::cis(TAU * f / LIGHT * (uvw[0] * l + uvw[1] * m + uvw[2] * (n - 1.0))) * seen;
        }
        worst = worst.max((Complex64::new(v.re.into(), v.im.into()) - sum).norm());
    }
    worst / total
}

fn through(header: &VisibilityHeader, sky: &SkyModel, p: Pointings) -> VisibilityBlock {
    let simulator = Simulator::new(header.clone(), sky, &SimulateOptions::default(), &Silent).unwrap();
    simulator.with_pointings(p).unwrap().block(coverage(), 0, &Silent).unwrap()
}

#[test]
fn points_and_a_scene_through_differing_patterns_agree_with_plain_sums() {
    let mut rng = stream(7, "points of a test", 0);
    let points: Vec<(f64, f64, f64)> =
        (0..100).map(|_| (rng.random_range(-0.3..0.3), rng.random_range(-0.3..0.3), rng.random_range(0.1..2.0))).collect();
    let list = SkyModel::of_sources(points.iter().map(|(l, m, s)| Source::point(*l, *m, *s)).collect());
    let grid = SkyGrid::new(48, 48, 8e-3, SkyFrame::Boresight).unwrap();
    let data = Array4::from_shape_fn((1, 1, 48, 48), |(_, _, r, c)| 200.0 + ((r * 31 + c * 17) % 100) as f64);
    let band = SpectralWindow::band(94e9, 6e9, 1).unwrap();
    let image = Image::new(grid.clone(), band, vec![Polarization::I], data, BrightnessUnit::Kelvin).unwrap();
    let cell = |((_, _, r, c), t): ((usize, usize, usize, usize), &f64)| {
        let (l, m) = (grid.l_at(c as f64), grid.m_at(r as f64));
        (l, m, t * grid.cell_sr() / (1.0 - l * l - m * m).sqrt())
    };
    let cells: Vec<(f64, f64, f64)> = image.data.indexed_iter().map(cell).collect();
    let scene = SkyModel::of_image(image);
    for (pattern, voltage) in kinds() {
        let h = header(pattern, VisUnit::Jy);
        let of_list = worst(&through(&h, &list, pointings()), h.spectrum.freq_hz(), &points, voltage);
        let h = header(pattern, VisUnit::KelvinSr);
        let of_scene = worst(&through(&h, &scene, pointings()), h.spectrum.freq_hz(), &cells, voltage);
        // Visibilities are kept in single precision.
        assert!(of_list < 1e-7 && of_scene < 1e-7, "{pattern}: points {of_list:e}, scene {of_scene:e}");
    }
}

#[test]
fn antennas_that_are_alike_measure_what_they_measured_before() {
    let mut gaussian = Source::point(0.02, 0.01, 2.0);
    gaussian.shape = SourceShape::Gaussian { major_rad: 0.004, minor_rad: 0.002, pa_rad: 0.4 };
    let sky = SkyModel::of_sources(vec![gaussian, Source::point(-0.03, 0.02, 1.0)]);
    let h = header("gaussian fwhm_deg=9", VisUnit::Jy);
    let plain = Simulator::new(h.clone(), &sky, &SimulateOptions::default(), &Silent).unwrap().block(coverage(), 0, &Silent).unwrap();
    let alike = through(&h, &sky, Pointings::nominal(vec![TIMES[0]], 4));
    assert!(plain.vis.iter().zip(&alike.vis).all(|(a, b)| (a - b).norm() < 3e-7));
    let other = through(&h, &sky, pointings());
    assert!(plain.vis.iter().zip(&other.vis).any(|(a, b)| (a - b).norm() > 0.1));
}

#[test]
fn what_cannot_be_done_is_said() {
    let sky = SkyModel::of_sources(vec![Source::point(0.0, 0.0, 1.0)]);
    let say = |pattern: &str, p: Pointings| {
        let simulator = Simulator::new(header(pattern, VisUnit::Jy), &sky, &SimulateOptions::default(), &Silent).unwrap();
        simulator.with_pointings(p).err().unwrap().to_string()
    };
    assert!(say("none", pointings()).contains("need a pattern"));
    assert!(say("cos exponent=2", Pointings::nominal(vec![1.0], 3)).contains("pointings"));
}
