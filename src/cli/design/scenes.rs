//! The scenes of the page: those that the program ships, that of the command line, and files that were dropped on the page.

use super::state::{MOST_PIXELS, check_pixels};
use crate::cli::context::Context;
use crate::cli::failure::{Context as _, Failure, Result, ensure};
use crate::cli::options::{LoadedScene, SceneArgs, read_scene};
use crate::simulate::SceneOptions;
use cittert_arrays::{PhaseCenter, SpectralWindow};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
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
/// Most pixels of the rendered scenes that are kept for all tabs together.
const RENDERED: usize = 2 * MOST_PIXELS;
/// Most sources of a list.
const MOST_SOURCES: usize = 100_000;
/// Largest dropped text that is printed with the commands, bytes.
const MOST_TEXT: u64 = 200_000;
/// Names of files that the printed commands write or read.
const TAKEN: [&str; 2] = ["layout.toml", "point.csv"];

type Key = String;

/// The scenes by name.
pub(super) struct Scenes {
    folder: PathBuf,
    files: Mutex<BTreeMap<String, PathBuf>>,
    rendered: Mutex<Vec<(Key, Arc<LoadedScene>)>>,
    /// Number of files that were written.
    drafts: AtomicUsize,
}

impl Scenes {
    /// The shipped scenes. Dropped files go into `folder`.
    pub(super) fn new(folder: PathBuf) -> Self {
        Self { folder, files: Mutex::default(), rendered: Mutex::default(), drafts: AtomicUsize::new(0) }
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
        // The printed commands name it, and may be run in another folder.
        let path = std::path::absolute(path).context(path.display())?;
        let name = path.display().to_string();
        self.insert(&name, path);
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
        let taken = TAKEN.contains(&name.as_str()) || self.shipped(&name).is_some();
        let name = if taken { format!("scene-{name}") } else { name };
        check_picture(&name, bytes)?;
        let count = self.files.lock().unwrap_or_else(PoisonError::into_inner).len();
        ensure!(count < MOST, Failure::message(format!("{MOST} files were dropped already: start the program anew")));
        self.write(&name, bytes)?;
        self.rendered.lock().unwrap_or_else(PoisonError::into_inner).clear();
        Ok(name)
    }

    /// Put a file into the folder in one step, as another tab may be reading the one before it.
    fn write(&self, name: &str, bytes: &[u8]) -> Result<PathBuf> {
        let what = || format!("keeping {name}");
        let (path, draft) = (self.folder.join(name), self.folder.join(format!(".draft-{}", self.drafts.fetch_add(1, Ordering::Relaxed))));
        std::fs::write(&draft, bytes).context(what())?;
        std::fs::rename(&draft, &path).context(what())?;
        self.insert(name, path.clone());
        Ok(path)
    }

    /// Names of all scenes.
    pub(super) fn names(&self) -> Vec<String> {
        let own = self.files.lock().unwrap_or_else(PoisonError::into_inner);
        let shipped = SHIPPED.iter().chain([&POINTS]).map(|(name, _)| (*name).to_owned());
        own.keys().filter(|k| self.shipped(k).is_none()).cloned().chain(shipped).collect()
    }

    fn shipped(&self, name: &str) -> Option<&'static str> {
        SHIPPED.iter().chain([&POINTS]).find(|(n, _)| *n == name).map(|(_, text)| *text)
    }

    /// The text of a shipped scene, or of a dropped one that is text and not long.
    pub(super) fn text(&self, name: &str) -> Option<String> {
        if let Some(text) = self.shipped(name) {
            return Some(text.to_owned());
        }
        let path = self.files.lock().unwrap_or_else(PoisonError::into_inner).get(name)?.clone();
        let dropped = path.starts_with(&self.folder) && std::fs::metadata(&path).is_ok_and(|m| m.len() <= MOST_TEXT);
        if dropped { std::fs::read_to_string(path).ok().filter(|t| !t.contains('\0')) } else { None }
    }

    /// The file of a scene.
    ///
    /// # Errors
    /// There is no such scene, or an error of the file system.
    pub(super) fn path(&self, name: &str) -> Result<PathBuf> {
        if let Some(path) = self.files.lock().unwrap_or_else(PoisonError::into_inner).get(name) {
            return Ok(path.clone());
        }
        let text = self.shipped(name).ok_or_else(|| {
            Failure::message(format!(
                "there is no scene {name:?} here: drop its file on the page; the others are {}",
                self.names().join(", ")
            ))
        })?;
        self.write(name, text.as_bytes())
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
        let shown = |e: Failure| e.renamed(&args.scene.display().to_string(), name);
        if Path::new(name).extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
            let grid = read_scene(&args.scene).and_then(|s| Ok(s.natural_grid(how.scene_size)?)).map_err(shown)?;
            check_pixels(name, grid.map_or((0, 0), |g| (g.n_l, g.n_m)))?;
        }
        let loaded = Arc::new(args.load(center, spectrum, context).map_err(shown)?);
        let sources = loaded.sky.sources.len();
        let text = format!("{name} has {sources} sources, and the page shows at most {MOST_SOURCES}: choose fewer");
        ensure!(sources <= MOST_SOURCES, Failure::message(text));
        let pixels = |scene: &LoadedScene| scene.sky.images.iter().map(|i| i.grid.n_l * i.grid.n_m).sum::<usize>();
        for image in &loaded.sky.images {
            check_pixels(name, (image.grid.n_l, image.grid.n_m))?;
        }
        let mut kept = self.rendered.lock().unwrap_or_else(PoisonError::into_inner);
        kept.push((key, loaded.clone()));
        while kept.len() > MOST || (kept.len() > 1 && kept.iter().map(|(_, s)| pixels(s)).sum::<usize>() > RENDERED) {
            kept.remove(0);
        }
        Ok(loaded)
    }
}

/// Refuse a dropped file that would be too large once it is unpacked.
fn check_picture(name: &str, bytes: &[u8]) -> Result<()> {
    ensure!(!bytes.starts_with(&[0x1f, 0x8b]), Failure::message(format!("{name}: the page takes no gzip files: unpack it first")));
    // The sizes are in the first chunk of a PNG.
    if let (true, Some(sides)) = (bytes.starts_with(b"\x89PNG"), bytes.get(16..24)) {
        let side = |k: usize| u32::from_be_bytes([sides[k], sides[k + 1], sides[k + 2], sides[k + 3]]) as usize;
        check_pixels(name, (side(0), side(4)))?;
    }
    Ok(())
}
