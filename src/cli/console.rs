//! The console: progress bars on a terminal, notes and warnings on stderr, and the log of cycles.

use super::failure::{Context as _, Failure, Result};
use crate::progress::{Event, Observer};
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::json;
use std::fs::File;
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Instant;

/// How much is printed on stderr.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Loudness {
    /// Errors only.
    Quiet,
    /// Notes, warnings, progress on a terminal.
    Normal,
    /// Also each phase of the work with its time, and each cycle.
    Verbose,
}

#[derive(Debug, Default)]
struct State {
    bar: Option<ProgressBar>,
    phase: String,
    started: Option<Instant>,
    done: u64,
    unit: String,
    cycle_log: Option<(PathBuf, File)>,
    log_failure: Option<String>,
    warnings: Vec<String>,
}

/// An [`Observer`] that prints on stderr.
#[derive(Debug)]
pub struct Console {
    pub(super) loudness: Loudness,
    terminal: bool,
    state: Mutex<State>,
}

impl Console {
    /// A console that prints this much.
    #[must_use]
    pub fn new(loudness: Loudness) -> Self {
        Self { loudness, terminal: std::io::stderr().is_terminal(), state: Mutex::default() }
    }

    /// Write each cycle as one line of JSON to `file`, whose name is `path`.
    pub fn log_cycles(&self, path: &Path, file: File) {
        if let Ok(mut s) = self.state.lock() {
            s.cycle_log = Some((path.into(), file));
        }
    }

    /// Flush the log of cycles to the disk and close it.
    ///
    /// # Errors
    /// A line could not be written.
    pub fn close_log(&self) -> Result<()> {
        let Ok(mut s) = self.state.lock() else { return Ok(()) };
        if let Some((path, file)) = s.cycle_log.take() {
            file.sync_all().context(format!("{}: cannot write the log", path.display()))?;
        }
        s.log_failure.take().map_or(Ok(()), |text| Err(Failure::message(text)))
    }

    /// The warnings since the last call.
    #[must_use]
    pub fn take_warnings(&self) -> Vec<String> {
        self.state.lock().map(|mut s| std::mem::take(&mut s.warnings)).unwrap_or_default()
    }

    /// Print a note.
    pub fn note(&self, text: &str) {
        self.event(Event::Note(text));
    }

    /// Print a warning: something makes the result doubtful.
    pub fn warn(&self, text: &str) {
        self.event(Event::Warning(text));
    }

    fn say(&self, state: &State, text: &str) {
        if self.loudness == Loudness::Quiet {
            return;
        }
        // One write, so that no other process prints between the parts of a line. Nothing can be done where stderr is closed.
        let print = || drop(std::io::stderr().write_all(format!("{text}\n").as_bytes()));
        match &state.bar {
            Some(bar) => bar.suspend(print),
            None => print(),
        }
    }

    fn begin(&self, s: &mut State, name: &str, total: Option<u64>, unit: &str) {
        self.end(s);
        s.phase = name.to_owned();
        s.unit = unit.to_owned();
        s.started = Some(Instant::now());
        s.done = 0;
        if self.terminal && self.loudness >= Loudness::Normal {
            let (bar, template) = match total {
                Some(total) => (ProgressBar::new(total), "{msg:18} {bar:32} {percent:>3}% {per_sec} {eta}"),
                None => (ProgressBar::new_spinner(), "{msg:18} {spinner} {elapsed}"),
            };
            if let Ok(style) = ProgressStyle::with_template(template) {
                bar.set_style(style);
            }
            bar.set_message(name.to_owned());
            s.bar = Some(bar);
        }
    }

    fn end(&self, s: &mut State) {
        if let Some(bar) = s.bar.take() {
            bar.finish_and_clear();
        }
        let Some(started) = s.started.take() else { return };
        if self.loudness == Loudness::Verbose {
            let seconds = started.elapsed().as_secs_f64();
            let known = s.done > 0 && !s.unit.is_empty();
            let rate = if known { format!(", {:.3e} {}/s", s.done as f64 / seconds, s.unit) } else { String::new() };
            self.say(s, &format!("{}: {seconds:.2} s{rate}", s.phase));
        }
    }

    /// Print a cycle or a step, and write it to the log.
    fn step(&self, s: &mut State, text: &str, json: &serde_json::Value) {
        if self.loudness == Loudness::Verbose || self.terminal {
            self.say(s, text);
        }
        if let Some((path, log)) = &mut s.cycle_log
            && let Err(e) = log.write_all(format!("{json}\n").as_bytes())
        {
            // It is told once now, and again as the error with which the command ends.
            let text = format!("{}: cannot write the log: {e}", path.display());
            self.say(s, &format!("warning: {text}"));
            s.log_failure = Some(text);
            s.cycle_log = None;
        }
    }
}

impl Observer for Console {
    fn event(&self, event: Event<'_>) {
        let Ok(mut s) = self.state.lock() else { return };
        match event {
            Event::Phase { name, total, unit } => self.begin(&mut s, name, total, unit),
            Event::Advance(n) => {
                s.done += n;
                if let Some(bar) = &s.bar {
                    bar.inc(n);
                }
            }
            Event::Done => self.end(&mut s),
            Event::Cycle { channel, number, iterations, peak, flux, rms } => {
                let of = channel.map_or(String::new(), |k| format!("channel {k}, "));
                let text = format!("{of}cycle {number}: {iterations} iterations, peak {peak:.4e}, flux {flux:.4e}, rms {rms:.4e}");
                let mut json = json!({"cycle": number, "iterations": iterations, "peak": peak, "flux": flux, "rms": rms});
                if let Some(channel) = channel {
                    json["channel"] = channel.into();
                }
                self.step(&mut s, &text, &json);
            }
            Event::Entropy { number, evaluations, chi2, kkt, flux, lambda } => {
                let text = format!("step {number}: {evaluations} evaluations, chi2/N {chi2:.4}, KKT {kkt:.2e}, flux {flux:.4e}");
                let json = json!({
                    "step": number, "evaluations": evaluations, "chi2_per_datum": chi2, "kkt_residual": kkt, "flux": flux, "lambda": lambda,
                });
                self.step(&mut s, &text, &json);
            }
            Event::Note(text) => self.say(&s, text),
            Event::Warning(text) => {
                self.say(&s, &format!("warning: {text}"));
                s.warnings.push(text.to_owned());
            }
        }
    }
}
