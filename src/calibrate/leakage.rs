//! Leakages between the feeds and the phase between them, solved against a polarised model.
//!
//! The data are V = F D1 M D2^H F^H with the model M of the four products as perfect feeds would have measured them (turning with their mounts), D =
//! \[\[1, d\], \[d', 1\]\] for each antenna and F = diag(exp(i phi), 1) for the whole array. Gauss-Newton steps minimise the weighted squares of the
//! residuals of all four products. A direction of the parameters that the data do not determine is found as a small singular value of the normal
//! matrix: no step goes along it, so that it stays at 0, and it is named.
//!
//! # Reference
//! Sault, Hamaker & Bregman 1996, A&AS 117, 149 (degeneracies of polarimetric calibration); Smirnov 2011, A&A 527, A106.

use super::model::ModelVisibilities;
use crate::linalg::{Matrix, singular_values};
use crate::memory::MemoryBudget;
use crate::progress::{Event, Observer};
use crate::{ChainError, Result, ensure};
use cittert_arrays::feeds::{FourProducts, Jones, adjoint, leakage_matrix, times};
use cittert_arrays::{GainTable, VisibilityBlock, VisibilityHeader, VisibilitySource, for_each_block};
use ndarray::{Array3, Array4, s};
use num_complex::{Complex, Complex64};
use serde::{Deserialize, Serialize};

/// What is solved for beside the gains.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum, schemars::JsonSchema))]
pub enum FeedTerm {
    /// The part of the field of the other feed that each feed receives.
    Leakage,
    /// The phase between the two feeds, the same at all antennas.
    CrossPhase,
}

/// Leakages and the phase between the feeds.
#[derive(Debug, Clone, PartialEq)]
pub struct LeakageSolution {
    /// Leakage of each feed \[ant\]\[feed\].
    pub leakages: Vec<[Complex64; 2]>,
    /// Standard deviation of its real and of its imaginary part by the weights \[ant\]\[feed\]; infinite for antennas without data.
    pub sigma: Vec<[[f64; 2]; 2]>,
    /// Phase of the first feed less that of the second, rad.
    pub cross_phase_rad: f64,
    /// Its standard deviation by the weights; 0 if it was not solved.
    pub cross_sigma_rad: f64,
    /// Directions that the data do not determine, in words.
    pub undetermined: Vec<String>,
    /// chi^2 by the weights over its degrees of freedom.
    pub reduced_chi2: f64,
    /// Gauss-Newton steps.
    pub iterations: usize,
}

/// Most steps. Leakages of a tenth need five.
const MOST_STEPS: usize = 30;
/// The steps end when no parameter changes by more.
const SETTLED: f64 = 1e-9;
/// A direction is not determined if its standard deviation is larger than this.
const LARGEST_SIGMA: f64 = 1.0;
/// Or if its singular value is smaller than the largest by this factor.
const SMALLEST_RATIO: f64 = 1e-9;
/// Parameters of a baseline: real and imaginary parts of the leakages of two antennas, and the phase.
const OWN: usize = 9;

/// The parameters: for each antenna real and imaginary part of both leakages, then the phase.
struct Parameters {
    leakages: Vec<[Complex64; 2]>,
    phase: f64,
}

/// Sums of one pass over the data.
struct Sums {
    normal: Matrix,
    slope: Vec<f64>,
    chi2: f64,
    /// Real data.
    data: u64,
}

/// Solve leakages, the phase between the feeds, or both, against a model, in data that are calibrated in gain.
///
/// # Errors
/// The set lacks one of the four products, nothing is usable, the steps do not settle, or an error of source or model.
pub fn solve_leakages(
    source: &mut dyn VisibilitySource,
    model: &mut dyn ModelVisibilities,
    terms: &[FeedTerm],
    observer: &dyn Observer,
) -> Result<LeakageSolution> {
    let header = source.header().clone();
    let four = FourProducts::of(&header.polarizations).ok_or_else(|| {
        ChainError::Incompatible("leakages and the phase between feeds need the four products of two feeds, such as RR,RL,LR,LL".into())
    })?;
    let n_ant = header.layout.n_ant();
    let n = 4 * n_ant + 1;
    let mut now = Parameters { leakages: vec![[Complex64::ZERO; 2]; n_ant], phase: 0.0 };
    let solved: Vec<usize> =
        (0..n).filter(|k| terms.contains(if *k == n - 1 { &FeedTerm::CrossPhase } else { &FeedTerm::Leakage })).collect();
    observer.event(Event::Phase { name: "leakages", total: None, unit: "steps" });
    if terms.contains(&FeedTerm::CrossPhase) {
        now.phase = first_phase(source, model, (&header, &four), observer)?;
    }
    let mut iterations = 0;
    let (sums, modes, used) = loop {
        let sums = pass(source, model, (&header, &four), &now, observer)?;
        ensure!(sums.data > 0, ChainError::NoData("no row has four usable products and a model: leakages cannot be solved".into()));
        // Antennas without data have no part.
        let used: Vec<usize> = solved.iter().copied().filter(|k| sums.normal[(*k, *k)] > 0.0).collect();
        ensure!(!used.is_empty(), ChainError::NoData("the model is zero where the data are usable: leakages cannot be solved".into()));
        let modes = Modes::of(&sums.normal, &used);
        let step = modes.step(&used.iter().map(|k| sums.slope[*k]).collect::<Vec<_>>());
        let largest = step.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        for (k, x) in used.iter().zip(&step) {
            match (k / 4, k % 4) {
                _ if *k == n - 1 => now.phase += x,
                (ant, part) => now.leakages[ant][part / 2] += if part % 2 == 0 { Complex::new(*x, 0.0) } else { Complex::new(0.0, *x) },
            }
        }
        iterations += 1;
        observer.event(Event::Advance(1));
        ensure!(largest.is_finite() && iterations < MOST_STEPS, {
            ChainError::NoData(format!("leakages did not settle in {MOST_STEPS} steps: calibrate the gains first, or give a better model"))
        });
        if largest < SETTLED {
            break (sums, modes, used);
        }
    };
    observer.event(Event::Done);
    let variance = modes.variances();
    let mut sigma = vec![[[if terms.contains(&FeedTerm::Leakage) { f64::INFINITY } else { 0.0 }; 2]; 2]; n_ant];
    let mut cross_sigma_rad = 0.0;
    for (k, v) in used.iter().zip(&variance) {
        if *k == n - 1 {
            cross_sigma_rad = v.sqrt();
        } else {
            sigma[k / 4][k % 4 / 2][k % 2] = v.sqrt();
        }
    }
    let freedom = sums.data as f64 - modes.determined() as f64;
    Ok(LeakageSolution {
        leakages: now.leakages,
        sigma,
        cross_phase_rad: (now.phase + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI,
        cross_sigma_rad,
        undetermined: modes.names(&used, n),
        reduced_chi2: sums.chi2 / freedom.max(1.0),
        iterations,
    })
}

impl LeakageSolution {
    /// Put the solution into a table of the gains of the same array.
    ///
    /// # Errors
    /// A table of gains of Stokes parameters, whose feeds are not known.
    pub fn put_into(&self, table: &GainTable) -> Result<GainTable> {
        let mut out = table.with_each_feed();
        ensure!(out.feeds.len() == 2, ChainError::Incompatible("leakages need a table with the gains of two feeds".into()));
        let turn = Complex64::cis(self.cross_phase_rad);
        out.gains.slice_mut(s![.., .., .., 0]).mapv_inplace(|g| g * turn);
        out.leakages = Some(Array4::from_shape_fn(out.gains.dim(), |(_, ant, _, feed)| self.leakages[ant][feed]));
        Ok(out)
    }
}

/// Work on every usable sample of the four products: the antennas, data, model and weights.
fn for_each_sample(
    source: &mut dyn VisibilitySource,
    model: &mut dyn ModelVisibilities,
    (header, four): (&VisibilityHeader, &FourProducts),
    observer: &dyn Observer,
    mut work: impl FnMut([usize; 2], &Jones, &Jones, [[f64; 2]; 2]),
) -> Result<()> {
    for_each_block(source, MemoryBudget::default().block(), |first, block: VisibilityBlock| {
        ensure!(!observer.cancelled(), ChainError::Cancelled);
        let predicted: Array3<Complex<f32>> = model.predict(header, first, &block.coverage)?;
        for row in 0..block.n_rows() {
            let ants = [block.coverage.ant1[row] as usize, block.coverage.ant2[row] as usize];
            if ants[0] == ants[1] {
                continue;
            }
            for chan in 0..block.vis.dim().1 {
                let weights = four.0.map(|feeds| feeds.map(|p| f64::from(block.usable_weight(row, chan, p))));
                let m = four.get(&predicted, (row, chan));
                if weights.iter().flatten().all(|w| *w > 0.0) && m.iter().flatten().all(|v| v.is_finite()) {
                    work(ants, &four.get(&block.vis, (row, chan)), &m, weights);
                }
            }
        }
        Ok(())
    })
}

/// The phase between the feeds that fits the cross hands best without leakages.
fn first_phase(
    source: &mut dyn VisibilitySource,
    model: &mut dyn ModelVisibilities,
    of: (&VisibilityHeader, &FourProducts),
    observer: &dyn Observer,
) -> Result<f64> {
    let mut sum = Complex64::ZERO;
    for_each_sample(source, model, of, observer, |_, v, m, w| {
        sum += v[0][1] * m[0][1].conj() * w[0][1] + (v[1][0] * m[1][0].conj()).conj() * w[1][0];
    })?;
    Ok(if sum == Complex64::ZERO { 0.0 } else { sum.arg() })
}

/// Residuals and their derivatives at the present parameters.
fn pass(
    source: &mut dyn VisibilitySource,
    model: &mut dyn ModelVisibilities,
    of: (&VisibilityHeader, &FourProducts),
    now: &Parameters,
    observer: &dyn Observer,
) -> Result<Sums> {
    let n_ant = now.leakages.len();
    let n = 4 * n_ant + 1;
    let mut sums = Sums { normal: Matrix::zeros(n, n), slope: vec![0.0; n], chi2: 0.0, data: 0 };
    let one = Complex64::new(1.0, 0.0);
    let i = Complex64::i();
    let turn = [Complex64::cis(now.phase), one];
    let turned = |m: Jones| [0, 1].map(|j| [0, 1].map(|k| m[j][k] * turn[j] * turn[k].conj()));
    let unit = |j: usize, k: usize| {
        let mut e = [[Complex64::ZERO; 2]; 2];
        e[j][k] = one;
        e
    };
    for_each_sample(source, model, of, observer, |ants, v, m, w| {
        let [first, second] = ants.map(|a| leakage_matrix(now.leakages[a]));
        let behind = times(m, &adjoint(&second));
        let before = times(&first, m);
        let predicted = turned(times(&first, &behind));
        // Leakage of feed 0 is the element 01 of D, that of feed 1 the element 10; of antenna 2 it enters conjugated and transposed.
        let of_first = [(0, 1), (1, 0)].map(|(j, k)| turned(times(&unit(j, k), &behind)));
        let of_second = [(0, 1), (1, 0)].map(|(j, k)| turned(times(&before, &unit(k, j))));
        let places: [usize; OWN] = std::array::from_fn(|p| if p == OWN - 1 { n - 1 } else { 4 * ants[p / 4] + p % 4 });
        for j in 0..2 {
            for k in 0..2 {
                let derivatives: [Complex64; OWN] = std::array::from_fn(|p| match (p / 4, p % 4 / 2, p % 2) {
                    (0, feed, 0) => of_first[feed][j][k],
                    (0, feed, _) => i * of_first[feed][j][k],
                    (1, feed, 0) => of_second[feed][j][k],
                    (1, feed, _) => -i * of_second[feed][j][k],
                    // The phase turns the cross hands alone.
                    _ => i * predicted[j][k] * (k as f64 - j as f64),
                });
                let left = v[j][k] - predicted[j][k];
                sums.chi2 += w[j][k] * left.norm_sqr();
                sums.data += 2;
                for (a, da) in derivatives.iter().enumerate() {
                    sums.slope[places[a]] += w[j][k] * (da.re * left.re + da.im * left.im);
                    for (b, db) in derivatives.iter().enumerate() {
                        sums.normal[(places[a], places[b])] += w[j][k] * (da.re * db.re + da.im * db.im);
                    }
                }
            }
        }
    })?;
    Ok(sums)
}

/// The normal matrix by its singular values, of which small ones are directions that the data do not determine.
struct Modes {
    values: Vec<f64>,
    vectors: Matrix,
    keep: Vec<bool>,
}

impl Modes {
    fn of(normal: &Matrix, used: &[usize]) -> Self {
        let mut part = Matrix::zeros(used.len(), used.len());
        for (r, k) in used.iter().enumerate() {
            for (c, l) in used.iter().enumerate() {
                part[(r, c)] = normal[(*k, *l)];
            }
        }
        let (values, vectors) = singular_values(part);
        let largest = values.first().copied().unwrap_or(0.0);
        let keep = values.iter().map(|v| *v > SMALLEST_RATIO * largest && *v * LARGEST_SIGMA * LARGEST_SIGMA > 1.0).collect();
        Self { values, vectors, keep }
    }

    fn determined(&self) -> usize {
        self.keep.iter().filter(|k| **k).count()
    }

    fn kept(&self) -> impl Iterator<Item = (f64, &[f64])> {
        (0..self.values.len()).filter(|k| self.keep[*k]).map(|k| (self.values[k], self.vectors.row(k)))
    }

    fn step(&self, slope: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; slope.len()];
        for (value, vector) in self.kept() {
            let along = vector.iter().zip(slope).map(|(a, b)| a * b).sum::<f64>() / value;
            out.iter_mut().zip(vector).for_each(|(x, v)| *x += along * v);
        }
        out
    }

    fn variances(&self) -> Vec<f64> {
        let mut out = vec![0.0; self.values.len()];
        for (value, vector) in self.kept() {
            out.iter_mut().zip(vector).for_each(|(x, v)| *x += v * v / value);
        }
        out
    }

    /// What the directions are that are not determined.
    fn names(&self, used: &[usize], n: usize) -> Vec<String> {
        let mut out = Vec::new();
        for mode in (0..self.values.len()).filter(|k| !self.keep[*k]) {
            let vector = self.vectors.row(mode);
            let part = |weight: &dyn Fn(usize) -> f64| {
                let (mut dot, mut size) = (0.0, 0.0);
                for (k, v) in used.iter().zip(vector) {
                    dot += weight(*k) * v;
                    size += weight(*k).powi(2);
                }
                if size > 0.0 { dot * dot / size } else { 0.0 }
            };
            let phase = part(&|k| f64::from(u8::from(k == n - 1)));
            // d of the first feed grows by c and that of the second falls by its conjugate.
            let real = part(&|k| if k == n - 1 { 0.0 } else { [1.0, 0.0, -1.0, 0.0][k % 4] });
            let imaginary = part(&|k| if k == n - 1 { 0.0 } else { [0.0, 1.0, 0.0, 1.0][k % 4] });
            out.push(if phase > 0.99 {
                "the phase between the feeds: the model has too little in the cross hands".into()
            } else if real + imaginary > 0.99 {
                "a sum of the leakages (a constant added to those of the first feeds, its conjugate taken from those of the second): an unpolarised source does not tell it".into()
            } else if phase > 1e-3 {
                "the phase between the feeds together with leakages: feeds that do not turn on a polarised source do not tell them apart".into()
            } else {
                "a combination of leakages".into()
            });
        }
        out.sort();
        out.dedup();
        out
    }
}
