//! The pupil on a grid of square cells: how much of each cell is open, the illumination, and the path error.

use super::aberrations::{Wavefront, too_rough};
use super::intervals::{add_cover, without};
use super::options::PupilOptions;
use super::shapes::Shape;
use super::struts::Struts;
use crate::values::need;
use crate::{ChainError, Result, ensure};
use ndarray::{Array2, ArrayView2, Axis};
use num_complex::Complex64;
use rayon::prelude::*;

/// Lines of each part of a cell at which the edges are computed exactly. Parts end where an edge runs along the lines.
const LINES: usize = 16;
/// Cells across the pupil: the fewest, and the most where aberrations need them.
const CELLS: (usize, usize) = (384, 1536);
/// Largest difference of the path between neighbouring cells, waves.
const STEP: f64 = 0.05;

/// The pupil without the wavefront. The arrays are \[y, x\]; the axis of the optics is between the two middle cells of each side.
#[derive(Debug)]
pub(super) struct Pupil {
    /// Side of a cell, m.
    pub(super) cell_m: f64,
    /// Radius of the unit disc of the aberrations, m.
    pub(super) radius_m: f64,
    /// Part of each cell that is open times the amplitude of the illumination.
    pub(super) amplitude: Array2<f64>,
    /// Received power: the sum of the open parts times the square of the amplitude, in cells.
    pub(super) power: f64,
    /// Area of the open parts, m^2.
    pub(super) area_m2: f64,
}

/// The openings of the pupil.
#[derive(Debug)]
struct Openings {
    aperture: Box<dyn Shape>,
    blockage: Option<Box<dyn Shape>>,
    struts: Option<Struts>,
}

impl Openings {
    fn new(options: &PupilOptions) -> Result<Self> {
        let missing = || ChainError::bad_option("aperture", "not given", "a shape with its lengths, such as circle=1.2m");
        let made =
            |name: &'static str, shape: &super::shapes::Aperture| shape.shape().map_err(|why| ChainError::bad_option(name, shape, why));
        let aperture = made("aperture", options.aperture.as_ref().ok_or_else(missing)?)?;
        let blockage = options.blockage.as_ref().map(|shape| made("blockage", shape)).transpose()?;
        need("struts", options.struts, options.struts <= 24, "at most 24 struts")?;
        let struts = match (options.struts, options.strut_width) {
            (0, None) => None,
            (0, Some(width)) => return Err(ChainError::bad_option("strut_width", width, "a number of --struts with it")),
            (_, None) => return Err(ChainError::bad_option("struts", options.struts, "a --strut-width with it")),
            (number, Some(width)) => {
                need("strut_width", width, width.si() > 0.0, "a width above 0")?;
                Some(Struts { number, width_m: width.si(), angle_rad: options.strut_angle.map_or(0.0, |a| a.si()) })
            }
        };
        Ok(Self { aperture, blockage, struts })
    }

    /// The open parts of the line at height `y`.
    fn spans(&self, y: f64) -> Vec<(f64, f64)> {
        let mut spans = self.aperture.spans(y);
        for closed in self.blockage.iter().flat_map(|shape| shape.spans(y)) {
            spans = without(&spans, closed);
        }
        for closed in self.struts.iter().flat_map(|struts| struts.spans(y)) {
            spans = without(&spans, closed);
        }
        spans
    }

    /// The heights at which the open parts begin, end or turn, in ascending order.
    fn breaks_m(&self) -> Vec<f64> {
        let shapes = std::iter::once(&self.aperture).chain(&self.blockage);
        let mut breaks: Vec<f64> = shapes.flat_map(|shape| shape.breaks_m()).collect();
        breaks.extend(self.struts.iter().flat_map(Struts::breaks_m));
        breaks.sort_by(f64::total_cmp);
        breaks
    }
}

impl Pupil {
    /// The pupil with so many cells that a wavefront is nearly flat in each of them.
    ///
    /// # Errors
    /// Options that make no opening, or a wavefront too rough for the finest cells.
    pub(super) fn new(options: &PupilOptions, waves: &[Wavefront], shortest_m: f64) -> Result<Self> {
        let openings = Openings::new(options)?;
        let mut cells = CELLS.0;
        loop {
            let pupil = Self::sampled(options, &openings, cells)?;
            let step = waves.iter().map(|wave| pupil.largest_step(wave)).fold(0.0, f64::max) / shortest_m;
            if step <= STEP || (cells >= CELLS.1 && step <= 0.25) {
                return Ok(pupil);
            }
            ensure!(cells < CELLS.1, too_rough(step));
            cells *= 2;
        }
    }

    fn sampled(options: &PupilOptions, openings: &Openings, n: usize) -> Result<Self> {
        let half = openings.aperture.half_box_m();
        let cell_m = 2.0 * half.0.max(half.1) / n as f64;
        let radius_m = openings.aperture.radius_m();
        let start = -0.5 * n as f64 * cell_m;
        let breaks = openings.breaks_m();
        let mut open = Array2::<f64>::zeros((n, n));
        open.axis_iter_mut(Axis(0)).into_par_iter().enumerate().for_each(|(row, mut line)| {
            let (low, high) = (start + row as f64 * cell_m, start + (row as f64 + 1.0) * cell_m);
            let mut cells = vec![0.0; n];
            let mut from = low;
            for to in breaks.iter().copied().filter(|y| low < *y && *y < high).chain([high]) {
                cells.fill(0.0);
                for k in 0..LINES {
                    let y = from + (to - from) * (k as f64 + 0.5) / LINES as f64;
                    add_cover(&openings.spans(y), start, cell_m, &mut cells);
                }
                let share = (to - from) / (cell_m * LINES as f64);
                line.iter_mut().zip(&cells).for_each(|(v, c)| *v += share * c);
                from = to;
            }
        });
        if let Some(mask) = &options.mask {
            open *= &masked(mask.view(), n, (half.0 / cell_m, half.1 / cell_m))?;
        }
        let at = |k: usize| start + (k as f64 + 0.5) * cell_m;
        let taper = Array2::from_shape_fn((n, n), |(r, c)| options.taper.amplitude(at(r).hypot(at(c)) / radius_m));
        let power = open.iter().zip(&taper).map(|(c, a)| c * a * a).sum();
        let area_m2 = open.sum() * cell_m * cell_m;
        ensure!(
            power > 0.0,
            ChainError::Incompatible("nothing of the aperture is open: its blockage, struts or mask close all of it".into())
        );
        Ok(Self { cell_m, radius_m, amplitude: open * taper, power, area_m2 })
    }

    /// Coordinate of the centre of a cell, m.
    fn at(&self, k: usize) -> f64 {
        (k as f64 + 0.5 - 0.5 * self.amplitude.nrows() as f64) * self.cell_m
    }

    /// Cells across.
    pub(super) fn cells(&self) -> usize {
        self.amplitude.nrows()
    }

    /// Path error at the centre of each cell, m; 0 where the pupil is closed.
    pub(super) fn paths_m(&self, wave: &Wavefront) -> Array2<f64> {
        let mut paths = Array2::zeros(self.amplitude.dim());
        if wave.is_flat() {
            return paths;
        }
        paths.axis_iter_mut(Axis(0)).into_par_iter().enumerate().for_each(|(r, mut line)| {
            for (c, v) in line.iter_mut().enumerate() {
                if self.amplitude[[r, c]] != 0.0 {
                    *v = wave.path_m(self.at(c), self.at(r), self.radius_m);
                }
            }
        });
        paths
    }

    /// Largest difference of the path between neighbouring open cells, m.
    fn largest_step(&self, wave: &Wavefront) -> f64 {
        if wave.is_flat() {
            return 0.0;
        }
        let paths = self.paths_m(wave);
        let step = |(r, c): (usize, usize), (p, q): (usize, usize)| {
            let open = |at| self.amplitude.get(at).is_some_and(|v| *v != 0.0);
            if open((r, c)) && open((p, q)) { (paths[[p, q]] - paths[[r, c]]).abs() } else { 0.0 }
        };
        paths.indexed_iter().map(|((r, c), _)| step((r, c), (r + 1, c)).max(step((r, c), (r, c + 1)))).fold(0.0, f64::max)
    }

    /// The field in the pupil at a wavelength.
    pub(super) fn field(&self, paths_m: &Array2<f64>, wavelength_m: f64) -> Array2<Complex64> {
        let phase = std::f64::consts::TAU / wavelength_m;
        ndarray::Zip::from(&self.amplitude).and(paths_m).par_map_collect(|a, path| Complex64::from_polar(*a, phase * path))
    }
}

/// Mean of a picture over each cell. It fills the box around the aperture, whose half sides are given in cells.
fn masked(mask: ArrayView2<'_, f64>, n: usize, half: (f64, f64)) -> Result<Array2<f64>> {
    let good = mask.iter().all(|v| (0.0..=1.0).contains(v));
    ensure!(good, ChainError::bad_option("aperture_mask", "a picture with other values", "values from 0 (closed) to 1 (open)"));
    let (rows, columns) = mask.dim();
    // The pixels under a cell, with the part of the cell that each covers.
    let under = |k: usize, half: f64, pixels: usize| -> Vec<(usize, f64)> {
        let scale = pixels as f64 / (2.0 * half);
        let place = |edge: f64| ((edge - 0.5 * n as f64 + half) * scale).clamp(0.0, pixels as f64);
        let (a, b) = (place(k as f64), place(k as f64 + 1.0));
        (a.floor() as usize..b.ceil() as usize).map(|p| (p, (b.min(p as f64 + 1.0) - a.max(p as f64)).max(0.0) / scale)).collect()
    };
    let across: Vec<_> = (0..n).map(|c| under(c, half.0, columns)).collect();
    let down: Vec<_> = (0..n).map(|r| under(r, half.1, rows)).collect();
    // The openings know how much of a cell at the edge of the box is covered; here it counts as the mean of what is in the box.
    let mean = |(r, c): (usize, usize)| {
        let pairs = || down[r].iter().flat_map(|d| across[c].iter().map(move |a| (d, a)));
        let weight: f64 = pairs().map(|(d, a)| d.1 * a.1).sum();
        let sum: f64 = pairs().map(|(d, a)| d.1 * a.1 * mask[[d.0, a.0]]).sum();
        if weight > 0.0 { sum / weight } else { 0.0 }
    };
    Ok(Array2::from_shape_fn((n, n), mean))
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::quantity::{Angle, Length};
    use std::f64::consts::PI;

    pub(crate) fn pupil(options: &PupilOptions) -> Pupil {
        Pupil::new(options, &[], 1e-3).unwrap()
    }

    #[test]
    fn the_open_area_is_that_of_the_parts() {
        let circle = PupilOptions { aperture: Some("circle=1.2m".parse().unwrap()), ..PupilOptions::default() };
        let full = PI * 0.36;
        assert!((pupil(&circle).area_m2 / full - 1.0).abs() < 1e-5);
        let blocked = PupilOptions { blockage: Some("circle=0.3m".parse().unwrap()), ..circle.clone() };
        assert!((pupil(&blocked).area_m2 / (full - PI * 0.0225) - 1.0).abs() < 1e-5);
        for degrees in [0.0_f64, 30.0, 45.0] {
            let struts = PupilOptions {
                struts: 3,
                strut_width: Some(Length(0.03)),
                strut_angle: Some(Angle(degrees.to_radians())),
                ..blocked.clone()
            };
            // Three bars from the blockage to the rim; the ends are curved by less than 1e-4 of the area.
            let expected = full - PI * 0.0225 - 3.0 * 0.03 * 0.45;
            assert!((pupil(&struts).area_m2 / expected - 1.0).abs() < 2e-4, "{degrees}: {}", pupil(&struts).area_m2 / expected);
        }
    }

    /// An edge along the lines is where it is, and not at the nearest line.
    #[test]
    fn edges_along_the_lines_are_exact() {
        for height in [0.74, 0.7413] {
            let aperture = Some(format!("rectangle=1.06m:{height}m").parse().unwrap());
            let options = PupilOptions { aperture, blockage: Some("rectangle=0.2m:0.1237m".parse().unwrap()), ..PupilOptions::default() };
            assert!((pupil(&options).area_m2 / (1.06 * height - 0.2 * 0.1237) - 1.0).abs() < 1e-12, "{height}");
            let struts = PupilOptions { struts: 2, strut_width: Some(Length(0.0301)), ..options };
            let open = 1.06 * height - 0.2 * 0.1237 - 0.0301 * 0.86;
            assert!((pupil(&struts).area_m2 / open - 1.0).abs() < 1e-9, "{height}");
        }
    }

    #[test]
    fn a_mask_fills_the_box_and_closes_what_it_must() {
        let mut mask = Array2::ones((30, 20));
        mask.slice_mut(ndarray::s![.., 10..]).fill(0.0);
        let options = PupilOptions { aperture: Some("rectangle=0.8m:1.2m".parse().unwrap()), mask: Some(mask), ..PupilOptions::default() };
        let found = pupil(&options);
        assert!((found.area_m2 - 0.48).abs() < 1e-4, "{}", found.area_m2);
        assert!(found.amplitude[[192, 191]] > 0.99 && found.amplitude[[192, 192]] == 0.0);
        let wrong = PupilOptions { mask: Some(Array2::from_elem((4, 4), 2.0)), ..options };
        assert!(Pupil::new(&wrong, &[], 1e-3).unwrap_err().to_string().contains("from 0 (closed)"));
    }

    #[test]
    fn a_closed_pupil_and_a_rough_wave_are_refused() {
        let aperture = Some("circle=1m".parse().unwrap());
        let closed = PupilOptions { aperture: aperture.clone(), blockage: Some("circle=2m".parse().unwrap()), ..PupilOptions::default() };
        assert!(Pupil::new(&closed, &[], 1e-3).unwrap_err().to_string().contains("close all of it"));
        let options = PupilOptions { aperture, ..PupilOptions::default() };
        let wave = |waves: &str| {
            let zernike = Some(waves.parse().unwrap());
            Wavefront::new(&super::super::options::AberrationOptions { zernike, ..Default::default() }, 1e-3).unwrap()
        };
        assert_eq!(Pupil::new(&options, &[wave("4:0.1")], 1e-3).unwrap().cells(), 384);
        assert!(Pupil::new(&options, &[wave("4:3")], 1e-3).unwrap().cells() > 384);
        let e = Pupil::new(&options, &[wave("100:90")], 1e-3).unwrap_err().to_string();
        assert!(e.contains("--range") && e.contains("waves"), "{e}");
        assert!(Pupil::new(&PupilOptions::default(), &[], 1e-3).unwrap_err().to_string().contains("circle=1.2m"));
    }
}
