//! `--pareto`: several weightings of two objectives, and the layouts that no other beats in both.

use super::inputs::Inputs;
use super::search::{OptimizeArgs, name, search_one};
use crate::cli::context::{Context, Outcome};
use crate::cli::failure::{Failure, Result};
use crate::design::{DesignOptions, Objectives, front, weightings};
use crate::plot::{CurveOptions, Series, Style, curves};
use cittert_arrays::quantity::Duration;
use serde_json::json;
use std::path::PathBuf;

/// The files of a front of so many weightings: the layouts, then the picture.
pub(super) fn outputs(args: &OptimizeArgs, count: usize) -> (Vec<PathBuf>, PathBuf) {
    let base = args.out.output.with_extension("");
    let named = |end: String| PathBuf::from(format!("{}-{end}", base.display()));
    ((1..=count).map(|k| named(format!("{k}.toml"))).collect(), named("front.png".into()))
}

/// Search every weighting, and write the layouts of the front and a picture of it.
pub(super) fn run(args: &OptimizeArgs, count: usize, context: &Context) -> Result<Outcome> {
    let all = weightings(&args.design.objective, count).map_err(Failure::call)?;
    let (layouts, picture) = outputs(args, count);
    args.out.claim(layouts.iter().chain([&picture]), args.inputs())?;
    let inputs = Inputs::read(&args.place, &args.design)?;
    let mut found = Vec::new();
    for (objective, path) in all.into_iter().zip(&layouts) {
        let time = args.design.time.map(|t| Duration(t.si() / count as f64));
        let design = DesignOptions { objective, time, ..args.design.clone() };
        let one = search_one(args, &design, &inputs, path, context)?;
        let figures = one.problem.evaluator()?.figures(&one.searched.best.xy)?;
        found.push((one, [figures[0].1, figures[1].1]));
    }
    let points: Vec<[f64; 2]> = found.iter().map(|(_, p)| *p).collect();
    let kept = front(&points);
    let names: Vec<&str> = args.design.objective.0.iter().map(|(n, _)| n.as_str()).collect();
    let (mut outcome, mut rows, mut lines) = (Outcome::default(), Vec::new(), Vec::new());
    for k in &kept {
        let (one, [a, b]) = &found[*k];
        let weights = Objectives(one.problem.kinds().map(|(kind, w)| (kind.name.to_owned(), w)).collect());
        let history = format!(
            "{}; objectives {weights}: {} {a:.6}, {} {b:.6} after {} attempts, seed {}",
            context.history(),
            names[0],
            names[1],
            one.searched.attempts,
            args.design.seed
        );
        let layout = inputs.layout(name(&layouts[*k]), &one.searched.best.xy, history, args.scene.of_new())?;
        args.out.write(&layouts[*k], layout.to_toml().as_bytes())?;
        outcome = outcome.wrote(&layouts[*k]);
        rows.push(
            json!({ "output": layouts[*k], "objective": weights.to_string(), names[0]: a, names[1]: b, "attempts": one.searched.attempts }),
        );
        lines.push(format!("{}: {} {a:.5}, {} {b:.5}", layouts[*k].display(), names[0], names[1]));
    }
    args.out.write(&picture, &drawn(&points, &kept, &names)?)?;
    outcome = outcome.wrote(&picture);
    for (one, _) in found {
        one.journal.remove()?;
    }
    outcome.json = json!({ "front": rows, "weightings": count, "beaten": count - kept.len(), "seed": args.design.seed });
    outcome.text = lines.join("\n");
    Ok(outcome)
}

fn drawn(points: &[[f64; 2]], kept: &[usize], names: &[&str]) -> Result<Vec<u8>> {
    let series = [
        Series { name: "front".into(), points: kept.iter().map(|k| (points[*k][0], points[*k][1])).collect(), errors: Vec::new() },
        Series { name: "all weightings".into(), points: points.iter().map(|p| (p[0], p[1])).collect(), errors: Vec::new() },
    ];
    let options = CurveOptions {
        title: format!("{} against {}", names[1], names[0]),
        x_label: names[0].into(),
        y_label: names[1].into(),
        styles: vec![Style { color: 0, line: true, dots: true }, Style { color: 1, line: false, dots: true }],
        ..CurveOptions::default()
    };
    Ok(curves(&series, &options)?.png()?)
}
