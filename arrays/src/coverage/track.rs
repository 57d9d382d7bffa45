//! The times of an observation: a start and a duration, or a range of hour angles near a date.

use crate::astrometry::LocalSky;
use crate::{ArrayError, PhaseCenter, PhaseCenterKind, Result, Site};
use std::f64::consts::{PI, TAU};

/// Seconds of a day.
pub(super) const DAY_S: f64 = 86_400.0;
/// Most integrations of one track: eleven days of one second.
const MOST_TIMES: f64 = 1e6;
/// Rotations of the Earth relative to the stars in one solar day.
const SIDEREAL_RATE: f64 = 1.002_737_909_350_795;

/// Consecutive integrations, and which antennas are correlated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Track {
    /// Start of the first integration, Julian date UTC.
    pub start_jd: f64,
    /// Length of the whole track, s. The track has as many whole integrations as fit.
    pub duration_s: f64,
    /// Length of one integration, s.
    pub integration_s: f64,
    /// Antennas for which the phase centre is below this elevation (rad) are left out; `None` keeps all antennas.
    pub elevation_limit_rad: Option<f64>,
    /// Whether each antenna is also correlated with itself.
    pub autocorrelations: bool,
}

impl Track {
    /// A track of cross-correlations without an elevation limit.
    #[must_use]
    pub fn new(start_jd: f64, duration_s: f64, integration_s: f64) -> Self {
        Self { start_jd, duration_s, integration_s, elevation_limit_rad: None, autocorrelations: false }
    }

    /// The track from one hour angle of a phase centre to another, in the transit nearest to a date.
    ///
    /// Hour angles in rad, negative before transit.
    ///
    /// # Errors
    /// A phase centre that is not sidereal, an end before its start or more than a turn after it, a bad date or site.
    pub fn hour_angles(
        phase_center: &PhaseCenter,
        site: &Site,
        near_jd: f64,
        hour_angles_rad: [f64; 2],
        integration_s: f64,
    ) -> Result<Self> {
        let [from, to] = hour_angles_rad;
        let PhaseCenterKind::Sidereal { ra_rad, dec_rad } = phase_center.kind else {
            return Err(ArrayError::bad_value(
                "phase centre of an hour-angle range",
                &phase_center.name,
                "a right ascension and declination",
            ));
        };
        ArrayError::unless(
            to > from && to - from <= TAU,
            "hour-angle range",
            format_args!("{}h to {}h", from * 12.0 / PI, to * 12.0 / PI),
            "an end after the start, at most 24 h later",
        )?;
        let hour_angle = |jd: f64| -> Result<f64> {
            let sky = LocalSky::at(jd, site)?;
            Ok(sky.lst_rad() - sky.apparent_place(ra_rad, dec_rad, &phase_center.frame)?.ra_rad)
        };
        // The middle of the range is placed nearest to the date. After two steps the error is less than a microsecond.
        let middle = (from + to) / 2.0;
        let mut jd = near_jd;
        for _ in 0..3 {
            let ahead = (middle - hour_angle(jd)? + PI).rem_euclid(TAU) - PI;
            jd += ahead / TAU / SIDEREAL_RATE;
        }
        let duration_s = (to - from) / TAU / SIDEREAL_RATE * DAY_S;
        Ok(Self::new(jd - duration_s / 2.0 / DAY_S, duration_s, integration_s))
    }

    /// Number of whole integrations.
    ///
    /// # Errors
    /// Times that are not positive and finite, a track shorter than one integration, more than a million integrations.
    pub fn n_times(&self) -> Result<usize> {
        for (what, value) in [("integration time", self.integration_s), ("duration of the track", self.duration_s)] {
            ArrayError::unless(value.is_finite() && value > 0.0, what, format_args!("{value} s"), "a positive time")?;
        }
        // A duration read as hours and an integration in seconds divide with a rounding error.
        let n = (self.duration_s / self.integration_s * (1.0 + 1e-9)).floor();
        ArrayError::unless(n >= 1.0, "duration of the track", format_args!("{} s", self.duration_s), "at least one integration time")?;
        ArrayError::unless(
            n <= MOST_TIMES,
            "number of integrations",
            format_args!("{n}"),
            "at most 1,000,000: take a longer integration time or a shorter track",
        )?;
        Ok(n as usize)
    }

    /// Midpoint of integration `i`, Julian date UTC.
    #[must_use]
    pub fn midpoint_jd(&self, i: usize) -> f64 {
        self.start_jd + (i as f64 + 0.5) * self.integration_s / DAY_S
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const VLA: Site = Site { latitude_rad: 0.594_784, longitude_rad: -1.878_283, altitude_m: 2115.0 };

    #[test]
    fn an_hour_angle_range_begins_and_ends_at_its_hour_angles() {
        let center = PhaseCenter::sidereal("Cyg A", 5.233_686, 0.710_940).unwrap();
        let track = Track::hour_angles(&center, &VLA, 2_460_828.0, [-PI / 4.0, PI / 6.0], 10.0).unwrap();
        for (jd, expected) in [(track.start_jd, -PI / 4.0), (track.start_jd + track.duration_s / DAY_S, PI / 6.0)] {
            let sky = LocalSky::at(jd, &VLA).unwrap();
            let place = sky.apparent_place(5.233_686, 0.710_940, "icrs").unwrap();
            let off = (sky.lst_rad() - place.ra_rad - expected + PI).rem_euclid(TAU) - PI;
            // Diurnal aberration, 1.5e-6 rad over the cosine of the declination, moves the place between the middle and the ends.
            assert!(off.abs() < 4e-6, "{off}");
        }
        assert!((track.start_jd + track.duration_s / 2.0 / DAY_S - 2_460_828.0).abs() <= 0.5);
    }

    #[test]
    fn only_whole_integrations_are_counted() {
        assert_eq!(Track::new(2.46e6, 3600.0, 10.0).n_times().unwrap(), 360);
        assert_eq!(Track::new(2.46e6, 35.0, 10.0).n_times().unwrap(), 3);
        assert_eq!(Track::new(2.46e6, 0.3, 0.1).n_times().unwrap(), 3);
        for (duration, integration) in [(5.0, 10.0), (-1.0, 1.0), (1.0, 0.0), (f64::NAN, 1.0), (1e9, 1e-3)] {
            assert!(Track::new(2.46e6, duration, integration).n_times().is_err(), "{duration} {integration}");
        }
    }
}
