//! Compares the sky table with the integral that it replaces.

use std::time::Instant;

use crate::atmosphere::*;

fn mls() -> Atmosphere {
    Atmosphere::reference("mls", "mpm89").unwrap()
}

#[test]
fn table_of_frequencies_keeps_its_stated_error() {
    let freqs = [10.0, 94.0, 183.0];
    let table = SkyTable::for_frequencies(&mls(), &freqs, &SkyTableOptions::default()).unwrap();
    assert!(table.interpolation_error_k() <= 0.05);
    let zeniths: Vec<f64> = (0..300).map(|i| 89.999 * (f64::from(i) / 299.0).powf(0.3)).collect();
    for row in mls().sky(&freqs, &zeniths, Geometry::Spherical).unwrap() {
        let ours = table.temperature_k(row.zenith_deg, row.freq_ghz).unwrap();
        let off = (ours - row.tb_planck_k).abs();
        assert!(off <= table.interpolation_error_k(), "{row:?} {off}");
    }
}

#[test]
fn below_the_horizon_the_ground_is_seen_through_the_air() {
    let options = SkyTableOptions { ground_k: Some(310.0), ..SkyTableOptions::default() };
    let surface = SkyTable::for_frequencies(&mls(), &[94.0], &options).unwrap();
    assert_eq!(surface.horizon_deg(), 90.0);
    assert!((surface.temperature_k(90.5, 94.0).unwrap() - 310.0).abs() < 1e-9);
    assert!(surface.temperature_k(90.0, 94.0).unwrap() < 300.0);

    let high = SkyTableOptions { observer_km: Some(3.0), ..options };
    let table = SkyTable::for_frequencies(&mls(), &[94.0], &high).unwrap();
    let horizon = table.horizon_deg();
    // Refraction lifts the horizon: the dip is less than that of a straight ray.
    let straight_dip = (EARTH_RADIUS_KM / (EARTH_RADIUS_KM + 3.0)).acos().to_degrees();
    assert!((0.8..0.95).contains(&((horizon - 90.0) / straight_dip)), "{horizon}");
    let nadir = table.temperature_k(180.0, 94.0).unwrap();
    let path = mls().path(&[94.0], &PathEnds::new(3.0, 0.0, PathExtent::ZenithDeg(0.0)).unwrap()).unwrap()[0];
    let ground = planck::black_body_radiance(94.0, 310.0);
    let expected = planck::planck_temperature_k(94.0, path.seen_before(ground));
    assert!((nadir - expected).abs() < 1e-6);
    // Rays just above the horizon pass a tangent height and see a deep, warm atmosphere.
    let grazing = table.temperature_k(horizon - 0.01, 94.0).unwrap();
    let level = table.temperature_k(90.0, 94.0).unwrap();
    assert!(grazing > level && grazing < 300.0, "{grazing} {level}");
}

#[test]
fn tables_can_be_built_at_every_height() {
    let air = Atmosphere::reference("trl", "mpm89").unwrap();
    let freqs = [10.0, 60.3, 183.31, 340.0];
    for height in [0.0, 0.002, 0.5, 7.03, 20.0, 29.99, 30.0] {
        let options = SkyTableOptions { observer_km: Some(height), ..SkyTableOptions::default() };
        let table = SkyTable::for_frequencies(&air, &freqs, &options).unwrap();
        println!("{height} km: {:.3} K", table.interpolation_error_k());
        assert!(table.interpolation_error_k() <= 0.1, "{height}");
        for freq in freqs {
            for i in 0..=1800 {
                let t = table.temperature_k(f64::from(i) * 0.1, freq).unwrap();
                assert!((2.7..301.0).contains(&t), "{height} {freq} {i} {t}");
            }
        }
    }
}

#[test]
fn isothermal_world_is_isothermal_in_every_direction_of_the_table() {
    let profile = Profile::isothermal(280.0, 1013.0, 60.0).unwrap();
    let air = Atmosphere::new(profile, gas_model("mpm89").unwrap()).unwrap().with_background(280.0).unwrap();
    let options = SkyTableOptions { observer_km: Some(1.0), ..SkyTableOptions::default() };
    let table = SkyTable::for_frequencies(&air, &[22.0, 94.0], &options).unwrap();
    for i in 0..=360 {
        for freq in [22.0, 94.0] {
            let t = table.temperature_k(f64::from(i) * 0.5, freq).unwrap();
            assert!((t - 280.0).abs() < 1e-6, "{i} {t}");
        }
    }
}

#[test]
fn sixty_thousand_temperatures_are_quick_even_here() {
    let table = SkyTable::for_frequencies(&mls(), &[94.0], &SkyTableOptions::default()).unwrap();
    let start = Instant::now();
    let mut sum = 0.0;
    for i in 0..60_000 {
        sum += table.temperature_k(f64::from(i) * 1.6e-3, 94.0).unwrap();
    }
    assert!(sum > 0.0);
    // The bench measures the time exactly. This test only fails if the table integrates on every call.
    assert!(start.elapsed().as_secs_f64() < 0.5, "{:?}", start.elapsed());
}

#[test]
fn bad_options_are_named() {
    let build = |options| SkyTable::for_frequencies(&mls(), &[94.0], &options);
    let base = SkyTableOptions::default();
    let message = |options| build(options).unwrap_err().to_string();
    assert!(message(SkyTableOptions { tolerance_k: 0.0, ..base }).contains("tolerance"));
    assert!(message(SkyTableOptions { ground_k: Some(0.0), ..base }).contains("ground temperature 0 K"));
    assert!(message(SkyTableOptions { observer_km: Some(99.0), ..base }).contains("observer height 99"));
    let table = build(base).unwrap();
    assert!(table.temperature_k(181.0, 94.0).is_err());
    assert!(table.temperature_k(f64::NAN, 94.0).is_err());
    assert!(table.rayleigh_jeans_k(1, 0.0).is_err());
}
