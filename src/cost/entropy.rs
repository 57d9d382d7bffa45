//! The stages of `mem`.

use super::held::{DOUBLE, Held, SINGLE, convolution};
use super::image::{InputFormat, fits};
use super::rehearsed::{Course, searches};
use super::speeds::Speeds;
use super::stage::{Forecast, Stage};
use super::term::Term;
use crate::imaging::{Field, Outlook};

/// Images in single precision that the solver holds beside its transforms: the prior, the point (variable, slopes of data and penalty), the direction,
/// the vectors of the Newton system, and three gradients in double precision.
const IMAGES: f64 = 16.0;

/// Evaluations of the data where they are noise alone, and the power of chi squared of an empty image with which their number grows.
const IN_NOISE: f64 = 12.0;
const GROWTH: f64 = 0.28;
/// The last step is finished where the evaluations are used up: some runs make one more.
const OVER: f64 = 0.5;
/// Convolutions for each evaluation, over the logarithm of the evaluations over a number. Runs on random sets of points took 1.3, 1.9, 3.2, 3.9, 5.3 and 7.2 of them
/// in 8, 12, 16, 24, 40 and 150 evaluations.
const STEPS: (f64, f64) = (2.25, 4.3);

/// What maximum entropy is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EntropyWork {
    /// Evaluations of the data, at most.
    pub evaluations: f64,
    /// Chi squared of an empty image for each visibility, if it is known: 1 is noise alone.
    pub chi2_of_nothing: Option<f64>,
    /// How far a rehearsal came.
    pub course: Option<Course>,
    /// True where a map of uncertainties is made.
    pub uncertainty: bool,
    /// The transform that predicts visibilities by whose residuals the fit is judged; none where it is not.
    pub judged: Option<Field>,
    /// True where a second image is made without some baselines.
    pub twice: bool,
}

/// Evaluations of the data: those of a rehearsal, or those that runs take, which are the more, the further the data lie above their noise.
pub(super) fn evaluations(work: &EntropyWork, speeds: &Speeds) -> f64 {
    let typical = work.chi2_of_nothing.map_or(speeds.typical("mem.evaluations"), |chi2| IN_NOISE * chi2.max(1.0).powf(GROWTH));
    let expected = match work.course {
        Some(course) if course.ended => return course.turns,
        Some(course) => typical.max(course.turns + 1.0),
        None => typical,
    };
    expected.round().min(work.evaluations + OVER).max(2.0)
}

/// Convolutions with the beam in so many evaluations: the later ones take more steps of the linear solver.
fn convolutions(work: &EntropyWork, evaluations: f64) -> f64 {
    let typical = evaluations * (STEPS.0 * (evaluations / STEPS.1).ln()).max(1.0);
    work.course.filter(|course| course.ended && course.steps > 0.0).map_or(typical, |course| course.steps)
}

/// The forecast of an image of maximum entropy.
#[must_use]
pub fn entropy(outlook: &Outlook, (format, threads): (InputFormat, usize), work: &EntropyWork, speeds: &Speeds) -> Forecast {
    let held = Held { outlook, threads };
    let (pixels, out) = (outlook.pixels(), outlook.channels_out as f64);
    let image = &outlook.image;
    let (n_l, n_m) = (outlook.grid.n_l, outlook.grid.n_m);
    let (wide, of_wide, rows) = convolution((n_l, n_m), n_l.max(n_m), SINGLE);
    let (round, of_round, _) = convolution((n_l, n_m), 0, SINGLE);
    // Of spectra of symmetric kernels the real part is kept.
    let hessian = (of_wide + of_round) / 2.0;
    let results = (out - 1.0) * held.plane(2.0 * DOUBLE + if work.uncertainty { DOUBLE } else { 0.0 });
    let evaluations = evaluations(work, speeds);
    let convolutions = convolutions(work, evaluations);
    let beam = outlook.core.as_ref().unwrap_or(image);
    let solver = hessian + held.plane(IMAGES * SINGLE) + results;
    // The beam for the Hessian has twice the size.
    let field = Stage::new(
        "beam of the data",
        held.pass(image) + held.plane(4.0 * SINGLE) + 4.0 * image.size.plane_bytes as f64 / image.size.planes.max(1) as f64 + of_wide,
    );
    let first = held.gridded(image, 1.0).into_iter().map(|(t, n)| {
        if matches!(t, Term::ToImage | Term::ToImagePoint) { (t, 4.0 * n / image.size.planes.max(1) as f64) } else { (t, n) }
    });
    // The noise and the flux of the data, which are found in a pass without a transform.
    let statistics = Stage::new("statistics", held.pass(image)).doing([(Term::Statistics, outlook.visibilities())]);
    let mut passes = held.residuals(evaluations, solver);
    passes.name = "passes";
    let solve = Stage::new("solver", held.pass(image) + held.planes_between(2.0) + solver + rows);
    let mut stages = vec![
        held.start(),
        held.read(format),
        held.weigh(),
        held.beam(beam, results),
        statistics,
        Stage { summed_bytes: held.plane(4.0 * SINGLE), ..field }
            .doing([(Term::Sort, out * image.pass.nodes), (Term::Convolve, out * wide * wide.log2())])
            .doing(first),
        passes.doing([(Term::Sort, if outlook.kept { out * image.pass.nodes } else { 0.0 })]),
        Stage { whole: true, ..solve }.doing([
            (Term::Convolve, out * convolutions * wide * wide.log2() + out * convolutions * round * round.log2()),
            (Term::EntropyPixel, out * pixels * (evaluations + convolutions)),
        ]),
    ];
    let mut residual = held.residuals(1.0, held.plane(2.0 * DOUBLE) + results);
    residual.name = "residual";
    stages.push(residual);
    stages.push(
        Stage { whole: true, ..Stage::new("restored image", held.plane(4.0 * DOUBLE) + results) }.doing([(Term::Pixel, out * pixels)]),
    );
    if work.uncertainty {
        let map = Stage::new("uncertainty", held.pass(image) + solver + rows);
        // The data are evaluated once more at the result.
        let again = held.residuals(1.0, solver);
        stages.push(Stage { name: "last evaluation", ..again });
        stages.push(Stage { whole: true, ..map }.doing([(Term::EntropyMap, out * wide * wide.log2())]));
    }
    let images = if work.uncertainty { 4.0 } else { 3.0 };
    stages.push(held.write(images, held.plane(3.0 * DOUBLE) + results));
    stages.extend(work.judged.as_ref().map(|field| held.verdict((field, searches(work.course)), held.plane(3.0 * DOUBLE))));
    if work.twice {
        stages.push(Stage::second(&stages, ["start", "write"]));
    }
    let why = match work.chi2_of_nothing {
        _ if work.course.is_some_and(|course| course.ended) => "as in a rehearsal".to_owned(),
        Some(chi2) if evaluations < work.evaluations => format!("as runs take on data with {chi2:.3} times the power of their noise"),
        Some(_) => "which are all that it may take, as the data lie far above their noise".into(),
        None => "as runs typically take".into(),
    };
    let evaluations = (10.0 * evaluations).round() / 10.0;
    let text = format!("{evaluations} evaluations of the data and {convolutions:.0} convolutions with the beam, {why}");
    Forecast { stages, output_bytes: fits(outlook, images), assumptions: vec![text], groups_of_planes: image.size.groups }
}
