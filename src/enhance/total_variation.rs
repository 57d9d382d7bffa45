//! Total variation: the model of Rudin, Osher and Fatemi.

use super::border::{line, sum_of_rows};
use super::step::{Given, Step};
use crate::Result;
use ndarray::{Array2, ArrayView2};
use rayon::prelude::*;

/// The search ends where the rms distance from the minimum is at most this part of the weight, as the gap of duality proves.
const CLOSE: f64 = 0.01;
/// The gap is computed after so many iterations.
const LOOKS: usize = 10;

#[derive(Debug)]
struct TotalVariation {
    weight: f64,
    iterations: usize,
}

impl Step for TotalVariation {
    fn apply(&self, frame: Array2<f64>) -> Result<Array2<f64>> {
        Ok(total_variation(frame.view(), self.weight, self.iterations, CLOSE * self.weight).0)
    }
}

pub(super) fn make(given: &Given<'_>) -> Result<Box<dyn Step>> {
    Ok(Box::new(TotalVariation { weight: given.number(0), iterations: given.whole(1) }))
}

/// The image u that minimises sum |grad u| + sum (u - f)^2 / (2 weight), with forward differences that are 0 across the border, and a bound of its
/// rms distance from the true minimum. The search ends at `iterations`, or where that bound is at most `close`. `weight` is in the unit of the
/// plane: edges lower than about twice the weight over their length in pixels vanish. The mean is kept.
///
/// # Reference
/// Rudin, Osher & Fatemi 1992, Physica D 60, 259; the dual of Chambolle 2004, J. Math. Imaging Vis. 20, 89, in the accelerated projection
/// of Beck & Teboulle 2009, IEEE Trans. Image Process. 18, 2419.
#[must_use]
pub fn total_variation(plane: ArrayView2<'_, f64>, weight: f64, iterations: usize, close: f64) -> (Array2<f64>, f64) {
    let f = plane.as_standard_layout().into_owned();
    let n_l = f.ncols();
    // Vectors of the dual [m, component, l]: `p` of this iteration, `ahead` of it.
    let mut dual: Vec<Dual> = vec![Dual { p: vec![0.0; 2 * n_l], ahead: vec![0.0; 2 * n_l] }; f.nrows()];
    let mut u = f.clone();
    let (mut t, mut bound) = (1.0_f64, f64::INFINITY);
    for k in 1..=iterations {
        primal(&mut u, &f, &dual, weight, |row| &row.ahead);
        let further = 0.5 * (1.0 + (1.0 + 4.0 * t * t).sqrt());
        project(&mut dual, &u, 1.0 / (8.0 * weight), (t - 1.0) / further);
        t = further;
        if k % LOOKS == 0 || k == iterations {
            primal(&mut u, &f, &dual, weight, |row| &row.p);
            // The objective times the weight is strongly convex with modulus 1, so half of the squared distance is at most the gap.
            bound = (2.0 * weight * gap(&dual, &u).max(0.0) / f.len() as f64).sqrt();
            if bound <= close {
                break;
            }
        }
    }
    primal(&mut u, &f, &dual, weight, |row| &row.p);
    (u, bound)
}

/// One row of the dual: the components along m, then those along l.
#[derive(Clone)]
struct Dual {
    p: Vec<f64>,
    ahead: Vec<f64>,
}

/// The image of a dual: f plus the weight times its divergence.
fn primal(u: &mut Array2<f64>, f: &Array2<f64>, dual: &[Dual], weight: f64, of: impl Fn(&Dual) -> &[f64] + Sync) {
    let n_l = f.ncols();
    let Some(all) = u.as_slice_mut() else { return };
    all.par_chunks_mut(n_l).enumerate().for_each(|(r, out)| {
        let (down, across) = of(&dual[r]).split_at(n_l);
        let f = line(f, r);
        out[0] = f[0] + weight * (down[0] + across[0]);
        for c in 1..n_l {
            out[c] = f[c] + weight * (down[c] + across[c] - across[c - 1]);
        }
        if r > 0 {
            out.iter_mut().zip(of(&dual[r - 1])).for_each(|(o, above)| *o -= weight * above);
        }
    });
}

/// A step along the gradient of u from the point ahead, shortened to vectors of length 1, and the next point ahead.
fn project(dual: &mut [Dual], u: &Array2<f64>, step: f64, momentum: f64) {
    let (n_m, n_l) = u.dim();
    dual.par_iter_mut().enumerate().for_each(|(r, row)| {
        let (own, below) = (line(u, r), line(u, (r + 1).min(n_m - 1)));
        let (p_down, p_across) = row.p.split_at_mut(n_l);
        let (a_down, a_across) = row.ahead.split_at_mut(n_l);
        for c in 0..n_l {
            let beside = if c + 1 < n_l { own[c + 1] } else { own[c] };
            let (a, b) = (a_down[c] + step * (below[c] - own[c]), a_across[c] + step * (beside - own[c]));
            let shorter = 1.0 / (a * a + b * b).sqrt().max(1.0);
            let (a, b) = (a * shorter, b * shorter);
            (a_down[c], a_across[c]) = (a + momentum * (a - p_down[c]), b + momentum * (b - p_across[c]));
            (p_down[c], p_across[c]) = (a, b);
        }
    });
}

/// The gap between the objectives of u and of its dual, over the weight.
fn gap(dual: &[Dual], u: &Array2<f64>) -> f64 {
    let (n_m, n_l) = u.dim();
    sum_of_rows(n_m, |r| {
        let (own, below) = (line(u, r), line(u, (r + 1).min(n_m - 1)));
        let of_pixel = |c: usize| {
            let (down, across) = (below[c] - own[c], own[(c + 1).min(n_l - 1)] - own[c]);
            down.hypot(across) - dual[r].p[c] * down - dual[r].p[n_l + c] * across
        };
        (0..n_l).map(of_pixel).sum()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::enhance::samples::{noise, rms};

    #[test]
    fn a_step_loses_height_as_its_closed_form_says() {
        // In one dimension, a step between plateaus of n pixels moves each plateau by weight / n.
        let plane = Array2::from_shape_fn((6, 40), |(_, c)| if c < 16 { 280.0 } else { 290.0 });
        let (out, bound) = total_variation(plane.view(), 8.0, 20_000, 1e-9);
        assert!(bound <= 1e-9);
        let (left, right) = (280.0 + 8.0 / 16.0, 290.0 - 8.0 / 24.0);
        assert!(out.indexed_iter().all(|((_, c), v)| (v - if c < 16 { left } else { right }).abs() < 1e-6));
    }

    #[test]
    fn the_bound_of_the_distance_holds_and_the_mean_is_kept() {
        let plane = noise(40, 33, 6).mapv(|v| 280.0 + v) + Array2::from_shape_fn((40, 33), |(r, _)| if r < 15 { 0.0 } else { 8.0 });
        let (best, _) = total_variation(plane.view(), 1.0, 20_000, 1e-8);
        for iterations in [10, 30, 100] {
            let (out, bound) = total_variation(plane.view(), 1.0, iterations, 0.0);
            let distance = rms(&out - &best);
            assert!(distance <= bound && bound < 1.0, "{iterations}: {distance} {bound}");
            assert!((out.mean().unwrap() - plane.mean().unwrap()).abs() < 1e-9);
        }
    }
}
