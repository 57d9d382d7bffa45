//! Pictures of permittivities: one for each model.

use crate::{Drawn, Figure, Points, Row, logarithmic, oracle};
use cittert_phenomenology::dielectrics::{Extrapolation, Material, MaterialState, Parameter, brine_volume_cox_weeks83, material_of_model};

const FREQ: &str = "frequency [GHz]";

/// A model, its label in the reference, and the states that are drawn.
struct Case {
    model: &'static str,
    label: &'static str,
    source: &'static str,
    states: &'static [&'static str],
}

/// States are written as in the reference: temperature, then its parameters.
const CASES: &[Case] = &[
    Case { model: "liebe91", label: "water_liebe91_double_debye", source: "smrt", states: &["273.15", "303.15"] },
    Case { model: "turner16", label: "water_turner_cadeddu_2016", source: "smrt", states: &["273.15", "303.15"] },
    Case { model: "stogryn95", label: "sea_stogryn_1995", source: "smrt", states: &["273.15 S_psu=36", "303.15 S_psu=36"] },
    Case { model: "klein-swift77", label: "sea_klein_swift_1977", source: "smrt", states: &["273.15 S_psu=36", "303.15 S_psu=36"] },
    Case { model: "maetzler06", label: "ice_maetzler06", source: "smrt", states: &["223.15", "273"] },
    Case { model: "hufford91", label: "ice_hufford91_maetzler98", source: "smrt", states: &["223.15", "273"] },
    Case { model: "stogryn-desargant85", label: "brine_stogryn85", source: "smrt", states: &["243.15", "270.15"] },
    Case { model: "maetzler96", label: "drysnow_maetzler96", source: "smrt", states: &["263.15 rho_kg_m3=100", "263.15 rho_kg_m3=400"] },
    Case {
        model: "dobson85",
        label: "soil_dobson85_peplinski95_loam",
        source: "the formulas in other software",
        states: &["288.15 mv=0.05", "288.15 mv=0.3"],
    },
    Case {
        model: "ulaby86",
        label: "soil_hut_ulaby86_loam",
        source: "the formulas in other software",
        states: &["288.15 mv=0.05", "288.15 mv=0.3"],
    },
];

pub(crate) fn draw() -> Drawn {
    let rows = oracle("permittivity.csv")?;
    for case in CASES {
        against_frequency(case, &rows)?;
    }
    wet_snow(&rows)?;
    brine_volume()?;
    side_by_side()
}

fn state_of(material: &Material, text: &str) -> MaterialState {
    let mut state = material.state();
    for (i, word) in text.split_whitespace().enumerate() {
        let (key, value) = word.split_once('=').unwrap_or(("t_k", word));
        let value: f64 = value.parse().unwrap_or(f64::NAN);
        match key {
            "S_psu" => state.salinity_psu = value,
            "rho_kg_m3" => state.density_kg_m3 = value,
            "mv" => state.moisture = value,
            _ if i == 0 => state.temperature_k = value,
            _ => {}
        }
    }
    state
}

fn line(material: &'static Material, model: &str, state: &MaterialState, freqs: &[f64], loss: bool) -> Drawn<Points> {
    let model = material.model(model)?;
    freqs
        .iter()
        .map(|f| {
            let eps = material.evaluate(Some(model), state, f * 1e9, Extrapolation::Documented)?.eps;
            Ok((*f, if loss { -eps.im } else { eps.re }))
        })
        .collect()
}

fn against_frequency(case: &Case, rows: &[Row]) -> Drawn {
    let material = material_of_model(case.model)?;
    let title = format!("{}: {} (lines) and {} (dots)", material.name, case.model, case.source);
    let mut figure = Figure::new(&title, FREQ, "permittivity").log(true, true);
    for text in case.states {
        let state = state_of(material, text);
        let words: Vec<&str> = text.split_whitespace().collect();
        let theirs: Vec<&Row> = rows
            .iter()
            .filter(|r| r.text("model").split('(').next() == Some(case.label) && r.number("t_k") == state.temperature_k)
            .filter(|r| words[1..].iter().all(|w| r.text("params").split_whitespace().any(|p| p == *w)))
            .collect();
        let last = theirs.iter().map(|r| r.number("f_ghz")).fold(1.0, f64::max);
        let freqs = logarithmic(1.0, last, 250);
        for (loss, part, column) in [(false, "real", "eps_real"), (true, "loss", "eps_loss_positive")] {
            let name = format!("{part}, {} K {}", state.temperature_k, words[1..].join(" "));
            figure.ours(name.trim_end(), line(material, case.model, &state, &freqs, loss)?);
            figure.theirs(theirs.iter().map(|r| (r.number("f_ghz"), r.number(column))).collect());
        }
    }
    figure.save(&format!("eps-{}", case.model))
}

/// Each sample of wet snow has its own density. Results of cittert and of the reference are therefore both points; a line joins those of
/// cittert.
fn wet_snow(rows: &[Row]) -> Drawn {
    let snow = Material::by_name("wet-snow")?;
    let model = snow.model("hallikainen86")?;
    let mut figure = Figure::new("wet-snow: hallikainen86 (lines) and smrt (dots)", "water [% of volume]", "loss").log(false, false);
    for freq in [5.0, 19.0, 37.0] {
        let mut samples: Vec<(f64, f64, f64)> = Vec::new();
        for row in rows.iter().filter(|r| r.text("model").starts_with("wetsnow") && r.number("f_ghz") == freq) {
            let value = |key: &str| -> f64 {
                let pair = row.text("params").split_whitespace().filter_map(|p| p.split_once('=')).find(|p| p.0 == key);
                pair.and_then(|p| p.1.parse().ok()).unwrap_or(f64::NAN)
            };
            let mut state = snow.state();
            state.set(Parameter::Moisture, value("mv_pct") * 1e-2);
            state.set(Parameter::Density, value("rho_dry_g_cm3") * 1e3);
            let eps = snow.evaluate(Some(model), &state, freq * 1e9, Extrapolation::Documented)?.eps;
            samples.push((value("mv_pct"), -eps.im, row.number("eps_loss_positive")));
        }
        samples.sort_by(|a, b| a.0.total_cmp(&b.0));
        figure.ours(&format!("{freq} GHz"), samples.iter().map(|s| (s.0, s.1)).collect());
        figure.theirs(samples.iter().map(|s| (s.0, s.2)).collect());
    }
    figure.save("eps-hallikainen86")
}

fn brine_volume() -> Drawn {
    let rows = oracle("sea_ice_brine_volume.csv")?;
    let mut figure = Figure::new("Brine volume (lines) and smrt (dots)", "temperature [K]", "volume fraction").log(false, true);
    for salinity in [2.0, 5.0, 8.0] {
        let temperatures = crate::linear(245.0, 272.5, 200);
        figure.ours(&format!("{salinity} psu"), temperatures.iter().map(|t| (*t, brine_volume_cox_weeks83(*t, salinity))).collect());
        let wanted = [("salinity_psu", &*salinity.to_string())];
        figure.theirs(crate::pick(&rows, &wanted, "t_k", "brine_volume_fraction_cox83_lepparanta88"));
    }
    figure.save("brine-volume")
}

/// Models without reference numbers, compared with similar models.
fn side_by_side() -> Drawn {
    let compare = |name: &str, title: &str, last: f64, loss: bool, list: &[(&str, &str, &str)]| -> Drawn {
        let freqs = logarithmic(1.0, last, 250);
        let part = if loss { "loss" } else { "real part" };
        let mut figure = Figure::new(title, FREQ, part).log(true, loss);
        for (material, model, text) in list {
            let material = Material::by_name(material)?;
            let label = format!("{} {model} {text}", material.name);
            figure.ours(label.trim_end(), line(material, model, &state_of(material, text), &freqs, loss)?);
        }
        figure.save(name)
    };
    let sea = [("sea-water", "meissner-wentz04", "288.15"), ("sea-water", "stogryn95", "288.15"), ("fresh-water", "turner16", "288.15")];
    compare("eps-meissner-wentz04", "Sea water: two models, and fresh water", 90.0, true, &sea)?;
    let soils = [
        ("soil", "mironov09", "293.15 mv=0.2"),
        ("soil", "dobson85", "293.15 mv=0.2"),
        ("soil", "ulaby86", "293.15 mv=0.2"),
        ("soil", "ulaby86-liebe91", "293.15 mv=0.2"),
        ("frozen-soil", "frozen-soil-constant", "263.15"),
    ];
    compare("eps-soils", "Loam with 20 % water by four models, and frozen soil", 100.0, false, &soils)?;
    let ice = [
        ("sea-ice", "sea-ice-spheres", "263.15"),
        ("sea-ice", "sea-ice-maxwell-garnett", "263.15"),
        ("sea-ice", "sea-ice-needles", "263.15"),
    ];
    compare("eps-sea-ice", "Sea ice of 5 psu at 263 K: shapes of the brine pockets", 340.0, true, &ice)?;
    let snow = [
        ("wet-snow", "hallikainen86", "273.15"),
        ("wet-snow", "polder-van-santen46", "273.15"),
        ("vegetation", "ulaby-el-rayes87", "293.15"),
    ];
    compare("eps-snow-leaf", "Wet snow with 3 % water by two models; leaves", 100.0, true, &snow)?;
    let built = [
        ("concrete", "p2040", ""),
        ("brick", "p2040", ""),
        ("wood", "p2040", ""),
        ("glass", "p2040", ""),
        ("asphalt", "p2040", ""),
        ("paint", "paint-constant", ""),
    ];
    compare("eps-p2040", "Building materials of P.2040, and paint", 100.0, true, &built)
}
