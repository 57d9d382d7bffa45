//! Compares a study with the law of dynamic range, and tests that the number of threads does not change it.

use super::*;
use crate::Result;
use crate::calibrate::{RoundOptions, SolveOptions, StartFrom};
use crate::closure::SolutionInterval;
use crate::corrupt::{Error, PhaseError, Variation};
use crate::deconvolve::by_name;
use crate::fixtures::{Recorder, as_processes};
use crate::imaging::major::CleanOptions;
use crate::imaging::{ImageSize, ImagingOptions, Weighting};
use crate::progress::Silent;
use crate::random::stream;
use crate::simulate::{Method, SimulateOptions, SkyModel, simulate_set};
use cittert_arrays::quantity::Angle;
use cittert_arrays::{
    Antenna, ArrayLayout, CoveragePlan, LayoutFrame, PhaseCenter, Polarization, Source, SpectralWindow, VisUnit, VisibilityHeader,
};
use rand::RngExt;
use std::collections::BTreeSet;
use std::sync::{Arc, Mutex};

/// A point of 1 Jy, observed once by random antennas in a square of 100 wavelengths.
pub(super) fn base(n_ant: u32, size: usize) -> Arc<Base> {
    let mut rng = stream(4, "layout of the test", 0);
    let antennas = (0..n_ant).map(|k| Antenna::new(format!("A{k}"), k, [rng.random::<f64>(), rng.random::<f64>(), 0.0])).collect();
    let layout = ArrayLayout::new("strewn", LayoutFrame::Boresight, antennas).unwrap();
    let coverage = CoveragePlan::snapshot(&layout, 2_460_000.5, 10.0).unwrap().coverage().unwrap();
    let header = VisibilityHeader {
        telescope: "t".into(),
        instrument: "t".into(),
        layout,
        spectrum: SpectralWindow::band(100.0 * cittert_arrays::SPEED_OF_LIGHT_M_S, 1e6, 1).unwrap(),
        polarizations: vec![Polarization::I],
        phase_centers: vec![PhaseCenter::unprojected("b")],
        unit: VisUnit::Jy,
        pedestal_k: None,
        scene_pedestal_k: None,
        scene_width_rad: None,
        antenna_temperature_k: None,
        near_field: Default::default(),
        annotations: Default::default(),
        history: Vec::new(),
    };
    let sky = SkyModel::of_sources(vec![Source::point(0.0, 0.0, 1.0)]);
    let options = SimulateOptions { method: Method::Dft, ..SimulateOptions::default() };
    let set = simulate_set(header, &coverage, &sky, &options, &Silent).unwrap();
    let imaging = ImagingOptions {
        size: Some(ImageSize::square(size)),
        cell: Some(Angle(3e-3)),
        weighting: Weighting::Natural,
        no_w: true,
        ..ImagingOptions::default()
    };
    // One component takes the whole peak, so CLEAN does not remove the errors.
    let clean = CleanOptions { algorithm: by_name("hogbom").unwrap().into(), gain: 1.0, niter: 1, ..CleanOptions::default() };
    Arc::new(Base::new(set, imaging, Deconvolution::Clean(Box::new(clean))))
}

pub(super) fn phase(rms_rad: f64) -> Error {
    Error::Phase(PhaseError { rms_rad, variation: Variation::Constant })
}

fn plan() -> SelfcalPlan {
    SelfcalPlan {
        solve: SolveOptions { solint: SolutionInterval::Infinite, refant: Some("A3".parse().unwrap()), ..SolveOptions::default() },
        rounds: RoundOptions { rounds: 1, start: StartFrom::Point, ..RoundOptions::default() },
    }
}

#[test]
fn the_dynamic_range_of_a_point_follows_n_over_root_two_phi() {
    // Dynamic range: the peak of the restored image divided by its rms off the source. The variance is averaged over the trials. Perley
    // 1999, ASP Conf. 180, 275: N / (sqrt(2) phi). One trial scatters by a fifth, so the mean of 200 has an error of 1.5 percent.
    let (n, phi) = (20, 0.05);
    let setup = Setup { base: base(n, 64), antennas: Antennas::All, errors: vec![phase(phi)], selfcal: None, silent: None };
    let study = Study { grid: Grid::default(), setups: vec![setup], seeds: (0..200).collect() };
    let mut found = Vec::new();
    run(
        &study,
        &BTreeSet::new(),
        2,
        &mut |_, r| {
            found.push(r.before);
            Ok(())
        },
        &Silent,
    )
    .unwrap();
    let mean = summarize(found.iter().map(|q| q.off_source_dynamic_range.powi(-2))).mean.powf(-0.5);
    let law = f64::from(n) / (2.0_f64.sqrt() * phi);
    assert!((mean / law - 1.0).abs() < 0.1, "{mean} against {law}");
    // The phases themselves: rms 0.05 with one common phase removed.
    let phases = summarize(found.iter().map(|q| q.phase_rms_rad)).mean;
    assert!((phases / phi - 1.0).abs() < 0.05, "{phases}");
}

fn small_study() -> Study {
    let axis = Axis::new("phase", &["0.1rad".into(), "0.6rad".into()]).unwrap();
    let base = base(12, 48);
    let setup = |rms| Setup { base: base.clone(), antennas: Antennas::All, errors: vec![phase(rms)], selfcal: Some(plan()), silent: None };
    let random = |rms| Setup { antennas: Antennas::Random(9), ..setup(rms) };
    Study { grid: Grid::new(vec![axis]).unwrap(), setups: vec![setup(0.1), random(0.6)], seeds: vec![5, 6, 7] }
}

fn results(study: &Study, done: &BTreeSet<usize>, threads: usize) -> Vec<(usize, TrialResult)> {
    let mut all = Vec::new();
    run(
        study,
        done,
        threads,
        &mut |k, r| {
            all.push((k, r));
            Ok(())
        },
        &Silent,
    )
    .unwrap();
    all.sort_by_key(|r| r.0);
    all
}

#[test]
fn the_bytes_do_not_depend_on_threads_or_on_what_was_done_before() {
    let one = results(&small_study(), &BTreeSet::new(), 1);
    let two = results(&small_study(), &BTreeSet::new(), 2);
    let rest = results(&small_study(), &BTreeSet::from([0, 2, 3]), 2);
    assert_eq!(one.iter().map(|r| r.0).collect::<Vec<_>>(), [0, 1, 2, 3, 4, 5]);
    let bits = |r: &TrialResult| r.before.values().into_iter().chain(r.after.unwrap().values()).map(f64::to_bits).collect::<Vec<_>>();
    for (a, b) in one.iter().zip(&two) {
        assert_eq!(bits(&a.1), bits(&b.1));
    }
    assert_eq!(rest.iter().map(|r| r.0).collect::<Vec<_>>(), [1, 4, 5]);
    assert_eq!(bits(&rest[1].1), bits(&one[4].1));
}

/// The results of a study in processes. Those of process 0, which has them all, and what each process returns.
fn in_several(study: &Study, size: usize, threads: usize, observer: &Recorder) -> (Vec<Found>, Vec<Result<()>>) {
    let (all, todo) = (Mutex::new(Vec::new()), (0..study.n_trials()).collect::<Vec<_>>());
    let returned = as_processes(size, |ranks| {
        let todo = if ranks.rank() == 0 { &todo[..] } else { &[] };
        let job = |k: usize| (&study.setups[study.place(k).0], study.place(k).1);
        let place = |k: usize| study.grid.place(study.place(k).0);
        let batch = Batch { todo, job: &job, place: &place, ranks: &*ranks };
        let mut keep = |found: Vec<Found>| {
            assert_eq!(ranks.rank(), 0);
            all.lock().unwrap().extend(found);
            Ok(())
        };
        let done = run_batch(&batch, threads, &mut keep, observer);
        if done.is_err() && ranks.rank() == 0 {
            // The program ends all processes.
            observer.cancel();
        }
        done
    });
    let mut all = all.into_inner().unwrap();
    all.sort_by_key(|r| r.0);
    (all, returned)
}

#[test]
fn processes_run_each_trial_once_and_with_the_bytes_of_one_process() {
    let one = results(&small_study(), &BTreeSet::new(), 1);
    for (size, threads) in [(2, 1), (3, 2), (8, 1)] {
        let (several, returned) = in_several(&small_study(), size, threads, &Recorder::default());
        assert!(returned.iter().all(Result::is_ok), "{returned:?}");
        assert_eq!(format!("{several:?}"), format!("{one:?}"), "{size} processes");
    }
}

#[test]
fn a_process_that_has_finished_a_batch_early_waits_for_the_next() {
    let study = Study { seeds: vec![5], ..small_study() };
    let counts = Mutex::new(vec![0; 20]);
    let returned = as_processes(4, |ranks| {
        let todo: &[usize] = if ranks.rank() == 0 { &[0, 1, 2, 3] } else { &[] };
        let job = |k: usize| {
            // The process that runs the first trial is late: the others want trials of the next batch long before.
            std::thread::sleep(std::time::Duration::from_millis(if k == 0 { 30 } else { 0 }));
            (&study.setups[k % 2], 5)
        };
        let place = |_| String::new();
        let batch = Batch { todo, job: &job, place: &place, ranks: &*ranks };
        (0..20).try_for_each(|n| {
            let mut keep = |found: Vec<Found>| {
                counts.lock().unwrap()[n] += found.len();
                Ok(())
            };
            run_batch(&batch, 1, &mut keep, &Silent)
        })
    });
    assert!(returned.iter().all(Result::is_ok), "{returned:?}");
    assert_eq!(*counts.lock().unwrap(), [4; 20]);
}

#[test]
fn a_trial_that_fails_in_any_process_fails_with_the_same_words() {
    let mut study = small_study();
    study.setups[1].antennas = Antennas::Random(13);
    for size in [2, 4] {
        let (several, returned) = in_several(&study, size, 1, &Recorder::default());
        let e = returned[0].as_ref().unwrap_err().to_string();
        assert!(e.starts_with("the trial at phase = 0.6rad, seed") && e.contains("2 to the 12"), "{e}");
        assert!(several.iter().all(|(k, _)| *k < 3));
    }
}

#[test]
fn self_calibration_brings_a_noiseless_point_back() {
    for (_, r) in results(&small_study(), &BTreeSet::new(), 2) {
        let after = r.after.unwrap();
        assert!(after.phase_rms_rad < 1e-6, "{after:?}");
        assert!(after.nrmse < 1e-3 * r.before.nrmse.max(1.0), "{:?} {after:?}", r.before);
        assert!(after.dynamic_range > 5.0 * r.before.dynamic_range, "{:?} {after:?}", r.before);
        assert!(after.fidelity > r.before.fidelity);
    }
}

#[test]
fn wrong_antennas_and_errors_name_the_trial() {
    let mut study = small_study();
    study.setups[1].antennas = Antennas::Random(13);
    let e = run(&study, &BTreeSet::new(), 1, &mut |_, _| Ok(()), &Silent).unwrap_err().to_string();
    assert!(e.contains("phase = 0.6rad, seed 5") && e.contains("2 to the 12"), "{e}");
    study.setups[0].errors = vec![phase(f64::NAN)];
    let e = run(&study, &BTreeSet::new(), 1, &mut |_, _| Ok(()), &Silent).unwrap_err().to_string();
    assert!(e.contains("phase = 0.1rad") && e.contains("NaN"), "{e}");
}

#[test]
fn a_subset_is_what_its_antennas_alone_would_see() {
    let all = base(12, 48);
    let first = all.with(Antennas::First(5), 1).unwrap();
    assert_eq!((first.set.header.layout.n_ant(), first.set.data.n_rows()), (5, 10));
    let (a, b) = (all.with(Antennas::Random(5), 1).unwrap(), all.with(Antennas::Random(5), 2).unwrap());
    let names = |b: &Base| b.set.header.layout.antennas().iter().map(|a| a.name.clone()).collect::<Vec<_>>();
    assert_ne!(names(&a), names(&b));
    for r in 0..10 {
        let place = |k: u32| a.set.header.layout.antennas()[k as usize].position_m;
        let c = &a.set.data.coverage;
        assert!((place(c.ant2[r])[0] - place(c.ant1[r])[0] - c.uvw_m[(r, 0)]).abs() < 1e-12);
    }
}
