//! What a joint solution of image and gains takes, from a few of its evaluations on some rows of the set.
//!
//! An evaluation is two transforms, the gains that fit the model, and steps over all pixels. No table describes the gains, whose number of iterations depends on the
//! data. So the solution is begun with two lengths of its last part: the difference of their times is that of their evaluations. A part of the rows gives the time
//! of a pixel and that of a visibility.

use crate::calibrate::{
    GainMode, ImageMaker, JointGoals, JointMaker, JointOptions, JointSchedule, ModelMaker, RoundPlan, SolutionInterval,
};
use crate::cli::failure::Result;
use crate::cli::forecast::measured;
use crate::cost::JointTimes;
use crate::imaging::ImagingOptions;
use crate::progress::Silent;
use cittert_arrays::{SPEED_OF_LIGHT_M_S, SkyGrid, VisibilityBlock, VisibilitySet, VisibilitySource};
use num_complex::Complex;
use std::f64::consts::PI;

/// Values of the rows that are taken, at most, and the part of them that is taken first.
const MOST_VALUES: usize = 1 << 18;
const FIRST_PART: usize = 3;
/// Evaluations of the last part of the solution.
const EVALUATIONS: [usize; 2] = [3, 15];
/// Width of the round source that stands for a set that is not made yet, as a part of the field, and its signal to noise ratio in a visibility.
const SOURCE: f64 = 0.125;
const SIGNAL: f32 = 100.0;

/// Some rows, and what one evaluation takes of them.
struct Part {
    rows: f64,
    times: JointTimes,
}

/// Begin a joint solution of some rows of a set. `made` is false where the set is only promised, and has no visibilities yet.
///
/// # Errors
/// Rows that cannot be read, or that allow no solution.
pub(super) fn begun(
    source: &mut dyn VisibilitySource,
    (imaging, grid): (&ImagingOptions, &SkyGrid),
    options: &JointOptions,
    (rows, made): (f64, bool),
) -> Result<JointTimes> {
    let header = source.header().clone();
    let n_ant = header.layout.n_ant().max(2);
    let of_row = (header.spectrum.n_chan() * header.polarizations.len()).max(1);
    // Whole integrations, so that all antennas have gains.
    let integration = n_ant * (n_ant - 1) / 2;
    let whole = |n: usize| (n / integration * integration).max(integration).min(source.n_rows());
    let most = if source.n_rows() * of_row <= MOST_VALUES { source.n_rows() } else { whole(MOST_VALUES / of_row) };
    // One of several processes has fewer rows.
    let most = if rows < most as f64 { whole(rows as usize) } else { most };
    let least = if rows > most as f64 { whole(most / FIRST_PART) } else { most };
    let large = part(source, most, (imaging, grid), options, made)?;
    if least == most {
        return Ok(large.times.scaled(rows / large.rows));
    }
    let small = part(source, least, (imaging, grid), options, made)?;
    Ok(small.times.grown(&large.times, (rows - small.rows) / (large.rows - small.rows)))
}

/// What the first rows take.
fn part(
    source: &mut dyn VisibilitySource,
    rows: usize,
    (imaging, grid): (&ImagingOptions, &SkyGrid),
    options: &JointOptions,
    made: bool,
) -> Result<Part> {
    let mut data = source.read_rows(0..rows)?;
    let header = source.header().clone();
    if !made {
        stand_in(&mut data, header.spectrum.mean_hz(), SOURCE * grid.n_l.min(grid.n_m) as f64 * grid.cell_rad);
    }
    let mut set = VisibilitySet::new(header, data)?;
    let mut found = Vec::new();
    for evaluations in EVALUATIONS {
        let mut tuning = JointSchedule { priors: 0, expectations: 1, final_evaluations: evaluations, ..JointSchedule::default() };
        (tuning.near_enough, tuning.near_rms) = (f64::INFINITY, f64::INFINITY);
        tuning.stages.iter_mut().for_each(|stage| stage.steps = 1);
        let goals = JointGoals { tuning, ..options.goals };
        let mut maker = JointMaker::new(imaging.on_grid(grid), JointOptions { goals, ..options.clone() });
        let plan = RoundPlan { mode: GainMode::Phase, solint: SolutionInterval::Infinite, depth: 0.0, last: true };
        let done = measured(|| Ok(maker.update(&mut set, &plan, &Silent)?))?;
        let made: usize = maker.solution().map_or(0, |joint| joint.stages.iter().map(|s| s.evaluations).sum());
        found.push((made as f64, done));
    }
    let [few, many] = &found[..] else { return Ok(Part { rows: rows as f64, times: JointTimes::default() }) };
    let more = many.0 - few.0;
    let evaluation_s = if more > 0.0 { (many.1.seconds - few.1.seconds).max(0.0) / more } else { many.1.seconds / many.0.max(1.0) };
    let begin_s = (few.1.seconds - few.0 * evaluation_s).max(0.0);
    Ok(Part { rows: rows as f64, times: JointTimes { begin_s, evaluation_s, held_bytes: few.1.held_bytes.max(many.1.held_bytes) } })
}

/// A round source in place of the visibilities that a set does not have yet.
fn stand_in(data: &mut VisibilityBlock, freq_hz: f64, width_rad: f64) {
    let uvw = &data.coverage.uvw_m;
    for ((row, _, _), v) in data.vis.indexed_iter_mut() {
        let wavelengths = uvw[(row, 0)].hypot(uvw[(row, 1)]) * freq_hz / SPEED_OF_LIGHT_M_S;
        *v = Complex::new((-0.5 * (PI * wavelengths * width_rad).powi(2)).exp() as f32, 0.0);
    }
    data.weights.fill(SIGNAL * SIGNAL);
}
