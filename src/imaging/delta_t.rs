//! The noise of a dirty image over its field, predicted.
//!
//! A pixel of a dirty image is S / sum(W), with S the sum of W_pq Re(V_pq exp(-i phi_pq)) over the baselines and the imaging weights W.
//!
//! Noise that is independent from baseline to baseline, as the weights state it, has the variance sum(W^2 sigma^2) everywhere. But the
//! fields of the antennas hold the scene too, and baselines share it. S is then a quadratic form of these fields, and for M samples of Gaussian fields
//! with the covariance C (receivers and scene)
//!
//! ```text
//! var S = tr(W C' W C') / 4 M,   C'_pq = C_pq exp(-i phi_pq),
//! ```
//!
//! which follows the brightness over the field. The autocorrelations of a set with total power are the diagonal of C, so that such a set
//! holds all of C.
//!
//! # Reference
//! Isserlis 1918, Biometrika 12, 134; Kulkarni 1989, AJ 98, 1112 (self-noise of images).

use super::imager::Imager;
use super::output::Kind;
use super::products::{Integration, Products};
use super::weighed_rows::WeighedRows;
use crate::progress::{Event, Observer};
use crate::{ChainError, Result, ensure};
use cittert_arrays::{Image, RestoringBeam, SPEED_OF_LIGHT_M_S, SkyGrid};
use ndarray::{Array1, Array2};
use num_complex::Complex64;
use rayon::prelude::*;
use std::ops::Range;

/// Complex products that a map may cost; beyond it is computed on a lattice of pixels, and linear between them.
const COST: f64 = 2e10;
/// Weights are products of one number for each antenna if they agree with such products within this part.
const SEPARABLE: f64 = 1e-3;

/// A predicted map of noise.
#[derive(Debug, Clone)]
pub struct DeltaT {
    /// Standard deviation of the dirty image, in its unit.
    pub image: Image<f32>,
    /// True if it follows from the fields of the antennas, false if from the weights alone.
    pub of_fields: bool,
    /// Distance of the pixels for which it was computed.
    pub step: usize,
}

/// The standard deviation of the dirty image by noise. `products` are those of the same set.
///
/// # Errors
/// The source fails, or no Gaussian fits the beam of a set in K sr.
pub fn delta_t(imager: &mut Imager<'_>, products: &Products, beams: &[RestoringBeam], observer: &dyn Observer) -> Result<DeltaT> {
    let of_fields = products.are_of_fields();
    observer.event(Event::Note(if of_fields {
        "the noise of the image follows from the autocorrelations and the visibilities: the scene is a part of it"
    } else {
        "the noise of the image follows from the weights: it is the same over the field"
    }));
    let weights = imager.weighed_rows(observer)?;
    let ranges = imager.channels().to_vec();
    let grid = imager.grid().clone();
    let freq_hz = imager.header().spectrum.freq_hz().to_vec();
    let (mut planes, mut step) = (Vec::new(), 1);
    for (k, range) in ranges.into_iter().enumerate() {
        let sum = imager.sum_of_weights(k);
        let variance = if of_fields {
            let forms = forms(products, &weights, range, &freq_hz)?;
            let (plane, by) = over_the_field(&forms, &grid, observer)?;
            step = by;
            plane
        } else {
            Array2::from_elem((grid.n_m, grid.n_l), independent(products, &weights, range))
        };
        planes.push(variance.mapv(|v| if sum > 0.0 { (v.max(0.0).sqrt() / sum) as f32 } else { 0.0 }));
    }
    Ok(DeltaT { image: imager.image(planes, Kind::Residual, beams)?, of_fields, step })
}

/// The variance of S by the weights of the data.
fn independent(products: &Products, weights: &WeighedRows, range: Range<usize>) -> f64 {
    let of_row = |row: usize| -> f64 {
        range.clone().filter(|c| products.weight(row, *c) > 0.0).map(|c| weights.at(row, c).powi(2) / products.weight(row, c)).sum()
    };
    (0..products.ant1.len()).into_par_iter().map(of_row).collect::<Vec<f64>>().iter().sum()
}

/// The quadratic form of one integration and channel.
struct Form {
    /// Covariance of the fields \[antenna, antenna\].
    fields: Array2<Complex64>,
    weights: Weights,
    samples: f64,
    /// Place of each antenna, wavelengths.
    place: Vec<[f64; 3]>,
}

/// Imaging weights \[antenna, antenna\], 0 on the diagonal.
enum Weights {
    /// Products of one number for each antenna; with tr(D C D C) of its squares D.
    Separable(Array1<f64>, f64),
    Any(Array2<f64>),
}

impl Form {
    fn new(products: &Products, weights: &WeighedRows, i: &Integration, (chan, freq_hz): (usize, f64)) -> Self {
        let mut antennas: Vec<u32> = products.ant1[i.rows.clone()].iter().chain(&products.ant2[i.rows.clone()]).copied().collect();
        antennas.sort_unstable();
        antennas.dedup();
        let n = antennas.len();
        let index = |a: u32| antennas.partition_point(|x| *x < a);
        let (mut fields, mut all) = (Array2::<Complex64>::zeros((n, n)), Array2::<f64>::zeros((n, n)));
        let mut place = vec![[0.0; 3]; n];
        for row in i.rows.clone() {
            let (p, q, v) = (index(products.ant1[row]), index(products.ant2[row]), products.vis(row, chan));
            fields[(p, q)] = v;
            fields[(q, p)] = v.conj();
            if p == q {
                continue;
            }
            all[(p, q)] = weights.at(row, chan);
            all[(q, p)] = all[(p, q)];
            let uvw = products.uvw_m.row(row);
            // Places relative to the first antenna, from its baselines.
            for (from, to, sign) in [(p, q, 1.0), (q, p, -1.0)] {
                if from == 0 {
                    place[to] = [0, 1, 2].map(|k| sign * uvw[k] * freq_hz / SPEED_OF_LIGHT_M_S);
                }
            }
        }
        let samples = products.samples_per_s[chan] * i.length_s;
        let weights = match separated(&all) {
            Some(a) => {
                let at = |((p, q), c): ((usize, usize), &Complex64)| (a[p] * a[q]).powi(2) * c.norm_sqr();
                let diagonal = fields.indexed_iter().map(at).sum();
                Weights::Separable(a, diagonal)
            }
            None => Weights::Any(all),
        };
        Self { fields, weights, samples, place }
    }

    /// Complex products for one pixel.
    fn cost(&self) -> f64 {
        let n = self.place.len() as f64;
        match self.weights {
            Weights::Separable(..) => n * n,
            Weights::Any(_) => n * n * n,
        }
    }

    /// The variance of S at direction cosines.
    fn variance(&self, l: f64, m: f64) -> f64 {
        let depth = (1.0 - l * l - m * m).max(0.0).sqrt() - 1.0;
        let turn = |p: &[f64; 3]| Complex64::from_polar(1.0, -std::f64::consts::TAU * (p[0] * l + p[1] * m + p[2] * depth));
        let phase = Array1::from_iter(self.place.iter().map(turn));
        let trace = match &self.weights {
            Weights::Separable(a, diagonal) => {
                // W = a a^T - D: tr(W C' W C') = (a^T C' a)^2 - 2 a^T C' D C' a + tr(D C' D C').
                let steered = Array1::from_iter(a.iter().zip(&phase).map(|(a, z)| z * *a));
                let y = self.fields.dot(&steered);
                let whole: Complex64 = steered.iter().zip(&y).map(|(s, y)| s.conj() * y).sum();
                let middle: f64 = a.iter().zip(&y).map(|(a, y)| a * a * y.norm_sqr()).sum();
                whole.re * whole.re - 2.0 * middle + diagonal
            }
            Weights::Any(w) => {
                let turned = Array2::from_shape_fn(self.fields.dim(), |(p, q)| self.fields[(p, q)] * phase[p].conj() * phase[q]);
                let product = w.mapv(Complex64::from).dot(&turned);
                product.indexed_iter().map(|((p, q), v)| (v * product[(q, p)]).re).sum()
            }
        };
        trace / (4.0 * self.samples)
    }
}

/// Numbers a with W_pq = a_p a_q for p != q, if there are any.
fn separated(w: &Array2<f64>) -> Option<Array1<f64>> {
    let n = w.nrows();
    if n < 3 {
        return None;
    }
    let other = |p: usize| ((p + 1) % n, (p + 2) % n);
    let a = Array1::from_shape_fn(n, |p| {
        let (q, r) = other(p);
        (w[(p, q)] * w[(p, r)] / w[(q, r)]).sqrt()
    });
    let fits = w.indexed_iter().all(|((p, q), v)| p == q || (a[p] * a[q] - v).abs() <= SEPARABLE * v.abs());
    (fits && a.iter().all(|v| v.is_finite())).then_some(a)
}

fn forms(products: &Products, weights: &WeighedRows, range: Range<usize>, freq_hz: &[f64]) -> Result<Vec<Form>> {
    let of = |i: &Integration| -> Vec<Form> {
        range
            .clone()
            .filter(|c| i.rows.clone().any(|row| weights.at(row, *c) > 0.0))
            .map(|c| Form::new(products, weights, i, (c, freq_hz[c])))
            .collect()
    };
    let forms: Vec<Form> = products.integrations.iter().flat_map(of).collect();
    ensure!(!forms.is_empty(), ChainError::NoData("no visibility has a weight: the image has no noise to predict".into()));
    Ok(forms)
}

/// The variance of S at every pixel \[m, l\], and the distance of the pixels at which it was computed.
fn over_the_field(forms: &[Form], grid: &SkyGrid, observer: &dyn Observer) -> Result<(Array2<f64>, usize)> {
    let each: f64 = forms.iter().map(Form::cost).sum();
    let pixels = (grid.n_l * grid.n_m) as f64;
    let step = ((each * pixels / COST).sqrt().ceil() as usize).clamp(1, grid.n_l.min(grid.n_m).max(2) / 2);
    let line = |n: usize| -> Vec<usize> { (0..n).step_by(step).chain((!(n - 1).is_multiple_of(step)).then_some(n - 1)).collect() };
    let (rows, columns) = (line(grid.n_m), line(grid.n_l));
    observer.event(Event::Phase { name: "noise of the image", total: Some(rows.len() as u64), unit: "rows" });
    let mut lattice = Array2::zeros((rows.len(), columns.len()));
    for (k, row) in rows.iter().enumerate() {
        ensure!(!observer.cancelled(), ChainError::Cancelled);
        let at = |column: &usize| -> f64 {
            let (l, m) = (grid.l_at(*column as f64), grid.m_at(*row as f64));
            forms.iter().map(|f| f.variance(l, m)).sum()
        };
        let values: Vec<f64> = columns.par_iter().map(at).collect();
        lattice.row_mut(k).assign(&Array1::from_vec(values));
        observer.event(Event::Advance(1));
    }
    observer.event(Event::Done);
    if step == 1 {
        return Ok((lattice, 1));
    }
    let between = |lines: &[usize], x: usize| -> (usize, f64) {
        let k = lines.partition_point(|v| *v <= x).saturating_sub(1).min(lines.len().saturating_sub(2));
        (k, (x - lines[k]) as f64 / (lines[k + 1] - lines[k]) as f64)
    };
    let full = Array2::from_shape_fn((grid.n_m, grid.n_l), |(row, column)| {
        let ((i, y), (j, x)) = (between(&rows, row), between(&columns, column));
        let along = |i: usize| lattice[(i, j)] * (1.0 - x) + lattice[(i, j + 1)] * x;
        along(i) * (1.0 - y) + along(i + 1) * y
    });
    Ok((full, step))
}
