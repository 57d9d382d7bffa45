//! Reads the file of a study and prepares its points.

use super::axes::{axes, shown};
use super::config::{AxisSection, Config, QuestionSection};
use super::failing::Failing;
use super::question::Asked;
use super::setups::Setups;
use crate::cli::context::Context;
use crate::cli::failure::{Context as _, Failure, Result};
use crate::cli::quality::{self, Limits};
use crate::study::{Axis, Grid, Study};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;

/// A study ready to run.
pub(super) struct Plan {
    pub title: String,
    pub study: Study,
    /// Configuration, input files and version. Two studies with the same fingerprint are the same.
    pub fingerprint: String,
    /// Unit of residual images.
    pub unit: &'static str,
    /// The question.
    pub asked: Option<Asked>,
    /// The antennas that fail in turn.
    pub failing: Option<Failing>,
    /// What metrics.json must reach.
    pub quality: BTreeMap<String, Limits>,
    /// Makes more trials.
    pub setups: Setups,
}

impl Plan {
    /// Read the file, insert the values of the axes, and make the observations that trials share.
    ///
    /// # Errors
    /// The file is wrong (the message names the line or the values of the axes), or a layout or a scene cannot be read.
    pub(super) fn new(text: &str, path: &Path, context: &Context) -> Result<Self> {
        let table: toml::Table = crate::cli::numbers::read(text, path)?;
        let of_file = toml::from_str::<Parts>(text)?;
        let axes = axes(of_file.axis, of_file.question.as_ref())?;
        let of_texts = axes.iter().map(|(s, l)| Ok(Axis::new(&s.parameter, &l.iter().map(shown).collect::<Vec<_>>())?));
        let grid = Grid::new(of_texts.collect::<Result<_>>()?)?;
        let mut maker = Setups::new(table, path.parent().unwrap_or(Path::new("")))?;
        let first = axes.iter().filter_map(|(s, list)| Some((s.parameter.as_str(), list.first()?.clone())));
        maker.check_replaced(&first.collect::<Vec<_>>())?;
        let (mut setups, mut head) = (Vec::new(), None);
        for point in 0..grid.n_points() {
            let changes = axes.iter().zip(grid.indices(point)).map(|((s, list), k)| (s.parameter.as_str(), list[k].clone()));
            match maker.make(&changes.collect::<Vec<_>>(), context) {
                Ok((setup, config)) => {
                    setups.push(setup);
                    head.get_or_insert(config);
                }
                Err(e) => {
                    // The error of the file itself names the line. A value of an axis has no line.
                    toml::from_str::<Config>(text)?;
                    return if grid.axes.is_empty() { Err(e) } else { Err(e).context(format!("at {}", grid.place(point))) };
                }
            }
        }
        let Some(head) = head else { return Err(Failure::message("the study has no point")) };
        if head.seeds == 0 || head.seeds.saturating_mul(setups.len()) > 100_000_000 {
            return Err(Failure::message(format!("seeds is {}, expected at least 1 and at most 100 million trials in all", head.seeds)));
        }
        quality::check(&head.quality).map_err(Failure::message)?;
        let asked = of_file.question.map(|q| Asked::new(q, &grid, head.seeds, &axes)).transpose().context("question")?;
        let failing = head.failures.as_ref().map(|f| Failing::new(f, &setups)).transpose().context("failures")?;
        if asked.is_some() && failing.is_some() {
            return Err(Failure::message("a study has a [question] or [failures], not both: give them in two files"));
        }
        let seeds = (0..head.seeds as u64).map(|k| head.seed.wrapping_add(k)).collect();
        let fingerprint = format!("{} {} {}", env!("CARGO_PKG_VERSION"), maker.text()?, maker.hashes());
        let (unit, study) = (maker.unit(), Study { grid, setups, seeds });
        Ok(Self { title: head.title, study, fingerprint, unit, asked, failing, quality: head.quality, setups: maker })
    }

    /// True if trials are self-calibrated.
    pub(super) fn has_after(&self) -> bool {
        self.study.setups.iter().any(|s| s.selfcal.is_some())
    }
}

/// The parts of the file that say which points the study has.
#[derive(Deserialize)]
struct Parts {
    #[serde(default)]
    axis: Vec<AxisSection>,
    question: Option<QuestionSection>,
}
