//! Pictures of surfaces: reflection, stacks, roughness, facets.

use crate::{Drawn, Figure, Points, Row, linear, oracle, pick};
use cittert_phenomenology::dielectrics::permittivity_of;
use cittert_phenomenology::surfaces::{
    BistaticGeometry, Layer, Shadowing, Slopes, Stack, SurfaceModel, bistatic_coefficient, fresnel, shadow_lambda,
};

const ANGLE: &str = "angle from the normal [deg]";
const R: &str = "reflectivity";

pub(crate) fn draw() -> Drawn {
    half_space()?;
    stacks(true, "coherent")?;
    stacks(false, "incoherent")?;
    small_roughness("qnh", "Wang & Choudhury Q/H", "10", &["Q=0.1 N=0 H=0.5", "Q=0.3 N=1 H=1.5"], "rough-qh")?;
    small_roughness("choudhury79", "Choudhury 1979", "10", &["sigma_mm=0.1", "sigma_mm=0.3"], "rough-choudhury79")?;
    small_roughness("wegmuller99", "Wegmueller & Maetzler 1999", "37", &["sigma_mm=1", "sigma_mm=5"], "rough-wegmuller99")?;
    bistatic()?;
    shadowing()?;
    facets("single", "one bounce", "single_bounce_escape")?;
    facets("second-bounce", "two bounces", "total")
}

fn half_space() -> Drawn {
    let rows = oracle("fresnel_halfspace_tmm.csv")?;
    let mut figure = Figure::new("Fresnel reflection (lines) and tmm (dots)", ANGLE, R);
    for (name, real, loss) in [("water_94", 8.2, 13.9), ("concrete", 5.2, 0.35)] {
        let eps = permittivity_of(real, loss);
        for (pol, column) in [("h", "r_h_power"), ("v", "r_v_power")] {
            let ours = linear(0.0, 89.9, 300).into_iter().map(|a| {
                let r = fresnel(eps, a.to_radians())?;
                Ok((a, if pol == "h" { r.power_h } else { r.power_v }))
            });
            figure.ours(&format!("{name}, {pol}"), ours.collect::<Drawn<Points>>()?);
            figure.theirs(pick(&rows, &[("name", name)], "theta_deg", column));
        }
    }
    figure.save("fresnel")
}

fn layers(text: &str) -> Vec<Layer> {
    let number = |t: Option<&str>| t.and_then(|t| t.parse::<f64>().ok()).unwrap_or(f64::NAN);
    text.split('|')
        .map(|layer| {
            let mut parts = layer.split(';');
            let (real, loss, mm) = (number(parts.next()), number(parts.next()), number(parts.next()));
            Layer { eps: permittivity_of(real, loss), thickness_m: mm * 1e-3, temperature_k: 290.0 }
        })
        .collect()
}

fn stacks(coherent: bool, word: &str) -> Drawn {
    let rows = oracle("multilayer_tmm.csv")?;
    let mut figure = Figure::new(&format!("Stacks at 37 GHz, {word}, h (lines) and tmm (dots)"), ANGLE, R);
    for name in ["ice_on_water", "snow_ice_water", "asphalt_gravel_soil", "paint_on_metal"] {
        let Some(row) = rows.iter().find(|r| r.text("stack") == name) else { return Err(name.into()) };
        let stack = Stack::new(layers(row.text("layers(eps_re;eps_loss;thickness_mm|...)")), coherent, 37e9)?;
        let ours = linear(0.0, 89.0, 400).into_iter().map(|a| Ok((a, stack.reflection(a.to_radians())?.power_h)));
        figure.ours(&name.replace('_', " "), ours.collect::<Drawn<Points>>()?);
        figure.theirs(pick(&rows, &[("stack", name), ("f_ghz", "37")], "theta_deg", &format!("r_h_{word}")));
    }
    figure.save(&format!("stack-{word}"))
}

fn small_roughness(model: &str, title: &str, freq: &str, params: &[&str], file: &str) -> Drawn {
    let rows = oracle("rough_qh_choudhury_smrt.csv")?;
    let mut figure = Figure::new(&format!("{title} (lines) and smrt (dots), eps 8 - j2.5"), ANGLE, R);
    let last = if model == "wegmuller99" { 70.0 } else { 85.0 };
    for text in params {
        let value = |key: &str| text.split_whitespace().filter_map(|p| p.split_once('=')).find(|p| p.0 == key).map_or("", |p| p.1);
        let rough = match model {
            "qnh" => format!("qh:{},{},{}", value("Q"), value("H"), value("N")),
            "choudhury79" => format!("choudhury:{}mm", value("sigma_mm")),
            _ => format!("wegmuller:{}mm", value("sigma_mm")),
        };
        let stack = Stack::half_space(permittivity_of(8.0, 2.5), 290.0, freq.parse::<f64>()? * 1e9)?;
        let surface = SurfaceModel::new(stack, rough.parse()?);
        for (p, pol) in ["h", "v"].into_iter().enumerate() {
            let ours = linear(0.0, last, 200).into_iter().map(|a| Ok((a, surface.reflection(a.to_radians())?.powers()[p])));
            figure.ours(&format!("{text}, {pol}"), ours.collect::<Drawn<Points>>()?);
            let wanted = [("model", model), ("params", text), ("eps_re", "8")];
            figure.theirs(pick(&rows, &wanted, "theta_deg", &format!("r_{pol}")));
        }
    }
    figure.save(file)
}

fn bistatic() -> Drawn {
    let rows = oracle("rough_go_bistatic_smrt.csv")?;
    let title = "Bistatic coefficients, slope 0.22, incidence 40 deg, forward (lines) and smrt (dots)";
    let mut figure = Figure::new(title, "angle of scattering [deg]", "gamma").log(false, false);
    let variance = rows.iter().map(|r| r.number("mss_per_axis")).filter(|m| *m > 0.02).fold(1.0, f64::min);
    let slopes = Slopes::isotropic(variance.sqrt())?;
    for (name, shadowing, flag) in [("Smith", Shadowing::Smith, "1"), ("no shadowing", Shadowing::None, "0")] {
        let stack = Stack::half_space(permittivity_of(8.2, 13.9), 290.0, 37e9)?;
        for pol in ["vv", "hh"] {
            let ours = linear(0.0, 89.0, 200).into_iter().map(|a| {
                let geometry = BistaticGeometry {
                    incident_zenith_rad: 40f64.to_radians(),
                    incident_azimuth_rad: 0.0,
                    scattered_zenith_rad: a.to_radians(),
                    scattered_azimuth_rad: 0.0,
                };
                let g = bistatic_coefficient(&stack, &slopes, shadowing, &geometry)?;
                Ok((a, if pol == "vv" { g.vv } else { g.hh }))
            });
            figure.ours(&format!("{pol}, {name}"), ours.collect::<Drawn<Points>>()?);
            let wanted =
                [("mss_per_axis", &*variance.to_string()), ("shadow", flag), ("eps_re", "8.2"), ("theta_i_deg", "40"), ("dphi_deg", "0")];
            figure.theirs(pick(&rows, &wanted, "theta_s_deg", &format!("gamma_{pol}")));
        }
    }
    figure.save("bistatic")
}

fn shadowing() -> Drawn {
    let rows = oracle("shadow_lambda_smrt.csv")?;
    let mut figure =
        Figure::new("Lambda of the shadowing function (lines) and smrt (dots)", "zenith angle [deg]", "Lambda").log(false, true);
    let mut variances: Vec<f64> = rows.iter().map(|r| r.number("mss_per_axis")).collect();
    variances.dedup();
    for variance in variances {
        let slopes = Slopes::isotropic(variance.sqrt())?;
        let visible = |p: &(f64, f64)| p.1 > 1e-8;
        let ours = linear(30.0, 89.8, 300).into_iter().map(|a| (a, shadow_lambda(&slopes, a.to_radians(), 0.0)));
        figure.ours(&format!("rms slope {:.3}", variance.sqrt()), ours.filter(visible).collect());
        figure.theirs(pick(&rows, &[("mss_per_axis", &variance.to_string())], "theta_deg", "lambda").into_iter().filter(visible).collect());
    }
    figure.save("shadowing")
}

fn facets(closure: &str, words: &str, suffix: &str) -> Drawn {
    let rows = oracle("rough_surface_monte_carlo.csv")?;
    let title = format!("Facets, {words} (lines), and ray-traced height fields (dots), eps 8.2 - j13.9");
    let mut figure = Figure::new(&title, ANGLE, R);
    for slope in ["0.1", "0.3162"] {
        let wanted = [("rms_slope_per_axis", slope), ("eps_re", "8.2")];
        let theirs: Vec<&Row> = rows.iter().filter(|r| r.is(&wanted)).collect();
        let s = theirs.first().map_or(f64::NAN, |r| r.number("mss_per_axis")).sqrt();
        let stack = Stack::half_space(permittivity_of(8.2, 13.9), 290.0, 37e9)?;
        let surface = SurfaceModel::new(stack, format!("go:{s},{s},{closure}").parse()?);
        for (p, pol) in ["h", "v"].into_iter().enumerate() {
            let ours = linear(0.0, 85.0, 52).into_iter().map(|a| Ok((a, surface.reflection(a.to_radians())?.powers()[p])));
            figure.ours(&format!("slope {slope}, {pol}"), ours.collect::<Drawn<Points>>()?);
            figure.theirs(pick(&rows, &wanted, "theta_deg", &format!("r_{pol}_{suffix}")));
        }
    }
    figure.save(&format!("facets-{closure}"))
}
