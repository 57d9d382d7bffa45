//! The apparent places of `tests/data/apparent_places.csv`, which pyuvdata computed.

use super::*;

/// Angles agree to this, rad: 0.1 mas, twice the rounding of the pole in the table of Earth orientation.
const TOL_RAD: f64 = 5e-10;

fn difference(a: f64, b: f64) -> f64 {
    let d = (a - b).rem_euclid(TAU);
    d.min(TAU - d)
}

fn worst(text: &str) -> [f64; 4] {
    let mut worst = [0.0_f64; 4];
    let mut rows = 0;
    for line in text.lines().filter(|l| !l.starts_with('#') && !l.starts_with("time")) {
        let c: Vec<&str> = line.split(',').collect();
        let v = |i: usize| c[i].parse::<f64>().unwrap();
        let site = Site { latitude_rad: v(1), longitude_rad: v(2), altitude_m: v(3) };
        let sky = LocalSky::at(v(0), &site).unwrap();
        let p = sky.apparent_place(v(4), v(5), c[6]).unwrap();
        // Right ascension and the position angle lose their meaning at the pole; arcs on the sky do not.
        let arc = p.dec_rad.cos();
        let found = [
            difference(sky.lst_rad(), v(7)),
            difference(p.ra_rad, v(8)) * arc,
            difference(p.dec_rad, v(9)),
            difference(p.frame_pa_rad, v(10)) * arc,
        ];
        for (w, f) in worst.iter_mut().zip(found) {
            assert!(f.is_finite());
            *w = w.max(f);
        }
        rows += 1;
    }
    assert!(rows > 50);
    worst
}

#[test]
fn sidereal_time_and_apparent_places_are_those_of_pyuvdata() {
    let found = worst(include_str!("../../tests/data/apparent_places.csv"));
    assert!(found.iter().all(|f| *f < TOL_RAD), "lst, ra, dec, frame pa differ by {found:?} rad");
}

#[test]
fn a_source_transits_when_the_sidereal_time_is_its_right_ascension() {
    let site = Site { latitude_rad: 0.6, longitude_rad: -1.9, altitude_m: 2000.0 };
    let sky = LocalSky::at(2_460_000.25, &site).unwrap();
    let overhead = ApparentPlace { ra_rad: sky.lst_rad(), dec_rad: 0.6, frame_pa_rad: 0.0 };
    assert!((sky.elevation_rad(&overhead, &site) - FRAC_PI_2).abs() < 1e-7);
}

#[test]
fn bad_times_and_frames_are_refused() {
    let site = Site { latitude_rad: 0.6, longitude_rad: -1.9, altitude_m: 2000.0 };
    for jd in [f64::NAN, f64::INFINITY, 0.0, 58_849.0, 1e12] {
        assert!(lst_rad(jd, &site).unwrap_err().to_string().contains("Julian date"), "{jd}");
    }
    assert!(apparent_place(1.0, 0.5, "fk4", 2_460_000.5, &site).unwrap_err().to_string().contains("icrs or fk5"));
    assert!(apparent_place(f64::NAN, 0.5, "icrs", 2_460_000.5, &site).is_err());
    let nowhere = Site { latitude_rad: f64::NAN, ..site };
    assert!(apparent_place(1.0, 0.5, "icrs", 2_460_000.5, &nowhere).is_err());
}
