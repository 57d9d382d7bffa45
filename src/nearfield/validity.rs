//! Where the Fourier image of a focused set is valid.
//!
//! Focus takes the phase of one point out of the visibilities. A Fourier transform then images its surroundings as if their waves were plane. What is left of the
//! phase of a pair of antennas, once its phase at the focus and that of the Fourier kernel are taken away, grows with the angle from the focus: to lowest
//! order k/(2R) ((s.r_q)^2 - (s.r_p)^2) by the inclination of the sphere, and k/(2R^2) r^2 s.r by its coma. Below pi/8 the peak of a point loses less
//! than 2 % and stays in its place.

use super::paths::{Elements, Point, path};
use super::surface::Surface;
use crate::Result;
use cittert_arrays::{FocusPoint, SPEED_OF_LIGHT_M_S, SkyGrid};
use ndarray::Array2;
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_8, TAU};

/// The residual phase of the pixels of an image.
#[derive(Debug, Clone, PartialEq)]
pub struct Validity {
    /// The largest residual phase of all pairs of antennas \[m, l\], rad; NaN behind the horizon.
    pub phase_rad: Array2<f64>,
    /// Number of pixels in front of the horizon.
    pub pixels: usize,
    /// Number of those whose phase is below pi/8.
    pub valid: usize,
    /// Angle from the focus within which all pixels are valid, rad. If all are, that to the farthest of them.
    pub radius_rad: f64,
}

impl Validity {
    /// The residual phases of a surface at the pixels of a grid, for visibilities that are phased to `focus` (without one, to the boresight at infinity), at a
    /// frequency, Hz.
    ///
    /// # Errors
    /// A grid on the sky, a map of distances that ends within it, a surface nearer than the farthest element.
    pub fn new(elements: &Elements, focus: Option<FocusPoint>, surface: &Surface, grid: &SkyGrid, freq_hz: f64) -> Result<Self> {
        surface.check(grid)?;
        elements.check_distance(surface.nearest_m())?;
        let center = focus.map_or(Point { toward: [0.0, 0.0, 1.0], curvature: 0.0 }, Point::from);
        let wavenumber = TAU * freq_hz / SPEED_OF_LIGHT_M_S;
        let at_focus: Vec<f64> = elements.positions_m().iter().map(|r| bent(*r, center)).collect();
        let phase = |p: Point| {
            let left = elements.positions_m().iter().zip(&at_focus).map(|(r, focus)| bent(*r, p) - focus);
            let (low, high) = left.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
            wavenumber * (high - low)
        };
        let rows: Vec<(Vec<f64>, f64, f64)> = (0..grid.n_m)
            .into_par_iter()
            .map(|row| {
                let (mut wrong, mut far) = (f64::INFINITY, 0.0_f64);
                let of = |column: usize| {
                    let Some(p) = Point::on(surface, grid.l_at(column as f64), grid.m_at(row as f64)) else { return f64::NAN };
                    let chord = (0..3).map(|k| (p.toward[k] - center.toward[k]).powi(2)).sum::<f64>().sqrt();
                    let (angle, phase) = (2.0 * (0.5 * chord).asin(), phase(p));
                    far = far.max(angle);
                    if phase >= FRAC_PI_8 {
                        wrong = wrong.min(angle);
                    }
                    phase
                };
                ((0..grid.n_l).map(of).collect(), wrong, far)
            })
            .collect();
        let wrong = rows.iter().map(|r| r.1).fold(f64::INFINITY, f64::min);
        let far = rows.iter().map(|r| r.2).fold(0.0, f64::max);
        let phase_rad = Array2::from_shape_fn((grid.n_m, grid.n_l), |(row, column)| rows[row].0[column]);
        let pixels = phase_rad.iter().filter(|p| p.is_finite()).count();
        let valid = phase_rad.iter().filter(|p| **p < FRAC_PI_8).count();
        Ok(Self { phase_rad, pixels, valid, radius_rad: wrong.min(far) })
    }

    /// The largest phase, rad.
    #[must_use]
    pub fn largest_rad(&self) -> f64 {
        self.phase_rad.iter().copied().filter(|p| p.is_finite()).fold(0.0, f64::max)
    }
}

/// The path to an element less that of a plane wave from the same direction, m: 0 at infinity.
fn bent(r: [f64; 3], p: Point) -> f64 {
    path(r, p).0 + (0..3).map(|k| r[k] * p.toward[k]).sum::<f64>()
}

/// The largest phase between two elements by which waves from a point differ from plane ones, rad.
#[must_use]
pub fn bending_rad(elements: &Elements, from: FocusPoint, freq_hz: f64) -> f64 {
    let all = elements.positions_m().iter().map(|r| bent(*r, from.into()));
    let (low, high) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
    TAU * freq_hz / SPEED_OF_LIGHT_M_S * (high - low)
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::{Antenna, ArrayLayout, LayoutFrame, SkyFrame};

    const HZ: f64 = SPEED_OF_LIGHT_M_S / 3.2e-3;

    fn elements(places: &[[f64; 3]]) -> Elements {
        let antennas = places.iter().enumerate().map(|(k, p)| Antenna::new(format!("a{k}"), k as u32, *p)).collect();
        Elements::new(&ArrayLayout::new("t", LayoutFrame::Boresight, antennas).unwrap(), None).unwrap()
    }

    /// A grid with a pixel at 7 degrees to the right.
    fn grid() -> SkyGrid {
        SkyGrid::new(64, 8, 7.0_f64.to_radians().sin() / 16.0, SkyFrame::Boresight).unwrap()
    }

    #[test]
    fn the_phases_of_an_aperture_of_a_metre_at_ten_metres_are_those_by_hand() {
        let point = FocusPoint::new(0.0, 0.0, 10.0).unwrap();
        let focus = Some(point);
        let sphere = Surface::Sphere(10.0);
        let edge = elements(&[[0.0; 3], [0.5, 0.0, 0.0]]);
        let opposite = elements(&[[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]]);
        // Without focus, the edge against the centre: k a^2 / (2 R) = 24.54 rad (26.2 rad at 3.0 mm).
        let unfocused = Validity::new(&edge, None, &sphere, &grid(), HZ).unwrap().phase_rad[(4, 32)];
        let by_hand = TAU / 3.2e-3 * 0.25 / 20.0;
        let taken = bending_rad(&edge, point, HZ);
        assert!((taken - unfocused).abs() < 1e-9, "what focus takes out: {taken}");
        assert!((by_hand - 24.54).abs() < 0.01 && (unfocused / by_hand - 1.0).abs() < 1e-3, "{unfocused} {by_hand}");
        // What focus leaves at 7 degrees. Opposite edges, by coma: k a^3 sin cos^2 / R^2 = 0.295 rad (0.314 rad at 3.0 mm).
        let (sin, cos) = 7.0_f64.to_radians().sin_cos();
        let left = Validity::new(&opposite, focus, &sphere, &grid(), HZ).unwrap().phase_rad[(4, 48)];
        let by_hand = TAU / 3.2e-3 * 0.125 * sin * cos * cos / 100.0;
        assert!((by_hand - 0.295).abs() < 1e-3 && (left - by_hand).abs() < 2e-3, "{left} {by_hand}");
        // The edge against the centre, by inclination and coma: k a^2 sin^2 / (2 R) + half of the above on the far side, less on the near side.
        let left = Validity::new(&edge, focus, &sphere, &grid(), HZ).unwrap().phase_rad[(4, 48)];
        let by_hand = TAU / 3.2e-3 * 0.25 * sin * sin / 20.0 - 0.5 * by_hand;
        assert!((left - by_hand).abs() < 5e-3, "{left} {by_hand}");
    }

    #[test]
    fn the_angle_is_that_up_to_which_all_pixels_are_valid() {
        let ring: Vec<[f64; 3]> =
            (0..24).map(|k| [0.5 * (f64::from(k) * TAU / 24.0).cos(), 0.5 * (f64::from(k) * TAU / 24.0).sin(), 0.0]).collect();
        let focus = FocusPoint::new(0.02, 0.0, 10.0).unwrap();
        let grid = SkyGrid::new(200, 200, 2e-3, SkyFrame::Boresight).unwrap();
        let map = Validity::new(&elements(&ring), Some(focus), &Surface::Sphere(10.0), &grid, HZ).unwrap();
        assert!(map.phase_rad[(100, 110)] < 1e-9, "the focus");
        assert!(map.valid > 0 && map.valid < map.pixels && map.pixels == 40_000);
        let inside = map.phase_rad.indexed_iter().filter(|((r, c), _)| {
            let (l, m) = (grid.l_at(*c as f64), grid.m_at(*r as f64));
            (l - 0.02).hypot(m) < map.radius_rad - 2e-3
        });
        assert!(inside.map(|(_, p)| *p).fold(0.0, f64::max) < FRAC_PI_8);
        let far = Validity::new(&elements(&ring), None, &Surface::Plane(1e9), &grid, HZ).unwrap();
        assert_eq!(far.valid, far.pixels);
        assert!(far.largest_rad() < 1e-5 && far.radius_rad > 0.28);
    }
}
