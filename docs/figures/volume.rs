//! Pictures of snow that scatters.

use crate::{Drawn, Figure, Points, linear, logarithmic, oracle};
use cittert_phenomenology::dielectrics::Extrapolation;
use cittert_phenomenology::surfaces::{Roughness, Sky, StackDescription, SurfaceModel};

/// Case of the table and its layer: thickness m, density kg/m3, temperature K, scattering.
const CASES: [(&str, &str, [f64; 3], &str); 3] = [
    ("exp-fine", "0.05 mm", [0.5, 200.0, 260.0], "iba:0.05mm"),
    ("exp-medium", "0.1 mm", [1.0, 300.0, 255.0], "iba:0.1mm"),
    ("exp-coarse", "0.2 mm", [0.7, 350.0, 265.0], "iba:0.2mm"),
];

pub(crate) fn draw() -> Drawn {
    angles()?;
    frequencies()
}

fn snow([thickness, density, temperature]: [f64; 3], scatter: &str, freq_ghz: f64) -> Drawn<SurfaceModel> {
    let scatter = if scatter.is_empty() { String::new() } else { format!("scatter = \"{scatter}\"\n") };
    let text = format!(
        "coherent = false\n[[layer]]\nmaterial = \"dry-snow\"\nthickness_m = {thickness}\ndensity_kg_m3 = {density}\n\
         temperature_k = {temperature}\n{scatter}[[layer]]\neps = [5.0, 0.5]\ntemperature_k = 268\n"
    );
    let stack = StackDescription::from_toml(&text)?.resolve(freq_ghz * 1e9, Extrapolation::Refuse)?;
    Ok(SurfaceModel::new(stack, Roughness::Smooth))
}

fn angles() -> Drawn {
    let rows = oracle("volume_brightness_smrt.csv")?;
    let title = "Snow on soil at 36.5 GHz by correlation length, v and h (lines), and smrt (dots)";
    let mut figure = Figure::new(title, "angle from the normal [deg]", "brightness [K]");
    for (case, name, layer, scatter) in CASES {
        let surface = snow(layer, scatter, 36.5)?;
        for (p, pol) in [(1, "v"), (0, "h")] {
            let line = linear(0.0, 85.0, 120)
                .into_iter()
                .map(|a| Ok((a, surface.brightness_k(a.to_radians(), 0.0, Sky::Symmetric(&|_| 0.0))?[p])));
            figure.ours(&format!("{name}, {pol}"), line.collect::<Drawn<Points>>()?);
            let wanted = [("case", case), ("freq_ghz", "36.5")];
            figure.theirs(crate::pick(&rows, &wanted, "theta_deg", &format!("tb_{pol}_k")));
        }
    }
    figure.save("volume-angle")
}

fn frequencies() -> Drawn {
    let mut figure = Figure::new(
        "Emissivity of 1 m of snow (300 kg/m3, 255 K) on soil at 50 degrees, v, by correlation length",
        "frequency [GHz]",
        "emissivity",
    );
    figure = figure.log(true, false);
    for scatter in ["", "iba:0.05mm", "iba:0.1mm", "iba:0.15mm", "iba:0.2mm", "iba:0.3mm"] {
        let line = logarithmic(5.0, 200.0, 40).into_iter().map(|f| {
            let surface = snow([1.0, 300.0, 255.0], scatter, f)?;
            Ok((f, surface.response(50f64.to_radians(), 0.0, Sky::Symmetric(&|_| 0.0))?.emissivity[1]))
        });
        figure.ours(
            if scatter.is_empty() { "without scattering" } else { scatter.trim_start_matches("iba:") },
            line.collect::<Drawn<Points>>()?,
        );
    }
    figure.save("volume-frequency")
}
