//! Planes of images, alone or side by side.

use super::axes::{Axis, angle_unit};
use super::heat::{Ellipse, Heat, Map, levels};
use super::panel::Sheet;
use super::picture::Picture;
use super::size::{DEFAULT_HEIGHT, DEFAULT_WIDTH};
use super::units::{brightness, value_unit};
use super::view::{View, Wish};
use crate::fidelity::robust_rms;
use crate::{ChainError, Result};
use cittert_arrays::{Image, SkyFrame};
use ndarray::s;

/// How to draw an image.
#[derive(Debug, Clone, PartialEq)]
pub struct ImagePlot {
    /// Channel of the image.
    pub chan: usize,
    /// Polarisation of the image.
    pub pol: usize,
    /// Title; empty for none. Its second line is smaller.
    pub title: String,
    /// Which values, colours and part of the frame are shown.
    pub wish: Wish,
    /// The view that was chosen for another image, in place of `wish`, so that both can be compared.
    pub view: Option<View>,
    /// Width of the picture, pixels.
    pub width: usize,
    /// Height of the picture, pixels; less where the image is wide, as its cells are square.
    pub height: usize,
}

impl Default for ImagePlot {
    fn default() -> Self {
        Self { chan: 0, pol: 0, title: String::new(), wish: Wish::default(), view: None, width: DEFAULT_WIDTH, height: DEFAULT_HEIGHT }
    }
}

/// Draw one plane of an image, with square cells and the beam in the lower left corner. On the sky l grows to the left, around a boresight
/// to the right.
///
/// # Errors
/// A channel or polarisation that the image does not have, an image without a finite value, a picture below 100 or above 8000 pixels.
pub fn image(image: &Image, options: &ImagePlot) -> Result<Picture> {
    images(&[(image, "")], options)
}

/// Draw the same plane of several images side by side, each below its title, in the colours of the first.
///
/// # Errors
/// As [`image()`], and images of different fields or units.
pub fn images(all: &[(&Image, &str)], options: &ImagePlot) -> Result<Picture> {
    let Some(((first, _), others)) = all.split_first() else { return Err(ChainError::NoData("there is no image to draw".into())) };
    let own = View::new(first, options.chan, options.pol, &options.wish)?;
    let view = options.view.clone().unwrap_or(own);
    let (rows, columns) = view.cells(&first.grid);
    let grid = &first.grid;
    let half = 0.5 * grid.cell_rad;
    for (image, name) in others {
        let apart =
            |n: usize, o: usize| (n as f64 * grid.cell_rad - o as f64 * image.grid.cell_rad).abs() > half.max(0.5 * image.grid.cell_rad);
        if apart(grid.n_l, image.grid.n_l) || apart(grid.n_m, image.grid.n_m) {
            return Err(ChainError::Incompatible(format!("{name:?} does not show the same field as the first image")));
        }
        if image.unit != first.unit {
            let (a, b) = (first.unit.bunit(), image.unit.bunit());
            return Err(ChainError::Incompatible(format!("{name:?} is in {b:?} and the first image in {a:?}: they cannot share colours")));
        }
    }
    let (unit, name) = angle_unit(grid.cell_rad * (rows.len().max(columns.len()) / 2) as f64);
    let (x_name, y_name) = match grid.frame {
        SkyFrame::Sky { .. } => ("Offset east", "Offset north"),
        SkyFrame::Boresight => ("l", "m"),
    };
    let mut note = String::new();
    let maps: Vec<Map<'_>> = all
        .iter()
        .map(|(image, title)| {
            let whole = image.data.dim();
            if options.chan >= whole.0 || options.pol >= whole.1 {
                return Err(ChainError::Incompatible(format!(
                    "{title:?} has no plane of channel {} and polarisation {}",
                    options.chan, options.pol
                )));
            }
            let plane = image.plane(options.chan, options.pol);
            let (r, c) = view.cells(&image.grid);
            let shown = plane.slice_move(s![r, c]);
            let levels = if view.contours { levels(shown, robust_rms(plane)) } else { Vec::new() };
            // One beam serves all channels, several serve one channel each.
            let beam = if image.beams.len() == 1 { image.beams.first() } else { image.beams.get(options.chan) };
            let beam = beam.map(|b| Ellipse { major: b.bmaj_rad / unit, minor: b.bmin_rad / unit, pa_rad: b.bpa_rad });
            Ok(Map { plane: shown, title: (*title).to_owned(), beam, levels })
        })
        .collect::<Result<_>>()?;
    if let ([map], [(image, _)]) = (maps.as_slice(), all)
        && !map.levels.is_empty()
    {
        let noise = robust_rms(image.plane(options.chan, options.pol));
        let multiples: Vec<String> = map.levels.iter().map(|v| format!("{:.0}", v / noise).replace('-', "\u{2212}")).collect();
        let shown = if multiples.len() > 5 { format!("{} ...", multiples[..5].join(", ")) } else { multiples.join(", ") };
        note += &format!("Contours at {shown} times the noise of {} (robust rms). ", brightness(noise, first.unit));
    }
    note += &view.told;
    if rows.len() < grid.n_m || columns.len() < grid.n_l {
        note += &format!(" Shown: {} x {} of {} x {} pixels.", columns.len(), rows.len(), grid.n_l, grid.n_m);
    }
    let scale = view.scale();
    let (factor, bar_label) = match view.in_noise {
        Some(noise) => (noise, format!("Multiples of the noise of {}", brightness(noise, first.unit))),
        None => value_unit(first.unit, scale.low.abs().max(scale.high.abs())),
    };
    let edge = |k: usize| k as f64 - 0.5;
    Heat {
        x: Axis::linear(grid.l_at(edge(columns.start)) / unit, grid.l_at(edge(columns.end)) / unit, format!("{x_name} ({name})")),
        y: Axis::linear(grid.m_at(edge(rows.start)) / unit, grid.m_at(edge(rows.end)) / unit, format!("{y_name} ({name})")),
        maps,
        scale,
        unit: factor,
        bar_label,
        sheet: Sheet::new(&options.title, options.width, options.height).with_note(note.trim()),
        extremes: view.points,
    }
    .draw()
}

#[cfg(test)]
mod tests {
    use super::super::view::Range;
    use super::*;
    use cittert_arrays::{BrightnessUnit, Polarization, RestoringBeam, SkyGrid, SpectralWindow};
    use ndarray::Array4;

    fn plane(frame: SkyFrame) -> Image {
        let grid = SkyGrid::new(64, 48, 1e-5, frame).unwrap();
        let data = Array4::from_shape_fn((1, 1, 48, 64), |(_, _, r, c)| if r > 40 && c < 8 { 1.0 } else { 0.0 });
        let spectrum = SpectralWindow::band(1e9, 1e6, 1).unwrap();
        let mut image = Image::new(grid, spectrum, vec![Polarization::I], data, BrightnessUnit::JyPerBeam).unwrap();
        image.beams.push(RestoringBeam { bmaj_rad: 5e-5, bmin_rad: 3e-5, bpa_rad: 0.5 });
        image
    }

    fn decode(png: &[u8]) -> ::image::RgbImage {
        ::image::load_from_memory(png).unwrap().to_rgb8()
    }

    #[test]
    fn the_first_column_and_last_row_are_at_the_upper_left() {
        let options = ImagePlot { title: "t".into(), width: 450, height: 400, ..ImagePlot::default() };
        let picture = decode(&image(&plane(SkyFrame::Boresight), &options).unwrap().png().unwrap());
        let (width, height) = picture.dimensions();
        assert!(width == 450 && height < 400, "a wide image leaves no empty margin: {height}");
        // The bright block lies in the upper left of the panel: look for the brightest colours left of the colour bar.
        let bright: Vec<(u32, u32)> = picture
            .enumerate_pixels()
            .filter(|(x, _, p)| *x < 300 && p.0[0] > 240 && p.0[1] > 240 && p.0[2] < 200 && p.0[2] > 120)
            .map(|(x, y, _)| (x, y))
            .collect();
        assert!(bright.len() > 500, "{}", bright.len());
        assert!(bright.iter().all(|(x, y)| *x < 150 && *y < height / 2));
    }

    #[test]
    fn odd_images_are_drawn_or_refused() {
        let mut im = plane(SkyFrame::Sky { ra_rad: 0.0, dec_rad: 0.0, frame: "icrs".into() });
        let small = ImagePlot { width: 300, height: 280, ..ImagePlot::default() };
        im.data.fill(3.0);
        image(&im, &small).unwrap();
        image(&im, &ImagePlot { wish: Wish { range: Range::Symmetric, ..Wish::default() }, ..small.clone() }).unwrap();
        assert!(image(&im, &ImagePlot { chan: 1, ..small.clone() }).is_err());
        assert!(image(&im, &ImagePlot { width: 10, ..small.clone() }).is_err());
        assert!(image(&im, &ImagePlot { wish: Wish { range: Range::Fixed(2.0, 1.0), ..Wish::default() }, ..small.clone() }).is_err());
        im.data.fill(f64::NAN);
        assert!(image(&im, &small).err().unwrap().to_string().contains("no finite value"));
    }

    #[test]
    fn images_side_by_side_share_their_field_and_unit() {
        let one = plane(SkyFrame::Boresight);
        let wide = ImagePlot { width: 900, height: 300, ..ImagePlot::default() };
        let picture = decode(&images(&[(&one, "one"), (&one, "two")], &wide).unwrap().png().unwrap());
        let bright = |from: u32, to: u32| {
            picture.enumerate_pixels().filter(|(x, _, p)| (from..to).contains(x) && p.0[0] > 240 && p.0[2] < 200).count()
        };
        assert!(bright(60, 260) > 100 && bright(380, 600) > 100, "{} {}", bright(60, 260), bright(380, 600));
        let kelvin = Image { unit: BrightnessUnit::Kelvin, ..one.clone() };
        let refused = |other: &Image| images(&[(&one, "one"), (other, "two")], &wide).err().unwrap().to_string();
        assert!(refused(&kelvin).contains("cannot share colours"));
        let small = Image { grid: SkyGrid::new(64, 48, 2e-5, SkyFrame::Boresight).unwrap(), ..one.clone() };
        assert!(refused(&small).contains("same field"));
    }
}
