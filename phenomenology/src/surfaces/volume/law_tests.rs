//! Laws that every stack that scatters obeys: energy, reciprocity, isothermal enclosures, and the limits without scattering.

use super::column::Column;
use super::iba::{Mixture, improved_born_maetzler98};
use super::{Microstructure, StreamOptions};
use crate::constants::SPEED_OF_LIGHT_M_S;
use crate::dielectrics::mixing::SPHERE;
use crate::dielectrics::{Extrapolation, ice_permittivity_maetzler06};
use crate::surfaces::{Canopy, Layer, Roughness, Sky, Stack, StackDescription, SurfaceModel};
use num_complex::Complex64;
use std::f64::consts::TAU;

const SNOW_ON_ICE: &str = "coherent = false
[[layer]]
material = \"dry-snow\"
thickness_m = 0.2
density_kg_m3 = 280
temperature_k = 250
scatter = \"iba:0.15mm\"
[[layer]]
material = \"dry-snow\"
thickness_m = 0.05
density_kg_m3 = 400
temperature_k = 255
[[layer]]
material = \"sea-ice\"
thickness_m = 2
temperature_k = 260
salinity_psu = 1
porosity = 0.1
scatter = \"iba-spheres:0.3mm\"
[[layer]]
material = \"sea-water\"
temperature_k = 271.3
";

const DEEP: &str = "coherent = false
[[layer]]
material = \"dry-snow\"
density_kg_m3 = 300
temperature_k = 255
scatter = \"iba:0.1mm\"
";

const TREES: &str = "coherent = false
[[layer]]
material = \"leaf\"
thickness_m = 5
temperature_k = 290
scatter = \"leaves:3,0.2mm\"
[[layer]]
material = \"soil\"
temperature_k = 285
";

fn surface(text: &str, freq_hz: f64) -> SurfaceModel {
    let stack = StackDescription::from_toml(text).unwrap().resolve(freq_hz, Extrapolation::Documented).unwrap();
    SurfaceModel::new(stack, Roughness::Smooth)
}

fn angles() -> impl Iterator<Item = f64> {
    [0.0_f64, 5.0, 31.7, 53.0, 70.0, 83.0, 89.0, 89.99].into_iter().map(f64::to_radians)
}

#[test]
fn an_isothermal_enclosure_shows_its_temperature() {
    for text in [SNOW_ON_ICE, DEEP, TREES] {
        let mut model = surface(text, 89e9);
        model.stack = model.stack.with_temperatures(|_| 271.0).unwrap();
        for theta in angles() {
            for sky in [Sky::Symmetric(&|_| 271.0), Sky::Full(&|_, _| 271.0)] {
                let r = model.response(theta, 0.4, sky).unwrap();
                for p in 0..2 {
                    assert!((r.brightness_k()[p] - 271.0).abs() < 1e-10, "{theta}: {}", r.brightness_k()[p]);
                    assert!((r.emissivity[p] + r.reflectivity[p] - 1.0).abs() < 1e-14);
                    assert!((0.0..=1.0).contains(&r.emissivity[p]));
                }
            }
        }
    }
}

#[test]
fn layers_absorb_what_is_not_reflected() {
    for text in [SNOW_ON_ICE, DEEP, TREES] {
        let model = surface(text, 36.5e9);
        for theta in angles() {
            let reflected = model.reflection(theta).unwrap().powers();
            let absorbed = model.stack.absorption(theta).unwrap();
            for p in 0..2 {
                let sum: f64 = absorbed.iter().map(|a| a[p]).sum();
                assert!((sum + reflected[p] - 1.0).abs() < 1e-12);
            }
            let r = model.response(theta, 0.0, Sky::Symmetric(&|_| 40.0)).unwrap();
            assert!((0..2).all(|p| (r.scattered_sky_k[p] - 40.0 * r.reflectivity[p]).abs() < 1e-10));
        }
    }
}

/// Snow over a lossy half-space, solved without any closing of the balance: rows add up to 1, and a path has the loss of its reverse.
#[test]
fn the_solver_itself_keeps_energy_and_is_reciprocal() {
    let freq_hz = 89e9;
    let mix =
        Mixture { host: Complex64::new(1.0, 0.0), inclusion: ice_permittivity_maetzler06(89.0, 260.0), fraction: 0.3, factors: SPHERE };
    let (eps, scatterer) = improved_born_maetzler98(&mix, Microstructure::Exponential { length_m: 2e-4 }, freq_hz).unwrap();
    let layers = [
        Layer { eps, thickness_m: 0.3, temperature_k: 260.0 },
        Layer { eps: Complex64::new(5.0, -0.5), thickness_m: f64::INFINITY, temperature_k: 270.0 },
    ];
    let k0 = TAU * freq_hz / SPEED_OF_LIGHT_M_S;
    let column = Column::new(&layers, &[Some(scatterer), None], k0, StreamOptions::default());
    for (r, e) in column.seen.reflect.row_sums().iter().zip(column.seen.emit.row_sums()) {
        assert!((r + e - 1.0).abs() < 1e-9, "{}", r + e - 1.0);
    }
    let n = column.seen.reflect.rows();
    for i in 0..n {
        for j in 0..i {
            let there = column.streams.flux[i / 2] * column.seen.reflect[(i, j)];
            let back = column.streams.flux[j / 2] * column.seen.reflect[(j, i)];
            assert!((there - back).abs() < 1e-9 * column.streams.flux[i / 2].max(column.streams.flux[j / 2]), "{i} {j}: {there} {back}");
        }
    }
}

#[test]
fn fine_grains_leave_the_plain_stack() {
    let plain = SNOW_ON_ICE.replace("scatter = \"iba:0.15mm\"\n", "").replace("porosity = 0.1\nscatter = \"iba-spheres:0.3mm\"\n", "");
    let fine = plain.replace("temperature_k = 250\n", "temperature_k = 250\nscatter = \"iba:0.0002mm,maetzler96\"\n");
    assert_ne!(plain, fine);
    let (plain, fine) = (surface(&plain, 18.7e9), surface(&fine, 18.7e9));
    for theta in angles().filter(|t| *t < 1.4) {
        let (a, b) = (plain.emission_k(theta, 0.0).unwrap(), fine.emission_k(theta, 0.0).unwrap());
        // The absorption 2 k0 Im sqrt(eps) d/cos and that of a lossy layer differ in the second order of the loss tangent.
        assert!((a[0] - b[0]).abs() < 0.02 && (a[1] - b[1]).abs() < 0.02, "{theta}: {a:?} {b:?}");
    }
}

#[test]
fn leaves_that_do_not_scatter_are_the_canopy_of_tau_and_omega() {
    let text = "coherent = false\n[[layer]]\neps = [1.0, 0.0]\nthickness_m = 1\ntemperature_k = 295\nscatter = \"isotropic:0.4,0\"\n\
                [[layer]]\neps = [6.0, 1.0]\ntemperature_k = 280\n";
    let model = surface(text, 10e9);
    let mut other = SurfaceModel::new(Stack::half_space(Complex64::new(6.0, -1.0), 280.0, 10e9).unwrap(), Roughness::Smooth);
    other.canopy = Some(Canopy::new(0.4, 0.0, 295.0).unwrap());
    for theta in angles().filter(|t| *t < 1.5) {
        let (a, b) = (model.emission_k(theta, 0.0).unwrap(), other.emission_k(theta, 0.0).unwrap());
        assert!((a[0] - b[0]).abs() < 0.01 && (a[1] - b[1]).abs() < 0.01, "{theta}: {a:?} {b:?}");
    }
}

#[test]
fn twice_the_streams_change_little() {
    let description = StackDescription::from_toml(SNOW_ON_ICE).unwrap();
    for freq_hz in [18.7e9, 89e9, 150e9] {
        let (mut layers, mut scatterers) = (Vec::new(), Vec::new());
        for (i, layer) in description.layers.iter().enumerate() {
            let (eps, scatterer) = description.scatterer(i, freq_hz, Extrapolation::Documented).unwrap();
            layers.push(Layer { eps, thickness_m: layer.thickness_m, temperature_k: layer.temperature_k });
            scatterers.push(scatterer);
        }
        let solved = |options| {
            let stack = Stack::scattering(layers.clone(), &scatterers, false, freq_hz, options).unwrap();
            SurfaceModel::new(stack, Roughness::Smooth)
        };
        let half = StreamOptions::default();
        let (half, whole) = (solved(half), solved(StreamOptions { air: 2 * half.air, inner: 2 * half.inner }));
        let sky = |zenith: f64| 270.0 - 230.0 * (-0.2 / zenith.cos().max(1e-6)).exp();
        let mut most = 0.0_f64;
        for theta in angles() {
            let a = half.brightness_k(theta, 0.0, Sky::Symmetric(&sky)).unwrap();
            let b = whole.brightness_k(theta, 0.0, Sky::Symmetric(&sky)).unwrap();
            most = most.max((a[0] - b[0]).abs()).max((a[1] - b[1]).abs());
        }
        println!("{freq_hz}: {most}");
        assert!(most < 0.05, "{freq_hz}: {most} K");
    }
}

/// Maetzler 1994 and others: old winter snow is tens of kelvins colder at 36.5 GHz than its temperature, and colder at 94 GHz than at 10 GHz.
#[test]
fn winter_snow_is_cold_at_millimetre_waves() {
    let text = "coherent = false\n[[layer]]\nmaterial = \"dry-snow\"\nthickness_m = 1\ndensity_kg_m3 = 300\ntemperature_k = 260\n\
                scatter = \"iba:0.2mm\"\n[[layer]]\nmaterial = \"frozen-soil\"\ntemperature_k = 270\n";
    let emissivity = |f: f64| surface(text, f).response(50f64.to_radians(), 0.0, Sky::Symmetric(&|_| 0.0)).unwrap().emissivity[1];
    let (low, mid, high) = (emissivity(10e9), emissivity(36.5e9), emissivity(94e9));
    assert!(low > 0.93 && mid < 0.85 && high < mid, "{low} {mid} {high}");
}

#[test]
fn faults_name_the_layer_and_what_to_do() {
    let message = |text: &str| {
        let found = StackDescription::from_toml(text).and_then(|d| d.resolve(37e9, Extrapolation::Refuse));
        found.unwrap_err().to_string()
    };
    let coherent = message(&DEEP.replace("false", "true"));
    assert!(coherent.contains("layer 1 (line 2)") && coherent.contains("coherent = false"), "{coherent}");
    let wet = message(&DEEP.replace("dry-snow", "wet-snow"));
    assert!(wet.contains("layer 1 (line 2)") && wet.contains("dry-snow, fresh-ice and sea-ice"), "{wet}");
    let bubbles = message(&DEEP.replace("dry-snow", "ice").replace("density_kg_m3 = 300\n", ""));
    assert!(bubbles.contains("porosity"), "{bubbles}");
    let unused = message(&DEEP.replace("scatter = \"iba:0.1mm\"", "porosity = 0.1"));
    assert!(unused.contains("give scatter too"), "{unused}");
    let model = SurfaceModel::new(surface(DEEP, 37e9).stack, "sea:5".parse().unwrap());
    let rough = model.response(0.3, 0.0, Sky::Symmetric(&|_| 0.0)).unwrap_err().to_string();
    assert!(rough.contains("give it one of them"), "{rough}");
}
