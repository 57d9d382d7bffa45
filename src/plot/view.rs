//! What a picture of an image shows: the range and the stretch of its colours, its part of the frame, and its contours. Where the caller
//! leaves the choice open, it is made from the image.
//!
//! | image | colours | contours | part |
//! |---|---|---|---|
//! | Jy/beam or Jy/pixel, mostly empty | asinh around 0, linear up to three times the noise | -3, 3, 6, 12 ... times the noise | the emission with a margin |
//! | Jy/beam or Jy/pixel, extended | linear, all values | none | all |
//! | kelvin | linear, from the 0.5th to the 99.5th percentile | none | all |
//! | other | linear, all values | none | all |

use super::colors::{BLANK, ColorScale, Curve};
use super::units::brightness;
use crate::fidelity::robust_rms;
use crate::{ChainError, Result};
use cittert_arrays::{BrightnessUnit, Image, SkyGrid};
use ndarray::ArrayView2;
use std::ops::Range as Cells;

/// Which values the colours span.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Range {
    /// Chosen from the image.
    #[default]
    Auto,
    /// From the smallest to the largest value.
    Full,
    /// From the first to the second value, in the unit of the image.
    Fixed(f64, f64),
    /// The same distance below and above zero, in two colours. The distance is the 99.9th percentile of the absolute values.
    Symmetric,
    /// So many times the robust noise below and above zero, in two colours, as for residuals.
    Noise(f64),
}

/// How values become colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Stretch {
    /// Chosen from the image.
    #[default]
    Auto,
    /// In proportion.
    Linear,
    /// By asinh: linear for faint values and logarithmic above, to show faint emission beside bright emission.
    Asinh,
}

/// What the caller asks for.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Wish {
    /// Which values the colours span.
    pub range: Range,
    /// How values become colours.
    pub stretch: Stretch,
    /// Show the whole frame, also where the emission fills a small part of it.
    pub full: bool,
}

/// A part of the sky, as direction cosines: l and m of two opposite corners.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Part {
    l: (f64, f64),
    m: (f64, f64),
}

/// What a picture shows. It can be used for several images in the same unit.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    low: f64,
    high: f64,
    curve: Curve,
    two_sided: bool,
    part: Option<Part>,
    /// Contours at multiples of the noise.
    pub(super) contours: bool,
    /// The image is mostly empty: a pixel of the picture shows the extreme of its cells, so that no point is lost.
    pub(super) points: bool,
    /// The noise of which the values are multiples, where they are.
    pub(super) in_noise: Option<f64>,
    /// Unit of the image.
    pub(super) unit: BrightnessUnit,
    /// How the colours were chosen, as a sentence.
    pub(super) told: String,
}

/// Largest fraction of bright pixels of an image that is mostly empty.
const MOSTLY_EMPTY: f64 = 0.03;
/// A pixel is bright above this multiple of the noise, and above this fraction of the peak.
const BRIGHT: (f64, f64) = (5.0, 0.02);
/// Pixels above this multiple of the noise, and above this fraction of the peak, are not cut off.
const KEPT: (f64, f64) = (6.0, 0.003);
/// Colours are in proportion up to this multiple of the noise.
const LINEAR_SIGMAS: f64 = 3.0;
/// Colours are in proportion at least up to this fraction of the peak.
const LINEAR_OF_PEAK: f64 = 1.0 / 20_000.0;
/// The same in an image without noise, such as a list of components.
const LINEAR_WITHOUT_NOISE: f64 = 1.0 / 100.0;
/// The frame is cut where the emission with its margin needs less than this fraction of it.
const WORTH_A_CUT: f64 = 0.6;
/// Percentiles of the colours of an image in kelvin.
const PERCENTILES: (f64, f64) = (0.5, 99.5);

/// Share of the range of an image in kelvin that is added at both ends.
const HEADROOM: f64 = 0.05;

/// Numbers of a plane on which the choice rests.
struct Content {
    values: Vec<f64>,
    min: f64,
    max: f64,
    noise: f64,
}

impl Content {
    fn of(plane: ArrayView2<'_, f64>) -> Result<Self> {
        let values: Vec<f64> = plane.iter().copied().filter(|v| v.is_finite()).collect();
        if values.is_empty() {
            return Err(ChainError::NoData("the image holds no finite value to draw".into()));
        }
        let (min, max) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
        Ok(Self { values, min, max, noise: robust_rms(plane) })
    }

    fn peak(&self) -> f64 {
        self.max.abs().max(self.min.abs())
    }

    fn is_mostly_empty(&self) -> bool {
        let faint = (BRIGHT.0 * self.noise).max(BRIGHT.1 * self.peak());
        let bright = self.values.iter().filter(|v| v.abs() > faint).count();
        bright > 0 && (bright as f64) < MOSTLY_EMPTY * self.values.len() as f64
    }

    fn percentile(&mut self, percent: f64) -> f64 {
        let k = ((self.values.len() - 1) as f64 * percent / 100.0).round() as usize;
        *self.values.select_nth_unstable_by(k, f64::total_cmp).1
    }

    /// asinh around zero, for an image that is mostly empty.
    fn around_zero(&self) -> Curve {
        let least = if self.noise > 0.0 { LINEAR_OF_PEAK } else { LINEAR_WITHOUT_NOISE };
        Curve::Asinh { origin: 0.0, linear: (LINEAR_SIGMAS * self.noise).max(least * self.peak()).max(f64::MIN_POSITIVE) }
    }
}

impl View {
    /// Choose the view of one plane of an image.
    ///
    /// # Errors
    /// A plane that the image does not have or without a finite value, or a range that is none.
    pub fn new(image: &Image, chan: usize, pol: usize, wish: &Wish) -> Result<Self> {
        let (n_chan, n_pol, ..) = image.data.dim();
        for (what, index, len) in [("channel", chan, n_chan), ("polarisation", pol, n_pol)] {
            if index >= len {
                return Err(cittert_arrays::ArrayError::OutOfRange { what, index, len }.into());
            }
        }
        let plane = image.plane(chan, pol);
        let mut content = Content::of(plane)?;
        let unit = image.unit;
        let jansky = matches!(unit, BrightnessUnit::JyPerBeam | BrightnessUnit::JyPerPixel);
        let points = jansky && content.is_mostly_empty();
        let mut view = Self {
            low: content.min,
            high: content.max,
            curve: Curve::Linear,
            two_sided: false,
            part: None,
            contours: false,
            points,
            in_noise: None,
            unit,
            told: String::new(),
        };
        view.choose_range(wish, &mut content)?;
        view.choose_stretch(wish, &content);
        if points && wish.range == Range::Auto {
            view.contours = content.noise > 0.0 && content.max > 6.0 * content.noise;
        }
        if points && !wish.full && !view.two_sided {
            view.part = emission(image, plane, &content, chan);
        }
        Ok(view)
    }

    fn choose_range(&mut self, wish: &Wish, content: &mut Content) -> Result<()> {
        match wish.range {
            Range::Full => {}
            Range::Auto if self.points => self.low = content.min.max(-6.0 * content.noise).min(0.0),
            Range::Auto if self.unit == BrightnessUnit::Kelvin => {
                let (low, high) = (content.percentile(PERCENTILES.0), content.percentile(PERCENTILES.1));
                // A few points on an even ground would be cut off.
                let span = high - low;
                if span > 0.05 * (self.high - self.low) {
                    // Images of the same scene overshoot its extremes, so a little is added.
                    self.low = self.low.max(low - HEADROOM * span);
                    self.high = self.high.min(high + HEADROOM * span);
                    self.told = format!(
                        "Colours from the {}th to the {}th percentile of the pixels and 5 per cent beyond.",
                        PERCENTILES.0, PERCENTILES.1
                    );
                }
            }
            Range::Auto => {}
            Range::Fixed(a, b) if a.is_finite() && b.is_finite() && a < b => (self.low, self.high) = (a, b),
            Range::Fixed(a, b) => {
                return Err(ChainError::bad_option("range of values", format!("{a} to {b}"), "two finite numbers, the smaller first"));
            }
            Range::Symmetric => {
                content.values.iter_mut().for_each(|v| *v = v.abs());
                let reach = content.percentile(99.9);
                (self.low, self.high, self.two_sided) = (-reach, reach, true);
            }
            Range::Noise(times) => {
                let rms = (content.values.iter().map(|v| v * v).sum::<f64>() / content.values.len() as f64).sqrt();
                // The robust noise of an image that is zero in most pixels is zero.
                let noise = [content.noise, rms].into_iter().find(|n| *n > 0.0);
                let Some(noise) = noise else {
                    (self.low, self.high, self.two_sided) = (-1.0, 1.0, true);
                    self.told = "All pixels are 0.".into();
                    return Ok(());
                };
                (self.low, self.high, self.two_sided) = (-times * noise, times * noise, true);
                self.in_noise = Some(noise);
                let most = content.peak() / noise;
                self.told = format!("The largest pixel is {most:.1} times the noise, which is the robust rms of the image.");
            }
        }
        if self.high <= self.low {
            // If all pixels have the same value, the colours need a range around it.
            let margin = 0.5 * self.low.abs().max(1.0);
            (self.low, self.high) = (self.low - margin, self.high + margin);
        }
        Ok(())
    }

    fn choose_stretch(&mut self, wish: &Wish, content: &Content) {
        let jansky = matches!(self.unit, BrightnessUnit::JyPerBeam | BrightnessUnit::JyPerPixel);
        self.curve = match wish.stretch {
            Stretch::Linear => Curve::Linear,
            _ if self.two_sided => Curve::Linear,
            Stretch::Auto if self.points && wish.range == Range::Auto => content.around_zero(),
            Stretch::Auto => Curve::Linear,
            Stretch::Asinh if jansky => content.around_zero(),
            Stretch::Asinh => Curve::Asinh { origin: self.low, linear: 0.1 * (self.high - self.low) },
        };
        if let Curve::Asinh { origin, linear } = self.curve {
            let from = if origin == 0.0 { String::new() } else { format!(" from {}", brightness(origin, self.unit)) };
            self.told +=
                &format!("Colours by asinh{from}: in proportion up to {}, logarithmic above.", brightness(origin + linear, self.unit));
        }
    }

    /// The colours.
    pub(super) fn scale(&self) -> ColorScale {
        ColorScale {
            gradient: if self.two_sided { colorous::RED_BLUE } else { colorous::INFERNO },
            reversed: self.two_sided,
            low: self.low,
            high: self.high,
            stretch: self.curve,
            blank: BLANK,
        }
    }

    /// The rows and columns of a grid that the picture shows.
    pub(super) fn cells(&self, grid: &SkyGrid) -> (Cells<usize>, Cells<usize>) {
        let Some(part) = self.part else { return (0..grid.n_m, 0..grid.n_l) };
        let span = |a: f64, b: f64, n: usize| {
            let (low, high) = ((a.min(b) + 0.5).round().max(0.0) as usize, (a.max(b) + 0.5).round().max(0.0) as usize);
            let low = low.min(n - 2);
            low..high.clamp(low + 2, n)
        };
        let rows = span(grid.row_of(part.m.0), grid.row_of(part.m.1), grid.n_m);
        (rows, span(grid.column_of(part.l.0), grid.column_of(part.l.1), grid.n_l))
    }

    /// The view for another image: the same colours and the same part. Its own noise decides about contours.
    #[must_use]
    pub fn like(mut self, name: &str) -> Self {
        self.told = format!("Colours as for {name}.");
        self
    }

    /// Unit of the image that was looked at.
    #[must_use]
    pub fn unit(&self) -> BrightnessUnit {
        self.unit
    }
}

/// The square around all emission, with a margin, if it is a small part of the frame.
fn emission(image: &Image, plane: ArrayView2<'_, f64>, content: &Content, chan: usize) -> Option<Part> {
    let grid = &image.grid;
    let kept = (KEPT.0 * content.noise).max(KEPT.1 * content.peak());
    let mut ends = [(usize::MAX, 0), (usize::MAX, 0)];
    for ((r, c), _) in plane.indexed_iter().filter(|(_, v)| v.abs() > kept) {
        for (end, k) in ends.iter_mut().zip([r, c]) {
            *end = (end.0.min(k), end.1.max(k));
        }
    }
    let [rows, columns] = ends;
    if rows.0 > rows.1 {
        return None;
    }
    // One beam serves all channels, several serve one channel each.
    let beam = if image.beams.len() == 1 { image.beams.first() } else { image.beams.get(chan) };
    let beam = beam.map_or(4.0, |b| b.bmaj_rad / grid.cell_rad);
    let extent = (rows.1 - rows.0).max(columns.1 - columns.0) as f64 + 1.0;
    let side = (extent + 2.0 * (0.12 * extent).max(4.0 * beam).max(8.0)).ceil();
    if side > WORTH_A_CUT * grid.n_l.min(grid.n_m) as f64 {
        return None;
    }
    // The square is moved into the frame where it reaches over an edge.
    let place = |(a, b): (usize, usize), n: usize| {
        let low = (0.5 * (a + b) as f64 - 0.5 * side).round().clamp(0.0, n as f64 - side);
        (low - 0.5, low + side - 0.5)
    };
    let (r, c) = (place(rows, grid.n_m), place(columns, grid.n_l));
    Some(Part { l: (grid.l_at(c.0), grid.l_at(c.1)), m: (grid.m_at(r.0), grid.m_at(r.1)) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::Noise;
    use cittert_arrays::{Polarization, SkyFrame, SpectralWindow};
    use ndarray::Array4;

    fn image(unit: BrightnessUnit, mut value: impl FnMut(usize, usize) -> f64) -> Image {
        let grid = SkyGrid::new(200, 200, 1e-5, SkyFrame::Boresight).unwrap();
        let data = Array4::from_shape_fn((1, 1, 200, 200), |(_, _, r, c)| value(r, c));
        Image::new(grid, SpectralWindow::band(1e9, 1e6, 1).unwrap(), vec![Polarization::I], data, unit).unwrap()
    }

    fn chosen(image: &Image) -> View {
        View::new(image, 0, 0, &Wish::default()).unwrap()
    }

    /// Two points of 1 Jy/beam in noise of 1 mJy/beam.
    fn points(unit: BrightnessUnit) -> Image {
        let mut noise = Noise(3);
        image(unit, |r, c| {
            let grains: f64 = (0..12).map(|_| noise.next()).sum::<f64>() / 2.0;
            let at = |y: f64, x: f64| (-0.5 * ((r as f64 - y).powi(2) + (c as f64 - x).powi(2)) / 4.0).exp();
            1e-3 * grains + at(90.0, 100.0) + 0.3 * at(110.0, 120.0)
        })
    }

    #[test]
    fn points_get_asinh_contours_and_a_cut() {
        let found = chosen(&points(BrightnessUnit::JyPerBeam));
        let Curve::Asinh { origin, linear } = found.curve else { panic!("{found:?}") };
        assert!(origin == 0.0 && (2e-3..6e-3).contains(&linear), "{linear}");
        assert!(found.contours && found.points && !found.two_sided);
        let (rows, columns) = found.cells(&points(BrightnessUnit::JyPerBeam).grid);
        assert!(rows.len() == columns.len() && rows.len() < 100, "{rows:?} {columns:?}");
        assert!(rows.contains(&80) && rows.contains(&120) && columns.contains(&90) && columns.contains(&130));
        let all = View::new(&points(BrightnessUnit::JyPerBeam), 0, 0, &Wish { full: true, ..Wish::default() }).unwrap();
        assert_eq!(all.cells(&points(BrightnessUnit::JyPerBeam).grid), (0..200, 0..200));
    }

    #[test]
    fn a_warm_scene_gets_percentiles_and_no_contours() {
        let warm = image(BrightnessUnit::Kelvin, |r, c| if (r, c) == (3, 3) { 2000.0 } else { 200.0 + r as f64 });
        let found = chosen(&warm);
        assert_eq!((found.curve, found.contours, found.part), (Curve::Linear, false, None));
        // The lowest value is 200, and the 99.5th percentile 398.
        assert!(found.low == 200.0 && (found.high - (398.0 + 0.05 * 197.0)).abs() < 2.0, "{} {}", found.low, found.high);
        // A bright point on an even ground is not cut off.
        let point = image(BrightnessUnit::Kelvin, |r, c| if (r, c) == (3, 3) { 2000.0 } else { 200.0 });
        assert_eq!(chosen(&point).high, 2000.0);
    }

    #[test]
    fn an_extended_source_in_jansky_is_linear_and_whole() {
        let disc = image(BrightnessUnit::JyPerBeam, |r, c| f64::from((r as f64 - 100.0).hypot(c as f64 - 100.0) < 60.0));
        let found = chosen(&disc);
        assert_eq!((found.curve, found.contours, found.part), (Curve::Linear, false, None));
        assert_eq!((found.low, found.high), (0.0, 1.0));
    }

    #[test]
    fn residuals_are_in_units_of_the_robust_noise() {
        let wish = Wish { range: Range::Noise(5.0), ..Wish::default() };
        let found = View::new(&points(BrightnessUnit::JyPerBeam), 0, 0, &wish).unwrap();
        let noise = found.in_noise.unwrap();
        // The sum of twelve numbers in [-1, 1) has a standard deviation of 2. Its shape and the 350 pixels of the points raise the median
        // absolute deviation by 1 per cent each, and 40,000 pixels give it to 1 per cent.
        assert!((noise - 1e-3).abs() < 4e-5, "{noise}");
        assert!((found.high - 5.0 * noise).abs() < 1e-12 && found.low == -found.high && found.part.is_none());
        let zero = View::new(&image(BrightnessUnit::Kelvin, |_, _| 0.0), 0, 0, &wish).unwrap();
        assert!((zero.low, zero.high) == (-1.0, 1.0) && zero.told.contains("All pixels are 0"));
    }
}
