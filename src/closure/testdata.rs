//! Small synthetic sets for the tests of this folder.

use cittert_arrays::{
    Antenna, ArrayLayout, LayoutFrame, PhaseCenter, Polarization, SPEED_OF_LIGHT_M_S, SpectralWindow, UvCoverage, VisUnit, VisibilityBlock,
    VisibilityHeader, VisibilitySet,
};
use ndarray::Array2;
use num_complex::{Complex, Complex64};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::f64::consts::TAU;

pub(crate) const T0_JD: f64 = 2_460_310.5;

/// The set to simulate: random antennas in a disc of 1 km that rotates under the sky, and point sources (l, m, flux).
#[derive(Clone)]
pub(crate) struct Scene {
    pub(crate) n_ant: usize,
    pub(crate) n_time: usize,
    pub(crate) n_chan: usize,
    pub(crate) pols: Vec<Polarization>,
    pub(crate) integration_s: f64,
    pub(crate) sources: Vec<(f64, f64, f64)>,
    /// Noise of the real and of the imaginary part.
    pub(crate) sigma: f64,
    pub(crate) seed: u64,
}

impl Scene {
    pub(crate) fn point(n_ant: usize, n_time: usize) -> Self {
        Self {
            n_ant,
            n_time,
            n_chan: 1,
            pols: vec![Polarization::I],
            integration_s: 10.0,
            sources: vec![(0.0, 0.0, 1.0)],
            sigma: 0.0,
            seed: 1,
        }
    }

    pub(crate) fn layout(&self) -> ArrayLayout {
        let mut rng = ChaCha8Rng::seed_from_u64(99);
        let place = |rng: &mut ChaCha8Rng| {
            let (r, a): (f64, f64) = (500.0 * rng.random_range(0.0_f64..1.0).sqrt(), rng.random_range(0.0..TAU));
            [r * a.cos(), r * a.sin(), 0.0]
        };
        let antennas = (0..self.n_ant).map(|i| Antenna::new(format!("A{i}"), i as u32, place(&mut rng))).collect();
        ArrayLayout::new("disc", LayoutFrame::Boresight, antennas).unwrap()
    }

    pub(crate) fn header(&self) -> VisibilityHeader {
        let width = 2e6;
        let freq = (0..self.n_chan).map(|c| 1.4e9 + width * c as f64).collect();
        VisibilityHeader {
            layout: self.layout(),
            spectrum: SpectralWindow::new(freq, vec![width; self.n_chan]).unwrap(),
            polarizations: self.pols.clone(),
            phase_centers: vec![PhaseCenter::unprojected("test")],
            unit: VisUnit::Jy,
            telescope: "disc".into(),
            instrument: "disc".into(),
            pedestal_k: None,
            scene_pedestal_k: None,
            scene_width_rad: None,
            antenna_temperature_k: None,
            near_field: Default::default(),
            annotations: Default::default(),
            history: Vec::new(),
        }
    }

    /// The set with `gain(time, ant, chan, feed)` on it; weights are 1 / sigma^2, or 1 without noise.
    pub(crate) fn set(&self, gain: impl Fn(usize, usize, usize, usize) -> Complex64) -> VisibilitySet {
        let header = self.header();
        let antennas = header.layout.antennas().to_vec();
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        let mut uvw = Vec::new();
        let (mut ant1, mut ant2, mut time) = (Vec::new(), Vec::new(), Vec::new());
        for t in 0..self.n_time {
            let turn = TAU * t as f64 * self.integration_s / 86_164.0;
            for p in 0..self.n_ant {
                for q in p + 1..self.n_ant {
                    let d: Vec<f64> = (0..3).map(|k| antennas[q].position_m[k] - antennas[p].position_m[k]).collect();
                    uvw.extend([d[0] * turn.cos() - d[1] * turn.sin(), d[0] * turn.sin() + d[1] * turn.cos(), 0.0]);
                    ant1.push(p as u32);
                    ant2.push(q as u32);
                    time.push(T0_JD + t as f64 * self.integration_s / 86_400.0);
                }
            }
        }
        let rows = ant1.len();
        let uvw = Array2::from_shape_vec((rows, 3), uvw).unwrap();
        let coverage = UvCoverage::new(uvw, ant1, ant2, time, vec![self.integration_s; rows], vec![0; rows]).unwrap();
        let mut block = VisibilityBlock::zeros(coverage, self.n_chan, self.pols.len());
        let per_time = rows / self.n_time.max(1);
        for row in 0..rows {
            let (p, q) = (block.coverage.ant1[row] as usize, block.coverage.ant2[row] as usize);
            for c in 0..self.n_chan {
                let k = TAU * header.spectrum.freq_hz()[c] / SPEED_OF_LIGHT_M_S;
                let (u, v) = (block.coverage.uvw_m[(row, 0)], block.coverage.uvw_m[(row, 1)]);
                let sky: Complex64 = self.sources.iter().map(|(l, m, s)| Complex64::from_polar(*s, k * (u * l + v * m))).sum();
                for (i, pol) in self.pols.iter().enumerate() {
                    let (f1, f2) = pol.feeds().unwrap_or((0, 0));
                    let truth = if f1 == f2 { sky } else { Complex64::new(0.0, 0.0) };
                    let noise = Complex64::new(rng.sample(StandardNormal), rng.sample(StandardNormal)) * self.sigma;
                    let seen = gain(row / per_time, p, c, f1) * gain(row / per_time, q, c, f2).conj() * truth + noise;
                    block.vis[(row, c, i)] = Complex::new(seen.re as f32, seen.im as f32);
                    if self.sigma > 0.0 {
                        block.weights[(row, c, i)] = (1.0 / (self.sigma * self.sigma)) as f32;
                    }
                }
            }
        }
        VisibilitySet::new(header, block).unwrap()
    }
}

/// Phases in -range..range, always the same for a seed.
pub(crate) fn random_phases(n: usize, range: f64, seed: u64) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..n).map(|_| rng.random_range(-range..range)).collect()
}

/// exp(i phase).
pub(crate) fn cis(phase: f64) -> Complex64 {
    Complex64::from_polar(1.0, phase)
}

/// Largest error of the phases of `found` against `truth`, rad, after the best common phase.
pub(crate) fn worst_phase(found: &[Complex64], truth: &[Complex64]) -> f64 {
    let common: Complex64 = found.iter().zip(truth).map(|(f, t)| (f * t.conj()) / (f * t).norm()).sum();
    found.iter().zip(truth).map(|(f, t)| (f * t.conj() * common.conj()).arg().abs()).fold(0.0, f64::max)
}
