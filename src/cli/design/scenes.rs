//! The scenes of the page: those that the program ships, that of the command line, and files that were dropped on the page.

use super::state::MOST_PIXELS;
use crate::cli::context::Context;
use crate::cli::failure::{Context as _, Failure, Result, ensure};
use crate::cli::options::{LoadedScene, SceneArgs};
use crate::simulate::SceneOptions;
use cittert_arrays::{PhaseCenter, SpectralWindow};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// The scene of a page that is opened without one.
pub(super) const FIRST: &str = "airport.toml";

/// The shipped scenes that need no file beside them.
const SHIPPED: [(&str, &str); 5] = [
    (FIRST, include_str!("../../../phenomenology/scenes/airport.toml")),
    ("bmp-1.toml", include_str!("../../../phenomenology/scenes/bmp-1.toml")),
    ("t-72.toml", include_str!("../../../phenomenology/scenes/t-72.toml")),
    ("ss-24.toml", include_str!("../../../phenomenology/scenes/ss-24.toml")),
    ("ship.toml", include_str!("../../../phenomenology/scenes/ship.toml")),
];
/// Two points, by which the beam shows itself.
const POINTS: (&str, &str) = ("points.csv", "l_rad,m_rad,flux_jy\n0,0,1\n0.02,0.012,0.5\n-0.015,0.02,0.3\n");
/// Most files that are kept.
const MOST: usize = 100;
/// Most rendered scenes that are kept for all tabs together.
const RENDERED: usize = 8;

type Key = String;

/// The scenes by name.
pub(super) struct Scenes {
    folder: PathBuf,
    files: Mutex<BTreeMap<String, PathBuf>>,
    rendered: Mutex<Vec<(Key, Arc<LoadedScene>)>>,
}

impl Scenes {
    /// The shipped scenes. Dropped files go into `folder`.
    pub(super) fn new(folder: PathBuf) -> Self {
        Self { folder, files: Mutex::default(), rendered: Mutex::default() }
    }

    /// The folder of dropped files.
    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }

    /// Add a file of this machine under the name that was given.
    ///
    /// # Errors
    /// There is no such file.
    pub(super) fn add_file(&self, path: &Path) -> Result<String> {
        let meta = std::fs::metadata(path).context(format!("{}: cannot read the scene", path.display()))?;
        ensure!(meta.is_file(), Failure::message(format!("{}: it is no file, expected a scene (FITS, PNG, CSV or TOML)", path.display())));
        let name = path.display().to_string();
        self.insert(&name, path.to_path_buf());
        Ok(name)
    }

    fn insert(&self, name: &str, path: PathBuf) {
        self.files.lock().unwrap_or_else(PoisonError::into_inner).insert(name.to_owned(), path);
    }

    /// Keep a dropped file, and return its name.
    ///
    /// # Errors
    /// A name that cannot be that of a file, too many files, or an error of the file system.
    pub(super) fn add(&self, name: &str, bytes: &[u8]) -> Result<String> {
        let good = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
        let name: String = name.chars().map(|c| if good(c) { c } else { '-' }).take(80).collect();
        let name = name.trim_start_matches(['.', '-']).to_owned();
        ensure!(!name.is_empty(), Failure::message("the file has no name: rename it"));
        let count = self.files.lock().unwrap_or_else(PoisonError::into_inner).len();
        ensure!(count < MOST, Failure::message(format!("{MOST} files were dropped already: start the program anew")));
        let path = self.folder.join(&name);
        std::fs::write(&path, bytes).context(format!("keeping {name}"))?;
        self.rendered.lock().unwrap_or_else(PoisonError::into_inner).clear();
        self.insert(&name, path);
        Ok(name)
    }

    /// Names of all scenes.
    pub(super) fn names(&self) -> Vec<String> {
        let own = self.files.lock().unwrap_or_else(PoisonError::into_inner);
        let shipped = SHIPPED.iter().chain([&POINTS]).map(|(name, _)| (*name).to_owned());
        own.keys().filter(|k| self.text(k).is_none()).cloned().chain(shipped).collect()
    }

    /// The text of a shipped scene.
    pub(super) fn text(&self, name: &str) -> Option<&'static str> {
        SHIPPED.iter().chain([&POINTS]).find(|(n, _)| *n == name).map(|(_, text)| *text)
    }

    /// The file of a scene.
    ///
    /// # Errors
    /// There is no such scene, or an error of the file system.
    pub(super) fn path(&self, name: &str) -> Result<PathBuf> {
        if let Some(path) = self.files.lock().unwrap_or_else(PoisonError::into_inner).get(name) {
            return Ok(path.clone());
        }
        let text = self.text(name).ok_or_else(|| {
            Failure::message(format!(
                "there is no scene {name:?} here: drop its file on the page; the others are {}",
                self.names().join(", ")
            ))
        })?;
        let path = self.folder.join(name);
        std::fs::write(&path, text).context(format!("keeping {name}"))?;
        self.insert(name, path.clone());
        Ok(path)
    }

    /// A scene as it is seen around a phase centre. A scene that was rendered before is not rendered again.
    ///
    /// # Errors
    /// As [`SceneArgs::load`]; too many pixels.
    pub(super) fn load(
        &self,
        (name, how): (&str, &SceneOptions),
        center: &PhaseCenter,
        spectrum: &SpectralWindow,
        context: &Context,
    ) -> Result<Arc<LoadedScene>> {
        let key = format!("{name} {how:?} {center:?} {:?}", (spectrum.mean_hz(), spectrum.extent_hz()));
        let find = |all: &[(Key, Arc<LoadedScene>)]| all.iter().find(|(k, _)| *k == key).map(|(_, s)| s.clone());
        if let Some(found) = find(&self.rendered.lock().unwrap_or_else(PoisonError::into_inner)) {
            return Ok(found);
        }
        let args = SceneArgs { scene: self.path(name)?, how: how.clone() };
        let loaded = Arc::new(args.load(center, spectrum, context)?);
        let pixels = loaded.sky.images.iter().map(|i| i.grid.n_l * i.grid.n_m).max().unwrap_or(0);
        let text = format!("{name} has {pixels} pixels, and the page shows at most {MOST_PIXELS} (4096 x 4096): make it smaller first");
        ensure!(pixels <= MOST_PIXELS, Failure::message(text));
        let mut kept = self.rendered.lock().unwrap_or_else(PoisonError::into_inner);
        if kept.len() >= RENDERED {
            kept.remove(0);
        }
        kept.push((key, loaded.clone()));
        Ok(loaded)
    }
}
