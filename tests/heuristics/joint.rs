//! The joint solution of image and gains: the error of the image relative to the scene, after a shift onto it.

use crate::scenes::{CELL, Case, SIDE, cases, error_of};
use crate::table::{Group, Knob, measure};
use cittert::arrays::quantity::Angle;
use cittert::calibrate::{
    FeedGroups, GainMode, ImageMaker, JointGoals, JointMaker, JointOptions, JointSchedule, ModelMaker, SolutionInterval, SolveOptions,
    schedule,
};
use cittert::fidelity::{find_shift, shifted};
use cittert::imaging::{ImageSize, ImagingOptions, Weighting};
use cittert::mem::Prior;
use cittert::progress::Silent;

fn error(case: &Case, tuning: &JointSchedule) -> f64 {
    let (mut set, _) = case.observed(3, std::f64::consts::PI);
    let imaging = ImagingOptions {
        size: Some(ImageSize::square(SIDE)),
        cell: Some(Angle(CELL)),
        weighting: Weighting::Natural,
        ..ImagingOptions::default()
    };
    let goals = JointGoals { tuning: *tuning, ..JointGoals::default() };
    let solve = SolveOptions { feeds: FeedGroups::Joined, solint: SolutionInterval::Infinite, ..SolveOptions::default() };
    let mut maker = JointMaker::new(imaging, JointOptions { solve, prior: Prior::Auto, mask: None, goals });
    let plan = schedule(GainMode::Phase, SolutionInterval::Infinite, 1, false)[0];
    maker.update(&mut set, &plan, &Silent).unwrap();
    let image = maker.products().unwrap().model.plane(0, 0).to_owned();
    let by = find_shift(image.view(), case.scene.view()).unwrap();
    error_of(&shifted(image.view(), by), &case.scene)
}

pub fn group() -> Group {
    let d = JointSchedule::default();
    let knobs: Vec<Knob<JointSchedule>> = vec![
        Knob {
            name: "JointSchedule::stages, strength",
            default: "0.6 to 6000".into(),
            set: |t, x| t.stages.iter_mut().for_each(|s| s.strength *= x),
        },
        Knob {
            name: "JointSchedule::stages, steps",
            default: "8 to 20".into(),
            set: |t, x| t.stages.iter_mut().for_each(|s| s.steps = (s.steps as f64 * x) as usize),
        },
        Knob { name: "JointSchedule::near", default: d.near.to_string(), set: |t, x| t.near = 1.0 + 0.5 * x },
        Knob { name: "JointSchedule::dark", default: d.dark.to_string(), set: |t, x| t.dark *= x },
        Knob {
            name: "JointSchedule::final_evaluations",
            default: d.final_evaluations.to_string(),
            set: |t, x| t.final_evaluations = (60.0 * x) as usize,
        },
        Knob { name: "JointSchedule::finals", default: d.finals.to_string(), set: |t, x| t.finals = (3.0 * x) as usize },
        Knob { name: "JointSchedule::epsilon", default: d.epsilon.to_string(), set: |t, x| t.epsilon *= x },
        Knob { name: "JointSchedule::priors", default: d.priors.to_string(), set: |t, x| t.priors = (4.0 * x) as usize },
        Knob { name: "JointSchedule::prior_settled", default: d.prior_settled.to_string(), set: |t, x| t.prior_settled = 1.0 + 0.1 * x },
        Knob { name: "JointSchedule::brighter", default: d.brighter.to_string(), set: |t, x| t.brighter *= x },
    ];
    measure("joint solution", &cases(), &knobs, error)
}
