//! `film --dry-run`: what the frames would take, from some that are made, and a study of frame rates from that of one.

use super::args::FilmArgs;
use super::frames::with_reel;
use super::{rates, refuse_mixed};
use crate::cli::failure::{Failure, Result};
use crate::cli::forecast::{Measured, Plan, Planner, Scratch, Told, frames_to_make, measured};
use crate::cost::{self, Filmed};
use crate::progress::Silent;
use serde_json::Map;
use std::path::Path;

/// Frames of the fastest rate that are made: two, which is the least, and more to see how long one takes.
const SEEDS: [usize; 2] = [2, 8];

impl FilmArgs {
    /// The forecast of a study of frame rates, from that of the fastest one with few frames.
    fn of_rates(&self, planner: &Planner<'_>) -> Result<Told> {
        rates::outputs(self)?;
        let mut all = self.rates.rates.clone();
        all.sort_by(f64::total_cmp);
        all.dedup();
        let fastest = all[all.len() - 1];
        let mut made = Vec::new();
        for seeds in SEEDS {
            let look = || rates::studied(self, (vec![fastest], seeds), &|_| Ok(()), planner.context, &Silent);
            made.push(measured(look)?);
        }
        let [few, many] = &made[..] else { return Err(Failure::message("a rate was looked at twice")) };
        let more = (SEEDS[1] - SEEDS[0]) as f64;
        let beside = |done: &Measured<rates::Studied>| done.seconds - done.result.stills.1;
        let frame_s = (beside(many) - beside(few)).max(0.0) / more;
        let (count, stills_s) = few.result.stills;
        let still_s = stills_s / count.max(1) as f64;
        let figures = &few.result.figures;
        let pictures: usize = all.iter().map(|rate| figures.pictures_at(*rate)).sum::<usize>() + count - figures.pictures_at(fastest);
        let frames = all.len() * self.rates.seeds;
        let work = cost::Rated {
            setup_s: (beside(few) - SEEDS[0] as f64 * frame_s).max(0.0),
            pictures_s: pictures as f64 * still_s,
            frames_s: frames as f64 * frame_s,
            held_bytes: few.held_bytes.max(many.held_bytes),
        };
        let mut forecast = cost::rates(&work);
        forecast
            .assumptions
            .push(format!("all frames and pictures take the time of those at {fastest} frames per second, on this machine"));
        let mut facts = Map::new();
        facts.insert("rates".into(), all.len().into());
        facts.insert("frames".into(), frames.into());
        facts.insert("pictures".into(), pictures.into());
        Ok(Told { command: "film", forecast, facts })
    }
}

impl Plan for FilmArgs {
    fn plan(&self, planner: &Planner<'_>) -> Result<Told> {
        planner.alone("makes a film")?;
        planner.no_visibilities("each frame has its own")?;
        refuse_mixed(self)?;
        if !self.rates.rates.is_empty() {
            return self.of_rates(planner);
        }
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
