//! Speed of the tracer: primary rays a second with reflections, growth with the number of solids, the real-time mode.

use cittert_arrays::SpectralWindow;
use cittert_phenomenology::trace::MeshOptions;
use cittert_phenomenology::{RenderOptions, SolidScene, Tracer, View};
use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, Throughput};
use std::fmt::Write;
use std::process::Command;

/// One solid of the yard: kind, place, size, and whether it is metal.
struct Item {
    kind: usize,
    x: f64,
    y: f64,
    r: f64,
    metal: bool,
}

/// Solids of five kinds, spread so that the picture always shows about the same share of them.
fn items(solids: usize) -> Vec<Item> {
    let columns = (solids as f64).sqrt().ceil();
    let pitch = 50.0 / columns;
    (0..solids)
        .map(|k| {
            let (x, y) = (pitch * (k as f64 % columns) - 25.0, pitch * (k as f64 / columns).floor() - 25.0);
            Item { kind: k % 5, x, y, r: 0.3 * pitch, metal: k % 3 != 0 }
        })
        .collect()
}

/// The yard as a scene.
fn yard(solids: usize, side: usize) -> Option<SolidScene> {
    let mut text = format!(
        "kind = \"solids\"\nname = \"yard\"\n[camera]\nposition_m = [0, -60, 30]\nlook_at_m = [0, 0, 0]\nfov_deg = 50\nsize_px = [{side}, {side}]\n\
         [surface.metal]\nlayer = [{{ material = \"steel\" }}]\n[surface.soil]\nlayer = [{{ material = \"soil\" }}]\n\
         [surface.concrete]\nlayer = [{{ material = \"concrete\" }}]\n[ground]\nsurface = \"soil\"\n"
    );
    for (k, Item { kind, x, y, r, metal }) in items(solids).into_iter().enumerate() {
        let (kind, data) = match kind {
            0 => ("SPH", format!("{x}, {y}, {r}, {r}")),
            1 => ("RPP", format!("{}, {}, {}, {}, 0, {}", x - r, x + r, y - r, y + r, 2.0 * r)),
            2 => ("RCC", format!("{x}, {y}, 0, 0, 0, {}, {r}", 3.0 * r)),
            3 => ("TRC", format!("{x}, {y}, 0, 0, 0, {}, {r}, {}", 2.5 * r, 0.3 * r)),
            _ => ("ELL", format!("{x}, {y}, {r}, {x}, {y}, {}, {}", 2.0 * r, 2.5 * r)),
        };
        let surface = if metal { "metal" } else { "concrete" };
        let _ = writeln!(text, "[[body]]\nname = \"b{k}\"\ntype = \"{kind}\"\ndata = [{data}]\nsurface = \"{surface}\"");
    }
    SolidScene::from_toml(&text).ok()
}

/// The same solids for POV-Ray, every surface a mirror with its own light and nothing to shade.
fn pov(solids: usize) -> String {
    let mut text = String::from(
        "#version 3.7;\nglobal_settings { assumed_gamma 1 max_trace_level 9 adc_bailout 0.001 }\n\
         camera { location <0, -60, 30> sky z up y right x angle 50 look_at 0 }\n\
         background { rgb 0.2 }\n\
         #declare Metal = texture { pigment { rgb 0.1 } finish { ambient 0.1 diffuse 0 reflection 0.95 } }\n\
         #declare Stone = texture { pigment { rgb 0.8 } finish { ambient 0.7 diffuse 0 reflection 0.2 } }\n\
         plane { z, 0 texture { Stone } }\n",
    );
    for Item { kind, x, y, r, metal } in items(solids) {
        let shape = match kind {
            0 => format!("sphere {{ <{x}, {y}, {r}>, {r}"),
            1 => format!("box {{ <{}, {}, 0>, <{}, {}, {}>", x - r, y - r, x + r, y + r, 2.0 * r),
            2 => format!("cylinder {{ <{x}, {y}, 0>, <{x}, {y}, {}>, {r}", 3.0 * r),
            3 => format!("cone {{ <{x}, {y}, 0>, {r}, <{x}, {y}, {}>, {}", 2.5 * r, 0.3 * r),
            _ => {
                let (major, minor) = (1.25 * r, (1.25_f64.powi(2) - 0.25).sqrt() * r);
                format!("sphere {{ 0, 1 scale <{minor}, {minor}, {major}> translate <{x}, {y}, {}>", 1.5 * r)
            }
        };
        let _ = writeln!(text, "{shape} texture {{ {} }} }}", if metal { "Metal" } else { "Stone" });
    }
    text
}

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
}
