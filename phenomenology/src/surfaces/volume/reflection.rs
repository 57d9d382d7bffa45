//! Emission and reflection of a stack that scatters, at any angle in the air.

use super::column::{Column, index, interface_powers, kept};
use super::matrix::Matrix;
use super::scatterer::Scatterer;
use super::streams::StreamOptions;
use crate::surfaces::fresnel::{AIR, Reflection, interface, normal_wavenumber};
use crate::surfaces::layer::Layer;
use num_complex::Complex64;

/// A stack of layers of which at least one scatters, solved at one frequency.
///
/// The mirrored part is computed at any angle. The diffuse part and the emission are polynomials in the cosine through the streams in the
/// air, which are nodes of a Gauss rule. Emissivity and reflectivity add up to 1 at every angle.
#[derive(Debug, Clone, PartialEq)]
pub struct VolumeReflection {
    /// Cosines of the streams in the air.
    mu: Vec<f64>,
    /// Their barycentric weights.
    barycentric: Vec<f64>,
    /// Diffuse reflection of unpolarised radiation from each stream into each. // [stream pol, stream]
    diffuse: Matrix,
    /// Share of each layer in the emission. // [stream pol, layer]
    absorbed: Matrix,
    /// Layers, with the extinction of those that scatter, 1/m.
    layers: Vec<(Layer, Option<f64>)>,
    k0: f64,
}

/// Emission and reflection at one angle, `[h, v]`.
#[derive(Debug, Clone, PartialEq)]
pub struct VolumeBudget {
    /// Power reflected as by a mirror.
    pub mirrored: [f64; 2],
    /// Power reflected from all other directions of the sky.
    pub diffuse: [f64; 2],
    /// Weight of the temperature of each layer, from the top.
    pub absorbed: Vec<[f64; 2]>,
}

impl VolumeReflection {
    /// Solves a stack: layers from the top, the last infinite, with what scatters in each. `k0` is the wavenumber of free space, 1/m.
    #[must_use]
    pub fn new(layers: &[Layer], scatterers: &[Option<Scatterer>], k0: f64, options: StreamOptions) -> Self {
        let column = Column::new(layers, scatterers, k0, options);
        let streams = column.streams.of(1.0);
        let air = column.streams.air;
        let mu = streams.mu[..air].to_vec();
        let barycentric = (0..air)
            .map(|j| {
                let sign = if j % 2 == 0 { 1.0 } else { -1.0 };
                let x = 2.0 * mu[j] - 1.0;
                sign * ((1.0 - x * x) * streams.weight[j]).max(0.0).sqrt()
            })
            .collect();
        let layers: Vec<(Layer, Option<f64>)> = layers.iter().copied().zip(column.extinction_per_m).collect();
        let mut solved = Self { mu, barycentric, diffuse: Matrix::zeros(2 * air, air), absorbed: column.seen.emit, layers, k0 };
        for i in 0..2 * air {
            let mirrored = solved.mirrored(column.streams.invariants[i / 2]).0[i % 2];
            for j in 0..air {
                let both = column.seen.reflect[(i, 2 * j)] + column.seen.reflect[(i, 2 * j + 1)];
                solved.diffuse[(i, j)] = if i / 2 == j { both - mirrored } else { both };
            }
        }
        solved
    }

    /// Powers mirrored, and the mean of `r_v r_h*`, for an invariant.
    fn mirrored(&self, invariant: f64) -> ([f64; 2], Complex64) {
        let mut power = [0.0; 2];
        let mut cross = Complex64::new(0.0, 0.0);
        for n in (0..self.layers.len()).rev() {
            let (layer, extinction) = &self.layers[n];
            let above = if n == 0 { AIR } else { self.layers[n - 1].0.eps };
            let s2 = invariant * invariant;
            let r = interface(above, normal_wavenumber(above, s2), layer.eps, normal_wavenumber(layer.eps, s2));
            let one_way = match extinction {
                _ if layer.thickness_m.is_infinite() => 0.0,
                Some(k) => {
                    let sine = invariant / index(layer.eps);
                    if sine < 1.0 { (-k * layer.thickness_m / (1.0 - sine * sine).sqrt()).exp() } else { 0.0 }
                }
                None => kept(layer, self.k0, invariant),
            };
            let two_way = one_way * one_way;
            let g = interface_powers(above, layer.eps, invariant);
            for p in 0..2 {
                let back = power[p] * two_way;
                power[p] = g[p] + (1.0 - g[p]).powi(2) * back / (1.0 - g[p] * back).max(1e-300);
            }
            let c = r[1] * r[0].conj();
            let through = (1.0 - r[1] * r[1]) * (1.0 - r[0] * r[0]).conj();
            let back = cross * two_way;
            cross = c + through * back / (1.0 - c * back);
        }
        let largest = (power[0] * power[1]).sqrt();
        if cross.norm() > largest {
            cross *= largest / cross.norm();
        }
        (power, cross)
    }

    /// Weights of the streams at a cosine; they add up to 1.
    fn at(&self, cos: f64) -> Vec<f64> {
        if let Some(k) = self.mu.iter().position(|mu| (mu - cos).abs() < 1e-12) {
            return (0..self.mu.len()).map(|j| if j == k { 1.0 } else { 0.0 }).collect();
        }
        let terms: Vec<f64> = self.mu.iter().zip(&self.barycentric).map(|(mu, b)| b / (cos - mu)).collect();
        let sum: f64 = terms.iter().sum();
        terms.into_iter().map(|t| t / sum).collect()
    }

    /// Row `[stream]` or `[layer]` of a table at a cosine, by the weights of [`Self::at`].
    fn between(table: &Matrix, weights: &[f64], pol: usize) -> Vec<f64> {
        let mut out = vec![0.0; table.columns()];
        for (i, w) in weights.iter().enumerate() {
            for (o, v) in out.iter_mut().zip(table.row(2 * i + pol)) {
                *o += w * v;
            }
        }
        // A polynomial through positive values can dip below 0 next to grazing incidence.
        out.iter_mut().for_each(|v| *v = v.max(0.0));
        out
    }

    /// Mirrored and diffuse reflectivity, and the weights of the layers, at a cosine of incidence. All of them add up to 1.
    #[must_use]
    pub fn budget(&self, cos: f64) -> VolumeBudget {
        let (mirrored, _) = self.mirrored((1.0 - cos * cos).max(0.0).sqrt());
        let weights = self.at(cos);
        let mut out = VolumeBudget { mirrored, diffuse: [0.0; 2], absorbed: vec![[0.0; 2]; self.layers.len()] };
        for (p, mirrored) in mirrored.into_iter().enumerate() {
            let rest = 1.0 - mirrored;
            out.diffuse[p] = Self::between(&self.diffuse, &weights, p).iter().sum::<f64>().min(rest);
            let whole = rest - out.diffuse[p];
            let shares = Self::between(&self.absorbed, &weights, p);
            let sum: f64 = shares.iter().sum();
            let last = shares.len() - 1;
            for (k, share) in shares.iter().enumerate() {
                out.absorbed[k][p] = match sum > 0.0 {
                    true => whole * share / sum,
                    false if k == last => whole,
                    false => 0.0,
                };
            }
        }
        out
    }

    /// Brightness of the sky that is reflected diffusely, `[h, v]`, K. `sky` gives the brightness of an unpolarised sky against the zenith
    /// angle in radians, averaged over azimuth.
    #[must_use]
    pub fn diffuse_sky_k(&self, cos: f64, sky: &dyn Fn(f64) -> f64) -> [f64; 2] {
        let skies: Vec<f64> = self.mu.iter().map(|mu| sky(mu.acos())).collect();
        let weights = self.at(cos);
        let budget = self.budget(cos);
        [0, 1].map(|p| {
            let row = Self::between(&self.diffuse, &weights, p);
            let sum: f64 = row.iter().sum();
            let mean = row.iter().zip(&skies).map(|(w, t)| w * t).sum::<f64>();
            if sum > 0.0 { budget.diffuse[p] * (mean / sum) } else { 0.0 }
        })
    }

    /// Reflection at a cosine of incidence. The powers are those reflected into all directions. The amplitudes have the mirrored power and
    /// the phase of the top interface, and the cross term is that of the mirrored part, because diffuse radiation has none.
    #[must_use]
    pub fn reflection(&self, cos: f64) -> Reflection {
        let s2 = (1.0 - cos * cos).max(0.0);
        let budget = self.budget(cos);
        let top = self.layers[0].0.eps;
        let r = interface(AIR, normal_wavenumber(AIR, s2), top, normal_wavenumber(top, s2));
        let (mirrored, cross) = self.mirrored(s2.sqrt());
        let amplitude = |p: usize| {
            let size = r[p].norm();
            if size > 0.0 { r[p] * (mirrored[p].sqrt() / size) } else { Complex64::new(mirrored[p].sqrt(), 0.0) }
        };
        let power = [0, 1].map(|p| mirrored[p] + budget.diffuse[p]);
        Reflection { r_h: amplitude(0), r_v: amplitude(1), power_h: power[0], power_v: power[1], cross }
    }
}
