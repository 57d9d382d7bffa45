//! Paths of constant temperature with optical depths from a table, for ray tracing.
//!
//! `T_up = T_m (1 - exp(-tau))` in radiance, `tau = (L/dz) |tau(0, z1) - tau(0, z2)|`,
//! `T_m` the temperature at the middle height. The error is at most half the temperature
//! difference over the path when it is opaque, and far less when it is thin.

use std::sync::Arc;

use super::air_grid::{Column, Levels};
use super::error::{PhysicsError, check_frequencies, check_range};
use super::mixture::Mixture;
use super::model::Atmosphere;
use super::path::{LEVEL_PATH_KM, LONGEST_PATH_KM, PathEnds};
use super::planck::rayleigh_jeans_temperature_k;
use super::transfer::PathRadiation;

/// Width of the bins in which a search starts, km. It affects only the speed.
const BIN_KM: f64 = 0.05;

/// Depth below the profile down to which its lowest air is used, km.
const BELOW_BOTTOM_KM: f64 = 0.5;

/// Optical depths from the lowest level up, for a list of frequencies.
#[derive(Debug, Clone)]
pub struct PathTable {
    freqs_ghz: Vec<f64>,
    levels: Arc<Levels>,
    /// Segment in the middle of every bin, where a search starts: that of the whole bin in most of them.
    bins: Vec<u32>,
    channels: Vec<Vec<Segment>>,
    max_rise_km: f64,
}

/// Optical depth between two levels: absorption linear in height, scaled to the exact mean.
#[derive(Debug, Clone, Copy)]
struct Segment {
    /// Height of its lower end, km.
    z_km: f64,
    dz_km: f64,
    per_km: f64,
    /// Depth below this segment, Np.
    tau: f64,
    /// Absorption at its lower end, Np/km.
    low: f64,
    /// Absorption at its upper end, Np/km.
    high: f64,
    /// Black-body radiance at its lower end.
    low_radiance: f64,
    /// Black-body radiance at its upper end.
    high_radiance: f64,
}

/// A height as segment and fraction.
#[derive(Debug, Clone, Copy)]
struct Place {
    segment: usize,
    fraction: f64,
    dz_km: f64,
}

impl PathTable {
    /// Builds the table for `freqs_ghz`: index in this list is the channel.
    ///
    /// # Errors
    /// [`PhysicsError::Empty`] or [`PhysicsError::OutOfRange`] for the frequencies, or
    /// layers that cannot exist at their temperature.
    pub fn new(atmosphere: &Atmosphere, freqs_ghz: &[f64]) -> Result<Self, PhysicsError> {
        check_frequencies(freqs_ghz)?;
        let profile = atmosphere.profile();
        let grid = atmosphere.air_grid(profile.bottom_km(), profile.top_km(), &[])?;
        let channels = grid.columns(freqs_ghz)?.iter().map(segments).collect();
        Ok(Self {
            freqs_ghz: freqs_ghz.to_vec(),
            levels: Arc::clone(grid.levels()),
            bins: bins(&grid.levels().z_km),
            channels,
            max_rise_km: f64::INFINITY,
        })
    }

    /// The same table, but paths are divided into equal pieces that rise by at most `max_rise_km`.
    ///
    /// Without this a path is one piece. With 0.2 km the error in the reference atmospheres is below 0.8 K for paths to any height. The cost
    /// is proportional to the number of pieces.
    ///
    /// # Errors
    /// [`PhysicsError::OutOfRange`] outside 0.01-30 km.
    pub fn with_max_rise(mut self, max_rise_km: f64) -> Result<Self, PhysicsError> {
        self.max_rise_km = check_range("rise of a path piece", max_rise_km, "km", 0.01, 30.0)?;
        Ok(self)
    }

    /// Emission and transmission of a path in a channel.
    ///
    /// Heights down to 0.5 km below the profile have its lowest air, because the ground of a scene may lie below its origin.
    ///
    /// # Errors
    /// [`PhysicsError::OutOfRange`] for an unknown channel or an end outside the table.
    pub fn radiation(&self, channel: usize, ends: &PathEnds) -> Result<PathRadiation, PhysicsError> {
        let Some(segments) = self.channels.get(channel) else {
            let last = self.channels.len() as f64 - 1.0;
            return Err(PhysicsError::OutOfRange { quantity: "channel", value: channel as f64, min: 0.0, max: last, unit: "(index)" });
        };
        let freq_ghz = self.freqs_ghz[channel];
        let (observer, target) = self.heights_of(ends)?;

        let rise = ends.height_km();
        if rise < LEVEL_PATH_KM {
            let place = self.locate(observer);
            let segment = &segments[place.segment];
            let tau = segment.absorption(place.fraction) * ends.length_km();
            return Ok(constant_radiance(freq_ghz, tau, segment.radiance(place.fraction)));
        }
        let stretch = ends.length_km() / rise;
        let depth_at = |z_km: f64| depth(segments, self.locate(z_km));
        let piece = |tau: f64, middle_km: f64| {
            let place = self.locate(middle_km);
            constant_radiance(freq_ghz, tau, segments[place.segment].radiance(place.fraction))
        };
        if rise <= self.max_rise_km {
            let tau = (depth_at(observer) - depth_at(target)).abs() * stretch;
            return Ok(piece(tau, 0.5 * (observer + target)));
        }
        // At most 30.5 km in pieces of at least 0.01 km.
        let pieces = (rise / self.max_rise_km).ceil() as u32;
        let at = |steps: f64| observer + (target - observer) * (steps / f64::from(pieces));
        let mut path = PathRadiation { freq_ghz, tau_np: 0.0, emission: 0.0 };
        let mut start_depth = depth_at(observer);
        for i in 0..pieces {
            let end_depth = depth_at(at(f64::from(i + 1)));
            let tau = (end_depth - start_depth).abs() * stretch;
            path = path.then(&piece(tau, at(f64::from(i) + 0.5)));
            start_depth = end_depth;
        }
        Ok(path)
    }

    /// Emission (Rayleigh-Jeans temperature, K) and transmission of a path that rises by at most one piece, as of [`PathTable::radiation`] but in a third of the
    /// time. `None` for other paths, and for those that [`PathTable::radiation`] refuses. The length is at least the rise, km.
    #[must_use]
    #[inline]
    pub fn of_piece(&self, channel: usize, from_km: f64, to_km: f64, length_km: f64) -> Option<(f64, f64)> {
        let segments = self.channels.get(channel)?;
        let (low, high) = if from_km < to_km { (from_km, to_km) } else { (to_km, from_km) };
        let (rise, z) = (high - low, &self.levels.z_km);
        let inside = low >= z[0] - BELOW_BOTTOM_KM && high <= z[z.len() - 1] && rise <= self.max_rise_km;
        if !(inside && length_km >= rise && length_km <= LONGEST_PATH_KM) {
            return None;
        }
        let below = self.start(segments, low);
        let at_middle = rise_to(segments, below, 0.5 * (low + high));
        let (middle, half_way) = (&segments[at_middle], segments[at_middle].fraction(0.5 * (low + high)));
        let tau = if rise < LEVEL_PATH_KM {
            middle.absorption(half_way) * length_km
        } else {
            let depth = |segment: &Segment, z_km: f64| {
                let fraction = segment.fraction(z_km);
                segment.tau + segment.dz_km * fraction * segment.absorption(0.5 * fraction)
            };
            let above = rise_to(segments, at_middle, high);
            (depth(&segments[above], high) - depth(&segments[below], low)) * (length_km / rise)
        };
        let absorbed = absorbed(tau);
        Some((rayleigh_jeans_temperature_k(self.freqs_ghz[channel], absorbed * middle.radiance(half_way)), 1.0 - absorbed))
    }

    /// The segment of a height that lies in the table.
    #[inline]
    fn start(&self, segments: &[Segment], z_km: f64) -> usize {
        let bin = ((z_km - segments[0].z_km) * (1.0 / BIN_KM)).max(0.0) as usize;
        let mut at = self.bins[bin.min(self.bins.len() - 1)] as usize;
        while at > 0 && segments[at].z_km > z_km {
            at -= 1;
        }
        rise_to(segments, at, z_km)
    }

    /// Adds the air of a short path to a mixture. Its black-body radiance is that of the air at each end. Returns these radiances, near and
    /// far.
    ///
    /// # Errors
    /// [`PhysicsError::OutOfRange`] for an end outside the table.
    pub fn add_to(&self, mixture: &mut Mixture, channel: usize, ends: &PathEnds) -> Result<[f64; 2], PhysicsError> {
        let segments = &self.channels[channel];
        let (observer, target) = self.heights_of(ends)?;
        let (near, far) = (self.locate(observer), self.locate(target));
        let rise = ends.height_km();
        let tau = if rise < LEVEL_PATH_KM {
            segments[near.segment].absorption(near.fraction) * ends.length_km()
        } else {
            (depth(segments, near) - depth(segments, far)).abs() * (ends.length_km() / rise)
        };
        let radiances = [near, far].map(|p| segments[p.segment].radiance(p.fraction));
        mixture.add(tau, radiances[0], radiances[1]);
        Ok(radiances)
    }

    /// Heights of the ends of a path, checked against the table.
    fn heights_of(&self, ends: &PathEnds) -> Result<(f64, f64), PhysicsError> {
        let (observer, target) = (ends.observer_km(), ends.target_km());
        let z = &self.levels.z_km;
        let (lowest, highest) = (z[0] - BELOW_BOTTOM_KM, z[z.len() - 1]);
        check_range("path height", observer, "km", lowest, highest)?;
        check_range("path height", target, "km", lowest, highest)?;
        Ok((observer, target))
    }

    /// The place of a height that lies in the table.
    fn locate(&self, z_km: f64) -> Place {
        let z = &self.levels.z_km;
        let last = z.len() - 1;
        let bin = ((z_km - z[0]) / BIN_KM).max(0.0) as usize;
        let mut segment = self.bins[bin.min(self.bins.len() - 1)] as usize;
        while segment > 0 && z[segment] > z_km {
            segment -= 1;
        }
        while segment + 1 < last && z[segment + 1] <= z_km {
            segment += 1;
        }
        let dz_km = z[segment + 1] - z[segment];
        Place { segment, fraction: (z_km - z[segment]) / dz_km, dz_km }
    }
}

/// The segment of a height that is not below the segment `at`.
#[inline]
fn rise_to(segments: &[Segment], mut at: usize, z_km: f64) -> usize {
    while at + 1 < segments.len() && segments[at + 1].z_km <= z_km {
        at += 1;
    }
    at
}

impl Segment {
    /// A height as fraction of the segment.
    #[inline]
    fn fraction(&self, z_km: f64) -> f64 {
        (z_km - self.z_km) * self.per_km
    }

    fn absorption(&self, fraction: f64) -> f64 {
        self.low + fraction.max(0.0) * (self.high - self.low)
    }

    /// Black-body radiance, linear over a step of the grid.
    fn radiance(&self, fraction: f64) -> f64 {
        self.low_radiance + fraction.max(0.0) * (self.high_radiance - self.low_radiance)
    }
}

/// The fraction of radiation that a depth in Np absorbs, `1 - exp(-tau)`.
#[inline]
fn absorbed(tau: f64) -> f64 {
    // The series is exact to rounding there, and most paths of a scene are so thin.
    if (0.0..0.05).contains(&tau) {
        const SHARES: [f64; 8] = [1.0 / 9.0, 1.0 / 8.0, 1.0 / 7.0, 1.0 / 6.0, 1.0 / 5.0, 1.0 / 4.0, 1.0 / 3.0, 1.0 / 2.0];
        return tau * SHARES.iter().fold(1.0, |rest, share| 1.0 - tau * share * rest);
    }
    -(-tau).exp_m1()
}

/// A path of constant temperature, given its black-body radiance.
fn constant_radiance(freq_ghz: f64, tau_np: f64, radiance: f64) -> PathRadiation {
    PathRadiation { freq_ghz, tau_np, emission: -(-tau_np).exp_m1() * radiance }
}

/// Depth from the lowest level to a place, negative below it.
fn depth(segments: &[Segment], place: Place) -> f64 {
    let segment = &segments[place.segment];
    // The mean absorption up to the place is the absorption half way there.
    segment.tau + place.dz_km * place.fraction * segment.absorption(0.5 * place.fraction)
}

/// The segment in the middle of every bin of height.
fn bins(z_km: &[f64]) -> Vec<u32> {
    let last = z_km.len() - 1;
    let count = ((z_km[last] - z_km[0]) / BIN_KM).ceil() as usize;
    (0..=count)
        .map(|bin| {
            let middle = z_km[0] + (bin as f64 + 0.5) * BIN_KM;
            z_km.partition_point(|level| *level <= middle).clamp(1, last) as u32 - 1
        })
        .collect()
}

fn segments(column: &Column) -> Vec<Segment> {
    let mut tau = 0.0;
    let z = &column.levels.z_km;
    (0..column.mean.len())
        .map(|i| {
            let (low, high) = (column.gas[i] + column.hydrosol[i], column.gas[i + 1] + column.hydrosol[i]);
            let scale = column.mean[i] / (0.5 * (low + high));
            let dz_km = z[i + 1] - z[i];
            let segment = Segment {
                z_km: z[i],
                dz_km,
                per_km: 1.0 / dz_km,
                tau,
                low: low * scale,
                high: high * scale,
                low_radiance: column.radiance[i],
                high_radiance: column.radiance[i + 1],
            };
            tau += column.mean[i] * dz_km;
            segment
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::atmosphere::PathExtent;

    fn table(freqs: &[f64]) -> (Atmosphere, PathTable) {
        let atmosphere = Atmosphere::reference("mls", "mpm89").unwrap();
        let table = PathTable::new(&atmosphere, freqs).unwrap();
        (atmosphere, table)
    }

    #[test]
    fn depth_is_that_of_the_integral_at_any_height() {
        let freqs = [22.235, 94.0, 183.0];
        let (atmosphere, table) = table(&freqs);
        for (z1, z2) in [(0.0, 5.0), (0.013, 0.027), (1.23, 4.56), (0.0, 30.0)] {
            let ends = PathEnds::new(z1, z2, PathExtent::ZenithDeg(30.0)).unwrap();
            let exact = atmosphere.path(&freqs, &ends).unwrap();
            for (channel, path) in exact.iter().enumerate() {
                let fast = table.radiation(channel, &ends).unwrap();
                assert!((fast.tau_np / path.tau_np - 1.0).abs() < 2e-4, "{z1} {z2} {channel}");
            }
        }
    }

    #[test]
    fn pieces_bound_the_error_of_long_paths() {
        let (atmosphere, table) = table(&[60.0, 94.0]);
        let table = table.with_max_rise(0.2).unwrap();
        let ends = PathEnds::new(5.0, 0.0, PathExtent::ZenithDeg(60.0)).unwrap();
        for (channel, path) in atmosphere.path(&[60.0, 94.0], &ends).unwrap().iter().enumerate() {
            let fast = table.radiation(channel, &ends).unwrap();
            // Half the temperature difference over 0.2 km.
            let off = (fast.emission_rj_k() - path.emission_rj_k()).abs();
            assert!(off < 0.65, "{channel} {off}");
        }
    }

    #[test]
    fn a_piece_is_the_same_in_both_ways() {
        let (_, table) = table(&[22.235, 94.0]);
        let table = table.with_max_rise(0.2).unwrap();
        for (from, to, length) in
            [(0.0, 0.1, 0.3), (0.1, 0.0, 40.0), (-0.2, -0.1, 0.1), (1.23, 1.23, 0.5), (29.9, 30.0, 7.0), (0.07, 0.07, 2000.0)]
        {
            let plain = table.radiation(1, &PathEnds::new(from, to, PathExtent::LengthKm(length)).unwrap()).unwrap();
            let (emission_k, transmission) = table.of_piece(1, from, to, length).unwrap();
            assert!(
                (emission_k - plain.emission_rj_k()).abs() < 1e-11 && (transmission - plain.transmission()).abs() < 1e-14,
                "{from} {to}"
            );
        }
        for (channel, from, to, length) in
            [(2, 0.0, 0.1, 1.0), (0, 0.0, 0.3, 1.0), (0, -0.6, -0.6, 1.0), (0, 0.0, 0.0, 3e3), (0, f64::NAN, 0.0, 1.0)]
        {
            assert_eq!(table.of_piece(channel, from, to, length), None);
        }
        for tau in [1e-12, 0.01, 0.049_999, 0.05, 3.0] {
            assert!((absorbed(tau) + f64::exp_m1(-tau)).abs() <= 3e-16 * absorbed(tau), "{tau}");
        }
    }

    #[test]
    fn ground_below_the_profile_holds_its_lowest_air() {
        let (_, table) = table(&[94.0]);
        let radiation = |z: f64| {
            let ends = PathEnds::new(z, z, PathExtent::LengthKm(1.0)).unwrap();
            table.radiation(0, &ends)
        };
        assert_eq!(radiation(-0.3).unwrap(), radiation(0.0).unwrap());
        assert!(radiation(-0.6).is_err());
    }

    #[test]
    fn bins_find_the_segment_of_every_height() {
        let (_, table) = table(&[94.0]);
        let z = &table.levels.z_km;
        for i in 0..3001 {
            let height = 0.01 * f64::from(i);
            let place = table.locate(height.min(30.0));
            let low = z[place.segment];
            assert!(low <= height + 1e-12 && height <= z[place.segment + 1] + 1e-12, "{height}");
        }
    }

    #[test]
    fn unknown_channels_are_named() {
        let (_, table) = table(&[94.0, 140.0]);
        let ends = PathEnds::new(0.0, 1.0, PathExtent::LengthKm(1.0)).unwrap();
        assert!(table.radiation(2, &ends).unwrap_err().to_string().starts_with("channel 2"));
        assert!(table.clone().with_max_rise(0.0).is_err());
    }
}
