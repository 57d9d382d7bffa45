//! The worker of a tab: it computes the newest state, what is quick first.

use super::chain::{self, Planned};
use super::closures::{self, Closures, closures};
use super::commands;
use super::frame::{Answer, Send};
use super::mailbox::{Job, Mailbox, WhileWanted};
use super::scenes::Scenes;
use super::state::State;
use crate::ChainError;
use crate::calibrate::{CompareOptions, compare_gains};
use crate::cli::ahead::Ahead;
use crate::cli::console::{Console, Loudness};
use crate::cli::context::{Context, Outcome, Subcommands};
use crate::cli::failure::{Failure, Result};
use crate::cli::layout::figures_json;
use crate::fidelity::compare as compare_images;
use cittert_arrays::{FigureOptions, GainTable, Image, SkyFrame, VisibilitySet};
use serde_json::{Value, json};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::Instant;

/// Most points of the u-v plane that are sent. Of more, every so manieth is.
const MOST_POINTS: usize = 200_000;

/// The worker of a tab.
pub(super) struct Worker {
    mailbox: Arc<Mailbox>,
    scenes: Arc<Scenes>,
    send: Send,
    context: Context,
}

impl Worker {
    pub(super) fn new(mailbox: Arc<Mailbox>, scenes: Arc<Scenes>, send: Send) -> Self {
        let subcommands = Subcommands { check: |_| Ok(()), run: |_, _| Ok(Outcome::default()) };
        let context =
            Context { command_line: "cittert design".into(), console: Console::new(Loudness::Quiet), subcommands, ahead: Ahead::default() };
        Self { mailbox, scenes, send, context }
    }

    /// Work until the tab is closed.
    pub(super) fn run(self) {
        while let Some(job) = self.mailbox.take() {
            let done = catch_unwind(AssertUnwindSafe(|| self.show(&job)))
                .unwrap_or_else(|_| Err(Failure::message("internal error, please report it with the address of this page")));
            // Work that a newer state has ended has failed too, but nobody waits for it.
            let stale = done.is_err() && self.mailbox.is_stale();
            self.tell(&match done {
                Err(e) if !stale => json!({ "is": "error", "seq": job.seq, "text": e.to_string() }),
                _ => json!({ "is": "done", "seq": job.seq, "cancelled": stale }),
            });
        }
    }

    fn tell(&self, value: &Value) {
        (self.send)(Answer::json(value));
    }

    fn image<P: Copy + Into<f64>>(&self, seq: u64, name: &str, image: &Image<P>, more: Value) {
        let plane = image.plane(0, 0);
        let numbers: Vec<f32> = plane.iter().map(|v| (*v).into() as f32).collect();
        let grid = &image.grid;
        let mut header = json!({
            "is": "image", "seq": seq, "name": name, "columns": grid.n_l, "rows": grid.n_m, "cell_rad": grid.cell_rad,
            "unit": image.unit.bunit(), "sky": grid.frame != SkyFrame::Boresight,
        });
        if let (Value::Object(header), Value::Object(more)) = (&mut header, more) {
            header.extend(more);
        }
        (self.send)(Answer::numbers(&header, &numbers));
    }

    /// Compute a state.
    fn show(&self, job: &Job) -> Result<()> {
        let (state, seq) = (job.state.as_ref(), job.seq);
        let planned = chain::plan(state)?;
        self.coverage(seq, &planned)?;
        let observer = WhileWanted { mailbox: &self.mailbox, quick: job.moving };
        let scene = chain::scene(state, &planned, &self.scenes, &self.context)?;
        // The beam needs only the weights, so it need not wait for the visibilities.
        let mut blind = chain::weighed(state, &planned, scene.unit, &observer)?;
        if let Some(weighed) = &mut blind {
            self.beam(seq, state, weighed)?;
        }
        let mut set = chain::simulated(state, &planned, &scene, &observer)?;
        let without = if job.moving || !chain::has_errors(state) { Closures::new() } else { closures(&set)? };
        let corrupted = chain::corrupted(state, &mut set)?;
        let (mut data, truth) = match corrupted {
            Some((data, truth)) => (data, Some(truth)),
            None => (set, None),
        };
        if blind.is_none() {
            self.beam(seq, state, &mut data)?;
        }
        self.image(seq, "dirty", &chain::dirty(&mut chain::imager(state, &mut data)?)?, json!({ "calibrated": false }));
        if job.moving {
            return Ok(());
        }
        self.still_wanted()?;
        self.tell(&commands::told(seq, state, &planned.layout.to_toml(), &self.scenes)?);
        let with = if without.is_empty() { Closures::new() } else { closures(&data)? };
        self.tell(&closures::told(seq, &data.header, &without, &with));
        if let Some(image) = scene.sky.images.first() {
            self.image(seq, "truth", image, json!({}));
        }
        self.still_wanted()?;
        self.figures(seq, state, &planned)?;
        self.still_wanted()?;
        if let Some((found, calibrated)) = chain::calibrated(state, &mut data, &observer)? {
            let rms = truth.as_ref().map(|t| compare_gains(&found.gains, t, CompareOptions { gradient: true, flux_scale: true }));
            let rms = rms.transpose()?.map(|c| json!({ "rms_phase_rad": c.rms_phase_rad, "rms_amplitude": c.rms_amplitude }));
            self.tell(&json!({
                "is": "gains", "seq": seq, "accepted": found.verdict.accepted(), "deconvolver": found.algorithm, "left": rms,
                "true": truth.as_ref().map(|t| gains(t, found.gains.refant)), "solved": gains(&found.gains, found.gains.refant),
                "names": planned.layout.antennas().iter().map(|a| a.name.as_str()).collect::<Vec<_>>(),
            }));
            data = calibrated;
            let mut imager = chain::imager(state, &mut data)?;
            self.image(seq, "dirty", &chain::dirty(&mut imager)?, json!({ "calibrated": true }));
        } else {
            self.tell(&json!({
                "is": "gains", "seq": seq, "true": truth.as_ref().map(|t| gains(t, None)),
                "names": planned.layout.antennas().iter().map(|a| a.name.as_str()).collect::<Vec<_>>(),
            }));
        }
        let truth = scene.sky.images.first();
        let began = Instant::now();
        if let Some(found) = chain::cleaned(state, &mut data, &observer)? {
            let s = &found.statistics;
            let scores = scores(&found.restored, truth, true);
            self.image(
                seq,
                "clean",
                &found.restored,
                json!({
                    "seconds": began.elapsed().as_secs_f64(), "iterations": s.iterations, "residual_rms": s.residual_rms, "scores": scores,
                }),
            );
        }
        let began = Instant::now();
        if let Some(found) = chain::entropic(state, &mut data, &observer)? {
            // The page images one channel.
            let (c, goals) = (found.certificates.first(), state.mem.as_ref().map(|m| m.options.goals()));
            let missed = c.zip(goals).and_then(|(c, g)| c.shortfall(g.chi2_tolerance, g.flux, g.kkt));
            self.image(seq, "mem", &found.model, json!({
                "seconds": began.elapsed().as_secs_f64(), "chi2_per_datum": c.map(|c| c.chi2_per_datum), "scores": scores(&found.model, truth, false),
                "missed": missed,
            }));
        }
        Ok(())
    }

    /// Steps that cannot be interrupted do not begin where a newer state waits.
    fn still_wanted(&self) -> Result<()> {
        if self.mailbox.is_stale() { Err(ChainError::Cancelled.into()) } else { Ok(()) }
    }

    /// The u-v coverage: u and v of each row in metres, and the band.
    fn coverage(&self, seq: u64, planned: &Planned) -> Result<()> {
        let coverage = planned.plan.coverage()?;
        let every = coverage.n_rows().div_ceil(MOST_POINTS).max(1);
        let points: Vec<f32> = coverage.uvw_m.rows().into_iter().step_by(every).flat_map(|r| [r[0] as f32, r[1] as f32]).collect();
        let freq = planned.spectrum.freq_hz();
        let header = json!({ "is": "coverage", "seq": seq, "rows": coverage.n_rows(), "freq_hz": freq });
        (self.send)(Answer::numbers(&header, &points));
        Ok(())
    }

    /// The dirty beam.
    fn beam(&self, seq: u64, state: &State, data: &mut VisibilitySet) -> Result<()> {
        let (psf, beams) = chain::psf(&mut chain::imager(state, data)?)?;
        let beam = beams.first().map(|b| json!([b.bmaj_rad, b.bmin_rad, b.bpa_rad]));
        self.image(seq, "psf", &psf, json!({ "beam_rad": beam }));
        Ok(())
    }

    /// The figures of merit, as `layout show --json` has them.
    fn figures(&self, seq: u64, state: &State, planned: &Planned) -> Result<()> {
        let freq = state.simulate.options.band.freq;
        let figures = figures_json(&planned.layout, freq, &FigureOptions::default())?;
        self.tell(&json!({ "is": "figures", "seq": seq, "figures": figures }));
        Ok(())
    }
}

/// Phases and amplitudes of the first interval and channel, each against the reference antenna.
fn gains(table: &GainTable, refant: Option<usize>) -> Value {
    let of = |ant: usize| table.gains[[0, ant, 0, 0]];
    let turn = refant.map_or(num_complex::Complex64::ONE, |r| of(r).conj());
    let all = 0..table.gains.dim().1;
    json!({
        "phase_rad": all.clone().map(|a| (of(a) * turn).arg()).collect::<Vec<f64>>(),
        "amplitude": all.map(|a| of(a).norm()).collect::<Vec<f64>>(),
    })
}

/// How far an image is from the scene, where both are images that can be compared.
fn scores(image: &Image, truth: Option<&Image>, convolve: bool) -> Value {
    let beam = image.beams.first().copied().filter(|_| convolve);
    let options = crate::fidelity::CompareOptions { beam, ..Default::default() };
    let found = truth.and_then(|t| compare_images(image, t, &options).ok());
    found.map_or(Value::Null, |c| json!({ "rms": c.scores.rms_difference, "nrmse": c.scores.nrmse, "ssim": c.scores.ssim }))
}
