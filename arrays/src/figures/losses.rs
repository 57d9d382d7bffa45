//! Figures of merit with any one and any two antennas lost.
//!
//! A lost antenna takes its phasors out of the sums of the beam, and its baselines out of the counts. Nothing is summed anew: one pair of lost
//! antennas costs as much as one antenna does in the full sum.

use super::beam_lobes::Reach;
use super::coverage::{different_baselines, uv_cells, uv_fill};
use super::main_lobe::Beam;
use super::plane::Plane;
use super::psf::{Psf, phasor};
use super::sensitivity;
use super::side_lobes::{Field, RAY_STEPS, RAYS};
use crate::{ArrayError, ArrayLayout, Result};
use num_complex::Complex64;
use rayon::prelude::*;
use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

/// Most antennas for which all pairs are lost in turn: 32,640 pairs.
const MOST_FOR_PAIRS: usize = 256;

/// Most steps of a ray whose phasors are kept for every antenna.
const MOST_RAY_STEPS: usize = 240;

/// Number of figures that are followed.
const FIGURES: usize = 9;
/// Names of the figures, and whether a larger value is the worse one. `noise_ratio` is the noise of a point source over that of the full array.
pub const LOSS_FIGURES: [(&str, bool); FIGURES] = [
    ("bmaj_rad", true),
    ("bmin_rad", true),
    ("largest_scale_rad", false),
    ("psl_within_db", true),
    ("rms_sidelobe_within", true),
    ("uv_fill", false),
    ("redundancy", true),
    ("unique_baselines", false),
    ("noise_ratio", true),
];
/// Place of the peak side lobe among the figures.
const PSL: usize = 3;
/// Place of the rms of the side lobes.
const RMS: usize = 4;

/// The figures of [`LOSS_FIGURES`], in their order.
pub type LossFigures = [f64; FIGURES];

/// The worst and the mean value of each figure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LossSummary {
    /// The worst value of each figure. Each may belong to another loss.
    pub worst: LossFigures,
    /// The mean of each figure over all losses. That of a figure in dB is the mean of the dB.
    pub mean: LossFigures,
    /// The antennas whose loss gives the highest side lobe; the second is the first again where one antenna is lost.
    pub worst_for_psl: [usize; 2],
}

/// What the loss of antennas costs.
#[derive(Debug, Clone, PartialEq)]
pub struct Losses {
    /// The figures of the full array.
    pub intact: LossFigures,
    /// Any one antenna lost.
    pub one: LossSummary,
    /// Any two antennas lost, if asked for.
    pub two: Option<LossSummary>,
    /// The antennas with the figures of the array without each: first the one whose loss raises the peak side lobe most, and of equal ones, the rms.
    pub ranking: Vec<(usize, LossFigures)>,
}

impl ArrayLayout {
    /// Figures at a frequency with natural weights, for one integration towards the zenith, with any one antenna lost, and any two if `pairs`. The
    /// side lobes are those within `reach`, the range of the full array. The u-v cells are those of [`crate::LayoutFigures`] at this
    /// `cell_m`. `sefd_jy` weighs the antennas in `noise_ratio`; equal ones without it.
    ///
    /// # Errors
    /// Fewer than three antennas (four for pairs), more than 3,000 (256 for pairs).
    pub(super) fn losses(&self, wavelength_m: f64, cell_m: f64, sefd_jy: Option<&[f64]>, reach: Reach, pairs: bool) -> Result<Losses> {
        let n = self.n_ant();
        let (least, most) = if pairs { (4, MOST_FOR_PAIRS) } else { (3, 3000) };
        ArrayError::need("lost", if pairs { 2 } else { 1 }, n >= least, format!("0: of {n} antennas none can be spared"))?;
        ArrayError::need("lost", 2, n <= most, format!("at most 1 for more than {most} antennas, here {n}"))?;
        let sums = Sums::new(self, wavelength_m, cell_m / wavelength_m, sefd_jy, reach)?;
        let intact = sums.figures(&sums.sums_without(None), &[]);
        let ranked = |lost: Vec<usize>, figures| (lost, figures);
        let single: Vec<_> = (0..n).into_par_iter().map(|i| ranked(vec![i], sums.figures(&sums.sums_without(Some(i)), &[i]))).collect();
        let two = pairs.then(|| {
            let of = |i: usize| {
                let field = sums.sums_without(Some(i));
                (i + 1..n).map(|j| ranked(vec![i, j], sums.figures(&field, &[i, j]))).collect::<Vec<_>>()
            };
            let all: Vec<_> = (0..n).into_par_iter().flat_map_iter(of).collect();
            summary(&all)
        });
        let mut ranking: Vec<(usize, LossFigures)> = single.iter().map(|(lost, f)| (lost[0], *f)).collect();
        ranking.sort_by(|(_, a), (_, b)| b[PSL].total_cmp(&a[PSL]).then(b[RMS].total_cmp(&a[RMS])));
        Ok(Losses { intact, one: summary(&single), two, ranking })
    }
}

fn summary(losses: &[(Vec<usize>, LossFigures)]) -> LossSummary {
    let column = |k: usize| losses.iter().map(move |(_, f)| f[k]);
    let mut worst = [0.0; FIGURES];
    let mut mean = [0.0; FIGURES];
    for (k, (_, larger)) in LOSS_FIGURES.iter().enumerate() {
        worst[k] = if *larger { column(k).fold(f64::NEG_INFINITY, f64::max) } else { column(k).fold(f64::INFINITY, f64::min) };
        mean[k] = column(k).sum::<f64>() / losses.len() as f64;
    }
    let highest = losses.iter().max_by(|a, b| a.1[PSL].total_cmp(&b.1[PSL])).map_or([0; 2], |(lost, _)| [lost[0], lost[lost.len() - 1]]);
    LossSummary { worst, mean, worst_for_psl: highest }
}

/// The sums of the full array, and each antenna's part of them.
struct Sums {
    xy: Vec<[f64; 2]>,
    field: Field,
    /// Phasors of each antenna along the columns and the rows of the field.
    along: Vec<Vec<Complex64>>,
    across: Vec<Vec<Complex64>>,
    /// Steps of the rays that are kept, and the phasors there.
    ray_steps: usize,
    on_rays: Vec<Vec<Complex64>>,
    /// Sum of the phasors of all antennas on the grid, and on the rays.
    total: Vec<Complex64>,
    ray_total: Vec<Complex64>,
    pairs: Pairs,
}

/// The grid and the rays after the first loss.
struct Reduced {
    grid: Vec<Complex64>,
    rays: Vec<Complex64>,
}

impl Sums {
    fn new(layout: &ArrayLayout, wavelength_m: f64, cell: f64, sefd_jy: Option<&[f64]>, reach: Reach) -> Result<Self> {
        let plane = Plane::new(layout, wavelength_m);
        let xy = plane.views.concat();
        let psf = Psf::natural(&xy);
        let field = reach.field(&Beam::fit(&psf))?;
        let edges = field.edges(|ray, step| {
            let [l, m] = field.on_ray(ray, step as f64 / RAY_STEPS);
            psf.at(l, m)
        });
        // A lost antenna widens the main lobe. Where it becomes wider than twice of what it was, its end is found by full sums.
        let ray_steps =
            ((2.0 * RAY_STEPS * edges.iter().map(|e| e.beams).fold(1.0, f64::max)) as usize + 4).min(field.ray_end).min(MOST_RAY_STEPS);
        let steps = |p: &[f64; 2], step: [f64; 2], from: i64| (from..=field.half).map(|k| phasor(*p, step, k)).collect::<Vec<_>>();
        let along: Vec<_> = xy.iter().map(|p| steps(p, field.step_x, -field.half)).collect();
        let across: Vec<_> = xy.iter().map(|p| steps(p, field.step_y, 0)).collect();
        let ray = |p: &[f64; 2]| {
            let at = |ray: usize, step: usize| {
                let [l, m] = field.on_ray(ray, step as f64 / RAY_STEPS);
                Complex64::cis(TAU * (p[0] * l + p[1] * m))
            };
            (0..RAYS).flat_map(|r| (1..=ray_steps).map(move |s| (r, s))).map(|(r, s)| at(r, s)).collect::<Vec<_>>()
        };
        let on_rays: Vec<Vec<Complex64>> = xy.par_iter().map(ray).collect();
        let mut total = vec![Complex64::ZERO; along[0].len() * across[0].len()];
        let mut ray_total = vec![Complex64::ZERO; RAYS * ray_steps];
        for a in 0..xy.len() {
            add(&mut total, &along[a], &across[a], 1.0);
            ray_total.iter_mut().zip(&on_rays[a]).for_each(|(t, p)| *t += p);
        }
        let pairs = Pairs::new(layout, &plane, wavelength_m, cell, sefd_jy);
        Ok(Self { xy, field, along, across, ray_steps, on_rays, total, ray_total, pairs })
    }

    fn sums_without(&self, lost: Option<usize>) -> Reduced {
        let (mut grid, mut rays) = (self.total.clone(), self.ray_total.clone());
        if let Some(a) = lost {
            add(&mut grid, &self.along[a], &self.across[a], -1.0);
            rays.iter_mut().zip(&self.on_rays[a]).for_each(|(t, p)| *t -= p);
        }
        Reduced { grid, rays }
    }

    /// Figures without the lost antennas, the first of which is already taken out of the sums.
    fn figures(&self, reduced: &Reduced, lost: &[usize]) -> LossFigures {
        let left: Vec<[f64; 2]> = (0..self.xy.len()).filter(|k| !lost.contains(k)).map(|k| self.xy[k]).collect();
        let n = left.len() as f64;
        let mean = [0, 1].map(|k| left.iter().map(|p| p[k]).sum::<f64>() / n);
        let psf = Psf::natural(&left.iter().map(|p| [p[0] - mean[0], p[1] - mean[1]]).collect::<Vec<_>>());
        let beam = |af: Complex64| (af.norm_sqr() - n) / (n * (n - 1.0));
        let second = lost.get(1).copied();
        let values: Vec<f64> = match second {
            None => reduced.grid.iter().map(|af| beam(*af)).collect(),
            Some(b) => {
                let rows = reduced.grid.chunks(self.along[b].len()).zip(&self.across[b]);
                rows.flat_map(|(row, y)| row.iter().zip(&self.along[b]).map(move |(af, x)| beam(af - x * y))).collect()
            }
        };
        let edges = self.field.edges(|ray, step| {
            let k = ray * self.ray_steps + step - 1;
            if step > self.ray_steps {
                let [l, m] = self.field.on_ray(ray, step as f64 / RAY_STEPS);
                return psf.at(l, m);
            }
            beam(reduced.rays[k] - second.map_or(Complex64::ZERO, |b| self.on_rays[b][k]))
        });
        let lobes = self.field.lobes(&values, &edges, |l, m| psf.curve(l, m));
        let main = Beam::fit(&psf);
        let counts = self.pairs.without(lost);
        [
            main.major_rad.min(PI),
            main.minor_rad.min(PI),
            1.0 / counts.shortest,
            10.0 * lobes.peak.log10(),
            lobes.rms,
            counts.uv_fill,
            n * (n - 1.0) / 2.0 / counts.different as f64,
            counts.different as f64,
            counts.noise_ratio,
        ]
    }
}

/// Add the phasors of an antenna to a grid, times a sign.
fn add(grid: &mut [Complex64], along: &[Complex64], across: &[Complex64], sign: f64) {
    for (row, y) in grid.chunks_mut(along.len()).zip(across) {
        let y = y * sign;
        row.iter_mut().zip(along).for_each(|(g, x)| *g += x * y);
    }
}

/// What is counted over pairs of antennas.
struct Pairs {
    antennas: usize,
    cell: f64,
    /// Group of each pair in the order of [`Plane::pairs`], and the number of pairs in each group.
    group: Vec<usize>,
    group_size: Vec<usize>,
    /// Cells of each pair, and the number of hits of each cell.
    cells: Vec<[usize; 2]>,
    hits: Vec<usize>,
    /// Pairs with their projected lengths in wavelengths, the shortest first.
    by_length: Vec<(f64, [usize; 2])>,
    inverse_sefd: Vec<f64>,
}

/// Counts without the lost antennas.
struct Counts {
    different: usize,
    uv_fill: f64,
    shortest: f64,
    noise_ratio: f64,
}

impl Pairs {
    fn new(layout: &ArrayLayout, plane: &Plane, wavelength_m: f64, cell: f64, sefd_jy: Option<&[f64]>) -> Self {
        let antennas = layout.n_ant();
        let counted = |numbers: &mut dyn Iterator<Item = usize>| {
            let mut counts = Vec::new();
            for k in numbers {
                counts.resize(counts.len().max(k + 1), 0);
                counts[k] += 1;
            }
            counts
        };
        let (group, cells) = (different_baselines(layout, wavelength_m / 10.0), uv_cells(plane, cell));
        let pairs = (0..antennas).flat_map(|i| (i + 1..antennas).map(move |j| [i, j]));
        let mut by_length: Vec<(f64, [usize; 2])> = plane.pairs().map(|[u, v]| u.hypot(v)).zip(pairs).collect();
        by_length.sort_by(|a, b| a.0.total_cmp(&b.0));
        Self {
            antennas,
            cell,
            group_size: counted(&mut group.iter().copied()),
            hits: counted(&mut cells.iter().flatten().copied()),
            group,
            cells,
            by_length,
            inverse_sefd: sefd_jy.map_or(vec![1.0; antennas], |s| s.iter().map(|v| 1.0 / v).collect()),
        }
    }

    /// Place of a pair in the order of [`Plane::pairs`].
    fn index(&self, i: usize, j: usize) -> usize {
        let (i, j) = (i.min(j), i.max(j));
        i * (2 * self.antennas - i - 1) / 2 + j - i - 1
    }

    fn without(&self, lost: &[usize]) -> Counts {
        let mut pairs: Vec<usize> =
            lost.iter().flat_map(|a| (0..self.antennas).filter(move |b| b != a).map(|b| self.index(*a, b))).collect();
        pairs.sort_unstable();
        pairs.dedup();
        let emptied = |numbers: &mut dyn Iterator<Item = usize>, counts: &[usize]| {
            let mut taken: HashMap<usize, usize> = HashMap::new();
            numbers.for_each(|k| *taken.entry(k).or_default() += 1);
            taken.iter().filter(|(k, n)| counts[**k] == **n).count()
        };
        let different = self.group_size.len() - emptied(&mut pairs.iter().map(|p| self.group[*p]), &self.group_size);
        let hit = self.hits.len() - emptied(&mut pairs.iter().flat_map(|p| self.cells[*p]), &self.hits);
        let remains = |(_, pair): &&(f64, [usize; 2])| !lost.contains(&pair[0]) && !lost.contains(&pair[1]);
        let longest = self.by_length.iter().rev().find(remains).map_or(0.0, |p| p.0);
        // Pairs along the line of sight do not count, as in the figures of the full array.
        let shortest = self.by_length.iter().filter(|p| p.0 > 1e-9 * longest).find(remains).map_or(longest, |p| p.0);
        let kept: Vec<f64> = (0..self.antennas).filter(|a| !lost.contains(a)).map(|a| 1.0 / self.inverse_sefd[a]).collect();
        let all: Vec<f64> = self.inverse_sefd.iter().map(|v| 1.0 / v).collect();
        Counts {
            different,
            uv_fill: uv_fill(hit, longest, self.cell),
            shortest,
            noise_ratio: (sensitivity::pairs(&all) / sensitivity::pairs(&kept)).sqrt(),
        }
    }
}
