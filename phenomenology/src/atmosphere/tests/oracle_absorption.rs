//! Absorption against ARTS (MPM, hydrosols, Olsen rain) and ITU-R (P.676, P.838, P.840).

use super::{Worst, median, number, oracle};
use crate::atmosphere::*;

#[test]
fn gas_totals_match_arts() {
    let rows = oracle("mpm_specific_attenuation_arts.csv");
    for name in ["mpm89", "mpm93"] {
        let model = gas_model(name).unwrap();
        let (mut total, mut water, mut oxygen) = (Worst::default(), Worst::default(), Worst::default());
        for row in rows.iter().filter(|r| r[0].to_lowercase() == name) {
            let v = |i| number(row, i);
            let air = AirState::new(v(2), v(3), v(4)).unwrap();
            let ours = model.spectrum(&air).absorption(v(1));
            let what = || row.join(",");
            total.see((ours.total_db_per_km() / v(10) - 1.0).abs(), what);
            water.see((ours.water_db_per_km / v(5) - 1.0).abs(), what);
            oxygen.see((ours.oxygen_db_per_km / v(7) - 1.0).abs(), what);
        }
        total.within(&format!("{name} total"), 1e-3);
        water.within(&format!("{name} water"), 1e-3);
        oxygen.within(&format!("{name} oxygen"), 1e-3);
    }
}

#[test]
fn median_ratio_to_p676_is_near_one_in_every_band() {
    let rows = oracle("itu_p676_12_specific_attenuation.csv");
    let model = gas_model("mpm89").unwrap();
    let edges = [0.0, 10.0, 48.0, 72.0, 200.0, 400.0, 1000.1];
    for band in edges.windows(2) {
        let mut ratios = Vec::new();
        for row in &rows {
            let v = |i| number(row, i);
            let e = v(3) * v(2) / 216.68;
            if v(1) + e <= 300.0 || v(0) < band[0] || v(0) >= band[1] {
                continue;
            }
            let air = AirState::new(v(1) + e, v(2), e).unwrap();
            let ours = model.spectrum(&air).absorption(v(0)).total_db_per_km();
            ratios.push(ours / (v(4) + v(5)));
        }
        let ratio = median(&mut ratios);
        println!("{band:?} GHz: median ratio {ratio:.4} of {} rows", ratios.len());
        assert!((ratio - 1.0).abs() <= 0.04, "{band:?}: {ratio}");
    }
}

#[test]
fn hydrosols_and_olsen_rain_match_arts() {
    let rows = oracle("mpm93_hydrosol_arts.csv");
    let olsen = rain_model("olsen78").unwrap();
    let (mut liquid, mut ice, mut rain) = (Worst::default(), Worst::default(), Worst::default());
    for row in &rows {
        let v = |i| number(row, i);
        let what = || row.join(",");
        let off = |ours: f64| (ours / v(4) - 1.0).abs();
        match row[0].as_str() {
            "liquid_mpm93_double_debye" => {
                let ours = droplet_attenuation_liebe93(v(1), v(2), v(3)).unwrap();
                liquid.see(off(ours), what);
            }
            "ice_mpm93" => {
                ice.see(off(crystal_attenuation_liebe93(v(1), v(2), v(3)).unwrap()), what);
            }
            "rain_olsen1978_arts" if v(3) <= 25.0 => {
                let ours = rain_attenuation(olsen.as_ref(), v(1), v(3)).unwrap();
                rain.see(off(ours.mean_db_per_km()), what);
            }
            "rain_olsen1978_arts" => {
                assert!(rain_attenuation(olsen.as_ref(), v(1), v(3)).is_err());
            }
            other => panic!("unknown kind {other}"),
        }
    }
    liquid.within("droplets", 1e-5);
    ice.within("ice", 1e-5);
    rain.within("Olsen rain", 1e-4);
}

#[test]
fn rain_matches_p838() {
    let rows = oracle("itu_p838_3_rain.csv");
    let model = ItuP838::new().unwrap();
    let (mut coefficients, mut gamma) = (Worst::default(), Worst::default());
    for row in &rows {
        let v = |i| number(row, i);
        let what = || row.join(",");
        let [h, vert] = model.power_laws(v(0));
        for (ours, theirs) in [(h.k, v(1)), (h.alpha, v(2)), (vert.k, v(3)), (vert.alpha, v(4))] {
            coefficients.see((ours / theirs - 1.0).abs(), what);
        }
        let ours = rain_attenuation(&model, v(0), v(5)).unwrap();
        let slant = model.power_law(v(0), v(8), v(9)).unwrap().attenuation_db_per_km(v(5));
        for (ours, theirs) in [(ours.horizontal_db_per_km, v(6)), (ours.vertical_db_per_km, v(7)), (slant, v(10))] {
            gamma.see((ours / theirs - 1.0).abs(), what);
        }
    }
    coefficients.within("P.838 k, alpha", 1e-5);
    gamma.within("P.838 gamma", 1e-5);
}

#[test]
fn droplets_are_close_to_p840() {
    let rows = oracle("itu_p840_cloud_kl.csv");
    let mut worst = Worst::default();
    for row in &rows {
        let ours = droplet_attenuation_liebe93(number(row, 0), number(row, 1), 1.0).unwrap();
        worst.see((ours / number(row, 2) - 1.0).abs(), || row.join(","));
    }
    worst.within("droplets against P.840", 0.03);
}
