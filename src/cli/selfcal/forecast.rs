//! `selfcal --dry-run`: what the rounds would take.

use super::super::clean::work_of;
use super::super::verdict;
use super::{BYTES_PER_SAMPLE, SelfcalArgs, check_solve};
use crate::calibrate::{SelfcalTuning, SolutionInterval, StartFrom, schedule};
use crate::cli::failure::{Failure, Result, ensure};
use crate::cli::forecast::{Plan, Planner, Told, facts, format_of};
use crate::cli::options::no_range;
use crate::cost::{self, CalibrationWork, CleanWork};
use crate::deconvolve::{Algorithm, EXTENDED, by_name};
use crate::fourier::GridOptions;
use crate::imaging::{Field, Outlook};
use crate::memory::MemoryBudget;
use cittert_arrays::{VisUnit, VisibilitySource};
use std::path::Path;

impl Plan for SelfcalArgs {
    fn plan(&self, planner: &Planner<'_>) -> Result<Told> {
        self.clean.check()?;
        self.rounds.check().map_err(Failure::call)?;
        no_range(&self.imaging, "self-calibration images by Fourier transforms")?;
        let extra = self.feed_terms.is_empty() && !self.pointing.pointing;
        ensure!(extra, Failure::unforeseen("--dry-run: no forecast of --solve and --pointing. Leave them out to see what the rounds take"));
        let input = self.input.files()?;
        let mut source = input.open(planner.context)?;
        check_solve(self, source.as_ref())?;
        let (name, others) = self.first_way(source.header().unit)?;
        let looked = planner.outlook(source.as_mut(), &self.imaging)?;
        let (outlook, sample) = &looked;
        let (g, header) = (&outlook.grid, source.header());
        let alone = planner.ranks == 1;
        let plans = schedule(self.solve.mode, self.solve.solint, self.rounds.rounds, self.rounds.shrink);
        let deep = plans.iter().filter(|p| p.last).count();
        let field = |epsilon: f64, n_vis: Option<u64>| {
            let options = GridOptions { epsilon, ..self.imaging.grid_options() };
            let freq_hz = header.spectrum.freq_hz();
            let of_output = &freq_hz[..freq_hz.len().div_ceil(outlook.channels_out.max(1))];
            let field = sample.field_for(g, of_output, outlook.extent, (&options, n_vis))?;
            Ok::<_, crate::ChainError>(Field { pass: field.pass.shared(planner.ranks), ..field })
        };
        let short_epsilon = self.imaging.epsilon.max(SelfcalTuning::default().short_epsilon);
        let values = outlook.visibilities() * outlook.shape.2 as f64;
        let judged = if alone { verdict::transform(header, &looked, &self.imaging, false)? } else { None };
        let clean = CleanWork { judged, ..work_of(&self.clean, name, outlook) };
        let work = CalibrationWork {
            clean,
            rounds: ((plans.len() - deep) as f64, deep as f64),
            held_out: self.rounds.hold_out > 0.0,
            from_image: self.rounds.model.is_none() && self.rounds.start == StartFrom::Data,
            short: field(short_epsilon, Some(outlook.visibilities() as u64))?,
            predictor: field(self.imaging.epsilon, None)?,
            solved: solved(self.solve.solint, source.as_mut(), outlook)?,
            stays: values * BYTES_PER_SAMPLE as f64 <= MemoryBudget::default().kept_visibilities() as f64,
        };
        let mut forecast = cost::selfcal(outlook, (format_of(&input, planner.context)?, planner.threads), &work, &planner.speeds);
        if !others.is_empty() {
            let text = format!("{name} explains the held-out baselines, so that the other ways ({}) are not tried", others.join(", "));
            forecast.assumptions.push(text);
        }
        Ok(Told { command: "selfcal", forecast, facts: facts(outlook) })
    }

    fn output(&self) -> &Path {
        &self.out.output
    }
}

impl SelfcalArgs {
    /// The deconvolver that is tried first, and those that are tried where it is not good enough.
    fn first_way(&self, unit: VisUnit) -> Result<(&'static str, Vec<&'static str>)> {
        match self.clean.algorithm {
            Algorithm::Clean(entry) => Ok((entry.name, Vec::new())),
            Algorithm::Auto if unit != VisUnit::KelvinSr => Ok((by_name("hogbom")?.name, vec![EXTENDED, Algorithm::Mem.name()])),
            Algorithm::Auto | Algorithm::Mem => Err(Failure::unforeseen(
                "--dry-run: no forecast of a joint solution of image and gains, which comes first here. --deconvolver multiscale has one",
            )),
        }
    }
}

/// The gain solutions of a round, each counted once for each of its baselines: a row counts once for each interval that it begins.
fn solved(solint: SolutionInterval, source: &mut dyn VisibilitySource, outlook: &Outlook) -> Result<f64> {
    let rows = outlook.shape.0 as f64;
    let integration_s = source.read_coverage(0..1)?.integration_s.first().copied().unwrap_or(0.0);
    Ok(match solint {
        SolutionInterval::Infinite => 0.0,
        SolutionInterval::Integration => rows,
        SolutionInterval::Seconds(s) => rows * (integration_s / s).min(1.0),
    })
}
