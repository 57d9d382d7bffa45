//! Renders a scene of solids with its own camera and writes the temperatures as raw numbers for a plotting tool.
//!
//! `cargo run --release -p cittert-phenomenology --example render -- SCENE.toml OUT.raw [FREQ_GHZ] [SIDE]`: a line of text with
//! columns and rows, then rows from the bottom, 32-bit floats, K.

use cittert_arrays::SpectralWindow;
use cittert_phenomenology::{RenderOptions, SolidScene, View};
use std::io::Write;
use std::process::ExitCode;
use std::time::Instant;

fn render(args: &[String]) -> Result<String, Box<dyn std::error::Error>> {
    let [scene, out, rest @ ..] = args else { return Err("give SCENE.toml and OUT.raw".into()) };
    let freq_ghz: f64 = rest.first().map_or(Ok(94.0), |f| f.parse())?;
    let scene = SolidScene::from_toml(&std::fs::read_to_string(scene)?)?;
    let mut camera = scene.camera()?.clone();
    if let Some(side) = rest.get(1) {
        let side: usize = side.parse()?;
        let [columns, rows] = camera.size_px;
        camera.size_px = [side, side * rows / columns];
    }
    let scene = scene.with_camera(camera)?;
    let view = View::of_camera(scene.camera()?)?;
    let band = SpectralWindow::band(freq_ghz * 1e9, 1e9, 1)?;
    let start = Instant::now();
    let picture = scene.picture(&view, &band, &RenderOptions::default())?;
    let plane = picture.temperature.plane(0, 0);
    let mut file = std::io::BufWriter::new(std::fs::File::create(out)?);
    writeln!(file, "{} {}", plane.ncols(), plane.nrows())?;
    for t in plane {
        file.write_all(&(*t as f32).to_le_bytes())?;
    }
    file.flush()?;
    let bodies = scene.geometry().bodies().len();
    Ok(format!("{}: {bodies} bodies, {} rays in {:.2} s", scene.name(), picture.rays, start.elapsed().as_secs_f64()))
}

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let mut err = std::io::stderr();
    match render(&args) {
        Ok(line) => {
            let _ = writeln!(err, "{line}");
            ExitCode::SUCCESS
        }
        Err(e) => {
            let mut chain = e.to_string();
            let mut source = e.source();
            while let Some(s) = source {
                chain = format!("{chain}: {s}");
                source = s.source();
            }
            let _ = writeln!(err, "{chain}");
            ExitCode::FAILURE
        }
    }
}
