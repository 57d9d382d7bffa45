//! The report that compares two layouts, as `layout compare` writes it.

use super::frame::Answer;
use super::message::Observed;
use super::scenes::Scenes;
use super::session::Send;
use super::state::check_keys;
use crate::cli::failure::{Context as _, Failure, Result, ensure};
use crate::cli::sections::words;
use cittert_arrays::ArrayLayout;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
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
pub(super) fn begin(folder: &Path, pair: &[ArrayLayout; 2], options: &Observed, scenes: &Scenes, send: Send) -> Result<()> {
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
    let program = std::env::current_exe().context("finding this program")?;
    let mut command = Command::new(program);
    command.current_dir(&here).args(["layout", "compare", "a.toml", "b.toml", "-o", "out"]).arg(format!("--freq={}", options.freq));
    if let Some((section, file)) = options.scene.as_ref().and_then(|s| Some((s, s.options.file.as_ref()?))) {
        command.arg("--scene").arg(std::path::absolute(scenes.path(&file.display().to_string())?).context("finding the scene")?);
        command.args(words(&section.keys).into_iter().filter(|w| !w.starts_with("--file=")));
        command.args(options.size.map(|n| format!("--size={n}")));
    }
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
    let work = move || {
        let _counted = counted;
        let made = made(command, &here);
        let _ = std::fs::remove_dir_all(&here);
        send(Answer::json(&match made {
            Ok(text) => json!({ "is": "saved", "name": "comparison.html", "text": text, "lost": [] }),
            Err(e) => json!({ "is": "error", "text": format!("the report: {e}") }),
        }));
        send(Answer::json(&json!({ "is": "report-ended" })));
    };
    std::thread::Builder::new().name("report".into()).spawn(work).context("starting the report")?;
    Ok(())
}

/// Run the command, and read the page that it wrote.
fn made(mut command: Command, here: &Path) -> Result<String> {
    let done = command.output().context("running `layout compare`")?;
    if !done.status.success() {
        let text = String::from_utf8_lossy(&done.stderr);
        let last: Vec<&str> = text.lines().filter(|l| !l.trim().is_empty()).collect();
        return Err(Failure::message(last.last().map_or("it failed", |l| l.trim_start_matches("cittert: ")).to_owned()));
    }
    let page: PathBuf = here.join("out").join("report.html");
    std::fs::read_to_string(page).context("reading the report")
}
