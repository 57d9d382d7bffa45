//! Self-calibration with CLEAN: the error of the antenna phases, rad.

use crate::scenes::{CELL, Case, SIDE, cases};
use crate::table::{Group, Knob, measure};
use cittert::arrays::quantity::Angle;
use cittert::calibrate::{
    CleanMaker, CompareOptions, FeedGroups, GainMode, SelfcalOptions, SelfcalTuning, SolutionInterval, Start, compare_gains, selfcal,
    tuned_schedule,
};
use cittert::deconvolve::by_name;
use cittert::imaging::major::CleanOptions;
use cittert::imaging::{ImageSize, ImagingOptions, Weighting};
use cittert::progress::Silent;

/// Rounds of each self-calibration.
const ROUNDS: usize = 6;

fn error(case: &Case, tuning: &SelfcalTuning) -> f64 {
    let (mut set, truth) = case.observed(1, 0.7);
    let imaging = ImagingOptions {
        size: Some(ImageSize::square(SIDE)),
        cell: Some(Angle(CELL)),
        weighting: Weighting::Natural,
        ..ImagingOptions::default()
    };
    let clean = CleanOptions { algorithm: by_name("multiscale").unwrap().into(), niter: 2000, scale_bias: 0.3, ..CleanOptions::default() };
    let mut maker = CleanMaker::new(imaging, clean).tuned(*tuning);
    let (mode, solint) = (GainMode::Phase, SolutionInterval::Infinite);
    let mut options = SelfcalOptions {
        schedule: tuned_schedule(mode, solint, ROUNDS, false, tuning),
        tuning: *tuning,
        ..SelfcalOptions::new(mode, solint, ROUNDS)
    };
    options.solve.feeds = FeedGroups::Joined;
    let found = selfcal(&mut set, &mut maker, Start::Data, &options, None, &Silent).unwrap();
    let free = CompareOptions { gradient: true, flux_scale: false };
    compare_gains(&found.best().gains, &truth, free).unwrap().rms_phase_rad
}

pub fn group() -> Group {
    let d = SelfcalTuning::default();
    let knobs: Vec<Knob<SelfcalTuning>> = vec![
        Knob { name: "SelfcalTuning::first_depth", default: d.first_depth.to_string(), set: |t, x| t.first_depth *= x },
        Knob { name: "SelfcalTuning::deeper", default: d.deeper.to_string(), set: |t, x| t.deeper *= x },
        Knob { name: "SelfcalTuning::short_epsilon", default: d.short_epsilon.to_string(), set: |t, x| t.short_epsilon *= x },
        Knob { name: "SelfcalTuning::short_nsigma", default: d.short_nsigma.to_string(), set: |t, x| t.short_nsigma *= x },
        Knob { name: "SelfcalTuning::predicted_epsilon", default: d.predicted_epsilon.to_string(), set: |t, x| t.predicted_epsilon *= x },
    ];
    measure("self-calibration, rad", &cases(), &knobs, error)
}
