//! The report that compares two layouts, as `layout compare` writes it.

use super::frame::{Answer, Send};
use super::message::Observed;
use super::scenes::Scenes;
use super::state::check_keys;
use crate::cli::ahead::Ahead;
use crate::cli::console::{Console, Loudness};
use crate::cli::context::{Context, Subcommands};
use crate::cli::failure::{Context as _, Failure, Result, ensure};
use crate::cli::sections::words_of;
use cittert_arrays::ArrayLayout;
use serde_json::json;
use std::ffi::OsString;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Most pixels along each side of the images of a report.
const MOST_SIDE: usize = 1024;
/// Reports that are being made, in all tabs together.
static RUNNING: AtomicUsize = AtomicUsize::new(0);
/// Most of them at a time: each uses all processors.
const MOST_RUNNING: usize = 2;
/// Gives each report a folder of its own.
static NUMBER: AtomicUsize = AtomicUsize::new(0);

/// Counts a report while it is made.
struct Counted;

impl Drop for Counted {
    fn drop(&mut self) {
        RUNNING.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Begin the report of two layouts. It is sent once it is there.
///
/// # Errors
/// An option that a page does not set, too many pixels, too many reports at a time, an unknown scene, or an error of the file system.
pub(super) fn begin(
    folder: &Path,
    pair: &[ArrayLayout; 2],
    options: &Observed,
    scenes: &Scenes,
    (subcommands, send): (Subcommands, Send),
) -> Result<()> {
    if let Some(scene) = &options.scene {
        check_keys("scene", &scene.keys)?;
    }
    let side = options.size.unwrap_or(0);
    ensure!(side <= MOST_SIDE, Failure::message(format!("a report with {side} x {side} pixels takes too long, at most {MOST_SIDE}")));
    let counted = (RUNNING.fetch_add(1, Ordering::Relaxed), Counted);
    ensure!(counted.0 < MOST_RUNNING, Failure::message("other reports are being made: wait for them"));
    let here = folder.join(format!("report-{}", NUMBER.fetch_add(1, Ordering::Relaxed)));
    std::fs::create_dir(&here).context("making the folder of the report")?;
    for (layout, name) in pair.iter().zip(["a.toml", "b.toml"]) {
        std::fs::write(here.join(name), layout.to_toml()).context("keeping a layout")?;
    }
    let file = |name: &str| here.join(name).display().to_string();
    let mut line: Vec<String> = ["cittert", "layout", "compare"].map(str::to_owned).into();
    line.extend([file("a.toml"), file("b.toml"), format!("--output={}", file("out")), format!("--freq={}", options.freq)]);
    if let Some((section, name)) = options.scene.as_ref().and_then(|s| Some((s, s.options.file.as_ref()?))) {
        line.push(format!("--scene={}", scenes.path(&name.display().to_string())?.display()));
        line.extend(words_of(&section.keys, |key| key != "file"));
        line.extend(options.size.map(|n| format!("--size={n}")));
    }
    // Names of files as the user knows them.
    let hidden = [&here, folder].map(|path| format!("{}/", path.display()));
    let work = move || {
        let _counted = counted;
        let made = catch_unwind(AssertUnwindSafe(|| made(&line, &here, subcommands)));
        let made = made.unwrap_or_else(|_| Err(Failure::message("internal error, please report it with the address of this page")));
        let _ = std::fs::remove_dir_all(&here);
        let plain = |text: String| hidden.iter().fold(text, |text, folder| text.replace(folder, ""));
        send(Answer::json(&match made {
            Ok(text) => json!({ "is": "saved", "name": "comparison.html", "text": plain(text), "lost": [] }),
            Err(e) => json!({ "is": "error", "text": plain(format!("the report: {e}")) }),
        }));
        send(Answer::json(&json!({ "is": "report-ended" })));
    };
    std::thread::Builder::new().name("report".into()).spawn(work).context("starting the report")?;
    Ok(())
}

/// Run the command, and read the page that it wrote.
fn made(line: &[String], here: &Path, subcommands: Subcommands) -> Result<String> {
    let words: Vec<OsString> = line.iter().map(Into::into).collect();
    let shown = "cittert layout compare a.toml b.toml".to_owned();
    let context = Context { command_line: shown, console: Console::new(Loudness::Quiet), subcommands, ahead: Ahead::default() };
    (subcommands.run)(&words, &context)?;
    std::fs::read_to_string(here.join("out").join("report.html")).context("reading the report")
}
