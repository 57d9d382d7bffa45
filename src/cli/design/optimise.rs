//! The search for a better layout, which sends its best so far.

use super::commands::LAYOUT;
use super::frame::{Answer, Send};
use super::state::keys;
use crate::ChainError;
use crate::cli::context::shell_word;
use crate::cli::failure::{Context as _, Failure, Result, ensure};
use crate::cli::optimize::search_from;
use crate::cli::sections::{Section, words_of};
use crate::design::{DesignOptions, Found, Polygon};
use crate::progress::{Event, Observer};
use cittert_arrays::ArrayLayout;
use serde_json::{Value, json};
use std::sync::atomic::{AtomicU8, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// Most attempts of one search.
const MOST_ATTEMPTS: u64 = 100_000;

/// Most corners of all zones together. Every candidate is compared with each.
const MOST_CORNERS: usize = 2000;
/// The file of the zones on the command line.
const ZONES: &str = "keep-out.csv";

/// Numbers the searches, so that a page knows to which one an answer belongs.
static COUNT: AtomicU64 = AtomicU64::new(1);

/// What to search for.
pub(super) struct Wanted {
    /// The layout at which the first attempt begins.
    layout: ArrayLayout,
    design: DesignOptions,
    attempts: u64,
    /// Zones in which no antenna may stand.
    keep_out: Vec<Polygon>,
    /// The same on the command line.
    line: String,
    /// The files that the command reads, with their texts.
    needs: Value,
}

impl Wanted {
    /// Check what a page asks for. `corners` are those of the zones.
    ///
    /// # Errors
    /// An option that is wrong, or too many attempts, elements or corners.
    pub(super) fn new(layout: ArrayLayout, section: &Section<DesignOptions>, attempts: u64, corners: Vec<Vec<[f64; 2]>>) -> Result<Self> {
        let text = format!("the number of attempts is {attempts}, expected 1 to {MOST_ATTEMPTS}");
        ensure!((1..=MOST_ATTEMPTS).contains(&attempts), Failure::message(text));
        let text = "the search begins at the layout of the page: leave elements out";
        ensure!(section.options.elements.is_none_or(|n| n == layout.n_ant()), Failure::message(text));
        let count: usize = corners.iter().map(Vec::len).sum();
        let text = format!("the zones have {count} corners, at most {MOST_CORNERS}: draw simpler ones");
        ensure!(count <= MOST_CORNERS, Failure::message(text));
        let design = DesignOptions { restarts: Some(attempts), time: None, ..section.options.clone() };
        let mut words = vec!["cittert".into(), "layout".into(), "optimize".into(), format!("--start={LAYOUT}")];
        words.extend(words_of(&section.keys, |key| !["restarts", "time"].contains(&key)));
        words.push(format!("--restarts={attempts}"));
        let mut needs = vec![json!({ "name": LAYOUT, "text": layout.to_toml() })];
        if !corners.is_empty() {
            words.push(format!("--keep-out={ZONES}"));
            let zone = |c: &Vec<[f64; 2]>| c.iter().map(|[x, y]| format!("{x},{y}\n")).collect::<String>();
            needs.push(json!({ "name": ZONES, "text": corners.iter().map(zone).collect::<Vec<_>>().join("\n") }));
        }
        words.extend(["-o".to_owned(), "optimized.toml".to_owned()]);
        let polygon = |(k, c)| Polygon::new(&format!("of zone {}", k + 1), c).map_err(Failure::call);
        let keep_out = corners.into_iter().enumerate().map(polygon).collect::<Result<_>>()?;
        let line = words.iter().map(|w| shell_word(w)).collect::<Vec<_>>().join(" ");
        Ok(Self { layout, design, attempts, keep_out, line, needs: needs.into() })
    }
}

/// How a search goes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
enum Goes {
    On,
    /// The user has stopped it.
    Ends,
    /// Nobody listens any more: another search has begun, or the tab is closed.
    Unheard,
}

/// A running search. It ends unheard when this is dropped.
pub(super) struct Search {
    goes: Arc<AtomicU8>,
}

struct WhileOn(Arc<AtomicU8>);

impl WhileOn {
    fn is_heard(&self) -> bool {
        self.0.load(Ordering::Relaxed) != Goes::Unheard as u8
    }
}

impl Observer for WhileOn {
    fn event(&self, _event: Event<'_>) {}

    fn cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed) != Goes::On as u8
    }
}

impl Search {
    /// Begin a search on a thread of its own.
    ///
    /// # Errors
    /// The system has no thread to give.
    pub(super) fn begin(wanted: Wanted, send: Send) -> Result<Self> {
        let search = COUNT.fetch_add(1, Ordering::Relaxed);
        send(Answer::json(&json!({ "is": "search", "search": search, "line": wanted.line, "needs": wanted.needs })));
        let goes = Arc::new(AtomicU8::new(Goes::On as u8));
        let observer = WhileOn(goes.clone());
        // A search would keep all common threads, and the beams of the layouts that it finds would wait for its end.
        let threads = rayon::current_num_threads().saturating_sub(1).max(1);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().context("starting the search")?;
        let work = move || {
            let searching = || pool.install(|| run((&wanted, search), &send, &observer));
            let done = std::panic::catch_unwind(std::panic::AssertUnwindSafe(searching));
            let text = match done {
                Ok(Ok(()) | Err(Stopped::ByUser)) => None,
                Ok(Err(Stopped::Failed(e))) => Some(e.to_string()),
                Err(_) => Some("internal error in the search, please report it".to_owned()),
            };
            if observer.is_heard() {
                send(Answer::json(&json!({ "is": "search-ended", "search": search, "error": text })));
            }
        };
        std::thread::Builder::new().name("search".into()).spawn(work).context("starting the search")?;
        Ok(Self { goes })
    }

    /// End the search. It answers once more.
    pub(super) fn stop(&self) {
        self.goes.store(Goes::Ends as u8, Ordering::Relaxed);
    }
}

impl Drop for Search {
    fn drop(&mut self) {
        self.goes.store(Goes::Unheard as u8, Ordering::Relaxed);
    }
}

enum Stopped {
    ByUser,
    Failed(Failure),
}

fn run((wanted, search): (&Wanted, u64), send: &Send, observer: &WhileOn) -> std::result::Result<(), Stopped> {
    let best: Mutex<(u64, f64)> = Mutex::new((0, f64::INFINITY));
    let each = |found: &Found, layout: &dyn Fn(&Found) -> crate::Result<ArrayLayout>| -> crate::Result<()> {
        let mut best = best.lock().unwrap_or_else(PoisonError::into_inner);
        best.0 += 1;
        let better = found.score < best.1;
        if better {
            best.1 = found.score;
        }
        let drawn = if better { Some(keys(&layout(found)?).map_err(|e| ChainError::Internal(e.to_string()))?) } else { None };
        if !observer.is_heard() {
            return Ok(());
        }
        send(Answer::json(&json!({
            "is": "attempt", "search": search, "attempt": found.attempt, "done": best.0, "of": wanted.attempts, "score": found.score, "best": best.1, "layout": drawn,
        })));
        Ok(())
    };
    search_from(&wanted.layout, &wanted.keep_out, &wanted.design, &each, observer)
        .map_err(|e| if observer.cancelled() { Stopped::ByUser } else { Stopped::Failed(e) })
}
