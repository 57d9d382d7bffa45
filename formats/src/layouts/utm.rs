//! Conversion of universal transverse Mercator coordinates, on the datums of antenna surveys, to geocentric positions.

use crate::builtin;
use serde::Deserialize;
use std::sync::LazyLock;

/// An ellipsoid and the position of its centre in WGS84.
#[derive(Debug, Clone, Deserialize)]
pub(super) struct Datum {
    name: String,
    dx_m: f64,
    dy_m: f64,
    dz_m: f64,
    semi_major_m: f64,
    inverse_flattening: f64,
}

static DATUMS: LazyLock<Vec<Datum>> = LazyLock::new(|| builtin::rows(include_str!("datums.csv")));

/// Scale on the central meridian.
const K0: f64 = 0.9996;

impl Datum {
    /// The datum of that name, in upper or lower case.
    pub(super) fn find(name: &str) -> Option<&'static Self> {
        DATUMS.iter().find(|d| d.name.eq_ignore_ascii_case(name))
    }

    /// Names of all datums, for a message.
    pub(super) fn names() -> String {
        DATUMS.iter().map(|d| d.name.as_str()).collect::<Vec<_>>().join(", ")
    }

    fn flattening(&self) -> f64 {
        1.0 / self.inverse_flattening
    }

    /// Geocentric position in WGS84 of easting, northing and height in a zone (1 to 60), m.
    pub(super) fn utm_to_ecef_m(&self, [easting_m, northing_m, height_m]: [f64; 3], zone: u32, south: bool) -> [f64; 3] {
        let (lat, lon) = self.utm_to_geodetic_rad(easting_m, northing_m, zone, south);
        let e2 = self.flattening() * (2.0 - self.flattening());
        let ((sin_lat, cos_lat), (sin_lon, cos_lon)) = (lat.sin_cos(), lon.sin_cos());
        let n = self.semi_major_m / (1.0 - e2 * sin_lat * sin_lat).sqrt();
        let r = (n + height_m) * cos_lat;
        [r * cos_lon + self.dx_m, r * sin_lon + self.dy_m, (n * (1.0 - e2) + height_m) * sin_lat + self.dz_m]
    }

    /// Latitude and longitude in rad of a point in a zone (1 to 60); `south` adds the false northing of 10,000 km.
    ///
    /// # Reference
    /// Krüger 1912, in the form of Karney 2011, J. Geodesy 85, 475: series in the third flattening n to fourth order, below a micrometre.
    fn utm_to_geodetic_rad(&self, easting_m: f64, northing_m: f64, zone: u32, south: bool) -> (f64, f64) {
        let f = self.flattening();
        let n = f / (2.0 - f);
        let (n2, n3, n4) = (n * n, n.powi(3), n.powi(4));
        let rectifying_radius = self.semi_major_m / (1.0 + n) * (1.0 + n2 / 4.0 + n4 / 64.0);
        let beta = [
            n / 2.0 - 2.0 / 3.0 * n2 + 37.0 / 96.0 * n3 - n4 / 360.0,
            n2 / 48.0 + n3 / 15.0 - 437.0 / 1440.0 * n4,
            17.0 / 480.0 * n3 - 37.0 / 840.0 * n4,
            4397.0 / 161_280.0 * n4,
        ];
        let xi = (northing_m - if south { 10_000_000.0 } else { 0.0 }) / (K0 * rectifying_radius);
        let eta = (easting_m - 500_000.0) / (K0 * rectifying_radius);
        let (mut x, mut e) = (xi, eta);
        for (j, b) in beta.iter().enumerate() {
            let k = 2.0 * (j + 1) as f64;
            x -= b * (k * xi).sin() * (k * eta).cosh();
            e -= b * (k * xi).cos() * (k * eta).sinh();
        }
        // The isometric latitude of the conformal sphere, then the latitude by fixed point: each step gains a factor of 300.
        let sin_chi = x.sin() / e.cosh();
        let isometric = sin_chi.atanh();
        let ecc = (f * (2.0 - f)).sqrt();
        let mut sin_lat = sin_chi;
        for _ in 0..12 {
            sin_lat = (isometric + ecc * (ecc * sin_lat).atanh()).tanh();
        }
        let central_rad = (6.0 * f64::from(zone) - 183.0).to_radians();
        (sin_lat.asin(), central_rad + e.sinh().atan2(x.cos()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wgs84() -> &'static Datum {
        Datum::find("wgs84").unwrap()
    }

    /// The forward projection by its own series (alpha), as an oracle.
    fn forward(lat: f64, lon: f64, zone: u32) -> (f64, f64) {
        let f: f64 = 1.0 / 298.257_223_563;
        let n = f / (2.0 - f);
        let (n2, n3, n4) = (n * n, n.powi(3), n.powi(4));
        let a = 6_378_137.0 / (1.0 + n) * (1.0 + n2 / 4.0 + n4 / 64.0);
        let alpha = [
            n / 2.0 - 2.0 / 3.0 * n2 + 5.0 / 16.0 * n3 + 41.0 / 180.0 * n4,
            13.0 / 48.0 * n2 - 3.0 / 5.0 * n3 + 557.0 / 1440.0 * n4,
            61.0 / 240.0 * n3 - 103.0 / 140.0 * n4,
            49_561.0 / 161_280.0 * n4,
        ];
        let ecc = (f * (2.0 - f)).sqrt();
        let t = (lat.sin().atanh() - ecc * (ecc * lat.sin()).atanh()).sinh();
        let dl = lon - (6.0 * f64::from(zone) - 183.0).to_radians();
        let (xi, eta) = (t.atan2(dl.cos()), (dl.sin() / t.hypot(dl.cos())).asinh());
        let (mut x, mut y) = (eta, xi);
        for (j, c) in alpha.iter().enumerate() {
            let k = 2.0 * (j + 1) as f64;
            y += c * (k * xi).sin() * (k * eta).cosh();
            x += c * (k * xi).cos() * (k * eta).sinh();
        }
        (500_000.0 + K0 * a * x, K0 * a * y)
    }

    #[test]
    fn the_inverse_undoes_the_projection_to_a_micrometre() {
        for (lat, lon, zone) in [(34.0784_f64, -107.6177_f64, 13), (-23.0229, -67.7549, 19), (0.0, 3.0, 31), (63.9, 20.0, 34)] {
            let (e, n) = forward(lat.to_radians(), lon.to_radians(), zone);
            let (la, lo) = wgs84().utm_to_geodetic_rad(e, if lat < 0.0 { n + 1e7 } else { n }, zone, lat < 0.0);
            assert!((la - lat.to_radians()).abs() * 6_378_137.0 < 1e-6, "{lat}: {}", la.to_degrees());
            assert!((lo - lon.to_radians()).abs() * 6_378_137.0 < 1e-6, "{lon}: {}", lo.to_degrees());
        }
    }

    #[test]
    fn a_known_point_is_where_the_map_has_it() {
        // Meridian quadrant of WGS84, 10,001,965.729 m, times the scale: the pole.
        let (lat, _) = wgs84().utm_to_geodetic_rad(500_000.0, K0 * 10_001_965.729_3, 31, false);
        assert!((lat.to_degrees() - 90.0).abs() < 1e-6, "{}", lat.to_degrees());
        // CN Tower, Toronto: 17 N 630084 E 4833438 N is 43 38 33.24 N, 79 23 13.7 W.
        let (lat, lon) = wgs84().utm_to_geodetic_rad(630_084.0, 4_833_438.0, 17, false);
        assert!((lat.to_degrees() - 43.642_567).abs() < 1e-5 && (lon.to_degrees() + 79.387_139).abs() < 1e-5);
    }

    /// `simutil.utm2xyz` of CASA 6.7 for the same numbers; its series are good to a few millimetres.
    #[test]
    fn positions_are_those_of_casa() {
        assert_eq!(DATUMS.len(), 18);
        for (datum, utm, zone, south, xyz) in [
            ("SAM56", [627_789.81, 7_453_079.62, 5029.4], 19, true, [2_225_083.645_11, -5_440_152.112_94, -2_481_694.493_44]),
            ("WGS84", [627_789.81, 7_453_079.62, 5029.4], 19, true, [2_225_279.568_11, -5_440_087.235_88, -2_481_316.842_74]),
            ("NAD27", [325_000.0, 3_772_000.0, 2115.0], 13, false, [-1_537_636.846_74, -5_061_876.184_44, 3_554_598.546_42]),
        ] {
            let found = Datum::find(datum).unwrap().utm_to_ecef_m(utm, zone, south);
            assert!((0..3).all(|k| (found[k] - xyz[k]).abs() < 5e-3), "{datum}: {found:?}");
        }
    }
}
