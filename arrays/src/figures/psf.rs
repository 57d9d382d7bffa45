//! The beam of an array by direct sums: its main lobe and its side lobes.
//!
//! With natural weights and no autocorrelations the beam of N antennas is (|AF|^2 - N) / (N (N - 1)), where AF is the sum of the
//! antennas' phasors, so each point of the beam costs N multiplications.

use super::plane::Plane;
use num_complex::Complex64;
use std::f64::consts::{FRAC_PI_2, LN_2, PI, TAU};

/// Number of grid points from the centre to the edge of the grid on which the main lobe is fitted.
const FIT_HALF: i64 = 16;
/// Side lobes are searched out to this many beams.
const BEAMS: f64 = 30.0;
/// Points per beam in the search for side lobes.
const PER_BEAM: f64 = 4.0;

/// An elliptical Gaussian fitted to the main lobe.
#[derive(Debug, Clone, Copy)]
pub(super) struct Beam {
    pub major_rad: f64,
    pub minor_rad: f64,
    /// From +y towards +x.
    pub pa_rad: f64,
}

/// Peak (absolute) and rms of the beam outside its main lobe, over its peak.
#[derive(Debug, Clone, Copy)]
pub(super) struct SideLobes {
    pub peak: f64,
    pub rms: f64,
}

impl Plane {
    /// The beam on the points i a + j b for i in -half..=half and j in 0..=half (the beam is even), [j][i].
    fn beam_grid(&self, a: [f64; 2], b: [f64; 2], half: i64) -> Vec<Vec<f64>> {
        let n = self.xy.len() as f64;
        let phasor = |p: [f64; 2], s: [f64; 2], k: i64| Complex64::cis(TAU * (p[0] * s[0] + p[1] * s[1]) * k as f64);
        // [i][antenna], so that the inner sum runs along memory.
        let along: Vec<Vec<Complex64>> = (-half..=half).map(|i| self.xy.iter().map(|p| phasor(*p, a, i)).collect()).collect();
        (0..=half)
            .map(|j| {
                let across: Vec<Complex64> = self.xy.iter().map(|p| phasor(*p, b, j)).collect();
                along
                    .iter()
                    .map(|row| {
                        let af: Complex64 = row.iter().zip(&across).map(|(x, y)| x * y).sum();
                        (af.norm_sqr() - n) / (n * (n - 1.0))
                    })
                    .collect()
            })
            .collect()
    }

    fn beam_at(&self, l: f64, m: f64) -> f64 {
        let n = self.xy.len() as f64;
        let af: Complex64 = self.xy.iter().map(|p| Complex64::cis(TAU * (p[0] * l + p[1] * m))).sum();
        (af.norm_sqr() - n) / (n * (n - 1.0))
    }
}

impl Beam {
    /// Fit the main lobe above half its peak.
    ///
    /// The curvature at the peak gives axes and a first size; the logarithm of the beam is then fitted by a quadratic form, with weights
    /// equal to the beam squared, on a grid stretched to those axes.
    pub(super) fn fit(plane: &Plane) -> Self {
        // The beam near its peak is 1 - 2 pi^2 <(u l + v m)^2> over baselines, and baselines have twice the antennas' moments.
        let n = plane.xy.len() as f64;
        let scale = 2.0 * n / (n - 1.0) / n;
        let moment = |i: usize, k: usize| scale * plane.xy.iter().map(|p| p[i] * p[k]).sum::<f64>();
        let curvature = eigen(moment(0, 0), moment(0, 1), moment(1, 1));
        // Gaussian of the same curvature: 1 - 4 ln2 x^2 / fwhm^2.
        let fwhm = |m: f64| (2.0 * LN_2 / m.max(f64::MIN_POSITIVE)).sqrt() / PI;
        // A line of antennas has no resolution across the line: there the beam is wider than the sky.
        let narrow = fwhm(curvature.large);
        let wide = fwhm(curvature.small).clamp(narrow, (2.0 * PI).max(narrow));
        let line = wide >= PI;
        let (along, across) = (curvature.axis, [-curvature.axis[1], curvature.axis[0]]);
        let mut reach = 1.0;
        loop {
            let step = |axis: [f64; 2], size: f64| axis.map(|v| v * size * reach / FIT_HALF as f64);
            let grid = plane.beam_grid(step(along, narrow), step(across, wide), FIT_HALF);
            match quadratic(&grid, line) {
                Some((x2, xy, y2)) => {
                    let unit = reach / FIT_HALF as f64;
                    let (sx, sy) = (narrow * unit, wide * unit);
                    return Self::of_form(x2 / (sx * sx), xy / (sx * sy), y2 / (sy * sy), along, across);
                }
                // A wide pedestal makes the beam wider than its curvature suggests, so the grid is enlarged. Far enough out the beam of any array
                // falls below half.
                None if reach < 1e4 => reach *= 2.0,
                None => return Self::of_form(1.0 / (narrow * narrow), 0.0, 1.0 / (wide * wide), along, across),
            }
        }
    }

    /// From 1/fwhm^2 as a quadratic form along two axes.
    fn of_form(x2: f64, xy: f64, y2: f64, along: [f64; 2], across: [f64; 2]) -> Self {
        let e = eigen(x2, xy, y2);
        // The small eigenvalue belongs to the major axis, at right angles to the other.
        let (p, q) = (-e.axis[1], e.axis[0]);
        let major = [0, 1].map(|k| p * along[k] + q * across[k]);
        let pa = major[0].atan2(major[1]);
        let pa_rad = if pa > FRAC_PI_2 {
            pa - PI
        } else if pa <= -FRAC_PI_2 {
            pa + PI
        } else {
            pa
        };
        Self { major_rad: 1.0 / e.small.max(f64::MIN_POSITIVE).sqrt(), minor_rad: 1.0 / e.large.sqrt(), pa_rad }
    }
}

/// Fit ln beam = -4 ln2 (x2 i^2 + 2 xy i j + y2 j^2) to the points above half that are connected to the centre; `None` where they reach
/// the edge. For a line of antennas only the middle row is fitted, because the beam does not fall across the line.
fn quadratic(grid: &[Vec<f64>], line: bool) -> Option<(f64, f64, f64)> {
    let half = FIT_HALF;
    let at = |i: i64, j: i64| if j >= 0 { grid[j as usize][(i + half) as usize] } else { grid[-j as usize][(half - i) as usize] };
    let mut inside = vec![(0_i64, 0_i64)];
    let mut seen = std::collections::HashSet::from([(0_i64, 0_i64)]);
    // Normal equations for the three coefficients.
    let (mut m, mut r) = ([[0.0; 3]; 3], [0.0; 3]);
    let mut points = 0;
    while let Some((i, j)) = inside.pop() {
        if i.abs() == half || j.abs() == half {
            return None;
        }
        let p = at(i, j);
        let (x, y) = (i as f64, j as f64);
        let basis = [x * x, 2.0 * x * y, y * y];
        let value = -p.ln() / (4.0 * LN_2);
        for a in 0..3 {
            for b in 0..3 {
                m[a][b] += p * p * basis[a] * basis[b];
            }
            r[a] += p * p * basis[a] * value;
        }
        points += 1;
        for next in [(i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)] {
            if (!line || next.1 == 0) && at(next.0, next.1) > 0.5 && seen.insert(next) {
                inside.push(next);
            }
        }
    }
    if line {
        return (points >= 3).then(|| (r[0] / m[0][0], 0.0, 0.0));
    }
    if points < 9 { None } else { solve3(m, r).filter(|(x2, xy, y2)| *x2 > 0.0 && x2 * y2 > xy * xy) }
}

/// Solution of three symmetric equations by Cramer's rule.
fn solve3(m: [[f64; 3]; 3], r: [f64; 3]) -> Option<(f64, f64, f64)> {
    let det = |a: [[f64; 3]; 3]| {
        a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) - a[0][1] * (a[1][0] * a[2][2] - a[1][2] * a[2][0])
            + a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0])
    };
    let d = det(m);
    let with = |c: usize| {
        let mut a = m;
        for k in 0..3 {
            a[k][c] = r[k];
        }
        det(a) / d
    };
    (d != 0.0).then(|| (with(0), with(1), with(2))).filter(|(a, b, c)| a.is_finite() && b.is_finite() && c.is_finite())
}

struct Eigen {
    large: f64,
    small: f64,
    /// Unit vector of the large eigenvalue.
    axis: [f64; 2],
}

/// Eigenvalues of a symmetric 2 x 2 matrix.
fn eigen(xx: f64, xy: f64, yy: f64) -> Eigen {
    let (mean, half) = ((xx + yy) / 2.0, ((xx - yy) / 2.0).hypot(xy));
    let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
    Eigen { large: mean + half, small: (mean - half).max(0.0), axis: [angle.cos(), angle.sin()] }
}

/// Side lobes beyond the first minimum of the beam along each ray, out to 30 beams (less where the sky ends).
pub(super) fn side_lobes(plane: &Plane, beam: &Beam) -> SideLobes {
    let (sin_pa, cos_pa) = beam.pa_rad.sin_cos();
    let major = beam.major_rad.min(2.0 / BEAMS);
    let unit_x = [cos_pa, -sin_pa].map(|v| v * beam.minor_rad);
    let unit_y = [sin_pa, cos_pa].map(|v| v * major);
    // The main lobe ends where the beam first stops falling, ray by ray, in units of the fitted ellipse.
    let rays = 180;
    let edge: Vec<f64> = (0..rays)
        .map(|k| {
            let (s, c) = (PI * k as f64 / rays as f64).sin_cos();
            let step = 0.5 / PER_BEAM;
            let value = |i: i32| {
                let r = f64::from(i) * step;
                plane.beam_at(r * (c * unit_x[0] + s * unit_y[0]), r * (c * unit_x[1] + s * unit_y[1]))
            };
            let mut last = 1.0;
            let mut i = 1;
            while f64::from(i) * step < BEAMS {
                let v = value(i);
                if v > last {
                    break;
                }
                last = v;
                i += 1;
            }
            f64::from(i - 1) * step
        })
        .collect();
    let half = (BEAMS * PER_BEAM) as i64;
    let grid = plane.beam_grid(unit_x.map(|v| v / PER_BEAM), unit_y.map(|v| v / PER_BEAM), half);
    let (mut peak, mut sum, mut count) = (0.0_f64, 0.0, 0_usize);
    for (j, row) in grid.iter().enumerate() {
        for (column, v) in row.iter().enumerate() {
            let (x, y) = ((column as i64 - half) as f64 / PER_BEAM, j as f64 / PER_BEAM);
            let (l, m) = (x * unit_x[0] + y * unit_y[0], x * unit_x[1] + y * unit_y[1]);
            let turn = y.atan2(x).rem_euclid(PI) / PI * rays as f64;
            let end = edge[turn.floor() as usize % rays].max(edge[turn.ceil() as usize % rays]);
            if x.hypot(y) <= end || l * l + m * m > 1.0 {
                continue;
            }
            peak = peak.max(v.abs());
            sum += v * v;
            count += 1;
        }
    }
    SideLobes { peak: peak.min(1.0), rms: if count == 0 { 0.0 } else { (sum / count as f64).sqrt() } }
}
