//! Imaging weights of the visibilities.
//!
//! The density of the weights is summed in cells of the u-v plane. The visibilities are folded to v >= 0. A cell is 1 / (2 n cell) wide, where n
//! is the side of the image in pixels: these are the cells of an image with twice the field. Let w be the weight of a visibility and W the sum
//! of the weights in its cell. The imaging weight is:
//!
//! - natural: w;
//! - uniform: w / W;
//! - Briggs: w / (1 + W f^2), with f^2 = (5 10^-R)^2 / (sum of W^2 over cells / sum of w).
//!
//! Uniform factors 1 / W are limited to three times their mean over the occupied cells of the 16 x 16 cells around them, so that a single
//! visibility among well-filled cells does not dominate.
//!
//! # Reference
//! Briggs 1995, PhD thesis, New Mexico Tech, ch. 3. Cells, fold and limit are those of WSClean with a padding of 2 (Offringa et al. 2014,
//! MNRAS 444, 606), as found from the weights that it stores. CASA counts each visibility at (u, v) and at (-u, -v), in cells of the image
//! itself and without a limit, so its weights differ.

use super::options::ImagingOptions;
use super::reduction::ReducedBlock;
use cittert_arrays::{Ranks, SPEED_OF_LIGHT_M_S, SkyGrid, Weighting};
use ndarray::{Array2, ArrayView1, Axis, Zip};
use rayon::prelude::*;
use std::ops::Range;

/// The density grid is that of an image larger by this factor.
const PADDING: f64 = 2.0;
/// Limit of a uniform factor, as a multiple of the mean around it.
const LIMIT: f64 = 3.0;
/// Half of the side of the window of that mean, cells.
const WINDOW: usize = 8;
/// Most rows of cells that one task sums: enough work for a task, and enough tasks for all threads.
const BAND: usize = 64;
/// Tasks that share the occupied rows of a smaller grid.
const BANDS: usize = 32;
/// Rows of data that are listed by band at a time: a list of all would take as much memory as their weights.
const ROWS: usize = 1 << 17;
/// Rows of cells of a visibility that may lie in any.
const EVERYWHERE: Range<f64> = f64::NEG_INFINITY..f64::INFINITY;

/// Imaging weights of one image.
#[derive(Debug, Clone)]
pub struct ImageWeights {
    weighting: Weighting,
    robust: f64,
    taper_rad: Option<f64>,
    inner_taper_rad: Option<f64>,
    width: usize,
    height: usize,
    /// Cells per wavelength along u and v.
    scale: (f64, f64),
    /// Sum of weights, later the factor of each cell \[v, u\]. It is empty for natural weights.
    cells: Vec<f64>,
    /// Cells may be occupied in so many columns to either side of the middle and in so many rows. The others are not read: the system gives
    /// memory only to pages that are used.
    reach: (usize, usize),
    sum_of_weights: f64,
}

impl ImageWeights {
    /// An empty density for an image.
    #[must_use]
    pub fn new(grid: &SkyGrid, options: &ImagingOptions) -> Self {
        let (width, height) = density_sides(grid, options);
        let natural = options.weighting == Weighting::Natural;
        Self {
            weighting: options.weighting,
            robust: options.robust.unwrap_or(0.0),
            taper_rad: options.taper.map(|t| t.si()),
            inner_taper_rad: options.inner_taper.map(|t| t.si()),
            width,
            height,
            scale: (grid.cell_rad * width as f64, grid.cell_rad * height as f64),
            cells: if natural { Vec::new() } else { vec![0.0; width * (height / 2 + 1)] },
            reach: (0, 0),
            sum_of_weights: 0.0,
        }
    }

    /// The rows and columns of cells that may be occupied.
    fn occupied(&self) -> (Range<usize>, Range<usize>) {
        let (middle, n) = (self.width / 2, self.cells.len() / self.width.max(1));
        (0..self.reach.1.min(n), middle - self.reach.0.min(middle)..(middle + self.reach.0).min(self.width))
    }

    /// Extend the reach to some rows of data, up to a frequency.
    fn extend(&mut self, uvw_m: &Array2<f64>, highest_hz: f64) {
        let per_m = highest_hz / SPEED_OF_LIGHT_M_S;
        let (u, v) = uvw_m.rows().into_iter().fold((0.0_f64, 0.0_f64), |(u, v), uvw| (u.max(uvw[0].abs()), v.max(uvw[1].abs())));
        // One cell more for the step down to a whole number, and one for the fold. What lies outside the grid may wrap to any cell.
        let cells = |x: f64, scale: f64, side: usize| {
            let cells = x * per_m * scale + 2.0;
            if cells < (side / 2) as f64 { cells.ceil() as usize } else { side }
        };
        let (columns, rows) = (cells(u, self.scale.0, self.width), cells(v, self.scale.1, self.height));
        let wraps = columns == self.width || rows == self.height;
        let (columns, rows) = if wraps { (self.width, self.height) } else { (columns, rows) };
        self.reach = (self.reach.0.max(columns), self.reach.1.max(rows));
    }

    /// True if the weights need a pass over the data first.
    #[must_use]
    pub fn needs_density(&self) -> bool {
        !self.cells.is_empty()
    }

    /// True if the imaging weights by these options are the weights of the data.
    pub(super) fn will_be_those_of_the_data(options: &ImagingOptions) -> bool {
        options.weighting == Weighting::Natural && options.taper.is_none() && options.inner_taper.is_none()
    }

    /// True if the imaging weights are the weights of the data.
    #[must_use]
    pub fn are_those_of_the_data(&self) -> bool {
        self.cells.is_empty() && self.taper_rad.is_none() && self.inner_taper_rad.is_none()
    }

    /// Index of the cell of (u, v) in wavelengths, folded to v >= 0. A point outside the grid wraps around, as it aliases in the image.
    fn cell(&self, u: f64, v: f64) -> usize {
        let (u, v) = if v < 0.0 { (-u, -v) } else { (u, v) };
        // Column width / 2 is u = 0.
        let (mut x, mut y) = (wrapped(u * self.scale.0 + (self.width / 2) as f64, self.width), wrapped(v * self.scale.1, self.height));
        if y > self.height / 2 {
            (x, y) = (self.width - 1 - x, self.height - 1 - y);
        }
        y * self.width + x
    }

    /// Add the weights of these channels of a block to the density.
    ///
    /// Each task sums its own rows of cells in an order that only the visibilities give, so the sums do not depend on the number of threads.
    pub fn add(&mut self, block: &ReducedBlock, channels: &Range<usize>, freq_hz: &[f64]) {
        if !self.needs_density() {
            return;
        }
        let (low, high) = freq_hz[channels.clone()].iter().fold((f64::INFINITY, 0.0_f64), |(a, b), f| (a.min(*f), b.max(*f)));
        self.extend(&block.uvw_m, high);
        let mut cells = std::mem::take(&mut self.cells);
        let occupied = self.reach.1.min(self.height / 2 + 1);
        let lines = (occupied / BANDS).clamp(1, BAND);
        let bands = (cells.len() / self.width).div_ceil(lines);
        let weight = block.weight.view();
        for from in (0..block.uvw_m.nrows()).step_by(ROWS) {
            let rows = from..block.uvw_m.nrows().min(from + ROWS);
            let (of_band, anywhere) = self.rows_of_bands((block.uvw_m.column(1), rows), (low, high), (lines, bands));
            let task = |((band, cells), rows): ((usize, &mut [f64]), &Vec<u32>)| {
                let first = band * lines * self.width;
                // Only some channels of a row lie in these rows of cells.
                let (start, end) = ((band * lines) as f64 - 1.0, ((band + 1) * lines) as f64 + 1.0);
                let mut sum = 0.0;
                for (row, inside) in rows.iter().map(|row| (row, start..end)).chain(anywhere.iter().map(|row| (row, EVERYWHERE))) {
                    let (uvw, weights) = (block.uvw_m.row(*row as usize), weight.row(*row as usize));
                    let (u, v) = (uvw[0] / SPEED_OF_LIGHT_M_S, uvw[1] / SPEED_OF_LIGHT_M_S);
                    let per_hz = v.abs() * self.scale.1;
                    let inside = inside.start / per_hz..inside.end / per_hz;
                    for c in channels.clone() {
                        if !inside.contains(&freq_hz[c]) {
                            continue;
                        }
                        let w = f64::from(weights[c]);
                        if w > 0.0
                            && let Some(cell) = cells.get_mut(self.cell(u * freq_hz[c], v * freq_hz[c]).wrapping_sub(first))
                        {
                            *cell += w;
                            sum += w;
                        }
                    }
                }
                sum
            };
            // Most visibilities lie in the first rows of cells, so each band is handed out by itself.
            let each = cells.par_chunks_mut(lines * self.width).enumerate().zip(&of_band).with_max_len(1);
            let sums: Vec<f64> = each.map(task).collect();
            self.sum_of_weights += sums.iter().sum::<f64>();
        }
        self.cells = cells;
    }

    /// Which of these rows of data with their v in m reach into each band of rows of cells between two frequencies, and those that lie partly outside
    /// the grid: they wrap around, and may reach into any. `lines` are the rows of cells of a band.
    fn rows_of_bands(
        &self,
        (v_m, rows): (ArrayView1<'_, f64>, Range<usize>),
        (low, high): (f64, f64),
        (lines, bands): (usize, usize),
    ) -> (Vec<Vec<u32>>, Vec<u32>) {
        // The place of a visibility is computed in another order of the factors.
        const ROUNDING: f64 = 1e-12;
        let (mut of_band, mut anywhere) = (vec![Vec::new(); bands], Vec::new());
        let band = |v: f64| (v as usize / lines).min(bands - 1);
        for row in rows {
            let per_hz = (v_m[row] / SPEED_OF_LIGHT_M_S).abs() * self.scale.1;
            let (near, far) = (per_hz * low * (1.0 - ROUNDING), per_hz * high * (1.0 + ROUNDING));
            if far >= (self.height / 2) as f64 {
                anywhere.push(row as u32);
            } else {
                of_band[band(near)..=band(far)].iter_mut().for_each(|rows| rows.push(row as u32));
            }
        }
        (of_band, anywhere)
    }

    /// Replace the density of the rows of this process by that of all rows.
    pub(super) fn share(&mut self, ranks: &dyn Ranks) {
        let mut sum = [self.sum_of_weights];
        if ranks.size() > 1 {
            self.reach = (self.width, self.height);
        }
        ranks.sum(&mut self.cells);
        ranks.sum(&mut sum);
        self.sum_of_weights = sum[0];
    }

    /// Convert the density into the factor of each cell.
    pub fn finish(&mut self) {
        let ((rows, columns), width) = (self.occupied(), self.width);
        let cells = &mut self.cells[..rows.end * width];
        let change = |cells: &mut [f64], to: &(dyn Fn(f64) -> f64 + Sync)| {
            let lines = cells.par_chunks_exact_mut(width).flat_map_iter(|line| &mut line[columns.clone()]);
            lines.filter(|w| **w > 0.0).for_each(|w| *w = to(*w));
        };
        match self.weighting {
            Weighting::Natural => {}
            Weighting::Uniform => {
                change(cells, &|w| 1.0 / w);
                self.limit();
            }
            Weighting::Briggs => {
                let squares = |line: &[f64]| line[columns.clone()].iter().map(|w| w * w).sum::<f64>();
                let lines: Vec<f64> = cells.par_chunks_exact(width).map(squares).collect();
                let f2 = (5.0 * 10f64.powf(-self.robust)).powi(2) / (lines.iter().sum::<f64>() / self.sum_of_weights);
                change(cells, &|w| 1.0 / (1.0 + w * f2));
            }
        }
    }

    /// Limit each factor to [`LIMIT`] times the mean of the occupied cells around it.
    fn limit(&mut self) {
        let (width, rows) = (self.width, self.cells.len() / self.width);
        let old = &self.cells;
        let mut new = vec![0.0; old.len()];
        new.par_chunks_mut(BAND * width).enumerate().with_max_len(1).for_each(|(band, out)| {
            let (y0, lines) = (band * BAND, out.len() / width);
            if y0 >= self.reach.1 {
                return;
            }
            let (from, to) = (y0.saturating_sub(WINDOW), (y0 + lines + WINDOW).min(rows));
            // Sum and number of the occupied cells around each column, for each line.
            let mut along = vec![(0.0, 0.0); (to - from) * width];
            for (sums, line) in along.chunks_exact_mut(width).zip(old[from * width..to * width].chunks_exact(width)) {
                windows(line, sums);
            }
            for (y, out) in (y0..).zip(out.chunks_exact_mut(width)) {
                let line = &old[y * width..(y + 1) * width];
                if line.iter().all(|w| *w == 0.0) {
                    continue;
                }
                let around = &along[(y.saturating_sub(WINDOW) - from) * width..((y + WINDOW).min(rows) - from) * width];
                for (x, (out, w)) in out.iter_mut().zip(line).enumerate().filter(|(_, (_, w))| **w > 0.0) {
                    let (sum, count) = around[x..].iter().step_by(width).fold((0.0, 0.0), |(s, n), a| (s + a.0, n + a.1));
                    *out = w.min(LIMIT * sum / count);
                }
            }
        });
        self.cells = new;
    }

    /// Factor for the weight of a visibility at (u, v) wavelengths.
    #[must_use]
    pub fn factor(&self, u: f64, v: f64) -> f64 {
        let density = if self.cells.is_empty() { 1.0 } else { self.cells[self.cell(u, v)] };
        // The transform of a Gaussian of FWHM theta is exp(-(pi theta |u|)^2 / (4 ln 2)).
        let gauss = |theta: f64| (-(std::f64::consts::PI * theta).powi(2) * (u * u + v * v) / (4.0 * std::f64::consts::LN_2)).exp();
        density * self.taper_rad.map_or(1.0, gauss) * self.inner_taper_rad.map_or(1.0, |t| 1.0 - gauss(t))
    }

    /// Set the imaging weights \[row, chan\] of these channels of a block.
    pub fn apply(&self, block: &ReducedBlock, (channels, freq_hz): (&Range<usize>, &[f64]), imaging: &mut Array2<f32>) {
        let plain = self.are_those_of_the_data();
        let ReducedBlock { uvw_m, weight, .. } = block;
        imaging.axis_iter_mut(Axis(0)).into_par_iter().zip(weight.view().axis_iter(Axis(0))).zip(uvw_m.axis_iter(Axis(0))).for_each(
            |((mut imaging, weight), uvw)| {
                let (u, v) = (uvw[0] / SPEED_OF_LIGHT_M_S, uvw[1] / SPEED_OF_LIGHT_M_S);
                let range = ndarray::s![channels.clone()];
                Zip::from(imaging.slice_mut(range)).and(weight.slice(range)).and(&freq_hz[channels.clone()]).for_each(|i, w, f| {
                    let factor = if plain || *w == 0.0 { 1.0 } else { self.factor(u * f, v * f) };
                    *i = (f64::from(*w) * factor) as f32;
                });
            },
        );
    }
}

/// Columns and rows of the whole density grid, of which half is kept.
pub(super) fn density_sides(grid: &SkyGrid, options: &ImagingOptions) -> (usize, usize) {
    let side = |n: usize| ((PADDING * n as f64 / options.super_uniform).round() as usize).max(1);
    (side(grid.n_l), side(grid.n_m))
}

/// Index of the cell of a coordinate, in `n` cells that repeat periodically.
#[inline]
fn wrapped(x: f64, n: usize) -> usize {
    // Truncation and a step down give the floor without a call.
    let whole = x as i64;
    let floor = whole.saturating_sub(i64::from((whole as f64) > x));
    if (0..n as i64).contains(&floor) { floor as usize } else { floor.rem_euclid(n as i64) as usize }
}

/// Sum and number of the occupied cells from [`WINDOW`] cells before each column to `WINDOW - 1` cells after it.
fn windows(line: &[f64], sums: &mut [(f64, f64)]) {
    if line.iter().all(|w| *w == 0.0) {
        return;
    }
    for (x, sum) in sums.iter_mut().enumerate() {
        let around = &line[x.saturating_sub(WINDOW)..(x + WINDOW).min(line.len())];
        *sum = around.iter().fold((0.0, 0.0), |(s, n), w| (s + w, n + f64::from(u8::from(*w > 0.0))));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::SkyFrame;
    use cittert_arrays::quantity::Angle;
    use ndarray::array;
    use num_complex::Complex32;

    /// Three rows: two in one cell (one of them with the reversed baseline), and one in a cell of its own.
    fn block() -> ReducedBlock {
        let wavelength = SPEED_OF_LIGHT_M_S / 1e9;
        let weight = array![[1.0_f32], [3.0], [2.0]];
        ReducedBlock {
            antennas: Vec::new(),
            uvw_m: array![[100.0, 40.0, 0.0], [-100.2, -40.1, 0.0], [30.0, 0.1, 0.0]] * wavelength,
            vis: Array2::from_elem((3, 1), Complex32::new(1.0, 0.0)),
            imaging: None,
            weight: weight.into(),
        }
    }

    fn natural() -> ImagingOptions {
        ImagingOptions { weighting: Weighting::Natural, ..ImagingOptions::default() }
    }

    fn weigh(options: ImagingOptions) -> Vec<f32> {
        let grid = SkyGrid::new(64, 64, 1e-3, SkyFrame::Boresight).unwrap();
        let b = block();
        let mut weights = ImageWeights::new(&grid, &options);
        if weights.needs_density() {
            weights.add(&b, &(0..1), &[1e9]);
            weights.finish();
        }
        let mut imaging = Array2::zeros(b.vis.dim());
        weights.apply(&b, (&(0..1), &[1e9]), &mut imaging);
        imaging.into_iter().collect()
    }

    #[test]
    fn places_beyond_all_cells_wrap_into_a_cell() {
        for x in [-1e300, -1e19, -1.5, -1.0, 0.0, 7.9, 8.0, 1e300, f64::NAN] {
            assert!(wrapped(x, 8) < 8, "{x}");
        }
        assert_eq!([-1.5, -1.0, 0.0, 7.9, 8.0].map(|x| wrapped(x, 8)), [6, 7, 0, 7, 0]);
    }

    #[test]
    fn each_scheme_gives_the_weights_of_its_formula() {
        let with = |weighting| ImagingOptions { weighting, ..ImagingOptions::default() };
        assert_eq!(weigh(with(Weighting::Natural)), [1.0, 3.0, 2.0]);
        assert_eq!(weigh(with(Weighting::Uniform)), [0.25, 0.75, 1.0]);
        // W = 4, 4, 2; sum W^2 = 16 + 4, sum w = 6; f^2 = 25 * 6 / 20 = 7.5
        let briggs = weigh(with(Weighting::Briggs));
        for (got, expected) in briggs.iter().zip([1.0 / 31.0, 3.0 / 31.0, 2.0 / 16.0]) {
            assert!((got - expected).abs() < 1e-7, "{got} {expected}");
        }
        let wide = weigh(ImagingOptions { super_uniform: 64.0, ..with(Weighting::Uniform) });
        assert!((wide.iter().sum::<f32>() - 1.0).abs() < 0.3, "{wide:?}");
    }

    #[test]
    fn density_and_limit_agree_with_plain_sums_on_any_number_of_threads() {
        let grid = SkyGrid::new(150, 96, 2e-3, SkyFrame::Boresight).unwrap();
        let n = 3000;
        let mut noise = crate::fixtures::Noise(3);
        // Some reach beyond the grid.
        let wavelength = SPEED_OF_LIGHT_M_S / 1e9;
        let uvw_m = Array2::from_shape_fn((n, 3), |(_, k)| if k < 2 { 260.0 * noise.next() * noise.next() * wavelength } else { 0.0 });
        let weight = Array2::from_shape_fn((n, 2), |(r, _)| if r % 9 == 0 { 0.0 } else { 1.0 + noise.next().abs() as f32 });
        let vis = Array2::from_elem((n, 2), Complex32::default());
        let block = ReducedBlock { antennas: Vec::new(), uvw_m, vis, imaging: None, weight: weight.into() };
        let freq = [0.9e9, 1.1e9];
        let options = ImagingOptions { weighting: Weighting::Uniform, ..ImagingOptions::default() };
        let made = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let mut weights = ImageWeights::new(&grid, &options);
            pool.install(|| weights.add(&block, &(0..2), &freq));
            let density = weights.cells.clone();
            pool.install(|| weights.finish());
            (density, weights)
        };
        let (density, weights) = made(1);
        assert!(made(2).0 == density && made(3).1.cells == weights.cells);
        let (width, rows) = (weights.width, density.len() / weights.width);
        let mut plain = vec![0.0; density.len()];
        for (uvw, w) in block.uvw_m.rows().into_iter().zip(block.weight.view().rows()) {
            for c in 0..2 {
                let at = |k: usize| uvw[k] / SPEED_OF_LIGHT_M_S * freq[c];
                plain[weights.cell(at(0), at(1))] += f64::from(w[c]);
            }
        }
        assert_eq!(plain, density);
        for y in 0..rows {
            for x in 0..width {
                let at = y * width + x;
                let around = (y.saturating_sub(WINDOW)..(y + WINDOW).min(rows))
                    .flat_map(|y| (x.saturating_sub(WINDOW)..(x + WINDOW).min(width)).map(move |x| y * width + x));
                let occupied: Vec<f64> = around.map(|k| density[k]).filter(|w| *w > 0.0).map(|w| 1.0 / w).collect();
                let mean = occupied.iter().sum::<f64>() / occupied.len().max(1) as f64;
                let expected = if density[at] > 0.0 { (1.0 / density[at]).min(LIMIT * mean) } else { 0.0 };
                assert!((weights.cells[at] - expected).abs() <= 1e-12 * expected, "{x} {y}");
            }
        }
    }

    #[test]
    fn tapers_halve_where_they_should() {
        // exp(-(pi theta u)^2 / (4 ln 2)) = 1/2 at u = 2 ln 2 / (pi theta).
        let theta = 2.0 * std::f64::consts::LN_2 / (std::f64::consts::PI * 30.0_f64.hypot(0.1));
        let tapered = weigh(ImagingOptions { taper: Some(Angle(theta)), ..natural() });
        assert!((tapered[2] - 1.0).abs() < 1e-6 && tapered[0] < 1e-3, "{tapered:?}");
        let inner = weigh(ImagingOptions { inner_taper: Some(Angle(theta)), ..natural() });
        assert!((inner[2] - 1.0).abs() < 1e-6 && (inner[0] - 1.0).abs() < 1e-3, "{inner:?}");
    }

    #[test]
    fn numbers_out_of_range_are_refused() {
        let robust = |robust| ImagingOptions { weighting: Weighting::Briggs, robust: Some(robust), ..ImagingOptions::default() };
        assert!(robust(f64::NAN).check().is_err() && robust(2.5).check().is_err() && robust(-2.0).check().is_ok());
        // Uniform weights do not use a robustness.
        let unused = ImagingOptions { robust: Some(0.5), ..ImagingOptions::default() }.check().unwrap_err().to_string();
        assert!(unused.contains("briggs"), "{unused}");
        assert!(ImagingOptions { taper: Some(Angle(-1.0)), ..natural() }.check().is_err());
    }
}
