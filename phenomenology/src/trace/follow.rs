//! Following one ray backwards from the antenna through its reflections, with one weight for every plane and channel.

use super::cause::{Cause, Tally};
use super::face::Face;
use super::lattice::{Points, Use};
use super::polar::{local_frame, polarised, reflect, turn};
use super::scatter::{Scattering, heaviest, weight_of};
use super::scratch::{Reach, Scratch};
use super::tracer::{Seen, Spot, Tracer};
use super::weather::Cuts;
use crate::atmosphere::{PathEnds, PathExtent};
use crate::error::Result;
use crate::space::{Ray, Vec3};

/// Longest leg, km. The ground plane has no end, and a nearly horizontal ray may hit it at any distance. Air near the ground is opaque over
/// this length, so a longer leg emits the same.
const LONGEST_KM: f64 = 2000.0;

/// Weight of a mirror ray from which an object in the mirror is visible: a contrast of 250 K changes the pixel by 5 K.
const VISIBLE_MIRROR: f64 = 0.02;

impl Tracer<'_> {
    /// Working memory for rays.
    pub(super) fn scratch(&self) -> Scratch {
        let n = self.freqs_ghz.len() * self.antenna.len();
        Scratch {
            rows: vec![vec![[0.0; 4]; n]],
            sums: vec![0.0; n],
            corrections: vec![0.0; n],
            path: vec![(0.0, 1.0); self.freqs_ghz.len()],
            points: Points::of_pixel(0.0, 0.0),
            speckle_k: self.options.speckle_k,
            scatters: false,
            mirrored: None,
            cuts: Cuts::default(),
            tally: Tally::new(self.options.causes),
        }
    }

    /// Follows a ray. `reference` is the h direction of the antenna, and `points` select the facets of rough surfaces. Writes the
    /// temperatures to `scratch.sums` and `scratch.corrections`, and returns the first hit.
    pub(super) fn follow(
        &self,
        origin: Vec3,
        direction: Vec3,
        reference: Vec3,
        points: Points,
        scratch: &mut Scratch,
    ) -> Result<Option<Seen>> {
        let ray = Ray::from_unit(origin, direction);
        self.follow_from(ray, self.spot(&ray)?, None, reference, points, scratch)
    }

    /// Follows a ray whose first hit is known, and the only solids that its mirrored ray can meet, if they are.
    pub(super) fn follow_from(
        &self,
        ray: Ray,
        first: Option<Spot>,
        mirrored: Option<&[(f64, u32)]>,
        reference: Vec3,
        points: Points,
        scratch: &mut Scratch,
    ) -> Result<Option<Seen>> {
        let planes = self.antenna.len();
        scratch.rows[0].chunks_exact_mut(planes).for_each(|rows| rows.copy_from_slice(&self.antenna));
        scratch.sums.fill(0.0);
        scratch.corrections.fill(0.0);
        scratch.tally.clear();
        (scratch.points, scratch.scatters, scratch.mirrored) = (points, false, None);
        let Some(spot) = first else {
            self.add_sky(&ray, 0, scratch)?;
            scratch.credit(Cause::Sky, 0);
            return Ok(None);
        };
        let cos_incidence = (-ray.direction.dot(spot.normal)).clamp(0.0, 1.0);
        self.walk(ray, spot, mirrored, reference, Reach { bounces: 0, branch: 0, bundle: 1.0 }, scratch)?;
        Ok(Some(Seen { range_m: spot.t, cos_incidence, cover: spot.cover, region: spot.region, face: spot.face }))
    }

    /// Follows a ray from its next hit on. `mirrored` are the only solids that its mirrored ray can meet there, if they are known.
    pub(super) fn walk(
        &self,
        ray: Ray,
        spot: Spot,
        mirrored: Option<&[(f64, u32)]>,
        reference: Vec3,
        reach: Reach,
        scratch: &mut Scratch,
    ) -> Result<()> {
        let (mut ray, mut spot, mut mirrored, mut reference, mut reach) = (ray, spot, mirrored, reference, reach);
        loop {
            let cos = (-ray.direction.dot(spot.normal)).clamp(0.0, 1.0);
            self.add_leg(&ray, spot.point.z, spot.t, reach.branch, scratch)?;
            scratch.credit(Cause::Sky, reach.branch);
            if let Some((local, by)) = local_frame(ray.direction, spot.normal, reference) {
                scratch.rows[reach.branch].iter_mut().for_each(|row| turn(row, by));
                reference = local;
            }
            let left = self.add_surface(&ray, &spot, cos, reference, reach, scratch)?;
            if left * reach.bundle < self.options.min_weight || reach.bounces == self.options.max_bounces {
                self.close(spot.cover, reach.branch, scratch);
                scratch.credit(Cause::of_bounce(reach.bounces), reach.branch);
                return Ok(());
            }
            ray = self.mirror_ray(&ray, &spot);
            let first = reach.bounces == 0 && reach.branch == 0;
            reach.bounces += 1;
            let next = match mirrored.take() {
                Some([]) => None,
                solids => self.spot_of(&ray, solids)?,
            };
            if first && left >= VISIBLE_MIRROR {
                scratch.mirrored = Some(next.as_ref().map_or(Face::SKY, Spot::identity));
            }
            spot = match next {
                Some(spot) => spot,
                None => {
                    self.add_sky(&ray, reach.branch, scratch)?;
                    scratch.credit(Cause::Sky, reach.branch);
                    return Ok(());
                }
            };
        }
    }

    /// The ray that is mirrored at a hit.
    #[inline]
    pub(super) fn mirror_ray(&self, ray: &Ray, spot: &Spot) -> Ray {
        Ray::from_unit(spot.point + spot.normal * self.eps, ray.direction.mirrored(spot.normal).unit())
    }

    /// Adds what a surface emits and scatters, and reflects every antenna row as a mirror. Returns the largest weight left.
    #[inline]
    fn add_surface(&self, ray: &Ray, spot: &Spot, cos: f64, reference: Vec3, reach: Reach, scratch: &mut Scratch) -> Result<f64> {
        let planes = self.antenna.len();
        let tables = &self.surfaces[spot.cover as usize];
        let scatters = tables[0].scatters();
        let along = if tables[0].facets().is_some() { self.along(spot, ray.direction) } else { ray.direction };
        // The rows before the reflection are those that the drawn rays get.
        let draws = scatters && reach.bounces < self.options.max_bounces && (reach.branch > 0 || scratch.points.use_of != Use::Nothing);
        if draws {
            scratch.copy_rows(reach.branch);
        }
        scratch.scatters |= scatters && reach.branch == 0;
        // A level surface scatters the sky; a tilted one is taken to see its own temperature, until drawn facets correct that.
        let scattered_from = if self.is_level(spot) { Cause::Sky } else { Cause::Surroundings };
        let (mut left, mut weights) = (0.0_f64, [0.0_f64; 2]);
        for (channel, table) in tables.iter().enumerate() {
            let (response, scattered) = table.at(cos, along.x, along.y);
            for k in channel * planes..(channel + 1) * planes {
                let (row, sum) = (&mut scratch.rows[reach.branch][k], &mut scratch.sums[k]);
                *sum += polarised(row, response.emitted_k);
                if k == 0 && reach.branch == 0 {
                    scratch.tally.credit(Cause::of_bounce(reach.bounces), *sum);
                }
                if let Some(s) = &scattered {
                    *sum += polarised(row, self.assumed(spot, table, s));
                    if k == 0 && reach.branch == 0 {
                        scratch.tally.credit(scattered_from, *sum);
                    }
                    let facets = [0, 1].map(|p| s.power[p] - s.diffuse[p]);
                    weights = [weights[0].max(weight_of(row, facets)), weights[1].max(weight_of(row, s.diffuse))];
                }
                reflect(row, &response);
                left = left.max(heaviest(row));
            }
        }
        if draws {
            self.correct_scatter(&Scattering { ray, spot, cos, reference }, weights, reach, scratch)?;
        }
        Ok(left)
    }

    /// Ends a ray that is not followed any further. The remaining weight sees radiation at the temperature of the last surface. A world of
    /// one temperature therefore shows exactly that temperature.
    fn close(&self, cover: u32, branch: usize, scratch: &mut Scratch) {
        let planes = self.antenna.len();
        for (k, row) in scratch.rows[branch].iter().enumerate() {
            scratch.sums[k] += 2.0 * row[0] * self.surfaces[cover as usize][k / planes].top_k();
        }
    }

    /// Adds the emission and the loss of air and weather along a ray to the height `to_m`, over a length in m.
    #[inline]
    fn add_leg(&self, ray: &Ray, to_m: f64, length_m: f64, branch: usize, scratch: &mut Scratch) -> Result<()> {
        if self.weather.is_some() && self.add_weathered(ray, to_m, length_m, branch, scratch)? {
            return Ok(());
        }
        self.add_air(ray.origin.z, to_m, length_m, branch, scratch)
    }

    /// Length of a leg in km between two heights in km. Rounding must not make it shorter than its rise.
    #[inline]
    pub(super) fn leg_km(&self, from_km: f64, to_km: f64, length_m: f64) -> f64 {
        (1e-3 * length_m).max((from_km - to_km).abs()).min(LONGEST_KM)
    }

    /// Adds the emission and the loss of clear air between two heights in m over a length in m.
    #[inline]
    pub(super) fn add_air(&self, from_m: f64, to_m: f64, length_m: f64, branch: usize, scratch: &mut Scratch) -> Result<()> {
        let Some(air) = &self.air else { return Ok(()) };
        let (from, to) = (self.altitude_km + 1e-3 * from_m, self.altitude_km + 1e-3 * to_m);
        let length = self.leg_km(from, to, length_m);
        for (channel, path) in scratch.path.iter_mut().enumerate() {
            *path = match air.of_piece(channel, from, to, length) {
                Some(piece) => piece,
                None => {
                    let p = air.radiation(channel, &PathEnds::new(from, to, PathExtent::LengthKm(length))?)?;
                    (p.emission_rj_k(), p.transmission())
                }
            };
        }
        self.apply_path(branch, scratch);
        Ok(())
    }

    #[inline]
    pub(super) fn apply_path(&self, branch: usize, scratch: &mut Scratch) {
        let planes = self.antenna.len();
        let rows = scratch.rows[branch].chunks_exact_mut(planes);
        for ((rows, sums), (emission_k, transmission)) in rows.zip(scratch.sums.chunks_exact_mut(planes)).zip(&scratch.path) {
            for (row, sum) in rows.iter_mut().zip(sums) {
                *sum += 2.0 * row[0] * emission_k;
                row.iter_mut().for_each(|w| *w *= transmission);
            }
        }
    }

    /// Adds the sky, or the black ground under a scene without ground, with the weather before it.
    pub(super) fn add_sky(&self, ray: &Ray, branch: usize, scratch: &mut Scratch) -> Result<()> {
        if self.weather.is_some()
            && (ray.direction.z >= 0.0 || self.air.is_none())
            && let Some(rest) = self.leave_weather(ray, branch, scratch)?
        {
            return self.add_clear_sky(&rest, branch, scratch);
        }
        self.add_clear_sky(ray, branch, scratch)
    }

    /// Adds the sky behind all weather, or the black ground.
    fn add_clear_sky(&self, ray: &Ray, branch: usize, scratch: &mut Scratch) -> Result<()> {
        let planes = self.antenna.len();
        let (z, cos) = (ray.origin.z, ray.direction.z);
        if cos < 0.0 && self.air.is_some() {
            let depth = z.max(0.0);
            self.add_leg(ray, z - depth, (depth / -cos).min(1e3 * LONGEST_KM), branch, scratch)?;
            for (k, row) in scratch.rows[branch].iter().enumerate() {
                scratch.sums[k] += 2.0 * row[0] * self.below_k[k / planes];
            }
            return Ok(());
        }
        let height_km = self.altitude_km + 1e-3 * z;
        let (level, level_km) = self.sky.level_above(height_km)?;
        let rise_m = 1e3 * (level_km - height_km);
        // There are tables at a few heights. The air between the ray and the next table is added.
        if rise_m > 1e-3 {
            self.add_air(z, z + rise_m, (rise_m / cos.max(1e-9)).min(1e3 * LONGEST_KM), branch, scratch)?;
        }
        let rows = scratch.rows[branch].chunks_exact(planes);
        for (channel, (rows, sums)) in rows.zip(scratch.sums.chunks_exact_mut(planes)).enumerate() {
            let sky_k = self.sky.rj_k(level, channel, cos.abs());
            rows.iter().zip(sums).for_each(|(row, sum)| *sum += 2.0 * row[0] * sky_k);
        }
        Ok(())
    }
}
