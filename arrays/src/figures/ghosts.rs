//! Ghosts: directions in which an array of regular spacings sees the same image again.
//!
//! If all antennas stand on the places of a grid with the steps a and b, the beam repeats on the reciprocal grid, with the steps g and h for
//! which a.g = b.h = 1 and a.h = b.g = 0. The grid is found from the positions by Euclid's algorithm for the greatest common divisor, in two
//! dimensions.
//!
//! # Reference
//! Lagrange's reduction of a grid to its shortest steps: Cohen 1993, A Course in Computational Algebraic Number Theory, algorithm 1.3.14.

use super::plane::Plane;

type Vector = [f64; 2];

/// Positions may miss the grid by this much, wavelengths.
const TOLERANCE: f64 = 0.1;
/// Shorter steps (wavelengths) put all ghosts beyond the horizon, wherever the source is.
const SHORTEST: f64 = 0.5;
/// Most steps of Euclid's algorithm. The area of a cell of the grid is at least halved in a few of them.
const MOST_STEPS: usize = 1000;
/// Most ghosts that are listed.
const MOST: usize = 24;

/// Where an array of regular spacings repeats its image.
#[derive(Debug, Clone, PartialEq)]
pub struct Ghosts {
    /// Steps of the grid on which all antennas stand, wavelengths: none for irregular positions, one for a line.
    pub steps: Vec<Vector>,
    /// Ghosts of a source at the zenith (or boresight) that are above the horizon: direction cosines (l, m), the nearest first, at most 24. The
    /// opposite directions have ghosts too. The ghost of a line of antennas is a line across the sky through this direction.
    pub directions: Vec<Vector>,
    /// Diameter of the largest round field around the zenith (or boresight) whose sources have no ghosts in it, rad; pi where no ghost is on the
    /// sky.
    pub alias_free_field_rad: f64,
}

impl Ghosts {
    pub(super) fn of(plane: &Plane) -> Self {
        let steps = grid(plane);
        let inverse = match steps.as_slice() {
            [a] => vec![a.map(|v| v / dot(*a, *a))],
            [a, b] => {
                let d = cross(*a, *b);
                shortest([b[1] / d, -b[0] / d], [-a[1] / d, a[0] / d]).to_vec()
            }
            _ => Vec::new(),
        };
        let nearest = inverse.iter().map(|g| length(*g)).fold(f64::INFINITY, f64::min);
        let reach = |g: &Vector| (1.0 / length(*g)).floor() as i64 + 1;
        let mut directions: Vec<Vector> = match inverse.as_slice() {
            [g] => (1..=reach(g)).map(|i| g.map(|v| i as f64 * v)).collect(),
            // The shortest steps of a grid lie 60 to 120 degrees apart, so coordinates exceed the length by at most 2 / sqrt 3.
            [g, h] => (-2 * reach(g)..=2 * reach(g))
                .flat_map(|i| {
                    (0..=2 * reach(h)).filter(move |j| *j > 0 || i > 0).map(move |j| [0, 1].map(|k| i as f64 * g[k] + j as f64 * h[k]))
                })
                .collect(),
            _ => Vec::new(),
        };
        directions.retain(|g| length(*g) <= 1.0);
        directions.sort_by(|a, b| length(*a).total_cmp(&length(*b)));
        directions.truncate(MOST);
        Self { steps, directions, alias_free_field_rad: 2.0 * (nearest / 2.0).min(1.0).asin() }
    }
}

/// Steps of the coarsest grid on which all antennas stand; none if there is no grid coarser than [`SHORTEST`].
fn grid(plane: &Plane) -> Vec<Vector> {
    let mut offsets: Vec<Vector> = plane.views.iter().flat_map(|xy| xy.iter().map(|p| sub(*p, xy[0]))).collect();
    offsets.sort_by(|a, b| length(*a).total_cmp(&length(*b)));
    let mut basis: Vec<Vector> = Vec::new();
    for offset in &offsets {
        basis = with(basis, *offset);
        if basis.iter().any(|b| length(*b) < SHORTEST) {
            return Vec::new();
        }
    }
    fitted(&basis, &offsets)
}

/// The steps of the grid of all sums of the old steps and a vector.
fn with(basis: Vec<Vector>, v: Vector) -> Vec<Vector> {
    match basis.as_slice() {
        [] if length(v) <= TOLERANCE => basis,
        [] => vec![v],
        [a] => {
            if cross(*a, v).abs() / length(*a) > TOLERANCE {
                return shortest(*a, v).to_vec();
            }
            let (mut a, mut rest) = (*a, v);
            while length(rest) > TOLERANCE {
                (a, rest) = (rest, sub(a, times((dot(a, rest) / dot(rest, rest)).round(), rest)));
                if length(a) < SHORTEST {
                    break;
                }
            }
            // The first remainder may be longer than a.
            vec![a]
        }
        [a, b, ..] => {
            let (mut a, mut b, mut rest) = (*a, *b, v);
            for _ in 0..MOST_STEPS {
                rest = remainder(rest, a, b);
                if length(rest) <= TOLERANCE || length(a).min(length(b)) < SHORTEST {
                    return vec![a, b];
                }
                if length(rest) < SHORTEST {
                    return vec![rest, a];
                }
                // The remainder becomes a step, and the step that is most along it is to be expressed by the other two.
                let along = |x: Vector| cross(x, rest).abs() / length(x);
                let (kept, left) = if along(a) > along(b) { (a, b) } else { (b, a) };
                [a, b] = shortest(kept, rest);
                rest = left;
            }
            vec![[0.0; 2], a]
        }
    }
}

/// What remains of a vector after the nearest place of the grid.
fn remainder(v: Vector, a: Vector, b: Vector) -> Vector {
    let d = cross(a, b);
    let (x, y) = ((cross(v, b) / d).round(), (cross(a, v) / d).round());
    sub(sub(v, times(x, a)), times(y, b))
}

/// The two shortest steps of a grid, after Lagrange.
fn shortest(mut a: Vector, mut b: Vector) -> [Vector; 2] {
    loop {
        if length(a) > length(b) {
            (a, b) = (b, a);
        }
        let next = sub(b, times((dot(a, b) / dot(a, a)).round(), a));
        // Exactly half a step can be taken off again and again.
        if length(next) >= length(b) * (1.0 - 1e-12) {
            return [a, b];
        }
        b = next;
    }
}

/// The steps that fit all offsets best, after each has found its place; none where one misses its place by more than the tolerance.
fn fitted(basis: &[Vector], offsets: &[Vector]) -> Vec<Vector> {
    let second = match basis {
        [] => return Vec::new(),
        // A second step at right angles that no offset uses.
        [a] => [-a[1], a[0]],
        [_, b, ..] => *b,
    };
    let a = basis[0];
    let d = cross(a, second);
    let places: Vec<Vector> = offsets.iter().map(|v| [(cross(*v, second) / d).round(), (cross(a, *v) / d).round()]).collect();
    let sum = |f: &dyn Fn(&Vector, &Vector) -> f64| places.iter().zip(offsets).map(|(n, v)| f(n, v)).sum::<f64>();
    let (nn, nm, mm) = (sum(&|n, _| n[0] * n[0]), sum(&|n, _| n[0] * n[1]), sum(&|n, _| n[1] * n[1]));
    let [nx, mx] = [0, 1].map(|i| [0, 1].map(|k| sum(&|n, v| n[i] * v[k])));
    let steps = if basis.len() == 1 {
        vec![nx.map(|v| v / nn)]
    } else {
        let det = nn * mm - nm * nm;
        vec![[0, 1].map(|k| (nx[k] * mm - mx[k] * nm) / det), [0, 1].map(|k| (mx[k] * nn - nx[k] * nm) / det)]
    };
    let at = |n: &Vector| steps.iter().zip(n).fold([0.0; 2], |p, (s, n)| [p[0] + n * s[0], p[1] + n * s[1]]);
    let misses = places.iter().zip(offsets).any(|(n, v)| !(length(sub(at(n), *v)) <= 2.0 * TOLERANCE));
    if misses { Vec::new() } else { steps }
}

fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn cross(a: Vector, b: Vector) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

fn sub(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1]]
}

fn times(k: f64, a: Vector) -> Vector {
    a.map(|v| k * v)
}

fn length(a: Vector) -> f64 {
    a[0].hypot(a[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figures::psf::Psf;

    #[test]
    fn every_ghost_is_as_strong_as_its_source() {
        // Places of grids, none of which has two neighbours at the plain steps: the steps follow from the differences.
        for (a, b) in [([3.0, 0.0], [0.0, 3.0]), ([2.0, 0.0], [1.0, 3.0_f64.sqrt()]), ([5.1, 1.3], [-2.2, 7.7])] {
            let places = [(0, 0), (4, 6), (9, 1), (15, 10), (-6, 21), (2, -9), (7, 7)];
            let xy: Vec<Vector> = places.iter().map(|(i, j)| [0, 1].map(|k| f64::from(*i) * a[k] + f64::from(*j) * b[k])).collect();
            let ghosts = Ghosts::of(&Plane { views: vec![xy.clone()] });
            assert_eq!(ghosts.steps.len(), 2);
            let area = cross(ghosts.steps[0], ghosts.steps[1]).abs();
            assert!((area / cross(a, b).abs() - 1.0).abs() < 1e-9, "{area}");
            let psf = Psf::natural(&xy);
            assert!(!ghosts.directions.is_empty() && ghosts.directions.is_sorted_by(|x, y| length(*x) <= length(*y) + 1e-12));
            for [l, m] in &ghosts.directions {
                assert!((psf.at(*l, *m) - 1.0).abs() < 1e-9, "{l} {m}: {}", psf.at(*l, *m));
            }
            let nearest = length(ghosts.directions[0]);
            assert!((ghosts.alias_free_field_rad - 2.0 * (nearest / 2.0).asin()).abs() < 1e-12);
        }
    }

    #[test]
    fn a_line_has_the_ghosts_of_its_common_spacing() {
        // Spacings of 4.4, 6.6 and 11 wavelengths have the common step 2.2, turned by 30 degrees.
        let (s, c) = (0.5, 0.75_f64.sqrt());
        let xy = [0.0, 4.4, 11.0, 22.0].map(|r| [r * c, r * s]).to_vec();
        let ghosts = Ghosts::of(&Plane { views: vec![xy] });
        assert_eq!(ghosts.steps.len(), 1);
        assert!((length(ghosts.steps[0]) - 2.2).abs() < 1e-12);
        assert_eq!(ghosts.directions.len(), 2);
        assert!((length(ghosts.directions[0]) - 1.0 / 2.2).abs() < 1e-12);
        assert!((ghosts.alias_free_field_rad - 2.0 * (0.5_f64 / 2.2).asin()).abs() < 1e-12);
    }

    #[test]
    fn irregular_and_closely_spaced_arrays_have_none() {
        let spiral: Vec<Vector> = (0..40)
            .map(|k| [f64::from(k).sqrt() * f64::from(k).cos(), f64::from(k).sqrt() * f64::from(k).sin()].map(|v| v * 9.0))
            .collect();
        let close: Vec<Vector> = (0..25).map(|k| [f64::from(k % 5), f64::from(k / 5)].map(|v| v * 0.49)).collect();
        for xy in [spiral, close] {
            let ghosts = Ghosts::of(&Plane { views: vec![xy] });
            assert!(ghosts.directions.is_empty());
            assert!((ghosts.alias_free_field_rad - std::f64::consts::PI).abs() < 1e-12);
        }
    }
}
