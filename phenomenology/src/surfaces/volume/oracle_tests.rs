//! Comparison with smrt: `tests/oracle/volume_brightness_smrt.csv` and `volume_layers_smrt.csv`, made by `volume_smrt.py` beside them.

use crate::dielectrics::Extrapolation;
use crate::oracle_tests::Table;
use crate::surfaces::{Roughness, Sky, Stack, StackDescription, SurfaceModel};

/// `thickness m, density kg/m3, temperature K, scatter` of each layer of snow.
type Snow = (f64, f64, f64, &'static str);

const SOIL: &str = "[[layer]]\neps = [5.0, 0.5]\ntemperature_k = 268\n";
const WATER: &str = "[[layer]]\neps = [10.0, 17.0]\ntemperature_k = 271.3\n";

fn snow(rows: &[Snow]) -> String {
    let row = |(d, rho, t, scatter): &Snow| {
        format!(
            "[[layer]]\nmaterial = \"dry-snow\"\nthickness_m = {d}\ndensity_kg_m3 = {rho}\ntemperature_k = {t}\nscatter = \"{scatter}\"\n"
        )
    };
    rows.iter().map(row).collect()
}

/// The stacks of `volume_smrt.py`, by name.
fn stack_of(case: &str) -> String {
    let layers = match case {
        "exp-fine" => snow(&[(0.5, 200.0, 260.0, "iba:0.05mm")]),
        "exp-medium" => snow(&[(1.0, 300.0, 255.0, "iba:0.1mm")]),
        "exp-coarse" => snow(&[(0.7, 350.0, 265.0, "iba:0.2mm")]),
        "exp-deep" => snow(&[(100.0, 320.0, 250.0, "iba:0.15mm")]),
        "shs-fine" => snow(&[(0.5, 250.0, 260.0, "iba-spheres:0.1mm,0.2")]),
        "shs-medium" => snow(&[(1.0, 320.0, 258.0, "iba-spheres:0.2mm,0.3")]),
        "shs-coarse" => snow(&[(0.4, 280.0, 263.0, "iba-spheres:0.35mm,1000")]),
        "several" => snow(&[
            (0.1, 120.0, 252.0, "iba:0.06mm"),
            (0.2, 220.0, 257.0, "iba:0.09mm"),
            (0.3, 310.0, 262.0, "iba:0.14mm"),
            (0.15, 260.0, 266.0, "iba:0.22mm"),
        ]),
        "dense-over-light" => snow(&[(0.1, 420.0, 250.0, "iba:0.08mm"), (0.6, 180.0, 262.0, "iba:0.18mm")]),
        "under-sky" => snow(&[(0.8, 290.0, 258.0, "iba:0.12mm")]),
        "oblate" => snow(&[(0.6, 270.0, 259.0, "iba:0.11mm,maetzler96")]),
        "dmrt" => snow(&[(0.8, 280.0, 260.0, "dmrt:0.12mm,0.25")]),
        "later-exp" => snow(&[(0.9, 230.0, 247.0, "iba:0.13mm")]),
        "later-shs" => snow(&[(0.3, 380.0, 267.0, "iba-spheres:0.15mm,0.15")]),
        "later-several" => snow(&[
            (0.05, 90.0, 249.0, "iba:0.04mm"),
            (0.02, 450.0, 253.0, "iba:0.07mm"),
            (0.5, 280.0, 259.0, "iba:0.17mm"),
            (0.4, 340.0, 265.0, "iba:0.25mm"),
            (0.3, 200.0, 268.0, "iba:0.1mm"),
        ]),
        "first-year" => {
            snow(&[(0.15, 310.0, 255.0, "iba:0.12mm")])
                + "[[layer]]\nmaterial = \"sea-ice\"\nthickness_m = 1.2\ntemperature_k = 261\nsalinity_psu = 6\nscatter = \"iba:0.15mm\"\n"
        }
        "multi-year" => {
            snow(&[(0.25, 330.0, 250.0, "iba:0.16mm")])
                + "[[layer]]\nmaterial = \"sea-ice\"\nthickness_m = 2.5\ntemperature_k = 258\nsalinity_psu = 1\nporosity = 0.15\n\
                   scatter = \"iba:0.25mm\"\n"
        }
        "lake-ice" => {
            "[[layer]]\nmaterial = \"ice\"\nthickness_m = 0.5\ntemperature_k = 268\nporosity = 0.05\nscatter = \"iba:0.3mm\"\n".to_owned()
        }
        "later-sea-ice" => {
            snow(&[(0.1, 250.0, 253.0, "iba:0.09mm"), (0.1, 360.0, 256.0, "iba:0.2mm")])
                + "[[layer]]\nmaterial = \"sea-ice\"\nthickness_m = 3\ntemperature_k = 260\nsalinity_psu = 2\nporosity = 0.08\n\
                   scatter = \"iba:0.35mm\"\n"
        }
        other => panic!("no stack `{other}`"),
    };
    let ice = ["first-year", "multi-year", "lake-ice", "later-sea-ice"].contains(&case);
    format!("coherent = false\n{layers}{}", if ice { WATER } else { SOIL })
}

fn solved(case: &str, freq_ghz: f64) -> Stack {
    StackDescription::from_toml(&stack_of(case)).unwrap().resolve(freq_ghz * 1e9, Extrapolation::Refuse).unwrap()
}

/// Largest difference in K and number of temperatures for each case, over the rows with a value of `unseen`.
fn differences(unseen: &str) -> Vec<(String, f64, usize)> {
    let table = Table::open("volume_brightness_smrt.csv");
    let mut out: Vec<(String, f64, usize)> = Vec::new();
    let mut last: Option<(String, SurfaceModel)> = None;
    for row in table.rows.iter().filter(|r| table.text(r, "unseen") == unseen) {
        let (case, freq) = (table.text(row, "case"), table.text(row, "freq_ghz"));
        let key = format!("{case} {freq} GHz");
        if last.as_ref().is_none_or(|l| l.0 != key) {
            last = Some((key, SurfaceModel::new(solved(case, freq.parse().unwrap()), Roughness::Smooth)));
        }
        let (key, surface) = last.as_ref().unwrap();
        let sky_k = table.number(row, "sky_k");
        let angle = table.number(row, "theta_deg");
        let [h, v] = surface.brightness_k(angle.to_radians(), 0.0, Sky::Symmetric(&|_| sky_k)).unwrap();
        let [their_h, their_v] = [table.number(row, "tb_h_k"), table.number(row, "tb_v_k")];
        let error = (h - their_h).abs().max((v - their_v).abs());
        println!("{key} {angle} deg: h {h:.3} {their_h:.3}, v {v:.3} {their_v:.3}");
        match out.last_mut().filter(|l| l.0 == case) {
            Some(l) => (l.1, l.2) = (l.1.max(error), l.2 + 2),
            None => out.push((case.to_owned(), error, 2)),
        }
    }
    out
}

#[test]
fn layers_absorb_and_scatter_as_those_of_smrt() {
    let table = Table::open("volume_layers_smrt.csv");
    for row in &table.rows {
        let (case, freq) = (table.text(row, "case"), table.number(row, "freq_ghz"));
        let layer = table.number(row, "layer") as usize - 1;
        let description = StackDescription::from_toml(&stack_of(case)).unwrap();
        let (eps, scatterer) = description.scatterer(layer, freq * 1e9, Extrapolation::Refuse).unwrap();
        let scatterer = scatterer.unwrap();
        let near = |ours: f64, column: &str, most: f64| {
            let theirs = table.number(row, column);
            assert!((ours - theirs).abs() <= most * theirs.abs(), "{case} layer {layer}, {freq} GHz, {column}: {ours} {theirs}");
        };
        // Both solve the same equation of mixing. smrt stops at about 1e-8 of the permittivity, which in dry snow is 1e-4 of its loss.
        near(eps.re, "eps_re", 1e-6);
        near(scatterer.absorption_per_m, "ka_per_m", 1e-3);
        // smrt integrates with 65 points.
        near(scatterer.scattering_per_m(), "ks_per_m", 1e-3);
    }
}

#[test]
fn brightness_is_that_of_smrt() {
    let found = differences("0");
    println!("{found:?}");
    assert!(found.len() >= 15 && found.iter().map(|f| f.2).sum::<usize>() >= 600);
    // The bar of the task is 1 K.
    for (case, error, _) in found {
        assert!(error < 1.0, "{case}: {error}");
    }
}

#[test]
fn brightness_is_that_of_smrt_where_it_was_not_looked_at() {
    let found = differences("1");
    println!("{found:?}");
    for (case, error, _) in found {
        assert!(error < 1.0, "{case}: {error}");
    }
}
