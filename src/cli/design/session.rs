//! One tab: its messages, its worker and its search.

use super::beginning::Beginning;
use super::frame::{Answer, Send};
use super::mailbox::{Job, Mailbox};
use super::message::{Dropped, Kind, Message, Sent, read, read_file, seq_of};
use super::optimise::{Search, Wanted};
use super::report;
use super::scenes::Scenes;
use super::state::{check_size, keys, layout};
use super::worker::Worker;
use crate::cli::context::Subcommands;
use crate::cli::failure::{Context as _, Failure, Result, ensure};
use cittert_arrays::{ArrayLayout, BUILTIN_LAYOUTS, LAYOUT_KINDS};
use cittert_formats::layouts::{layout_format, layout_formats, read_layout};
use serde_json::{Value, json};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::Arc;

/// One tab.
pub(super) struct Session {
    scenes: Arc<Scenes>,
    folder: PathBuf,
    mailbox: Arc<Mailbox>,
    search: Option<Search>,
    subcommands: Subcommands,
    send: Send,
}

impl Session {
    /// Begin a tab, with its worker on a thread of its own. `None` where the tab is closed already, or the system has no thread to give.
    pub(super) fn begin(beginning: &Beginning, folder: PathBuf, send: Send) -> Option<Self> {
        let mailbox = Arc::new(Mailbox::default());
        let scenes = beginning.scenes.clone();
        let worker = Worker::new(mailbox.clone(), scenes.clone(), send.clone());
        let session = Self { scenes, folder, mailbox, search: None, subcommands: beginning.subcommands, send };
        let begun = std::thread::Builder::new().name("designer".into()).spawn(move || worker.run()).context("starting a tab");
        let hello = begun.and_then(|_| hello(beginning));
        match hello {
            Ok(hello) => (session.send)(Answer::json(&hello)).then_some(session),
            Err(e) => {
                session.tell(Err(e));
                None
            }
        }
    }

    /// Answer what the tab has sent.
    pub(super) fn answer(&mut self, sent: &Sent) {
        let work = AssertUnwindSafe(|| match sent {
            Sent::Text(text) => match read(text) {
                Ok(message) => self.message(message),
                Err(e) => {
                    // The page waits for an answer to each state, also to one that is none.
                    self.send(&json!({ "is": "error", "seq": seq_of(text), "text": e.to_string() }));
                    Ok(())
                }
            },
            Sent::File(bytes) => read_file(bytes).and_then(|(dropped, bytes)| self.keep(&dropped, bytes)),
        });
        let done = catch_unwind(work);
        self.tell(done.unwrap_or_else(|_| Err(Failure::message("internal error, please report it with the address of this page"))));
    }

    fn tell(&self, done: Result<()>) {
        if let Err(e) = done {
            (self.send)(Answer::json(&json!({ "is": "error", "text": e.to_string() })));
        }
    }

    fn send(&self, value: &Value) {
        (self.send)(Answer::json(value));
    }

    fn message(&mut self, message: Message) -> Result<()> {
        match message {
            Message::Show { seq, moving, state } => {
                if let Err(e) = state.check() {
                    self.send(&json!({ "is": "error", "seq": seq, "text": e.to_string() }));
                    return Ok(());
                }
                self.mailbox.put(Job { seq, moving, state });
            }
            Message::Make { make } => {
                let count = make.options.options.elements;
                let most = super::state::MOST_ANTENNAS;
                let text = format!("{count} elements are more than the page shows, at most {most}");
                ensure!(count <= most, Failure::message(text));
                self.layout(&make.options.layout()?)?;
            }
            Message::Builtin { name } => self.layout(&ArrayLayout::builtin(&name)?)?,
            Message::Save { format, layout: drawn } => {
                let layout = layout(&drawn)?;
                let known = || layout_formats().map(|f| f.name()).collect::<Vec<_>>().join(", ");
                let format = layout_format(&format).ok_or_else(|| Failure::message(format!("the formats are {}", known())))?;
                let text = format.write(&layout)?;
                self.send(&json!({ "is": "saved", "name": format!("{}.{}", layout.name, format.extension()), "text": text, "lost": format.loses(&layout) }));
            }
            Message::Optimise { layout: drawn, design, attempts, keep_out } => {
                self.search = None; // The one before ends.
                let wanted = Wanted::new(layout(&drawn)?, &design, attempts, keep_out)?;
                self.search = Some(Search::begin(wanted, self.send.clone())?);
            }
            Message::Stop => {
                if let Some(search) = &self.search {
                    search.stop();
                }
            }
            Message::Report { a, b, options } => {
                let pair = [layout(&a)?, layout(&b)?];
                report::begin(&self.folder, &pair, &options, &self.scenes, (self.subcommands, self.send.clone()))?;
            }
        }
        Ok(())
    }

    fn layout(&self, layout: &ArrayLayout) -> Result<()> {
        check_size(layout)?;
        self.send(&json!({ "is": "layout", "layout": keys(layout)? }));
        Ok(())
    }

    fn keep(&self, dropped: &Dropped, bytes: &[u8]) -> Result<()> {
        match dropped.kind {
            Kind::Scene => {
                let name = self.scenes.add(&dropped.name, bytes)?;
                self.send(&json!({ "is": "scenes", "scenes": self.scenes.names(), "added": name }));
                Ok(())
            }
            Kind::Layout => {
                // Formats are told apart by the ending of the name too.
                let end: String =
                    dropped.name.rsplit('.').next().unwrap_or("").chars().filter(char::is_ascii_alphanumeric).take(8).collect();
                let path = self.folder.join(format!("layout-{:p}.{end}", Arc::as_ptr(&self.mailbox)));
                std::fs::write(&path, bytes).context("keeping the layout")?;
                let read = read_layout(&path, None);
                let _ = std::fs::remove_file(&path);
                let shown = path.display().to_string();
                let layout = read.map_err(|e| Failure::from(e).renamed(&shown, &dropped.name))?;
                self.layout(&layout)
            }
        }
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        self.mailbox.close();
    }
}

/// Objectives that need nothing but the layout.
const ALONE: [&str; 8] = ["psl", "rms", "fill", "density", "redundancy", "cable", "delta-t", "robust"];

/// What the page must know of this program.
fn hello(beginning: &Beginning) -> Result<Value> {
    let kinds: Vec<Value> =
        LAYOUT_KINDS.iter().map(|k| json!({ "name": k.name, "about": k.about, "options": k.options().collect::<Vec<_>>() })).collect();
    let builtin: Vec<Value> =
        BUILTIN_LAYOUTS.iter().map(|b| json!({ "name": b.name, "about": b.description, "freq_hz": b.freq_hz })).collect();
    let formats: Vec<Value> = layout_formats().map(|f| json!({ "name": f.name(), "extension": f.extension() })).collect();
    let objectives: Vec<Value> =
        crate::design::OBJECTIVES.iter().filter(|o| ALONE.contains(&o.name)).map(|o| json!({ "name": o.name, "about": o.about })).collect();
    Ok(json!({
        "is": "hello", "version": env!("CARGO_PKG_VERSION"), "layout": keys(&beginning.layout)?, "freq_hz": beginning.freq_hz,
        "scene": beginning.scene, "scenes": beginning.scenes.names(), "kinds": kinds, "builtin": builtin, "formats": formats,
        "objectives": objectives,
        "colors": { "inferno": hex(colorous::INFERNO), "viridis": hex(colorous::VIRIDIS), "red-blue": hex(colorous::RED_BLUE) },
    }))
}

/// 256 colours of a gradient, six hexadecimal digits each.
fn hex(gradient: colorous::Gradient) -> String {
    (0..256).map(|k| format!("{:x}", gradient.eval_rational(k, 256))).collect()
}
