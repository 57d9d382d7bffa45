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

pub use search::{OptimizeArgs, search_from};

use super::context::{Context, Outcome};
use super::failure::{Context as _, Failure, Result, ensure};
use crate::design::{PeakFinder, Problem, Searched};
use cittert_arrays::quantity::Length;
use cittert_arrays::{BeamLobes, SPEED_OF_LIGHT_M_S};
use inputs::Inputs;
use search::{name, search_one};
use serde_json::json;
use std::path::Path;

/// Distance of the directions from which the tops of side lobes are searched for the figures of the result.
const PEAK_STEP: f64 = 0.1;
/// Wavelengths of the aperture for each one of the field, where no frequency is given.
const FAR: f64 = 100.0;

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
    ensure!(
        args.page.is_none() || inputs.flat(),
        Failure::usage("--page shows the beam of a plane layout, and these stations stand on no plane: leave it out")
    );
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
    let told: Vec<String> = figures.iter().map(|(name, value)| format!("{name} {value:.6}")).collect();
    let history = format!("{}; {} after {} attempts, seed {}", context.history(), told.join(", "), found.attempts, args.design.seed);
    let layout = inputs.layout(name(&args.out.output), &best.xy, history, args.scene.of_new())?;
    let longest_m = layout.extent().longest_m;
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
        "longest_m": longest_m, "violated": violated.max(0.0),
        "attempts": found.attempts, "best_attempt": best.attempt, "scores": found.scores, "seed": args.design.seed,
    });
    outcome.text = format!(
        "{}: {} elements in {}\n{} (attempt {} of {})",
        args.out.output.display(),
        layout.n_ant(),
        Length(super::text::round(inputs.aperture_m)),
        told.join(", "),
        best.attempt + 1,
        found.attempts,
    );
    if inputs.flat() {
        add_lobes(&mut outcome, (args, inputs, problem), &best.xy)?;
    } else {
        let chosen: Vec<&str> = layout.antennas().iter().map(|a| a.name.as_str()).collect();
        outcome.text += &format!("\nchosen: {}", chosen.join(", "));
    }
    Ok(outcome)
}

/// Tell the side lobes and the width of the beam of a plane layout.
fn add_lobes(outcome: &mut Outcome, (args, inputs, problem): (&OptimizeArgs, &Inputs, &Problem), xy: &[[f64; 2]]) -> Result<()> {
    let ring = problem.setting.ring;
    let searched = PeakFinder::new(&problem.setting.views, ring, PEAK_STEP).highest(xy);
    let lobes = lobes(args, inputs, problem, xy)?;
    let width = problem.limits.width(xy);
    let within_rad = args.design.freq.map(|f| args.design.within * SPEED_OF_LIGHT_M_S / f.si() / inputs.aperture_m);
    for (key, value) in [
        ("psl", json!(lobes.peak)),
        ("psl_within_db", json!(10.0 * lobes.peak.log10())),
        ("within", json!(args.design.within)),
        ("within_rad", json!(within_rad)),
        ("rms_sidelobe_within", json!(lobes.rms)),
        ("psl_searched", json!(searched)),
        ("searched_from", json!(ring.inner)),
        ("searched_to", json!(ring.outer)),
        ("beam_largest", json!(width[1])),
        ("beam_smallest", json!(width[0])),
    ] {
        outcome.json[key] = value;
    }
    outcome.text += &format!(
        "\npeak side lobe {:.4} ({:.2} dB) from the first minimum to {} wavelengths over the aperture\nsearched: peak side lobe {:.4} from {} to {}\nbeam {:.3} to {:.3} wavelengths over the aperture",
        lobes.peak,
        10.0 * lobes.peak.log10(),
        args.design.within,
        searched,
        ring.inner,
        ring.outer,
        width[0],
        width[1],
    );
    Ok(())
}

/// Side lobes by the definition of `layout show`, over all channels and moments that are observed.
fn lobes(args: &OptimizeArgs, inputs: &Inputs, problem: &Problem, xy: &[[f64; 2]]) -> Result<BeamLobes> {
    // Without a frequency the field is small, so that the horizon does not cut it.
    let unit = args.design.freq.map_or(FAR * args.design.within, |f| inputs.aperture_m * f.si() / SPEED_OF_LIGHT_M_S);
    let views = problem.setting.views.iter().map(|view| view.of(xy).into_iter().map(|p| p.map(|v| v * unit)).collect()).collect();
    BeamLobes::of_views(views, args.design.within, unit).map_err(|e| Failure::call(e.into()))
}

/// The file name must have an ending that layouts are read by.
fn check_ending(path: &Path) -> Result<()> {
    let toml = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"));
    ensure!(toml, Failure::usage(format!("-o {}: the layout is written as TOML, so its name must end in .toml", path.display())));
    Ok(())
}
