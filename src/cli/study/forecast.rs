//! `study --dry-run`: what the trials would take, from two that are run.

use super::args::StudyArgs;
use super::{plan, slurm};
use crate::cli::failure::{Context as _, Failure, Result, ensure};
use crate::cli::forecast::{Plan, Planner, Told};
use crate::cli::slurm::Pilot;
use crate::cost;
use serde_json::{Map, Value};
use std::path::Path;
use std::time::Instant;

impl Plan for StudyArgs {
    fn plan(&self, planner: &Planner<'_>) -> Result<Told> {
        ensure!(planner.args.visibilities()?.is_none(), Failure::usage("--visibilities: the trials of a study simulate their own"));
        // The short tests of this machine have held more than a trial may.
        Pilot::forget_memory();
        let begun = Instant::now();
        let (path, text) = self.of.read()?;
        let plan = plan::Plan::new(&text, path, planner.context).context(format!("{}", path.display()))?;
        let (points, seeds) = (plan.study.setups.len(), plan.study.seeds.len());
        let trials = plan.study.n_trials() + plan.failing.as_ref().map_or(0, |f| f.n() * seeds);
        let of_shard = self.shard.map_or(trials, |shard| (0..trials).filter(|k| shard.has(*k)).count());
        let pilot = slurm::measured(&plan, begun, planner.context)?;
        let mut facts = Map::new();
        let mut say = |name: &str, value: Value| facts.insert(name.to_owned(), value);
        say("points", points.into());
        say("seeds", seeds.into());
        say("trials", of_shard.into());
        say("trial_s", pilot.trial_s.into());
        let work = cost::Trials {
            count: of_shard.div_ceil(planner.ranks),
            setup_s: pilot.setup_s,
            trial_s: pilot.trial_s,
            memory: (pilot.before_bytes as f64, pilot.peak_bytes as f64),
            threads: planner.threads,
            base_bytes: planner.speeds.base_bytes(),
        };
        let mut forecast = cost::study(work);
        forecast
            .assumptions
            .push("all trials take the time of the slower of two, the first of the first and of the last point, on this machine".into());
        if plan.asked.is_some() {
            forecast
                .assumptions
                .push("the trials that the question needs are not counted: they follow from the results of the others".into());
        }
        Ok(Told { command: "study", forecast, facts })
    }

    fn output(&self) -> &Path {
        self.of.folder().unwrap_or(Path::new("."))
    }
}
