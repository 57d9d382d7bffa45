//! The numbers of a comparison.

use super::args::CompareArgs;
use super::common;
use super::design::Design;
use super::ranking::{Beam, ImageError, Ranking, by_beams, by_images};
use super::score::Score;
use super::steps::{IMAGES, Pixels};
use super::vary::{self, Point, What};
use crate::cli::context::Context;
use crate::cli::run::command::Done;
use serde_json::{Value, json};

/// The scores that `compare` gave to the images of a layout.
pub(super) fn scores(done: &[Done]) -> Vec<Score> {
    let score = |key: &'static str| {
        let found = &done.iter().find(|d| d.step.key.strip_prefix("compare.") == Some(key))?.json;
        let number = |name: &str| found.get(name).and_then(Value::as_f64).unwrap_or(f64::NAN);
        let unit = found.get("unit").and_then(Value::as_str).unwrap_or_default().to_owned();
        Some(Score { key, rms: number("rms_difference"), unit, nrmse: number("nrmse"), over_grey_card: number("error_over_grey_card") })
    };
    IMAGES.iter().filter_map(|made| score(made.key)).collect()
}

/// By the images of maximum entropy where they have scores, else by the beams.
pub(super) fn rank(designs: &[Design], scores: &[Vec<Score>]) -> Ranking {
    let error = |(d, scores): (&Design, &Vec<Score>)| {
        let s = scores.iter().find(|s| s.key == "mem" && s.over_grey_card.is_finite())?;
        Some(ImageError { name: d.name.clone(), rms: s.rms, unit: s.unit.clone(), over_grey_card: s.over_grey_card })
    };
    match designs.iter().zip(scores).map(error).collect::<Option<Vec<_>>>().filter(|all| !all.is_empty()) {
        Some(errors) => by_images(errors),
        None => by_beams(&designs.iter().map(Beam::of).collect::<Vec<_>>()),
    }
}

/// The content of `comparison.json`. `done` holds the steps of each layout.
pub(super) fn comparison(
    args: &CompareArgs,
    (designs, done, scores): (&[Design], &[Vec<Done>], &[Vec<Score>]),
    (ranking, pixels, resolution_rad): (&Ranking, Option<Pixels>, Option<f64>),
    varied: &[(What, Vec<Vec<Point>>)],
    context: &Context,
) -> Value {
    let mut layouts: Vec<Value> = designs.iter().zip(done).zip(scores).map(|((d, done), scores)| layout(d, done, scores)).collect();
    for (what, points) in varied {
        for (layout, points) in layouts.iter_mut().zip(points) {
            layout["quality_against"][what.key()] = vary::json(points);
        }
    }
    let o = &args.observed;
    json!({
        "version": env!("CARGO_PKG_VERSION"), "command": context.command_line,
        "freq_hz": args.freq.si(), "bandwidth_hz": args.figures.bandwidth.map(|b| b.si()), "channels": args.figures.channels,
        "scene": o.scene, "noise": o.noise, "seed": o.seed, "time_s": args.figures.time.si(),
        "size": pixels.map(|p| [p.size.columns, p.size.rows]), "cell_rad": pixels.map(|p| p.cell.si()),
        "resolution_rad": resolution_rad, "compared_with": resolution_rad.map(|r| common::rule(args, r)),
        "best": ranking.order.first(), "ranking": ranking.order, "not_ranked": ranking.not_ranked,
        "ranked_by": ranking.by, "reason": ranking.reason,
        "layouts": layouts,
    })
}

fn layout(design: &Design, done: &[Done], scores: &[Score]) -> Value {
    let mut all = design.json.clone();
    all["name"] = design.name.as_str().into();
    all["file"] = design.given.as_str().into();
    for d in done.iter().filter(|d| IMAGES.iter().any(|m| m.key == d.step.key)) {
        all[&d.step.key] = d.json.clone();
    }
    for s in scores {
        let own = &mut all[s.key];
        (own["rms_difference"], own["unit"]) = (s.rms.into(), s.unit.as_str().into());
        (own["nrmse"], own["error_over_grey_card"]) = (s.nrmse.into(), s.over_grey_card.into());
        if s.unit == "K" {
            own["rms_k"] = s.rms.into();
        }
    }
    all
}
