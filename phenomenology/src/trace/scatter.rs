//! Radiation that a surface scatters to the antenna, by facets or by its diffuse lobe: what lies in the way of the sky.
//!
//! The table of a surface holds the open sky that the level surface scatters. This sum is exact, and nothing is drawn for it. Drawn rays
//! then correct it: each adds what it meets and subtracts the sky that the table assumed in its direction. A ray
//! that meets nothing adds exactly zero, so ground and sea under an open sky show no noise, and a world of one temperature shows that temperature. On
//! a surface that is not level, one temperature takes the place of the sky: that of the surface for facets, and the mean of sky and surface by
//! its tilt for the diffuse lobe.

use super::lattice::Use;
use super::polar::{local_frame, polarised, reflect, turn};
use super::scratch::{Reach, Scratch};
use super::tracer::{Spot, Tracer};
use super::weather::Cuts;
use crate::error::Result;
use crate::radiometry::{DiffuseTable, Scattered, SurfaceTable};
use crate::space::{Ray, Vec3};
use crate::surfaces::FacetPath;

/// Contrast between an object and the sky behind it for which the number of rays is chosen, K.
const CONTRAST_K: f64 = 250.0;
/// Rms error of the mean over one point for a contrast of 1, extrapolated from many points. The error falls with the power 3/4 of the number of
/// points, because the outlines of objects cut the square of points.
const ERROR: f64 = 0.45;
/// Largest number of rays for a pixel.
const MOST: usize = 1024;
/// Noise of the diffuse lobe of a surface that is seen in a mirror, as a multiple of `speckle_k`.
const MIRRORED_LOBE: f64 = 4.0;
/// Fraction of the points that search for objects, and their least number. If all of them meet open sky, the pixel is done.
const SEARCH: (usize, usize) = (8, 32);

/// How radiation leaves a surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Way {
    /// Mirrored by facets.
    Facets,
    /// Through the diffuse lobe.
    Lobe,
}

/// A ray that leaves a surface, in the frame of its plane.
#[derive(Debug, Clone, Copy)]
enum Leaving {
    Facets(FacetPath),
    Lobe(Vec3),
}

impl Leaving {
    #[inline]
    fn direction(&self) -> Vec3 {
        match self {
            Self::Facets(path) => path.direction,
            Self::Lobe(direction) => *direction,
        }
    }
}

/// The plane of a surface: two axes in it, and its normal. On level ground the axes point east and north.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plane {
    axes: [Vec3; 3],
}

impl Plane {
    /// The plane with a unit normal: level ground after the smallest rotation.
    #[inline]
    pub(super) fn with_normal(n: Vec3) -> Self {
        if n.z < -0.999_999 {
            return Self { axes: [Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, -1.0, 0.0), n] };
        }
        let a = 1.0 / (1.0 + n.z);
        Self { axes: [Vec3::new(1.0 - a * n.x * n.x, -a * n.x * n.y, -n.x), Vec3::new(-a * n.x * n.y, 1.0 - a * n.y * n.y, -n.y), n] }
    }

    /// A vector in the frame of the plane.
    #[inline]
    pub(super) fn local(&self, d: Vec3) -> Vec3 {
        let [x, y, z] = self.axes;
        Vec3::new(d.dot(x), d.dot(y), d.dot(z))
    }

    /// A vector of the frame of the plane.
    #[inline]
    pub(super) fn global(&self, d: Vec3) -> Vec3 {
        let [x, y, z] = self.axes;
        x * d.x + y * d.y + z * d.z
    }
}

/// A hit on a surface that scatters.
pub(super) struct Scattering<'a> {
    pub ray: &'a Ray,
    pub spot: &'a Spot,
    pub cos: f64,
    pub reference: Vec3,
}

impl Tracer<'_> {
    /// What the table of a surface assumes that it scatters, `[h, v]`, RJ, K.
    #[inline]
    pub(super) fn assumed(&self, spot: &Spot, table: &SurfaceTable, s: &Scattered) -> [f64; 2] {
        if self.is_level(spot) {
            return s.sky_k;
        }
        let around_k = around_k(spot, table);
        [0, 1].map(|p| (s.power[p] - s.diffuse[p]) * table.top_k() + s.diffuse[p] * around_k)
    }

    /// A direction in the frame of a surface.
    #[inline]
    pub(super) fn along(&self, spot: &Spot, direction: Vec3) -> Vec3 {
        Plane::with_normal(spot.normal).local(direction)
    }

    /// Whether a surface scatters the sky of its table.
    #[inline]
    pub(super) fn is_level(&self, spot: &Spot) -> bool {
        spot.normal.z > self.level
    }

    /// Corrects the table for everything but open sky that the surface scatters. `weights` are the largest weights in a row of what facets and
    /// the lobe scatter. The rows before the reflection lie one place behind those of the ray.
    pub(super) fn correct_scatter(&self, hit: &Scattering<'_>, weights: [f64; 2], reach: Reach, scratch: &mut Scratch) -> Result<()> {
        let [of_facets, of_lobe] = weights;
        if of_facets * reach.bundle >= self.options.min_weight {
            self.gather(Way::Facets, hit, of_facets, reach, scratch)?;
        }
        // An object that covers half of the sky of this surface changes the pixel by less than its noise.
        if 0.5 * CONTRAST_K * of_lobe * reach.bundle >= scratch.speckle_k {
            self.gather(Way::Lobe, hit, of_lobe, reach, scratch)?;
        }
        Ok(())
    }

    /// The number of rays for a scattered weight.
    fn rays(&self, way: Way, weight: f64, reach: Reach, scratch: &Scratch) -> usize {
        // The lobe of a surface that is seen in a mirror is smooth, and few pixels show it.
        let coarser = if way == Way::Lobe && reach.bounces > 0 { MIRRORED_LOBE } else { 1.0 };
        let error = ERROR * CONTRAST_K * weight / (coarser * scratch.speckle_k);
        // Powers of two, so that channels of nearly the same reflectivity use the same points alone and together.
        scratch.points.count((error.powf(4.0 / 3.0).ceil() as usize).next_power_of_two().min(MOST))
    }

    /// Adds what drawn rays meet, less what the table assumed.
    fn gather(&self, way: Way, hit: &Scattering<'_>, weight: f64, reach: Reach, scratch: &mut Scratch) -> Result<()> {
        let facets = self.surfaces[hit.spot.cover as usize][0].facets();
        let plane = Plane::with_normal(hit.spot.normal);
        let observer = plane.local(-hit.ray.direction);
        let level = self.is_level(hit.spot);
        let (points, count) = match (reach.branch, scratch.points.use_of) {
            (0, Use::Nothing) => return Ok(()),
            (0, _) => (scratch.points, self.rays(way, weight, reach, scratch)),
            _ => (scratch.points.of_place(hit.spot.point), 1),
        };
        let leave = |k: usize| {
            let draw = points.at(k, count);
            let paths = match (way, facets) {
                (Way::Lobe, _) => [Some(Leaving::Lobe(DiffuseTable::draw(draw))), None],
                (Way::Facets, Some(facets)) => facets.draw(observer, draw).map(|path| path.map(Leaving::Facets)),
                (Way::Facets, None) => [None; 2],
            };
            paths.into_iter().flatten()
        };
        let ray_of =
            |leaving: &Leaving| Ray::from_unit(hit.spot.point + hit.spot.normal * self.eps, plane.global(leaving.direction()).unit());
        if level
            && points.use_of == Use::Search
            && self
                .all_open((0..(count / SEARCH.0).max(SEARCH.1).min(count)).flat_map(leave).map(|path| ray_of(&path)), &mut scratch.cuts)?
        {
            return Ok(());
        }
        // The rays of a branch of the first kind are the correction.
        let correction = reach.branch == 0;
        if correction {
            std::mem::swap(&mut scratch.sums, &mut scratch.corrections);
        }
        for leaving in (0..count).flat_map(leave) {
            let ray = ray_of(&leaving);
            let next = self.spot(&ray)?;
            if level && next.is_none() && !self.meets_weather(&ray, &mut scratch.cuts) {
                continue;
            }
            let share = 1.0 / count as f64;
            let reference = match &leaving {
                Leaving::Facets(path) => self.branch(hit, &plane, path, share, reach, scratch),
                Leaving::Lobe(_) => self.branch_lobe(hit, &ray, share, reach, scratch),
            };
            self.subtract_assumed(way, hit, &ray, reach.branch + 2, scratch);
            match next {
                Some(spot) => self.walk(ray, spot, None, reference, reach.next_branch(count), scratch)?,
                None => self.add_sky(&ray, reach.branch + 2, scratch)?,
            }
        }
        if correction {
            std::mem::swap(&mut scratch.sums, &mut scratch.corrections);
        }
        Ok(())
    }

    /// Whether rays meet nothing but clear sky. `cuts` is working memory.
    fn all_open(&self, rays: impl Iterator<Item = Ray>, cuts: &mut Cuts) -> Result<bool> {
        for ray in rays {
            if self.spot(&ray)?.is_some() || self.meets_weather(&ray, cuts) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Sets the rows of a ray that leaves through facets. Returns the reference direction of the rows.
    fn branch(&self, hit: &Scattering<'_>, plane: &Plane, path: &FacetPath, share: f64, reach: Reach, scratch: &mut Scratch) -> Vec3 {
        let planes = self.antenna.len();
        scratch.copy_rows(reach.branch + 1);
        let rows = &mut scratch.rows[reach.branch + 2];
        let (mut direction, mut reference) = (hit.ray.direction, hit.reference);
        for (bounce, normal) in path.normals[..path.facets].iter().enumerate() {
            let normal = plane.global(*normal);
            let cos = (-direction.dot(normal)).clamp(0.0, 1.0);
            if let Some((local, by)) = local_frame(direction, normal, reference) {
                rows.iter_mut().for_each(|row| turn(row, by));
                reference = local;
            }
            for (table, rows) in self.surfaces[hit.spot.cover as usize].iter().zip(rows.chunks_exact_mut(planes)) {
                let Some(facets) = table.facets() else { continue };
                let response = facets.reflection(cos);
                let factor = if bounce == 0 { path.weight * share * facets.seen(hit.cos) } else { 1.0 };
                for row in rows {
                    reflect(row, &response);
                    row.iter_mut().for_each(|w| *w *= factor);
                }
            }
            direction = direction.mirrored(normal);
        }
        reference
    }

    /// Sets the rows of a ray that leaves through the diffuse lobe, which keeps no polarisation but that of its albedo. Returns the reference
    /// direction of the rows.
    fn branch_lobe(&self, hit: &Scattering<'_>, ray: &Ray, share: f64, reach: Reach, scratch: &mut Scratch) -> Vec3 {
        let planes = self.antenna.len();
        scratch.copy_rows(reach.branch + 1);
        let tables = &self.surfaces[hit.spot.cover as usize];
        let cos = ray.direction.dot(hit.spot.normal).clamp(0.0, 1.0);
        for (table, rows) in tables.iter().zip(scratch.rows[reach.branch + 2].chunks_exact_mut(planes)) {
            let Some(lobe) = table.diffuse() else { continue };
            let (observer, [h, v]) = (lobe.albedo(hit.cos), lobe.source(cos));
            for row in rows {
                let seen = share * polarised(row, observer);
                *row = [0.5 * seen * (v + h), 0.5 * seen * (v - h), 0.0, 0.0];
            }
        }
        let across = ray.direction.cross(hit.spot.normal);
        // Straight up, h and v have the same albedo.
        if across.norm() > 1e-12 { across.unit() } else { Plane::with_normal(hit.spot.normal).axes[0] }
    }

    /// Subtracts what the table assumed in the direction of a ray.
    fn subtract_assumed(&self, way: Way, hit: &Scattering<'_>, ray: &Ray, branch: usize, scratch: &mut Scratch) {
        let planes = self.antenna.len();
        let level = self.is_level(hit.spot);
        for (k, row) in scratch.rows[branch].iter().enumerate() {
            let table = &self.surfaces[hit.spot.cover as usize][k / planes];
            let assumed_k = match way {
                _ if level => self.sky.rj_k(self.open_level, k / planes, ray.direction.z),
                Way::Facets => table.top_k(),
                Way::Lobe => around_k(hit.spot, table),
            };
            scratch.sums[k] -= 2.0 * row[0] * assumed_k;
        }
    }
}

/// The temperature that the lobe of a tilted surface is taken to see, RJ, K.
#[inline]
fn around_k(spot: &Spot, table: &SurfaceTable) -> f64 {
    table.diffuse().map_or(table.top_k(), |lobe| lobe.surroundings_k(spot.normal.z, table.top_k()))
}

/// The weight of unpolarised radiation that is scattered with the powers `[h, v]`, and at most that of polarised radiation.
#[inline]
pub(super) fn weight_of(row: &[f64; 4], [h, v]: [f64; 2]) -> f64 {
    (row[0] * (v + h) + row[1] * (v - h)).abs() + (row[2].abs() + row[3].abs()) * (h * v).sqrt()
}

/// The largest weight of a row.
#[inline]
pub(super) fn heaviest(row: &[f64; 4]) -> f64 {
    2.0 * row.iter().fold(0.0_f64, |most, w| most.max(w.abs()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes_are_right_handed_and_level_ground_keeps_its_axes() {
        for n in [[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [0.0, -0.6, -0.8], [0.0, 0.0, -1.0], [0.36, 0.48, 0.8]] {
            let n = Vec3::from(n);
            let plane = Plane::with_normal(n);
            let [x, y, z] = plane.axes;
            assert!((x.cross(y) - n).norm() < 1e-14 && (x.norm() - 1.0).abs() < 1e-14 && z == n);
            let d = Vec3::new(0.1, -0.7, 0.4);
            assert!((plane.global(plane.local(d)) - d).norm() < 1e-14);
        }
        assert_eq!(Plane::with_normal(Vec3::UP).local(Vec3::new(1.0, 2.0, 3.0)), Vec3::new(1.0, 2.0, 3.0));
    }
}
