use cittert_arrays::SpectralWindow;
use cittert_phenomenology::trace::{MeshOptions, error_map};
use cittert_phenomenology::{RenderOptions, SolidScene, Tracer, View};
use std::time::Instant;
fn cpu() -> f64 {
    let t = std::fs::read_to_string("/proc/self/stat").unwrap();
    let f: Vec<&str> = t.rsplit(") ").next().unwrap().split(' ').collect();
    (f[11].parse::<f64>().unwrap() + f[12].parse::<f64>().unwrap()) / 100.0
}
fn main() {
    rayon::ThreadPoolBuilder::new().num_threads(2).build_global().unwrap();
    for name in ["airport", "runway-fog-1", "runway-fog-2", "runway-fog-3", "runway-fog-4"] {
        let path = format!("{}/scenes/{name}.toml", env!("CARGO_MANIFEST_DIR"));
        let scene = SolidScene::from_toml(&std::fs::read_to_string(path).unwrap()).unwrap();
        let mut camera = scene.camera().unwrap().clone();
        let n: usize = std::env::args().nth(1).map_or(256, |a| a.parse().unwrap());
        camera.size_px = [n, n];
        let scene = scene.with_camera(camera).unwrap();
        let c0 = cpu();
        let tracer = Tracer::new(&scene, &[94e9], &RenderOptions::default()).unwrap();
        let c1 = cpu();
        let view = View::of_camera(scene.camera().unwrap()).unwrap();
        let band = SpectralWindow::band(94e9, 1e9, 1).unwrap();
        let full = tracer.picture(&view, &band, None).unwrap();
        let c2 = cpu();
        let one = Tracer::new(&scene, &[94e9], &RenderOptions { antialias: 1, ..RenderOptions::default() }).unwrap();
        let c3 = cpu();
        let plain = one.picture(&view, &band, None).unwrap();
        let c4 = cpu();
        let n = 20;
        let t = Instant::now();
        for _ in 0..n {
            tracer.frame(&view, &MeshOptions::default()).unwrap();
        }
        let wall = t.elapsed().as_secs_f64() / n as f64;
        let c5 = cpu();
        let frame = tracer.frame(&view, &MeshOptions::default()).unwrap();
        let rms = error_map(&frame, full.temperature.plane(0, 0)).unwrap().1;
        let rms1 = error_map(&frame, plain.temperature.plane(0, 0)).unwrap().1;
        let map = error_map(&frame, full.temperature.plane(0, 0)).unwrap().0;
        let dump = |n: &str, a: ndarray::ArrayView2<'_, f64>| {
            std::fs::write(format!("/tmp/tr/{name}.{n}"), a.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>()).unwrap()
        };
        dump("err", map.view());
        dump("full", full.temperature.plane(0, 0));
        dump("frame", frame.temperature_k.view());
        println!(
            "{name}: tables {:.2} s, full {:.3} s ({} rays), plain {:.3} s, frame {:.1} ms cpu {:.1} ms wall, {} rays; rms to AA {rms:.3}, to plain {rms1:.3}, table err {:.4}",
            c1 - c0,
            c2 - c1,
            full.rays,
            c4 - c3,
            1e3 * (c5 - c4) / n as f64,
            1e3 * wall,
            frame.rays,
            tracer.table_error_k()
        );
    }
}
