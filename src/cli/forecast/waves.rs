//! The work of spherical waves between a scene near the array and all pairs of antennas, from some of its points.
//!
//! All points of a scene take the same time, and that depends on elements and channels. So the transform of a few tiles of points is made, and thrown away.

use super::Planner;
use crate::cli::failure::Result;
use crate::cli::options::with_range;
use crate::cost::{self, Waves};
use crate::fourier::Real;
use crate::imaging::{ImagingOptions, Outlook};
use crate::memory::MemoryBudget;
use crate::nearfield::{Elements, Pairs, PathTransform, Point, Surface};
use crate::progress::Silent;
use crate::simulate::SkyModel;
use cittert_arrays::{SkyGrid, SourceShape, VisibilityHeader};
use ndarray::Array2;
use serde_json::{Map, Value};
use std::time::Instant;

/// Tiles of points that are tried first for each thread, and by how much more the next time.
const FIRST: usize = 2;
const MORE: usize = 4;
/// Time after which no more points are needed, s.
const ENOUGH_S: f64 = 0.2;

/// What some of these points take. In single precision the passes of an image are, and never what is simulated.
///
/// # Errors
/// A point that is nearer than the farthest element, or tables that do not fit into the memory.
pub(in crate::cli) fn waves(
    elements: &Elements,
    (points, single): (&mut dyn Iterator<Item = Point>, bool),
    freq_hz: &[f64],
    memory: MemoryBudget,
) -> Result<Waves> {
    let threads = rayon::current_num_threads();
    let mut wanted = FIRST * threads * PathTransform::points_of_tile();
    let mut some: Vec<Point> = Vec::new();
    loop {
        let before = some.len();
        some.extend(points.take(wanted - before));
        let all = some.len() < wanted;
        let transform = PathTransform::new(elements.clone(), some.clone(), freq_hz, memory)?;
        let waves = if single { timed::<f32>(&transform, threads)? } else { timed::<f64>(&transform, threads)? };
        let took = some.len() as f64 * (waves.lit_s + waves.back_s);
        if all || took > ENOUGH_S {
            return Ok(waves);
        }
        wanted *= MORE;
    }
}

/// The time of each pass of a transform, for one of its points.
fn timed<T: Real>(transform: &PathTransform, threads: usize) -> Result<Waves> {
    let of_point = |started: Instant| started.elapsed().as_secs_f64() / transform.n_points().max(1) as f64;
    let started = Instant::now();
    let pairs: Pairs = transform.predict::<T>(|_, _| 1.0, &Silent)?;
    let lit_s = of_point(started);
    let started = Instant::now();
    transform.predict::<T>(|_, _| 0.0, &Silent)?;
    let dark_s = of_point(started);
    let started = Instant::now();
    transform.adjoint::<T>(&pairs, &Silent)?;
    let back_s = of_point(started);
    let started = Instant::now();
    let n = transform.elements().len();
    let _gains: Vec<f64> = transform.power(Array2::ones((n, n)).view());
    let gain_s = of_point(started);
    let started = Instant::now();
    transform.predict::<f64>(|_, _| 1.0, &Silent)?;
    let exact_s = of_point(started);
    let (table_bytes, tile) = (transform.bytes_of_pass(threads) as f64, PathTransform::points_of_tile() as f64);
    Ok(Waves { lit_s, dark_s, back_s, gain_s, exact_s, table_bytes, tile })
}

/// The waves of a scene on a surface near the array of a set: those of each image and of the sources, and their number of points. A point counts once for each plane of
/// the scene that has it.
///
/// # Errors
/// A scene that does not fit the array.
pub(in crate::cli) fn of_scene(
    sky: &SkyModel,
    surface: &Surface,
    header: &VisibilityHeader,
    (freq_hz, subchannels): (&[f64], usize),
) -> Result<Vec<(Waves, f64)>> {
    let elements = Elements::new(&header.layout, header.near_field.focus)?;
    let (memory, n_chan) = (MemoryBudget::default(), freq_hz.len());
    let fine = |some: &[f64]| -> Vec<f64> { some.iter().flat_map(|f| std::iter::repeat_n(*f, subchannels)).collect() };
    let mut all = Vec::new();
    for image in &sky.images {
        surface.check(&image.grid)?;
        let own = image.spectrum.n_chan();
        // A plane of the image serves the channels that are nearest to its own; behind a pattern that varies with frequency each channel has its own.
        let planes = if header.layout.pattern.varies_with_frequency() { n_chan } else { own.min(n_chan) };
        let lit = image.data.iter().filter(|v| **v != 0.0).count() * planes / own.max(1);
        let elements = elements.clone().relative(!image.pattern.is_none());
        let of_plane = fine(&freq_hz[..n_chan.div_ceil(planes.max(1))]);
        all.push((waves(&elements, (&mut points_of(&image.grid, surface), false), &of_plane, memory)?, lit as f64));
    }
    if !sky.sources.is_empty() {
        // Every direction in front of the array takes the same time.
        let mut middle = sky.sources.iter().filter_map(|_| Point::on(surface, 0.0, 0.0));
        all.push((waves(&elements, (&mut middle, false), &fine(freq_hz), memory)?, sky.sources.len() as f64));
    }
    Ok(all)
}

/// The points of a grid in front of the array.
fn points_of(g: &SkyGrid, surface: &Surface) -> impl Iterator<Item = Point> {
    (0..g.n_m * g.n_l).filter_map(|k| Point::on(surface, g.l_at((k % g.n_l) as f64), g.m_at((k / g.n_l) as f64)))
}

/// A scene of a few points that is checked as the whole scene is.
pub(in crate::cli) fn few_points(sky: &SkyModel) -> SkyModel {
    let mut few = sky.clone();
    for image in &mut few.images {
        let first = image.data.iter().position(|v| *v != 0.0);
        image.data.iter_mut().enumerate().filter(|(k, v)| v.is_finite() && Some(*k) != first).for_each(|(_, v)| *v = 0.0);
    }
    let first = few.sources.first().cloned();
    // Sources that have no near field are refused.
    few.sources.retain(|s| s.shape != SourceShape::Point || s.is_polarized());
    few.sources.extend(first);
    few
}

/// The waves of an image of a set near the array, where the options ask for one. The outlook then has no Fourier transforms.
///
/// # Errors
/// Several processes, or a scene that does not fit the array.
pub(in crate::cli) fn of_image(
    imaging: &ImagingOptions,
    header: &VisibilityHeader,
    outlook: &mut Outlook,
    planner: &Planner<'_>,
) -> Result<Option<Waves>> {
    let Some(surface) = with_range(imaging)?.surface_of(&header.near_field)? else { return Ok(None) };
    planner.alone("makes exact images of scenes near the array")?;
    surface.check(&outlook.grid)?;
    let elements = Elements::new(&header.layout, header.near_field.focus)?.relative_at(header.spectrum.mean_hz());
    let single = imaging.grid_options().single_precision_suffices();
    let waves = waves(&elements, (&mut points_of(&outlook.grid, &surface), single), header.spectrum.freq_hz(), imaging.memory)?;
    *outlook = cost::without_transforms(outlook);
    Ok(Some(waves))
}

/// What is said about an image by spherical waves, which has no grid.
pub(in crate::cli) fn say(waves: &Waves, outlook: &Outlook, facts: &mut Map<String, Value>) {
    for of_grid in ["grid", "kernel_cells", "w_planes", "groups_of_planes"] {
        facts.remove(of_grid);
    }
    facts.insert("points".into(), outlook.pixels().into());
    facts.insert("point_s".into(), waves.back_s.into());
}
