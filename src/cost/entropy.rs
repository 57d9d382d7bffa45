//! The stages of `mem`.

use super::held::{DOUBLE, Held, SINGLE, convolution};
use super::image::{InputFormat, fits};
use super::speeds::Speeds;
use super::stage::{Forecast, Stage};
use super::term::Term;
use crate::imaging::{Field, Outlook};

/// Images in single precision that the solver holds beside its transforms: the prior, the point (variable, slopes of data and penalty), the direction,
/// the vectors of the Newton system, and three gradients in double precision.
const IMAGES: f64 = 16.0;

/// What maximum entropy is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EntropyWork {
    /// Evaluations of the data, at most.
    pub evaluations: f64,
    /// True where a map of uncertainties is made.
    pub uncertainty: bool,
    /// The transform that predicts visibilities by whose residuals the fit is judged; none where it is not.
    pub judged: Option<Field>,
    /// True where a second image is made without some baselines.
    pub twice: bool,
}

/// Evaluations of the data that runs typically take.
pub(super) fn evaluations(work: &EntropyWork, speeds: &Speeds) -> f64 {
    speeds.typical("mem.evaluations").min(work.evaluations).round().max(2.0)
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
    let convolutions = evaluations * speeds.typical("mem.convolutions-per-evaluation");
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
    let mut passes = held.residuals(evaluations, solver);
    passes.name = "passes";
    let solve = Stage::new("solver", held.pass(image) + held.planes_between(2.0) + solver + rows);
    let mut stages = vec![
        held.start(),
        held.read(format),
        held.weigh(),
        held.imaged("beam", beam, (true, results)),
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
        stages.push(Stage { whole: true, ..map }.doing([(Term::EntropyMap, out * wide * wide.log2())]));
    }
    let images = if work.uncertainty { 4.0 } else { 3.0 };
    stages.push(held.write(images, held.plane(3.0 * DOUBLE) + results));
    stages.extend(work.judged.as_ref().map(|field| held.verdict(field, held.plane(3.0 * DOUBLE))));
    if work.twice {
        stages.push(Stage::second(&stages, ["start", "write"]));
    }
    let text = format!("{evaluations} evaluations of the data and {convolutions:.0} convolutions with the beam, as runs typically take");
    Forecast { stages, output_bytes: fits(outlook, images), assumptions: vec![text], groups_of_planes: image.size.groups }
}
