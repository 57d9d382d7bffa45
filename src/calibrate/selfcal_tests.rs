//! Runs of the whole loop, with a small CLEAN by direct sums as model maker.

use super::*;
use crate::Result;
use crate::closure::testdata::{Scene, cis, random_phases};
use crate::fixtures::Recorder;
use crate::progress::{Observer, Silent};
use cittert_arrays::{SPEED_OF_LIGHT_M_S, UvCoverage, VisibilityHeader, VisibilitySource};
use ndarray::{Array2, Array3};
use num_complex::{Complex, Complex64};
use std::f64::consts::TAU;

const SIDE: usize = 21;
const CELL: f64 = 6e-5;

/// Högbom CLEAN with direct sums. It is slow, but it tests the loop without the imager.
struct TinyClean {
    components: Vec<(f64, f64, f64)>,
    kept: Vec<(f64, f64, f64)>,
    updates: usize,
    fail_at: Option<usize>,
    nsigma: f64,
}

impl Default for TinyClean {
    fn default() -> Self {
        Self { components: Vec::new(), kept: Vec::new(), updates: 0, fail_at: None, nsigma: 3.0 }
    }
}

fn at(i: usize) -> f64 {
    (i as f64 - (SIDE / 2) as f64) * CELL
}

impl ModelVisibilities for TinyClean {
    fn predict(&mut self, header: &VisibilityHeader, _: usize, coverage: &UvCoverage) -> Result<Array3<Complex<f32>>> {
        let mut sum = Array3::zeros(header.shape(coverage.n_rows()));
        for (l, m, flux) in &self.components {
            sum += &PointModel { flux: *flux, l: *l, m: *m }.predict(header, 0, coverage)?;
        }
        Ok(sum)
    }
}

impl ModelMaker for TinyClean {
    fn update(&mut self, data: &mut dyn VisibilitySource, plan: &RoundPlan, _: &dyn Observer) -> Result<ModelMetrics> {
        self.updates += 1;
        if self.fail_at == Some(self.updates) {
            return Err(crate::ChainError::NoData("no image today".into()));
        }
        let wave = SPEED_OF_LIGHT_M_S / data.header().spectrum.freq_hz()[0];
        let block = data.read_rows(0..data.n_rows())?;
        let (mut dirty, mut beam) = (Array2::<f64>::zeros((SIDE, SIDE)), Array2::<f64>::zeros((2 * SIDE - 1, 2 * SIDE - 1)));
        let mut total = 0.0;
        for row in 0..block.n_rows() {
            let w = f64::from(block.usable_weight(row, 0, 0));
            let v = block.vis[(row, 0, 0)];
            let v = Complex64::new(v.re.into(), v.im.into());
            total += w;
            let step = [0, 1].map(|k| TAU * block.coverage.uvw_m[(row, k)] * CELL / wave);
            let powers = |s: f64, n: usize| (0..n).map(move |i| cis(s * (i as f64 - (n / 2) as f64))).collect::<Vec<_>>();
            for (image, n, z) in [(&mut dirty, SIDE, v), (&mut beam, 2 * SIDE - 1, Complex64::new(1.0, 0.0))] {
                let (x, y) = (powers(-step[0], n), powers(-step[1], n));
                for ((j, i), value) in image.indexed_iter_mut() {
                    *value += w * (z * x[i] * y[j]).re;
                }
            }
        }
        dirty /= total;
        beam /= total;
        self.components.clear();
        let rms = |d: &Array2<f64>| (d.iter().map(|x| x * x).sum::<f64>() / d.len() as f64).sqrt();
        let peak_of = |d: &Array2<f64>| d.indexed_iter().max_by(|a, b| a.1.total_cmp(b.1)).map(|(i, v)| (i, *v)).unwrap();
        let peak = peak_of(&dirty).1;
        for _ in 0..400 {
            let ((j, i), value) = peak_of(&dirty);
            if value < (plan.depth * peak).max(self.nsigma * rms(&dirty)) {
                break;
            }
            self.components.push((at(i), at(j), 0.2 * value));
            for ((y, x), d) in dirty.indexed_iter_mut() {
                *d -= 0.2 * value * beam[(y + SIDE - 1 - j, x + SIDE - 1 - i)];
            }
        }
        let flux = self.components.iter().map(|c| c.2).sum();
        Ok(ModelMetrics { peak, residual_rms: rms(&dirty), model_flux: flux, iterations: self.components.len() })
    }

    fn remember(&mut self) {
        self.kept = self.components.clone();
    }

    fn recall(&mut self) {
        self.components = self.kept.clone();
    }
}

const POINT: Start<'static> = Start::Point { flux: None, l: 0.0, m: 0.0 };

fn double(sigma: f64) -> Scene {
    Scene { sigma, sources: vec![(0.0, 0.0, 1.0), (3.0 * CELL, -5.0 * CELL, 0.3)], integration_s: 600.0, ..Scene::point(12, 8) }
}

fn options(mode: GainMode, rounds: usize) -> SelfcalOptions {
    SelfcalOptions::new(mode, SolutionInterval::Integration, rounds)
}

#[test]
fn phases_are_found_from_a_point_and_the_second_source_appears() {
    let phase = random_phases(96, 0.9, 3);
    let scene = double(0.02);
    let mut data = scene.set(|t, a, _, _| cis(phase[t * 12 + a]));
    let mut maker = TinyClean::default();
    let out = selfcal(&mut data, &mut maker, POINT, &options(GainMode::Phase, 4), None, &Silent).unwrap();
    let mut truth = out.best().gains.clone();
    truth.gains.indexed_iter_mut().for_each(|((t, a, _, _), g)| *g = cis(phase[t * 12 + a]));
    let error =
        |r: &RoundRecord| compare_gains(&r.gains, &truth, CompareOptions { gradient: true, flux_scale: false }).unwrap().rms_phase_rad;
    assert!(error(&out.rounds[0]) > 3.0 * error(out.best()), "{} {}", error(&out.rounds[0]), error(out.best()));
    assert!(error(out.best()) < 0.03, "{}", error(out.best()));
    assert!(out.warnings.is_empty(), "{:?}", out.warnings);
    let second: f64 = maker.components.iter().filter(|c| (c.1 + 5.0 * CELL).abs() < 1.5 * CELL).map(|c| c.2).sum();
    assert!((second - 0.3).abs() < 0.06, "{second}");
}

#[test]
fn amplitudes_follow_phases_and_keep_the_flux_scale() {
    let phase = random_phases(12, 0.9, 4);
    let gain = |a: usize| Complex64::from_polar(1.0 + 0.2 * phase[a].sin(), phase[a]);
    let mut data = double(0.01).set(|_, a, _, _| gain(a));
    let mut o = options(GainMode::AmpPhase, 6);
    o.schedule.iter_mut().for_each(|p| p.solint = SolutionInterval::Infinite);
    let mut maker = TinyClean::default();
    let out = selfcal(&mut data, &mut maker, Start::Data, &o, None, &Silent).unwrap();
    assert!(out.before.unwrap().dynamic_range() * 2.0 < out.best().metrics.dynamic_range());
    assert_eq!(out.best().plan.mode, GainMode::AmpPhase);
    let mut truth = out.best().gains.clone();
    truth.gains.indexed_iter_mut().for_each(|((_, a, _, _), g)| *g = gain(a));
    let c = compare_gains(&out.best().gains, &truth, CompareOptions { gradient: true, flux_scale: true }).unwrap();
    assert!(c.rms_amplitude < 0.02 && c.rms_phase_rad < 0.02, "{c:?}");
}

#[test]
fn noise_on_a_point_model_draws_the_warning_and_a_source_does_not() {
    let (n, times) = (10, 4);
    let sigma = (9.0 * 4.0_f64).sqrt() / 20.0;
    let (mut warned, mut false_alarms) = (0, 0);
    let mut o = options(GainMode::Phase, 2);
    o.schedule.iter_mut().for_each(|p| p.solint = SolutionInterval::Infinite);
    for seed in 0..100 {
        let source = Scene { sigma, seed, ..Scene::point(n, times) };
        let phase = random_phases(n, 3.1, seed + 50);
        for (sources, count) in [(Vec::new(), &mut warned), (source.sources.clone(), &mut false_alarms)] {
            let mut data = Scene { sources, ..source.clone() }.set(|_, a, _, _| cis(phase[a]));
            let told = Recorder::default();
            let out = selfcal(&mut data, &mut TinyClean::default(), POINT, &o, None, &told).unwrap();
            *count += usize::from(!out.warnings.is_empty());
            assert_eq!(told.messages().iter().filter(|m| m.contains("closure phases")).count(), out.warnings.len());
        }
    }
    assert!(warned >= 95 && false_alarms < 5, "{warned} warned of 100 of noise, {false_alarms} of 100 of a source");
}

#[test]
fn noise_is_told_when_the_first_model_comes_from_the_data_too() {
    let mut o = options(GainMode::Phase, 2);
    o.schedule.iter_mut().for_each(|p| p.solint = SolutionInterval::Infinite);
    let (mut warned, mut false_alarms) = (0, 0);
    for seed in 0..40 {
        let noise = Scene { sigma: 1.0, seed, sources: Vec::new(), ..Scene::point(10, 6) };
        // With a low threshold the model contains noise peaks.
        let nsigma = if seed % 2 == 0 { 1.5 } else { 30.0 };
        let run = |scene: &Scene| {
            let phase = random_phases(10, 0.5, seed);
            let mut data = scene.set(|_, a, _, _| cis(phase[a]));
            !selfcal(&mut data, &mut TinyClean { nsigma, ..TinyClean::default() }, Start::Data, &o, None, &Silent)
                .unwrap()
                .warnings
                .is_empty()
        };
        warned += usize::from(run(&noise));
        false_alarms += usize::from(run(&Scene { sources: vec![(0.0, 0.0, 3.0)], ..noise }));
    }
    assert!(warned >= 38 && false_alarms < 2, "{warned} warned of 40 of noise, {false_alarms} of 40 of a source");
}

#[test]
fn the_best_round_is_kept_and_the_reason_to_stop_is_told() {
    let phase = random_phases(12, 0.5, 6);
    let mut data = double(0.02).set(|_, a, _, _| cis(phase[a]));
    let out = selfcal(&mut data, &mut TinyClean::default(), POINT, &options(GainMode::Phase, 30), None, &Silent).unwrap();
    assert!(out.rounds.len() < 30);
    assert_eq!(out.stop, SelfcalStop::NoImprovement);
    assert!(out.rounds.iter().all(|r| r.metrics.dynamic_range() <= out.best().metrics.dynamic_range()));
    let mut maker = TinyClean { fail_at: Some(2), ..TinyClean::default() };
    let out = selfcal(&mut data, &mut maker, POINT, &options(GainMode::Phase, 3), None, &Silent).unwrap();
    assert_eq!((out.rounds.len(), out.best), (1, 0));
    assert!(out.stop.to_string().contains("no image today"));
    let mut maker = TinyClean { fail_at: Some(1), ..TinyClean::default() };
    assert!(selfcal(&mut data, &mut maker, POINT, &options(GainMode::Phase, 3), None, &Silent).is_err());
    let empty = SelfcalOptions { schedule: Vec::new(), ..options(GainMode::Phase, 1) };
    assert!(selfcal(&mut data, &mut maker, POINT, &empty, None, &Silent).is_err());
}

#[test]
fn schedules_start_with_phases_and_shrink_the_interval() {
    let s = schedule(GainMode::AmpPhase, SolutionInterval::Seconds(30.0), 6, true);
    let modes: Vec<GainMode> = s.iter().map(|p| p.mode).collect();
    assert_eq!(modes, [GainMode::Phase, GainMode::Phase, GainMode::Phase, GainMode::Phase, GainMode::AmpPhase, GainMode::AmpPhase]);
    assert_eq!(s[0].solint, SolutionInterval::Seconds(120.0));
    assert_eq!(s[3].solint, SolutionInterval::Seconds(30.0));
    assert_eq!(schedule(GainMode::Phase, SolutionInterval::Seconds(30.0), 6, false)[0].solint, SolutionInterval::Seconds(30.0));
    assert!(
        s[..5].windows(2).all(|w| w[1].depth < w[0].depth)
            && s[4].last
            && s[5].last
            && !s[3].last
            && s[4].depth == 0.0
            && s[5].depth == 0.0
    );
}
