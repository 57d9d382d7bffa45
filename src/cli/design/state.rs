//! What the page shows: a layout, and sections of options as in the file of `run`.

use crate::cli::failure::{Context as _, Failure, Result, ensure};
use crate::cli::sections::{SceneSection, Section, SelfcalSection, SimulateSection};
use crate::corrupt::ErrorOptions;
use crate::deconvolve::CleanOptions;
use crate::imaging::ImagingOptions;
use crate::mem::MemOptions;
use cittert_arrays::ArrayLayout;
use serde::Deserialize;

/// Most antennas of a layout on the page.
pub(super) const MOST_ANTENNAS: usize = 10_000;
/// Most pixels of an image or a scene on the page.
pub(super) const MOST_PIXELS: usize = 4096 * 4096;
/// Most visibilities that the page computes.
pub(super) const MOST_VISIBILITIES: u64 = 50_000_000;

/// The state of a page. The keys of its sections are the options of the subcommands.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct State {
    /// The layout, with the keys of a layout file.
    pub(super) layout: toml::Value,
    /// What is observed. Without a scene it is a point.
    pub(super) scene: Option<Section<SceneSection>>,
    /// Band, track and noise.
    pub(super) simulate: Section<SimulateSection>,
    /// Options of every image.
    #[serde(default)]
    pub(super) image: Section<ImagingOptions>,
    /// Errors of the antennas.
    #[serde(default)]
    pub(super) corrupt: Section<ErrorOptions>,
    pub(super) clean: Option<Section<CleanOptions>>,
    pub(super) mem: Option<Section<MemOptions>>,
    pub(super) selfcal: Option<Section<SelfcalSection>>,
    /// Seed of every random draw.
    #[serde(default = "first_seed")]
    pub(super) seed: u64,
}

fn first_seed() -> u64 {
    1
}

/// The options that the page may set. Others could name files of this machine, or are not for a page that answers at once.
const KEYS: [(&str, &[&str]); 7] = [
    ("scene", &["file", "scene-cell", "scene-size", "scene-min", "scene-max"]),
    (
        "simulate",
        &[
            "freq",
            "bandwidth",
            "channels",
            "phase-center",
            "start",
            "duration",
            "hour-angle",
            "integration",
            "elevation-limit",
            "element",
            "element-diameter",
            "element-width",
            "noise",
            "sefd",
            "tsys",
            "aperture-efficiency",
        ],
    ),
    ("image", &["size", "cell", "weighting", "robust", "taper", "super-uniform"]),
    (
        "corrupt",
        &["phase-rms", "amp-rms", "position-rms", "delay-rms", "troposphere", "dropout", "dropout-length", "dropout-noticed", "variation"],
    ),
    ("clean", &["algorithm", "niter", "gain", "nsigma", "threshold", "mgain", "scales", "no-negative"]),
    ("mem", &["niter", "noise", "flux", "entropy", "total-variation", "uncertainty"]),
    ("selfcal", &["mode", "solint", "rounds", "algorithm", "deconvolver", "force"]),
];

impl State {
    /// The layout.
    ///
    /// # Errors
    /// Too many antennas or fewer than two, or a layout that no file could hold.
    pub(super) fn array(&self) -> Result<ArrayLayout> {
        let layout = layout(&self.layout)?;
        ensure!(layout.n_ant() >= 2, Failure::message("a baseline needs two antennas: add some"));
        Ok(layout)
    }

    /// Check the options against those that a page may set.
    ///
    /// # Errors
    /// An option that is not among them, or too many pixels.
    pub(super) fn check(&self) -> Result<()> {
        let empty = toml::Table::new();
        let of = |name: &str| match name {
            "scene" => self.scene.as_ref().map_or(&empty, |s| &s.keys),
            "simulate" => &self.simulate.keys,
            "image" => &self.image.keys,
            "corrupt" => &self.corrupt.keys,
            "clean" => self.clean.as_ref().map_or(&empty, |s| &s.keys),
            "mem" => self.mem.as_ref().map_or(&empty, |s| &s.keys),
            _ => self.selfcal.as_ref().map_or(&empty, |s| &s.keys),
        };
        for (section, _) in KEYS {
            check_keys(section, of(section))?;
        }
        let sides = self.image.options.size.map_or((0, 0), |s| (s.columns, s.rows));
        let scene = self.scene.as_ref().and_then(|s| s.options.how.scene_size).unwrap_or(0);
        check_pixels("the image", sides)?;
        check_pixels("the scene", (scene, scene))?;
        let seed = format!("the seed is {}, expected at most {}", self.seed, i64::MAX);
        ensure!(i64::try_from(self.seed).is_ok(), Failure::message(seed));
        self.image.options.check().context("image")
    }
}

/// Check the keys of a section against those that a page may set.
///
/// # Errors
/// One that is not among them.
pub(super) fn check_keys(section: &str, keys: &toml::Table) -> Result<()> {
    let allowed = KEYS.iter().find(|(name, _)| *name == section).map_or(&[][..], |(_, allowed)| allowed);
    for key in keys.keys() {
        ensure!(allowed.contains(&key.as_str()), Failure::message(format!("{section}: the page does not set {key}; a file of `run` can")));
    }
    Ok(())
}

/// Refuse an image that is too large for the page.
///
/// # Errors
/// It has too many pixels.
pub(super) fn check_pixels(what: &str, (columns, rows): (usize, usize)) -> Result<()> {
    let pixels = columns.saturating_mul(rows);
    let text = format!("{what} has {columns} x {rows} pixels, and the page shows at most {MOST_PIXELS} (4096 x 4096): choose fewer");
    ensure!(pixels <= MOST_PIXELS, Failure::message(text));
    Ok(())
}

/// Refuse a layout with too many antennas for the page.
///
/// # Errors
/// There are too many.
pub(super) fn check_size(layout: &ArrayLayout) -> Result<()> {
    check_count(layout.n_ant())
}

fn check_count(count: usize) -> Result<()> {
    let text = format!("the layout has {count} antennas, and the page shows at most {MOST_ANTENNAS}: choose fewer");
    ensure!(count <= MOST_ANTENNAS, Failure::message(text));
    Ok(())
}

/// A layout from the keys of a layout file.
///
/// # Errors
/// Too many antennas, or what no layout file may hold.
pub(super) fn layout(keys: &toml::Value) -> Result<ArrayLayout> {
    check_count(keys.get("antenna").and_then(toml::Value::as_array).map_or(0, Vec::len))?;
    let text = toml::to_string(keys).map_err(|e| Failure::message(format!("the layout cannot be written as TOML: {e}")))?;
    Ok(ArrayLayout::from_toml(&text)?)
}

/// The keys of the file of a layout.
///
/// # Errors
/// None in practice: the text is TOML.
pub(super) fn keys(layout: &ArrayLayout) -> Result<serde_json::Value> {
    let table: toml::Table = toml::from_str(&layout.to_toml())?;
    Ok(serde_json::to_value(table)?)
}
