//! The stages of `clean`.

use super::held::{DOUBLE, Held, SINGLE, convolution};
use super::image::{InputFormat, fits};
use super::rehearsed::{Course, searches};
use super::speeds::Speeds;
use super::stage::{Forecast, Stage};
use super::term::Term;
use crate::imaging::{Field, Outlook};

/// Side of a tile of a minor cycle by Högbom, pixels.
const TILE: f64 = 32.0;
/// Bytes of a component in the list, in memory and in its file.
const COMPONENT: f64 = 64.0;
const COMPONENT_TEXT: f64 = 56.0;
/// Flux of the components that multiscale CLEAN finds before the second round, in brightest components without a loop gain, and the rounds for each factor of e of
/// it: 28 runs on random sets took 12, 21, 30 and 37 rounds for 300, 1000, 3000 and 10000 components, whatever the size of the image.
const FIRST_ROUND: f64 = 5.4;
const ROUNDS: f64 = 7.1;
/// Convolutions of a round beside those that smooth the residual: the components with their scale, of which half are points, and with the beam.
const ROUND: f64 = 1.5;
/// Steps over all pixels in a round beside the search for the peak of each scale.
const STEPS: f64 = 8.0;
/// Convolutions that make the kernel of a scale and smooth the beam twice with it, and steps over all pixels.
const OF_SCALE: (f64, f64) = (2.5, 6.0);
/// Models that are drawn for each major cycle, and the most scales that such a model has apart from points.
const DRAWN: (f64, f64) = (2.7, 2.5);
/// A component is drawn by a convolution and the transform of the kernel, in double precision.
const DRAWING: f64 = 1.5 * DOUBLE / SINGLE;
/// Of so many rows of an image one waits for a comparison with the exact residual.
const COMPARED: f64 = 8.0;

/// What CLEAN is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CleanWork {
    /// Components, at most.
    pub components: f64,
    /// Part of the peak that a component takes.
    pub gain: f64,
    /// How far a rehearsal came.
    pub course: Option<Course>,
    /// Major cycles, at most.
    pub most_cycles: f64,
    /// True for the minor cycles by Högbom, which visit tiles for each component.
    pub hogbom: bool,
    /// Number of scales.
    pub scales: f64,
    /// True where the data are tested for phases that are not calibrated, so that the set is read twice.
    pub tested: bool,
    /// The transform that predicts visibilities by whose residuals the fit is judged; none where it is not.
    pub judged: Option<Field>,
    /// True where a second image is made without some baselines.
    pub twice: bool,
}

/// Major cycles: those of a rehearsal, or those that runs with so many components typically take.
pub(super) fn cycles(work: &CleanWork, speeds: &Speeds) -> f64 {
    let logs = |components: f64| (components * work.gain).max(1.0).ln();
    let typical = speeds.typical("clean.cycles") + speeds.typical("clean.cycles-per-log") * logs(work.components);
    let expected = match work.course {
        Some(course) if course.ended => return course.turns,
        // The first cycle of a run tells too little of the others.
        Some(course) if course.turns >= 2.0 && logs(course.steps) > 0.0 => course.turns * logs(work.components) / logs(course.steps),
        Some(course) => typical.max(course.turns + 1.0),
        None => typical,
    };
    ((10.0 * expected).round().max(10.0) / 10.0).min(work.most_cycles)
}

/// Components that are found.
fn components(work: &CleanWork) -> f64 {
    work.course.filter(|course| course.ended).map_or(work.components, |course| course.steps)
}

/// Rounds of multiscale CLEAN: after each one the scales are compared again.
fn rounds(work: &CleanWork) -> f64 {
    if work.scales > 1.0 { (ROUNDS * (components(work) * work.gain / FIRST_ROUND).max(1.0).ln()).max(1.0) } else { 0.0 }
}

impl Held<'_> {
    /// The beams and kernels of all scales, which stay in memory as long as the minor cycles are not over.
    pub(super) fn scales(self, work: &CleanWork) -> f64 {
        let (n_l, n_m) = (self.outlook.grid.n_l, self.outlook.grid.n_m);
        let (_, spectrum, _) = convolution((n_l, n_m), n_l.max(n_m) / 2, SINGLE);
        // The spectrum of a kernel has no imaginary part. Points have no kernel, and share the beam of the image.
        (work.scales - 1.0).max(0.0) * (self.plane(SINGLE) + spectrum / 2.0)
    }

    /// Minor cycles that find so many components in so many turns. `beside` are the bytes that are held beside beam, dirty image, residual and components.
    pub(super) fn minor(self, work: &CleanWork, cycles: f64, beside: f64) -> Stage {
        let (pixels, out) = (self.outlook.pixels(), self.outlook.channels_out as f64);
        let (n_l, n_m) = (self.outlook.grid.n_l, self.outlook.grid.n_m);
        let (points, spectrum, rows) = convolution((n_l, n_m), n_l.max(n_m) / 2, SINGLE);
        let logs = points * points.log2();
        let found = components(work);
        let images = self.plane(3.0 * SINGLE) + out * found * COMPONENT;
        // Processes share out the channels.
        let own = (out / self.outlook.processes as f64).ceil();
        // Each scale of multiscale CLEAN finds its components as Högbom does.
        let in_tiles = work.hogbom || work.scales > 1.0;
        let of_tiles = if in_tiles { self.plane(SINGLE) } else { 0.0 };
        let tiles = pixels / TILE / TILE;
        let rounds = rounds(work);
        let steps = 2.0 * cycles + rounds * (work.scales + STEPS);
        let convolutions = if in_tiles { 0.5 } else { 6.0 } * cycles + rounds * (work.scales - 1.0 + ROUND);
        let stage = Stage::new("minor cycles", beside + images + spectrum + rows + of_tiles);
        Stage { whole: true, ..stage }.doing([
            (Term::Component, own * found),
            (Term::Tile, if in_tiles { own * found * tiles } else { 0.0 }),
            (Term::MinorPixel, own * pixels * steps),
            (Term::Convolve, own * logs * convolutions),
        ])
    }

    /// The kernels and beams of the scales, and the models that are drawn with them in so many turns; none where all components are points.
    pub(super) fn drawn(self, work: &CleanWork, cycles: f64, beside: f64) -> Option<Stage> {
        let wide = work.scales - 1.0;
        let (n_l, n_m) = (self.outlook.grid.n_l, self.outlook.grid.n_m);
        let (points, spectrum, _) = convolution((n_l, n_m), n_l.max(n_m) / 2, SINGLE);
        // Half of the largest scale, which is nearly half of the image, is typical of the largest one in a model.
        let (drawn, of_model, rows) = convolution((n_l, n_m), n_l.max(n_m) / 8, DOUBLE);
        let models = DRAWING * DRAWN.0 * cycles * wide.min(DRAWN.1);
        let out = self.outlook.channels_out as f64;
        let making = spectrum + self.plane(3.0 * SINGLE);
        let drawing = self.plane(DOUBLE) + 1.5 * of_model + rows;
        let stage = Stage { whole: true, ..Stage::new("scales", beside + making.max(drawing)) };
        let convolved = OF_SCALE.0 * wide * points * points.log2() + models * drawn * drawn.log2();
        (wide > 0.0)
            .then(|| stage.doing([(Term::Convolve, out * convolved), (Term::MinorPixel, out * OF_SCALE.1 * wide * self.outlook.pixels())]))
    }
}

/// The forecast of CLEAN.
#[must_use]
pub fn clean(outlook: &Outlook, (format, threads): (InputFormat, usize), work: &CleanWork, speeds: &Speeds) -> Forecast {
    let held = Held { outlook, threads };
    let (pixels, out) = (outlook.pixels(), outlook.channels_out as f64);
    let (cycles, found) = (cycles(work, speeds), components(work));
    let image = &outlook.image;
    // The beam and the data of the other output channels stay in memory: beam, dirty image, residual and model.
    let others = (out - 1.0) * held.plane(3.0 * SINGLE + DOUBLE);
    let scales = held.scales(work);
    let list = out * found * COMPONENT;
    let between = held.pass(image) + held.planes_between(2.0);
    let compared = held.plane(SINGLE / COMPARED);
    let mut stages = vec![held.start()];
    if work.tested {
        let again = held.read(format);
        let twice = again.work.iter().map(|(t, n)| (*t, 2.0 * n)).collect();
        let read_bytes = 2.0 * again.read_bytes;
        stages.push(Stage { name: "test of phases", work: twice, read_bytes, ..again });
        stages.push(Stage { name: "weights of the test", ..held.weigh() });
    }
    stages.extend([
        held.read(format),
        held.weigh(),
        held.beam(image, others),
        held.imaged("dirty image", image, (!outlook.kept, held.plane(SINGLE) + others)),
    ]);
    stages.extend(held.drawn(work, cycles, between + scales + list + held.plane(2.0 * SINGLE) + others));
    stages.extend([
        held.minor(work, cycles, between + scales + others),
        held.residuals(cycles, held.plane(2.0 * SINGLE) + scales + compared + list + others),
        Stage { whole: true, ..Stage::new("restored image", between + held.plane(SINGLE + DOUBLE + DOUBLE + SINGLE) + list + others) }
            .doing([(Term::Pixel, out * pixels)]),
        held.write(5.0, between + held.plane(2.0 * SINGLE + DOUBLE) + list + others),
    ]);
    stages.extend(work.judged.as_ref().map(|field| held.verdict((field, searches(work.course)), list)));
    if work.twice {
        stages.push(Stage::second(&stages, ["start", "test of phases", "weights of the test", "write"]));
    }
    let assumptions = match work.course {
        Some(course) if course.ended => vec![format!("{cycles:.1} major cycles and {found:.0} components, as in a rehearsal")],
        course => {
            let why = course.map_or_else(
                || "as runs with so many components take on average".to_owned(),
                |c| format!("of which a rehearsal made {:.1}, with {:.0} components", c.turns, c.steps),
            );
            vec![format!("the {found} components of --niter are used up"), format!("{cycles:.1} major cycles, {why}")]
        }
    };
    Forecast { stages, output_bytes: fits(outlook, 5.0) + out * found * COMPONENT_TEXT, assumptions, groups_of_planes: image.size.groups }
}
