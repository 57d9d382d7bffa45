//! The work of rendering a scene of solids. The time of a ray depends on what it meets, so some of the rays of the very picture are followed first.
//!
//! A full picture has a ray for each pixel, and more for pixels on edges and for what surfaces scatter. These depend on the size of a pixel, so squares of the picture
//! are rendered as they are: those of the tiles in which the tracer works, spread evenly over the picture (Roberts 2018, "The unreasonable effectiveness of quasirandom
//! sequences"). A frame of the real-time mode is smoothed as a whole. Where it is large, two smaller frames say what a ray and a pixel take.

use super::pilot::{Measured, measured};
use crate::cli::failure::{Failure, Result};
use cittert_arrays::{Image, SpectralWindow};
use cittert_phenomenology::trace::MeshOptions;
use cittert_phenomenology::{RenderOptions, SolidScene, Tracer, View};
use ndarray::Axis;
use rayon::prelude::*;
use std::time::Instant;

/// Side of a square, pixels.
const SIDE: usize = 32;
/// Squares that are rendered at least, and how many at a time.
const LEAST: usize = 96;
const AT_ONCE: usize = 32;
/// Time after which no more of a picture is needed, s.
const ENOUGH_S: f64 = 0.4;
/// Pixels of the first frame of the real-time mode, and of the image that stands for the scene.
const FIRST: f64 = 4096.0;
/// A frame with pixels that are less wide than this times those of the whole takes about as long, so the whole is rendered.
const ABOUT_WHOLE: f64 = 1.25;

/// What the rendering of a scene takes.
#[derive(Debug)]
pub(in crate::cli) struct Rendered {
    /// Time of the tables of surfaces, sky and air, s.
    pub(in crate::cli) setup_s: f64,
    /// Time of all rays, s.
    pub(in crate::cli) trace_s: f64,
    /// Number of rays from the camera.
    pub(in crate::cli) rays: f64,
    /// Bytes of the tables, and of all arrays while the picture is made.
    pub(in crate::cli) bytes: f64,
    /// Pixels of the picture that were rendered.
    pub(in crate::cli) sampled: f64,
    /// A small picture of the scene, K; none in the real-time mode.
    pub(in crate::cli) image: Option<Image>,
}

/// A frame or a part of a picture that was made.
#[derive(Debug, Clone, Copy, Default)]
struct Small {
    pixels: f64,
    rays: f64,
    seconds: f64,
}

/// Look at a scene. With a mesh it is rendered in the real-time mode.
///
/// # Errors
/// As the rendering itself.
pub(in crate::cli) fn rendered(
    scene: &SolidScene,
    view: &View,
    spectrum: &SpectralWindow,
    options: &RenderOptions,
    mesh: Option<&MeshOptions>,
) -> Result<Rendered> {
    let Measured { result: (tracer, band), seconds: setup_s, held_bytes } = measured(|| Ok(scene.tracer_for(view, spectrum, options)?))?;
    let all = pixels(view);
    if let Some(mesh) = mesh {
        let (Small { rays, seconds, .. }, sampled) = framed(&tracer, view, mesh)?;
        let bytes = held_bytes + Tracer::frame_bytes(view) as f64;
        return Ok(Rendered { setup_s, trace_s: seconds, rays, bytes, sampled, image: None });
    }
    let bytes = held_bytes + tracer.picture_bytes(view)? as f64;
    let coarse = view.with_wider_pixels((all / FIRST).sqrt().max(1.0))?;
    let image = tracer.picture(&coarse, &band, None)?.temperature;
    let some = sampled(&tracer, view, &band)?;
    let factor = all / some.pixels;
    Ok(Rendered { setup_s, trace_s: factor * some.seconds, rays: factor * some.rays, bytes, sampled: some.pixels, image: Some(image) })
}

fn pixels(view: &View) -> f64 {
    (view.grid().n_l * view.grid().n_m) as f64
}

/// Squares of a picture, or all of it where it has few.
fn sampled(tracer: &Tracer<'_>, view: &View, band: &SpectralWindow) -> Result<Small> {
    let (columns, rows) = (view.grid().n_l, view.grid().n_m);
    // Squares that the border cuts are left out.
    let (across, down) = (columns / SIDE, rows / SIDE);
    let picture = |view: &View| Ok::<_, Failure>(tracer.picture(view, band, None)?.rays as f64);
    if across * down <= LEAST {
        let started = Instant::now();
        let rays = picture(view)?;
        return Ok(Small { pixels: pixels(view), rays, seconds: started.elapsed().as_secs_f64() });
    }
    let order = spread_evenly(across, down);
    let mut sum = Small::default();
    for (k, squares) in order.chunks(AT_ONCE).enumerate() {
        if sum.seconds > ENOUGH_S && k * AT_ONCE >= LEAST {
            break;
        }
        let started = Instant::now();
        let made: Vec<(f64, f64)> = squares
            .par_iter()
            .map(|&(x, y)| {
                let part = view.part([x * SIDE, y * SIDE], [SIDE, SIDE])?;
                Ok((pixels(&part), picture(&part)?))
            })
            .collect::<Result<_>>()?;
        sum.seconds += started.elapsed().as_secs_f64();
        sum.pixels += made.iter().map(|m| m.0).sum::<f64>();
        sum.rays += made.iter().map(|m| m.1).sum::<f64>();
    }
    Ok(sum)
}

/// All squares of a picture, in an order whose beginnings cover it evenly.
fn spread_evenly(across: usize, down: usize) -> Vec<(usize, usize)> {
    // The sequence of Roberts in two dimensions: multiples of the powers of a root of x^3 = x + 1.
    const ROOT: f64 = 1.324_717_957_244_746;
    let (mut seen, mut order) = (vec![false; across * down], Vec::new());
    let place = |k: usize, power: i32, n: usize| (((0.5 + k as f64 * ROOT.powi(-power)).fract() * n as f64) as usize).min(n - 1);
    // In the end few are missing, and these come in their own order.
    for k in 0..4 * across * down {
        let (x, y) = (place(k, 1, across), place(k, 2, down));
        if !std::mem::replace(&mut seen[y * across + x], true) {
            order.push((x, y));
        }
    }
    order.extend((0..across * down).filter(|k| !seen[*k]).map(|k| (k % across, k / across)));
    order
}

/// A frame of the real-time mode, and the pixels of the largest one that was made for it.
fn framed(tracer: &Tracer<'_>, view: &View, mesh: &MeshOptions) -> Result<(Small, f64)> {
    let all = pixels(view);
    let (mut before, mut wanted) = (None, FIRST);
    loop {
        let factor = (all / wanted).sqrt();
        let whole = factor < ABOUT_WHOLE;
        let small = if whole { view.clone() } else { view.with_wider_pixels(factor)? };
        let started = Instant::now();
        let rays = tracer.frame(&small, mesh)?.rays as f64;
        let last = Small { pixels: pixels(&small), rays, seconds: started.elapsed().as_secs_f64() };
        if whole {
            return Ok((last, last.pixels));
        }
        if let Some(before) = before.filter(|_| last.seconds > ENOUGH_S) {
            return Ok((extrapolated(before, last, all), last.pixels));
        }
        (before, wanted) = (Some(last), 4.0 * wanted);
    }
}

/// A frame of so many pixels, from two smaller ones. Its rays grow with a power of the number of pixels.
fn extrapolated(before: Small, last: Small, pixels: f64) -> Small {
    let power = (last.rays.max(1.0) / before.rays.max(1.0)).ln() / (last.pixels / before.pixels).ln();
    let rays = last.rays * (pixels / last.pixels).powf(power.clamp(0.0, 1.0));
    // Two frames, two unknowns: the time of a ray and that of a pixel. Neither is below 0.
    let determinant = before.rays * last.pixels - last.rays * before.pixels;
    let ray_s = (before.seconds * last.pixels - last.seconds * before.pixels) / determinant;
    let ray_s = if ray_s.is_finite() { ray_s.clamp(0.0, last.seconds / last.rays.max(1.0)) } else { 0.0 };
    let pixel_s = (last.seconds - ray_s * last.rays) / last.pixels;
    Small { pixels, rays, seconds: ray_s * rays + pixel_s * pixels }
}

impl Rendered {
    /// An image on another grid that shows about the same: each of its pixels has the temperature of the nearest one of the picture.
    pub(in crate::cli) fn spread(&self, (columns, rows): (usize, usize)) -> Option<ndarray::Array4<f64>> {
        let data = &self.image.as_ref()?.data; // [chan, pol, m, l]
        let (from_rows, from_columns) = (data.len_of(Axis(2)), data.len_of(Axis(3)));
        let near = |k: usize, n: usize, of: usize| ((2 * k + 1) * of / (2 * n)).min(of.saturating_sub(1));
        let shape = (data.len_of(Axis(0)), data.len_of(Axis(1)), rows, columns);
        Some(ndarray::Array4::from_shape_fn(shape, |(c, p, m, l)| data[(c, p, near(m, rows, from_rows), near(l, columns, from_columns))]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The pixels of lines have rays in the real-time mode.
    #[test]
    fn rays_of_a_frame_grow_as_lines_do() {
        let of = |side: f64| Small { pixels: side * side, rays: 16.0 * side, seconds: 2e-6 * 16.0 * side + 1e-7 * side * side };
        let (found, all) = (extrapolated(of(64.0), of(128.0), 1024.0 * 1024.0), of(1024.0));
        assert!((found.rays / all.rays - 1.0).abs() < 1e-9 && (found.seconds / all.seconds - 1.0).abs() < 1e-9, "{found:?} {all:?}");
    }

    #[test]
    fn the_first_squares_cover_a_picture_evenly() {
        let order = spread_evenly(24, 16);
        let mut all = order.clone();
        all.sort_unstable();
        all.dedup();
        assert_eq!((order.len(), all.len()), (24 * 16, 24 * 16));
        // Of the first 96, each eighth of the picture has its twelve, give or take three.
        for k in 0..8 {
            let n = order[..96].iter().filter(|(x, y)| x / 6 + 4 * (y / 8) == k).count();
            assert!((9..=15).contains(&n), "{k}: {n}");
        }
    }
}
