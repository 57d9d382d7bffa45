//! The messages of a tab. A message is JSON, or a binary frame with a JSON header and the bytes of a file.
//!
//! Each answer is an object whose key `is` names it. `seq` is the number of the state that it belongs to.
//!
//! | answer | when | keys |
//! |---|---|---|
//! | `hello` | at the start | what the program has: `layout`, `freq_hz`, `scene`, `scenes`, `kinds`, `builtin`, `formats`, `objectives`, `colors` |
//! | `coverage` | each state | binary: u and v of each row, m; `rows`, `freq_hz` of the channels |
//! | `image` | each state | binary: pixels, l first; `name` is `psf`, `dirty`, `truth`, `clean` or `mem`; `columns`, `rows`, `cell_rad`, `unit` |
//! | `commands` | at rest | `steps` of `what`, `line`, `output`; `needs` of `name`, `text`; `layout` and `run` as TOML; all of it as a shell `script` |
//! | `figures` | at rest | `figures` as `layout show --json` has them |
//! | `closures` | at rest, with errors | `names` of triangles, `true_rad`, `observed_rad` |
//! | `gains` | at rest | `names`, `true` and `solved` gains of `phase_rad` and `amplitude`; `accepted`, `deconvolver`, `left` |
//! | `done` | last of a state | `cancelled` where a newer state has ended the work |
//! | `error` | last of a state, or without `seq` | `text` |
//! | `layout`, `saved`, `scenes` | asked for | `layout`; `name`, `text`, `lost`; `scenes`, `added` |
//! | `search`, `attempt`, `search-ended` | a search | `search` is its number; `line` and `needs` of the command; `score`, `best`, `layout`; `error` |
//! | `report-ended` | asked for | nothing; the page came as `saved`, or an `error` |

use super::state::State;
use crate::cli::failure::{Failure, Result, ensure};
use crate::cli::made::MakeSection;
use crate::cli::sections::{SceneSection, Section};
use crate::design::DesignOptions;
use cittert_arrays::quantity::Frequency;
use serde::Deserialize;

/// Largest file that may be dropped on the page, bytes.
pub(super) const MOST_BYTES: usize = 100_000_000;
/// Largest message that is JSON, bytes: room for the layout of 10,000 antennas.
const MOST_TEXT: usize = 8 << 20;
/// Largest header of a binary message, bytes.
const MOST_HEADER: usize = 4096;

/// What a tab has sent.
pub(super) enum Sent {
    /// A message.
    Text(String),
    /// A dropped file with its header.
    File(Vec<u8>),
}

/// What a tab asks for.
#[derive(Debug, Deserialize)]
#[serde(tag = "do", rename_all = "kebab-case", deny_unknown_fields)]
pub(super) enum Message {
    /// Compute a state.
    Show {
        /// Its number.
        seq: u64,
        /// Whether the hand moves.
        #[serde(default)]
        moving: bool,
        state: Box<State>,
    },
    /// Generate a layout.
    Make { make: Section<MakeSection> },
    /// Send a built-in layout.
    Builtin { name: String },
    /// Write a layout in a format.
    Save { format: String, layout: toml::Value },
    /// Search for a better layout. `keep_out` holds the corners of zones in which no antenna may stand, m.
    Optimise {
        layout: toml::Value,
        design: Box<Section<DesignOptions>>,
        attempts: u64,
        #[serde(default)]
        keep_out: Vec<Vec<[f64; 2]>>,
    },
    /// End the search.
    Stop,
    /// Compare two layouts, as `layout compare` does.
    Report { a: toml::Value, b: toml::Value, options: Observed },
}

/// How the layouts of a comparison observe.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Observed {
    /// Centre of the band.
    pub(super) freq: Frequency,
    /// The scene that both see.
    pub(super) scene: Option<Section<SceneSection>>,
    /// Pixels along each side of the images.
    pub(super) size: Option<usize>,
}

/// What a dropped file is.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Kind {
    /// A scene.
    Scene,
    /// A layout.
    Layout,
}

/// The header of a dropped file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Dropped {
    pub(super) kind: Kind,
    pub(super) name: String,
}

/// Read a message.
///
/// # Errors
/// It is too long, or no message.
pub(super) fn read(text: &str) -> Result<Message> {
    let length = text.len();
    ensure!(length <= MOST_TEXT, Failure::message(format!("a message of {length} bytes is too long, at most {MOST_TEXT}")));
    serde_json::from_str(text).map_err(|e| Failure::message(format!("the page sent what this program does not understand: {e}")))
}

/// The number of a state that cannot be read.
pub(super) fn seq_of(text: &str) -> Option<u64> {
    #[derive(Deserialize)]
    struct Numbered {
        seq: u64,
    }
    serde_json::from_str::<Numbered>(text).ok().filter(|_| text.len() <= MOST_TEXT).map(|n| n.seq)
}

/// Read a binary message: the length of the header as u32, the header, the file.
///
/// # Errors
/// It is too long, or no file with a header.
pub(super) fn read_file(bytes: &[u8]) -> Result<(Dropped, &[u8])> {
    let wrong = |why: &str| Failure::message(format!("the file did not arrive whole ({why}): drop it again"));
    let (length, rest) = bytes.split_first_chunk::<4>().ok_or_else(|| wrong("no header"))?;
    let length = u32::from_le_bytes(*length) as usize;
    ensure!(length <= MOST_HEADER && length <= rest.len(), wrong("the header is cut off"));
    let (header, file) = rest.split_at(length);
    let dropped: Dropped = serde_json::from_slice(header).map_err(|e| wrong(&e.to_string()))?;
    let size = file.len();
    let text =
        format!("{}: the file has {:.0} MB, and the page takes at most 100 MB: make it smaller first", dropped.name, size as f64 / 1e6);
    ensure!(size <= MOST_BYTES, Failure::message(text));
    Ok((dropped, file))
}
