//! The rows of an observation, computed on request, so that millions of rows need no memory.

use super::rows::UvCoverage;
use super::track::{DAY_S, Track};
use crate::astrometry::{ApparentPlace, LocalSky};
use crate::{ArrayError, ArrayLayout, PhaseCenter, PhaseCenterKind, Result, Site};
use ndarray::Array2;
use std::ops::Range;

/// Antenna positions and the direction of the phase centre at each time. Together they give all rows.
///
/// Rows run by time, then by first and second antenna with `ant1 < ant2` (or `<=` with autocorrelations). For a sidereal phase centre u
/// points east and v north in the catalogue frame of the phase centre, and w to the source. Without such a phase centre uvw are the
/// baselines in the frame of the layout.
#[derive(Debug, Clone)]
pub struct CoveragePlan {
    /// Antenna positions from the site, m: geocentric axes for a tracked centre, otherwise the layout's own.
    positions_m: Vec<[f64; 3]>,
    /// Unit vectors of the antennas' zeniths in geocentric axes; empty where nothing on the sky is tracked.
    zeniths: Vec<[f64; 3]>,
    /// Sine of the elevation limit; minus infinity without a limit.
    sin_limit: f64,
    autocorrelations: bool,
    integration_s: f64,
    times: Vec<TimeSlot>,
    /// Index of the first row of each time, and the number of rows.
    first_row: Vec<usize>,
}

/// One integration: its midpoint and the rows u, v, w of the rotation from the axes of the positions.
#[derive(Debug, Clone, Copy)]
struct TimeSlot {
    jd: f64,
    axes: [[f64; 3]; 3],
}

/// Sine of the elevation below which an antenna cannot see a source. Refraction lifts a source at the horizon by half a degree.
const SIN_HORIZON: f64 = -0.01;

const IDENTITY: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

impl CoveragePlan {
    /// One integration towards the boresight or zenith of the array: uvw = r2 - r1 in the frame of the layout.
    ///
    /// # Errors
    /// A time or integration time that is not finite and positive; an array of one antenna.
    pub fn snapshot(layout: &ArrayLayout, midpoint_jd: f64, integration_s: f64) -> Result<Self> {
        let center = PhaseCenter::unprojected("boresight");
        Self::track(layout, &center, &Track::new(midpoint_jd - integration_s / 2.0 / DAY_S, integration_s, integration_s))
    }

    /// The rows of a track.
    ///
    /// # Errors
    /// A boresight layout with a celestial phase centre; a bad track; no antenna pair above the elevation limit at any time.
    pub fn track(layout: &ArrayLayout, phase_center: &PhaseCenter, track: &Track) -> Result<Self> {
        let n_times = track.n_times()?;
        ArrayError::unless(track.start_jd.is_finite(), "start", track.start_jd, "a finite Julian date")?;
        let enu = layout.antennas().iter().map(|a| a.position_m);
        let fixed = matches!(phase_center.kind, PhaseCenterKind::Unprojected);
        let (positions_m, times) = if fixed {
            (enu.collect(), (0..n_times).map(|i| TimeSlot { jd: track.midpoint_jd(i), axes: IDENTITY }).collect())
        } else {
            let Some(site) = layout.site() else {
                return Err(ArrayError::bad_value(
                    format_args!("frame of layout {:?}", layout.name),
                    "boresight",
                    "a layout with a site, as the sky is to be tracked (leave out the phase centre for a boresight scene)",
                ));
            };
            let slots: Result<Vec<TimeSlot>> = (0..n_times)
                .map(|i| {
                    let jd = track.midpoint_jd(i);
                    let (lst_rad, place) = look(jd, &site, phase_center)?;
                    Ok(TimeSlot { jd, axes: uvw_axes(lst_rad, &site, &place) })
                })
                .collect();
            (enu.map(|p| site.enu_to_ecef_offset(p)).collect(), slots?)
        };
        let zeniths = match (track.elevation_limit_rad, layout.site()) {
            (Some(limit), _) if !(limit.abs() <= std::f64::consts::FRAC_PI_2) => {
                return Err(ArrayError::bad_value(
                    "elevation limit",
                    format_args!("{} deg", limit.to_degrees()),
                    "an angle between -90 and 90 deg",
                ));
            }
            (_, Some(site)) if !fixed => layout.antennas().iter().map(|a| zenith(&site, a.position_m)).collect(),
            _ => Vec::new(),
        };
        let mut plan = Self {
            positions_m,
            zeniths,
            sin_limit: track.elevation_limit_rad.map_or(f64::NEG_INFINITY, f64::sin),
            autocorrelations: track.autocorrelations,
            integration_s: track.integration_s,
            times,
            first_row: Vec::new(),
        };
        plan.count_rows();
        plan.check_rows(layout, phase_center, track)?;
        Ok(plan)
    }

    /// The same plan, with or without a row for each antenna with itself.
    #[must_use]
    pub fn with_autocorrelations(mut self, on: bool) -> Self {
        self.autocorrelations = on;
        self.count_rows();
        self
    }

    fn count_rows(&mut self) {
        let mut first_row = Vec::with_capacity(self.times.len() + 1);
        first_row.push(0_usize);
        let mut total = 0_usize;
        for slot in &self.times {
            let n = self.antennas_up(slot).count();
            let pairs = if self.autocorrelations { n * (n + 1) / 2 } else { n * n.saturating_sub(1) / 2 };
            total += pairs;
            first_row.push(total);
        }
        self.first_row = first_row;
    }

    /// Refuse a plan without rows, and a source that no two antennas ever see.
    fn check_rows(&self, layout: &ArrayLayout, center: &PhaseCenter, track: &Track) -> Result<()> {
        let antennas = self.positions_m.len();
        let seen = |slot: &TimeSlot| (0..antennas).filter(|i| self.sin_elevation(slot, *i).is_none_or(|s| s >= SIN_HORIZON)).count() > 1;
        if self.n_rows() > 0 && (antennas < 2 || self.times.iter().any(seen)) {
            return Ok(());
        }
        let (Some(site), true) = (layout.site().filter(|_| !self.zeniths.is_empty()), antennas > 1) else {
            return Err(ArrayError::bad_value("number of antennas", antennas, "at least two, to form a baseline"));
        };
        let all = self.times.iter().flat_map(|slot| (0..antennas).filter_map(|i| self.sin_elevation(slot, i)));
        let highest = all.fold(-1.0, f64::max).asin().to_degrees();
        let (limit, latitude) = (track.elevation_limit_rad.unwrap_or(0.0).to_degrees(), site.latitude_rad.to_degrees());
        let place = center.ra_dec_rad().map_or_else(String::new, |(_, dec)| {
            let dec = dec.to_degrees();
            let never = if 90.0 - (latitude - dec).abs() < limit { ", where it never rises above this limit" } else { "" };
            format!("; its declination is {dec:.2} deg and the latitude of the array {latitude:.2} deg{never}")
        });
        Err(ArrayError::bad_value(
            "elevation of the phase centre",
            format_args!("at most {highest:.1} deg in this track, with a limit of {limit} deg{place}"),
            "two antennas that see it above the limit at some time: choose another phase centre, start or limit",
        ))
    }

    /// Sine of the elevation of the phase centre at an antenna; `None` where nothing on the sky is tracked.
    fn sin_elevation(&self, slot: &TimeSlot, antenna: usize) -> Option<f64> {
        let [x, y, z] = slot.axes[2];
        self.zeniths.get(antenna).map(|up| up[0] * x + up[1] * y + up[2] * z)
    }

    /// The share of all antennas and times, 0 to 1, that take part although the phase centre is below the horizon.
    #[must_use]
    pub fn share_below_horizon(&self) -> f64 {
        let (mut below, mut all) = (0_usize, 0_usize);
        for slot in &self.times {
            for antenna in self.antennas_up(slot) {
                all += 1;
                below += usize::from(self.sin_elevation(slot, antenna).is_some_and(|s| s < SIN_HORIZON));
            }
        }
        below as f64 / all.max(1) as f64
    }

    /// Number of rows.
    #[must_use]
    pub fn n_rows(&self) -> usize {
        self.first_row.last().copied().unwrap_or(0)
    }

    /// Midpoints of the integrations that have rows, Julian date UTC.
    pub fn times_jd(&self) -> impl Iterator<Item = f64> + '_ {
        self.times.iter().zip(self.first_row.windows(2)).filter(|(_, w)| w[1] > w[0]).map(|(t, _)| t.jd)
    }

    /// Length of each integration, s.
    #[must_use]
    pub fn integration_s(&self) -> f64 {
        self.integration_s
    }

    /// Each integration that has baselines, as seen from the phase centre: the antennas that take part, and their places (u, v) in m from a common
    /// origin. The baseline of two antennas is the difference of their places.
    pub fn views(&self) -> impl Iterator<Item = Vec<(usize, [f64; 2])>> + '_ {
        let seen = |slot: &TimeSlot, i: usize| {
            let [u, v, _] = turned(&slot.axes, self.positions_m[i]);
            (i, [u, v])
        };
        self.times.iter().map(move |slot| self.antennas_up(slot).map(|i| seen(slot, i)).collect()).filter(|view: &Vec<_>| view.len() > 1)
    }

    /// The rows of a range.
    ///
    /// # Errors
    /// A range past the last row.
    pub fn rows(&self, range: Range<usize>) -> Result<UvCoverage> {
        ArrayError::unless_rows(&range, self.n_rows())?;
        let n = range.len();
        let mut uvw = Vec::with_capacity(n);
        let (mut ant1, mut ant2, mut time_jd) = (Vec::with_capacity(n), Vec::with_capacity(n), Vec::with_capacity(n));
        let mut t = self.first_row.partition_point(|first| *first <= range.start).saturating_sub(1);
        let mut row = self.first_row[t];
        while row < range.end {
            let slot = &self.times[t];
            let up: Vec<(u32, [f64; 3])> = self.antennas_up(slot).map(|i| (i as u32, turned(&slot.axes, self.positions_m[i]))).collect();
            for (k, (a, ra)) in up.iter().enumerate() {
                let partners = if self.autocorrelations { &up[k..] } else { &up[k + 1..] };
                for (b, rb) in partners {
                    if range.contains(&row) {
                        uvw.push([rb[0] - ra[0], rb[1] - ra[1], rb[2] - ra[2]]);
                        ant1.push(*a);
                        ant2.push(*b);
                        time_jd.push(slot.jd);
                    }
                    row += 1;
                }
            }
            t += 1;
        }
        UvCoverage::new(Array2::from(uvw), ant1, ant2, time_jd, vec![self.integration_s; n], vec![0; n])
    }

    /// The rows in blocks of whole integrations, each of about `target_rows` rows.
    pub fn blocks(&self, target_rows: usize) -> impl Iterator<Item = Result<UvCoverage>> + '_ {
        let mut t = 0;
        std::iter::from_fn(move || {
            let start = self.first_row[t];
            let mut end = start;
            while t < self.times.len() && (end == start || self.first_row[t + 1] - start <= target_rows) {
                t += 1;
                end = self.first_row[t];
            }
            (end > start).then(|| self.rows(start..end))
        })
    }

    /// All rows at once.
    ///
    /// # Errors
    /// None for a valid plan.
    pub fn coverage(&self) -> Result<UvCoverage> {
        self.rows(0..self.n_rows())
    }

    fn antennas_up<'a>(&'a self, slot: &'a TimeSlot) -> impl Iterator<Item = usize> + use<'a> {
        (0..self.positions_m.len()).filter(|i| self.sin_elevation(slot, *i).is_none_or(|s| s >= self.sin_limit))
    }
}

/// Sidereal time and apparent place of the phase centre.
fn look(jd: f64, site: &Site, phase_center: &PhaseCenter) -> Result<(f64, ApparentPlace)> {
    let sky = LocalSky::at(jd, site)?;
    let place = match phase_center.kind {
        PhaseCenterKind::Sidereal { ra_rad, dec_rad } => sky.apparent_place(ra_rad, dec_rad, &phase_center.frame)?,
        PhaseCenterKind::Driftscan { az_rad, el_rad } => {
            let (sin_lat, cos_lat) = site.latitude_rad.sin_cos();
            let (sin_el, cos_el) = el_rad.sin_cos();
            let north = cos_el * az_rad.cos();
            let hour_angle = (-cos_el * az_rad.sin()).atan2(sin_el * cos_lat - north * sin_lat);
            let dec_rad = (sin_el * sin_lat + north * cos_lat).clamp(-1.0, 1.0).asin();
            ApparentPlace { ra_rad: sky.lst_rad() - hour_angle, dec_rad, frame_pa_rad: 0.0 }
        }
        PhaseCenterKind::Unprojected => ApparentPlace { ra_rad: sky.lst_rad(), dec_rad: site.latitude_rad, frame_pa_rad: 0.0 },
    };
    Ok((sky.lst_rad(), place))
}

/// Rows u, v, w in geocentric axes.
///
/// # Reference
/// Thompson, Moran & Swenson 2017, eq. 4.1, with the hour angle at Greenwich, then turned by the position angle of the catalogue frame.
fn uvw_axes(lst_rad: f64, site: &Site, place: &ApparentPlace) -> [[f64; 3]; 3] {
    let (sin_h, cos_h) = (lst_rad - place.ra_rad - site.longitude_rad).sin_cos();
    let (sin_d, cos_d) = place.dec_rad.sin_cos();
    let (sin_p, cos_p) = place.frame_pa_rad.sin_cos();
    let u = [sin_h, cos_h, 0.0];
    let v = [-sin_d * cos_h, sin_d * sin_h, cos_d];
    let w = [cos_d * cos_h, -cos_d * sin_h, sin_d];
    [[0, 1, 2].map(|k| cos_p * u[k] - sin_p * v[k]), [0, 1, 2].map(|k| sin_p * u[k] + cos_p * v[k]), w]
}

fn turned(m: &[[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// Zenith of an antenna in geocentric axes. Each antenna has its own zenith, because distant antennas have different horizons.
fn zenith(site: &Site, enu: [f64; 3]) -> [f64; 3] {
    let (center, offset) = (site.to_ecef_m(), site.enu_to_ecef_offset(enu));
    let here = Site::from_ecef_m([0, 1, 2].map(|k| center[k] + offset[k]));
    let ((sin_lat, cos_lat), (sin_lon, cos_lon)) = (here.latitude_rad.sin_cos(), here.longitude_rad.sin_cos());
    [cos_lat * cos_lon, cos_lat * sin_lon, sin_lat]
}

#[cfg(test)]
#[path = "plan_tests.rs"]
mod tests;
