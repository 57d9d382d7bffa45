//! Sheets of the scenes that ship: in grey, and in colour by cause.

use crate::{Drawn, root, small};
use cittert::plot::{SceneStretch, cause_picture, scene_picture};
use cittert_arrays::SpectralWindow;
use cittert_phenomenology::{RenderOptions, SolidScene, View};
use image::{DynamicImage, Rgb, RgbImage, imageops};

/// Width of a picture, and the gap between two, in pixels.
const WIDTH: u32 = 512;
const GAP: u32 = 10;

/// The full model of every scene. An optimised build takes about a minute.
pub(crate) fn draw() -> Drawn {
    let fog = ["runway-fog-1", "runway-fog-2", "runway-fog-3", "runway-fog-4"];
    sheet("scenes", &["airport", "t-72", "bmp-1", "ss-24", "ship", "security"], grey)?;
    sheet("scenes-causes", &["airport", "t-72", "bmp-1", "ss-24", "runway-fog-3", "security"], by_cause)?;
    sheet("scenes-fog", &fog, grey)
}

/// A scene as a PNG.
type Draw = fn(&SolidScene) -> Drawn<Vec<u8>>;

fn grey(scene: &SolidScene) -> Drawn<Vec<u8>> {
    let picture = scene.picture(&View::of_camera(scene.camera()?)?, &band(scene)?, &RenderOptions::default())?;
    let on_surface = picture.material.mapv(|m| m > 0);
    Ok(scene_picture(picture.temperature.plane(0, 0), on_surface.view(), SceneStretch::Asinh)?)
}

fn by_cause(scene: &SolidScene) -> Drawn<Vec<u8>> {
    let options = RenderOptions { causes: true, ..RenderOptions::default() };
    let picture = scene.picture(&View::of_camera(scene.camera()?)?, &band(scene)?, &options)?;
    Ok(cause_picture(picture.causes_k.ok_or("the tracer told no causes")?.view())?)
}

fn band(scene: &SolidScene) -> Drawn<SpectralWindow> {
    let freq_hz = scene.file().freq_hz.ok_or("the scene states no frequency")?;
    Ok(SpectralWindow::band(freq_hz, 1e9, 1)?)
}

/// Pictures of scenes, two in a row.
fn sheet(name: &str, scenes: &[&str], draw: Draw) -> Drawn {
    let mut rows: Vec<Vec<RgbImage>> = Vec::new();
    for pair in scenes.chunks(2) {
        rows.push(pair.iter().map(|scene| panel(scene, draw)).collect::<Drawn<_>>()?);
    }
    let height = |row: &Vec<RgbImage>| row.iter().map(RgbImage::height).max().unwrap_or(0);
    let whole: u32 = rows.iter().map(|row| height(row) + GAP).sum::<u32>() - GAP;
    let mut out = RgbImage::from_pixel(2 * WIDTH + GAP, whole, Rgb([255; 3]));
    let mut top = 0;
    for row in &rows {
        for (k, panel) in row.iter().enumerate() {
            imageops::replace(&mut out, panel, k as i64 * i64::from(WIDTH + GAP), i64::from(top));
        }
        top += height(row) + GAP;
    }
    let mut png = Vec::new();
    DynamicImage::from(out).write_to(&mut std::io::Cursor::new(&mut png), image::ImageFormat::Png)?;
    std::fs::write(root().join("docs/algorithms/img").join(format!("{name}.png")), small(&png)?)?;
    Ok(())
}

/// The picture of a scene at the width of a panel.
fn panel(scene: &str, draw: Draw) -> Drawn<RgbImage> {
    let path = root().join("phenomenology/scenes").join(format!("{scene}.toml"));
    let scene = SolidScene::from_toml(&std::fs::read_to_string(&path)?).map_err(|e| format!("{}: {e}", path.display()))?;
    let drawn = image::load_from_memory(&draw(&scene)?)?.to_rgb8();
    let height = (f64::from(drawn.height() * WIDTH) / f64::from(drawn.width())).round() as u32;
    Ok(imageops::resize(&drawn, WIDTH, height, imageops::FilterType::Triangle))
}
