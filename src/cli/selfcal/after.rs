//! The forecast of what follows the gains: the terms between the feeds.

use super::SelfcalArgs;
use crate::calibrate::{FeedTerm, ModelVisibilities, PointModel, SelfcalTuning, solve_leakages};
use crate::cli::failure::Result;
use crate::cli::forecast::{Planner, measured};
use crate::cost::{self, BetweenWork, CleanWork, Forecast, InputFormat};
use crate::fourier::GridOptions;
use crate::imaging::{Outlook, RowSample};
use crate::progress::Silent;
use cittert_arrays::{VisibilitySet, VisibilitySource};

/// Rows on which a step of the leakages is timed.
const TIMED_ROWS: usize = 4096;

impl SelfcalArgs {
    /// Add the stages after the gains.
    ///
    /// # Errors
    /// Several processes, or a set without the products of two feeds.
    pub(super) fn after(
        &self,
        forecast: &mut Forecast,
        source: &mut dyn VisibilitySource,
        (looked, clean): (&(Outlook, RowSample), &CleanWork),
        format: InputFormat,
        planner: &Planner<'_>,
    ) -> Result<()> {
        let always = forecast.stages.iter().map(|s| s.bytes).fold(0.0, f64::max);
        if !self.feed_terms.is_empty() {
            planner.alone("solves terms between the feeds")?;
            let (outlook, sample) = looked;
            let asked = self.imaging.grid_options();
            let options = GridOptions { epsilon: SelfcalTuning::default().epsilon_of_short_rounds(&asked), ..asked };
            let predictor = sample.field_for(&outlook.grid, source.header().spectrum.freq_hz(), outlook.extent, (&options, None))?;
            let sample_s = sample_s(source)?;
            let work = BetweenWork { imaged: self.rounds.model.is_none(), predictor, sample_s, always };
            forecast.stages.extend(cost::between(outlook, (format, planner.threads), (&work, clean), &planner.speeds));
            forecast.assumptions.push(cost::settled());
        }
        Ok(())
    }
}

/// Time of a step of the leakages for one sample of the products of two feeds, s: of a point that the data hold exactly.
///
/// # Errors
/// Rows that cannot be read, or a set without the four products of two feeds.
fn sample_s(source: &mut dyn VisibilitySource) -> Result<f64> {
    let header = source.header().clone();
    let mut data = source.read_rows(0..TIMED_ROWS.min(source.n_rows()))?;
    let mut point = PointModel { flux: 1.0, l: 0.0, m: 0.0 };
    data.vis.assign(&point.predict(&header, 0, &data.coverage)?);
    data.flags.fill(false);
    data.weights.fill(1.0);
    let samples = data.n_rows() * header.spectrum.n_chan();
    let mut set = VisibilitySet::new(header, data)?;
    let done = measured(|| Ok(solve_leakages(&mut set, &mut point, &[FeedTerm::Leakage], &Silent)?))?;
    Ok(done.seconds / (done.result.iterations * samples).max(1) as f64)
}
