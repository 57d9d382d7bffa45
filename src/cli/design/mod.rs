//! `design`: the designer in a browser.
//!
//! The program serves one page on this machine. The page sends its whole state, a worker computes what the command line would with the same options,
//! and the results go back over a WebSocket. Nothing is fetched from elsewhere, and nobody without the token in the address is served.
//!
//! | file | what it holds |
//! |---|---|
//! | `beginning` | what every tab begins with |
//! | `state` | what the page shows, as sections of options, and its limits |
//! | `chain` | from a state to visibilities and images, by the calls of the subcommands |
//! | `closures` | closure phases with and without errors |
//! | `worker`, `mailbox` | one worker a tab, which works on the newest state only |
//! | `message`, `session` | the messages of a tab and their answers |
//! | `optimise` | a search for a better layout, with its best so far |
//! | `report` | the report that compares two layouts |
//! | `commands` | the same on the command line |
//! | `scenes` | the shipped scenes and the dropped ones |
//! | `server`, `guard`, `assets` | who is served, and what |

mod assets;
mod beginning;
mod chain;
mod closures;
mod commands;
mod frame;
mod guard;
mod mailbox;
mod message;
mod optimise;
mod report;
mod scenes;
mod server;
mod session;
mod state;
mod worker;

use super::context::{Context, Outcome};
use super::failure::{Context as _, Failure, Result};
use super::options::load_layout;
use beginning::Beginning;
use cittert_arrays::quantity::Length;
use cittert_arrays::{ArrayLayout, BuiltinLayout, GenerateOptions, LayoutKind};
use cittert_formats::atomic::{AtomicDir, Replaces};
use clap::Args;
use guard::Guard;
use scenes::Scenes;
use server::Served;
use std::io::Write;
use std::path::PathBuf;
use std::sync::Arc;

/// The layout of a page that is opened without one: its kind, elements and aperture in m. Images of 256 pixels show the first scene whole with it.
const FIRST_LAYOUT: (&str, usize, f64) = ("fermat", 64, 0.45);
/// The frequency of a layout that has none of its own, Hz.
const FIRST_FREQ_HZ: f64 = 94e9;
/// The folder of dropped files. It is never finished, so it is removed when the program ends, also by a signal.
const FOLDER: Replaces = Replaces::FilesOf("cittert design");

/// Options of `design`.
#[derive(Debug, Args)]
pub struct DesignArgs {
    /// Name of a built-in layout, or a layout file [default: a golden-angle spiral of 64 elements over 0.45 m].
    #[arg(value_name = "LAYOUT")]
    layout: Option<String>,
    /// Scene that the page shows first: FITS image, grey-scale PNG, source list (CSV) or scene description (TOML) [default: the shipped airport].
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    /// Port on this machine, which alone can reach the page; 0 takes a free one.
    #[arg(long, value_name = "PORT", default_value_t = 0)]
    port: u16,
    /// Print the address of the page without opening it.
    #[arg(long)]
    no_open: bool,
}

/// Serve the page until a signal ends the program.
///
/// # Errors
/// The layout or the scene cannot be read, or the port is taken.
pub fn run(args: &DesignArgs, context: &Context) -> Result<Outcome> {
    let layout = args.layout.as_deref().map_or_else(first_layout, load_layout)?;
    state::check_size(&layout)?;
    let freq_hz = args.layout.as_deref().and_then(BuiltinLayout::find).map_or(FIRST_FREQ_HZ, |b| b.freq_hz);
    let guard = Guard::new()?;
    let folder = AtomicDir::create(&std::env::temp_dir().join(format!("cittert-design-{}", guard.name())), false, FOLDER)?;
    let scenes = Scenes::new(folder.path().to_path_buf());
    let scene = match &args.scene {
        Some(path) => scenes.add_file(path)?,
        None => scenes::FIRST.to_owned(),
    };
    let beginning = Beginning { layout, freq_hz, scene, scenes: Arc::new(scenes), subcommands: context.subcommands };
    let listener = std::net::TcpListener::bind(("127.0.0.1", args.port)).map_err(|e| {
        Failure::message(format!("--port {}: cannot listen on this port: {e}; choose another one, or 0 for a free one", args.port))
    })?;
    let served = Served::new(listener, guard, beginning)?;
    let address = served.address();
    let mut stdout = std::io::stdout().lock();
    writeln!(stdout, "{address}").and_then(|()| stdout.flush()).context("the address cannot be printed on standard output")?;
    drop(stdout);
    context.console.note("the page is served to this machine only; Ctrl-C ends the program");
    if !args.no_open {
        open(&address, context);
    }
    served.run()?;
    Ok(Outcome::default())
}

fn first_layout() -> Result<ArrayLayout> {
    let (kind, elements, aperture_m) = FIRST_LAYOUT;
    Ok(LayoutKind::find(kind)?.layout(&GenerateOptions::new(elements, Length(aperture_m)))?)
}

/// Open the page in the browser of the desktop.
fn open(address: &str, context: &Context) {
    let program = if cfg!(target_os = "macos") { "open" } else { "xdg-open" };
    let null = std::process::Stdio::null;
    let started = std::process::Command::new(program).arg(address).stdin(null()).stdout(null()).stderr(null()).spawn();
    match started {
        Ok(mut child) => drop(std::thread::spawn(move || child.wait())),
        Err(e) => context.console.note(&format!("no browser was opened ({program}: {e}): open the address above")),
    }
}
