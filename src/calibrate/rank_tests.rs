//! Several processes that share a set find the gains, the images and the judgement of one process.

use super::*;
use crate::closure::testdata::{Scene, cis, random_phases};
use crate::deconvolve::{CleanOptions, by_name};
use crate::fixtures::in_processes;
use crate::imaging::{ImageSize, ImagingOptions, Weighting};
use crate::progress::Silent;
use cittert_arrays::quantity::Angle;
use cittert_arrays::{GainTable, PartsSink, Sensitivity, VisUnit, VisibilityBlock, VisibilitySet, VisibilitySink, VisibilitySource};
use std::sync::{Arc, Mutex};

const CELL: f64 = 4e-5;
const ANTENNAS: usize = 14;

/// Six integrations of 91 baselines: the parts of two, three and four processes end within integrations.
fn set() -> VisibilitySet {
    let scene = Scene {
        n_chan: 2,
        sources: vec![(4.0 * CELL, -6.0 * CELL, 1.0), (-9.0 * CELL, 3.0 * CELL, 0.5)],
        sigma: 0.05,
        seed: 3,
        integration_s: 300.0,
        ..Scene::point(ANTENNAS, 6)
    };
    let phase = random_phases(ANTENNAS, 1.0, 2);
    let mut set = scene.set(|_, a, _, _| cis(phase[a]) * (1.0 + 0.02 * a as f64));
    set.data.flags[(0, 0, 0)] = true;
    set.data.weights[(100, 1, 0)] = 0.0;
    set
}

fn options(mode: GainMode, solint: SolutionInterval) -> CandidateOptions {
    let imaging = ImagingOptions {
        size: Some(ImageSize::square(64)),
        cell: Some(Angle(CELL)),
        weighting: Weighting::Natural,
        ..ImagingOptions::default()
    };
    let clean = CleanOptions { algorithm: by_name("hogbom").unwrap().into(), niter: 500, ..CleanOptions::default() };
    let solve = SolveOptions { mode, solint, ..SolveOptions::default() };
    CandidateOptions::new(imaging, clean, solve, RoundOptions { rounds: 4, ..RoundOptions::default() }, VisUnit::Jy)
}

fn apart(a: &GainTable, b: &GainTable) -> f64 {
    assert_eq!((a.gains.dim(), &a.flags, a.refant), (b.gains.dim(), &b.flags, b.refant));
    assert_eq!((&a.time_jd, &a.interval_s), (&b.time_jd, &b.interval_s));
    a.gains.iter().zip(&b.gains).fold(0.0, |d, (a, b)| d.max((a - b).norm()))
}

#[test]
fn gains_images_and_judgement_do_not_depend_on_the_number_of_processes() {
    for (mode, solint) in [
        (GainMode::Phase, SolutionInterval::Infinite),
        (GainMode::AmpPhase, SolutionInterval::Seconds(600.0)),
        (GainMode::Phase, SolutionInterval::Integration),
    ] {
        let run = |source: &mut dyn VisibilitySource| {
            let ways = candidates(&options(mode, solint)).unwrap();
            let (out, maker) = calibrate(source, &ways, Beginning::Data, &JudgeOptions::default(), &Silent).unwrap();
            (out.gains, out.evidence.unwrap(), out.verdict, out.rounds, maker.products().unwrap().clone())
        };
        let one = in_processes(1, &set(), run).remove(0);
        assert_eq!(one.2, Verdict::Accepted);
        for size in [2, 3, 4] {
            let all = in_processes(size, &set(), run);
            for other in &all {
                assert_eq!(other.0, all[0].0, "{size} processes: the same bits in all");
                assert!(apart(&one.0, &other.0) < 1e-6, "{mode:?} {solint:?} {size}: {:e}", apart(&one.0, &other.0));
                assert_eq!((&other.2, other.3.best, other.3.rounds.len()), (&one.2, one.3.best, one.3.rounds.len()));
                for (a, b) in [(one.1.before, other.1.before), (one.1.after, other.1.after), (one.1.gain_rms, other.1.gain_rms)] {
                    assert!((a - b).abs() < 1e-6, "{a} {b}");
                }
                assert_eq!(one.1.baselines, other.1.baselines);
                let top = one.4.restored.data.iter().fold(0.0_f64, |t, v| t.max(v.abs()));
                let difference = one.4.restored.data.iter().zip(&other.4.restored.data).fold(0.0_f64, |d, (a, b)| d.max((a - b).abs()));
                assert!(difference < 1e-6 * top, "{mode:?} {solint:?} {size}: {:e}", difference / top);
            }
        }
    }
}

/// Sums of one interval over rows of several processes: also the halves of the samples, the outliers and the counts.
#[test]
fn normal_equations_are_those_of_all_rows() {
    let solve = SolveOptions { solint: SolutionInterval::Infinite, outliers: Outliers::Huber, ..SolveOptions::default() };
    let run = |source: &mut dyn VisibilitySource| {
        let sums = NormalEquations::of(source, &mut PointModel { flux: 1.0, l: 0.0, m: 0.0 }, &solve, &Silent).unwrap();
        (sums.counts, sums.closure_support(), sums.solve(&Silent).unwrap().gains)
    };
    let one = in_processes(1, &set(), run).remove(0);
    for size in [2, 5] {
        for other in in_processes(size, &set(), run) {
            assert_eq!((one.0, one.1.triangles), (other.0, other.1.triangles));
            let (a, b) = (one.1.halves_sigmas.unwrap(), other.1.halves_sigmas.unwrap());
            assert!((a / b - 1.0).abs() < 1e-9 && (one.1.model_sigmas / other.1.model_sigmas - 1.0).abs() < 1e-9, "{a} {b}");
            assert!(apart(&one.2, &other.2) < 1e-9);
        }
    }
}

#[test]
fn all_processes_end_where_one_has_a_wrong_row_or_none_has_data() {
    let mut wrong = set();
    let last = wrong.data.n_rows() - 1;
    wrong.data.coverage.time_jd[last] = f64::NAN;
    let solve = SolveOptions { solint: SolutionInterval::Integration, ..SolveOptions::default() };
    let run = |source: &mut dyn VisibilitySource| {
        NormalEquations::of(source, &mut PointModel { flux: 1.0, l: 0.0, m: 0.0 }, &solve, &Silent).map(drop)
    };
    for error in in_processes(3, &wrong, run) {
        assert!(error.unwrap_err().to_string().contains("a row has the time NaN"));
    }
    let mut empty = set();
    empty.data.flags.fill(true);
    let ways = |source: &mut dyn VisibilitySource| {
        let ways = candidates(&options(GainMode::Phase, SolutionInterval::Infinite)).unwrap();
        calibrate(source, &ways, Beginning::Data, &JudgeOptions::default(), &Silent).map(drop)
    };
    for error in in_processes(2, &empty, ways) {
        assert!(error.is_err());
    }
}

#[test]
fn autocorrelations_of_all_processes_tell_the_amplitudes() {
    let mut set = set();
    set.header.layout = set.header.layout.with_receivers(&[Sensitivity::SefdJy(3.0); ANTENNAS]);
    let mut powers = set.data.rows(0..ANTENNAS * 5).unwrap();
    for row in 0..powers.n_rows() {
        let antenna = (row % ANTENNAS) as u32;
        (powers.coverage.ant1[row], powers.coverage.ant2[row]) = (antenna, antenna);
        powers.coverage.time_jd[row] += 0.001 * (row / ANTENNAS) as f64;
    }
    powers.vis.indexed_iter_mut().for_each(|((r, _, _), v)| *v = (10.0 + (r % 7) as f32).into());
    set.data.append(&powers).unwrap();
    let solve = SolveOptions { solint: SolutionInterval::Seconds(600.0), ..SolveOptions::default() };
    let run = |source: &mut dyn VisibilitySource| amplitudes_from_power(source, &solve).unwrap().unwrap().gains;
    let one = in_processes(1, &set, run).remove(0);
    for size in [2, 4] {
        for other in in_processes(size, &set, run) {
            assert!(apart(&one, &other) < 1e-12, "{size}");
        }
    }
}

/// Rows that are written, in the order in which they came.
struct Written(Arc<Mutex<VisibilitySet>>);

impl VisibilitySink for Written {
    fn write_block(&mut self, block: &VisibilityBlock) -> cittert_arrays::Result<()> {
        self.0.lock().unwrap().write_block(block)
    }

    fn finish(self: Box<Self>) -> cittert_arrays::Result<()> {
        Ok(())
    }
}

#[test]
fn calibrated_rows_of_all_processes_are_written_in_the_order_of_the_set() {
    let set = set();
    let solve = SolveOptions { solint: SolutionInterval::Infinite, ..SolveOptions::default() };
    let gains = super::solve(&mut set.clone(), &mut PointModel { flux: 1.0, l: 0.0, m: 0.0 }, &solve, &Silent).unwrap().gains;
    let run = |source: &mut dyn VisibilitySource| {
        let empty = VisibilitySet { data: set.data.rows(0..0).unwrap(), ..set.clone() };
        let written = Arc::new(Mutex::new(empty));
        let ranks = source.ranks();
        let own = (ranks.rank() == 0).then(|| Box::new(Written(written.clone())) as Box<dyn VisibilitySink>);
        let mut sink = Box::new(PartsSink::new(ranks, own));
        apply(source, &gains, ApplyOptions::default(), sink.as_mut(), &Silent).unwrap();
        sink.finish().unwrap();
        written.lock().unwrap().clone()
    };
    let one = in_processes(1, &set, run).remove(0);
    assert_eq!(one.data.n_rows(), set.data.n_rows());
    for size in [2, 5] {
        assert!(in_processes(size, &set, run).remove(0) == one, "{size} processes");
    }
}
