//! Following one ray backwards from the antenna through its reflections, with one weight for every plane and channel.

use super::polar::{local_frame, polarised, reflect, turn};
use super::tracer::{Seen, Spot, Tracer};
use crate::atmosphere::{PathEnds, PathExtent};
use crate::error::Result;
use crate::space::{Ray, Vec3};

/// Longest leg, km. The ground plane has no end, and a nearly horizontal ray may hit it at any distance. Air near the ground is opaque over
/// this length, so a longer leg emits the same.
const LONGEST_KM: f64 = 2000.0;

/// Working memory of a ray; one for each thread.
#[derive(Debug, Clone, Default)]
pub(super) struct Scratch {
    /// Antenna rows. // [chan, pol]
    rows: Vec<[f64; 4]>,
    /// Temperatures summed so far, RJ, K. // [chan, pol]
    pub sums: Vec<f64>,
    /// Sky scattered by the surface of facets that was hit last. // [chan, pol]
    scattered: Vec<f64>,
    /// Emission (RJ, K) and transmission of the leg. // [chan]
    path: Vec<(f64, f64)>,
}

impl Tracer<'_> {
    /// Working memory for rays.
    pub(super) fn scratch(&self) -> Scratch {
        let n = self.freqs_ghz.len() * self.antenna.len();
        Scratch { rows: vec![[0.0; 4]; n], sums: vec![0.0; n], scattered: vec![0.0; n], path: vec![(0.0, 1.0); self.freqs_ghz.len()] }
    }

    /// Follows a ray. `reference` is the h direction of the antenna. Writes the temperatures to `scratch.sums` and returns the first hit.
    pub(super) fn follow(&self, origin: Vec3, direction: Vec3, reference: Vec3, scratch: &mut Scratch) -> Result<Option<Seen>> {
        let planes = self.antenna.len();
        for (k, row) in scratch.rows.iter_mut().enumerate() {
            *row = self.antenna[k % planes];
        }
        scratch.sums.fill(0.0);
        let mut ray = Ray::from_unit(origin, direction);
        let mut reference = reference;
        let mut seen = None;
        let mut from_rough = false;
        for bounce in 0..=self.options.max_bounces {
            let Some(spot) = self.spot(&ray)? else {
                if from_rough && ray.direction.z >= 0.0 {
                    for (sum, s) in scratch.sums.iter_mut().zip(&scratch.scattered) {
                        *sum += s;
                    }
                } else {
                    self.add_sky(&ray, scratch)?;
                }
                return Ok(seen);
            };
            let cos = (-ray.direction.dot(spot.normal)).clamp(0.0, 1.0);
            if bounce == 0 {
                seen = Some(Seen { range_m: spot.t, cos_incidence: cos, cover: spot.cover, region: spot.region, face: spot.face });
            }
            self.add_leg(ray.origin.z, spot.point.z, spot.t, scratch)?;
            if let Some((local, by)) = local_frame(ray.direction, spot.normal, reference) {
                scratch.rows.iter_mut().for_each(|row| turn(row, by));
                reference = local;
            }
            let (rough, heaviest) = self.add_surface(&ray, &spot, cos, scratch);
            from_rough = rough && spot.normal.z > self.level;
            if heaviest < self.options.min_weight || bounce == self.options.max_bounces {
                self.close(spot.cover, from_rough, scratch);
                return Ok(seen);
            }
            let direction = self.mirrored(&ray, &spot, from_rough);
            ray = Ray::from_unit(spot.point + spot.normal * self.eps, direction);
        }
        Ok(seen)
    }

    /// Direction of a reflected ray. On a level surface of facets one facet reflects the ray, so that objects near the surface have blurred
    /// images. The position of the hit selects the facet, so the picture is always the same.
    #[inline]
    fn mirrored(&self, ray: &Ray, spot: &Spot, rough: bool) -> Vec3 {
        if rough
            && let Some(facet) = self.surfaces[spot.cover as usize][0].facet(normal_pair(spot.point))
            && facet.dot(ray.direction) < 0.0
        {
            let direction = ray.direction.mirrored(facet);
            if direction.z > 0.0 {
                return direction.unit();
            }
        }
        ray.direction.mirrored(spot.normal).unit()
    }

    /// Adds the emission of a surface, and reflects every antenna row. Returns whether the surface has facets, and the largest weight left.
    #[inline]
    fn add_surface(&self, ray: &Ray, spot: &Spot, cos: f64, scratch: &mut Scratch) -> (bool, f64) {
        let planes = self.antenna.len();
        let (mut rough, mut heaviest) = (false, 0.0_f64);
        for (channel, table) in self.surfaces[spot.cover as usize].iter().enumerate() {
            let (response, scattered) = table.at(cos, ray.direction.x, ray.direction.y);
            rough = scattered.is_some();
            for k in channel * planes..(channel + 1) * planes {
                let row = &mut scratch.rows[k];
                scratch.sums[k] += polarised(row, response.emitted_k);
                if let Some(s) = scattered {
                    scratch.scattered[k] = polarised(row, s);
                }
                reflect(row, &response);
                heaviest = heaviest.max(2.0 * row[0].abs()).max(2.0 * row[1].abs()).max(2.0 * row[2].abs()).max(2.0 * row[3].abs());
            }
        }
        (rough, heaviest)
    }

    /// Ends a ray that is not followed any further. The remaining weight sees the scattered sky of a level surface of facets, or else
    /// radiation at the temperature of the last surface. A world of one temperature therefore shows exactly that temperature.
    fn close(&self, cover: u32, from_rough: bool, scratch: &mut Scratch) {
        let planes = self.antenna.len();
        for k in 0..scratch.sums.len() {
            scratch.sums[k] += if from_rough {
                scratch.scattered[k]
            } else {
                2.0 * scratch.rows[k][0] * self.surfaces[cover as usize][k / planes].top_k()
            };
        }
    }

    /// Adds the emission and the loss of the air between two heights in m over a length in m.
    #[inline]
    fn add_leg(&self, from_m: f64, to_m: f64, length_m: f64, scratch: &mut Scratch) -> Result<()> {
        let Some(air) = &self.air else { return Ok(()) };
        let (from, to) = (self.altitude_km + 1e-3 * from_m, self.altitude_km + 1e-3 * to_m);
        // Rounding must not make a leg shorter than its rise.
        let length = (1e-3 * length_m).max((from - to).abs()).min(LONGEST_KM);
        let ends = PathEnds::new(from, to, PathExtent::LengthKm(length))?;
        for (channel, path) in scratch.path.iter_mut().enumerate() {
            let p = air.radiation(channel, &ends)?;
            *path = (p.emission_rj_k(), p.transmission());
        }
        self.apply_path(scratch);
        Ok(())
    }

    #[inline]
    fn apply_path(&self, scratch: &mut Scratch) {
        let planes = self.antenna.len();
        for (k, row) in scratch.rows.iter_mut().enumerate() {
            let (emission_k, transmission) = scratch.path[k / planes];
            scratch.sums[k] += 2.0 * row[0] * emission_k;
            row.iter_mut().for_each(|w| *w *= transmission);
        }
    }

    /// Adds the sky, or the black ground under a scene without ground.
    fn add_sky(&self, ray: &Ray, scratch: &mut Scratch) -> Result<()> {
        let planes = self.antenna.len();
        let (z, cos) = (ray.origin.z, ray.direction.z);
        if cos < 0.0 && self.air.is_some() {
            let depth = z.max(0.0);
            self.add_leg(z, z - depth, (depth / -cos).min(1e3 * LONGEST_KM), scratch)?;
            for (k, row) in scratch.rows.iter().enumerate() {
                scratch.sums[k] += 2.0 * row[0] * self.below_k[k / planes];
            }
            return Ok(());
        }
        let height_km = self.altitude_km + 1e-3 * z;
        let (level, level_km) = self.sky.level_above(height_km)?;
        let rise_m = 1e3 * (level_km - height_km);
        // There are tables at a few heights. The air between the ray and the next table is added.
        if rise_m > 1e-3 {
            self.add_leg(z, z + rise_m, (rise_m / cos.max(1e-9)).min(1e3 * LONGEST_KM), scratch)?;
        }
        for (k, row) in scratch.rows.iter().enumerate() {
            scratch.sums[k] += 2.0 * row[0] * self.sky.rj_k(level, k / planes, cos.abs());
        }
        Ok(())
    }
}

/// Two standard normal numbers that depend on nothing but a position.
fn normal_pair(p: Vec3) -> [f64; 2] {
    // splitmix64 (Steele et al. 2014) of the bits of the coordinates.
    let mix = |mut z: u64| {
        z = z.wrapping_add(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    };
    let first = mix(mix(p.x.to_bits()) ^ p.y.to_bits().rotate_left(32));
    let unit = |z: u64| ((z >> 11) as f64 + 0.5) / (1_u64 << 53) as f64;
    let (radius, angle) = ((-2.0 * unit(first).ln()).sqrt(), std::f64::consts::TAU * unit(mix(first)));
    // The functions of libm give the same bits on every machine.
    [radius * libm::cos(angle), radius * libm::sin(angle)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_are_standard_normal_and_repeat() {
        let at = |k: u32| normal_pair(Vec3::new(f64::from(k) * 0.01, 3.0, 0.0));
        assert_eq!(at(7), at(7));
        let n = 40_000;
        let (mut mean, mut square, mut product) = ([0.0; 2], [0.0; 2], 0.0);
        for k in 0..n {
            let d = at(k);
            for i in 0..2 {
                mean[i] += d[i];
                square[i] += d[i] * d[i];
            }
            product += d[0] * d[1];
        }
        let n = f64::from(n);
        // Five standard errors.
        assert!(mean.iter().all(|m| (m / n).abs() < 5.0 / n.sqrt()), "{mean:?}");
        assert!(square.iter().all(|s| (s / n - 1.0).abs() < 5.0 * (2.0 / n).sqrt()), "{square:?}");
        assert!((product / n).abs() < 5.0 / n.sqrt());
    }
}
