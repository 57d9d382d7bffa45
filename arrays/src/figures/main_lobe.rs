//! The main lobe of a beam: an elliptical Gaussian fitted to it, and its widths at half of the peak.

use super::psf::Psf;
use std::f64::consts::{FRAC_PI_2, LN_2, PI};

/// Number of grid points from the centre to the edge of the grid on which the main lobe is fitted.
const FIT_HALF: i64 = 16;
/// Directions in which the width at half of the peak is measured.
const DIRECTIONS: usize = 36;
/// Steps per fitted width in the search for half of the peak.
const STEPS: f64 = 16.0;

/// An elliptical Gaussian fitted to the main lobe.
#[derive(Debug, Clone, Copy)]
pub(super) struct Beam {
    pub major_rad: f64,
    pub minor_rad: f64,
    /// From +y towards +x.
    pub pa_rad: f64,
}

/// Widths of the contour on which the beam is half of its peak, rad.
#[derive(Debug, Clone, Copy)]
pub(super) struct HalfPower {
    pub widest_rad: f64,
    pub narrowest_rad: f64,
    /// Diameter of the circle with the area of the contour.
    pub equivalent_rad: f64,
}

impl HalfPower {
    /// Measure the contour from the centre outwards. It ends where the sky ends.
    pub(super) fn of(psf: &Psf, beam: &Beam) -> Self {
        let (sin_pa, cos_pa) = beam.pa_rad.sin_cos();
        let radius = |k: usize| {
            let (s, c) = (PI * k as f64 / DIRECTIONS as f64).sin_cos();
            // Along the axes of the ellipse, so that the widest and the narrowest direction are among them.
            let direction = [s * sin_pa + c * cos_pa, s * cos_pa - c * sin_pa];
            let value = |r: f64| psf.at(r * direction[0], r * direction[1]);
            let step = ellipse_width(beam, s, c) / STEPS;
            let Some(outside) = (1..).map(|i| f64::from(i) * step).take_while(|r| *r < 1.0 + step).find(|r| value(*r) < 0.5) else {
                return 1.0;
            };
            let (mut low, mut high) = (outside - step, outside);
            for _ in 0..50 {
                let middle = 0.5 * (low + high);
                if value(middle) < 0.5 { high = middle } else { low = middle }
            }
            low.min(1.0)
        };
        let radii: Vec<f64> = (0..DIRECTIONS).map(radius).collect();
        // A radius of 1 is a direction cosine at the horizon: no resolution in this direction.
        let width = |r: f64| if r >= 1.0 { PI } else { 2.0 * r };
        Self {
            widest_rad: width(radii.iter().copied().fold(0.0, f64::max)),
            narrowest_rad: width(radii.iter().copied().fold(1.0, f64::min)),
            equivalent_rad: 2.0 * (radii.iter().map(|r| r * r).sum::<f64>() / DIRECTIONS as f64).sqrt(),
        }
    }
}

/// Full width of the fitted ellipse in the direction with the sine `s` from its minor axis.
fn ellipse_width(beam: &Beam, s: f64, c: f64) -> f64 {
    let (x, y) = (c / beam.minor_rad, s / beam.major_rad);
    1.0 / x.hypot(y)
}

impl Beam {
    /// Whether the array has no resolution in one direction, as a line of antennas.
    pub(super) fn is_line(&self) -> bool {
        self.major_rad >= PI
    }

    /// Fit the main lobe above half its peak.
    ///
    /// The curvature at the peak gives axes and a first size; the logarithm of the beam is then fitted by a quadratic form, with weights
    /// equal to the beam squared, on a grid stretched to those axes.
    pub(super) fn fit(psf: &Psf) -> Self {
        // The beam near its peak is 1 - 2 pi^2 <(u l + v m)^2> over baselines.
        let [uu, uv, vv] = psf.moments();
        let curvature = eigen(uu, uv, vv);
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
            let grid = psf.on_grid(step(along, narrow), step(across, wide), FIT_HALF);
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
