//! From universal transverse Mercator to latitude and longitude on WGS84.

/// Semi-major axis of WGS84, m.
const A_M: f64 = 6_378_137.0;
/// Flattening of WGS84.
const F: f64 = 1.0 / 298.257_223_563;
/// Scale on the central meridian.
const K0: f64 = 0.9996;

/// Latitude and longitude in rad of a point in a zone (1 to 60); `south` adds the false northing of 10,000 km.
///
/// # Reference
/// Krüger 1912, in the form of Karney 2011, J. Geodesy 85, 475: series in the third flattening n to fourth order, below a micrometre.
pub(super) fn utm_to_geodetic_rad(easting_m: f64, northing_m: f64, zone: u32, south: bool) -> (f64, f64) {
    let n = F / (2.0 - F);
    let (n2, n3, n4) = (n * n, n.powi(3), n.powi(4));
    let rectifying_radius = A_M / (1.0 + n) * (1.0 + n2 / 4.0 + n4 / 64.0);
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
    let ecc = (F * (2.0 - F)).sqrt();
    let mut sin_lat = sin_chi;
    for _ in 0..12 {
        sin_lat = (isometric + ecc * (ecc * sin_lat).atanh()).tanh();
    }
    let central_rad = (6.0 * f64::from(zone) - 183.0).to_radians();
    (sin_lat.asin(), central_rad + e.sinh().atan2(x.cos()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The forward projection by its own series (alpha), as an oracle.
    fn forward(lat: f64, lon: f64, zone: u32) -> (f64, f64) {
        let n = F / (2.0 - F);
        let (n2, n3, n4) = (n * n, n.powi(3), n.powi(4));
        let a = A_M / (1.0 + n) * (1.0 + n2 / 4.0 + n4 / 64.0);
        let alpha = [
            n / 2.0 - 2.0 / 3.0 * n2 + 5.0 / 16.0 * n3 + 41.0 / 180.0 * n4,
            13.0 / 48.0 * n2 - 3.0 / 5.0 * n3 + 557.0 / 1440.0 * n4,
            61.0 / 240.0 * n3 - 103.0 / 140.0 * n4,
            49_561.0 / 161_280.0 * n4,
        ];
        let ecc = (F * (2.0 - F)).sqrt();
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
            let (la, lo) = utm_to_geodetic_rad(e, if lat < 0.0 { n + 1e7 } else { n }, zone, lat < 0.0);
            assert!((la - lat.to_radians()).abs() * A_M < 1e-6, "{lat}: {}", la.to_degrees());
            assert!((lo - lon.to_radians()).abs() * A_M < 1e-6, "{lon}: {}", lo.to_degrees());
        }
    }

    #[test]
    fn a_known_point_is_where_the_map_has_it() {
        // Meridian quadrant of WGS84, 10,001,965.729 m, times the scale: the pole.
        let (lat, _) = utm_to_geodetic_rad(500_000.0, K0 * 10_001_965.729_3, 31, false);
        assert!((lat.to_degrees() - 90.0).abs() < 1e-6, "{}", lat.to_degrees());
        // CN Tower, Toronto: 17 N 630084 E 4833438 N is 43 38 33.24 N, 79 23 13.7 W.
        let (lat, lon) = utm_to_geodetic_rad(630_084.0, 4_833_438.0, 17, false);
        assert!((lat.to_degrees() - 43.642_567).abs() < 1e-5 && (lon.to_degrees() + 79.387_139).abs() < 1e-5);
    }
}
