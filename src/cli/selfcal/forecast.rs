//! `selfcal --dry-run`: what the rounds would take.

use super::super::clean::work_of;
use super::super::verdict;
use super::{BYTES_PER_SAMPLE, SelfcalArgs, candidate_options, check_solve, pilot};
use crate::calibrate::{CandidateOptions, SelfcalTuning, SolutionInterval, StartFrom, candidates, schedule};
use crate::cli::failure::{Failure, Result, ensure};
use crate::cli::forecast::{Plan, Planner, Told, facts, format_of};
use crate::cli::options::no_range;
use crate::cost::{self, CalibrationWork, CleanWork, Forecast, InputFormat};
use crate::deconvolve::{Algorithm, EXTENDED};
use crate::fourier::GridOptions;
use crate::imaging::{Field, Outlook, RowSample};
use crate::memory::MemoryBudget;
use cittert_arrays::VisibilitySource;
use std::path::Path;

impl Plan for SelfcalArgs {
    fn plan(&self, planner: &Planner<'_>) -> Result<Told> {
        self.clean.check()?;
        self.rounds.check().map_err(Failure::call)?;
        no_range(&self.imaging, "self-calibration images by Fourier transforms")?;
        ensure!(
            !self.pointing.pointing,
            Failure::unforeseen(
                "--dry-run: no forecast of --pointing, whose steps depend on where the antennas point. Leave it out to see what the rounds take"
            )
        );
        let input = self.input.files()?;
        let mut source = input.open(planner.context)?;
        check_solve(self, source.as_ref())?;
        let looked = planner.outlook(source.as_mut(), &self.imaging)?;
        let of = candidate_options(self, (self.imaging.on_grid(&looked.0.grid), self.solve.clone()), (&looked.0.grid, source.header()))?;
        let names: Vec<&str> = candidates(&of)?.iter().map(|way| way.name).collect();
        let Some((&name, others)) = names.split_first() else { return Err(Failure::message("no way to self-calibrate")) };
        let (outlook, sample) = &looked;
        let format = format_of(&input, planner.context)?;
        let made = input.all().iter().all(|file| planner.context.ahead.get(file).is_none());
        let untried = || format!("{name} explains the held-out baselines, so that the other ways ({}) are not tried", others.join(", "));
        if name == Algorithm::Mem.name() {
            let mut forecast = self.together(&of, (source.as_mut(), format, made), &looked, planner)?;
            forecast.assumptions.extend((!others.is_empty()).then(untried));
            let one = work_of(&self.clean, EXTENDED, outlook);
            self.after(&mut forecast, source.as_mut(), (&looked, &one), format, planner)?;
            return Ok(Told { command: "selfcal", forecast, facts: facts(outlook) });
        }
        let (g, header) = (&outlook.grid, source.header());
        let plans = schedule(self.solve.mode, self.solve.solint, self.rounds.rounds, self.rounds.shrink);
        let deep = plans.iter().filter(|p| p.last).count();
        let field = |epsilon: f64, n_vis: Option<u64>| {
            let options = GridOptions { epsilon, ..self.imaging.grid_options() };
            let freq_hz = header.spectrum.freq_hz();
            let of_output = &freq_hz[..freq_hz.len().div_ceil(outlook.channels_out.max(1))];
            let field = sample.field_for(g, of_output, outlook.extent, (&options, n_vis))?;
            Ok::<_, crate::ChainError>(Field { pass: field.pass.shared(planner.ranks), ..field })
        };
        let short_epsilon = SelfcalTuning::default().epsilon_of_short_rounds(&self.imaging.grid_options());
        let values = outlook.visibilities() * outlook.shape.2 as f64;
        let judged = verdict::transform(header, &looked, &self.imaging, false)?;
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
        let mut forecast = cost::selfcal(outlook, (format, planner.threads), &work, &planner.speeds);
        forecast.assumptions.extend((!others.is_empty()).then(untried));
        self.after(&mut forecast, source.as_mut(), (&looked, &clean), format, planner)?;
        Ok(Told { command: "selfcal", forecast, facts: facts(outlook) })
    }

    fn output(&self) -> &Path {
        &self.out.output
    }
}

impl SelfcalArgs {
    /// The forecast of a joint solution of image and gains.
    fn together(
        &self,
        of: &CandidateOptions,
        (source, format, made): (&mut dyn VisibilitySource, InputFormat, bool),
        looked: &(Outlook, RowSample),
        planner: &Planner<'_>,
    ) -> Result<Forecast> {
        let (outlook, _) = looked;
        let header = source.header();
        let behind = !header.layout.pattern.is_none();
        let known = self.prior.is_some() || header.antenna_temperature_k.is_some() || outlook.used < 1.0;
        ensure!(
            !(behind && known),
            Failure::unforeseen(
                "--dry-run: no forecast of a joint solution of a smooth scene behind the pattern of the elements, whose steps are of another kind. --deconvolver multiscale has one"
            )
        );
        let judged = verdict::transform(header, looked, &self.imaging, false)?;
        let times = pilot::begun(source, (&self.imaging, &outlook.grid), &of.joint, (outlook.shape.0 as f64, made))?;
        Ok(cost::joint(outlook, (format, planner.threads), &times, (self.rounds.hold_out > 0.0, judged.as_ref())))
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
