//! Films in files: one format a file beside this one, and one row of [`FILMS`].
//!
//! A writer takes frame after frame and keeps none of them, so that a film of any length needs the memory of a few frames. The caller gives the place to
//! write to, and gives the film its name when [`FilmWriter::finish`] has succeeded.

mod apng;
mod ffmpeg;
mod gif;
mod lzw;
mod rate;
mod table;
mod writer;

pub use ffmpeg::end_encoders;
pub use rate::FrameRate;
pub use table::{FILMS, FilmKind, endings};
pub use writer::{FilmSpec, FilmWriter};
