//! A search for a source outside the image, where an image does not explain its data.
//!
//! What a source outside does to the visibilities cannot be told from other faults by their size alone. An image of the residual visibilities over a wider field
//! can: the source is its brightest point, and subtracting it there takes much of the residual away.

use super::finding::Finding;
use super::misfits::angle;
use super::residuals::Residuals;
use super::samples::for_each_looked_at;
use crate::Result;
use crate::calibrate::{Accuracy, ModelVisibilities, of_all, sees_unpolarized};
use crate::fourier::{GridOptions, Transform, UvwExtent, good_size};
use crate::imaging::finished;
use crate::memory::MemoryBudget;
use cittert_arrays::{Ranks, SPEED_OF_LIGHT_M_S, SkyGrid, VisUnit, VisibilityBlock, VisibilitySource};
use ndarray::{Array2, Array3, ArrayView1, Axis};
use num_complex::{Complex, Complex32};

/// Most pixels along a side of a wide image.
const SIDE: usize = 1024;
/// Widths of the wide images, in terms of the image.
const WIDER: [f64; 2] = [3.0, 9.0];
/// Memory that the transform of a wide image shares out, bytes: its planes take a quarter.
const WORKING: u64 = 64 << 20;
/// Largest direction cosine of a wide image.
const HORIZON: f64 = 0.9;
/// Most turns of phase that w may make over a wide image, which needs some planes for each.
const TURNS: f64 = 4.0;
/// The part of what the image leaves, beyond noise, that a source explains at least.
const SHARE: f64 = 0.1;
/// How much brighter it is than anything that is left in the image. Other faults leave most near the sources, which lie within.
const BRIGHTER: f64 = 1.5;
/// How far it rises above the rms of the wide image. The largest of a million random pixels reaches 5 times the rms, however few baselines make the image.
const ABOVE_RMS: f64 = 6.5;
/// Radius of what belongs to the beam of a point, over the inverse of the rms length of the baselines: one and a half of its width at half maximum.
const BEAM: f64 = 0.8;
/// Room beside the source in the image that is proposed, in terms of its distance.
const ROOM: f64 = 1.1;

/// A source outside the image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outside {
    /// Its flux as the visibilities show it, in their unit: behind the pattern of the elements, and smeared by channels and integrations.
    pub flux: f64,
    /// Its direction cosine l.
    pub l: f64,
    /// Its direction cosine m.
    pub m: f64,
    /// The part of what the image leaves, beyond noise, that it explains.
    pub share: f64,
}

impl Outside {
    /// What is said about an image on this grid.
    #[must_use]
    pub fn finding(&self, grid: &SkyGrid, unit: VisUnit) -> Finding {
        let unit = match unit {
            VisUnit::Jy => " Jy",
            VisUnit::KelvinSr => " K sr",
            VisUnit::Uncalibrated => "",
        };
        let says = format!(
            "a source of about {}{unit} lies outside the image, at l = {:.3e}, m = {:.3e} ({} from its centre): it explains {:.0} % of what the image leaves",
            three_digits(self.flux),
            self.l,
            self.m,
            angle(self.l.hypot(self.m)),
            100.0 * self.share.min(1.0)
        );
        let half = self.l.abs().max(self.m.abs()) / grid.cell_rad;
        let size = good_size((2.0 * ROOM * half).ceil() as usize).max(grid.n_l.max(grid.n_m));
        Finding::new("outside", says, format!("make an image that holds it: --size {size} --cell {}", typed(grid.cell_rad)))
    }
}

/// Three digits of a positive number.
fn three_digits(x: f64) -> String {
    let places = 2 - x.log10().floor() as i32;
    if (0..=6).contains(&places) { format!("{x:.*}", places as usize) } else { format!("{x:.2e}") }
}

/// An angle as an option takes it.
fn typed(rad: f64) -> String {
    let arcsec = rad.to_degrees() * 3600.0;
    if (0.1..3600.0).contains(&arcsec) { format!("{arcsec:.4}arcsec") } else { format!("{rad:.4e}rad") }
}

/// The residuals of some rows: \[row, 3\] and \[row, chan\].
struct Part {
    uvw_m: Array2<f64>,
    /// Sums over the products of weight times residual, and of the weights.
    weighted: Array2<Complex32>,
    weights: Array2<f32>,
    /// Sums of weight times squared residual.
    power: Array2<f32>,
}

/// Look for a source outside an image whose model leaves these residuals, of which process 0 has the statistics. All processes get the answer.
///
/// # Errors
/// The data cannot be read, or the model cannot be evaluated.
pub fn look_outside(
    data: &mut dyn VisibilitySource,
    model: &mut dyn ModelVisibilities,
    residuals: Option<&Residuals>,
    (grid, accuracy): (&SkyGrid, Accuracy),
) -> Result<Option<Outside>> {
    let ranks = data.ranks();
    // The part of the power of the residuals that is not noise.
    let mut beyond = [residuals.map_or(0.0, |r| if r.noise_known { 1.0 - r.mean.recip() } else { 1.0 })];
    ranks.largest(&mut beyond);
    let mut parts = Vec::new();
    let freq_hz = data.header().spectrum.freq_hz().to_vec();
    let lowest_hz = freq_hz.iter().copied().fold(f64::INFINITY, f64::min);
    let wide_grids: Vec<SkyGrid> = WIDER.iter().filter_map(|factor| wide_grid(grid, *factor)).collect();
    if wide_grids.is_empty() {
        return Ok(None);
    }
    let longest_wl = wide_grids.iter().map(longest_wl).fold(0.0, f64::max);
    let read = for_each_looked_at(data, |header, blocks| {
        let runs: Vec<_> = blocks.iter().map(|(first, block)| (*first, &block.coverage)).collect();
        let predicted = model.predict_runs(header, &runs)?;
        let products: Vec<usize> = (0..header.polarizations.len()).filter(|p| sees_unpolarized(header.polarizations[*p])).collect();
        let shows = |uvw: ArrayView1<'_, f64>| uvw[0].hypot(uvw[1]) * lowest_hz / SPEED_OF_LIGHT_M_S <= longest_wl;
        parts.extend(blocks.iter().zip(&predicted).map(|((_, block), predicted)| Part::of(block, predicted, &products, shows)));
        Ok(())
    });
    of_all(&*ranks, read.map(|()| Vec::new()))?;
    for wide in &wide_grids {
        let seen = Seen::of(&parts, &freq_hz, (wide, accuracy.no_w), &*ranks);
        if !(seen.weight > 0.0 && seen.power > 0.0 && beyond[0] > 0.0) {
            break;
        }
        let image = seen.image(wide, accuracy, &*ranks)?;
        if let Some(found) = brightest(&seen, &image, (wide, grid), beyond[0]) {
            return Ok(Some(found));
        }
    }
    Ok(None)
}

impl Part {
    /// What is left of these products of those rows of a block whose uvw show anything. `predicted` is the model of all rows.
    fn of(block: &VisibilityBlock, predicted: &Array3<Complex32>, products: &[usize], shows: impl Fn(ArrayView1<'_, f64>) -> bool) -> Self {
        let coverage = &block.coverage;
        let apart = |row: &usize| coverage.ant1[*row] != coverage.ant2[*row] && shows(coverage.uvw_m.row(*row));
        let rows: Vec<usize> = (0..block.n_rows()).filter(apart).collect();
        let shape = (rows.len(), block.vis.dim().1);
        let uvw_m = coverage.uvw_m.select(Axis(0), &rows);
        let mut new = Self { uvw_m, weighted: Array2::zeros(shape), weights: Array2::zeros(shape), power: Array2::zeros(shape) };
        for ((k, row), chan) in rows.iter().enumerate().flat_map(|row| (0..shape.1).map(move |c| (row, c))) {
            for p in products {
                let at = (*row, chan, *p);
                let (weight, left) = (block.usable_weight(*row, chan, *p), block.vis[at] - predicted[at]);
                if weight > 0.0 && left.is_finite() {
                    new.weighted[(k, chan)] += left * weight;
                    new.weights[(k, chan)] += weight;
                    new.power[(k, chan)] += weight * left.norm_sqr();
                }
            }
        }
        new
    }

    fn length_wl(&self, row: usize, hz: f64) -> f64 {
        self.uvw_m[(row, 0)].hypot(self.uvw_m[(row, 1)]) * hz / SPEED_OF_LIGHT_M_S
    }

    /// Whether there is a visibility of a baseline within these limits of its length and of w.
    fn shows(&self, (row, chan): (usize, usize), hz: f64, (longest_wl, w_wl): (f64, f64)) -> bool {
        let w = (self.uvw_m[(row, 2)] * hz / SPEED_OF_LIGHT_M_S).abs();
        self.weights[(row, chan)] > 0.0 && self.length_wl(row, hz) <= longest_wl && w <= w_wl
    }
}

/// The grid of an image that is wider than `grid` by a factor, or more where few pixels allow it. `None` where there is nothing outside.
fn wide_grid(grid: &SkyGrid, factor: f64) -> Option<SkyGrid> {
    let width = grid.n_l.max(grid.n_m) as f64 * grid.cell_rad;
    let cell = (factor * width / SIDE as f64).max(grid.cell_rad * factor / WIDER[0]);
    let side = SIDE.min((HORIZON / cell) as usize * 2);
    (side as f64 * cell > 1.1 * width).then(|| SkyGrid::new(side, side, cell, grid.frame.clone()).ok()).flatten()
}

/// The longest baseline that does not see details between the pixels of a wide image.
fn longest_wl(wide: &SkyGrid) -> f64 {
    0.45 / wide.cell_rad
}

/// The visibilities that show what a wide image does. Longer baselines see details between its pixels, and a larger w takes long.
struct Seen<'a> {
    freq_hz: &'a [f64],
    limits_wl: (f64, f64),
    /// The rows of each part that have any.
    rows: Vec<(&'a Part, Vec<usize>)>,
    extent: UvwExtent,
    /// Their number, and their sums over all processes: of the weights, of weight times squared residual, of weight times squared length in wavelengths.
    count: f64,
    weight: f64,
    power: f64,
    length2: f64,
}

impl<'a> Seen<'a> {
    fn of(parts: &'a [Part], freq_hz: &'a [f64], (wide, no_w): (&SkyGrid, bool), ranks: &dyn Ranks) -> Self {
        // From the middle of the image to a corner, 1 - n grows to this depth.
        let corner = 0.5 * wide.n_l as f64 * wide.cell_rad * std::f64::consts::SQRT_2;
        let depth = 1.0 - (1.0 - corner * corner).max(0.0).sqrt();
        let limits_wl = (longest_wl(wide), if no_w { f64::INFINITY } else { TURNS / depth });
        let (mut sums, mut extent, mut rows) = ([0.0; 4], UvwExtent::default(), Vec::new());
        for part in parts {
            let mut of_part = Vec::new();
            for row in 0..part.uvw_m.nrows() {
                let before = sums[0];
                for (chan, hz) in freq_hz.iter().enumerate().filter(|(chan, hz)| part.shows((row, *chan), **hz, limits_wl)) {
                    let weight = f64::from(part.weights[(row, chan)]);
                    let of_one = [1.0, weight, f64::from(part.power[(row, chan)]), weight * part.length_wl(row, *hz).powi(2)];
                    sums.iter_mut().zip(of_one).for_each(|(sum, x)| *sum += x);
                }
                if sums[0] > before {
                    of_part.push(row);
                }
            }
            extent = extent.union(UvwExtent::of(part.uvw_m.select(Axis(0), &of_part).view()));
            rows.push((part, of_part));
        }
        ranks.sum(&mut sums);
        let mut reach = [extent.u_m, extent.v_m, extent.w_m];
        ranks.largest(&mut reach);
        let [count, weight, power, length2] = sums;
        let extent = UvwExtent { u_m: reach[0], v_m: reach[1], w_m: reach[2] };
        Self { freq_hz, limits_wl, rows, extent, count, weight, power, length2 }
    }

    /// The image of the residuals \[m, l\]: in each pixel, the flux of a point there that explains most of them.
    fn image(&self, wide: &SkyGrid, accuracy: Accuracy, ranks: &dyn Ranks) -> Result<Array2<f64>> {
        // Plane after plane: the search for what may lie outside must not need more memory than the image.
        let memory = MemoryBudget::new(WORKING.min(MemoryBudget::default().bytes() as u64))?;
        let options = GridOptions { epsilon: accuracy.epsilon, w_term: !accuracy.no_w, divide_by_n: false, memory };
        let mut gridder = Transform::<f32>::new(wide, self.freq_hz, self.extent, &options, self.count as u64)?.gridder();
        let rows: Vec<(&Part, usize)> = self.rows.iter().flat_map(|(part, rows)| rows.iter().map(move |row| (*part, *row))).collect();
        let uvw_m = Array2::from_shape_fn((rows.len(), 3), |(k, axis)| rows[k].0.uvw_m[(rows[k].1, axis)]);
        let values = Array2::from_shape_fn((rows.len(), self.freq_hz.len()), |(k, chan)| {
            let (part, at) = (rows[k].0, (rows[k].1, chan));
            let shown = part.shows(at, self.freq_hz[chan], self.limits_wl);
            if shown { part.weighted[at] / self.weight as f32 } else { Complex::default() }
        });
        // Planes that do not fit into the memory are made once for all rows that are added together.
        gridder.add(uvw_m.view(), values.view())?;
        Ok(finished(ranks, gridder))
    }
}

/// The brightest point of an image of the residuals outside the grid of an image, if it explains enough of them.
fn brightest(seen: &Seen<'_>, image: &Array2<f64>, (wide, grid): (&SkyGrid, &SkyGrid), beyond: f64) -> Option<Outside> {
    let half = |n: usize| (n / 2) as f64 * grid.cell_rad + wide.cell_rad;
    let (half_l, half_m) = (half(grid.n_l), half(grid.n_m));
    let pixels = || image.indexed_iter().map(|((i, j), value)| (wide.l_at(j as f64), wide.m_at(i as f64), *value));
    let inside = |l: f64, m: f64| l.abs() <= half_l && m.abs() <= half_m;
    let outer = pixels().filter(|(l, m, _)| !inside(*l, *m) && l.hypot(*m) < HORIZON);
    let (l, m, flux) = outer.max_by(|a, b| a.2.total_cmp(&b.2))?;
    // The beam of a source near the edge reaches into the image.
    let beam = BEAM / (seen.length2 / seen.weight).sqrt();
    let others = pixels().filter(|(x, y, _)| inside(*x, *y) && (x - l).hypot(y - m) > beam);
    let within = others.fold(0.0_f64, |top, (_, _, value)| top.max(value.abs()));
    let square = image.iter().map(|value| value * value).sum::<f64>() / image.len() as f64;
    // A point of this flux takes so much of the power away.
    let share = flux * flux * seen.weight / (seen.power * beyond);
    (share > SHARE && flux > BRIGHTER * within && flux > ABOVE_RMS * square.sqrt()).then_some(Outside { flux, l, m, share })
}
