//! The search for a better layout, which sends its best so far.

use super::frame::Answer;
use super::session::Send;
use super::state::keys;
use crate::ChainError;
use crate::cli::failure::{Context as _, Failure, Result};
use crate::cli::optimize::search_from;
use crate::design::{DesignOptions, Found, Polygon};
use crate::progress::{Event, Observer};
use cittert_arrays::ArrayLayout;
use serde_json::json;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// Most attempts of one search.
const MOST_ATTEMPTS: u64 = 100_000;

/// What to search for.
pub(super) struct Wanted {
    /// The layout at which the first attempt begins.
    pub(super) layout: ArrayLayout,
    pub(super) design: DesignOptions,
    pub(super) attempts: u64,
    /// Zones in which no antenna may stand.
    pub(super) keep_out: Vec<Polygon>,
}

/// A running search. It ends when this is dropped.
pub(super) struct Search {
    stop: Arc<AtomicBool>,
}

struct UntilStopped(Arc<AtomicBool>);

impl Observer for UntilStopped {
    fn event(&self, _event: Event<'_>) {}

    fn cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

impl Search {
    /// Begin a search on a thread of its own.
    ///
    /// # Errors
    /// An option that is wrong.
    pub(super) fn begin(mut wanted: Wanted, send: Send) -> Result<Self> {
        crate::ensure!(
            (1..=MOST_ATTEMPTS).contains(&wanted.attempts),
            Failure::message(format!("the number of attempts is {}, expected 1 to {MOST_ATTEMPTS}", wanted.attempts))
        );
        wanted.design.restarts = Some(wanted.attempts);
        wanted.design.time = None;
        let stop = Arc::new(AtomicBool::new(false));
        let observer = UntilStopped(stop.clone());
        let work = move || {
            let done = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| run(&wanted, &send, &observer)));
            let text = match done {
                Ok(Ok(())) | Ok(Err(Stopped::ByUser)) => None,
                Ok(Err(Stopped::Failed(e))) => Some(e.to_string()),
                Err(_) => Some("internal error in the search, please report it".to_owned()),
            };
            send(Answer::json(&json!({ "is": "search-ended", "error": text })));
        };
        std::thread::Builder::new().name("search".into()).spawn(work).context("starting the search")?;
        Ok(Self { stop })
    }
}

impl Drop for Search {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

enum Stopped {
    ByUser,
    Failed(Failure),
}

fn run(wanted: &Wanted, send: &Send, observer: &UntilStopped) -> std::result::Result<(), Stopped> {
    let best: Mutex<(u64, f64)> = Mutex::new((0, f64::INFINITY));
    let each = |found: &Found, layout: &dyn Fn(&Found) -> crate::Result<ArrayLayout>| -> crate::Result<()> {
        let mut best = best.lock().unwrap_or_else(PoisonError::into_inner);
        best.0 += 1;
        let better = found.score < best.1;
        if better {
            best.1 = found.score;
        }
        let drawn = if better { Some(keys(&layout(found)?).map_err(|e| ChainError::Internal(e.to_string()))?) } else { None };
        send(Answer::json(&json!({
            "is": "attempt", "attempt": found.attempt, "done": best.0, "of": wanted.attempts, "score": found.score, "best": best.1, "layout": drawn,
        })));
        Ok(())
    };
    search_from(&wanted.layout, &wanted.keep_out, &wanted.design, &each, observer)
        .map_err(|e| if observer.cancelled() { Stopped::ByUser } else { Stopped::Failed(e) })
}
