//! Options of films and of the study of the frame rate.

use super::interferometer::ArrayImage;
use crate::Result;
use crate::enhance::Target;
use crate::values::need;
use cittert_arrays::quantity::{Duration, Temperature};
use serde::{Deserialize, Serialize};

/// A panel of a film.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum PanelKind {
    /// The scene as it is in the middle of the frame.
    Truth,
    /// What the filled aperture measures, with its noise and enhancement.
    Filled,
    /// The image of the interferometer.
    Array,
}

impl PanelKind {
    /// Its name in the film.
    #[must_use]
    pub fn caption(self) -> &'static str {
        match self {
            Self::Truth => "truth",
            Self::Filled => "filled aperture",
            Self::Array => "interferometer",
        }
    }
}

/// Which frames black and white follow from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Levels {
    /// The first frame.
    #[default]
    First,
    /// Nine frames over the whole film.
    Flight,
}

impl Levels {
    /// The frames of a film of `count` frames.
    #[must_use]
    pub fn frames(self, count: usize) -> Vec<usize> {
        let mut all: Vec<usize> = match self {
            Self::First => vec![0],
            Self::Flight => (0..9).map(|k| k * count.saturating_sub(1) / 8).collect(),
        };
        all.dedup();
        all
    }
}

/// The colours of a film.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Colors {
    /// Black to white.
    #[default]
    Grey,
    /// Black over red to yellow.
    Inferno,
}

/// A film: its frames, its panels and its colours.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args))]
pub struct FilmOptions {
    /// Frames per second of the camera, at which the film also plays [default: frames_per_second of the path].
    #[cfg_attr(feature = "cli", arg(long, value_name = "N"))]
    pub rate: Option<f64>,
    /// Number of frames [default: all frames of the path].
    #[cfg_attr(feature = "cli", arg(long, value_name = "N"))]
    pub frames: Option<usize>,
    /// Pictures of the scene over the time of a frame, whose mean the camera sees; 1 shows no motion blur.
    #[cfg_attr(feature = "cli", arg(long, value_name = "N", default_value_t = FilmOptions::default().exposures))]
    pub exposures: usize,
    /// Panels side by side, with commas between: truth, filled (the camera) or array (the interferometer of --layout).
    #[cfg_attr(feature = "cli", arg(long, value_name = "PANELS", value_enum, value_delimiter = ',', hide_possible_values = true, default_values_t = FilmOptions::default().show))]
    pub show: Vec<PanelKind>,
    /// Image of the interferometer: dirty or mem.
    #[cfg_attr(feature = "cli", arg(long, value_name = "KIND", value_enum, hide_possible_values = true, default_value_t = FilmOptions::default().array_image))]
    pub array_image: ArrayImage,
    /// The interferometer makes an image of every N-th frame, and the film shows it until the next.
    #[cfg_attr(feature = "cli", arg(long, value_name = "N", default_value_t = FilmOptions::default().every))]
    pub every: usize,
    /// Brightness that is drawn black [default: the 0.5th percentile of the frames of --levels].
    #[cfg_attr(feature = "cli", arg(long, value_name = "TEMP"))]
    pub black: Option<Temperature>,
    /// Brightness that is drawn white [default: the 99.5th percentile of the frames of --levels].
    #[cfg_attr(feature = "cli", arg(long, value_name = "TEMP"))]
    pub white: Option<Temperature>,
    /// Frames that black and white follow from, the same for the whole film: first, or flight (nine frames over the whole film).
    #[cfg_attr(feature = "cli", arg(long, value_name = "FRAMES", value_enum, hide_possible_values = true, default_value_t = FilmOptions::default().levels))]
    pub levels: Levels,
    /// Colours: grey or inferno.
    #[cfg_attr(feature = "cli", arg(long, value_name = "NAME", value_enum, hide_possible_values = true, default_value_t = FilmOptions::default().colors))]
    pub colors: Colors,
    /// Write no names above the panels.
    #[cfg_attr(feature = "cli", arg(long))]
    pub no_names: bool,
}

impl Default for FilmOptions {
    fn default() -> Self {
        Self {
            rate: None,
            frames: None,
            exposures: 1,
            show: vec![PanelKind::Filled],
            array_image: ArrayImage::Dirty,
            every: 1,
            black: None,
            white: None,
            levels: Levels::First,
            colors: Colors::Grey,
            no_names: false,
        }
    }
}

impl FilmOptions {
    /// Refuse a film that cannot be made.
    ///
    /// # Errors
    /// A number out of its range, or a panel that is named twice.
    pub fn check(&self) -> Result<()> {
        let rate = self.rate.unwrap_or(1.0);
        need("rate", rate, rate > 0.0 && rate.is_finite(), "frames per second above 0")?;
        need("frames", self.frames.unwrap_or(1), self.frames != Some(0), "1 or more")?;
        need("exposures", self.exposures, (1..=1000).contains(&self.exposures), "1 to 1000")?;
        need("every", self.every, self.every > 0, "1 or more")?;
        let twice = self.show.iter().enumerate().find(|(k, panel)| self.show[..*k].contains(panel));
        need("show", twice.map_or("", |(_, panel)| panel.caption()), twice.is_none(), "each panel once")
    }

    /// True if a panel is shown.
    #[must_use]
    pub fn shows(&self, panel: PanelKind) -> bool {
        self.show.contains(&panel)
    }
}

/// A study of the frame rate instead of a film.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args))]
pub struct RateOptions {
    /// Frames per second that are compared, with commas between. The output is then a table (CSV), with a picture beside it.
    #[cfg_attr(feature = "cli", arg(long, value_name = "LIST", value_delimiter = ','))]
    pub rates: Vec<f64>,
    /// Disc around a target: column, row (from 0 at the lower left) and radius in pixels of a frame [default: no target].
    #[cfg_attr(feature = "cli", arg(long, value_name = "X,Y,R", requires = "rates", allow_hyphen_values = true))]
    pub target: Option<Target>,
    /// Surface of the scene as the target, such as paint: all pixels that show it, or those in the disc of --target.
    #[cfg_attr(feature = "cli", arg(long, value_name = "NAME", requires = "rates"))]
    pub target_surface: Option<String>,
    /// Time on the path at the middle of the frames that are compared [default: the middle of the path].
    #[cfg_attr(feature = "cli", arg(long, value_name = "TIME", requires = "rates"))]
    pub at: Option<Duration>,
    /// Number of frames with independent noise for each rate.
    #[cfg_attr(feature = "cli", arg(long, value_name = "N", default_value_t = RateOptions::default().seeds))]
    pub seeds: usize,
}

impl Default for RateOptions {
    fn default() -> Self {
        Self { rates: Vec::new(), target: None, target_surface: None, at: None, seeds: 8 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_frames_of_the_levels_span_the_film() {
        assert_eq!(Levels::First.frames(100), [0]);
        assert_eq!(Levels::Flight.frames(81), [0, 10, 20, 30, 40, 50, 60, 70, 80]);
        assert_eq!(Levels::Flight.frames(3), [0, 1, 2]);
        assert_eq!(Levels::Flight.frames(1), [0]);
    }

    #[test]
    fn films_that_cannot_be_made_are_refused() {
        let told = |options: FilmOptions| options.check().map_err(|e| e.to_string());
        let of = FilmOptions::default;
        assert!(told(of()).is_ok());
        assert!(told(FilmOptions { rate: Some(-5.0), ..of() }).unwrap_err().contains("rate is -5"));
        assert!(told(FilmOptions { frames: Some(0), ..of() }).unwrap_err().contains("frames"));
        assert!(told(FilmOptions { every: 0, ..of() }).unwrap_err().contains("every"));
        assert!(told(FilmOptions { exposures: 0, ..of() }).unwrap_err().contains("exposures"));
        assert!(told(FilmOptions { show: vec![PanelKind::Truth, PanelKind::Truth], ..of() }).unwrap_err().contains("truth"));
    }
}
