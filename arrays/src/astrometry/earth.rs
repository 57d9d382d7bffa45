//! Position and orientation of the Earth. This is the expensive part of an apparent place, so it is interpolated in time.
//!
//! Precession, nutation and the Earth's orbit have no period much shorter than five days. A cubic through nodes an eighth of a day
//! apart follows them to 1e-12. The series with their thousands of terms are evaluated only at the nodes.

use sofars::eph::epv00;
use sofars::pnp::{bpn2xy, eors, pnm06a, s06};
use std::cell::RefCell;

/// Number of nodes per day.
const PER_DAY: f64 = 8.0;
/// Julian date (TT) of node 0: J2000.
const EPOCH_JD: f64 = 2_451_545.0;

/// State of the Earth at one moment of terrestrial time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Earth {
    /// Celestial intermediate pole x, y, and the locator s, rad.
    pub pole: [f64; 3],
    /// Equation of the origins, rad.
    pub equation_of_origins_rad: f64,
    /// Heliocentric position, au.
    pub heliocentric_au: [f64; 3],
    /// Barycentric position, au, and velocity, au per day.
    pub barycentric: [[f64; 3]; 2],
}

/// x, y, s, equation of the origins, heliocentric position, barycentric position and velocity.
type Node = [f64; 13];

thread_local! {
    /// The four nodes used last, and the index of the first of them.
    static WINDOW: RefCell<(i64, Vec<Node>)> = const { RefCell::new((0, Vec::new())) };
}

/// The Earth at a terrestrial time, given in two parts as SOFA splits Julian dates. `None` outside the years 1900 to 2100, the range of
/// the series of the orbit.
pub(super) fn at(tt1: f64, tt2: f64) -> Option<Earth> {
    let q = (tt1 - EPOCH_JD + tt2) * PER_DAY;
    let first = q.floor() as i64 - 1;
    let p = q - q.floor();
    // Lagrange weights of nodes -1, 0, 1, 2.
    let weights = [
        -p * (p - 1.0) * (p - 2.0) / 6.0,
        (p + 1.0) * (p - 1.0) * (p - 2.0) / 2.0,
        -(p + 1.0) * p * (p - 2.0) / 2.0,
        (p + 1.0) * p * (p - 1.0) / 6.0,
    ];
    let v = WINDOW.with_borrow_mut(|(start, nodes)| {
        if *start != first || nodes.len() != 4 {
            let known = |i: i64| usize::try_from(i - *start).ok().and_then(|k| nodes.get(k).copied());
            let fresh: Option<Vec<Node>> = (first..first + 4).map(|i| known(i).or_else(|| node(EPOCH_JD + i as f64 / PER_DAY))).collect();
            *nodes = fresh?;
            *start = first;
        }
        let mut v = [0.0; 13];
        for (w, n) in weights.iter().zip(nodes.iter()) {
            for (sum, x) in v.iter_mut().zip(n) {
                *sum += w * x;
            }
        }
        Some(v)
    })?;
    Some(Earth {
        pole: [v[0], v[1], v[2]],
        equation_of_origins_rad: v[3],
        heliocentric_au: [v[4], v[5], v[6]],
        barycentric: [[v[7], v[8], v[9]], [v[10], v[11], v[12]]],
    })
}

fn node(tt_jd: f64) -> Option<Node> {
    let bpn = pnm06a(tt_jd, 0.0);
    let (x, y) = bpn2xy(&bpn);
    let s = s06(tt_jd, 0.0, x, y);
    let (h, b) = epv00(tt_jd, 0.0)?;
    Some([x, y, s, eors(&bpn, s), h[0][0], h[0][1], h[0][2], b[0][0], b[0][1], b[0][2], b[1][0], b[1][1], b[1][2]])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn between_nodes_the_cubic_follows_the_series() {
        for k in 0..20 {
            let tt = 2_448_000.123 + 700.377 * f64::from(k);
            let (found, exact) = (at(tt, 0.0).unwrap(), node(tt).unwrap());
            let flat = [
                found.pole.as_slice(),
                &[found.equation_of_origins_rad],
                &found.heliocentric_au,
                &found.barycentric[0],
                &found.barycentric[1],
            ]
            .concat();
            assert!(flat.iter().zip(&exact).all(|(a, b)| (a - b).abs() < 2e-12), "{tt}: {flat:?} {exact:?}");
        }
    }

    #[test]
    fn the_order_of_questions_does_not_change_the_answers() {
        let ask = |times: &[f64]| times.iter().map(|t| at(*t, 0.0).unwrap().pole[0].to_bits()).collect::<Vec<_>>();
        let forward = ask(&[2_460_000.1, 2_460_000.2, 2_460_000.5, 2_450_000.7]);
        let mut backward = ask(&[2_450_000.7, 2_460_000.5, 2_460_000.2, 2_460_000.1]);
        backward.reverse();
        assert_eq!(forward, backward);
    }

    #[test]
    fn the_centuries_of_the_series_are_its_limits() {
        assert!(at(2_415_030.5, 0.0).is_some() && at(2_488_060.5, 0.0).is_some());
        assert!(at(2_415_000.5, 0.0).is_none() && at(2_488_100.5, 0.0).is_none());
    }
}
