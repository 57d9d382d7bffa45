//! The processor time of the tracer against the number of solids.

#[path = "../../phenomenology/benches/yard/mod.rs"]
#[allow(dead_code)] // the bench uses the rest
mod yard;

use crate::{Drawn, Figure, Points};
use cittert_arrays::SpectralWindow;
use cittert_phenomenology::{RenderOptions, Tracer, View};

const SIDE: usize = 512;

/// Each run measures the times again, so the picture depends on the machine. Use an optimised build.
pub(crate) fn draw() -> Drawn {
    let options = RenderOptions { antialias: 1, ..RenderOptions::default() };
    let band = SpectralWindow::band(94e9, 1e9, 1)?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let mut points = Points::new();
    for solids in [10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10_000] {
        let scene = yard::yard(solids, SIDE).ok_or("the yard cannot be built")?;
        let tracer = Tracer::new(&scene, &[94e9], &options)?;
        let view = View::of_camera(scene.camera()?)?;
        let now = || yard::cpu_s(false).ok_or("the system does not tell processor time");
        let before = now()?;
        let times = 3;
        for _ in 0..times {
            pool.install(|| tracer.picture(&view, &band, None))?;
        }
        points.push((solids as f64, 1e6 * (now()? - before) / (times * SIDE * SIDE) as f64));
    }
    let mut figure =
        Figure::new("Processor time of a primary ray with its reflections", "number of solids", "microseconds").log(true, false);
    // Growth with the logarithm is a straight line through the first and the last third of the points.
    let (first, last) = (points[0], points[points.len() - 1]);
    figure.ours("through the ends", vec![first, last]);
    figure.theirs(points);
    figure.save("tracer-growth")
}
