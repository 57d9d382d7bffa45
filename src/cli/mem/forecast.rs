//! `mem --dry-run`: what an image of maximum entropy would take, with the number of evaluations that a rehearsal has shown.

use super::{MemCommandArgs, closure_forecast, imaged};
use crate::cli::context::Context;
use crate::cli::failure::Result;
use crate::cli::forecast::{Acts, Ended, Plan, Planner, Scratch, Told, Watch, facts, format_of, say_waves, waves_of_image};
use crate::cli::options::with_range;
use crate::cli::verdict;
use crate::cost::{self, Course, EntropyWork, WavePasses};
use crate::mem::{Uncertainty, chi2_of_nothing};
use cittert_arrays::VisibilitySource;

/// The stages that a rehearsal times.
const ACTS: Acts = Acts {
    before: &["read", "weights", "beam", "statistics", "beam of the data"],
    cycles: &["passes", "solver", "spherical waves"],
    after: &["residual", "restored image", "uncertainty", "last evaluation", "write"],
};

impl MemCommandArgs {
    /// Make the image and judge it, and throw it away.
    fn rehearse(&self, (source, what): (&mut dyn VisibilitySource, &str), watch: &Watch<'_>, context: &Context) -> Result<Ended> {
        let imaging = with_range(&self.imaging)?;
        let (products, ..) = imaged(self, (source, what), (&imaging, watch), |_| Ok(()))?;
        let sum = |f: fn(&crate::mem::Certificate) -> f64| products.certificates.iter().map(f).sum::<f64>();
        let counts = (sum(|c| c.evaluations as f64), sum(|c| c.convolutions as f64));
        if let Some(scratch) = Scratch::for_image(products.model.data.len()) {
            let images = [&products.model, &products.residual, &products.restored];
            images.into_iter().chain(&products.uncertainty).try_for_each(|image| scratch.image(image))?;
        }
        Ok(Ended { counts, verdict: verdict::timed(source, (products.model, &imaging), context)? })
    }
}

impl Plan for MemCommandArgs {
    fn plan(&self, planner: &Planner<'_>) -> Result<Told> {
        self.check_used()?;
        if self.terms.terms.is_some() {
            return closure_forecast::plan(self, planner);
        }
        let input = self.input.files()?;
        let mut source = input.open_chosen(&self.column, planner.context)?;
        let mut looked = planner.outlook(source.as_mut(), &self.imaging)?;
        let waves = waves_of_image(&self.imaging, source.header(), &mut looked.0, planner)?;
        let outlook = &looked.0;
        let work = EntropyWork {
            evaluations: self.mem.niter as f64,
            // A set that does not exist yet has no data.
            chi2_of_nothing: chi2_of_nothing(source.as_mut(), &self.mem).ok().flatten(),
            course: None,
            uncertainty: self.mem.uncertainty != Uncertainty::None,
            judged: verdict::transform(source.header(), &looked, &self.imaging, waves.is_some())?,
            twice: self.hold_out.is_made(source.as_ref(), &outlook.grid, &self.imaging),
        };
        let format = format_of(&input, planner.context)?;
        let forecast = |course: Option<Course>| {
            let work = EntropyWork { course, ..work };
            let plain = cost::entropy(outlook, (format, planner.threads), &work, &planner.speeds);
            match &waves {
                Some(waves) => waves.put_into(plain, outlook, &WavePasses::of_entropy(outlook, &work, &planner.speeds)),
                None => plain,
            }
        };
        let first = forecast(None);
        let exists = input.exist(planner.context);
        let what = format!("imaging {input}");
        let rehearsed =
            planner.rehearsed((&first, exists), &ACTS, |watch| self.rehearse((source.as_mut(), &what), watch, planner.context))?;
        let forecast = planner.after(rehearsed.as_ref(), first, &|course| forecast(Some(course)));
        let mut facts = facts(outlook);
        if let Some(waves) = &waves {
            say_waves(waves, outlook, &mut facts);
        }
        Ok(Told { command: "mem", forecast, facts })
    }

    fn output(&self) -> &std::path::Path {
        &self.out.output
    }
}
