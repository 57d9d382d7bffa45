//! Surfaces against numbers made by independent software; every row of every file.

use super::*;
use crate::oracle_tests::Table;
use num_complex::Complex64;

fn eps(t: &Table, row: &csv::StringRecord, real: &str, loss: &str) -> Complex64 {
    Complex64::new(t.number(row, real), -t.number(row, loss))
}

#[test]
fn fresnel_powers() {
    let t = Table::open("fresnel_halfspace_tmm.csv");
    let mut worst = 0.0f64;
    for row in &t.rows {
        let theta = t.number(row, "theta_deg").to_radians();
        let r = fresnel(eps(&t, row, "eps_real", "eps_loss"), theta).unwrap();
        worst = worst.max((r.power_h - t.number(row, "r_h_power")).abs());
        worst = worst.max((r.power_v - t.number(row, "r_v_power")).abs());
        // The oracle's p amplitude has the opposite sign.
        let s = Complex64::new(t.number(row, "tmm_rs_re"), t.number(row, "tmm_rs_im"));
        let size = (r.r_h.re - s.re).abs();
        assert!(size < 2e-8, "{row:?}");
    }
    println!("fresnel: {worst:e} over {}", t.rows.len());
    assert_eq!(t.rows.len(), 96);
    assert!(worst < 1e-8);
}

pub(super) fn layers(text: &str) -> Vec<Layer> {
    text.split('|')
        .map(|layer| {
            let n: Vec<f64> = layer.split(';').map(|x| x.parse().unwrap()).collect();
            Layer { eps: Complex64::new(n[0], -n[1]), thickness_m: n[2] * 1e-3, temperature_k: 290.0 }
        })
        .collect()
}

#[test]
fn stacks_coherent_and_incoherent() {
    let t = Table::open("multilayer_tmm.csv");
    let (mut coherent, mut incoherent) = (0.0f64, 0.0f64);
    for row in &t.rows {
        let list = layers(t.text(row, "layers(eps_re;eps_loss;thickness_mm|...)"));
        let freq_hz = t.number(row, "f_ghz") * 1e9;
        let theta = t.number(row, "theta_deg").to_radians();
        let r = Stack::new(list.clone(), true, freq_hz).unwrap().reflection(theta).unwrap();
        coherent = coherent.max((r.power_h - t.number(row, "r_h_coherent")).abs()).max((r.power_v - t.number(row, "r_v_coherent")).abs());
        let r = Stack::new(list, false, freq_hz).unwrap().reflection(theta).unwrap();
        incoherent =
            incoherent.max((r.power_h - t.number(row, "r_h_incoherent")).abs()).max((r.power_v - t.number(row, "r_v_incoherent")).abs());
    }
    println!("coherent {coherent:e}, incoherent {incoherent:e}");
    assert_eq!(t.rows.len(), 126);
    assert!(coherent < 1e-8 && incoherent < 1e-8);
}

#[test]
fn small_scale_roughness() {
    let t = Table::open("rough_qh_choudhury_smrt.csv");
    let mut worst = 0.0f64;
    for row in &t.rows {
        let freq_hz = t.number(row, "f_ghz") * 1e9;
        let stack = Stack::half_space(eps(&t, row, "eps_re", "eps_loss"), 290.0, freq_hz).unwrap();
        let params: Vec<(String, f64)> = t
            .text(row, "params")
            .split_whitespace()
            .map(|p| p.split_once('=').unwrap())
            .map(|(k, v)| (k.to_owned(), v.parse().unwrap()))
            .collect();
        let get = |name: &str| params.iter().find(|p| p.0 == name).unwrap().1;
        let text = match t.text(row, "model") {
            "qnh" => format!("qh:{},{},{}", get("Q"), get("H"), get("N")),
            "choudhury79" => format!("choudhury:{}mm", get("sigma_mm")),
            "wegmuller99" => format!("wegmuller:{}mm", get("sigma_mm")),
            other => panic!("{other}"),
        };
        let surface = SurfaceModel::new(stack, text.parse().unwrap());
        let r = surface.reflection(t.number(row, "theta_deg").to_radians()).unwrap();
        worst = worst.max((r.power_h - t.number(row, "r_h")).abs()).max((r.power_v - t.number(row, "r_v")).abs());
    }
    println!("Q/H, Choudhury, Wegmueller: {worst:e} over {}", t.rows.len());
    assert_eq!(t.rows.len(), 136);
    assert!(worst < 1e-5);
}

#[test]
fn shadow_lambda_values() {
    let t = Table::open("shadow_lambda_smrt.csv");
    let (mut worst, mut relative) = (0.0f64, 0.0f64);
    for row in &t.rows {
        let slopes = Slopes::isotropic(t.number(row, "mss_per_axis").sqrt()).unwrap();
        let lambda = shadow_lambda(&slopes, t.number(row, "theta_deg").to_radians(), 0.4);
        let want = t.number(row, "lambda");
        worst = worst.max((lambda - want).abs());
        // For very small values the oracle subtracts nearly equal terms and loses digits.
        if want > 1e-20 {
            relative = relative.max((lambda / want - 1.0).abs());
        }
    }
    println!("lambda: {worst:e} absolute, {relative:e} relative over {}", t.rows.len());
    assert_eq!(t.rows.len(), 45);
    assert!(worst < 1e-8 && relative < 1e-8);
}

#[test]
fn bistatic_values() {
    let t = Table::open("rough_go_bistatic_smrt.csv");
    let mut worst = 0.0f64;
    for row in &t.rows {
        let stack = Stack::half_space(eps(&t, row, "eps_re", "eps_loss"), 290.0, 37e9).unwrap();
        let slopes = Slopes::isotropic(t.number(row, "mss_per_axis").sqrt()).unwrap();
        let shadowing = match t.text(row, "shadow") {
            "1" => Shadowing::Smith,
            _ => Shadowing::None,
        };
        let got = bistatic_coefficient(
            &stack,
            &slopes,
            shadowing,
            &BistaticGeometry {
                incident_zenith_rad: t.number(row, "theta_i_deg").to_radians(),
                incident_azimuth_rad: 0.3,
                scattered_zenith_rad: t.number(row, "theta_s_deg").to_radians(),
                scattered_azimuth_rad: 0.3 + t.number(row, "dphi_deg").to_radians(),
            },
        )
        .unwrap();
        let want = ["gamma_vv", "gamma_vh", "gamma_hv", "gamma_hh"].map(|n| t.number(row, n));
        let largest = want.iter().fold(0.0f64, |a, b| a.max(*b));
        for (a, b) in [got.vv, got.vh, got.hv, got.hh].iter().zip(want) {
            // Far off the mirror direction the density of slopes underflows and all four are 0.
            let deviation = if a == &b { 0.0 } else { (a - b).abs() / largest };
            assert!(deviation < 1e-6, "{row:?} {got:?}");
            worst = worst.max(deviation);
        }
    }
    println!("bistatic: {worst:e} over {}", t.rows.len());
    assert_eq!(t.rows.len(), 768);
}

#[test]
fn facets_against_ray_traced_height_fields() {
    let t = Table::open("rough_surface_monte_carlo.csv");
    let (mut single, mut total) = (0.0f64, 0.0f64);
    for row in &t.rows {
        let stack = Stack::half_space(eps(&t, row, "eps_re", "eps_loss"), 290.0, 37e9).unwrap();
        let mut go = GeometricOptics::new(Slopes::isotropic(t.number(row, "mss_per_axis").sqrt()).unwrap());
        let theta = t.number(row, "theta_deg").to_radians();
        let cold = |_: f64| 0.0;
        go.closure = Closure::ReEmit;
        let once = go.response(&stack, theta, 0.0, Sky::Symmetric(&cold)).reflectivity;
        go.closure = Closure::SecondBounce;
        let twice = go.response(&stack, theta, 0.0, Sky::Symmetric(&cold)).reflectivity;
        let d1 = [once[0] - t.number(row, "r_h_single_bounce_escape"), once[1] - t.number(row, "r_v_single_bounce_escape")];
        let d2 = [twice[0] - t.number(row, "r_h_total"), twice[1] - t.number(row, "r_v_total")];
        println!(
            "slope {} eps {} theta {}: single {:+.4} {:+.4} total {:+.4} {:+.4}",
            &row[0], &row[2], &row[4], d1[0], d1[1], d2[0], d2[1]
        );
        single = single.max(d1[0].abs()).max(d1[1].abs());
        total = total.max(d2[0].abs()).max(d2[1].abs());
    }
    println!("single {single:.4}, second bounce {total:.4} over {}", t.rows.len());
    assert_eq!(t.rows.len(), 42);
    assert!(single < 0.01 && total < 0.02);
}
