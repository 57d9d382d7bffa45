//! The film: frames of all panels, from the path to the file.

use super::args::FilmArgs;
use super::cameras::{Scenery, psf};
use crate::cli::context::{Context, Outcome};
use crate::cli::failure::{Context as _, Failure, Result};
use crate::display::film::{FilmKind, FilmSpec, FrameRate};
use crate::display::{Aperture, Colors, Interferometer, Palette, PanelKind, Run, Sheet, Stages, Tone, exposed};
use crate::enhance::{Psf, Setting, StepList, enhance};
use crate::memory::{ImageWork, check_images};
use crate::plot::{inferno, name_strip};
use crate::{ChainError, progress::Observer};
use cittert_arrays::{BrightnessUnit, Image};
use cittert_formats::atomic::AtomicFile;
use ndarray::Array2;
use serde_json::json;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// The scene of a frame.
struct Seen {
    truth: Image,
    /// The mean over the time of the frame; `None` where it is the scene in its middle.
    blurred: Option<Image>,
}

/// What the cameras measure of it.
struct Measured {
    truth: Array2<f64>,
    filled: Option<Image>,
    array: Option<Arc<Array2<f64>>>,
}

/// What the stages of all frames share.
struct Maker<'a> {
    args: &'a FilmArgs,
    scenery: &'a Scenery<'a>,
    aperture: Aperture,
    psf: Option<Psf>,
    times_s: Vec<f64>,
    rate_hz: f64,
}

impl Maker<'_> {
    fn see(&self, k: usize) -> crate::Result<Seen> {
        let n = self.args.film.exposures;
        let mut plane = |t: f64| Ok(self.scenery.at(t)?.plane(0, 0).to_owned());
        let blurred = if n == 1 { None } else { Some(exposed(&mut plane, self.times_s[k], 1.0 / self.rate_hz, n)?) };
        Ok(Seen { truth: self.scenery.at(self.times_s[k])?, blurred: blurred.map(|p| self.scenery.image(p)).transpose()? })
    }

    /// What the filled aperture measures, if it is shown.
    fn filled(&self, seen: &Seen, run: &mut Run) -> crate::Result<Option<Image>> {
        let wanted = self.args.film.shows(PanelKind::Filled);
        wanted.then(|| self.aperture.frame(seen.blurred.as_ref().unwrap_or(&seen.truth), run)).transpose()
    }

    /// The planes of the panels, in their order.
    fn planes(&self, measured: Measured) -> crate::Result<Vec<Arc<Array2<f64>>>> {
        let Measured { truth, filled, array } = measured;
        let truth = Arc::new(truth);
        let one = |panel: &PanelKind| match panel {
            PanelKind::Truth => Ok(truth.clone()),
            PanelKind::Filled => {
                let frame = filled.as_ref().ok_or_else(|| ChainError::Internal("a panel without a frame".into()))?;
                let plane = match &self.args.camera.steps {
                    Some(steps) => enhance(std::slice::from_ref(frame), steps, self.psf.as_ref())?.plane(0, 0).to_owned(),
                    None => frame.plane(0, 0).to_owned(),
                };
                Ok(Arc::new(plane))
            }
            PanelKind::Array => array.clone().ok_or_else(|| ChainError::Internal("a panel without an image".into())),
        };
        self.args.film.show.iter().map(one).collect()
    }

    /// Black and white, from the scene or from what the filled aperture shows of it, and the size of a panel.
    fn tone(&self) -> crate::Result<(Tone, (usize, usize))> {
        let film = &self.args.film;
        let frames = film.levels.frames(self.times_s.len());
        let (mut all, mut size) = (Vec::new(), (self.scenery.grid.n_l, self.scenery.grid.n_m));
        for k in frames {
            let seen = self.see(k)?;
            let filled = self.filled(&seen, &mut self.aperture.begin(self.args.camera.seed))?;
            let truth = seen.truth.plane(0, 0).to_owned();
            let array = film.shows(PanelKind::Array).then(|| Arc::new(truth.clone()));
            let planes = self.planes(Measured { truth, filled, array })?;
            for plane in &planes {
                size = (size.0.max(plane.ncols()), size.1.max(plane.nrows()));
            }
            all.extend(planes);
        }
        let limits = [film.black, film.white].map(|t| t.map(|t| t.si()));
        Ok((Tone::of(all.iter().map(|p| p.view()), limits[0], limits[1])?, size))
    }

    fn sheet(&self, size: (usize, usize)) -> crate::Result<Sheet> {
        let film = &self.args.film;
        let sheet = Sheet::new(film.show.len(), size);
        if film.no_names || film.show.len() < 2 {
            return Ok(sheet);
        }
        let names: Vec<Array2<u8>> = film.show.iter().map(|p| name_strip(p.caption(), size.0)).collect::<crate::Result<_>>()?;
        sheet.with_names(&names)
    }
}

/// What a film is made of, before its first frame.
pub(super) struct Reel<'a> {
    maker: Maker<'a>,
    kind: &'static FilmKind,
    spec: FilmSpec,
    array: Option<Interferometer>,
    /// Noise of the filled aperture in the first frame, K.
    nedt_k: f64,
}

/// What was made.
pub(super) struct Made {
    spec: FilmSpec,
    tone: Tone,
    /// Time of the frames from which black and white follow, and of all frames, s.
    pub(super) seconds: (f64, f64),
}

/// Read everything, refuse what cannot be, and hand the film over to `work`.
///
/// # Errors
/// A path, a scene or an option that is wrong, a program that is missing, and the errors of `work`.
pub(super) fn with_reel<R>(args: &FilmArgs, context: &Context, work: impl FnOnce(Reel<'_>, &str) -> Result<R>) -> Result<R> {
    let output = &args.out.output;
    let (mut flight, scene) = args.flight.read("film")?;
    let kind = FilmKind::of(output).map_err(|e| Failure::usage(e.to_string().replacen("output is", "-o", 1)))?;
    if let Some(rate) = args.film.rate {
        flight.frames_per_second = rate;
        flight.check().context(args.flight.path.display())?;
    }
    let rate = FrameRate::new(flight.frames_per_second).map_err(Failure::call)?;
    let given = psf(args)?;
    let flown = args.flight.open(flight, &scene, true, context)?;
    flown.cameras()?;
    let [columns, rows] = flown.base.size_px;
    let palette = match args.film.colors {
        Colors::Grey => Palette::grey(),
        Colors::Inferno => Palette::new(inferno),
    };
    // Sizes are refused before any frame is made.
    let mut spec = FilmSpec { width: columns, height: rows, frames: 1, rate, palette, history: context.history() };
    kind.check(&spec).map_err(Failure::call)?;
    check_images((columns, rows), ImageWork::Entropy).map_err(Failure::call)?;
    let scenery = Scenery::new(&flown, args)?;
    let mut times_s = flown.flight.times_s();
    times_s.truncate(args.film.frames.unwrap_or(usize::MAX));
    let rate_hz = flown.flight.frames_per_second;
    let aperture = scenery.aperture(args, rate_hz).map_err(Failure::call)?;
    let needs_psf = given.is_none() && args.camera.steps.as_ref().is_some_and(StepList::needs_psf);
    let psf = if needs_psf { aperture.psf()? } else { given };
    if let Some(steps) = &args.camera.steps {
        let setting = Setting { unit: BrightnessUnit::Kelvin, cell_rad: aperture.grid().cell_rad, psf: psf.as_ref() };
        let factor = steps.chain(&setting).map_err(Failure::call)?.factor();
        (spec.width, spec.height) = (aperture.grid().n_l.saturating_mul(factor), aperture.grid().n_m.saturating_mul(factor));
        kind.check(&spec).map_err(Failure::call)?;
    }
    let array = scenery.interferometer(args, rate_hz)?;
    let maker = Maker { args, scenery: &scenery, aperture, psf, times_s, rate_hz };

    let first = maker.see(0)?;
    let nedt_k = maker.aperture.nedt_k(&first.truth)?;
    if !scenery.has_noise(args) && args.film.shows(PanelKind::Filled) {
        context.console.note("the filled aperture has no noise: give --tsys, or a --sensor with noise");
    }
    work(Reel { maker, kind, spec, array, nedt_k }, flown.name())
}

impl Reel<'_> {
    /// Number of frames.
    pub(super) fn frames(&self) -> usize {
        self.maker.times_s.len()
    }

    /// Number of frames from which black and white follow, of a film of so many frames.
    pub(super) fn frames_of_levels(&self, frames: usize) -> usize {
        self.maker.args.film.levels.frames(frames).len()
    }

    /// Keep about `count` frames, spread over the film.
    pub(super) fn thin(&mut self, count: usize) {
        let all = self.frames();
        let kept = count.clamp(1, all.max(1));
        self.maker.times_s = (0..kept).filter_map(|k| self.maker.times_s.get(k * all / kept).copied()).collect();
    }

    /// Make all frames, and write them to `path`.
    ///
    /// # Errors
    /// A ray that leaves the tables, or an error of the file system.
    pub(super) fn make(self, path: &Path, observer: &dyn Observer) -> Result<Made> {
        let Self { maker, kind, mut spec, array, .. } = self;
        let frames = maker.times_s.len();
        let begun = Instant::now();
        let (tone, size) = maker.tone().map_err(Failure::call)?;
        let sheet = maker.sheet(size)?;
        (spec.width, spec.height, spec.frames) = (sheet.width(), sheet.height(), frames);
        kind.check(&spec).map_err(Failure::call)?;

        let started = Instant::now();
        let mut film = kind.begin(path, &spec)?;
        let (mut run, mut held) = (maker.aperture.begin(maker.args.camera.seed), None);
        let stages = Stages {
            see: |k: usize| maker.see(k),
            measure: |k: usize, seen: Seen| {
                if let Some(array) = array.as_ref().filter(|_| k.is_multiple_of(maker.args.film.every)) {
                    // Visibilities are linear in the scene, so those of its mean are the mean over the time of the frame.
                    held = Some(Arc::new(array.frame(seen.blurred.as_ref().unwrap_or(&seen.truth), k as u64)?));
                }
                Ok(Measured { filled: maker.filled(&seen, &mut run)?, truth: seen.truth.plane(0, 0).to_owned(), array: held.clone() })
            },
            show: |_: usize, measured: Measured| {
                let planes = maker.planes(measured)?;
                let views: Vec<_> = planes.iter().map(|p| p.view()).collect();
                sheet.levels(&views, tone)
            },
            write: |_: usize, levels: Vec<u8>| film.frame(&levels),
        };
        stages.run(frames, observer).map_err(Failure::call)?;
        film.finish()?;
        Ok(Made { spec, tone, seconds: ((started - begun).as_secs_f64(), started.elapsed().as_secs_f64()) })
    }
}

/// Make the film.
///
/// # Errors
/// A path, a scene or an option that is wrong, a program that is missing, or an error of the file system.
pub(super) fn run(args: &FilmArgs, context: &Context) -> Result<Outcome> {
    let output = &args.out.output;
    let (_, scene) = args.flight.read("film")?;
    args.out.claim([output], args.inputs(&scene))?;
    with_reel(args, context, |reel, scene| {
        let (frames, kind, nedt_k, dwell_s) = (reel.frames(), reel.kind, reel.nedt_k, reel.maker.aperture.dwell_s());
        let file = AtomicFile::create(output, args.out.overwrite)?;
        let Made { spec, tone, seconds: (_, seconds) } = reel.make(file.path(), &context.console).context(output.display())?;
        file.commit()?;

        let panels: Vec<&str> = args.film.show.iter().map(|p| p.caption()).collect();
        let rate = spec.rate;
        let json = json!({
            "output": output, "format": kind.name, "scene": scene, "frames": frames, "rate_hz": rate.hz(),
            "size": [spec.width, spec.height], "panels": panels, "black_k": tone.black, "white_k": tone.white,
            "dwell_s": dwell_s, "nedt_k": nedt_k, "seconds": seconds, "seed": args.camera.seed,
        });
        let text = format!(
            "{}: {frames} frames of {} x {} pixels at {} per second, black {:.1} K, white {:.1} K, noise {nedt_k:.3} K, made in {seconds:.1} s",
            output.display(),
            spec.width,
            spec.height,
            rate.hz(),
            tone.black,
            tone.white
        );
        Ok(Outcome::new(json, text).wrote(output))
    })
}
