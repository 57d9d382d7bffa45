//! The stages of `scene render`, `scene fly` and `film`, and of other commands whose time is measured with a part of their work.

use super::chained::PICTURE;
use super::stage::{Forecast, Stage};
use super::term::Term;

/// A pixel of an image in memory, and in a FITS file.
const DOUBLE: f64 = 8.0;
const STORED: f64 = 4.0;

/// A picture of a scene, whose time follows from smaller ones.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Traced {
    /// Time of the tables of surfaces, sky and air, s.
    pub setup_s: f64,
    /// Time of all rays, s.
    pub trace_s: f64,
    /// Bytes of all arrays of the picture while it is made.
    pub bytes: f64,
    /// Pixels of all images that are written.
    pub written: f64,
}

impl Traced {
    /// Two pictures, one after the other.
    #[must_use]
    pub fn and(&self, next: &Self) -> Self {
        Self {
            setup_s: self.setup_s + next.setup_s,
            trace_s: self.trace_s + next.trace_s,
            bytes: self.bytes.max(next.bytes),
            written: self.written + next.written,
        }
    }
}

/// A film, whose time follows from some of its frames.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Filmed {
    /// Time until the first frame, s.
    pub setup_s: f64,
    /// Time of the frames from which black and white follow, s.
    pub levels_s: f64,
    /// Time of all frames, s.
    pub frames_s: f64,
    /// Bytes that are held at most.
    pub held_bytes: f64,
    /// Bytes of the film.
    pub output_bytes: f64,
}

/// A study of frame rates, whose time follows from one of them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Rated {
    /// Time until the first picture, s.
    pub setup_s: f64,
    /// Time of all pictures of the scene, s.
    pub pictures_s: f64,
    /// Time of all frames, s.
    pub frames_s: f64,
    /// Bytes that are held at most.
    pub held_bytes: f64,
}

/// The forecast of a picture.
#[must_use]
pub fn render(work: &Traced) -> Forecast {
    let stages = vec![
        Stage::new("start", 0.0).doing([(Term::Command, 1.0)]),
        Stage { timed_s: work.setup_s, ..Stage::new("tables", 0.0) },
        Stage { timed_s: work.trace_s, ..Stage::new("rays", work.bytes) },
        Stage::new("write", work.written * (2.0 * DOUBLE + STORED)).doing([(Term::WritePixel, work.written)]),
    ];
    Forecast { stages, output_bytes: work.written * STORED, ..Forecast::default() }
}

/// The forecast of a film or of the frames of a flight.
#[must_use]
pub fn film(work: &Filmed) -> Forecast {
    let timed = |name: &'static str, timed_s: f64| Stage { timed_s, ..Stage::new(name, work.held_bytes) };
    let start = Stage::new("start", 0.0).doing([(Term::Command, 1.0)]);
    let stages = vec![start, timed("set up", work.setup_s), timed("levels", work.levels_s), timed("frames", work.frames_s)];
    Forecast { stages, output_bytes: work.output_bytes, ..Forecast::default() }
}

/// The forecast of a study of frame rates. Its table and its picture are small.
#[must_use]
pub fn rates(work: &Rated) -> Forecast {
    let timed = |name: &'static str, timed_s: f64| Stage { timed_s, ..Stage::new(name, work.held_bytes) };
    let start = Stage::new("start", 0.0).doing([(Term::Command, 1.0)]);
    let write = Stage::new("write", work.held_bytes).doing([(Term::Picture, 1.0)]);
    let stages = vec![start, timed("set up", work.setup_s), timed("pictures", work.pictures_s), timed("frames", work.frames_s), write];
    Forecast { stages, output_bytes: 2.0 * PICTURE, ..Forecast::default() }
}

/// The forecast of a command whose work takes what parts of it say: seconds, and bytes that are held. Some pictures are drawn of its results.
#[must_use]
pub fn timed(name: &'static str, (timed_s, held_bytes): (f64, f64), pictures: f64) -> Forecast {
    let start = Stage::new("start", 0.0).doing([(Term::Command, 1.0)]);
    let mut stages = vec![start, Stage { timed_s, ..Stage::new(name, held_bytes) }];
    if pictures > 0.0 {
        stages.push(Stage::new("pictures", held_bytes).doing([(Term::Picture, pictures)]));
    }
    Forecast { stages, output_bytes: pictures * PICTURE, ..Forecast::default() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cost::Speeds;

    #[test]
    fn what_was_timed_is_told_and_what_is_held_counts_once() {
        let picture = render(&Traced { setup_s: 1.0, trace_s: 2.0, bytes: 5e7, written: 1e5 });
        assert_eq!(picture.stages.iter().map(|s| s.timed_s).sum::<f64>(), 3.0);
        assert_eq!((picture.largest().unwrap().name, picture.output_bytes), ("rays", 4e5));
        let speeds = Speeds::built_in().unwrap();
        let made = film(&Filmed { frames_s: 9.0, held_bytes: 3e7, ..Filmed::default() });
        assert_eq!(made.peak_bytes(&speeds), made.stages[3].memory(&speeds));
        assert!(made.peak_bytes(&speeds) >= speeds.base_bytes() + 3e7);
    }
}
