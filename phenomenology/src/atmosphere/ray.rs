//! Rays through the grid: straight in plane-parallel air, or refracted around a spherical Earth.

use super::air_grid::Levels;
use super::error::PhysicsError;

/// Mean radius of the Earth, km.
pub const EARTH_RADIUS_KM: f64 = 6370.95;

/// The end of a ray at the border of the grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum RayEnd {
    /// Through the top.
    Space,
    /// At the lowest level.
    Ground,
}

/// The part of a ray between two neighbouring levels, nearest the observer first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Step {
    /// Index of the level below.
    pub(super) segment: usize,
    /// Length of the ray, km.
    pub(super) length_km: f64,
    /// Where the observer's end lies: 0 at the level below, 1 at the level above.
    pub(super) near: f64,
    /// Where the far end lies.
    pub(super) far: f64,
}

impl Step {
    fn up(segment: usize, length_km: f64) -> Self {
        Self { segment, length_km, near: 0.0, far: 1.0 }
    }

    fn down(segment: usize, length_km: f64) -> Self {
        Self { segment, length_km, near: 1.0, far: 0.0 }
    }
}

/// A ray from an observer outward.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Ray {
    pub(super) steps: Vec<Step>,
    pub(super) end: RayEnd,
}

impl Ray {
    /// Length of the ray, km.
    pub(super) fn length_km(&self) -> f64 {
        self.steps.iter().map(|step| step.length_km).sum()
    }

    /// A straight ray from one level to another, `stretch` times the height difference.
    pub(super) fn straight(levels: &Levels, from: usize, to: usize, stretch: f64) -> Self {
        let length = |i: usize| (levels.z_km[i + 1] - levels.z_km[i]) * stretch;
        let (steps, end) = if to >= from {
            ((from..to).map(|i| Step::up(i, length(i))).collect(), RayEnd::Space)
        } else {
            ((to..from).rev().map(|i| Step::down(i, length(i))).collect(), RayEnd::Ground)
        };
        Self { steps, end }
    }

    /// A ray bent by refraction, seen from a level at a zenith angle of 0 to 180 degrees.
    ///
    /// By Snell's law in a sphere `q sin z` is constant, with `q = n r`. With `q` linear in
    /// `r` between levels the length is exact: `dr (q1 + q2)/(s1 + s2)`, `s = q cos z`.
    /// Rays below the horizontal pass a tangent height or meet the ground.
    ///
    /// # Errors
    /// [`PhysicsError::Ducting`] for a rising ray that is turned back.
    pub(super) fn refracted(levels: &Levels, from: usize, zenith_deg: f64) -> Result<Self, PhysicsError> {
        let radius = |i: usize| EARTH_RADIUS_KM + levels.z_km[i];
        let q = |i: usize| levels.index[i] * radius(i);
        let last = levels.z_km.len() - 1;
        let cosine = if zenith_deg == 90.0 { 0.0 } else { zenith_deg.to_radians().cos() };
        // s^2 is updated by differences, so that no digits are lost near 90 degrees.
        let mut s = q(from) * cosine.abs();
        let mut level = from;
        let mut steps = Vec::with_capacity(last);

        if cosine < 0.0 {
            loop {
                let Some(below) = level.checked_sub(1) else {
                    return Ok(Self { steps, end: RayEnd::Ground });
                };
                let (q_high, q_low) = (q(level), q(below));
                let dr = radius(level) - radius(below);
                let s2_low = s * s - (q_high - q_low) * (q_high + q_low);
                if s2_low >= 0.0 {
                    let s_low = s2_low.sqrt();
                    steps.push(Step::down(below, ray_length(dr, q_high + q_low, s + s_low)));
                    s = s_low;
                    level = below;
                } else {
                    // The tangent point lies inside the segment. The ray goes down to it and up again by the same length.
                    let q_tangent = (q_high * q_high - s * s).sqrt();
                    let drop = s * s / (q_high + q_tangent) / (q_high - q_low);
                    let length_km = ray_length(dr * drop, q_high + q_tangent, s);
                    let at = 1.0 - drop;
                    steps.push(Step { segment: below, length_km, near: 1.0, far: at });
                    steps.push(Step { segment: below, length_km, near: at, far: 1.0 });
                    break;
                }
            }
        }
        while level < last {
            let (q_low, q_high) = (q(level), q(level + 1));
            let s2_high = s * s + (q_high - q_low) * (q_high + q_low);
            if s2_high <= 0.0 {
                return Err(PhysicsError::Ducting { height_km: levels.z_km[level], zenith_deg });
            }
            let s_high = s2_high.sqrt();
            let dr = radius(level + 1) - radius(level);
            steps.push(Step::up(level, ray_length(dr, q_low + q_high, s + s_high)));
            s = s_high;
            level += 1;
        }
        Ok(Self { steps, end: RayEnd::Space })
    }

    /// The zenith angle in degrees below which rays from a level meet the ground.
    pub(super) fn horizon_deg(levels: &Levels, from: usize) -> f64 {
        let q = |i: usize| levels.index[i] * (EARTH_RADIUS_KM + levels.z_km[i]);
        let lowest = (0..=from).map(q).fold(f64::INFINITY, f64::min);
        180.0 - (lowest / q(from)).min(1.0).asin().to_degrees()
    }
}

fn ray_length(dr: f64, q_sum: f64, s_sum: f64) -> f64 {
    if dr == 0.0 { 0.0 } else { dr * q_sum / s_sum }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vacuum() -> Levels {
        let z_km: Vec<f64> = (0..=60).map(|i| f64::from(i) * 0.5).collect();
        Levels { t_k: vec![250.0; 61], index: vec![1.0; 61], z_km }
    }

    /// In vacuum rays are straight: the chord of a sphere is known.
    fn chord_km(from_km: f64, to_km: f64, zenith_deg: f64) -> f64 {
        let (r1, r2) = (EARTH_RADIUS_KM + from_km, EARTH_RADIUS_KM + to_km);
        let c = zenith_deg.to_radians().cos();
        -r1 * c + (r1 * r1 * c * c + r2 * r2 - r1 * r1).sqrt()
    }

    #[test]
    fn vacuum_rays_are_chords() {
        let levels = vacuum();
        for zenith in [0.0, 45.0, 80.0, 89.0, 90.0] {
            let ray = Ray::refracted(&levels, 0, zenith).unwrap();
            let expected = chord_km(0.0, 30.0, zenith);
            assert!((ray.length_km() / expected - 1.0).abs() < 1e-9, "{zenith}");
        }
    }

    #[test]
    fn tangent_rays_are_chords_too() {
        let levels = vacuum();
        for zenith in [90.001, 90.5, 91.0, 91.7] {
            let ray = Ray::refracted(&levels, 10, zenith).unwrap();
            assert_eq!(ray.end, RayEnd::Space);
            let expected = chord_km(5.0, 30.0, zenith);
            assert!((ray.length_km() / expected - 1.0).abs() < 1e-5, "{zenith}");
        }
    }

    #[test]
    fn steep_rays_meet_the_ground() {
        let levels = vacuum();
        let horizon = Ray::horizon_deg(&levels, 10);
        let dip = (EARTH_RADIUS_KM / (EARTH_RADIUS_KM + 5.0)).acos().to_degrees();
        assert!((horizon - 90.0 - dip).abs() < 1e-9);
        assert_eq!(Ray::refracted(&levels, 10, horizon - 1e-6).unwrap().end, RayEnd::Space);
        assert_eq!(Ray::refracted(&levels, 10, horizon + 1e-6).unwrap().end, RayEnd::Ground);
        let nadir = Ray::refracted(&levels, 10, 180.0).unwrap();
        assert!((nadir.length_km() - 5.0).abs() < 1e-9);
    }

    #[test]
    fn strong_gradient_traps_a_grazing_ray() {
        let mut levels = vacuum();
        levels.index[0] = 1.0003;
        levels.index[1] = 1.0001;
        let error = Ray::refracted(&levels, 0, 90.0).unwrap_err();
        assert!(matches!(error, PhysicsError::Ducting { .. }));
        assert!(Ray::refracted(&levels, 0, 85.0).is_ok());
    }

    #[test]
    fn refraction_lengthens_the_ray_near_the_horizon() {
        let mut levels = vacuum();
        for (n, z) in levels.index.iter_mut().zip(&levels.z_km) {
            *n = 1.0 + 3.2e-4 * (-z / 7.0).exp();
        }
        let bent = Ray::refracted(&levels, 0, 89.0).unwrap().length_km();
        // Bending makes the path longer near the ground for the same zenith angle.
        assert!(bent > chord_km(0.0, 30.0, 89.0));
        assert!(bent < 1.1 * chord_km(0.0, 30.0, 89.0));
    }
}
