//! Maximum entropy: the error of the image relative to the scene.

use crate::scenes::{CELL, Case, SIDE, cases, error_of};
use crate::table::{Group, Knob, measure};
use cittert::arrays::quantity::Angle;
use cittert::imaging::{ImageSize, Imager, ImagingOptions, Weighting};
use cittert::mem::{MemOptions, MemPlan, MemTuning, Method, Uncertainty, mem};
use cittert::progress::Silent;

fn error(case: &Case, solver: Method, tv: f64, tuning: &MemTuning) -> f64 {
    let (mut set, _) = case.observed(1, 0.0);
    let imaging = ImagingOptions {
        size: Some(ImageSize::square(SIDE)),
        cell: Some(Angle(CELL)),
        weighting: Weighting::Natural,
        ..ImagingOptions::default()
    };
    let mut imager = Imager::new(&mut set, imaging, &Silent).unwrap();
    let options = MemOptions { solver, total_variation: tv, uncertainty: Uncertainty::None, ..MemOptions::default() };
    let plan = MemPlan { options, tuning: *tuning, ..MemPlan::default() };
    error_of(&mem(&mut imager, &plan, &Silent).unwrap().model.plane(0, 0).to_owned(), &case.scene)
}

pub fn groups() -> Vec<Group> {
    let cases = cases();
    let knob = |name, default: f64, set| Knob { name, default: default.to_string(), set };
    let d = MemTuning::default();
    let control: Vec<Knob<MemTuning>> = vec![
        knob("MemControl::rise", d.control.rise, |t: &mut MemTuning, x| t.control.rise *= x),
        knob("MemControl::least_rise", d.control.least_rise, |t: &mut MemTuning, x| t.control.least_rise = 1.0 + 0.03 * x),
        knob("MemControl::followed", d.control.followed, |t: &mut MemTuning, x| t.control.followed *= x),
        knob("MemControl::settled", d.control.settled, |t: &mut MemTuning, x| t.control.settled *= x),
        knob("MemControl::near", d.control.near, |t: &mut MemTuning, x| t.control.near *= x),
        knob("MemControl::jump", d.control.jump, |t: &mut MemTuning, x| t.control.jump *= x),
        knob("MemControl::dead_band", d.control.dead_band, |t: &mut MemTuning, x| t.control.dead_band = (0.6 * x).min(1.0)),
        knob("MemControl::trim_up", d.control.trim_up, |t: &mut MemTuning, x| t.control.trim_up *= x),
        knob("MemControl::trim_up_kkt", d.control.trim_up_kkt, |t: &mut MemTuning, x| t.control.trim_up_kkt *= x),
        knob("MemControl::trim_down", d.control.trim_down, |t: &mut MemTuning, x| t.control.trim_down *= x),
        knob("MemControl::trim_down_kkt", d.control.trim_down_kkt, |t: &mut MemTuning, x| t.control.trim_down_kkt *= x),
    ];
    let vtess: Vec<Knob<MemTuning>> = vec![
        knob("VtessControl::growth", d.vtess.growth, |t: &mut MemTuning, x| t.vtess.growth *= x),
        knob("VtessControl::rise", d.vtess.rise, |t: &mut MemTuning, x| t.vtess.rise *= x),
        knob("VtessControl::loss", d.vtess.loss, |t: &mut MemTuning, x| t.vtess.loss = (0.9 * x).min(0.95)),
        knob("VtessControl::gain", d.vtess.gain, |t: &mut MemTuning, x| t.vtess.gain *= x),
        knob("VtessControl::close", d.vtess.close, |t: &mut MemTuning, x| t.vtess.close *= x),
    ];
    let softening: Vec<Knob<MemTuning>> = vec![knob("MemTuning::softening", d.softening, |t: &mut MemTuning, x| t.softening *= x)];
    vec![
        measure("maximum entropy", &cases, &control, |c, t| error(c, Method::QuasiNewton, 0.0, t)),
        measure("maximum entropy, vtess", &cases, &vtess, |c, t| error(c, Method::Vtess, 0.0, t)),
        measure("maximum entropy with total variation", &cases, &softening, |c, t| error(c, Method::QuasiNewton, 0.1, t)),
    ]
}
