//! Answers as sentences.

use super::answers::Answers;
use super::failures::Ranking;
use super::question::Asked;
use crate::study::{Answer, Place, Question, Score};

/// Share of the seeds that contradict a single limit above which the sentence says so.
const NOT_MONOTONE: f64 = 0.1;

/// A score in a sentence, with its article.
fn noun(score: Score) -> &'static str {
    match score {
        Score::DynamicRange => "a dynamic range",
        Score::OffSourceDynamicRange => "an off-source dynamic range",
        Score::Nrmse => "an NRMSE",
        Score::ErrorOverGreyCard => "an error over grey card",
        Score::Fidelity => "a fidelity index",
        Score::ResidualRms => "a residual rms",
        Score::PhaseRmsRad => "a phase error of the gains (rad)",
    }
}

/// Which points have images that are no better than a flat one. `None` where there are none.
pub(super) fn flat(stage: &str, points: &[String], all: usize) -> Option<String> {
    let first = points.first()?;
    let when = if stage == "after" { " after self-calibration" } else { "" };
    let place = if first.is_empty() { String::new() } else { format!(", the first at {first}") };
    Some(format!(
        "The median image{when} is no better than a flat one (error over grey card of 1 or more) at {} of {all} points{place}.",
        points.len()
    ))
}

/// A parameter in a sentence, in the plural.
fn subject(parameter: &str) -> String {
    match parameter {
        "corrupt.phase-rms" => "phase errors".into(),
        "corrupt.amp-rms" => "amplitude errors".into(),
        "corrupt.delay-rms" => "delay errors".into(),
        "corrupt.position-rms" => "position errors".into(),
        "corrupt.troposphere" => "phases of the troposphere".into(),
        "corrupt.sefd" => "SEFDs".into(),
        "corrupt.tsys" => "system temperatures".into(),
        "corrupt.dropout" => "dropouts".into(),
        "simulate.bandwidth" => "bandwidths".into(),
        "simulate.duration" => "durations".into(),
        "layout.antennas" => "numbers of antennas".into(),
        "layout.make.elements" => "numbers of elements".into(),
        "layout.make.aperture" => "apertures".into(),
        other => format!("values of {other}"),
    }
}

/// A number with so many decimals.
fn fixed(x: f64, decimals: usize) -> String {
    format!("{x:.decimals$}")
}

/// Decimals that show an uncertainty with one digit, or two where the first is 1.
fn decimals(error: f64) -> usize {
    if !(error > 0.0) {
        return 3;
    }
    let power = error.log10().floor();
    let two = error / 10f64.powf(power) < 1.95;
    (i32::from(two) - power as i32).clamp(0, 9) as usize
}

/// A value and its error, such as `4.1 +- 0.3`.
pub(super) fn plus_minus(value: f64, error: f64) -> String {
    let d = decimals(error);
    format!("{} +- {}", fixed(value, d), fixed(error, d))
}

fn with_unit(text: &str, unit: &str) -> String {
    if unit.is_empty() { text.to_owned() } else { format!("{text} {unit}") }
}

/// The limit and its uncertainty.
fn limit(value: f64, answer: &Answer, q: &Question) -> String {
    let number = |p: Option<Place>| p.and_then(Place::number);
    match (number(answer.limit.low), number(answer.limit.high)) {
        (Some(low), Some(high)) if high > low => {
            let (below, above) = (value - low, high - value);
            let (half, d) = (0.5 * (high - low), decimals(0.5 * (high - low)));
            if q.whole && half < 0.5 {
                format!("{value}")
            } else if (above - below).abs() < half {
                plus_minus(value, half)
            } else {
                format!("{} ({} to {})", fixed(value, d), fixed(low, d), fixed(high, d))
            }
        }
        (Some(_), Some(_)) => format!("{value}"),
        (None, None) if answer.limit.low.is_none() => format!("about {} (too few seeds for limits)", short(value)),
        (low, high) => {
            let side = |x: Option<f64>, end: f64, word: &str| x.map_or_else(|| format!("{word} {}", short(end)), short);
            format!("{} ({} to {})", short(value), side(low, q.from, "below"), side(high, q.to, "beyond"))
        }
    }
}

/// Three digits.
fn short(x: f64) -> String {
    let digits = if x == 0.0 { 0 } else { (2 - x.abs().log10().floor() as i32).clamp(0, 9) as usize };
    let text = fixed(x, digits);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// What a stage found: the values that keep the score.
enum Range {
    All,
    None,
    UpTo(f64),
    From(f64),
}

fn range(a: &Answer) -> Range {
    match (a.limit.value, a.rising) {
        (Place::At(x), false) => Range::UpTo(x),
        (Place::At(x), true) => Range::From(x),
        (Place::Above, false) | (Place::Below, true) => Range::All,
        (Place::Below, false) | (Place::Above, true) => Range::None,
    }
}

/// The number of an answer: the last value that keeps the score, or the end of the range if all values do.
pub(super) fn value(a: &Answer, q: &Question) -> Option<f64> {
    match range(a) {
        Range::UpTo(x) | Range::From(x) => Some(x),
        Range::All => Some(if a.rising { q.from } else { q.to }),
        Range::None => None,
    }
}

/// Where the limit lies, if it is not inside the range.
pub(super) fn outside(a: &Answer) -> Option<&'static str> {
    match a.limit.value {
        Place::At(_) => None,
        Place::Below => Some("below"),
        Place::Above => Some("above"),
    }
}

/// The values of a stage, such as `up to 4.1 +- 0.3 deg`; `None` where none keeps the score.
fn values(asked: &Asked, a: &Answer) -> Option<String> {
    let q = &asked.question;
    Some(match range(a) {
        Range::UpTo(x) => format!("up to {}", with_unit(&limit(x, a, q), &asked.unit)),
        Range::From(x) => format!("from {} on", with_unit(&limit(x, a, q), &asked.unit)),
        Range::All if a.rising => format!("from {} on (the start of the range)", with_unit(&short(q.from), &asked.unit)),
        Range::All => format!("up to {} (the end of the range)", with_unit(&short(q.to), &asked.unit)),
        Range::None => return None,
    })
}

fn trials(fraction: f64) -> String {
    if fraction == 0.5 { "half of the trials".into() } else { format!("{} % of the trials", short(100.0 * fraction)) }
}

/// Remarks about one stage.
fn remarks(asked: &Asked, a: &Answer, stage: &str, seeds: usize) -> String {
    let mut out = String::new();
    if a.contradictions > NOT_MONOTONE {
        let share = 100.0 * a.contradictions;
        out += &format!(" The score is not monotone{stage}: in {share:.0} % of the seeds a value beyond the limit keeps it again.");
    }
    if let Some(needed) = a.seeds_needed {
        let precision = short(100.0 * asked.question.precision);
        out += &format!(" {seeds} seeds do not give the precision of {precision} %{stage}: about {needed} are needed.");
    }
    out
}

/// The answer at a place as one sentence, with remarks.
pub(super) fn answer(asked: &Asked, place: usize, found: &Answers, seeds: usize) -> String {
    let q = &asked.question;
    let bound = format!("{} of at {} {}", noun(q.bound.score), if q.bound.at_least { "least" } else { "most" }, short(q.bound.limit));
    let who = subject(&asked.parameter);
    let place = &asked.places[place].text;
    let who = if place.is_empty() { capital(&who) } else { format!("At {place}, {who}") };
    let ends = format!("from {} to {}", short(q.from), with_unit(&short(q.to), &asked.unit));
    let mut text = match values(asked, &found.before) {
        Some(range) => format!("{who} {range} keep {bound} in {}", trials(q.fraction)),
        None => format!("{who} {ends} do not keep {bound} in {}", trials(q.fraction)),
    };
    if let Some(after) = &found.after {
        match (values(asked, after), values(asked, &found.before)) {
            (Some(range), _) => text += &format!("; with self-calibration {range}"),
            (None, None) => text += ", nor with self-calibration",
            (None, Some(_)) => text += "; with self-calibration none do",
        }
    }
    text.push('.');
    text += &remarks(asked, &found.before, "", seeds);
    if let Some(after) = &found.after {
        text += &remarks(asked, after, " after self-calibration", seeds);
    }
    text
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map(|c| c.to_uppercase().chain(letters).collect()).unwrap_or_default()
}

/// The worst antenna and the harmless ones. `names` are those of the ranked antennas, in the order of the ranking.
pub(super) fn ranking(score: Score, ranking: &Ranking, names: &[&str], place: &str, after: bool) -> String {
    let what = noun(score).split_once(' ').map_or("score", |(_, name)| name);
    let lead = if place.is_empty() { "Losing".to_owned() } else { format!("At {place}, losing") };
    let (Some(worst), Some(name)) = (ranking.costs.first(), names.first()) else { return String::new() };
    if !worst.cost.is_finite() {
        return format!("{lead} {name} leaves no {what}.");
    }
    let cost = if worst.error.is_finite() { plus_minus(worst.cost, worst.error) } else { short(worst.cost) };
    let stage = if after { ", after self-calibration" } else { "" };
    let harmless = 0.1 * worst.cost;
    let n = ranking.costs.iter().filter(|c| c.cost < harmless).count();
    let rest = if worst.cost > 0.0 {
        format!("; {n} of {} antennas cost less than {}, a tenth of that", ranking.costs.len(), short(harmless))
    } else {
        String::new()
    };
    format!("{lead} {name} costs {cost} of the {what} ({} with all antennas{stage}){rest}.", short(ranking.whole))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_uncertainty_has_one_digit_or_two_where_it_begins_with_1() {
        assert_eq!(plus_minus(4.123, 0.31), "4.1 +- 0.3");
        assert_eq!(plus_minus(4.123, 0.13), "4.12 +- 0.13");
        assert_eq!(plus_minus(512.7, 34.0), "513 +- 34");
        assert_eq!((short(0.012_345), short(90.0), short(1234.0)), ("0.0123".into(), "90".into(), "1234".into()));
    }
}
