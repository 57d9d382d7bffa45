//! Three scenes and two layouts that no other test or benchmark uses.

use cittert::arrays::{
    Antenna, ArrayLayout, GainTable, LayoutFrame, PhaseCenter, Polarization, SPEED_OF_LIGHT_M_S, SkyFrame, SkyGrid, SpectralWindow,
    UvCoverage, VisUnit, VisibilityBlock, VisibilityHeader, VisibilitySet,
};
use ndarray::Array2;
use num_complex::{Complex32, Complex64};
use std::f64::consts::TAU;

/// Pixels a side.
pub const SIDE: usize = 64;
/// Cell of the images, rad.
pub const CELL: f64 = 3e-3;
/// Noise of the real part of a visibility as a fraction of the total flux.
const NOISE: f64 = 2e-3;

/// One of the six cases: a scene observed with a layout.
pub struct Case {
    pub name: &'static str,
    pub scene: Array2<f64>,
    pub places: Vec<[f64; 2]>,
}

/// Uniform numbers in [-1, 1), the same in every run.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// Nearly Gaussian, of unit variance.
    fn gauss(&mut self) -> f64 {
        self.next() + self.next() + self.next()
    }
}

/// Brightness at a column and row from the middle of the frame.
type Brightness = fn(f64, f64) -> f64;

/// All six cases.
pub fn cases() -> Vec<Case> {
    let scenes: [(Brightness, [&str; 2]); 3] =
        [(points, ["points, spiral", "points, Y"]), (ring, ["ring, spiral", "ring, Y"]), (bar, ["bar, spiral", "bar, Y"])];
    let mut out = Vec::new();
    for (brightness, names) in scenes {
        for (name, places) in names.into_iter().zip([spiral(), wye()]) {
            out.push(Case {
                name,
                scene: Array2::from_shape_fn((SIDE, SIDE), |(i, j)| brightness(j as f64 - 31.0, i as f64 - 33.0)),
                places,
            });
        }
    }
    out
}

/// Blobs of two pixels and one faint extended one.
fn points(x: f64, y: f64) -> f64 {
    let blob = |dx: f64, dy: f64, width: f64, peak: f64| peak * (-((x - dx).powi(2) + (y - dy).powi(2)) / (2.0 * width * width)).exp();
    blob(0.0, 0.0, 1.3, 10.0) + blob(-9.0, 5.0, 1.3, 4.0) + blob(7.0, -11.0, 1.3, 2.0) + blob(4.0, 8.0, 4.0, 0.3)
}

/// A ring that is brighter on one side.
fn ring(x: f64, y: f64) -> f64 {
    let r = x.hypot(y);
    if (6.0..11.0).contains(&r) { 1.0 + 0.6 * x / r } else { 0.0 }
}

/// A bar with a bright end and a darker neighbour.
fn bar(x: f64, y: f64) -> f64 {
    let (u, v) = (0.8 * x + 0.6 * y, 0.8 * y - 0.6 * x);
    let bar = if u.abs() < 12.0 && v.abs() < 3.0 { 1.0 } else { 0.0 };
    let end = if (u - 9.0).hypot(v) < 2.5 { 2.0 } else { 0.0 };
    bar + end + if (u + 2.0).hypot(v - 9.0) < 4.0 { 0.5 } else { 0.0 }
}

/// Thirty antennas on a spiral; m.
fn spiral() -> Vec<[f64; 2]> {
    (0..30)
        .map(|k| {
            let (r, a) = (0.24 * ((k as f64 + 0.5) / 30.0).powf(0.7), 2.399_963 * k as f64);
            [r * a.cos(), r * a.sin()]
        })
        .collect()
}

/// Twenty-seven antennas on the arms of a Y; m.
fn wye() -> Vec<[f64; 2]> {
    (0..27)
        .map(|k| {
            let (r, a) = (0.26 * (f64::from(k / 3 + 1) / 9.0).powf(1.4), TAU * (f64::from(k % 3) / 3.0 + 0.04));
            [r * a.cos(), r * a.sin()]
        })
        .collect()
}

/// The grid of all images.
pub fn grid() -> SkyGrid {
    SkyGrid::new(SIDE, SIDE, CELL, SkyFrame::Boresight).unwrap()
}

impl Case {
    /// What the array measures in `n_chan` channels, with antenna phases in -range..range rad.
    pub fn observed(&self, n_chan: usize, range: f64) -> (VisibilitySet, GainTable) {
        let n_ant = self.places.len();
        let antennas = self.places.iter().enumerate().map(|(k, p)| Antenna::new(format!("a{k}"), k as u32, [p[0], p[1], 0.0])).collect();
        let layout = ArrayLayout::new("test", LayoutFrame::Boresight, antennas).unwrap();
        let freq_hz: Vec<f64> = (0..n_chan).map(|c| 90e9 + 4e9 * c as f64).collect();
        let header = VisibilityHeader {
            layout: layout.clone(),
            spectrum: SpectralWindow::new(freq_hz.clone(), vec![1e6; n_chan]).unwrap(),
            polarizations: vec![Polarization::XX, Polarization::YY],
            phase_centers: vec![PhaseCenter::unprojected("boresight")],
            unit: VisUnit::Jy,
            telescope: "test".into(),
            instrument: "test".into(),
            pedestal_k: None,
            scene_pedestal_k: None,
            scene_width_rad: None,
            antenna_temperature_k: None,
            near_field: Default::default(),
            annotations: Default::default(),
            history: Vec::new(),
        };
        let pairs: Vec<(usize, usize)> = (0..n_ant).flat_map(|a| (a + 1..n_ant).map(move |b| (a, b))).collect();
        let n = pairs.len();
        let uvw = Array2::from_shape_fn((n, 3), |(r, k)| if k < 2 { self.places[pairs[r].1][k] - self.places[pairs[r].0][k] } else { 0.0 });
        let (ant1, ant2) = (pairs.iter().map(|p| p.0 as u32).collect(), pairs.iter().map(|p| p.1 as u32).collect());
        let coverage = UvCoverage::new(uvw.clone(), ant1, ant2, vec![2_460_000.5; n], vec![1.0; n], vec![0; n]).unwrap();
        let mut data = VisibilityBlock::zeros(coverage, n_chan, 2);
        let mut random = Random(17);
        let phase: Vec<f64> = (0..n_ant).map(|_| range * random.next()).collect();
        let sigma = NOISE * self.scene.sum();
        let lit: Vec<((usize, usize), f64)> = self.scene.indexed_iter().filter(|(_, v)| **v > 1e-4).map(|(at, v)| (at, *v)).collect();
        let grid = grid();
        for (r, (p, q)) in pairs.iter().enumerate() {
            for (c, f) in freq_hz.iter().enumerate() {
                let (u, v) = (uvw[(r, 0)] * f / SPEED_OF_LIGHT_M_S, uvw[(r, 1)] * f / SPEED_OF_LIGHT_M_S);
                let sky: Complex64 = lit
                    .iter()
                    .map(|((i, j), s)| Complex64::from_polar(*s, TAU * (u * grid.l_at(*j as f64) + v * grid.m_at(*i as f64))))
                    .sum();
                for hand in 0..2 {
                    let noise = Complex64::new(random.gauss(), random.gauss()) * sigma;
                    let seen = sky * Complex64::from_polar(1.0, phase[*p] - phase[*q]) + noise;
                    data.vis[(r, c, hand)] = Complex32::new(seen.re as f32, seen.im as f32);
                    data.weights[(r, c, hand)] = (1.0 / (sigma * sigma)) as f32;
                }
            }
        }
        let set = VisibilitySet::new(header.clone(), data).unwrap();
        let mut truth = GainTable::unity(layout, header.spectrum, vec!["X+Y".into()], vec![2_460_000.5], vec![1.0]).unwrap();
        truth.gains.indexed_iter_mut().for_each(|((_, a, _, _), g)| *g = Complex64::from_polar(1.0, phase[a]));
        (set, truth)
    }
}

/// Rms of the difference from the scene over the rms of the scene.
pub fn error_of(image: &Array2<f64>, scene: &Array2<f64>) -> f64 {
    ((image - scene).mapv(|v| v * v).sum() / scene.mapv(|v| v * v).sum()).sqrt()
}
