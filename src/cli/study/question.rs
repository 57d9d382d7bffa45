//! The question of a study: its places, the trials that answer it, and the answers.

use super::axes::like;
use super::config::{AxisSection, QuestionSection};
use super::journal::Key;
use super::plan::Plan;
use super::trials::{Job, Trials};
use crate::cli::context::Context;
use crate::cli::failure::{Context as _, Failure, Result, ensure};
use crate::study::{Answer, Axis, Bound, Grid, Question, Search, Setup, least_seeds};
use std::collections::{BTreeMap, BTreeSet};

/// A question ready to be answered.
pub(super) struct Asked {
    pub(super) question: Question,
    pub(super) parameter: String,
    /// Unit of the values.
    pub(super) unit: String,
    /// The form of a value in the file.
    form: toml::Value,
    /// The combinations of the other axes.
    pub(super) places: Vec<Spot>,
}

/// A combination of the values of the other axes.
pub(super) struct Spot {
    /// Points of the grid there, with the value of the parameter at each.
    points: Vec<(usize, f64)>,
    /// Parameters and values as text, such as `layout.name = vla-a`; empty without other axes.
    pub(super) text: String,
    /// The values of the other axes.
    others: Vec<(String, toml::Value)>,
}

/// The answers at one place.
pub(super) struct Answers {
    pub(super) before: Answer,
    pub(super) after: Option<Answer>,
}

impl Asked {
    /// The question of a section. `axes` are those of the grid with their values in the file.
    ///
    /// # Errors
    /// A number out of its range, a parameter that is not numeric, or too few seeds.
    pub(super) fn new(q: QuestionSection, grid: &Grid, seeds: usize, axes: &[(AxisSection, Vec<toml::Value>)]) -> Result<Self> {
        let wrong = |what: String| Err(Failure::message(format!("parameter {}: {what}", q.parameter)));
        let (limit, at_least) = match (q.at_least, q.at_most) {
            (Some(limit), None) => (limit, true),
            (None, Some(limit)) => (limit, false),
            _ => return Err(Failure::message("give at-least or at-most, and not both")),
        };
        let ends = Axis::new(&q.parameter, &[super::axes::shown(&q.from), super::axes::shown(&q.to)])?;
        let (Some(from), Some(to)) = (ends.values[0].number, ends.values[1].number) else {
            return wrong("from and to must be numbers in the same unit".into());
        };
        let Some(own) = grid.axes.iter().position(|a| a.name == q.parameter) else {
            return wrong("it is no axis".into());
        };
        let axis = &grid.axes[own];
        if !axis.is_numeric() || axis.unit != ends.unit {
            return wrong(format!("its axis must have numbers in the unit of from and to, {:?}", ends.unit));
        }
        let whole = matches!(q.from, toml::Value::Integer(_)) && matches!(q.to, toml::Value::Integer(_));
        let bound = Bound { score: q.keep, limit, at_least };
        let question = Question { bound, from, to, whole, log: q.log, fraction: q.fraction, precision: q.precision };
        question.check()?;
        let least = least_seeds(1.0 - q.fraction);
        ensure!(seeds >= least, Failure::message(format!("seeds is {seeds}, and a fraction of {} needs at least {least}", q.fraction)));
        let mut places: BTreeMap<Vec<usize>, Vec<(usize, f64)>> = BTreeMap::new();
        for point in 0..grid.n_points() {
            let mut indices = grid.indices(point);
            let value = axis.values[indices.remove(own)].number.unwrap_or(f64::NAN);
            places.entry(indices).or_default().push((point, value));
        }
        let spot = |(indices, points): (Vec<usize>, Vec<(usize, f64)>)| {
            let others = axes.iter().enumerate().filter(|(k, _)| *k != own).zip(indices);
            let others: Vec<(String, toml::Value)> = others.map(|((_, (s, l)), i)| (s.parameter.clone(), l[i].clone())).collect();
            let text = others.iter().map(|(p, v)| format!("{p} = {}", super::axes::shown(v))).collect::<Vec<_>>().join(", ");
            Spot { points, text, others }
        };
        let places = places.into_iter().map(spot).collect();
        let form = if whole || matches!(q.from, toml::Value::String(_)) { q.from } else { toml::Value::Float(from) };
        Ok(Self { question, parameter: q.parameter, unit: ends.unit, form, places })
    }

    /// Where a trial of the question is, for messages.
    fn at(&self, place: usize, value: &str) -> String {
        let own = format!("{} = {value}{}", self.parameter, self.unit);
        if self.places[place].text.is_empty() { own } else { format!("{}, {own}", self.places[place].text) }
    }
}

/// Run the trials that the question needs beside those of the grid, which are done, and answer it at every place.
///
/// # Errors
/// A trial that fails or cannot be made, or an error of the file system.
pub(super) fn answer(plan: &mut Plan, trials: &mut Trials<'_>, context: &Context) -> Result<Vec<Answers>> {
    let Some(asked) = plan.asked.take() else { return Ok(Vec::new()) };
    let found = search(&asked, plan, trials, context);
    plan.asked = Some(asked);
    found
}

/// A trial that a search wants: place, index of the seed, value.
type Wanted = BTreeMap<(usize, String), (f64, BTreeSet<usize>)>;

fn search(asked: &Asked, plan: &mut Plan, trials: &mut Trials<'_>, context: &Context) -> Result<Vec<Answers>> {
    let (n, question) = (plan.study.seeds.len(), &asked.question);
    let stages: &[bool] = if plan.has_after() { &[false, true] } else { &[false] };
    let mut searches: Vec<Vec<Search<'_>>> =
        asked.places.iter().map(|_| stages.iter().map(|after| Search::new(question, n, *after)).collect()).collect();
    let mut wanted = Wanted::new();
    for (p, place) in asked.places.iter().enumerate() {
        for (point, value) in place.points.iter().filter(|(_, v)| (question.from..=question.to).contains(v)) {
            for seed in 0..n {
                if let Some(r) = trials.done.get(&Key::Grid(point * n + seed)) {
                    searches[p].iter_mut().for_each(|s| s.add(seed, *value, r));
                }
            }
        }
        for end in [question.from, question.to].into_iter().filter(|e| !place.points.iter().any(|(_, v)| v == e)) {
            wanted.insert((p, end.to_string()), (end, (0..n).collect()));
        }
    }
    // Each round is run completely before the next is planned, so that the values do not depend on the order in which trials finish.
    for round in 1.. {
        run_round(asked, plan, trials, &wanted, context)?;
        for ((p, text), (value, seeds)) in &wanted {
            for seed in seeds {
                let key = Key::Asked { place: *p, value: text.clone(), seed: *seed };
                if let Some(r) = trials.done.get(&key) {
                    searches[*p].iter_mut().for_each(|s| s.add(*seed, *value, r));
                }
            }
        }
        wanted.clear();
        for (p, stages) in searches.iter().enumerate() {
            for (seed, value) in stages.iter().flat_map(Search::next) {
                wanted.entry((p, value.to_string())).or_insert_with(|| (value, BTreeSet::new())).1.insert(seed);
            }
        }
        if wanted.is_empty() {
            break;
        }
        let count: usize = wanted.values().map(|w| w.1.len()).sum();
        context.console.note(&format!("question: round {round}, {count} trials at {} values", wanted.len()));
    }
    let answers = |s: &Vec<Search<'_>>| Answers { before: s[0].answer(), after: s.get(1).map(Search::answer) };
    Ok(searches.iter().map(answers).collect())
}

/// Run the wanted trials that are not done.
fn run_round(asked: &Asked, plan: &mut Plan, trials: &mut Trials<'_>, wanted: &Wanted, context: &Context) -> Result<()> {
    let key = |place: usize, text: &str, seed: usize| Key::Asked { place, value: text.to_owned(), seed };
    let mut setups: Vec<(usize, &str, &BTreeSet<usize>, Setup)> = Vec::new();
    for ((place, text), (value, seeds)) in wanted {
        if seeds.iter().all(|s| trials.done.contains_key(&key(*place, text, *s))) {
            continue;
        }
        let spot = &asked.places[*place];
        let own = (asked.parameter.as_str(), like(&asked.form, *value, &asked.unit));
        let changes: Vec<_> = spot.others.iter().map(|(p, v)| (p.as_str(), v.clone())).chain([own]).collect();
        let setup = plan.setups.make_once(&changes, context).context(format!("at {}", asked.at(*place, text)))?;
        setups.push((*place, text, seeds, setup));
    }
    let study = &plan.study;
    let mut jobs: Vec<Job<'_>> = Vec::new();
    for (place, text, seeds, setup) in &setups {
        jobs.extend(seeds.iter().map(|s| Job { key: key(*place, text, *s), setup, seed: study.seeds[*s] }));
    }
    trials.run(&jobs, &|key| match key {
        Key::Asked { place, value, .. } => asked.at(*place, value),
        Key::Grid(_) | Key::Without { .. } => String::new(),
    })
}
