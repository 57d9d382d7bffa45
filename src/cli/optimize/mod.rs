//! `layout optimize`: find the positions of elements, or choose among pads.
//!
//! From the start, a journal of the finished attempts stands beside the output. A search that was killed therefore continues where it stopped, when
//! the same command is run again. The journal is removed when the layout is written.

mod front;
mod inputs;
mod journal;
mod page;
mod scene;
mod search;

pub use search::OptimizeArgs;

use super::context::{Context, Outcome};
use super::failure::{Context as _, Failure, Result, ensure};
use crate::design::{PeakFinder, Problem, Searched};
use cittert_arrays::quantity::Length;
use inputs::Inputs;
use search::{name, search_one};
use serde_json::json;
use std::path::Path;

/// Distance of the directions from which the tops of side lobes are searched for the figures of the result.
const PEAK_STEP: f64 = 0.1;

/// Search, and write the best layout, or those of a Pareto front.
///
/// # Errors
/// An option or a file is wrong, elements do not fit, or an error of the file system.
pub fn run(args: &OptimizeArgs, context: &Context) -> Result<Outcome> {
    let path = &args.out.output;
    check_ending(path)?;
    if let Some(count) = args.pareto {
        return front::run(args, count, context);
    }
    args.out.claim([path].into_iter().chain(&args.page), args.inputs())?;
    let inputs = Inputs::read(&args.place, &args.design)?;
    let started = std::time::Instant::now();
    let found = search_one(args, &args.design, &inputs, path, context)?;
    let seconds = started.elapsed().as_secs_f64();
    let mut outcome = write(args, &inputs, &found.problem, &found.searched, context)?;
    found.journal.remove()?;
    outcome.json["resumed"] = found.resumed.into();
    outcome.json["seconds"] = seconds.into();
    Ok(outcome)
}

fn write(args: &OptimizeArgs, inputs: &Inputs, problem: &Problem, found: &Searched, context: &Context) -> Result<Outcome> {
    let best = &found.best;
    let violated = problem.limits.worst(&best.xy);
    let figures = problem.evaluator().and_then(|mut e| e.figures(&best.xy)).context("figures of the best layout")?;
    let mut finder = PeakFinder::new(&problem.setting.views, problem.setting.ring, PEAK_STEP);
    let peak = finder.highest(&best.xy);
    let width = problem.limits.width(&best.xy);
    let told: Vec<String> = figures.iter().map(|(name, value)| format!("{name} {value:.6}")).collect();
    let history = format!("{}; {} after {} attempts, seed {}", context.history(), told.join(", "), found.attempts, args.design.seed);
    let layout = inputs.layout(name(&args.out.output), &best.xy, history)?;
    args.out.write(&args.out.output, layout.to_toml().as_bytes())?;
    let mut outcome = Outcome::new(json!({}), "").wrote(&args.out.output);
    if let Some(page) = &args.page {
        args.out.write(page, page::page(&layout, problem, found, inputs.aperture_m, context)?.as_bytes())?;
        outcome = outcome.wrote(page);
    }
    if violated > 1e-6 {
        let text = "the best layout does not meet all limits: allow a wider beam, fewer elements or a smaller spacing, or search longer";
        context.console.warn(&format!("{text} (violated by {violated:.2e})"));
    }
    outcome.json = json!({
        "output": args.out.output, "n_antennas": layout.n_ant(), "aperture_m": inputs.aperture_m, "score": best.score,
        "figures": figures.iter().map(|(n, v)| ((*n).to_owned(), json!(v))).collect::<serde_json::Map<_, _>>(),
        "psl": peak, "psl_db": 10.0 * peak.log10(), "beam_largest": width[1], "beam_smallest": width[0], "violated": violated.max(0.0),
        "attempts": found.attempts, "best_attempt": best.attempt, "scores": found.scores, "seed": args.design.seed,
    });
    outcome.text = format!(
        "{}: {} elements in {}\n{} (attempt {} of {})\npeak side lobe {:.4} ({:.2} dB) from {} to {} wavelengths over the aperture\nbeam {:.3} to {:.3} wavelengths over the aperture",
        args.out.output.display(),
        layout.n_ant(),
        Length(inputs.aperture_m),
        told.join(", "),
        best.attempt + 1,
        found.attempts,
        peak,
        10.0 * peak.log10(),
        problem.setting.ring.inner,
        problem.setting.ring.outer,
        width[0],
        width[1],
    );
    Ok(outcome)
}

/// The file name must have an ending that layouts are read by.
fn check_ending(path: &Path) -> Result<()> {
    let toml = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"));
    ensure!(toml, Failure::usage(format!("-o {}: the layout is written as TOML, so its name must end in .toml", path.display())));
    Ok(())
}
