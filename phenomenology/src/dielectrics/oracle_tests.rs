//! Every model against numbers made by independent software, and bad input.

use super::*;
use num_complex::Complex64;
use std::collections::BTreeMap;
use std::path::PathBuf;

fn oracle(name: &str) -> Vec<csv::StringRecord> {
    crate::oracle_tests::Table::open(name).rows
}

/// Material, model and state of an oracle row, through the public names.
fn named(label: &str, params: &str, temperature_k: f64) -> Option<(&'static str, &'static str, MaterialState)> {
    let (material, model) = match label.split('(').next().unwrap() {
        "water_turner_cadeddu_2016" => ("fresh-water", "turner16"),
        "water_liebe91_double_debye" => ("fresh-water", "liebe91"),
        "sea_klein_swift_1977" => ("sea-water", "klein-swift77"),
        "sea_stogryn_1995" => ("sea-water", "stogryn95"),
        "ice_maetzler06" => ("fresh-ice", "maetzler06"),
        "ice_hufford91_maetzler98" => ("fresh-ice", "hufford91"),
        "brine_stogryn85" => ("brine", "stogryn-desargant85"),
        "drysnow_maetzler96" => ("dry-snow", "maetzler96"),
        "wetsnow_hallikainen86_ulaby14" => ("wet-snow", "hallikainen86"),
        l if l.starts_with("soil_dobson85") => ("soil", "dobson85"),
        l if l.starts_with("soil_hut_ulaby86") => ("soil", "ulaby86"),
        _ => return None,
    };
    let mut state = Material::by_name(material).unwrap().state();
    state.temperature_k = temperature_k;
    for pair in params.split_whitespace() {
        let (key, value) = pair.split_once('=').unwrap();
        let value: f64 = value.parse().unwrap();
        match key {
            "S_psu" => state.salinity_psu = value,
            "rho_kg_m3" | "dry_matter_kg_m3" => state.density_kg_m3 = value,
            "rho_dry_g_cm3" | "rho_b" => state.density_kg_m3 = value * 1e3,
            "mv_pct" => state.moisture = value * 1e-2,
            "mv" => state.moisture = value,
            "sand" => state.sand = value,
            "clay" => state.clay = value,
            other => panic!("unknown oracle parameter {other}"),
        }
    }
    Some((material, model, state))
}

#[test]
fn every_model_meets_its_oracle() {
    let mut worst: BTreeMap<&str, (f64, f64, usize)> = BTreeMap::new();
    for row in oracle("permittivity.csv") {
        let number = |i: usize| row[i].parse::<f64>().unwrap();
        let Some((material, model, state)) = named(&row[0], &row[3], number(2)) else {
            continue;
        };
        let material = Material::by_name(material).unwrap();
        let model = material.model(model).unwrap();
        let eps = material.evaluate(Some(model), &state, number(1) * 1e9, Extrapolation::Documented).unwrap().eps;
        let want = Complex64::new(number(4), -number(5));
        let deviation = (eps - want).norm() / want.norm();
        assert!(deviation < 1e-6, "{row:?}: {eps} deviates {deviation}");
        // A small loss is compared separately. The oracle ends its mixing iteration for dry snow early, so its loss has an error of 1.2e-6.
        let loss = (eps.im - want.im).abs() / want.im.abs();
        let allowed = if model.name == "maetzler96" { 1.5e-6 } else { 1e-6 };
        assert!(loss < allowed, "{row:?}: {eps} loss deviates {loss}");
        let entry = worst.entry(model.name).or_default();
        *entry = (entry.0.max(deviation), entry.1.max(loss), entry.2 + 1);
    }
    println!("{worst:#?}");
    assert_eq!(worst.len(), 11);
    assert!(worst.values().map(|w| w.2).sum::<usize>() > 3000);
}

// Two modern water models agree to a few per cent below 300 GHz.
#[test]
fn turner_agrees_with_rosenkranz() {
    for row in oracle("permittivity.csv") {
        let number = |i: usize| row[i].parse::<f64>().unwrap();
        if !row[0].starts_with("water_rosenkranz") || number(1) > 300.0 {
            continue;
        }
        let eps = water_permittivity_turner16(number(1), number(2));
        let want = Complex64::new(number(4), -number(5));
        assert!((eps - want).norm() < 0.055 * want.norm(), "{row:?} {eps}");
    }
}

#[test]
fn brine_volume_meets_its_oracle() {
    let rows = oracle("sea_ice_brine_volume.csv");
    assert_eq!(rows.len(), 15);
    for row in rows {
        let number = |i: usize| row[i].parse::<f64>().unwrap();
        let volume = brine_volume_cox_weeks83(number(0), number(1));
        assert!((volume / number(2) - 1.0).abs() < 1e-4, "{row:?} {volume}");
    }
}

#[test]
fn names_are_unique_and_every_model_is_used() {
    let mut names: Vec<&str> = Material::all().iter().flat_map(|m| std::iter::once(m.name).chain(m.aliases.iter().copied())).collect();
    names.sort_unstable();
    let count = names.len();
    names.dedup();
    assert_eq!(names.len(), count);
    for model in Model::all() {
        let material = material_of_model(model.name).unwrap();
        assert!(material.model(model.name).is_ok());
    }
    for material in Material::all() {
        for name in material.model_names() {
            assert!(Model::by_name(name).is_ok(), "{name}");
        }
    }
}

#[test]
fn the_book_lists_every_material_and_model() {
    let page = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../docs/algorithms/dielectrics.md");
    let page = std::fs::read_to_string(page).unwrap();
    for name in Model::all().iter().map(|m| m.name).chain(Material::all().iter().map(|m| m.name)) {
        assert!(page.contains(name), "{name} is missing in the book");
    }
}

#[test]
fn every_material_is_lossy_and_its_defaults_are_in_range() {
    for material in Material::all() {
        let state = material.state();
        let bands = material.default_model(10e9).unwrap().bands_of(material).unwrap();
        let inside = if bands.iter().any(|b| b.contains(10.0)) { 10e9 } else { bands[0].min_ghz * 1e9 };
        let eps = material.permittivity(&state, inside).unwrap();
        assert!(eps.im <= 0.0 && eps.re >= 1.0, "{}: {eps}", material.name);
        for f in [1.0, 10.0, 94.0, 340.0, 1000.0] {
            let eps = material.evaluate(None, &state, f * 1e9, Extrapolation::Documented).unwrap().eps;
            assert!(eps.im <= 0.0 && eps.re >= 0.9, "{} {f} GHz: {eps}", material.name);
        }
    }
}

#[test]
fn defaults_change_with_frequency_where_the_first_ends() {
    let snow = Material::by_name("wet-snow").unwrap();
    assert_eq!(snow.default_model(37e9).unwrap().name, "hallikainen86");
    assert_eq!(snow.default_model(94e9).unwrap().name, "polder-van-santen46");
    let soil = Material::by_name("soil").unwrap();
    assert_eq!(soil.default_model(10e9).unwrap().name, "dobson85");
    assert_eq!(soil.default_model(35e9).unwrap().name, "ulaby86");
    assert_eq!(soil.default_model(94e9).unwrap().name, "ulaby86-liebe91");
}

#[test]
fn bad_input_is_named() {
    let message = |name: &str, f: f64, change: &dyn Fn(&mut MaterialState)| {
        let material = Material::by_name(name).unwrap();
        let mut state = material.state();
        change(&mut state);
        material.permittivity(&state, f).unwrap_err().to_string()
    };
    assert!(message("sea-water", 10e9, &|s| s.temperature_k = 0.0).contains("0 K"));
    assert!(message("sea-water", 10e9, &|s| s.temperature_k = f64::NAN).contains("NaN"));
    assert!(message("sea-water", 10e9, &|s| s.salinity_psu = -1.0).contains("salinity"));
    assert!(message("sea-water", 10e9, &|s| s.salinity_psu = f64::NAN).contains("NaN"));
    assert!(message("sea-water", 10e9, &|s| s.salinity_psu = 60.0).contains("0 to 40 psu"));
    assert!(message("sea-water", 0.0, &|_| ()).contains("frequency"));
    assert!(message("sea-water", f64::INFINITY, &|_| ()).contains("frequency"));
    assert!(message("soil", 10e9, &|s| s.moisture = 0.6).contains("porosity 0.5120"));
    assert!(message("soil", 10e9, &|s| s.sand = 0.95).contains("more than 1"));
    assert!(message("wet-snow", 10e9, &|s| s.moisture = 0.9).contains("porosity"));
    assert!(message("fresh-water", 10e9, &|s| s.temperature_k = 260.0).contains("273.15 to 303.15"));
    assert!(message("fresh-water", 2e12, &|_| ()).contains("1-1000 GHz"));
    let error = Material::by_name("unobtainium").unwrap_err().to_string();
    assert!(error.contains("unobtainium") && error.contains("sea-water"));
    let sea = Material::by_name("Sea_Water").unwrap();
    assert!(sea.model("dobson85").unwrap_err().to_string().contains("stogryn95"));
    assert!(sea.model("debye29").unwrap_err().to_string().contains("unknown"));
    let error = sea.set(&mut sea.state(), "moisture", 0.1).unwrap_err().to_string();
    assert!(error.contains("no parameter `moisture`") && error.contains("salinity"));
}

proptest::proptest! {
    #![proptest_config(proptest::prelude::ProptestConfig::with_cases(400))]

    // Every input gives a permittivity with loss or an error, and never a panic or a NaN.
    #[test]
    fn any_state_gives_a_permittivity_or_an_error(
        material in 0..Material::all().len(),
        log_f in 6.0..13.0f64,
        values in proptest::array::uniform6(0.0..1.0f64),
        documented in proptest::prelude::any::<bool>(),
    ) {
        let material = &Material::all()[material];
        let mut state = material.state();
        for (parameter, x) in Parameter::ALL.into_iter().zip(values) {
            if let Some(spec) = material.spec(parameter) {
                // Beyond the bounds as well as between them.
                state.set(parameter, spec.min + (1.2 * x - 0.1) * (spec.max - spec.min).min(400.0));
            }
        }
        let extrapolation = if documented { Extrapolation::Documented } else { Extrapolation::Refuse };
        for name in material.model_names() {
            let model = material.model(name).unwrap();
            if let Ok(p) = material.evaluate(Some(model), &state, 10f64.powf(log_f), extrapolation) {
                proptest::prop_assert!(p.eps.re.is_finite() && p.eps.im <= 0.0, "{name} {state:?}");
                proptest::prop_assert!(documented || !p.extended);
            }
        }
    }
}
