//! From the file to the points of a study.

use super::config::{AxisSection, Choose, Config};
use super::errors::errors;
use crate::calibrate::{GainMode, SolutionInterval, refant_from_names};
use crate::cli::context::Context;
use crate::cli::failure::{Context as _, Failure, Result};
use crate::cli::options::{SceneArgs, TrackArgs, load_layout};
use crate::deconvolve::by_name;
use crate::imaging::major::CleanOptions;
use crate::imaging::{ImagingOptions, WeightOptions, Weighting};
use crate::progress::Silent;
use crate::simulate::{SimulateOptions, SkyModel, simulate_set};
use crate::study::{Antennas, Axis, Base, Deconvolution, Grid, SelfcalPlan, Setup, StartFrom, Study};
use cittert_arrays::quantity::Duration;
use cittert_arrays::{Polarization, Source, SpectralWindow, VisUnit, VisibilityHeader};
use ndarray::Array2;
use serde::Deserialize;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What `[clean]` calls maximum entropy.
const MEM: &str = "mem";

/// A study ready to run.
pub(super) struct Plan {
    pub title: String,
    pub study: Study,
    /// What makes two studies the same: configuration, input files and version.
    pub fingerprint: String,
    /// Unit of residual images.
    pub unit: &'static str,
}

/// Finished bases by the sections that make them.
type Bases = HashMap<String, (Arc<Base>, VisUnit)>;

impl Plan {
    /// Read the file, put the values of the axes in, and make what the trials share.
    ///
    /// # Errors
    /// Anything wrong in the file, with the line or the values of the axes; layouts and scenes that cannot be read.
    pub(super) fn new(text: &str, path: &Path, context: &Context) -> Result<Self> {
        let table: toml::Table = toml::from_str(text)?;
        let sections = toml::from_str::<Axes>(text)?.axis;
        let lists = sections.iter().map(values).collect::<Result<Vec<_>>>()?;
        let axes = sections.iter().zip(&lists).map(|(s, l)| Ok(Axis::new(&s.parameter, &l.iter().map(shown).collect::<Vec<_>>())?));
        let grid = Grid::new(axes.collect::<Result<_>>()?)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let (mut bases, mut setups, mut head) = (Bases::new(), Vec::new(), None);
        let mut files = String::new();
        // Bases are made on one thread, so that they too are the same bytes with any number of threads.
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().map_err(|e| Failure::message(e.to_string()))?;
        for point in 0..grid.n_points() {
            let mut tree = table.clone();
            let mut rest = point;
            for (section, list) in sections.iter().zip(&lists).rev() {
                put(&mut tree, &section.parameter, list[rest % list.len()].clone())?;
                rest /= list.len();
            }
            let place =
                || grid.axes.iter().zip(grid.point(point)).map(|(a, v)| format!("{} = {}", a.name, v.text)).collect::<Vec<_>>().join(", ");
            let config = match toml::Value::Table(tree.clone()).try_into::<Config>() {
                Ok(config) => config,
                // The file itself shows the line; a value of an axis has none.
                Err(e) => return toml::from_str::<Config>(text).map_err(Failure::from).and(Err(e.into())).context(place()),
            };
            let setup = pool.install(|| setup(&config, (&tree, text), folder, &mut bases, (&mut files, context)));
            let setup = if grid.axes.is_empty() { setup? } else { setup.context(format!("at {}", place()))? };
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

/// A value as a person would write it on a command line.
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
        // Twelve digits: the ends and round steps come out as they were typed.
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

/// Put a value at a place such as `errors.phase.rms`.
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

fn setup(c: &Config, (tree, text): (&toml::Table, &str), folder: &Path, bases: &mut Bases, more: (&mut String, &Context)) -> Result<Setup> {
    let mut sections: Vec<String> = ["scene", "simulate", "image", "clean"].iter().map(|k| format!("{:?}", tree.get(*k))).collect();
    let antennas = match (c.layout.antennas, c.layout.choose) {
        (None, _) => Antennas::All,
        (Some(n), Choose::First) => Antennas::First(n),
        (Some(n), Choose::Random) => Antennas::Random(n),
    };
    sections.push(c.layout.name.clone());
    let all = sections.join("\n");
    let whole = match bases.get(&all) {
        Some((base, _)) => base.clone(),
        None => {
            let (base, unit) = observe(c, folder, more)?;
            let base = Arc::new(base);
            bases.insert(all.clone(), (base.clone(), unit));
            base
        }
    };
    let layout = &whole.set.header.layout;
    let selfcal = c.selfcal.as_ref().map(|s| {
        if let Some(names) = &s.refant {
            refant_from_names(layout, names)?;
        }
        selfcal(s)
    });
    let selfcal = selfcal.transpose().context("selfcal")?;
    let base = match antennas {
        Antennas::First(n) => {
            let key = format!("{all}\nfirst {n}");
            let unit = bases[&all].1;
            match bases.get(&key) {
                Some((base, _)) => base.clone(),
                None => {
                    let part = Arc::new(whole.with(antennas, 0).context("layout")?);
                    bases.insert(key, (part.clone(), unit));
                    part
                }
            }
        }
        _ => whole.clone(),
    };
    let antennas = match antennas {
        Antennas::Random(n) => {
            whole.with(Antennas::First(n), 0).context("layout")?;
            antennas
        }
        _ => Antennas::All,
    };
    Ok(Setup { base, antennas, errors: errors(&c.errors, text)?, selfcal })
}

/// The error-free observation of a point.
fn observe(c: &Config, folder: &Path, (files, context): (&mut String, &Context)) -> Result<(Base, VisUnit)> {
    let (s, i) = (&c.simulate, &c.image);
    let path = folder.join(&c.layout.name);
    let name = if path.exists() { path.display().to_string() } else { c.layout.name.clone() };
    let layout = load_layout(&name).context("layout.name")?;
    note_file(files, Path::new(&name));
    let spectrum = SpectralWindow::band(s.freq.si(), s.bandwidth.si(), s.channels)?;
    let track = TrackArgs {
        phase_center: s.phase_center.clone(),
        start: s.start.clone(),
        duration: s.duration,
        hour_angle: s.hour_angle.clone(),
        integration: s.integration.unwrap_or(Duration(10.0)),
        elevation_limit: s.elevation_limit,
    };
    let (center, plan) = track.plan(&layout).context("simulate")?;
    let (sky, unit) = match (&c.scene.file, c.scene.points.as_slice()) {
        (Some(file), []) => {
            let scene: PathBuf = folder.join(file);
            note_file(files, &scene);
            let args = SceneArgs {
                scene,
                scene_cell: c.scene.scene_cell,
                scene_size: c.scene.scene_size,
                scene_channels: false,
                scene_min: c.scene.scene_min,
                scene_max: c.scene.scene_max,
            };
            let loaded = args.load(&center, &spectrum, context)?;
            (loaded.sky, loaded.unit)
        }
        (None, points @ [_, ..]) => {
            let source = |p: &super::config::Point| Source::point(p.l.map_or(0.0, |a| a.si()), p.m.map_or(0.0, |a| a.si()), p.flux.si());
            (SkyModel::of_sources(points.iter().map(source).collect()), VisUnit::Jy)
        }
        _ => return Err(Failure::message("scene: give file, or points = [{ flux = \"1Jy\" }], and not both")),
    };
    let header = VisibilityHeader {
        telescope: layout.name.clone(),
        instrument: layout.name.clone(),
        layout,
        spectrum,
        polarizations: vec![Polarization::I],
        phase_centers: vec![center],
        unit,
        pedestal_k: None,
        history: vec![context.history()],
    };
    let mut options = SimulateOptions { w_term: !i.no_w, ..SimulateOptions::default() };
    if let Some(method) = &s.method {
        options.method = method.parse()?;
    }
    let set = simulate_set(header, &plan.coverage()?, &sky, &options, &Silent).context("scene")?;
    let weighting = match (i.weighting.as_deref(), i.robust) {
        (None | Some("natural"), None) => Weighting::Natural,
        (Some("uniform"), None) => Weighting::Uniform,
        (Some("briggs"), robust) => Weighting::Briggs { robust: robust.unwrap_or(0.0) },
        (other, _) => {
            return Err(Failure::message(format!("image.weighting is {other:?}, expected natural, uniform or briggs (alone with robust)")));
        }
    };
    let imaging = ImagingOptions {
        size: i.size.map(|n| (n, n)),
        cell_rad: i.cell.map(|a| a.si()),
        weights: WeightOptions { weighting, ..WeightOptions::default() },
        epsilon: i.epsilon.unwrap_or(1e-5),
        w_term: !i.no_w,
        ..ImagingOptions::default()
    };
    Ok((Base::new(set, imaging, deconvolution(c, &sky)?), unit))
}

/// CLEAN, or maximum entropy with the scene to hold its images against.
fn deconvolution(c: &Config, sky: &SkyModel) -> Result<Deconvolution> {
    let (k, d) = (&c.clean, CleanOptions::default());
    if k.algorithm.as_deref() == Some(MEM) {
        return scene_on_the_grid(c, sky).map(Deconvolution::Mem);
    }
    Ok(Deconvolution::Clean(CleanOptions {
        algorithm: by_name(k.algorithm.as_deref().unwrap_or("hogbom"))?,
        gain: k.gain.unwrap_or(d.gain),
        niter: k.niter.unwrap_or(200),
        nsigma: k.nsigma.unwrap_or(4.0),
        mgain: k.mgain.unwrap_or(d.mgain),
        max_major: k.max_major.unwrap_or(10),
        auto_mask: k.auto_mask,
        ..d
    }))
}

/// The image of the scene, which must have the pixels of the images of the study; `mem` is judged without any beam.
fn scene_on_the_grid(c: &Config, sky: &SkyModel) -> Result<Array2<f64>> {
    let wrong = |found: String| {
        Failure::message(format!(
            "clean.algorithm is {MEM:?}, whose images are held against the scene itself: expected a scene that is an image of one channel on \
             the grid of image.size and image.cell, found {found}"
        ))
    };
    let [image] = sky.images.as_slice() else { return Err(wrong("sources or several images".into())) };
    if !sky.sources.is_empty() {
        return Err(wrong("an image with sources".into()));
    }
    let grid = &image.grid;
    let same = c.image.size == Some(grid.n_l)
        && grid.n_l == grid.n_m
        && c.image.cell.is_some_and(|a| (a.si() / grid.cell_rad - 1.0).abs() < 1e-6)
        && image.data.dim().0 == 1;
    if !same {
        return Err(wrong(format!("{} x {} pixels of {:.6e} rad", grid.n_l, grid.n_m, grid.cell_rad)));
    }
    if c.selfcal.as_ref().is_some_and(|s| s.start != "data") {
        return Err(Failure::message(format!("selfcal.start must be \"data\" where clean.algorithm is {MEM:?}: it needs no other model")));
    }
    Ok(image.plane(0, 0).to_owned())
}

/// Files are known by their bytes, so that a changed scene is another study.
fn note_file(files: &mut String, path: &Path) {
    if let Ok(bytes) = std::fs::read(path) {
        // FNV-1a: tells an edited file from the old one; nobody forges a scene.
        let hash = bytes.iter().fold(0xcbf2_9ce4_8422_2325_u64, |h, b| (h ^ u64::from(*b)).wrapping_mul(0x0000_0100_0000_01b3));
        files.push_str(&format!("{} {hash:016x} ", bytes.len()));
    }
}

fn selfcal(s: &super::config::SelfcalSection) -> Result<SelfcalPlan> {
    let wrong = |key: &str, value: &str, expected: &str| Failure::message(format!("{key} is {value:?}, expected {expected}"));
    Ok(SelfcalPlan {
        mode: match s.mode.as_str() {
            "phase" => GainMode::Phase,
            "amp-phase" => GainMode::AmpPhase,
            other => return Err(wrong("mode", other, "phase or amp-phase")),
        },
        solint: match s.solint.as_str() {
            "inf" => SolutionInterval::Infinite,
            "int" => SolutionInterval::Integration,
            time => SolutionInterval::Seconds(
                time.parse::<Duration>().map_err(|e| Failure::message(format!("solint: {e} (or int, or inf)")))?.si(),
            ),
        },
        rounds: if (1..=1000).contains(&s.rounds) { s.rounds } else { return Err(wrong("rounds", &s.rounds.to_string(), "1 to 1000")) },
        min_snr: s.minsnr,
        refant: s.refant.iter().flat_map(|r| r.split(',')).map(|n| n.trim().to_owned()).collect(),
        start: match s.start.as_str() {
            "point" => StartFrom::Point,
            "data" => StartFrom::Data,
            "truth" => StartFrom::Truth,
            other => return Err(wrong("start", other, "point, data or truth")),
        },
    })
}
