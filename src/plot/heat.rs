//! A plane of an image as colours.

use super::axes::{Axis, BOTTOM_ROOM, Panel, angle_unit, prefix, superscript, title, whole_prefix};
use super::canvas::{Canvas, INK, Rect, WHITE};
use super::colors::{BAR_ROOM, BLANK, ColorScale, bar_area};
use super::{DEFAULT_HEIGHT, DEFAULT_WIDTH};
use crate::simulate::UvMask;
use crate::{ChainError, Result};
use cittert_arrays::{BrightnessUnit, Image, RestoringBeam, SkyFrame};
use ndarray::ArrayView2;

/// Which values the colours span.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Range {
    /// From the smallest to the largest value.
    #[default]
    Full,
    /// From the (100 - p)th to the pth percentile, for images with a few extreme pixels.
    Percentile(f64),
    /// As given, in the unit of the image.
    Fixed(f64, f64),
    /// The same distance above and below zero, in two colours; the distance is the pth percentile of |value|.
    Symmetric(f64),
}

/// How values become colours.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Stretch {
    /// In proportion.
    #[default]
    Linear,
    /// asinh, linear for the lowest tenth of the range and logarithmic above: shows faint emission beside bright.
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

/// What a picture of cells needs to know.
struct Heat<'a> {
    plane: ArrayView2<'a, f64>,
    x: Axis,
    y: Axis,
    scale: ColorScale,
    /// Divide the values of the colour bar by this, and its label.
    unit: f64,
    bar_label: String,
    title: &'a str,
    size: (usize, usize),
    /// Ellipse in units of the axes: major, minor, position angle.
    beam: Option<(f64, f64, f64)>,
}

/// Draw one plane of an image: axes in the angle that reads best, l to the left on the sky and to the right around a boresight,
/// cells square, the beam in the lower left corner.
///
/// # Errors
/// A channel or polarisation that is not there, an image without a finite value, a picture below 100 or above 8000 pixels.
pub fn image(image: &Image, options: &ImagePlot) -> Result<Vec<u8>> {
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
    let beam = image.beams.get(options.chan).or(image.beams.first());
    Heat {
        plane,
        x: Axis::linear(grid.l_at(-0.5) / unit, grid.l_at(grid.n_l as f64 - 0.5) / unit, format!("{x_name} ({name})")),
        y: Axis::linear(grid.m_at(-0.5) / unit, grid.m_at(grid.n_m as f64 - 0.5) / unit, format!("{y_name} ({name})")),
        scale,
        unit: factor,
        bar_label,
        title: &options.title,
        size: (options.width, options.height),
        beam: beam.map(|b: &RestoringBeam| (b.bmaj_rad / unit, b.bmin_rad / unit, b.bpa_rad)),
    }
    .draw()
}

/// Draw a residual: as [`image()`], in two colours around zero that span the 99.9th percentile of the absolute values.
///
/// # Errors
/// As [`image()`].
pub fn residual(residual: &Image, options: &ImagePlot) -> Result<Vec<u8>> {
    image(residual, &ImagePlot { range: Range::Symmetric(99.9), ..options.clone() })
}

/// Draw the hits of each cell of the Fourier grid, cut to the cells that can be hit; cells without a hit are white.
///
/// # Errors
/// A mask without hits, a picture below 100 or above 8000 pixels.
pub fn uv_mask(mask: &UvMask, title: &str, width: usize, height: usize) -> Result<Vec<u8>> {
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
        title,
        size: (width, height),
        beam: None,
    }
    .draw()
}

impl Heat<'_> {
    fn draw(self) -> Result<Vec<u8>> {
        let (w, h) = (self.size.0 as f64, self.size.1 as f64);
        let top = if self.title.is_empty() { 18.0 } else { 44.0 };
        let left = Panel::left_room(&self.y, &Canvas::new(self.size.0, self.size.1)?, h - top - BOTTOM_ROOM);
        // The largest panel with square cells; what it leaves free is cut off.
        let room = (w - left - BAR_ROOM, h - top - BOTTOM_ROOM);
        let (span_x, span_y) = ((self.x.to - self.x.from).abs(), (self.y.to - self.y.from).abs());
        let k = (room.0 / span_x).min(room.1 / span_y);
        let (pw, ph) = ((k * span_x).round().max(2.0), (k * span_y).round().max(2.0));
        let height = (top + ph + BOTTOM_ROOM).min(h).max(260.0_f64.min(h));
        let (x0, y0) = ((left + (room.0 - pw) / 2.0).round(), (top + (height - top - BOTTOM_ROOM - ph) / 2.0).round());
        let area = Rect { x0, y0, x1: x0 + pw, y1: y0 + ph };
        let mut canvas = Canvas::new(self.size.0, height as usize)?;
        self.cells(&mut canvas, area);
        let panel = Panel { area, x: self.x.clone(), y: self.y.clone(), label_room: None };
        if let Some(beam) = self.beam {
            draw_beam(&mut canvas, area, k, beam, self.x.to > self.x.from)?;
        }
        panel.axes(&mut canvas, true)?;
        self.scale.bar(&mut canvas, bar_area(area), self.unit, &self.bar_label)?;
        if !self.title.is_empty() {
            title(&mut canvas, area, self.title, w - 20.0)?;
        }
        canvas.png()
    }

    /// Colours of the cells; where a pixel covers several cells it shows their mean, leaving out cells without a value.
    fn cells(&self, canvas: &mut Canvas, area: Rect) {
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
        });
    }
}

/// The beam as a filled ellipse in a box in the lower left corner; `k` pixels are one unit of the axes.
fn draw_beam(canvas: &mut Canvas, area: Rect, k: f64, (major, minor, pa): (f64, f64, f64), l_to_right: bool) -> Result<()> {
    // A beam as wide as half the picture would hide what it belongs to.
    if !(major * k > 0.0 && major * k < 0.5 * area.width().min(area.height())) {
        return Ok(());
    }
    let (a, b) = ((0.5 * major * k).max(1.5), (0.5 * minor * k).max(1.0));
    let side = (2.0 * a + 12.0).max(20.0);
    let frame = Rect { x0: area.x0 + 10.0, y0: area.y1 - 10.0 - side, x1: area.x0 + 10.0 + side, y1: area.y1 - 10.0 };
    canvas.fill(frame, WHITE);
    canvas.frame(frame, INK, 1.0);
    let (cx, cy) = (f64::midpoint(frame.x0, frame.x1), f64::midpoint(frame.y0, frame.y1));
    let (sin, cos) = pa.sin_cos();
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
    let check = |p: f64| {
        if (50.0..=100.0).contains(&p) {
            Ok(p / 100.0)
        } else {
            Err(ChainError::BadOption { option: "percentile", value: p.to_string(), expected: "50 to 100".into() })
        }
    };
    let (low, high) = match range {
        Range::Full => values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v))),
        Range::Percentile(p) => {
            let p = check(p)?;
            (quantile(&mut values, 1.0 - p), quantile(&mut values, p))
        }
        Range::Fixed(a, b) if a.is_finite() && b.is_finite() && a < b => (a, b),
        Range::Fixed(a, b) => {
            return Err(ChainError::BadOption {
                option: "range of values",
                value: format!("{a} to {b}"),
                expected: "two finite numbers, the smaller first".into(),
            });
        }
        Range::Symmetric(p) => {
            let p = check(p)?;
            values.iter_mut().for_each(|v| *v = v.abs());
            let x = quantile(&mut values, p);
            (-x, x)
        }
    };
    // A flat image still needs a range to be drawn in.
    let (low, high) = if high > low { (low, high) } else { (low - 0.5 * low.abs().max(1.0), low + 0.5 * low.abs().max(1.0)) };
    let soften = if stretch == Stretch::Asinh && !matches!(range, Range::Symmetric(_)) { 0.1 } else { 0.0 };
    let two_sided = matches!(range, Range::Symmetric(_));
    Ok(ColorScale {
        gradient: if two_sided { colorous::RED_BLUE } else { colorous::INFERNO },
        reversed: two_sided,
        low,
        high,
        soften,
        blank: BLANK,
    })
}

fn quantile(values: &mut [f64], p: f64) -> f64 {
    let k = ((values.len() - 1) as f64 * p).round() as usize;
    *values.select_nth_unstable_by(k, f64::total_cmp).1
}

/// Divisor and label of the colour bar.
fn value_unit(unit: BrightnessUnit, largest: f64) -> (f64, String) {
    let (factor, letter) = prefix(largest);
    let prefixed = |base: &str| if factor > 1.0 && base == "K" { (1.0, base.to_owned()) } else { (factor, format!("{letter}{base}")) };
    match unit {
        BrightnessUnit::Kelvin => {
            let (f, name) = prefixed("K");
            (f, format!("Brightness temperature ({name})"))
        }
        BrightnessUnit::JyPerPixel | BrightnessUnit::JyPerBeam => {
            let (f, name) = prefixed(unit.bunit());
            (f, format!("Brightness ({name})"))
        }
        BrightnessUnit::Metre => {
            let (f, name) = prefixed("m");
            (f, format!("Range ({name})"))
        }
        BrightnessUnit::One | BrightnessUnit::Other if (1e-3..1e4).contains(&largest) => (1.0, "Value".into()),
        BrightnessUnit::One | BrightnessUnit::Other => {
            let exponent = if largest > 0.0 { largest.log10().floor() as i32 } else { 0 };
            (10_f64.powi(exponent), format!("Value (10{})", superscript(exponent)))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::{Polarization, SkyGrid, SpectralWindow};
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
        let picture = decode(&image(&plane(SkyFrame::Boresight), &options).unwrap());
        assert_eq!(picture.dimensions(), (450, 400));
        // The bright block lies in the upper left of the panel: look for the brightest colours left of the colour bar.
        let bright: Vec<(u32, u32)> = picture
            .enumerate_pixels()
            .filter(|(x, _, p)| *x < 300 && p.0[0] > 240 && p.0[1] > 240 && p.0[2] < 200 && p.0[2] > 120)
            .map(|(x, y, _)| (x, y))
            .collect();
        assert!(bright.len() > 500, "{}", bright.len());
        assert!(bright.iter().all(|(x, y)| *x < 150 && *y < 200));
    }

    #[test]
    fn odd_images_are_drawn_or_refused() {
        let mut im = plane(SkyFrame::Sky { ra_rad: 0.0, dec_rad: 0.0, frame: "icrs".into() });
        let small = ImagePlot { width: 300, height: 280, ..ImagePlot::default() };
        im.data.fill(3.0);
        image(&im, &small).unwrap();
        residual(&im, &small).unwrap();
        assert!(image(&im, &ImagePlot { chan: 1, ..small.clone() }).is_err());
        assert!(image(&im, &ImagePlot { width: 10, ..small.clone() }).is_err());
        assert!(image(&im, &ImagePlot { range: Range::Fixed(2.0, 1.0), ..small.clone() }).is_err());
        assert!(image(&im, &ImagePlot { range: Range::Percentile(3.0), ..small.clone() }).is_err());
        im.data.fill(f64::NAN);
        assert!(image(&im, &small).unwrap_err().to_string().contains("no finite value"));
    }
}
