//! The whole joint solution of a small extended scene with unknown phases.

use super::*;
use crate::fixtures::{Noise, Recorder, in_processes, positions, repeated, snapshot};
use crate::imaging::{ImageSize, ImagingOptions, Weighting};
use crate::mem::Prior;
use crate::progress::Silent;
use cittert_arrays::quantity::Angle;
use cittert_arrays::{Polarization, SkyGrid, VisUnit, VisibilitySet, VisibilitySource};
use ndarray::{Array2, s};
use num_complex::Complex32;

const SIDE: usize = 40;
const CELL: f64 = 4e-3;

/// A disc with a hole and a bright spot, off the middle of the frame; flux a pixel.
fn scene() -> Array2<f64> {
    Array2::from_shape_fn((SIDE, SIDE), |(i, j)| {
        let (x, y) = (j as f64 - 21.5, i as f64 - 18.5);
        let disc = if x.hypot(y) < 10.0 { 1.0 } else { 0.0 };
        let hole = if (x + 3.0).hypot(y - 2.0) < 3.0 { 0.2 } else { 1.0 };
        disc * hole + if (x - 4.0).hypot(y + 4.0) < 2.0 { 1.5 } else { 0.0 }
    })
}

/// Forty antennas, four channels over a tenth of the frequency, two hands; the phases of the antennas are `phases` \[ant\].
fn observed(phases: &[f64], sigma: f64) -> VisibilitySet {
    let grid = SkyGrid::new(SIDE, SIDE, CELL, cittert_arrays::SkyFrame::Boresight).unwrap();
    let scene = scene();
    let lit = scene.indexed_iter().filter(|(_, v)| **v > 0.0);
    let sources: Vec<(f64, f64, f64)> = lit.map(|((i, j), v)| (grid.l_at(j as f64), grid.m_at(i as f64), *v)).collect();
    let freq: Vec<f64> = (0..4).map(|c| 90e9 + 3e9 * f64::from(c)).collect();
    let places = positions(phases.len(), 0.17, 0.0, 3);
    let mut set = snapshot(&places, &freq, &[Polarization::XX, Polarization::YY], &sources, (sigma, VisUnit::Jy));
    for row in 0..set.data.n_rows() {
        let (p, q) = (set.data.coverage.ant1[row] as usize, set.data.coverage.ant2[row] as usize);
        let g = Complex32::from_polar(1.0, (phases[p] - phases[q]) as f32);
        set.data.vis.slice_mut(s![row, .., ..]).mapv_inplace(|v| v * g);
    }
    set
}

fn imaging() -> ImagingOptions {
    ImagingOptions {
        size: Some(ImageSize::square(SIDE)),
        cell: Some(Angle(CELL)),
        weighting: Weighting::Natural,
        ..ImagingOptions::default()
    }
}

fn options() -> JointOptions {
    let solve = SolveOptions { feeds: FeedGroups::Joined, solint: SolutionInterval::Infinite, ..SolveOptions::default() };
    JointOptions { solve, prior: Prior::Auto, mask: None, goals: JointGoals::default() }
}

fn maker() -> JointMaker {
    JointMaker::new(imaging(), options())
}

/// Normalised error of an image laid over the scene.
fn nrmse(image: &Array2<f64>) -> f64 {
    let truth = scene();
    let by = crate::fidelity::find_shift(image.view(), truth.view()).unwrap();
    let over = crate::fidelity::shifted(image.view(), by);
    ((over - &truth).mapv(|v| v * v).sum() / truth.mapv(|v| v * v).sum()).sqrt()
}

fn calibrated(set: &mut VisibilitySet, maker: &mut JointMaker) -> Selfcal {
    let mut options = SelfcalOptions::new(GainMode::Phase, SolutionInterval::Infinite, 1);
    options.solve.feeds = FeedGroups::Joined;
    selfcal(set, maker, Start::Data, &options, None, &Silent).unwrap()
}

fn model(maker: &JointMaker) -> Array2<f64> {
    maker.products().unwrap().model.plane(0, 0).to_owned()
}

#[test]
fn a_scene_comes_back_through_phases_of_which_nothing_is_known() {
    let mut quiet = maker();
    calibrated(&mut observed(&[0.0; 40], 0.3), &mut quiet);
    let floor = nrmse(&model(&quiet));
    assert!(floor < 0.25, "{floor}");
    for seed in [1, 2, 3] {
        let phases = crate::closure::testdata::random_phases(40, std::f64::consts::PI, seed);
        let mut set = observed(&phases, 0.3);
        let mut m = maker();
        let result = calibrated(&mut set, &mut m);
        let error = nrmse(&model(&m));
        assert!(error < 1.3 * floor, "seed {seed}: {error}, without errors {floor}");
        let joint = m.solution().unwrap();
        assert!(joint.state.evaluations < 200, "{}", joint.state.evaluations);
        assert!((joint.state.chi2_per_datum - 1.0).abs() < 0.1, "{}", joint.state.chi2_per_datum);
        // The gains of the loop are those of the image, so the residual is noise.
        let chi2 = result.best().report.reduced_chi2();
        assert!((chi2 - 1.0).abs() < 0.1, "{chi2}");
    }
}

#[test]
fn noise_of_unknown_size_is_found_through_unknown_phases() {
    let phases = crate::closure::testdata::random_phases(40, std::f64::consts::PI, 4);
    let mut set = observed(&phases, 0.3);
    set.data.weights.fill(1.0);
    set.data.nsamples.fill(1.0);
    let mut m = maker();
    calibrated(&mut set, &mut m);
    let factor = m.solution().unwrap().noise_factor.unwrap();
    assert!((factor / 0.09 - 1.0).abs() < 0.1, "{factor}");
    assert!(nrmse(&model(&m)) < 0.35, "{}", nrmse(&model(&m)));
}

#[test]
fn a_set_that_does_not_fit_into_memory_is_averaged_and_gives_as_good_an_image() {
    let phases = crate::closure::testdata::random_phases(40, std::f64::consts::PI, 2);
    // Every integration has noise of its own.
    let set = || {
        let mut set = repeated(observed(&phases, 1e-6), 16, 0.0);
        let (sigma, mut noise) = (0.9, Noise(5));
        let mut draw = || (sigma * 3.0_f64.sqrt() * noise.next()) as f32;
        set.data.vis.mapv_inplace(|v| v + Complex32::new(draw(), draw()));
        set.data.weights.fill(1.0 / (sigma * sigma) as f32);
        set
    };
    let image = |memory: &str| {
        let mut m = JointMaker::new(ImagingOptions { memory: memory.parse().unwrap(), ..imaging() }, options());
        let told = Recorder::default();
        let plan = schedule(GainMode::Phase, SolutionInterval::Infinite, 1, false)[0];
        m.update(&mut set(), &plan, &told).unwrap();
        (told.messages().concat().contains("averaged over time"), model(&m))
    };
    let ((all, whole), (few, averaged)) = (image("4GB"), image("16MiB"));
    assert!(!all && few);
    // Chi squared of the averages lacks the scatter within them. Its target has the same relative tolerance, so they are fitted more closely.
    let (whole, averaged) = (nrmse(&whole), nrmse(&averaged));
    assert!(averaged < 1.05 * whole && averaged < 0.25, "{averaged}, of the whole set {whole}");
}

/// Phases near 1 and phases of which nothing is known, with gains of the whole set and of each integration, whose rows are in several processes or in one.
#[test]
fn image_and_gains_do_not_depend_on_the_number_of_processes() {
    for (size, solint) in
        [(0.1, SolutionInterval::Infinite), (std::f64::consts::PI, SolutionInterval::Infinite), (0.1, SolutionInterval::Integration)]
    {
        let phases = crate::closure::testdata::random_phases(40, size, 2);
        let set = repeated(observed(&phases, 0.5), 3, 0.0);
        let run = |source: &mut dyn VisibilitySource| {
            // In single precision every process rounds the sums of its own rows.
            let imaging = ImagingOptions { epsilon: 9e-6, ..imaging() };
            let options = options();
            let solve = SolveOptions { solint, ..options.solve.clone() };
            let mut m = JointMaker::new(imaging, JointOptions { solve, ..options });
            let mut options = SelfcalOptions::new(GainMode::Phase, solint, 1);
            options.solve.feeds = FeedGroups::Joined;
            let result = selfcal(source, &mut m, Start::Data, &options, None, &Silent).unwrap();
            let joint = m.solution().unwrap().clone();
            (model(&m), result.best().gains.clone(), joint)
        };
        let one = in_processes(1, &set, run).remove(0);
        let top = one.0.iter().fold(0.0_f64, |t, v| t.max(*v));
        for processes in [2, 4] {
            for other in in_processes(processes, &set, run) {
                let worst = one.0.iter().zip(&other.0).fold(0.0_f64, |d, (a, b)| d.max((a - b).abs())) / top;
                let gains = one.1.gains.iter().zip(&other.1.gains).fold(0.0, |d, (a, b)| (a - b).norm().max(d));
                let of = |j: &Joint| j.stages.iter().map(|s| (s.evaluations, s.moved)).collect::<Vec<_>>();
                assert_eq!(of(&one.2), of(&other.2), "{processes} processes: the same steps");
                assert!(worst < 1e-6 && gains < 1e-6, "{size} {solint:?}, {processes} processes: image {worst:e}, gains {gains:e}");
            }
        }
    }
}

#[test]
fn several_channels_of_images_are_refused() {
    let mut m = JointMaker::new(
        ImagingOptions { channels_out: 2, ..imaging() },
        JointOptions {
            solve: SolveOptions { solint: SolutionInterval::Infinite, ..SolveOptions::default() },
            prior: Prior::Auto,
            mask: None,
            goals: JointGoals::default(),
        },
    );
    let plan = schedule(GainMode::Phase, SolutionInterval::Infinite, 1, false)[0];
    let error = m.update(&mut observed(&[0.0; 40], 0.3), &plan, &Silent).unwrap_err();
    assert!(error.to_string().contains("channels-out"), "{error}");
}
