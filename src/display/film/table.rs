//! The table of formats. A new format is a file beside this one and a row here: the help and the messages follow.

use super::writer::{FilmSpec, FilmWriter};
use super::{apng, ffmpeg, gif};
use crate::values::bad_value;
use crate::{ChainError, Result, ensure};
use std::path::Path;

/// One row of the table of formats.
#[derive(Debug)]
pub struct FilmKind {
    /// Its name.
    pub name: &'static str,
    /// The endings of its files.
    pub endings: &'static [&'static str],
    /// What it is, in a sentence without a full stop.
    pub about: &'static str,
    /// The program that it needs, and the package that brings it.
    pub needs: Option<&'static str>,
    /// Largest number of frames per second.
    pub fastest: f64,
    /// Begin a film in a file.
    pub create: fn(&Path, &FilmSpec) -> Result<Box<dyn FilmWriter>>,
}

/// All formats.
pub const FILMS: &[FilmKind] = &[
    FilmKind {
        name: "animated PNG",
        endings: &["png", "apng"],
        about: "every level as it is, in all browsers",
        needs: None,
        fastest: 1000.0,
        create: apng::create,
    },
    FilmKind {
        name: "GIF",
        endings: &["gif"],
        about: "every level as it is; the time between frames is a whole number of 10 ms on average",
        needs: None,
        fastest: 50.0,
        create: gif::create,
    },
    FilmKind {
        name: "MP4",
        endings: &["mp4"],
        about: "H.264, small, with losses, in all players",
        needs: Some(ffmpeg::PACKAGE),
        fastest: 1000.0,
        create: ffmpeg::create_mp4,
    },
    FilmKind {
        name: "WebM",
        endings: &["webm"],
        about: "VP9, small, with losses, in all browsers",
        needs: Some(ffmpeg::PACKAGE),
        fastest: 1000.0,
        create: ffmpeg::create_webm,
    },
];

/// Longest side of a frame: the limit of GIF, and about that of H.264.
const LONGEST: usize = 16_384;

impl FilmKind {
    /// The format of a file by the ending of its name.
    ///
    /// # Errors
    /// An ending that no format has.
    pub fn of(path: &Path) -> Result<&'static Self> {
        let ending = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
        let found = FILMS.iter().find(|kind| kind.endings.contains(&ending.as_str()));
        found.map_or_else(|| bad_value("output", path.display(), format!("the name of a film: it ends in {}", endings())), Ok)
    }

    /// Begin a film in a file, which exists and is empty, or does not exist.
    ///
    /// # Errors
    /// A size or a rate that the format cannot hold, a program that is not installed, or an error of the file system.
    pub fn begin(&self, path: &Path, spec: &FilmSpec) -> Result<Box<dyn FilmWriter>> {
        self.check(spec)?;
        (self.create)(path, spec)
    }

    /// Refuse a film that the format cannot hold.
    ///
    /// # Errors
    /// A size, a number of frames or a rate out of its range.
    pub fn check(&self, spec: &FilmSpec) -> Result<()> {
        let size = format!("{} x {} pixels", spec.width, spec.height);
        let fits = (1..=LONGEST).contains(&spec.width) && (1..=LONGEST).contains(&spec.height);
        ensure!(fits, ChainError::bad_option("size of the film", size, format!("1 to {LONGEST} pixels a side")));
        ensure!(spec.frames > 0, ChainError::NoData("the film has no frame".into()));
        let rate = spec.rate.hz();
        let expected = format!("at most {} frames per second in a file of {}", self.fastest, self.name);
        ensure!(rate <= self.fastest, ChainError::bad_option("rate", rate, expected));
        Ok(())
    }
}

/// The endings of all films, for messages and help.
#[must_use]
pub fn endings() -> String {
    let all: Vec<String> = FILMS.iter().flat_map(|kind| kind.endings.iter().map(|e| format!(".{e}"))).collect();
    let (last, others) = all.split_last().map_or((String::new(), &[][..]), |(last, others)| (last.clone(), others));
    format!("{} or {last}", others.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::display::film::FrameRate;
    use crate::display::tone::Palette;

    #[test]
    fn the_ending_of_a_name_chooses_the_format() {
        let of = |name: &str| FilmKind::of(Path::new(name)).map(|kind| kind.name);
        assert_eq!((of("a.PNG").unwrap(), of("b/a.apng").unwrap(), of("a.gif").unwrap()), ("animated PNG", "animated PNG", "GIF"));
        assert_eq!((of("a.mp4").unwrap(), of("a.webm").unwrap()), ("MP4", "WebM"));
        for name in ["a.avi", "a", "png", ".gif/"] {
            let told = of(name).unwrap_err().to_string();
            assert!(told.contains(".png, .apng, .gif, .mp4 or .webm"), "{name}: {told}");
        }
    }

    #[test]
    fn endings_are_unique() {
        let mut all: Vec<&str> = FILMS.iter().flat_map(|kind| kind.endings).copied().collect();
        let n = all.len();
        all.sort_unstable();
        all.dedup();
        assert_eq!(all.len(), n);
    }

    #[test]
    fn films_that_a_format_cannot_hold_are_refused() {
        let spec = |width, frames, rate| FilmSpec {
            width,
            height: 4,
            frames,
            rate: FrameRate::new(rate).unwrap(),
            palette: Palette::grey(),
            history: String::new(),
        };
        let told = |k: usize, s: &FilmSpec| FILMS[k].check(s).map_err(|e| e.to_string());
        assert!(told(0, &spec(4, 1, 25.0)).is_ok());
        assert!(told(0, &spec(0, 1, 25.0)).unwrap_err().contains("0 x 4 pixels"));
        assert!(told(0, &spec(20_000, 1, 25.0)).unwrap_err().contains("16384"));
        assert!(told(0, &spec(4, 0, 25.0)).unwrap_err().contains("no frame"));
        assert!(told(1, &spec(4, 1, 60.0)).unwrap_err().contains("at most 50 frames per second in a file of GIF"));
    }
}
