//! `film --dry-run`: what the frames would take, from some that are made.

use super::args::FilmArgs;
use super::frames::with_reel;
use super::refuse_mixed;
use crate::cli::failure::{Failure, Result, ensure};
use crate::cli::forecast::{Plan, Planner, Scratch, Told, frames_to_make, measured};
use crate::cost::{self, Filmed};
use crate::progress::Silent;
use serde_json::Map;
use std::path::Path;

impl Plan for FilmArgs {
    fn plan(&self, planner: &Planner<'_>) -> Result<Told> {
        planner.alone("makes a film")?;
        planner.no_visibilities("each frame has its own")?;
        refuse_mixed(self)?;
        ensure!(
            self.rates.rates.is_empty(),
            Failure::unforeseen("--dry-run: no forecast of --rates, which studies a few frames of one moment")
        );
        let scratch = Scratch::new()?;
        let file = scratch.path().join(self.out.output.file_name().unwrap_or_default());
        let mut sampled = (0, 0, 0, 0);
        let done = measured(|| {
            with_reel(self, planner.context, |mut reel, _| {
                let frames = reel.frames();
                reel.thin(frames_to_make(planner.threads).max(self.film.every));
                let some = reel.frames();
                sampled = (frames, some, reel.frames_of_levels(frames), reel.frames_of_levels(some));
                reel.make(&file, &Silent)
            })
        })?;
        let (frames, some, levels, some_levels) = sampled;
        let part = |all: usize, some: usize| all as f64 / some.max(1) as f64;
        let (levels_s, frames_s) = done.result.seconds;
        let work = Filmed {
            setup_s: done.seconds - levels_s - frames_s,
            levels_s: levels_s * part(levels, some_levels),
            frames_s: frames_s * part(frames, some),
            held_bytes: done.held_bytes,
            output_bytes: std::fs::metadata(&file).map_or(0.0, |m| m.len() as f64) * part(frames, some),
        };
        let mut forecast = cost::film(&work);
        forecast.assumptions.push(format!("all frames take the time of {some} that are spread over the film, on this machine"));
        let mut facts = Map::new();
        facts.insert("frames".into(), frames.into());
        facts.insert("sampled_frames".into(), some.into());
        Ok(Told { command: "film", forecast, facts })
    }

    fn output(&self) -> &Path {
        &self.out.output
    }
}
