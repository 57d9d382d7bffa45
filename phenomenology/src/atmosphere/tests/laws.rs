//! Laws that hold for every input.

use proptest::prelude::*;

use crate::atmosphere::*;

fn isothermal(t: f64, rh: f64, model: &str, layers: &[&str]) -> Atmosphere {
    let profile = Profile::isothermal(t, 1013.0, rh).unwrap();
    Atmosphere::new(profile, gas_model(model).unwrap())
        .unwrap()
        .with_background(t)
        .unwrap()
        .with_layers(layers.iter().map(|text| text.parse().unwrap()).collect())
        .unwrap()
}

fn model_name() -> impl Strategy<Value = &'static str> {
    prop::sample::select(GAS_MODELS.iter().map(|e| e.name).collect::<Vec<_>>())
}

fn atmosphere_name() -> impl Strategy<Value = &'static str> {
    prop::sample::select(ATMOSPHERES.iter().map(|e| e.name).collect::<Vec<_>>())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn isothermal_sky_has_the_temperature_of_its_air(
        t in 240.0f64..310.0,
        rh in 0.0f64..100.0,
        freq in 1.0f64..1000.0,
        zenith in 0.0f64..89.999,
        model in model_name(),
        spherical in any::<bool>(),
    ) {
        let air = isothermal(t, rh, model, &["cloud:1km-2km:0.2g/m3", "rain:0km-3km:4mm/h"]);
        let geometry = if spherical { Geometry::Spherical } else { Geometry::Plane };
        let row = air.sky(&[freq], &[zenith], geometry).unwrap()[0];
        prop_assert!((row.tb_planck_k - t).abs() < 1e-6, "{:?}", row);
    }

    #[test]
    fn isothermal_paths_and_tables_agree(
        t in 240.0f64..310.0,
        freq in 1.0f64..1000.0,
        z1 in 0.0f64..10.0,
        z2 in 0.0f64..10.0,
        stretch in 1.0f64..50.0,
    ) {
        let air = isothermal(t, 50.0, "mpm89", &[]);
        let ends = PathEnds::new(z1, z2, PathExtent::LengthKm((z2 - z1).abs() * stretch)).unwrap();
        let full = air.path(&[freq], &ends).unwrap()[0];
        let fast = PathTable::new(&air, &[freq]).unwrap().radiation(0, &ends).unwrap();
        let black = planck::rayleigh_jeans_temperature_k(freq, planck::black_body_radiance(freq, t));
        prop_assert!((full.emission_rj_k() + black * full.transmission() - black).abs() < 1e-9);
        prop_assert!((fast.emission_rj_k() + black * fast.transmission() - black).abs() < 1e-9);
        prop_assert!((fast.emission_rj_k() - full.emission_rj_k()).abs() < 2e-3 * black);
    }

    #[test]
    fn depth_adds_and_transmission_multiplies(
        name in atmosphere_name(),
        freq in 1.0f64..350.0,
        mut heights in prop::array::uniform3(0.0f64..29.0),
        zenith in 0.0f64..85.0,
    ) {
        heights.sort_by(f64::total_cmp);
        let [low, middle, high] = heights;
        prop_assume!(middle - low > 1e-3 && high - middle > 1e-3);
        let air = Atmosphere::reference(name, "mpm89").unwrap();
        let path = |from, to| {
            let ends = PathEnds::new(from, to, PathExtent::ZenithDeg(zenith)).unwrap();
            air.path(&[freq], &ends).unwrap()[0]
        };
        let (whole, near, far) = (path(low, high), path(low, middle), path(middle, high));
        let joined = near.then(&far);
        // Cutting the path adds a level, which changes the mean absorption in one grid step.
        prop_assert!((joined.tau_np - whole.tau_np).abs() < 2e-3 * whole.tau_np);
        let product = near.transmission() * far.transmission();
        prop_assert!((product - joined.transmission()).abs() < 1e-12);
        prop_assert!((joined.emission_rj_k() - whole.emission_rj_k()).abs() < 0.1);
    }

    #[test]
    fn depth_and_temperature_rise_towards_the_horizon(
        name in atmosphere_name(),
        freq in 1.0f64..50.0,
        a in 0.0f64..89.0,
        step in 0.01f64..1.0,
        spherical in any::<bool>(),
    ) {
        let air = Atmosphere::reference(name, "mpm89").unwrap();
        let geometry = if spherical { Geometry::Spherical } else { Geometry::Plane };
        let rows = air.sky(&[freq], &[a, a + step * (89.9 - a)], geometry).unwrap();
        prop_assert!(rows[1].tau_np > rows[0].tau_np);
        prop_assert!(rows[1].path_km > rows[0].path_km);
        // Below 50 GHz the sky is not opaque overhead, so a deeper path is a warmer one.
        prop_assert!(rows[1].tb_planck_k > rows[0].tb_planck_k);
    }

    #[test]
    fn water_and_rain_only_add(
        freq in 1.0f64..1000.0,
        t in 240.0f64..310.0,
        rh in 0.0f64..99.0,
        more in 0.01f64..1.0,
        rate in 0.1f64..100.0,
        model in model_name(),
    ) {
        let (gas, rain) = (gas_model(model).unwrap(), rain_model("p838").unwrap());
        let run = |percent: f64, liquid: f64, rate: f64| {
            let air = AirState::with_humidity(900.0, t, Humidity::RelativePercent(percent)).unwrap();
            let parcel = Parcel { liquid_g_m3: liquid, rain_mm_h: rate, ..Parcel::clear(air) };
            attenuation(gas.as_ref(), rain.as_ref(), &parcel, &[freq]).unwrap()[0]
        };
        let base = run(rh, 0.1, rate);
        let moister = run(rh + 0.5 * more, 0.1, rate).water_vapour_db_per_km;
        prop_assert!(base.water_vapour_db_per_km <= moister);
        prop_assert!(base.droplets_db_per_km < run(rh, 0.1 + more, rate).droplets_db_per_km);
        prop_assert!(base.rain_h_db_per_km < run(rh, 0.1, rate + more).rain_h_db_per_km);
        prop_assert!(base.columns().iter().all(|(_, v)| v.is_finite() && *v >= 0.0));
    }

    #[test]
    fn any_layer_text_is_read_or_refused(text in "[a-z]{0,6}:?[-0-9.a-z]{0,12}:?[-0-9.a-z/]{0,8}") {
        if let Ok(layer) = text.parse::<Layer>() {
            prop_assert_eq!(layer.to_string().parse::<Layer>().unwrap(), layer);
        }
    }

    #[test]
    fn any_profile_text_is_read_or_refused(text in "(z_km|p_hpa|t_k|e_hpa|,|\n|[-0-9.]{1,4}|#|\"){0,30}") {
        if let Ok(profile) = Profile::from_csv("fuzz", &text) {
            prop_assert!(profile.levels().len() >= 2);
        }
    }
}
