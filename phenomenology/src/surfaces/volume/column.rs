//! A stack of layers, some of which scatter: emission of each layer and reflection, at every stream in the air.
//!
//! Layers and interfaces are put on each other from the bottom up. `R` is the reflection of all that lies below, and column `k` of `E` its
//! emission where layer `k` has 1 K and all else 0 K. A layer with reflection `r`, transmission `t` and emission `e` on top gives
//! `U = (1 - R r)^-1 [R (t I + e) + E]` for the radiance upward at its lower face, and `r I + t U + e` at its upper one. An interface
//! is such a layer with its Fresnel powers. Radiances are those over the square of the index, which an interface does not change.

use super::matrix::Matrix;
use super::scatterer::Scatterer;
use super::slab::Slab;
use super::streams::{StreamOptions, Streams};
use crate::surfaces::fresnel::{AIR, interface, normal_wavenumber};
use crate::surfaces::layer::Layer;
use num_complex::Complex64;

/// What lies below some level.
#[derive(Debug, Clone)]
pub(super) struct Below {
    /// Reflection. // [stream pol, stream pol]
    pub reflect: Matrix,
    /// Share of each layer in the emission. // [stream pol, layer]
    pub emit: Matrix,
}

/// The index of refraction that turns rays.
pub(super) fn index(eps: Complex64) -> f64 {
    eps.sqrt().re.abs()
}

/// Fresnel powers `[h, v]` of an interface for the invariant of a stream.
pub(super) fn interface_powers(eps1: Complex64, eps2: Complex64, invariant: f64) -> [f64; 2] {
    let s2 = invariant * invariant;
    interface(eps1, normal_wavenumber(eps1, s2), eps2, normal_wavenumber(eps2, s2)).map(|r| r.norm_sqr().min(1.0))
}

/// Share of power that a layer without scattering keeps, on one way.
pub(super) fn kept(layer: &Layer, k0: f64, invariant: f64) -> f64 {
    (2.0 * k0 * normal_wavenumber(layer.eps, invariant * invariant).im * layer.thickness_m).exp()
}

/// The streams of a stack, the slabs of its layers, and what the air sees of it.
#[derive(Debug)]
pub(super) struct Column {
    pub streams: Streams,
    /// Mean extinction of the layers that scatter, 1/m.
    pub extinction_per_m: Vec<Option<f64>>,
    pub seen: Below,
}

impl Column {
    /// A stack: layers from the top, the last infinite, and what scatters in each.
    pub(super) fn new(layers: &[Layer], scatterers: &[Option<Scatterer>], k0: f64, options: StreamOptions) -> Self {
        let last = layers.len() - 1;
        // The streams of a half-space at the bottom matter only if it scatters.
        let inside = |i: usize| i < last || scatterers[i].is_some();
        let indices: Vec<f64> = (0..=last).filter(|i| inside(*i)).map(|i| index(layers[i].eps)).collect();
        let streams = Streams::new(&indices, options);
        let mut extinction_per_m = vec![None; layers.len()];
        let mut below: Option<Below> = None;
        for (i, (layer, scatterer)) in layers.iter().zip(scatterers).enumerate().rev() {
            if inside(i) {
                let own = streams.of(index(layer.eps));
                let slab = match scatterer {
                    Some(s) => Slab::scattering(s, &own, layer.thickness_m),
                    None => Slab::absorbing(
                        &streams.invariants[..own.mu.len()].iter().flat_map(|s| [kept(layer, k0, *s); 2]).collect::<Vec<_>>(),
                    ),
                };
                extinction_per_m[i] = scatterer.as_ref().map(|_| slab.extinction_per_m);
                below = Some(match below {
                    None => half_space(&slab, i, layers.len()),
                    Some(b) => b.under_slab(&slab, i),
                });
            }
            let above = if i == 0 { AIR } else { layers[i - 1].eps };
            let count = if i == 0 { streams.air } else { streams.count(index(above)) };
            let powers: Vec<f64> = streams.invariants.iter().flat_map(|s| interface_powers(above, layer.eps, *s)).collect();
            below = Some(match below {
                None => bare(&powers[..2 * count], i, layers.len()),
                Some(b) => b.under_interface(&powers, count),
            });
        }
        let seen = below.unwrap_or_else(|| Below { reflect: Matrix::zeros(0, 0), emit: Matrix::zeros(0, 0) });
        Self { streams, extinction_per_m, seen }
    }
}

/// A half-space without scattering, seen through its surface.
fn bare(powers: &[f64], layer: usize, layers: usize) -> Below {
    let mut emit = Matrix::zeros(powers.len(), layers);
    for (i, r) in powers.iter().enumerate() {
        emit[(i, layer)] = 1.0 - r;
    }
    Below { reflect: Matrix::diagonal(powers), emit }
}

/// A half-space that scatters, seen from inside. What it does not reflect, it emits.
fn half_space(slab: &Slab, layer: usize, layers: usize) -> Below {
    let mut emit = Matrix::zeros(slab.reflect.rows(), layers);
    for (i, r) in slab.reflect.row_sums().iter().enumerate() {
        emit[(i, layer)] = (1.0 - r).max(0.0);
    }
    Below { reflect: slab.reflect.clone(), emit }
}

impl Below {
    fn under_slab(self, slab: &Slab, layer: usize) -> Self {
        let n = self.reflect.rows();
        let e = slab.emissivity();
        let mut own = Matrix::zeros(n, self.emit.columns());
        for (i, e) in e.iter().enumerate() {
            own[(i, layer)] = *e;
        }
        let round = Matrix::identity(n) - &(&self.reflect * &slab.reflect);
        let right = beside(&(&self.reflect * &slab.transmit), &((&self.reflect * &own) + &self.emit));
        let up = &slab.transmit * &round.solve(right);
        let (lit, emitted) = apart(&up, n);
        Self { reflect: slab.reflect.clone() + &lit, emit: own + &emitted }
    }

    /// Adds an interface to a medium with `count` streams. `powers` are its reflectivities, for all streams of the stack.
    fn under_interface(self, powers: &[f64], count: usize) -> Self {
        let own = self.reflect.rows();
        let common = own.min(2 * count);
        // Streams that the medium above has not are reflected as a whole, and so are those that only it has.
        let power = |i: usize| if i < common { powers[i] } else { 1.0 };
        let r: Vec<f64> = (0..own).map(power).collect();
        let t: Vec<f64> = r.iter().map(|r| 1.0 - r).collect();
        let round = Matrix::identity(own) - &self.reflect.clone().scale_columns(&r);
        let lit = self.reflect.scale_columns(&t).resized(own, common);
        let up = round.solve(beside(&lit, &self.emit)).scale_rows(&t);
        let (lit, emit) = apart(&up, common);
        let mut reflect = lit.resized(2 * count, 2 * count);
        for i in 0..2 * count {
            reflect[(i, i)] += power(i);
        }
        Self { reflect, emit: emit.resized(common, emit.columns()).resized(2 * count, emit.columns()) }
    }
}

/// Two matrices of equal height, beside each other.
fn beside(a: &Matrix, b: &Matrix) -> Matrix {
    let mut out = a.resized(a.rows(), a.columns() + b.columns());
    for i in 0..b.rows() {
        for j in 0..b.columns() {
            out[(i, a.columns() + j)] = b[(i, j)];
        }
    }
    out
}

/// The first `columns` columns and the rest.
fn apart(m: &Matrix, columns: usize) -> (Matrix, Matrix) {
    let mut rest = Matrix::zeros(m.rows(), m.columns() - columns);
    for i in 0..m.rows() {
        for j in columns..m.columns() {
            rest[(i, j - columns)] = m[(i, j)];
        }
    }
    (m.resized(m.rows(), columns), rest)
}
