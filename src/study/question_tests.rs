//! Answers to questions agree with laws that are known in closed form.

use super::law_tests::{base, phase};
use super::*;

/// Ask a question whose trials are given by a function of value and seed.
fn ask(question: &Question, seeds: u64, first: u64, trial: &dyn Fn(f64, u64) -> TrialResult) -> (Answer, usize) {
    let mut search = Search::new(question, seeds as usize, false);
    let mut next: Vec<(usize, f64)> = Vec::new();
    for k in 0..=4 {
        let t = f64::from(k) / 4.0;
        let value = if question.log {
            question.from * (question.to / question.from).powf(t)
        } else {
            question.from + t * (question.to - question.from)
        };
        next.extend((0..seeds as usize).map(|s| (s, value)));
    }
    let mut trials = 0;
    while !next.is_empty() {
        for (seed, value) in std::mem::take(&mut next) {
            search.add(seed, value, &trial(value, first + seed as u64));
            trials += 1;
        }
        next = search.next();
    }
    (search.answer(), trials)
}

fn question(score: Score, limit: f64, at_least: bool, (from, to): (f64, f64)) -> Question {
    let bound = Bound { score, limit, at_least };
    Question { bound, from, to, whole: false, log: true, fraction: 0.5, precision: 0.1 }
}

/// A trial that has only one score.
fn only(score: Score, value: f64) -> TrialResult {
    let values = Score::ALL.map(|s| if s == score { value } else { f64::NAN });
    TrialResult { before: Quality::from_values(values), after: None, accepted: None, rounds: 0, note: String::new() }
}

fn within(answer: &Answer, truth: f64) -> bool {
    let limit = |p: Option<Place>| p.and_then(Place::number).unwrap();
    (limit(answer.limit.low)..limit(answer.limit.high)).contains(&truth)
}

#[test]
fn the_limits_hold_the_law_of_phase_errors_in_two_of_three_studies() {
    // N antennas with phases of variance s^2 put the power 2 N s^2 X / (N (N - 1))^2 into the image, where X has a chi squared distribution
    // with N - 1 degrees of freedom, so D = (N - 1) sqrt(N / (2 X)) / s. The median of X is k (1 - 2 / (9 k))^3 (Wilson & Hilferty 1931,
    // PNAS 17, 684). 40 studies: 27 +- 3 hold the truth.
    let (n, least, k) = (12.0_f64, 100.0, 11.0_f64);
    let truth = (n - 1.0) * (n / (2.0 * k * (1.0 - 2.0 / (9.0 * k)).powi(3))).sqrt() / least;
    let base = base(12, 48);
    let setup = |rms| Setup { base: base.clone(), antennas: Antennas::All, errors: vec![phase(rms)], selfcal: None, silent: None };
    let question = question(Score::OffSourceDynamicRange, least, true, (0.01, 1.0));
    let answers: Vec<Answer> =
        (0..40).map(|study| ask(&question, 9, 100 * study, &|rms, seed| trial(&setup(rms), seed).unwrap()).0).collect();
    let held = answers.iter().filter(|a| within(a, truth)).count();
    assert!((22..=32).contains(&held), "{held} of 40 hold {truth}: {:?}", answers.iter().map(|a| a.limit).collect::<Vec<_>>());
    let mean = summarize(answers.iter().filter_map(|a| a.limit.value.number())).mean;
    assert!((mean / truth - 1.0).abs() < 0.05, "{mean} {truth}");
    assert!(answers.iter().all(|a| !a.rising && a.contradictions == 0.0));
}

/// Thresholds of the seeds are spread by a factor, around 4.
fn threshold(seed: u64) -> f64 {
    4.0 * (0.3 * (((seed * 7) % 20) as f64 - 9.5) / 9.5).exp()
}

#[test]
fn an_answer_costs_a_few_trials_of_each_seed() {
    let q = question(Score::Fidelity, 10.0, true, (1.0, 90.0));
    let (answer, trials) = ask(&q, 20, 0, &|x, seed| only(Score::Fidelity, 10.0 * threshold(seed) / x));
    assert!((answer.limit.value.number().unwrap() / 4.0 - 1.0).abs() < 0.03, "{answer:?}");
    assert!(within(&answer, 4.0) && answer.seeds_needed.is_none() && trials < 20 * 11, "{answer:?} {trials}");
    // Nine of ten trials keep the score up to a smaller value.
    let strict = Question { fraction: 0.9, ..q.clone() };
    let (most, _) = ask(&strict, 20, 0, &|x, seed| only(Score::Fidelity, 10.0 * threshold(seed) / x));
    assert!((most.limit.value.number().unwrap() / (4.0 * (-0.3_f64 * 0.8).exp()) - 1.0).abs() < 0.05, "{most:?}");
    // Four hundredths need more seeds: the limits fall with the square root of their number.
    let fine = Question { precision: 0.01, ..q };
    let needed = ask(&fine, 20, 0, &|x, seed| only(Score::Fidelity, 10.0 * threshold(seed) / x)).0.seeds_needed.unwrap();
    assert!((200..2000).contains(&needed), "{needed}");
}

#[test]
fn an_answer_outside_the_range_says_on_which_side() {
    let ask_at = |limit| ask(&question(Score::Nrmse, limit, false, (1.0, 20.0)), 5, 0, &|x, _| only(Score::Nrmse, x)).0.limit.value;
    assert_eq!((ask_at(0.5), ask_at(50.0)), (Place::Below, Place::Above));
}

#[test]
fn scores_that_grow_with_the_parameter_have_a_smallest_value() {
    let q = Question { whole: true, log: false, precision: 0.02, ..question(Score::DynamicRange, 300.0, true, (4.0, 64.0)) };
    let (answer, _) = ask(&q, 7, 0, &|x, _| only(Score::DynamicRange, 10.0 * x));
    assert_eq!((answer.rising, answer.limit.value), (true, Place::At(30.0)));
    let (all, _) = ask(&Question { bound: Bound { limit: 1.0, ..q.bound }, ..q }, 7, 0, &|x, _| only(Score::DynamicRange, 10.0 * x));
    assert_eq!((all.rising, all.limit.value), (false, Place::Above));
}

#[test]
fn a_score_that_comes_back_is_said() {
    let q = question(Score::Nrmse, 1.0, false, (1.0, 100.0));
    let (answer, _) = ask(&q, 10, 0, &|x, seed| only(Score::Nrmse, if x < 5.0 || (x > 30.0 && seed < 4) { 0.5 } else { 2.0 }));
    assert!((answer.contradictions - 0.4).abs() < 1e-12, "{answer:?}");
    assert!((answer.limit.value.number().unwrap() / 5.0 - 1.0).abs() < 0.06, "{answer:?}");
}

#[test]
fn numbers_out_of_range_are_refused() {
    let good = question(Score::Nrmse, 1.0, false, (1.0, 100.0));
    good.check().unwrap();
    for bad in [
        Question { from: 200.0, ..good.clone() },
        Question { from: 0.0, ..good.clone() },
        Question { fraction: 1.0, ..good.clone() },
        Question { precision: 0.0, ..good.clone() },
        Question { bound: Bound { limit: f64::NAN, ..good.bound }, ..good },
    ] {
        assert!(bad.check().is_err(), "{bad:?}");
    }
}
