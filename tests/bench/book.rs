//! Writes the page of the book on the cost of imaging: processor time against the number of visibilities and of pixels, and the speed of both
//! directions as a fraction of the machine's limit.
//!
//! Columns of the grid are transformed while rows are gridded or predicted, so gridding and transforms have no times of their own.

use crate::limits::{cpu_s, least, multiply_adds, triad};
use crate::tracks::{CELL_RAD, Tracks, tracks};
use crate::{Done, Value};
use cittert::fourier::{GridOptions, Transform, UvwExtent};
use cittert::plot::{CurveOptions, Series, curves};
use cittert_arrays::{SkyFrame, SkyGrid};
use num_complex::Complex32;
use serde_json::json;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Visibilities of one block. Only one block is in memory at a time.
const BLOCK: usize = 10_000_000;
const CHANNELS: usize = 64;
const BASELINES: usize = 351;
const SIDE: usize = 2048;
const BEGIN: &str = "<!-- measured: written by `make bench-book` -->";
const END: &str = "<!-- end of what was measured -->";

/// Processor seconds from visibilities to an image and back, and of the parts.
#[derive(Debug, Clone, Copy, Default)]
struct Times {
    plan: f64,
    sort: f64,
    spread: f64,
    to_image: f64,
    from_image: f64,
    gather: f64,
    /// Multiply-adds of gridding, and bytes and multiply-adds of one transform of the planes.
    spread_ops: f64,
    fourier_ops: f64,
    fourier_bytes: f64,
    vis_bytes: f64,
}

impl Times {
    /// Time from visibilities to an image. The order of the steps does not matter: planes that do not fit into memory together are made in groups.
    fn there(&self) -> f64 {
        self.sort + self.spread + self.to_image
    }

    /// Time from an image to visibilities.
    fn back(&self) -> f64 {
        self.sort + self.from_image + self.gather
    }
}

/// The same field of view with any number of pixels, so that the cost of the w term does not depend on their number.
fn grid(n: usize) -> Done<SkyGrid> {
    let cell = CELL_RAD * SIDE as f64 / n as f64;
    Ok(SkyGrid::new(n, n, cell, SkyFrame::Sky { ra_rad: 0.0, dec_rad: 0.5, frame: "icrs".into() })?)
}

/// About `n_vis` visibilities in blocks, each block with its own hour angles.
fn measure(n_vis: usize, side: usize, turns: usize) -> Done<(usize, Times)> {
    let n_times = n_vis.div_ceil(BASELINES * CHANNELS).max(1);
    let a_block = (BLOCK / (BASELINES * CHANNELS)).min(n_times);
    let blocks = n_times.div_ceil(a_block);
    let extent = UvwExtent::of(tracks(0..64, 64, 1).uvw_m.view());
    let mut t = Times::default();
    let mut done = 0;
    // A little more than the longest baseline at any hour angle.
    let extent = UvwExtent { u_m: extent.u_m * 1.1, v_m: extent.v_m * 1.1, w_m: extent.w_m * 1.1 };
    let options = GridOptions::default();
    let freq = tracks(0..1, 1, CHANNELS).freq_hz;
    let grid = grid(side)?;
    let (plan, transform) = least(turns, || Transform::<f32>::new(&grid, &freq, extent, &options, n_vis as u64));
    let transform = transform?;
    t.plan = plan;
    let mut gridder = transform.gridder();
    let (mut image, mut first) = (None, true);
    for pass in 0..2 {
        for b in 0..blocks {
            let from = b * a_block;
            let Tracks { uvw_m, vis, .. } = tracks(from..(from + a_block).min(n_times), n_times, CHANNELS);
            if pass == 0 {
                let (s, rows) = least(turns, || transform.sort(uvw_m.view()));
                let rows = rows?;
                t.sort += s;
                let work = transform.work(&rows);
                t.spread_ops += work.spread_multiply_adds;
                (t.fourier_ops, t.fourier_bytes) = (work.fourier_multiply_adds, work.fourier_bytes);
                t.vis_bytes += (vis.len() * size_of::<Complex32>()) as f64 + work.node_bytes;
                let fill = |r: usize, out: &mut [Complex32]| out.iter_mut().zip(vis.row(r)).for_each(|(o, v)| *o = *v);
                let (s, result) = least(turns, || gridder.add_sorted(&rows, fill));
                result?;
                t.spread += s;
                done += vis.len();
            } else {
                let model = transform.degridder(ndarray::ArrayView2::<f64>::from(image.as_ref().ok_or("no image")?))?;
                let mut out = vis;
                // A prediction that runs once sorts the rows as well. Sorting has its own column in the table.
                let (s, result) = least(turns, || model.predict(uvw_m.view(), out.view_mut()));
                result?;
                t.gather += s;
                if first {
                    drop(model);
                    let view = ndarray::ArrayView2::<f64>::from(image.as_ref().ok_or("no image")?);
                    let (s, model) = least(turns, || transform.degridder(view));
                    drop(model?);
                    t.from_image = s;
                    first = false;
                }
            }
        }
        if pass == 0 {
            let full = std::mem::replace(&mut gridder, transform.gridder());
            let start = cpu_s();
            let made = full.finish();
            t.to_image = cpu_s() - start;
            image = Some(made);
        }
    }
    t.gather -= t.sort;
    Ok((done, t))
}

/// Slope of ln y against ln x by least squares.
fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let (mx, my) = points.iter().fold((0.0, 0.0), |(a, b), (x, y)| (a + x.ln() / n, b + y.ln() / n));
    let (up, down) = points.iter().fold((0.0, 0.0), |(u, d), (x, y)| (u + (x.ln() - mx) * (y.ln() - my), d + (x.ln() - mx).powi(2)));
    up / down
}

fn picture(name: &str, x_label: &str, lines: Vec<(&str, Vec<(f64, f64)>)>) -> Done<()> {
    let options = CurveOptions {
        x_label: x_label.into(),
        y_label: "processor time, s".into(),
        log_x: true,
        log_y: true,
        width: 760,
        height: 440,
        ..CurveOptions::default()
    };
    let series: Vec<Series> = lines.into_iter().map(|(name, points)| Series { name: name.into(), points, errors: Vec::new() }).collect();
    std::fs::write(root().join("img").join(name), curves(&series, &options)?.png()?)?;
    Ok(())
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/algorithms")
}

/// Measure, draw, and put the tables into the page.
pub(crate) fn write() -> Done<Value> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    pool.install(measured)
}

fn measured() -> Done<Value> {
    let (bandwidth, arithmetic) = (triad(), multiply_adds());
    let mut text = format!(
        "One thread. Memory moves {:.1} GB a second (triad), the processor does {:.1} thousand million multiply-adds a second (single precision).\n\n",
        bandwidth * 1e-9,
        arithmetic * 1e-9
    );
    // Against visibilities.
    let mut by_vis = Vec::new();
    text += "| visibilities at 2048 x 2048 | sort, s | to image, s | from image, s |\n|---|---|---|---|\n";
    for n in [100_000, 1_000_000, 10_000_000, 100_000_000] {
        let (n, t) = measure(n, SIDE, if n < 5_000_000 { 3 } else { 1 })?;
        writeln!(text, "| {n} | {:.3} | {:.3} | {:.3} |", t.sort, t.there(), t.back())?;
        by_vis.push((n as f64, t));
    }
    let line = |f: fn(&Times) -> f64| by_vis.iter().map(|(n, t)| (*n, f(t))).collect::<Vec<_>>();
    let (there, back) = (line(Times::there), line(Times::back));
    let slopes_vis = (slope(&there[2..]), slope(&back[2..]));
    picture("cost-visibilities.png", "visibilities", vec![("visibilities to image", there), ("image to visibilities", back)])?;
    // Against pixels.
    let mut by_side = Vec::new();
    text += "\n| side, with a million visibilities | plan, s | to image, s | from image, s |\n|---|---|---|---|\n";
    for side in [256, 512, 1024, 2048, 4096, 8192] {
        let (_, t) = measure(1_000_000, side, if side < 4096 { 2 } else { 1 })?;
        writeln!(text, "| {side} | {:.3} | {:.3} | {:.3} |", t.plan, t.there(), t.back())?;
        by_side.push(((side * side) as f64, t));
    }
    let line = |f: fn(&Times) -> f64| by_side.iter().map(|(n, t)| (*n, f(t))).collect::<Vec<_>>();
    let (to, from) = (line(Times::there), line(Times::back));
    let slopes_pixels = (slope(&to[2..]), slope(&from[2..]));
    picture("cost-pixels.png", "pixels", vec![("visibilities to image", to), ("image to visibilities", from)])?;
    writeln!(
        text,
        "\nFitted slopes of ln(time): against visibilities (from ten million on) {:.2} to the image and {:.2} from it; against pixels \
         (from 1024 x 1024 on) {:.2} to the image and {:.2} from it. 1 is linear.\n\n\
         ![Processor time against visibilities](img/cost-visibilities.png)\n\n![Processor time against pixels](img/cost-pixels.png)\n",
        slopes_vis.0, slopes_vis.1, slopes_pixels.0, slopes_pixels.1
    )?;
    // The fraction of the machine's limits that each direction reaches, with ten million visibilities.
    let t = by_vis.iter().map(|v| v.1).nth(2).unwrap_or_default();
    let (ops, bytes) = (t.spread_ops + t.fourier_ops, t.vis_bytes + t.fourier_bytes);
    text += "| ten million visibilities | part of peak arithmetic | part of memory bandwidth |\n|---|---|---|\n";
    for (name, s) in [("to image", t.there()), ("from image", t.back())] {
        writeln!(text, "| {name} | {:.0} % | {:.0} % |", 100.0 * ops / s / arithmetic, 100.0 * bytes / s / bandwidth)?;
    }
    let path = root().join("performance.md");
    let page = std::fs::read_to_string(&path)?;
    let (head, rest) = page.split_once(BEGIN).ok_or("the page has lost its marker")?;
    let (_, tail) = rest.split_once(END).ok_or("the page has lost its second marker")?;
    std::fs::write(&path, format!("{head}{BEGIN}\n\n{text}\n{END}{tail}"))?;
    Ok(json!({ "bandwidth_bytes_s": bandwidth, "multiply_adds_s": arithmetic, "slope_vis": slopes_vis, "slope_pixels": slopes_pixels }))
}
