//! A plane of an image as colours.

use super::axes::{Axis, angle_unit, prefix, superscript, whole_prefix};
use super::canvas::{Canvas, INK, Rect, WHITE};
use super::colors::{BAR_ROOM, BLANK, ColorScale, bar_area};
use super::panel::{BOTTOM_ROOM, Panel, Sheet};
use super::picture::Picture;
use super::size::{DEFAULT_HEIGHT, DEFAULT_WIDTH};
use crate::simulate::UvMask;
use crate::{ChainError, Result};
use cittert_arrays::{BrightnessUnit, Image, SkyFrame};
use ndarray::ArrayView2;

/// Which values the colours span.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Range {
    /// From the smallest to the largest value.
    #[default]
    Full,
    /// From the first to the second value, in the unit of the image.
    Fixed(f64, f64),
    /// The same distance below and above zero, in two colours, as for residuals. The distance is the 99.9th percentile of the absolute values.
    Symmetric,
}

/// How values become colours.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Stretch {
    /// In proportion.
    #[default]
    Linear,
    /// By asinh: linear for the lowest tenth of the range and logarithmic above, to show faint emission beside bright emission.
    Asinh,
}

/// How to draw an image.
#[derive(Debug, Clone, PartialEq)]
pub struct ImagePlot {
    /// Channel of the image.
    pub chan: usize,
    /// Polarisation of the image.
    pub pol: usize,
    /// Title; empty for none.
    pub title: String,
    /// Which values the colours span.
    pub range: Range,
    /// How values become colours.
    pub stretch: Stretch,
    /// Width of the picture, pixels.
    pub width: usize,
    /// Height of the picture, pixels; less where the image is wide, as its cells are square.
    pub height: usize,
}

impl Default for ImagePlot {
    fn default() -> Self {
        Self {
            chan: 0,
            pol: 0,
            title: String::new(),
            range: Range::Full,
            stretch: Stretch::Linear,
            width: DEFAULT_WIDTH,
            height: DEFAULT_HEIGHT,
        }
    }
}

/// A picture of coloured cells.
struct Heat<'a> {
    plane: ArrayView2<'a, f64>,
    x: Axis,
    y: Axis,
    scale: ColorScale,
    /// Divisor of the values beside the colour bar.
    unit: f64,
    bar_label: String,
    sheet: Sheet<'a>,
    beam: Option<Ellipse>,
}

/// The beam as drawn: full widths in units of the axes, position angle in rad.
#[derive(Clone, Copy)]
struct Ellipse {
    major: f64,
    minor: f64,
    pa_rad: f64,
}

/// Draw one plane of an image, with square cells and the beam in the lower left corner. On the sky l grows to the left, around a boresight
/// to the right.
///
/// # Errors
/// A channel or polarisation that the image does not have, an image without a finite value, a picture below 100 or above 8000 pixels.
pub fn image(image: &Image, options: &ImagePlot) -> Result<Picture> {
    let (n_chan, n_pol, ..) = image.data.dim();
    for (what, index, len) in [("channel", options.chan, n_chan), ("polarisation", options.pol, n_pol)] {
        if index >= len {
            return Err(cittert_arrays::ArrayError::OutOfRange { what, index, len }.into());
        }
    }
    let grid = &image.grid;
    let plane = image.plane(options.chan, options.pol);
    let scale = scale_of(plane, options.range, options.stretch)?;
    let (factor, bar_label) = value_unit(image.unit, scale.low.abs().max(scale.high.abs()));
    let (unit, name) = angle_unit(grid.cell_rad * (grid.n_l.max(grid.n_m) / 2) as f64);
    let (x_name, y_name) = match grid.frame {
        SkyFrame::Sky { .. } => ("Offset east", "Offset north"),
        SkyFrame::Boresight => ("l", "m"),
    };
    // One beam serves all channels, several serve one channel each.
    let beam = if image.beams.len() == 1 { image.beams.first() } else { image.beams.get(options.chan) };
    Heat {
        plane,
        x: Axis::linear(grid.l_at(-0.5) / unit, grid.l_at(grid.n_l as f64 - 0.5) / unit, format!("{x_name} ({name})")),
        y: Axis::linear(grid.m_at(-0.5) / unit, grid.m_at(grid.n_m as f64 - 0.5) / unit, format!("{y_name} ({name})")),
        scale,
        unit: factor,
        bar_label,
        sheet: Sheet::new(&options.title, options.width, options.height),
        beam: beam.map(|b| Ellipse { major: b.bmaj_rad / unit, minor: b.bmin_rad / unit, pa_rad: b.bpa_rad }),
    }
    .draw()
}

/// Draw the number of visibilities in each cell of the Fourier grid, out to the longest baseline. Cells without a visibility are white.
///
/// # Errors
/// A mask without a visibility, a picture below 100 or above 8000 pixels.
pub fn uv_mask(mask: &UvMask, title: &str, width: usize, height: usize) -> Result<Picture> {
    let (n_v, n_u) = mask.counts.dim();
    let reach = |longest: f64, cell: f64, n: usize| ((1.04 * longest / cell).ceil() as usize + 1).min(n / 2);
    let (half_u, half_v) = (reach(mask.longest_wavelengths, mask.cell_u, n_u), reach(mask.longest_wavelengths, mask.cell_v, n_v));
    let (u0, v0) = (n_u / 2 - half_u, n_v / 2 - half_v);
    let (u1, v1) = ((n_u / 2 + half_u + 1).min(n_u), (n_v / 2 + half_v + 1).min(n_v));
    let shown = mask.counts.slice(ndarray::s![v0..v1, u0..u1]).mapv(|c| if c == 0 { f64::NAN } else { f64::from(c) });
    let high = shown.iter().copied().filter(|v| v.is_finite()).fold(0.0, f64::max);
    if high == 0.0 {
        return Err(ChainError::NoData("no cell of the mask is hit".into()));
    }
    let (unit, name) = whole_prefix(mask.longest_wavelengths);
    let edge = |k: usize, n: usize, cell: f64| (k as f64 - 0.5 - (n / 2) as f64) * cell / unit;
    Heat {
        plane: shown.view(),
        x: Axis::linear(edge(u0, n_u, mask.cell_u), edge(u1, n_u, mask.cell_u), format!("u ({name}\u{3bb})")),
        y: Axis::linear(edge(v0, n_v, mask.cell_v), edge(v1, n_v, mask.cell_v), format!("v ({name}\u{3bb})")),
        scale: ColorScale {
            gradient: colorous::VIRIDIS,
            reversed: true,
            low: 1.0,
            high: high.max(2.0),
            soften: if high > 20.0 { 0.05 } else { 0.0 },
            blank: WHITE,
        },
        unit: 1.0,
        bar_label: "Visibilities in a cell".into(),
        sheet: Sheet::new(title, width, height),
        beam: None,
    }
    .draw()
}

impl Heat<'_> {
    fn draw(self) -> Result<Picture> {
        let Sheet { width: w, height: h, .. } = self.sheet;
        let top = self.sheet.top();
        let left = Panel::left_room(&self.y, &Canvas::new(w as usize, h as usize)?, h - top - BOTTOM_ROOM);
        // The largest panel with square cells. The picture is cut to the height of the panel.
        let (room_x, room_y) = (w - left - BAR_ROOM, h - top - BOTTOM_ROOM);
        let (span_x, span_y) = ((self.x.to - self.x.from).abs(), (self.y.to - self.y.from).abs());
        let k = (room_x / span_x).min(room_y / span_y);
        let (pw, ph) = ((k * span_x).round().max(2.0), (k * span_y).round().max(2.0));
        let height = (top + ph + BOTTOM_ROOM).min(h).max(260.0_f64.min(h));
        let (x0, y0) = ((left + (room_x - pw) / 2.0).round(), (top + (height - top - BOTTOM_ROOM - ph) / 2.0).round());
        let area = Rect { x0, y0, x1: x0 + pw, y1: y0 + ph };
        let mut canvas = Canvas::new(w as usize, height as usize)?;
        self.cells(&mut canvas, area)?;
        if let Some(beam) = self.beam {
            draw_beam(&mut canvas, area, k, beam, self.x.to > self.x.from)?;
        }
        Panel { area, x: self.x, y: self.y, label_room: None }.axes(&mut canvas, true)?;
        self.scale.bar(&mut canvas, bar_area(area), self.unit, &self.bar_label)?;
        self.sheet.finish(canvas, area)
    }

    /// Colour the cells. A pixel that covers several cells shows their mean, without the cells that have no value.
    fn cells(&self, canvas: &mut Canvas, area: Rect) -> Result<()> {
        let (rows, columns) = self.plane.dim();
        let (half_x, half_y) = (0.25 / area.width(), 0.25 / area.height()); // half a drawn pixel
        let span = |center: f64, half: f64, n: usize| {
            let first = (((center - half) * n as f64).floor().max(0.0) as usize).min(n - 1);
            let last = (((center + half) * n as f64).ceil() as usize).clamp(first + 1, n);
            if (2.0 * half) * n as f64 <= 1.0 {
                let only = ((center * n as f64) as usize).min(n - 1);
                only..only + 1
            } else {
                first..last
            }
        };
        canvas.shade(area, |x, y| {
            let (cs, rs) = (span(x, half_x, columns), span(1.0 - y, half_y, rows));
            let (mut sum, mut n) = (0.0, 0_u32);
            for r in rs {
                for c in cs.clone() {
                    let v = self.plane[[r, c]];
                    if v.is_finite() {
                        sum += v;
                        n += 1;
                    }
                }
            }
            match n {
                0 => self.scale.color(f64::NAN),
                n => self.scale.color(sum / f64::from(n)),
            }
        })
    }
}

/// Draw the beam as a filled ellipse in a box in the lower left corner; `k` pixels are one unit of the axes.
fn draw_beam(canvas: &mut Canvas, area: Rect, k: f64, Ellipse { major, minor, pa_rad }: Ellipse, l_to_right: bool) -> Result<()> {
    // A beam as wide as half the picture would hide the image.
    if !(major * k > 0.0 && major * k < 0.5 * area.width().min(area.height())) {
        return Ok(());
    }
    let (a, b) = ((0.5 * major * k).max(1.5), (0.5 * minor * k).max(1.0));
    let side = (2.0 * a + 12.0).max(20.0);
    let frame = Rect { x0: area.x0 + 10.0, y0: area.y1 - 10.0 - side, x1: area.x0 + 10.0 + side, y1: area.y1 - 10.0 };
    canvas.fill(frame, WHITE);
    canvas.frame(frame, INK, 1.0);
    let (cx, cy) = (f64::midpoint(frame.x0, frame.x1), f64::midpoint(frame.y0, frame.y1));
    let (sin, cos) = pa_rad.sin_cos();
    let east = if l_to_right { 1.0 } else { -1.0 };
    let outline: Vec<(f64, f64)> = (0..72)
        .map(|i| {
            let (s, c) = (f64::from(i) * std::f64::consts::TAU / 72.0).sin_cos();
            let (l, m) = (a * c * sin + b * s * cos, a * c * cos - b * s * sin);
            (cx + east * l, cy - m)
        })
        .collect();
    canvas.polygon(&outline, [90, 96, 110], 1.0)
}

/// Range and colours of a plane.
fn scale_of(plane: ArrayView2<'_, f64>, range: Range, stretch: Stretch) -> Result<ColorScale> {
    let mut values: Vec<f64> = plane.iter().copied().filter(|v| v.is_finite()).collect();
    if values.is_empty() {
        return Err(ChainError::NoData("the image holds no finite value to draw".into()));
    }
    let (low, high) = match range {
        Range::Full => values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v))),
        Range::Fixed(a, b) if a.is_finite() && b.is_finite() && a < b => (a, b),
        Range::Fixed(a, b) => {
            return Err(ChainError::BadOption {
                option: "range of values",
                value: format!("{a} to {b}"),
                expected: "two finite numbers, the smaller first".into(),
            });
        }
        Range::Symmetric => {
            values.iter_mut().for_each(|v| *v = v.abs());
            let k = ((values.len() - 1) as f64 * 0.999).round() as usize;
            let x = *values.select_nth_unstable_by(k, f64::total_cmp).1;
            (-x, x)
        }
    };
    // If all pixels have the same value, the colours need a range around it.
    let margin = if high > low { 0.0 } else { 0.5 * low.abs().max(1.0) };
    let two_sided = range == Range::Symmetric;
    Ok(ColorScale {
        gradient: if two_sided { colorous::RED_BLUE } else { colorous::INFERNO },
        reversed: two_sided,
        low: low - margin,
        high: high + margin,
        soften: if stretch == Stretch::Asinh && !two_sided { 0.1 } else { 0.0 },
        blank: BLANK,
    })
}

/// Divisor and label of the colour bar.
fn value_unit(unit: BrightnessUnit, largest: f64) -> (f64, String) {
    let (label, base) = match unit {
        BrightnessUnit::Kelvin => ("Brightness temperature", "K"),
        BrightnessUnit::JyPerPixel | BrightnessUnit::JyPerBeam => ("Brightness", unit.bunit()),
        BrightnessUnit::Metre => ("Range", "m"),
        BrightnessUnit::One | BrightnessUnit::Other if (1e-3..1e4).contains(&largest) => return (1.0, "Value".into()),
        BrightnessUnit::One | BrightnessUnit::Other => {
            let exponent = if largest > 0.0 { largest.log10().floor() as i32 } else { 0 };
            return (10_f64.powi(exponent), format!("Value (10{})", superscript(exponent)));
        }
    };
    // Temperatures above 1000 K are not shown in kK.
    let (factor, letter) = match prefix(largest) {
        (factor, _) if factor > 1.0 && base == "K" => (1.0, ""),
        prefixed => prefixed,
    };
    (factor, format!("{label} ({letter}{base})"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::{Polarization, RestoringBeam, SkyGrid, SpectralWindow};
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
        image(&im, &ImagePlot { range: Range::Symmetric, ..small.clone() }).unwrap();
        assert!(image(&im, &ImagePlot { chan: 1, ..small.clone() }).is_err());
        assert!(image(&im, &ImagePlot { width: 10, ..small.clone() }).is_err());
        assert!(image(&im, &ImagePlot { range: Range::Fixed(2.0, 1.0), ..small.clone() }).is_err());
        im.data.fill(f64::NAN);
        assert!(image(&im, &small).err().unwrap().to_string().contains("no finite value"));
    }
}
