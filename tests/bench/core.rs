//! Times gridding and minor cycles without reading and writing, for comparisons with other programs, and prints one line of JSON. With `book` it
//! writes the page of the book on the cost of imaging.
//!
//! `core transform FILE PIXELS CELL_ARCSEC EPSILON TURNS`, `core minor ALGORITHM PSF.fits DIRTY.fits COMPONENTS MODEL.fits`, `core book`.
// This program prints its result.
#![allow(clippy::print_stdout)]

mod book;
mod limits;
mod tracks;

use cittert::deconvolve::{CleanTuning, Minor, MinorLimits, Scales, by_name};
use cittert::fourier::{GridOptions, Transform, UvwExtent};
use cittert_arrays::{BrightnessUnit, SkyGrid, for_each_block};
use cittert_formats::fits::{ImageOptions, write_image};
use cittert_formats::{open_image, open_visibilities};
use limits::least;
use ndarray::{Array2, Axis, concatenate};
use num_complex::Complex32;
use serde_json::{Value, json};
use std::error::Error;
use std::path::Path;
use std::time::Instant;

type Done<T> = Result<T, Box<dyn Error + Send + Sync>>;

fn main() -> Done<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let said = match words[..] {
        ["transform", file, n, cell, epsilon, turns] => {
            transform(Path::new(file), (n.parse()?, cell.parse()?), (epsilon.parse()?, turns.parse()?))?
        }
        ["minor", name, psf, dirty, n, model] => minor(name, (Path::new(psf), Path::new(dirty)), n.parse()?, Path::new(model))?,
        ["book"] => book::write()?,
        _ => return Err("expected transform, minor or book; see the head of tests/bench/core.rs".into()),
    };
    println!("{said}");
    Ok(())
}

/// uvw, channels, visibilities and the grid of a file.
type Contents = (Array2<f64>, Vec<f64>, Array2<Complex32>, SkyGrid);

/// uvw and Stokes I (mean of the first two products) of a whole file.
fn read(path: &Path) -> Done<Contents> {
    let mut source = open_visibilities(path)?;
    let freq_hz = source.header().spectrum.freq_hz().to_vec();
    let center = source.header().phase_centers.first().ok_or("no phase centre")?.clone();
    let (mut uvw, mut vis) = (Vec::new(), Vec::new());
    for_each_block(source.as_mut(), 64 << 20, |_, block| -> Result<(), cittert_arrays::ArrayError> {
        let last = block.vis.len_of(Axis(2)) - 1;
        vis.push((&block.vis.index_axis(Axis(2), 0) + &block.vis.index_axis(Axis(2), last.min(1))).mapv(|v| v * 0.5));
        uvw.push(block.coverage.uvw_m);
        Ok(())
    })?;
    let uvw = concatenate(Axis(0), &uvw.iter().map(|a| a.view()).collect::<Vec<_>>())?;
    let vis = concatenate(Axis(0), &vis.iter().map(|a| a.view()).collect::<Vec<_>>())?;
    Ok((uvw, freq_hz, vis, SkyGrid::new(2, 2, 1e-6, SkyGrid::frame_of(&center))?))
}

/// Time the way from visibilities to an image and back, on one thread and on two. The time includes sorting, and no reading of the file.
fn transform(path: &Path, (n, cell_arcsec): (usize, f64), (epsilon, turns): (f64, usize)) -> Done<Value> {
    let (uvw, freq_hz, vis, any) = read(path)?;
    let grid = SkyGrid::new(n, n, cell_arcsec.to_radians() / 3600.0, any.frame)?;
    let options = GridOptions { epsilon, ..GridOptions::default() };
    let extent = UvwExtent::of(uvw.view());
    let mut said = json!({ "n_vis": vis.len() });
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
        let mut wall = [f64::INFINITY; 2];
        let to_image = || -> cittert::Result<Array2<f64>> {
            let start = Instant::now();
            let transform = Transform::<f32>::new(&grid, &freq_hz, extent, &options, vis.len() as u64)?;
            let rows = transform.sort(uvw.view())?;
            let mut gridder = transform.gridder();
            gridder.add_sorted(&rows, |r, out| out.iter_mut().zip(vis.row(r)).for_each(|(o, v)| *o = *v))?;
            let image = gridder.finish();
            wall[0] = wall[0].min(start.elapsed().as_secs_f64());
            Ok(image)
        };
        let mut to_image = to_image;
        let (cpu_to, image) = least(turns, || pool.install(&mut to_image));
        let mut image = image?;
        image /= vis.len() as f64;
        let mut out = Array2::from_elem(vis.dim(), Complex32::default());
        let mut from_image = || -> cittert::Result<()> {
            let start = Instant::now();
            let transform = Transform::<f32>::new(&grid, &freq_hz, extent, &options, vis.len() as u64)?;
            transform.degridder(image.view())?.predict(uvw.view(), out.view_mut())?;
            wall[1] = wall[1].min(start.elapsed().as_secs_f64());
            Ok(())
        };
        let (cpu_from, result) = least(turns, || pool.install(&mut from_image));
        result?;
        said[format!("threads_{threads}")] = json!({
            "to_image": { "cpu_s": cpu_to, "wall_s": wall[0] }, "from_image": { "cpu_s": cpu_from, "wall_s": wall[1] },
        });
    }
    Ok(said)
}

/// Time one minor cycle with a given number of components, on a beam and a dirty image that any program may have written.
fn minor(name: &str, (psf, dirty): (&Path, &Path), iterations: usize, model_path: &Path) -> Done<Value> {
    let (mut psf, dirty) = (open_image(psf)?.plane(0, 0).mapv(|v| v as f32), open_image(dirty)?);
    let center = (psf.nrows() / 2, psf.ncols() / 2);
    let peak = psf[center];
    psf /= peak;
    let psf = psf.into_shared();
    let field = dirty.plane(0, 0).mapv(|v| v as f32);
    let limits = MinorLimits { gain: 0.1, level: 0.0, iterations, negative: true };
    let entry = by_name(name)?;
    let (made_s, deconvolver) = least(1, || (entry.make)(&psf, &Scales::default(), &CleanTuning::default()));
    let mut deconvolver = deconvolver?;
    let mut residual = field.clone();
    let (cpu_s, report) = least(1, || deconvolver.minor(Minor { residual: &mut residual, mask: None, limits }));
    let report = report?;
    let mut model = Array2::zeros(field.dim());
    deconvolver.draw(&report.components, &mut model);
    let rms = (residual.iter().map(|v| f64::from(v * v)).sum::<f64>() / residual.len() as f64).sqrt();
    let mut image = dirty;
    image.unit = BrightnessUnit::JyPerPixel;
    image.beams.clear();
    image.plane_mut(0, 0).assign(&model);
    write_image(model_path, &image, ImageOptions { overwrite: true, ..ImageOptions::default() })?;
    let (iterations, peak) = (report.components.len(), residual.iter().fold(0.0_f32, |a, v| a.max(v.abs())));
    Ok(json!({ "iterations": iterations, "cpu_s": made_s + cpu_s, "peak": peak, "rms": rms, "flux": model.sum() }))
}
