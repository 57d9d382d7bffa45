//! Speed of the tracer: primary rays a second with reflections, growth with the number of solids, the real-time mode.

mod yard;

use cittert_arrays::SpectralWindow;
use cittert_phenomenology::trace::MeshOptions;
use cittert_phenomenology::{RenderOptions, SolidScene, Tracer, View};
use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, Throughput};
use std::io::Write;
use std::process::Command;
use yard::{cpu_s, pov, yard};

/// Times POV-Ray, where it is installed, on one thread without antialiasing; its start and parsing are part of the time.
fn bench_pov(group: &mut BenchmarkGroup<'_, WallTime>) -> Option<()> {
    Command::new("povray").arg("--version").output().ok()?;
    let folder = std::env::temp_dir();
    let (input, output) = (folder.join("cittert-yard.pov"), folder.join("cittert-yard.png"));
    std::fs::write(&input, pov(50)).ok()?;
    group.bench_function("POV-Ray, 50 solids, 1024 x 1024, 1 thread", |b| {
        b.iter(|| {
            Command::new("povray")
                .args([format!("+I{}", input.display()), format!("+O{}", output.display())])
                .args(["+W1024", "+H1024", "-D", "-A", "+WT1"])
                .output()
        });
    });
    Some(())
}

/// Processor seconds of a picture, as the mean of several runs.
fn cpu_of(times: usize, mut run: impl FnMut()) -> Option<f64> {
    run();
    let before = cpu_s(false)?;
    (0..times).for_each(|_| run());
    Some((cpu_s(false)? - before) / times as f64)
}

/// Processor times of the tracer and of POV-Ray in one run. Other work on the machine hardly changes them.
fn cpu_table() -> Option<()> {
    let mut out = std::io::stdout();
    let options = RenderOptions { antialias: 1, ..RenderOptions::default() };
    let band = SpectralWindow::band(94e9, 1e9, 1).ok()?;
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().ok()?;
    let _ = writeln!(out, "\nprocessor time, one thread:");
    let seconds = |solids: usize, side: usize, times: usize| {
        let scene = yard(solids, side)?;
        let tracer = Tracer::new(&scene, &[94e9], &options).ok()?;
        let view = View::of_camera(scene.camera().ok()?).ok()?;
        cpu_of(times, || drop(one.install(|| tracer.picture(&view, &band, None))))
    };
    let ours = seconds(50, 1024, 3)?;
    let rays = 1024.0 * 1024.0;
    let _ = writeln!(out, "  50 solids, 1024 x 1024: {ours:.3} s, {:.3e} primary rays a second", rays / ours);
    let folder = std::env::temp_dir();
    let (input, output) = (folder.join("cittert-yard.pov"), folder.join("cittert-yard.png"));
    std::fs::write(&input, pov(50)).ok()?;
    let before = cpu_s(true)?;
    let times = 3;
    let ran = (0..times).all(|_| {
        Command::new("povray")
            .args([format!("+I{}", input.display()), format!("+O{}", output.display())])
            .args(["+W1024", "+H1024", "-D", "-A", "+WT1"])
            .output()
            .is_ok_and(|o| o.status.success())
    });
    if ran {
        let theirs = (cpu_s(true)? - before) / f64::from(times);
        let _ = writeln!(out, "  POV-Ray, the same solids:  {theirs:.3} s, {:.3e} primary rays a second", rays / theirs);
    }
    for solids in [10, 30, 100, 300, 1000, 3000, 10_000] {
        let s = seconds(solids, 512, 2)?;
        let _ = writeln!(out, "  {solids:5} solids, 512 x 512: {s:.3} s, {:.3} us a ray", 1e6 * s / (512.0 * 512.0));
    }
    Some(())
}

fn bench(c: &mut Criterion) -> Option<()> {
    let band = SpectralWindow::band(94e9, 1e9, 1).ok()?;
    let options = RenderOptions { antialias: 1, ..RenderOptions::default() };
    let mut group = c.benchmark_group("trace");
    group.sample_size(10);
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().ok()?;
    let two = rayon::ThreadPoolBuilder::new().num_threads(2).build().ok()?;
    {
        // Bar: 1e6 primary rays a second and core.
        let scene = yard(50, 1024)?;
        let tracer = Tracer::new(&scene, &[94e9], &options).ok()?;
        let view = View::of_camera(scene.camera().ok()?).ok()?;
        group.throughput(Throughput::Elements(1024 * 1024));
        group.bench_function("50 solids, 1024 x 1024, 1 thread", |b| b.iter(|| one.install(|| tracer.picture(&view, &band, None))));
        group.bench_function("50 solids, 1024 x 1024, 2 threads", |b| b.iter(|| two.install(|| tracer.picture(&view, &band, None))));
    }
    // Without it there is nothing to compare.
    let _ = bench_pov(&mut group);
    for solids in [10, 100, 1000, 10_000] {
        // Bar: the time grows no faster than the logarithm of the number.
        let scene = yard(solids, 256)?;
        let tracer = Tracer::new(&scene, &[94e9], &options).ok()?;
        let view = View::of_camera(scene.camera().ok()?).ok()?;
        group.throughput(Throughput::Elements(256 * 256));
        group.bench_function(format!("{solids} solids, 256 x 256, 1 thread"), |b| {
            b.iter(|| one.install(|| tracer.picture(&view, &band, None)));
        });
    }
    // Bar: 25 frames a second.
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/airport.toml");
    let scene = SolidScene::from_toml(&std::fs::read_to_string(path).ok()?).ok()?;
    let mut camera = scene.camera().ok()?.clone();
    camera.size_px = [256, 256];
    let scene = scene.with_camera(camera).ok()?;
    let tracer = Tracer::new(&scene, &[94e9], &options).ok()?;
    let view = View::of_camera(scene.camera().ok()?).ok()?;
    let mesh = MeshOptions::default();
    group.throughput(Throughput::Elements(256 * 256));
    group.bench_function("real-time frame of the airport, 256 x 256, 2 threads", |b| b.iter(|| two.install(|| tracer.frame(&view, &mesh))));
    group.finish();
    Some(())
}

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    // A scene that cannot be read shows as missing results.
    let _ = bench(&mut criterion);
    criterion.final_summary();
    let _ = cpu_table();
}
