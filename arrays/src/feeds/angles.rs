//! Position angles of the feeds of every antenna at a time.

use super::jones::{Jones, feed_matrix};
use super::mount::Mount;
use crate::{ArrayError, LayoutFrame, LocalSky, PhaseCenter, PhaseCenterKind, Polarization, Result, Site, VisibilityHeader, XOrientation};
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

/// Keyword of sets whose products are those of feeds that turn with the mounts, and its value.
const KEYWORD: (&str, &str) = ("CITFEED", "turning");
/// Half the arc over which the north of the catalogue is measured in the apparent frame, rad.
const NORTH_ARC_RAD: f64 = 1e-4;
/// Arrays that are larger have a zenith of its own at every antenna, m.
const LOCAL_M: f64 = 1e5;

/// Angles \[ant\] that are known, by the bits of the time and the phase centre.
type Known = HashMap<(u64, u16), Arc<[f64]>>;

/// The feeds of the antennas of a set.
#[derive(Debug, Clone)]
pub struct Feeds {
    mounts: Vec<Mount>,
    /// One site, or one for each antenna.
    sites: Vec<Site>,
    circular: bool,
    x_east: bool,
    centers: Vec<PhaseCenter>,
    turning: bool,
    cache: Arc<Mutex<Known>>,
}

impl Feeds {
    /// The feeds by the header of a set.
    ///
    /// # Errors
    /// The products are those of turning feeds, and a mount is missing or unknown.
    pub fn of(header: &VisibilityHeader) -> Result<Self> {
        let products = &header.polarizations;
        let circular = products.iter().any(|p| matches!(p, Polarization::RR | Polarization::LL | Polarization::RL | Polarization::LR));
        let linear = products.iter().any(|p| p.feeds().is_some()) && !circular;
        let x_east = linear && header.annotations.x_orientation == Some(XOrientation::East);
        let stated = header.annotations.text(KEYWORD.0) == Some(KEYWORD.1) && (linear || circular);
        let LayoutFrame::EastNorthUp(site) = header.layout.frame else {
            return Ok(Self::still(circular, x_east));
        };
        if !stated {
            return Ok(Self::still(circular, x_east));
        }
        let names = &header.annotations.mounts;
        ArrayError::unless(
            names.len() == header.layout.n_ant(),
            "number of mounts",
            names.len(),
            "a mount for every antenna, as the feeds of the set turn with them",
        )?;
        let mounts = names.iter().map(|n| Mount::named(n)).collect::<Result<Vec<_>>>()?;
        let turning = mounts.iter().any(|m| m.turns());
        let places = || header.layout.antennas().iter().map(|a| a.position_m);
        let far = places().flatten().any(|x| x.abs() > LOCAL_M);
        let sites = if far {
            let center = site.to_ecef_m();
            let of = |p| {
                let d = site.enu_to_ecef_offset(p);
                Site::from_ecef_m([0, 1, 2].map(|k| center[k] + d[k]))
            };
            places().map(of).collect()
        } else {
            vec![site]
        };
        Ok(Self { mounts, sites, circular, x_east, centers: header.phase_centers.clone(), turning, cache: Arc::default() })
    }

    fn still(circular: bool, x_east: bool) -> Self {
        Self { mounts: Vec::new(), sites: Vec::new(), circular, x_east, centers: Vec::new(), turning: false, cache: Arc::default() }
    }

    /// Say in a header that its products are those of feeds that turn with a mount. Feeds along a boresight do not turn.
    pub fn state(header: &mut VisibilityHeader, mount: Mount) {
        header.annotations.mounts = vec![mount.name().to_owned(); header.layout.n_ant()];
        header.annotations.add_text(KEYWORD.0, KEYWORD.1);
    }

    /// Take the statement of [`Feeds::state`] out of a header: its products are then those of feeds that keep their angle on the sky.
    pub fn unstate(header: &mut VisibilityHeader) {
        header.annotations.keywords.retain(|key, _| !key.eq_ignore_ascii_case(KEYWORD.0));
    }

    /// True where feeds turn on the sky.
    #[must_use]
    pub fn turn(&self) -> bool {
        self.turning
    }

    /// True where all feeds have the same angle at each time, so that products of one hand do not turn.
    #[must_use]
    pub fn alike(&self) -> bool {
        !self.turning || (self.sites.len() == 1 && self.mounts.iter().all(|m| *m == self.mounts[0]))
    }

    /// True for the feeds of the conventions: circular, or X to the north and Y to the east, and not turning.
    #[must_use]
    pub fn are_plain(&self) -> bool {
        !self.turning && !self.x_east
    }

    /// The mount of every antenna; none where feeds do not turn.
    #[must_use]
    pub fn mounts(&self) -> &[Mount] {
        &self.mounts
    }

    /// Position angle of the feeds of every antenna on the sky of a phase centre, rad \[ant\]. Empty where feeds do not turn.
    ///
    /// # Errors
    /// A date out of range, a phase centre in an unknown frame.
    pub fn angles(&self, time_jd: f64, center: u16) -> Result<Arc<[f64]>> {
        if !self.turning {
            return Ok(Arc::from([]));
        }
        let key = (time_jd.to_bits(), center);
        // The entries are complete whenever the lock is free, so a panic of another thread does no harm.
        if let Some(known) = self.cache.lock().unwrap_or_else(PoisonError::into_inner).get(&key) {
            return Ok(known.clone());
        }
        let index = usize::from(center);
        let center = self.centers.get(index).ok_or(ArrayError::OutOfRange { what: "phase centre", index, len: self.centers.len() })?;
        let places = self.sites.iter().map(|site| Place::of(center, time_jd, site)).collect::<Result<Vec<_>>>()?;
        let found: Arc<[f64]> =
            self.mounts.iter().enumerate().map(|(k, mount)| places[k.min(places.len() - 1)].angle(*mount)).collect::<Vec<_>>().into();
        self.cache.lock().unwrap_or_else(PoisonError::into_inner).insert(key, found.clone());
        Ok(found)
    }

    /// The response of the feeds at an angle to the field components to the north and to the east.
    #[must_use]
    pub fn matrix(&self, angle_rad: f64) -> Jones {
        feed_matrix(self.circular, self.x_east, angle_rad)
    }
}

/// Position angle, in the frame of a phase centre on the sky, of the feeds of a mount that looks there, rad. 0 for other phase centres.
///
/// # Errors
/// A date out of range, a frame that is not known.
pub fn sky_angle_rad(mount: Mount, center: &PhaseCenter, time_jd: f64, site: &Site) -> Result<f64> {
    Ok(Place::of(center, time_jd, site)?.angle(mount))
}

/// A direction in the axes east, north, up, with the directions to its north and east on the sky.
struct Place {
    toward: [f64; 3],
    north: [f64; 3],
    east: [f64; 3],
    /// Position angle of the north of the catalogue in the apparent frame.
    frame_pa_rad: f64,
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

impl Place {
    fn of(center: &PhaseCenter, time_jd: f64, site: &Site) -> Result<Self> {
        let (hour_angle, dec, frame_pa_rad) = match center.kind {
            PhaseCenterKind::Sidereal { ra_rad, dec_rad } => {
                let sky = LocalSky::at(time_jd, site)?;
                let at = sky.apparent_place(ra_rad, dec_rad, &center.frame)?;
                let [south, north] = [-NORTH_ARC_RAD, NORTH_ARC_RAD].map(|d| sky.apparent_place(ra_rad, dec_rad + d, &center.frame));
                let (south, north) = (south?, north?);
                let d_ra = (north.ra_rad - south.ra_rad + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI;
                let frame_pa = (d_ra * at.dec_rad.cos()).atan2(north.dec_rad - south.dec_rad);
                (sky.lst_rad() - at.ra_rad, at.dec_rad, frame_pa)
            }
            // The zenith: the phase centre is on the meridian, with the declination of the site.
            PhaseCenterKind::Unprojected => (0.0, site.latitude_rad, 0.0),
            PhaseCenterKind::Driftscan { .. } => {
                let expected = "a phase centre on the sky, as the feeds turn with the mount";
                return Err(ArrayError::bad_value("phase centre", &center.name, expected));
            }
        };
        let ((sin_h, cos_h), (sin_d, cos_d), (sin_p, cos_p)) = (hour_angle.sin_cos(), dec.sin_cos(), site.latitude_rad.sin_cos());
        Ok(Self {
            toward: [-cos_d * sin_h, cos_p * sin_d - sin_p * cos_d * cos_h, sin_p * sin_d + cos_p * cos_d * cos_h],
            north: [sin_d * sin_h, cos_p * cos_d + sin_p * sin_d * cos_h, sin_p * cos_d - cos_p * sin_d * cos_h],
            east: [cos_h, -sin_p * sin_h, cos_p * sin_h],
            frame_pa_rad,
        })
    }

    fn angle(&self, mount: Mount) -> f64 {
        let zenith = self.east[2].atan2(self.north[2]);
        let elevation = self.toward[2].clamp(-1.0, 1.0).asin();
        let apparent = match mount {
            Mount::AltAz => zenith,
            Mount::NasmythRight => zenith + elevation,
            Mount::NasmythLeft => zenith - elevation,
            Mount::Equatorial => return 0.0,
            Mount::Fixed => {
                // The rotation that takes the zenith to the direction, applied to the north.
                let axis = cross([0.0, 0.0, 1.0], self.toward);
                let first = cross(axis, [0.0, 1.0, 0.0]);
                let second = cross(axis, first).map(|x| x / (1.0 + self.toward[2]));
                let carried = [first[0] + second[0], 1.0 + first[1] + second[1], first[2] + second[2]];
                dot(carried, self.east).atan2(dot(carried, self.north))
            }
        };
        apparent - self.frame_pa_rad
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    const SITE: Site = Site { latitude_rad: 0.6, longitude_rad: 0.3, altitude_m: 100.0 };

    fn center(ahead: f64, dec: f64) -> PhaseCenter {
        let lst = LocalSky::at(2_460_000.3, &SITE).unwrap().lst_rad();
        PhaseCenter::sidereal("s", lst - ahead, dec).unwrap()
    }

    fn angle(mount: Mount, hour_angle: f64, dec: f64) -> f64 {
        sky_angle_rad(mount, &center(hour_angle, dec), 2_460_000.3, &SITE).unwrap()
    }

    // Precession since J2000 turns the frame by a tenth of a degree, and moves the hour angle by a third.
    #[test]
    fn the_zenith_is_north_of_a_southern_source_on_the_meridian_and_east_of_one_that_sets() {
        assert!(angle(Mount::AltAz, 0.0, 0.2).abs() < 0.02);
        assert!((angle(Mount::AltAz, 0.0, 1.1).abs() - PI).abs() < 0.04, "{}", angle(Mount::AltAz, 0.0, 1.1));
        let q = |h: f64, d: f64| (0.6_f64.cos() * h.sin()).atan2(0.6_f64.sin() * d.cos() - 0.6_f64.cos() * d.sin() * h.cos());
        for (h, d) in [(0.9, 0.3), (-1.2, -0.1), (2.0, 1.0)] {
            assert!((angle(Mount::AltAz, h, d) - q(h, d)).abs() < 0.02, "{h} {d}");
        }
        assert_eq!(angle(Mount::Equatorial, 0.9, 0.3), 0.0);
    }

    #[test]
    fn nasmyth_feeds_turn_with_the_elevation_too_and_fixed_ones_point_north_at_the_zenith() {
        let (right, left) = (angle(Mount::NasmythRight, 0.5, 0.3), angle(Mount::NasmythLeft, 0.5, 0.3));
        assert!((0.5 * (right + left) - angle(Mount::AltAz, 0.5, 0.3)).abs() < 1e-12);
        assert!(right > left && (right - left) < PI);
        assert!(angle(Mount::Fixed, 0.0, 0.6).abs() < 0.01);
        // On the meridian the north stays in the plane of the meridian.
        assert!(angle(Mount::Fixed, 0.0, 0.1).abs() < 0.01 && angle(Mount::Fixed, 0.0, 1.3).abs() < 0.02);
    }
}
