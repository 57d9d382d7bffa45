//! Makes what trials share: the observation of a point, its errors and its self-calibration.

use super::config::{Choose, Config};
use crate::calibrate::StartFrom;
use crate::cli::airs::Airs;
use crate::cli::context::Context;
use crate::cli::failure::{Context as _, Failure, Result, ensure};
use crate::cli::made::Origin;
use crate::cli::options::{SceneArgs, load_layout, loaded};
use crate::cli::scene_errors::{band_files, read_bands};
use crate::cli::sections::{ScenePoint, StudySelfcalSection};
use crate::imaging::ImageSize;
use crate::progress::Silent;
use crate::simulate::{PlannedTrack, SkyModel, simulate_set};
use crate::study::{Antennas, Base, Deconvolution, SelfcalPlan, Setup};
use cittert_arrays::{ArrayLayout, SkyFrame, SkyGrid, Source, VisUnit};
use ndarray::Array2;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Finished bases. The key is the text of the sections that they are made from.
type Bases = HashMap<String, (Arc<Base>, VisUnit)>;

/// The file of a study, from which the trials of any point are made.
pub(super) struct Setups {
    table: toml::Table,
    /// Folder of the file.
    folder: PathBuf,
    bases: Bases,
    files: Files,
    /// Bases are made on one thread, so that they have the same bytes with any number of threads.
    pool: rayon::ThreadPool,
}

/// The files that were read.
#[derive(Default)]
struct Files {
    paths: Vec<PathBuf>,
    /// Their sizes and hashes.
    hashes: String,
}

impl Setups {
    /// The files that the points were made from.
    pub(super) fn inputs(&self) -> impl Iterator<Item = &Path> {
        self.files.paths.iter().map(PathBuf::as_path)
    }

    /// Sizes and hashes of these files.
    pub(super) fn hashes(&self) -> &str {
        &self.files.hashes
    }

    pub(super) fn new(table: toml::Table, folder: &Path) -> Result<Self> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().map_err(|e| Failure::message(e.to_string()))?;
        Ok(Self { table, folder: folder.to_owned(), bases: Bases::new(), files: Files::default(), pool })
    }

    /// The trials of the point where some parameters have other values than in the file, and its configuration.
    ///
    /// # Errors
    /// A value that its key does not take, or an observation that cannot be made.
    pub(super) fn make(&mut self, changes: &[(&str, toml::Value)], context: &Context) -> Result<(Setup, Config)> {
        let mut tree = self.table.clone();
        for (parameter, value) in changes {
            put(&mut tree, parameter, value.clone())?;
        }
        let config = toml::Value::Table(tree.clone()).try_into::<Config>()?;
        let Self { folder, bases, files, pool, .. } = self;
        let setup = pool.install(|| setup(&config, &tree, folder, bases, (files, context)))?;
        Ok((setup, config))
    }

    /// Check the values that the file itself gives to the parameters of axes: the axes replace them, so that nothing else reads them. `first` is
    /// the first value of each axis.
    ///
    /// # Errors
    /// A value that its key does not take.
    pub(super) fn check_replaced(&self, first: &[(&str, toml::Value)]) -> Result<()> {
        let config_without = |kept: Option<&str>| -> Result<std::result::Result<Config, toml::de::Error>> {
            let mut tree = self.table.clone();
            first.iter().filter(|(other, _)| Some(*other) != kept).try_for_each(|(other, value)| put(&mut tree, other, value.clone()))?;
            Ok(toml::Value::Table(tree).try_into())
        };
        if config_without(None)?.is_err() {
            // Something else is wrong, and the trials say what.
            return Ok(());
        }
        for (parameter, _) in first.iter().filter(|(parameter, _)| has(&self.table, parameter)) {
            config_without(Some(parameter))?.context(format!("{parameter}, which an axis varies, has a wrong value of its own"))?;
        }
        Ok(())
    }

    /// Make trials without keeping their observations: those of a question are used once.
    ///
    /// # Errors
    /// As for [`Setups::make`].
    pub(super) fn make_once(&mut self, changes: &[(&str, toml::Value)], context: &Context) -> Result<Setup> {
        let before = self.bases.clone();
        let made = self.make(changes, context);
        self.bases = before;
        Ok(made?.0)
    }

    /// The file without its comments. The limits of its quality do not change what the study is.
    ///
    /// # Errors
    /// A value that JSON has no form for.
    pub(super) fn text(&self) -> Result<String> {
        let mut table = self.table.clone();
        table.remove("quality");
        Ok(serde_json::to_string(&table)?)
    }

    /// Unit of residual images.
    pub(super) fn unit(&self) -> &'static str {
        if self.bases.values().any(|b| b.1 == VisUnit::KelvinSr) { "K" } else { "Jy/beam" }
    }
}

/// Whether a table has a value at a place such as `corrupt.phase-rms`.
fn has(table: &toml::Table, parameter: &str) -> bool {
    match parameter.split_once('.') {
        Some((head, rest)) => table.get(head).and_then(toml::Value::as_table).is_some_and(|inner| has(inner, rest)),
        None => table.contains_key(parameter),
    }
}

/// Put a value at a place such as `corrupt.phase-rms`.
fn put(table: &mut toml::Table, parameter: &str, value: toml::Value) -> Result<()> {
    if let Some((head, rest)) = parameter.split_once('.') {
        let entry = table.entry(head).or_insert_with(|| toml::Value::Table(toml::Table::new()));
        let Some(inner) = entry.as_table_mut() else {
            return Err(Failure::message(format!("axis parameter {parameter}: {head} is no section of the file")));
        };
        return put(inner, rest, value);
    }
    if ["axis", "seeds", "seed", "title", "question", "failures", "quality"].contains(&parameter) && table.contains_key("seeds") {
        return Err(Failure::message(format!("axis parameter {parameter}: it belongs to the whole study and cannot vary")));
    }
    table.insert(parameter.to_owned(), value);
    Ok(())
}

fn setup(c: &Config, tree: &toml::Table, folder: &Path, bases: &mut Bases, (files, context): (&mut Files, &Context)) -> Result<Setup> {
    c.image.options.check().context("image")?;
    let mut sections: Vec<String> = ["scene", "simulate", "image", "clean"].iter().map(|k| format!("{:?}", tree.get(*k))).collect();
    let antennas = match (c.layout.antennas, c.layout.choose) {
        (None, _) => Antennas::All,
        (Some(n), Choose::First) => Antennas::First(n),
        (Some(n), Choose::Random) => Antennas::Random(n),
    };
    sections.push(match c.layout.origin()? {
        Origin::Named(name) => name.to_owned(),
        Origin::Made(make) => format!("{:?}", make.keys),
    });
    let all = sections.join("\n");
    let (whole, unit) = kept(bases, &all, || observe(c, folder, (&mut *files, context)))?;
    let layout = &whole.set.header.layout;
    let selfcal = c.selfcal.as_ref().map(|s| plan_of(&s.options, layout)).transpose().context("selfcal")?;
    if let Some(seed) = c.corrupt.options.seed {
        return Err(Failure::message(format!("corrupt.seed is {seed}: a study draws its errors from the seeds of its trials")));
    }
    let mut errors = c.corrupt.options.errors(whole.set.header.unit, &Airs).context("corrupt")?;
    for file in band_files(&errors) {
        note_file(files, &folder.join(file));
    }
    read_bands(&mut errors, folder)?;
    let (base, antennas) = match antennas {
        Antennas::First(n) => {
            let part = || Ok((whole.with(antennas, 0).context("layout")?, unit));
            (kept(bases, &format!("{all}\nfirst {n}"), part)?.0, Antennas::All)
        }
        Antennas::Random(n) => {
            whole.with(Antennas::First(n), 0).context("layout")?;
            (whole, antennas)
        }
        Antennas::All => (whole, antennas),
    };
    Ok(Setup { base, antennas, errors, selfcal, silent: None })
}

/// The base of this key, made where it does not exist.
fn kept(bases: &mut Bases, key: &str, make: impl FnOnce() -> Result<(Base, VisUnit)>) -> Result<(Arc<Base>, VisUnit)> {
    if let Some(found) = bases.get(key) {
        return Ok(found.clone());
    }
    let (base, unit) = make()?;
    Ok(bases.entry(key.to_owned()).or_insert((Arc::new(base), unit)).clone())
}

/// The error-free observation of a point.
fn observe(c: &Config, folder: &Path, (files, context): (&mut Files, &Context)) -> Result<(Base, VisUnit)> {
    let (s, scene) = (&c.simulate.options, &c.scene.options);
    let layout = match c.layout.origin()? {
        Origin::Named(name) => {
            let path = folder.join(name);
            let name = if path.exists() { path.display().to_string() } else { name.to_owned() };
            note_file(files, Path::new(&name));
            load_layout(&name).context("layout.name")?
        }
        Origin::Made(make) => make.options.layout()?,
    };
    let spectrum = s.band.spectrum()?;
    let PlannedTrack { center, plan } = s.track.plan(&layout).context("simulate")?;
    if s.how.noise_options()?.is_some() {
        return Err(Failure::message("simulate: a study adds its noise in the section corrupt, anew for each trial"));
    }
    let (sky, unit) = match (&scene.file, scene.points.as_slice()) {
        (Some(file), []) => {
            let args = SceneArgs { scene: folder.join(file), how: scene.how.clone() };
            note_file(files, &args.scene);
            let loaded = args.load(&center, &spectrum, context)?;
            (loaded.sky, loaded.unit)
        }
        (None, points @ [_, ..]) => {
            let source = |p: &ScenePoint| Source::point(p.l.map_or(0.0, |a| a.si()), p.m.map_or(0.0, |a| a.si()), p.flux.si());
            (SkyModel::of_sources(points.iter().map(source).collect()), VisUnit::Jy)
        }
        _ => return Err(Failure::message("scene: give file, or points = [{ flux = \"1Jy\" }], and not both")),
    };
    let frame = SkyGrid::frame_of(&center);
    let mut header = s.how.header(layout, spectrum, center, unit);
    header.history.push(context.history());
    let set = simulate_set(header, &plan.with_autocorrelations(s.how.autos).coverage()?, &sky, &s.how, &Silent).context("scene")?;
    let deconvolution = deconvolution(c, &sky, frame)?;
    Ok((Base::new(set, c.image.options.clone(), deconvolution).observing(sky), unit))
}

/// CLEAN, or maximum entropy with the scene with which its images are compared.
fn deconvolution(c: &Config, sky: &SkyModel, frame: SkyFrame) -> Result<Deconvolution> {
    let clean = &c.clean.options;
    if clean.algorithm.is_mem() {
        return scene_on_the_grid(c, sky).map(Deconvolution::Mem);
    }
    let (size, cell) = (c.image.options.size, c.image.options.cell);
    if clean.mask.is_none() && clean.boxes.is_empty() {
        return Ok(Deconvolution::Clean(Box::new(clean.clone())));
    }
    let (Some(size), Some(cell)) = (size, cell) else {
        return Err(Failure::message("clean: a mask or a box needs image.size and image.cell"));
    };
    let grid = SkyGrid::new(size.columns, size.rows, cell.si(), frame)?;
    Ok(Deconvolution::Clean(Box::new(loaded(clean, &grid)?)))
}

/// The image of the scene. It must have the pixels of the images of the study, because images of `mem` are compared without a beam.
fn scene_on_the_grid(c: &Config, sky: &SkyModel) -> Result<Array2<f64>> {
    let wrong = |found: String| {
        Failure::message(format!(
            "clean.algorithm is \"mem\", whose images are compared with the scene itself: expected a scene that is an image of one channel on \
             the grid of image.size and image.cell, found {found}"
        ))
    };
    let [image] = sky.images.as_slice() else { return Err(wrong("sources or several images".into())) };
    ensure!(sky.sources.is_empty(), wrong("an image with sources".into()));
    let grid = &image.grid;
    let same = c.image.options.size == Some(ImageSize { columns: grid.n_l, rows: grid.n_m })
        && c.image.options.cell.is_some_and(|a| (a.si() / grid.cell_rad - 1.0).abs() < 1e-6)
        && image.data.dim().0 == 1;
    ensure!(same, wrong(format!("{} x {} pixels of {:.6e} rad", grid.n_l, grid.n_m, grid.cell_rad)));
    if c.selfcal.as_ref().is_some_and(|s| s.options.rounds.start != StartFrom::Data) {
        return Err(Failure::message("selfcal.start must be \"data\" where clean.algorithm is \"mem\": it needs no other model"));
    }
    Ok(image.plane(0, 0).to_owned())
}

/// Add the bytes of a file to the fingerprint, so that a changed scene is another study.
fn note_file(files: &mut Files, path: &Path) {
    // What is no file, such as a pipe that never ends, is refused where it is opened.
    if path.is_file()
        && let Ok(bytes) = std::fs::read(path)
    {
        // FNV-1a suffices to detect an edited file.
        let hash = bytes.iter().fold(0xcbf2_9ce4_8422_2325_u64, |h, b| (h ^ u64::from(*b)).wrapping_mul(0x0000_0100_0000_01b3));
        files.paths.push(path.to_path_buf());
        files.hashes.push_str(&format!("{} {hash:016x} ", bytes.len()));
    }
}

fn plan_of(s: &StudySelfcalSection, layout: &ArrayLayout) -> Result<SelfcalPlan> {
    s.rounds.check()?;
    s.solve.check(layout.n_ant())?;
    if let Some(names) = &s.solve.refant {
        names.indices(layout)?;
    }
    ensure!(s.rounds.model.is_none(), Failure::message("model: a study starts from a point, from its data or from the truth"));
    Ok(SelfcalPlan { solve: s.solve.clone(), rounds: s.rounds.clone() })
}
