//! The trials that answer the question of a study, and its answers.

use super::journal::Key;
use super::plan::Plan;
use super::question::Asked;
use super::trials::{Job, Trials};
use crate::cli::context::Context;
use crate::cli::failure::{Context as _, Result};
use crate::study::{Answer, Search, Setup};
use std::collections::{BTreeMap, BTreeSet};

/// The answers at one place.
pub(super) struct Answers {
    pub(super) before: Answer,
    pub(super) after: Option<Answer>,
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
    trials.share()?;
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
        trials.share()?;
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
        let setup = plan.setups.make_once(&asked.changes(*place, *value), context).context(format!("at {}", asked.at(*place, text)))?;
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
