//! Reads the file of a study and prepares its points.

use super::config::{AxisSection, Choose, Config};
use crate::calibrate::StartFrom;
use crate::cli::context::Context;
use crate::cli::failure::{Context as _, Failure, Result, ensure};
use crate::cli::options::{SceneArgs, load_layout, loaded};
use crate::cli::sections::{ScenePoint, StudySelfcalSection};
use crate::imaging::ImageSize;
use crate::progress::Silent;
use crate::simulate::{PlannedTrack, SkyModel, simulate_set};
use crate::study::{Antennas, Axis, Base, Deconvolution, Grid, SelfcalPlan, Setup, Study};
use cittert_arrays::{ArrayLayout, SkyFrame, SkyGrid, Source, VisUnit};
use ndarray::Array2;
use serde::Deserialize;
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

/// A study ready to run.
pub(super) struct Plan {
    pub title: String,
    pub study: Study,
    /// Configuration, input files and version. Two studies with the same fingerprint are the same.
    pub fingerprint: String,
    /// Unit of residual images.
    pub unit: &'static str,
}

/// Finished bases. The key is the text of the sections that they are made from.
type Bases = HashMap<String, (Arc<Base>, VisUnit)>;

impl Plan {
    /// Read the file, insert the values of the axes, and make the observations that trials share.
    ///
    /// # Errors
    /// The file is wrong (the message names the line or the values of the axes), or a layout or a scene cannot be read.
    pub(super) fn new(text: &str, path: &Path, context: &Context) -> Result<Self> {
        let table: toml::Table = toml::from_str(text)?;
        let sections = toml::from_str::<Axes>(text)?.axis;
        let lists = sections.iter().map(values).collect::<Result<Vec<_>>>()?;
        let axes = sections.iter().zip(&lists).map(|(s, l)| Ok(Axis::new(&s.parameter, &l.iter().map(shown).collect::<Vec<_>>())?));
        let grid = Grid::new(axes.collect::<Result<_>>()?)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let (mut bases, mut setups, mut head) = (Bases::new(), Vec::new(), None);
        let mut files = String::new();
        // Bases are made on one thread, so that they have the same bytes with any number of threads.
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().map_err(|e| Failure::message(e.to_string()))?;
        for point in 0..grid.n_points() {
            let mut tree = table.clone();
            for ((section, list), k) in sections.iter().zip(&lists).zip(grid.indices(point)) {
                put(&mut tree, &section.parameter, list[k].clone())?;
            }
            let config = match toml::Value::Table(tree.clone()).try_into::<Config>() {
                Ok(config) => config,
                // The error of the file itself names the line. A value of an axis has no line.
                Err(e) if grid.axes.is_empty() => return toml::from_str::<Config>(text).map_err(Failure::from).and(Err(e.into())),
                Err(e) => return toml::from_str::<Config>(text).map_err(Failure::from).and(Err(e.into())).context(grid.place(point)),
            };
            let setup = pool.install(|| setup(&config, &tree, folder, &mut bases, (&mut files, context)));
            let setup = if grid.axes.is_empty() { setup? } else { setup.context(format!("at {}", grid.place(point)))? };
            setups.push(setup);
            head.get_or_insert(config);
        }
        let Some(head) = head else { return Err(Failure::message("the study has no point")) };
        if head.seeds == 0 || head.seeds.saturating_mul(setups.len()) > 100_000_000 {
            return Err(Failure::message(format!("seeds is {}, expected at least 1 and at most 100 million trials in all", head.seeds)));
        }
        let seeds = (0..head.seeds as u64).map(|k| head.seed.wrapping_add(k)).collect();
        let unit = if bases.values().any(|b| b.1 == VisUnit::KelvinSr) { "K" } else { "Jy/beam" };
        let fingerprint = format!("{} {} {files}", env!("CARGO_PKG_VERSION"), serde_json::to_string(&table)?);
        Ok(Self { title: head.title, study: Study { grid, setups, seeds }, fingerprint, unit })
    }
}

#[derive(Deserialize)]
struct Axes {
    #[serde(default)]
    axis: Vec<AxisSection>,
}

/// A value as it is written on a command line.
fn shown(value: &toml::Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

/// The values of an axis: as listed, or from, to and count.
fn values(axis: &AxisSection) -> Result<Vec<toml::Value>> {
    let wrong = |what: &str| Failure::message(format!("axis {}: {what}", axis.parameter));
    let (Some(from), Some(to), Some(count)) = (&axis.from, &axis.to, axis.count) else {
        if axis.values.is_empty() || axis.from.is_some() || axis.to.is_some() || axis.count.is_some() {
            return Err(wrong("give values = [...], or from, to and count"));
        }
        return Ok(axis.values.clone());
    };
    let ends = Axis::new(&axis.parameter, &[shown(from), shown(to)])?;
    let (Some(a), Some(b)) = (ends.values[0].number, ends.values[1].number) else {
        return Err(wrong("from and to must be numbers in the same unit"));
    };
    if !axis.values.is_empty() || !(2..=1_000_000).contains(&count) || (axis.log && !(a > 0.0 && b > 0.0)) {
        return Err(wrong("from, to and count go without values, with a count of at least 2 (and positive numbers for log)"));
    }
    let at = |k: usize| {
        let t = k as f64 / (count - 1) as f64;
        let x = if axis.log { a * (b / a).powf(t) } else { a + t * (b - a) };
        // With twelve digits the ends and round steps are printed as they were typed.
        format!("{x:.11e}").parse::<f64>().unwrap_or(x)
    };
    Ok((0..count)
        .map(|k| match from {
            toml::Value::Integer(_) => toml::Value::Integer(at(k).round() as i64),
            toml::Value::Float(_) => toml::Value::Float(at(k)),
            _ => toml::Value::String(format!("{}{}", at(k), ends.unit)),
        })
        .collect())
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
    if ["axis", "seeds", "seed", "title"].contains(&parameter) && table.contains_key("axis") {
        return Err(Failure::message(format!("axis parameter {parameter}: it belongs to the whole study and cannot vary")));
    }
    table.insert(parameter.to_owned(), value);
    Ok(())
}

fn setup(c: &Config, tree: &toml::Table, folder: &Path, bases: &mut Bases, more: (&mut String, &Context)) -> Result<Setup> {
    c.image.options.check().context("image")?;
    let mut sections: Vec<String> = ["scene", "simulate", "image", "clean"].iter().map(|k| format!("{:?}", tree.get(*k))).collect();
    let antennas = match (c.layout.antennas, c.layout.choose) {
        (None, _) => Antennas::All,
        (Some(n), Choose::First) => Antennas::First(n),
        (Some(n), Choose::Random) => Antennas::Random(n),
    };
    sections.push(c.layout.name.clone());
    let all = sections.join("\n");
    let (whole, unit) = kept(bases, &all, || observe(c, folder, more))?;
    let layout = &whole.set.header.layout;
    let selfcal = c.selfcal.as_ref().map(|s| plan_of(&s.options, layout)).transpose().context("selfcal")?;
    if let Some(seed) = c.corrupt.options.seed {
        return Err(Failure::message(format!("corrupt.seed is {seed}: a study draws its errors from the seeds of its trials")));
    }
    let errors = c.corrupt.options.errors(whole.set.header.unit).context("corrupt")?;
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
    Ok(Setup { base, antennas, errors, selfcal })
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
fn observe(c: &Config, folder: &Path, (files, context): (&mut String, &Context)) -> Result<(Base, VisUnit)> {
    let (s, scene) = (&c.simulate.options, &c.scene.options);
    let path = folder.join(&c.layout.name);
    let name = if path.exists() { path.display().to_string() } else { c.layout.name.clone() };
    let layout = load_layout(&name).context("layout.name")?;
    note_file(files, Path::new(&name));
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
    let set = simulate_set(header, &plan.coverage()?, &sky, &s.how, &Silent).context("scene")?;
    Ok((Base::new(set, c.image.options.clone(), deconvolution(c, &sky, frame)?), unit))
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
fn note_file(files: &mut String, path: &Path) {
    if let Ok(bytes) = std::fs::read(path) {
        // FNV-1a suffices to detect an edited file.
        let hash = bytes.iter().fold(0xcbf2_9ce4_8422_2325_u64, |h, b| (h ^ u64::from(*b)).wrapping_mul(0x0000_0100_0000_01b3));
        files.push_str(&format!("{} {hash:016x} ", bytes.len()));
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
