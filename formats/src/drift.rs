//! Arrays that do not track the sky: their direction, and the phasing of their rows to a fixed point of the sky.

use cittert_arrays::astrometry::LocalSky;
use cittert_arrays::{ArrayError, PhaseCenter, PhaseCenterKind, Site};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Apparent right ascension and declination of a direction fixed to the Earth.
pub(crate) fn apparent_direction(kind: PhaseCenterKind, latitude_rad: f64, lst_rad: f64) -> (f64, f64) {
    let (az, el) = match kind {
        PhaseCenterKind::Driftscan { az_rad, el_rad } => (az_rad, el_rad),
        _ => (0.0, FRAC_PI_2),
    };
    let (sin_lat, cos_lat) = latitude_rad.sin_cos();
    let (north, east, up) = (el.cos() * az.cos(), el.cos() * az.sin(), el.sin());
    // Axes towards the meridian, the west and the pole.
    let (x, y, z) = (up * cos_lat - north * sin_lat, -east, up * sin_lat + north * cos_lat);
    ((lst_rad - y.atan2(x)).rem_euclid(TAU), z.atan2(x.hypot(y)))
}

fn unit(ra: f64, dec: f64) -> [f64; 3] {
    [dec.cos() * ra.cos(), dec.cos() * ra.sin(), dec.sin()]
}

/// ICRS direction with the given apparent place, and the position angle of its frame. The difference between apparent and catalogue
/// direction is subtracted repeatedly; each iteration reduces the error by more than a factor of 100.
pub(crate) fn catalogue(sky: &LocalSky, ra: f64, dec: f64) -> Result<(f64, f64, f64), ArrayError> {
    let want = unit(ra, dec);
    let mut v = want;
    let mut turn = 0.0;
    for _ in 0..12 {
        let (r, d) = (v[1].atan2(v[0]).rem_euclid(TAU), v[2].atan2(v[0].hypot(v[1])));
        let place = sky.apparent_place(r, d, "icrs")?;
        let got = unit(place.ra_rad, place.dec_rad);
        turn = place.frame_pa_rad;
        v = [0, 1, 2].map(|k| v[k] + want[k] - got[k]);
    }
    Ok((v[1].atan2(v[0]).rem_euclid(TAU), v[2].atan2(v[0].hypot(v[1])), turn))
}

/// Phases rows to the direction of the array at one time, as pyuvdata phases a drift scan.
#[derive(Debug)]
pub(crate) struct Drift {
    site: Site,
    sky: crate::uvh5::Sky,
    kinds: Vec<PhaseCenterKind>,
    /// The points of the sky, in the order of the phase centres of the set.
    pub(crate) centers: Vec<PhaseCenter>,
}

/// A phased row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Phased {
    pub(crate) uvw_m: [f64; 3],
    /// The visibility is multiplied by exp(-2 pi i w nu / c) with this w, m.
    pub(crate) stop_w_m: f64,
}

impl Drift {
    /// Replace each phase centre that is not a point of the sky by the point that the array points at at `time_jd`.
    ///
    /// # Errors
    /// A time outside the years 1901 to 2099.
    pub(crate) fn new(centers: &[PhaseCenter], site: Site, time_jd: f64) -> Result<Self, ArrayError> {
        let sky = LocalSky::at(time_jd, &site)?;
        let point = |c: &PhaseCenter| -> Result<PhaseCenter, ArrayError> {
            if matches!(c.kind, PhaseCenterKind::Sidereal { .. }) {
                return Ok(c.clone());
            }
            let (ra, dec) = apparent_direction(c.kind, site.latitude_rad, sky.lst_rad());
            let (ra, dec, _) = catalogue(&sky, ra, dec)?;
            let name = match c.kind {
                PhaseCenterKind::Unprojected => format!("zenith_at_jd{time_jd:.6}"),
                _ => format!("{}_at_jd{time_jd:.6}", c.name),
            };
            Ok(PhaseCenter { id: c.id, ..PhaseCenter::sidereal(&name, ra, dec)? })
        };
        let kinds = centers.iter().map(|c| c.kind).collect();
        let centers = centers.iter().map(point).collect::<Result<_, _>>()?;
        Ok(Self { site, sky: crate::uvh5::Sky::over(site), kinds, centers })
    }

    /// Phase a row of phase centre `index`.
    ///
    /// # Errors
    /// A time outside the years 1901 to 2099.
    pub(crate) fn phased(&mut self, index: usize, time_jd: f64, uvw_m: [f64; 3]) -> Result<Phased, ArrayError> {
        let kind = self.kinds[index];
        if matches!(kind, PhaseCenterKind::Sidereal { .. }) {
            return Ok(Phased { uvw_m, stop_w_m: 0.0 });
        }
        let (lst, to) = self.sky.at(time_jd, &self.centers, index)?;
        let (ra, dec) = apparent_direction(kind, self.site.latitude_rad, lst);
        let (from, onto) = (axes(lst - ra, dec), axes(lst - to.ra_rad, to.dec_rad));
        let xyz = [0, 1, 2].map(|k| (0..3).map(|a| from[a][k] * uvw_m[a]).sum::<f64>());
        let [u, v, w] = onto.map(|axis| (0..3).map(|k| axis[k] * xyz[k]).sum::<f64>());
        let (sin, cos) = to.frame_pa_rad.sin_cos();
        // Unprojected visibilities contain the whole phase. For a direction fixed to the Earth the phase of w is removed already.
        let old_w = if kind == PhaseCenterKind::Unprojected { 0.0 } else { uvw_m[2] };
        Ok(Phased { uvw_m: [u * cos - v * sin, u * sin + v * cos, w], stop_w_m: w - old_w })
    }
}

/// The axes u, v, w towards an hour angle and declination, in the axes towards the meridian, the east and the pole.
///
/// # Reference
/// Thompson, Moran & Swenson 2017, equation 4.1.
fn axes(hour_angle: f64, dec: f64) -> [[f64; 3]; 3] {
    let ((sh, ch), (sd, cd)) = (hour_angle.sin_cos(), dec.sin_cos());
    [[sh, ch, 0.0], [-sd * ch, sd * sh, cd], [cd * ch, -cd * sh, sd]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_direction_is_found_whose_apparent_place_is_the_zenith() {
        for lat in [-1.2_f64, -0.536, 0.0, 0.6, 1.5] {
            let site = Site { latitude_rad: lat, longitude_rad: 0.37, altitude_m: 1000.0 };
            let sky = LocalSky::at(2_458_432.843, &site).unwrap();
            let (ra, dec) = apparent_direction(PhaseCenterKind::Unprojected, lat, sky.lst_rad());
            let offset = (ra - sky.lst_rad() + 3.0).rem_euclid(TAU) - 3.0;
            assert!(offset.abs() < 1e-12 && (dec - lat).abs() < 1e-12);
            let (r, d, _) = catalogue(&sky, ra, dec).unwrap();
            let place = sky.apparent_place(r, d, "icrs").unwrap();
            let (a, b) = (unit(place.ra_rad, place.dec_rad), unit(ra, dec));
            assert!((0..3).all(|k| (a[k] - b[k]).abs() < 1e-12), "{lat}");
        }
    }

    #[test]
    fn a_direction_in_the_east_has_yet_to_culminate() {
        let kind = PhaseCenterKind::Driftscan { az_rad: FRAC_PI_2, el_rad: 0.3 };
        let (ra, dec) = apparent_direction(kind, 0.0, 1.0);
        // On the equator the east point is 6 h before the meridian: right ascension is larger than the sidereal time.
        assert!((ra - (1.0 + FRAC_PI_2 - 0.3)).abs() < 1e-12 && dec.abs() < 1e-12);
    }

    #[test]
    fn at_its_time_the_point_of_the_sky_is_the_zenith() {
        let site = Site { latitude_rad: -0.536, longitude_rad: 0.37, altitude_m: 1000.0 };
        let centers = [PhaseCenter::unprojected("zenith")];
        let time = 2_458_432.843;
        let mut drift = Drift::new(&centers, site, time).unwrap();
        assert_eq!(drift.centers[0].name, "zenith_at_jd2458432.843000");
        let row = [30.0, -12.0, 0.5];
        let first = drift.phased(0, time, row).unwrap();
        // u and v turn with the frame of the catalogue; w is the height.
        let (_, place) = drift.sky.at(time, &drift.centers.clone(), 0).unwrap();
        let (sin, cos) = place.frame_pa_rad.sin_cos();
        let turned = [30.0 * cos + 12.0 * sin, 30.0 * sin - 12.0 * cos, 0.5];
        assert!((0..3).all(|k| (first.uvw_m[k] - turned[k]).abs() < 1e-9), "{first:?}");
        assert!((first.stop_w_m - 0.5).abs() < 1e-9);
        // An hour later the sky has turned by 15.04 deg: an east-west baseline has gained w.
        let later = drift.phased(0, time + 1.0 / 24.0, [30.0, 0.0, 0.0]).unwrap();
        let expected = 30.0 * (-0.536_f64).cos() * (15.041_f64).to_radians().sin();
        assert!((later.uvw_m[2] + expected).abs() < 0.01, "{later:?} {expected}");
        let length = later.uvw_m.iter().map(|x| x * x).sum::<f64>().sqrt();
        assert!((length - 30.0).abs() < 1e-9);
    }
}
