//! The stages of `run`: commands one after the other in one process, the pictures of their results, and comparisons of images.

use super::stage::{Forecast, Stage};
use super::term::Term;

/// A pixel while an image is read, compared and drawn.
const PIXEL: f64 = 27.0;
/// The canvas of a picture with its fonts and its file, and that of one with many dots.
const CANVAS: f64 = 25e6;
const DOTS: f64 = 45e6;
/// A visibility that is drawn, and a block of them.
const VALUE: f64 = 32.0;
const MOST_OF_BLOCK: f64 = 35e6;
/// What commands leave behind for the next ones: the pictures of the page, and freed blocks of which parts are in use (4 to 28 MB in six runs).
const LEFT: f64 = 20e6;
/// Bytes of a picture, in its file and in the page.
pub(super) const PICTURE: f64 = 200e3;

/// A picture, or a comparison of two images.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Shown {
    /// Pictures that are drawn.
    pub pictures: f64,
    /// Pixels that are read for them.
    pub pixels: f64,
    /// Pixels that are convolved with the beam of an image.
    pub smoothed: f64,
    /// Visibilities that are drawn.
    pub values: f64,
}

/// The forecast of pictures, or of comparisons.
#[must_use]
pub fn shown(name: &'static str, work: &Shown) -> Forecast {
    let canvas = if work.values > 0.0 { DOTS + MOST_OF_BLOCK.min(VALUE * work.values) } else { CANVAS };
    let stage = Stage::new(name, canvas + PIXEL * work.pixels).doing([
        (Term::Picture, work.pictures),
        (Term::PicturePixel, work.pixels),
        (Term::SmoothPixel, work.smoothed),
        (Term::PictureValue, work.values),
    ]);
    Forecast { stages: vec![stage], output_bytes: 2.0 * PICTURE * work.pictures, ..Forecast::default() }
}

/// The forecast of commands one after the other, each as one stage. They share one start of the program, and neighbours of the same name one stage.
#[must_use]
pub fn chain(commands: impl IntoIterator<Item = (&'static str, Forecast)>) -> Forecast {
    let start = Stage::new("start", 0.0).doing([(Term::Command, 1.0)]);
    let mut all = Forecast { stages: vec![start], groups_of_planes: 1, ..Forecast::default() };
    for (name, forecast) in commands {
        let mut stage = Stage::new(name, 0.0);
        for s in &forecast.stages {
            stage.timed_s += s.timed_s;
            stage.read_bytes += s.read_bytes;
            stage.bytes = stage.bytes.max(s.bytes);
            stage = stage.doing(s.work.iter().copied().filter(|(term, _)| *term != Term::Command));
        }
        all.output_bytes += forecast.output_bytes;
        all.groups_of_planes = all.groups_of_planes.max(forecast.groups_of_planes);
        all.assumptions.extend(forecast.assumptions.iter().map(|a| format!("{name}: {a}")));
        if all.stages.len() > 1 {
            stage.bytes += LEFT;
        }
        match all.stages.last_mut().filter(|last| last.name == name) {
            Some(last) => {
                last.timed_s += stage.timed_s;
                last.read_bytes += stage.read_bytes;
                last.bytes = last.bytes.max(stage.bytes);
                last.work.extend(stage.work);
            }
            None => all.stages.push(stage),
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cost::Speeds;

    #[test]
    fn a_chain_takes_the_sum_of_the_times_and_the_largest_memory() {
        let speeds = Speeds::built_in().unwrap();
        let one = |name: &'static str, bytes: f64| {
            let start = Stage::new("start", 0.0).doing([(Term::Command, 1.0)]);
            let work = Stage { timed_s: 1.5, ..Stage::new(name, bytes) }.doing([(Term::Pixel, 1e6)]);
            Forecast { stages: vec![start, work], output_bytes: 10.0, assumptions: vec!["so".into()], ..Forecast::default() }
        };
        let all = chain([("dirty", one("a", 3e6)), ("clean", one("b", 7e6)), ("clean", one("c", 5e6))]);
        assert_eq!(
            all.stages.iter().map(|s| (s.name, s.bytes)).collect::<Vec<_>>(),
            [("start", 0.0), ("dirty", 3e6), ("clean", 7e6 + LEFT)]
        );
        let start_s = speeds.seconds(Term::Command, 1);
        let sum = 3.0 * one("a", 0.0).seconds(&speeds, 1) - 2.0 * start_s;
        assert!((all.seconds(&speeds, 1) - sum).abs() < 1e-9);
        assert_eq!((all.output_bytes, all.assumptions[1].as_str()), (30.0, "clean: so"));
        assert!(shown("pictures", &Shown { pictures: 2.0, ..Shown::default() }).seconds(&speeds, 1) > 0.01);
    }
}
