//! The trials of failed antennas, and what each failure costs.

use super::journal::Key;
use super::plan::Plan;
use super::trials::{Job, Trials};
use crate::cli::failure::Result;
use crate::study::{AntennaCost, Quality, Setup, TrialResult, rank, summarize};

/// The ranking at one point.
pub(super) struct Ranking {
    /// Median score with all antennas.
    pub(super) whole: f64,
    /// The antennas, the costliest first. Indices are those of `Failing::antennas`.
    pub(super) costs: Vec<AntennaCost>,
}

/// Run the trials without each antenna.
///
/// # Errors
/// A trial that fails, or an error of the file system.
pub(super) fn fail(plan: &Plan, trials: &mut Trials<'_>) -> Result<()> {
    let Some(failing) = &plan.failing else { return Ok(()) };
    let study = &plan.study;
    let mut setups: Vec<(usize, usize, Setup)> = Vec::new();
    for (point, antennas) in failing.antennas.iter().enumerate() {
        let one = |(k, _): &(usize, String)| (point, *k, Setup { silent: Some(*k), ..study.setups[point].clone() });
        setups.extend(antennas.iter().map(one));
    }
    let jobs = |(point, antenna, setup)| {
        let key = move |seed| Key::Without { point, antenna, seed };
        study.seeds.iter().enumerate().map(move |(k, seed)| Job { key: key(k), setup, seed: *seed })
    };
    let jobs: Vec<Job<'_>> = setups.iter().flat_map(|(p, a, s)| jobs((*p, *a, s))).collect();
    let place = |key: &Key| match key {
        Key::Without { point, antenna, .. } => {
            let name = &study.setups[*point].base.set.header.layout.antennas()[*antenna].name;
            let place = study.grid.place(*point);
            if place.is_empty() { format!("antenna {name} silent") } else { format!("{place}, antenna {name} silent") }
        }
        Key::Grid(_) | Key::Asked { .. } => String::new(),
    };
    trials.run(&jobs, &place)
}

/// The keys of the trials without each antenna, in the order in which shards share them out.
pub(super) fn keys(plan: &Plan) -> Vec<Key> {
    let Some(failing) = &plan.failing else { return Vec::new() };
    let seeds = 0..plan.study.seeds.len();
    let of_point = |(point, antennas): (usize, &Vec<(usize, String)>)| {
        let keys = antennas.iter().flat_map(|(antenna, _)| seeds.clone().map(move |seed| Key::Without { point, antenna: *antenna, seed }));
        keys.collect::<Vec<_>>()
    };
    failing.antennas.iter().enumerate().flat_map(of_point).collect()
}

/// The rankings \[point\] of finished trials, for images before or after self-calibration.
pub(super) fn rankings(plan: &Plan, trials: &Trials<'_>, after: bool) -> Vec<Ranking> {
    let Some(failing) = &plan.failing else { return Vec::new() };
    let n = plan.study.seeds.len();
    let pick = |r: &TrialResult| if after { r.after } else { Some(r.before) };
    let of = |key: Key| trials.done.get(&key).and_then(pick);
    let one = |(point, antennas): (usize, &Vec<(usize, String)>)| {
        let whole: Vec<Option<Quality>> = (0..n).map(|s| of(Key::Grid(point * n + s))).collect();
        let without = |a: &(usize, String)| (0..n).map(|seed| of(Key::Without { point, antenna: a.0, seed })).collect();
        let without: Vec<Vec<Option<Quality>>> = antennas.iter().map(without).collect();
        let scores = whole.iter().flatten().map(|q| q.of(failing.score));
        Ranking { whole: summarize(scores).median, costs: rank(failing.score, &whole, &without) }
    };
    failing.antennas.iter().enumerate().map(one).collect()
}
