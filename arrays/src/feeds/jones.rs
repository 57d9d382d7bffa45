//! Matrices of feeds and products of Stokes parameters, in the conventions of this module.

use crate::Polarization;
use num_complex::Complex64;

/// A 2 x 2 matrix: the response \[feed\]\[component of the field\], or a coherency \[component\]\[component\].
pub type Jones = [[Complex64; 2]; 2];

const ZERO: Complex64 = Complex64::ZERO;

/// The product of two matrices.
#[must_use]
pub fn times(a: &Jones, b: &Jones) -> Jones {
    let mut out = [[ZERO; 2]; 2];
    for (i, row) in out.iter_mut().enumerate() {
        for (j, x) in row.iter_mut().enumerate() {
            *x = a[i][0] * b[0][j] + a[i][1] * b[1][j];
        }
    }
    out
}

/// The conjugate transpose.
#[must_use]
pub fn adjoint(a: &Jones) -> Jones {
    [[a[0][0].conj(), a[1][0].conj()], [a[0][1].conj(), a[1][1].conj()]]
}

/// The inverse; `None` for a singular matrix.
#[must_use]
pub fn inverse(a: &Jones) -> Option<Jones> {
    let det = a[0][0] * a[1][1] - a[0][1] * a[1][0];
    let size = a.iter().flatten().map(Complex64::norm_sqr).sum::<f64>();
    (det.norm() > 1e-12 * size && det.is_finite()).then(|| [[a[1][1] / det, -a[0][1] / det], [-a[1][0] / det, a[0][0] / det]])
}

/// The response of ideal feeds to the field components to the north and to the east.
///
/// `angle_rad` is the position angle of the X feed (or that by which circular feeds are turned). Y is a quarter turn further to the east, or where
/// `x_east` is true, Y has the angle and X is a quarter turn further.
///
/// # Reference
/// Hamaker & Bregman 1996, A&AS 117, 161; here conjugated.
#[must_use]
pub fn feed_matrix(circular: bool, x_east: bool, angle_rad: f64) -> Jones {
    let (sin, cos) = angle_rad.sin_cos();
    if circular {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let turn = Complex64::new(cos, sin) * half;
        let i = Complex64::i();
        return [[turn, -i * turn], [turn.conj(), i * turn.conj()]];
    }
    let re = |x: f64| Complex64::new(x, 0.0);
    let (north, east) = ([re(cos), re(sin)], [re(-sin), re(cos)]);
    if x_east { [east, north] } else { [north, east] }
}

/// The coherency of the field, \[north, east\] squared, of Stokes I, Q, U, V: an unpolarised source has I on the diagonal.
#[must_use]
pub fn coherency(stokes: [Complex64; 4]) -> Jones {
    let [i, q, u, v] = stokes;
    let iv = Complex64::i() * v;
    [[i + q, u - iv], [u + iv, i - q]]
}

/// The products J1 B J2^H \[feed of antenna 1\]\[feed of antenna 2\].
#[must_use]
pub fn products(first: &Jones, coherency: &Jones, second: &Jones) -> Jones {
    times(&times(first, coherency), &adjoint(second))
}

/// One term of a sum over products: the feeds, and the coefficient.
pub type StokesTerm = ((usize, usize), Complex64);

/// The sum over products that gives one Stokes parameter: tr(M J1^-1 V J2^-H). `None` for other products, or feeds that cannot be told apart.
#[must_use]
pub fn stokes_terms(target: Polarization, first: &Jones, second: &Jones) -> Option<[StokesTerm; 4]> {
    let half = Complex64::new(0.5, 0.0);
    let half_i = Complex64::new(0.0, 0.5);
    let pick: Jones = match target {
        Polarization::I => [[half, ZERO], [ZERO, half]],
        Polarization::Q => [[half, ZERO], [ZERO, -half]],
        Polarization::U => [[ZERO, half], [half, ZERO]],
        Polarization::V => [[ZERO, -half_i], [half_i, ZERO]],
        _ => return None,
    };
    let weight = times(&times(&adjoint(&inverse(second)?), &pick), &inverse(first)?);
    Some([(0, 0), (0, 1), (1, 0), (1, 1)].map(|(j, k)| ((j, k), weight[k][j])))
}

#[cfg(test)]
mod tests {
    use super::*;
    use Polarization::{I, Q, U, V};

    const STOKES: [f64; 4] = [3.0, 0.7, -0.4, 0.2];

    fn re(x: f64) -> Complex64 {
        Complex64::new(x, 0.0)
    }

    #[test]
    fn feeds_to_the_north_and_east_give_the_products_of_the_conventions() {
        let [i, q, u, v] = STOKES;
        let b = coherency(STOKES.map(re));
        let linear = feed_matrix(false, false, 0.0);
        let xy = products(&linear, &b, &linear);
        assert!((xy[0][0] - re(i + q)).norm() < 1e-14 && (xy[0][1] - Complex64::new(u, -v)).norm() < 1e-14);
        let east = feed_matrix(false, true, 0.0);
        let xy = products(&east, &b, &east);
        assert!((xy[0][0] - re(i - q)).norm() < 1e-14 && (xy[0][1] - Complex64::new(u, v)).norm() < 1e-14);
        let circular = feed_matrix(true, false, 0.0);
        let rl = products(&circular, &b, &circular);
        assert!((rl[0][0] - re(i + v)).norm() < 1e-14 && (rl[1][1] - re(i - v)).norm() < 1e-14);
        assert!((rl[0][1] - Complex64::new(q, -u)).norm() < 1e-14);
    }

    // Feeds that turn by chi see a source whose position angle is smaller by chi; RL turns by 2 chi (Smirnov 2011, A&A 527, A106, conjugated).
    #[test]
    fn a_turn_of_the_feeds_turns_q_and_u() {
        let chi = 0.3_f64;
        let b = coherency(STOKES.map(re));
        let [_, q, u, v] = STOKES;
        let turned = Complex64::new(q, u) * Complex64::cis(-2.0 * chi);
        let linear = feed_matrix(false, false, chi);
        let xy = products(&linear, &b, &linear);
        assert!((0.5 * (xy[0][0] - xy[1][1]) - re(turned.re)).norm() < 1e-14);
        assert!((xy[0][1] - Complex64::new(turned.im, -v)).norm() < 1e-14);
        let circular = feed_matrix(true, false, chi);
        assert!((products(&circular, &b, &circular)[0][1] - turned.conj()).norm() < 1e-14);
    }

    #[test]
    fn stokes_parameters_come_back_from_feeds_that_differ_and_leak() {
        let b = coherency(STOKES.map(re));
        for circular in [false, true] {
            let leak: Jones = [[re(1.0), Complex64::new(0.05, -0.02)], [Complex64::new(-0.01, 0.04), re(0.9)]];
            let first = times(&leak, &feed_matrix(circular, false, 0.3));
            let second = feed_matrix(circular, false, -1.1);
            let vis = products(&first, &b, &second);
            for (target, truth) in [I, Q, U, V].into_iter().zip(STOKES) {
                let terms = stokes_terms(target, &first, &second).unwrap();
                let got: Complex64 = terms.iter().map(|((j, k), c)| c * vis[*j][*k]).sum();
                assert!((got - re(truth)).norm() < 1e-13, "{target}: {got}");
            }
            assert!(stokes_terms(Polarization::RR, &first, &second).is_none());
        }
    }
}
