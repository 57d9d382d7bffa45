//! The curves of a finished study.

use super::failures::Ranking;
use super::plan::Plan;
use super::tables::{AllStatistics, stages};
use crate::cli::failure::Result;
use crate::plot::report::Figure;
use crate::plot::{CurveOptions, Picture, Series, curves};
use crate::study::{Score, Statistics};

/// More lines than these cannot be distinguished.
const MOST_LINES: usize = 6;

/// One picture for each score: the median over the seeds with the 16th and 84th percentile, against the first axis. Each stage and each
/// combination of the other axes has a line, and so has the limit of a question. The score of the question comes first.
pub(super) fn scores(plan: &Plan, stats: &AllStatistics) -> Result<Vec<(String, Figure)>> {
    let Some(axis) = plan.study.grid.axes.first() else { return Ok(Vec::new()) };
    let grid = &plan.study.grid;
    let others = grid.n_points() / axis.values.len();
    let x = |k: usize| axis.values[k].number.unwrap_or(k as f64 + 1.0);
    let xs: Vec<f64> = (0..axis.values.len()).map(x).collect();
    let (low, high) = xs.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), v| (a.min(*v), b.max(*v)));
    let log_x = low > 0.0 && high > 50.0 * low;
    let names: Vec<String> = axis.values.iter().enumerate().map(|(k, v)| format!("{} {}", k + 1, v.text)).collect();
    let x_label = match (axis.is_numeric(), axis.unit.as_str()) {
        (true, "") => axis.name.clone(),
        (true, unit) => format!("{} [{unit}]", axis.name),
        _ => format!("{}: {}", axis.name, names.join(", ")),
    };
    let bound = plan.asked.as_ref().map(|a| a.question.bound);
    let mut out = Vec::new();
    for (c, score) in Score::ALL.iter().enumerate() {
        let mut series = Vec::new();
        for other in 0..others.min(MOST_LINES) {
            for (name, stage) in stages(plan).iter().zip(stats) {
                let at: Vec<Statistics> = (0..xs.len()).map(|k| stage[c][k * others + other]).collect();
                let rest: Vec<String> = grid.point(other)[1..].iter().map(|v| v.text.clone()).collect();
                series.push(Series {
                    name: std::iter::once(format!("{name} self-calibration")).chain(rest).collect::<Vec<_>>().join(", "),
                    points: xs.iter().zip(&at).map(|(x, s)| (*x, s.median)).collect(),
                    errors: at.iter().map(|s| (s.median - s.p16, s.p84 - s.median)).collect(),
                });
            }
        }
        let asked = bound.filter(|b| b.score == *score);
        if let Some(b) = asked {
            let name = format!("at {} {}", if b.at_least { "least" } else { "most" }, b.limit);
            series.push(Series { name, points: vec![(low, b.limit), (high, b.limit)], errors: Vec::new() });
        }
        let y_label = if *score == Score::ResidualRms { format!("{} [{}]", score.label(), plan.unit) } else { score.label().to_owned() };
        let options =
            CurveOptions { title: plan.title.clone(), x_label: x_label.clone(), y_label, log_x, log_y: true, ..CurveOptions::default() };
        // A score without a single positive number (no gains, no errors) has no picture.
        if let Ok(png) = curves(&series, &options).and_then(Picture::png) {
            let caption =
                format!("{}: median over {} seeds, bars from the 16th to the 84th percentile.", score.label(), plan.study.seeds.len());
            let file = format!("{}.png", score.name());
            let figure = (file.clone(), Figure { png, caption, file });
            if asked.is_some() { out.insert(0, figure) } else { out.push(figure) }
        }
    }
    Ok(out)
}

/// The costs of failed antennas in the order of their rank, of the first points.
pub(super) fn failures(plan: &Plan, rankings: &[Ranking]) -> Option<(String, Figure)> {
    let failing = plan.failing.as_ref()?;
    let line = |(point, r): (usize, &Ranking)| Series {
        name: plan.study.grid.place(point),
        points: r.costs.iter().enumerate().map(|(k, c)| (k as f64 + 1.0, c.cost)).collect(),
        errors: r.costs.iter().map(|c| if c.error.is_finite() { (c.error, c.error) } else { (0.0, 0.0) }).collect(),
    };
    let series: Vec<Series> = rankings.iter().take(MOST_LINES).enumerate().map(line).collect();
    let first = rankings.first()?;
    let worst: Vec<&str> = first.costs.iter().take(3).map(|c| failing.antennas[0][c.antenna].1.as_str()).collect();
    let options = CurveOptions {
        title: plan.title.clone(),
        x_label: format!("rank of the failed antenna: {} ...", worst.join(", ")),
        y_label: format!("loss: {}", failing.score.label()),
        ..CurveOptions::default()
    };
    let png = curves(&series, &options).and_then(Picture::png).ok()?;
    let caption = format!("What the failure of each antenna costs, with the standard error over {} seeds.", plan.study.seeds.len());
    let file = "failures.png".to_owned();
    Some((file.clone(), Figure { png, caption, file }))
}
