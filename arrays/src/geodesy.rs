//! Places on the Earth: geodetic coordinates on WGS84, geocentric ones, and the local horizon.

use crate::{Antenna, ArrayError, ArrayLayout, LayoutFrame, Result, Site};

/// Semi-major axis of WGS84, m.
const A_M: f64 = 6_378_137.0;
/// Flattening of WGS84.
const F: f64 = 1.0 / 298.257_223_563;

impl Site {
    /// Geocentric (ECEF) coordinates, m.
    #[must_use]
    pub fn to_ecef_m(&self) -> [f64; 3] {
        let e2 = F * (2.0 - F);
        let (sin_lat, cos_lat) = self.latitude_rad.sin_cos();
        let (sin_lon, cos_lon) = self.longitude_rad.sin_cos();
        let n = A_M / (1.0 - e2 * sin_lat * sin_lat).sqrt();
        let r = (n + self.altitude_m) * cos_lat;
        [r * cos_lon, r * sin_lon, (n * (1.0 - e2) + self.altitude_m) * sin_lat]
    }

    /// The site at geocentric coordinates in m.
    ///
    /// # Reference
    /// Bowring 1976, Survey Review 23, 323, iterated until the latitude no longer changes.
    #[must_use]
    pub fn from_ecef_m(xyz: [f64; 3]) -> Self {
        let [x, y, z] = xyz;
        let e2 = F * (2.0 - F);
        let b = A_M * (1.0 - F);
        let ep2 = e2 / (1.0 - e2);
        let p = x.hypot(y);
        let mut beta = (z * A_M).atan2(p * b);
        let mut latitude_rad = 0.0;
        for _ in 0..10 {
            let (sin_b, cos_b) = beta.sin_cos();
            let next = (z + ep2 * b * sin_b.powi(3)).atan2(p - e2 * A_M * cos_b.powi(3));
            beta = ((1.0 - F) * f64::sin(next)).atan2(f64::cos(next));
            let done = f64::abs(next - latitude_rad) < 1e-15;
            latitude_rad = next;
            if done {
                break;
            }
        }
        let (sin_lat, cos_lat) = latitude_rad.sin_cos();
        let n = A_M / (1.0 - e2 * sin_lat * sin_lat).sqrt();
        // This form is accurate both at the pole and at the equator.
        let altitude_m = p * cos_lat + z * sin_lat - A_M * A_M / n;
        Self { latitude_rad, longitude_rad: y.atan2(x), altitude_m }
    }

    /// Rows east, north, up in geocentric axes.
    fn axes(&self) -> [[f64; 3]; 3] {
        let (sin_lat, cos_lat) = self.latitude_rad.sin_cos();
        let (sin_lon, cos_lon) = self.longitude_rad.sin_cos();
        [[-sin_lon, cos_lon, 0.0], [-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat], [cos_lat * cos_lon, cos_lat * sin_lon, sin_lat]]
    }

    /// East, north, up of a geocentric offset from the site (or of any geocentric vector), m.
    #[must_use]
    pub fn ecef_offset_to_enu(&self, d: [f64; 3]) -> [f64; 3] {
        self.axes().map(|row| row[0] * d[0] + row[1] * d[1] + row[2] * d[2])
    }

    /// Geocentric components of an east, north, up vector, m.
    #[must_use]
    pub fn enu_to_ecef_offset(&self, enu: [f64; 3]) -> [f64; 3] {
        let a = self.axes();
        [0, 1, 2].map(|k| a[0][k] * enu[0] + a[1][k] * enu[1] + a[2][k] * enu[2])
    }
}

impl ArrayLayout {
    /// A layout from antennas whose positions (and position errors) are geocentric, m.
    ///
    /// Without a given site, the site has the geodetic direction of the centroid and the mean height of the antennas. It is on the ground
    /// also for arrays as large as the Earth.
    ///
    /// # Errors
    /// A position that is not within some hundred kilometres of the Earth's surface; and the errors of [`ArrayLayout::new`].
    pub fn from_ecef(name: impl Into<String>, site: Option<Site>, mut antennas: Vec<Antenna>) -> Result<Self> {
        for a in &antennas {
            let radius = a.position_m.iter().map(|p| p * p).sum::<f64>().sqrt();
            ArrayError::unless(
                (6.25e6..=6.6e6).contains(&radius),
                format_args!("position of antenna {:?}", a.name),
                format_args!("{:?}, {radius} m from the centre of the Earth", a.position_m),
                "geocentric x, y, z in metres near the Earth's surface",
            )?;
        }
        let site = match (site, antennas.is_empty()) {
            (Some(site), _) => site,
            (None, false) => site_of(&antennas),
            (None, true) => Site::from_ecef_m([A_M, 0.0, 0.0]),
        };
        let center = site.to_ecef_m();
        let axes = site.axes();
        for a in &mut antennas {
            let p = a.position_m;
            a.position_m = site.ecef_offset_to_enu([0, 1, 2].map(|k| p[k] - center[k]));
            // Independent errors add in squares along the turned axes.
            a.position_error_m = a.position_error_m.map(|e| axes.map(|row| (0..3).map(|k| (row[k] * e[k]).powi(2)).sum::<f64>().sqrt()));
        }
        Self::new(name, LayoutFrame::EastNorthUp(site), antennas)
    }

    /// Geocentric position of every antenna, m; none in the boresight frame.
    #[must_use]
    pub fn ecef_m(&self) -> Option<Vec<[f64; 3]>> {
        let site = self.site()?;
        let center = site.to_ecef_m();
        let place = |a: &Antenna| {
            let d = site.enu_to_ecef_offset(a.position_m);
            [0, 1, 2].map(|k| center[k] + d[k])
        };
        Some(self.antennas().iter().map(place).collect())
    }
}

/// A site on the ground in the middle of geocentric positions.
fn site_of(antennas: &[Antenna]) -> Site {
    let n = antennas.len() as f64;
    let centroid = [0, 1, 2].map(|k| antennas.iter().map(|a| a.position_m[k]).sum::<f64>() / n);
    let radius = centroid.iter().map(|c| c * c).sum::<f64>().sqrt();
    // Antennas on opposite sides of the Earth have no middle on its surface, so the first antenna is used.
    let toward = if radius > 1e5 { centroid } else { antennas[0].position_m };
    let scale = A_M / toward.iter().map(|c| c * c).sum::<f64>().sqrt();
    let altitude_m = antennas.iter().map(|a| Site::from_ecef_m(a.position_m).altitude_m).sum::<f64>() / n;
    Site { altitude_m, ..Site::from_ecef_m(toward.map(|c| c * scale)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn geodetic_and_geocentric_agree_everywhere() {
        for lat in [-90.0, -67.1, -23.0, 0.0, 1e-7, 34.0784, 89.9999, 90.0_f64] {
            for alt in [-100.0, 0.0, 5058.7, 400_000.0] {
                let site = Site { latitude_rad: lat.to_radians(), longitude_rad: -1.878, altitude_m: alt };
                let back = Site::from_ecef_m(site.to_ecef_m());
                assert!((back.latitude_rad - site.latitude_rad).abs() < 1e-14, "{lat} {alt}");
                assert!((back.altitude_m - alt).abs() < 1e-8, "{lat} {alt} {}", back.altitude_m);
            }
        }
    }

    #[test]
    fn up_points_away_from_the_earth() {
        let site = Site { latitude_rad: 0.6, longitude_rad: 1.2, altitude_m: 0.0 };
        let higher = Site { altitude_m: 10.0, ..site };
        let (a, b) = (site.to_ecef_m(), higher.to_ecef_m());
        let enu = site.ecef_offset_to_enu([b[0] - a[0], b[1] - a[1], b[2] - a[2]]);
        assert!(enu[0].abs() < 1e-8 && enu[1].abs() < 1e-8 && (enu[2] - 10.0).abs() < 1e-8, "{enu:?}");
        let d = site.enu_to_ecef_offset(enu);
        assert!((0..3).all(|k| (d[k] - (b[k] - a[k])).abs() < 1e-9));
    }

    #[test]
    fn geocentric_positions_survive_becoming_east_north_up() {
        let xyz = [[-1_601_614.061_201, -5_042_001.676_547, 3_554_652.455_603], [-1_602_592.823_528, -5_042_055.013_423, 3_554_140.652_77]];
        let antennas: Vec<Antenna> = xyz.iter().enumerate().map(|(i, p)| Antenna::new(format!("A{i}"), i as u32, *p)).collect();
        let layout = ArrayLayout::from_ecef("vla", None, antennas.clone()).unwrap();
        let back = layout.ecef_m().unwrap();
        assert!((0..2).all(|i| (0..3).all(|k| (back[i][k] - xyz[i][k]).abs() < 1e-8)));
        let altitude = layout.site().unwrap().altitude_m;
        assert!((2100.0..2130.0).contains(&altitude), "{altitude}");
        let mut low = antennas;
        low[1].position_m = [0.0, 0.0, 100.0];
        assert!(ArrayLayout::from_ecef("vla", None, low).is_err());
    }
}
