//! `scene render --dry-run` and `scene fly --dry-run`.

use super::SceneCommand;
use super::image::{Mode, RenderArgs, frequency};
use super::render::{center, check_plain, scene_args};
use super::solids::{check_full, check_realtime, view};
use crate::cli::failure::{Context as _, Result};
use crate::cli::forecast::{Plan, Planner, Rendered, Told, rendered};
use crate::cli::options::read_scene;
use crate::cost::{self, Traced};
use cittert_arrays::SpectralWindow;
use cittert_phenomenology::{RenderOptions, Scene, SolidScene, View};
use serde_json::{Map, Value, json};
use std::path::Path;

impl SceneCommand {
    /// The subcommand as one whose time and memory are known before.
    pub(in crate::cli) fn plan(&self) -> Option<&dyn Plan> {
        match self {
            Self::Render(args) => Some(args.as_ref()),
            Self::Fly(args) => Some(args.as_ref()),
            _ => None,
        }
    }
}

/// Bytes of a pixel of an image, and of the same in the file that is written.
const IMAGE: f64 = 12.0;

/// What is said of a picture.
#[derive(Default)]
struct Facts(Map<String, Value>);

impl Facts {
    fn say(&mut self, name: &str, value: impl Into<Value>) {
        self.0.insert(name.to_owned(), value.into());
    }
}

impl Plan for RenderArgs {
    fn plan(&self, planner: &Planner<'_>) -> Result<Told> {
        planner.alone("renders a scene")?;
        planner.no_visibilities("a picture has none")?;
        let center = center(self)?;
        let described = self.scene.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"));
        let scene = if described { Some(read_scene(&self.scene)?) } else { None };
        let freq = frequency(self.freq, scene.as_ref().and_then(Scene::freq_hz), planner.context);
        let spectrum = SpectralWindow::band(freq.si(), self.bandwidth.si(), self.channels).context("--freq, --bandwidth and --channels")?;
        let mut facts = Facts::default();
        let work = if let Some(Scene::Solids(scene)) = scene {
            let scene = self.tracer.scene(*scene).context(self.scene.display())?;
            let view = view(self, &scene, &center).context(self.scene.display())?;
            self.of_solids(&scene, &view, &spectrum, &mut facts)?
        } else {
            check_plain(self)?;
            let (loaded, work) = scene_args(self).foreseen(&center, &spectrum, planner.context)?;
            let pixels = loaded.sky.images.first().map_or(0, |i| i.grid.n_l * i.grid.n_m);
            Traced { written: pixels as f64, ..work }
        };
        let mut forecast = cost::render(&work);
        if facts.0.contains_key("rays") {
            forecast.assumptions.push("the time of the rays is that of a few of them, followed on this machine".into());
        }
        Ok(Told { command: "scene render", forecast, facts: facts.0 })
    }

    fn output(&self) -> &Path {
        &self.out.output
    }
}

impl RenderArgs {
    /// The work on a scene of solids, with its maps.
    fn of_solids(&self, scene: &SolidScene, view: &View, spectrum: &SpectralWindow, facts: &mut Facts) -> Result<Traced> {
        let options = RenderOptions { causes: self.causes.is_some(), ..self.tracer.options(spectrum.n_chan() > 1) };
        let pixels = (view.grid().n_l * view.grid().n_m) as f64;
        let maps = self.maps().iter().flatten().count() + usize::from(self.model_error.is_some()) + usize::from(self.error_map.is_some());
        let planes = options.polarizations.len() * if options.per_channel { spectrum.n_chan() } else { 1 };
        let mut work = Traced { written: pixels * (planes + maps) as f64, ..Traced::default() };
        let add = |work: &mut Traced, seen: &Rendered, times: f64| {
            work.setup_s += times * seen.setup_s;
            work.trace_s += times * seen.trace_s;
            work.bytes = work.bytes.max(seen.bytes);
        };
        let full = || rendered(scene, view, spectrum, &options, None).context(self.scene.display());
        let seen = if self.mode == Mode::Realtime {
            check_realtime(self, &options)?;
            let mesh = self.mesh.options(options.antialias > 1);
            let frame = rendered(scene, view, spectrum, &options, Some(&mesh)).context(self.scene.display())?;
            if self.error_map.is_some() {
                add(&mut work, &full()?, 1.0);
            }
            // The tracer keeps the arrays of the frame while the image is made and written.
            work.bytes = work.bytes.max(frame.bytes + pixels * IMAGE);
            frame
        } else {
            check_full(self)?;
            full()?
        };
        add(&mut work, &seen, 1.0);
        if self.model_error.is_some() {
            // Two pictures of one plane for each material, with a permittivity that is too large and one that is too small.
            let one = RenderOptions { per_channel: false, polarizations: options.polarizations[..1].to_vec(), ..options.clone() };
            let times = 2.0 * scene.extended(spectrum.mean_hz()).len() as f64;
            add(&mut work, &rendered(scene, view, spectrum, &one, None).context(self.scene.display())?, times);
        }
        facts.say("size", json!([view.grid().n_l, view.grid().n_m]));
        facts.say("planes", planes);
        facts.say("rays", seen.rays.round());
        facts.say("sampled_pixels", seen.sampled);
        Ok(work)
    }
}
