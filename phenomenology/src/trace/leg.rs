//! Rays through clouds, fog banks, rain shafts and haze.
//!
//! A leg is cut where it enters or leaves a body of weather. The parts outside are clear air, as without weather. In the parts inside, the
//! water of all bodies and the air are one [`Mixture`]. Its extinction is absorption: scattering is neglected.

use super::scratch::Scratch;
use super::tracer::Tracer;
use super::weather::{Cuts, Weather};
use crate::atmosphere::{Mixture, PathEnds, PathExtent};
use crate::error::Result;
use crate::geometry::Passage;
use crate::space::Ray;

/// A part of a ray, m.
#[derive(Debug, Clone, Copy)]
struct Part {
    from_m: f64,
    to_m: f64,
    length_m: f64,
}

impl Tracer<'_> {
    /// Adds a leg of a ray that passes through weather. Returns false, and adds nothing, if it meets none.
    pub(super) fn add_weathered(&self, ray: &Ray, to_m: f64, length_m: f64, branch: usize, scratch: &mut Scratch) -> Result<bool> {
        let Some(weather) = &self.weather else { return Ok(false) };
        let mut cuts = std::mem::take(&mut scratch.cuts);
        weather.source.volumes.passages(ray, length_m, &mut cuts.passages);
        let any = !cuts.passages.is_empty();
        if any {
            self.add_parts(weather, ray, (to_m, length_m), branch, &mut cuts, scratch)?;
        }
        scratch.cuts = cuts;
        Ok(any)
    }

    /// Adds the part of an endless ray up to the last point where it leaves weather. Returns the rest of the ray; `None` if there is no
    /// weather on it.
    pub(super) fn leave_weather(&self, ray: &Ray, branch: usize, scratch: &mut Scratch) -> Result<Option<Ray>> {
        let Some(weather) = &self.weather else { return Ok(None) };
        let mut cuts = std::mem::take(&mut scratch.cuts);
        weather.source.volumes.passages(ray, f64::INFINITY, &mut cuts.passages);
        let last_m = cuts.passages.iter().map(|p| p.to).fold(0.0, f64::max);
        let mut rest = None;
        if last_m > 0.0 {
            let mut point = ray.at(last_m);
            // Rounding must not lift the ray above the table of the sky at the top of the body.
            point.z = point.z.min(self.top_m.max(ray.origin.z));
            self.add_parts(weather, ray, (point.z, last_m), branch, &mut cuts, scratch)?;
            rest = Some(Ray::from_unit(point, ray.direction));
        }
        scratch.cuts = cuts;
        Ok(rest)
    }

    /// Whether a ray passes through weather. `cuts` is working memory.
    pub(super) fn meets_weather(&self, ray: &Ray, cuts: &mut Cuts) -> bool {
        let Some(weather) = &self.weather else { return false };
        weather.source.volumes.passages(ray, f64::INFINITY, &mut cuts.passages);
        !cuts.passages.is_empty()
    }

    /// Adds the parts of a leg between its cuts. The leg ends at the height `to_m` after `length_m`.
    fn add_parts(
        &self,
        weather: &Weather<'_>,
        ray: &Ray,
        (to_m, length_m): (f64, f64),
        branch: usize,
        cuts: &mut Cuts,
        scratch: &mut Scratch,
    ) -> Result<()> {
        cuts.at_m.clear();
        cuts.at_m.extend(cuts.passages.iter().flat_map(|p| [p.from, p.to]).filter(|t| (0.0..length_m).contains(t)));
        cuts.at_m.push(length_m);
        cuts.at_m.sort_by(f64::total_cmp);
        cuts.at_m.dedup();
        let (mut start, mut start_m) = (0.0, ray.origin.z);
        for k in 0..cuts.at_m.len() {
            let end = cuts.at_m[k];
            let end_m = if k + 1 == cuts.at_m.len() { to_m } else { ray.at(end).z };
            let middle = 0.5 * (start + end);
            let inside = |p: &&Passage| p.from < middle && middle < p.to;
            cuts.inside.clear();
            cuts.inside.extend(cuts.passages.iter().filter(inside).map(|p| p.volume));
            let part = Part { from_m: start_m, to_m: end_m, length_m: end - start };
            if cuts.inside.is_empty() {
                self.add_air(part.from_m, part.to_m, part.length_m, branch, scratch)?;
            } else {
                self.add_mixture(weather, &cuts.inside, part, branch, scratch)?;
            }
            (start, start_m) = (end, end_m);
        }
        Ok(())
    }

    /// Adds a part inside bodies of weather, in pieces that rise by no more than the pieces of a path through air.
    fn add_mixture(&self, weather: &Weather<'_>, inside: &[u32], part: Part, branch: usize, scratch: &mut Scratch) -> Result<()> {
        let rise_m = (part.to_m - part.from_m).abs();
        let pieces = (1e-3 * rise_m / self.options.tables.path_rise_km).ceil().max(1.0);
        let height = |k: f64| part.from_m + (part.to_m - part.from_m) * (k / pieces);
        let length_m = part.length_m / pieces;
        for k in 0..pieces as u32 {
            let (near_m, far_m) = (height(f64::from(k)), height(f64::from(k) + 1.0));
            let ends = match &self.air {
                Some(_) => {
                    let [from, to] = [near_m, far_m].map(|z| self.altitude_km + 1e-3 * z);
                    let length_km = self.leg_km(from, to, length_m);
                    Some(PathEnds::new(from, to, PathExtent::LengthKm(length_km))?)
                }
                None => None,
            };
            for channel in 0..self.freqs_ghz.len() {
                let mut mixture = Mixture::default();
                let mut around = [0.0; 2];
                if let (Some(air), Some(ends)) = (&self.air, &ends) {
                    around = air.add_to(&mut mixture, channel, ends)?;
                }
                for &body in inside {
                    let tables = &weather.bodies[body as usize];
                    let tau = tables.absorption(channel, 0.5 * (near_m + far_m)) * length_m;
                    let [near, far] = tables.radiance.as_ref().map_or(around, |r| [r[channel]; 2]);
                    mixture.add(tau, near, far);
                }
                let p = mixture.radiation(self.freqs_ghz[channel]);
                scratch.path[channel] = (p.emission_rj_k(), p.transmission());
            }
            self.apply_path(branch, scratch);
        }
        Ok(())
    }
}
