//! Laws every surface obeys: energy, reciprocity, isothermal enclosures.

use super::*;
use num_complex::Complex64;
use proptest::prelude::*;
use std::f64::consts::{PI, TAU};

const FREQ_HZ: f64 = 94e9;

fn half_space(re: f64, loss: f64, temperature_k: f64) -> Stack {
    Stack::half_space(Complex64::new(re, -loss), temperature_k, FREQ_HZ).unwrap()
}

fn layered(temperature_k: [f64; 3], coherent: bool) -> Stack {
    let layer = |re: f64, loss: f64, d: f64, t: f64| Layer { eps: Complex64::new(re, -loss), thickness_m: d, temperature_k: t };
    Stack::new(
        vec![
            layer(1.5, 0.001, 5e-3, temperature_k[0]),
            layer(3.17, 0.02, 1.3e-3, temperature_k[1]),
            layer(9.0, 12.0, f64::INFINITY, temperature_k[2]),
        ],
        coherent,
        FREQ_HZ,
    )
    .unwrap()
}

fn any_roughness() -> impl Strategy<Value = Roughness> {
    let closures = prop_oneof![Just(Closure::ReEmit), Just(Closure::SecondBounce)];
    let shadowings = prop_oneof![Just(Shadowing::Smith), Just(Shadowing::Wagner)];
    let foams = prop_oneof![Just(None), (0.0..1.0f64).prop_map(|cover| Some(Foam::new(cover).unwrap()))];
    prop_oneof![
        1 => Just(Roughness::Smooth),
        2 => (0.0..1.0f64, 0.0..2.0f64, 0.0..2.0f64)
            .prop_map(|(q, h, n)| Roughness::Qh(QhRoughness::new(q, h, n).unwrap())),
        1 => (0.0..1e-3f64).prop_map(|s| Roughness::Choudhury { rms_height_m: s }),
        3 => (0.02..0.4f64, 0.02..0.4f64, closures, shadowings, foams).prop_map(|(a, b, closure, shadowing, foam)| {
            Roughness::GeometricOptics(GeometricOptics {
                slopes: Slopes::new(a, b).unwrap(),
                shadowing,
                closure,
                foam,
            })
        }),
    ]
}

fn any_stack(temperature_k: f64) -> impl Strategy<Value = Stack> {
    prop_oneof![
        (1.0..80.0f64, 0.0..80.0f64).prop_map(move |(re, loss)| half_space(re, loss, temperature_k)),
        Just(half_space(1.0, 5e6, temperature_k)),
        any::<bool>().prop_map(move |coherent| layered([temperature_k; 3], coherent)),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn isothermal_enclosure_shows_its_temperature(
        stack in any_stack(287.0),
        roughness in any_roughness(),
        theta in 0.0..89.99f64,
        azimuth in 0.0..TAU,
        tau in prop_oneof![Just(None), (0.0..3.0f64, 0.0..0.3f64).prop_map(Some)],
    ) {
        let mut surface = SurfaceModel::new(stack, roughness);
        surface.canopy = tau.map(|(tau, omega)| Canopy::new(tau, omega, 287.0).unwrap());
        let warm = |_: f64, _: f64| 287.0;
        let r = surface.response(theta.to_radians(), azimuth, Sky::Full(&warm)).unwrap();
        for p in 0..2 {
            prop_assert!((r.brightness_k()[p] - 287.0).abs() < 1e-6, "{r:?}");
            prop_assert!((r.emissivity[p] + r.reflectivity[p] - 1.0).abs() < 1e-12, "{r:?}");
            prop_assert!(r.reflectivity[p] >= 0.0);
        }
    }

    #[test]
    fn layer_weights_and_reflectivity_add_up_to_one(
        depths in proptest::collection::vec((1.0..12.0f64, 0.0..6.0f64, 0.0..0.05f64), 0..5),
        bottom in (1.0..80.0f64, 0.01..80.0f64),
        coherent in any::<bool>(),
        theta in 0.0..89.9f64,
    ) {
        let mut layers: Vec<Layer> = depths.iter().map(|&(re, loss, d)| Layer {
            eps: Complex64::new(re, -loss), thickness_m: d, temperature_k: 280.0,
        }).collect();
        layers.push(Layer {
            eps: Complex64::new(bottom.0, -bottom.1),
            thickness_m: f64::INFINITY,
            temperature_k: 270.0,
        });
        let stack = Stack::new(layers, coherent, 37e9).unwrap();
        let theta = theta.to_radians();
        let r = stack.reflection(theta).unwrap();
        let weights = stack.absorption(theta).unwrap();
        for p in 0..2 {
            let sum: f64 = weights.iter().map(|w| w[p]).sum();
            prop_assert!((sum + r.powers()[p] - 1.0).abs() < 1e-9, "{sum} {r:?}");
            prop_assert!(weights.iter().all(|w| w[p] >= -1e-12), "{weights:?}");
        }
    }

    #[test]
    fn bistatic_coefficient_is_reciprocal(
        incident in (0.0..89.0f64, 0.0..TAU),
        scattered in (0.0..89.0f64, 0.0..TAU),
        slopes in (0.05..0.5f64, 0.05..0.5f64),
        eps in (1.5..40.0f64, 0.0..40.0f64),
    ) {
        let stack = half_space(eps.0, eps.1, 290.0);
        let slopes = Slopes::new(slopes.0, slopes.1).unwrap();
        let there = BistaticGeometry {
            incident_zenith_rad: incident.0.to_radians(),
            incident_azimuth_rad: incident.1,
            scattered_zenith_rad: scattered.0.to_radians(),
            scattered_azimuth_rad: scattered.1,
        };
        // Back along the same two rays.
        let back = BistaticGeometry {
            incident_zenith_rad: there.scattered_zenith_rad,
            incident_azimuth_rad: there.scattered_azimuth_rad + PI,
            scattered_zenith_rad: there.incident_zenith_rad,
            scattered_azimuth_rad: there.incident_azimuth_rad + PI,
        };
        let a = bistatic_coefficient(&stack, &slopes, Shadowing::Smith, &there).unwrap();
        let b = bistatic_coefficient(&stack, &slopes, Shadowing::Smith, &back).unwrap();
        let (ci, cs) = (there.incident_zenith_rad.cos(), there.scattered_zenith_rad.cos());
        let size = (a.vv + a.hh + a.vh + a.hv) * ci + 1e-300;
        for (x, y) in [(a.vv, b.vv), (a.hh, b.hh), (a.vh, b.hv), (a.hv, b.vh)] {
            prop_assert!((x * ci - y * cs).abs() <= 1e-9 * size, "{a:?} {b:?}");
        }
    }

    #[test]
    fn smith_facets_never_give_more_than_they_get(
        log_slopes in (-6.0..0.0f64, -6.0..0.0f64),
        theta in prop_oneof![0.0..90.0f64, 89.0..89.99999f64],
        azimuth in 0.0..TAU,
    ) {
        let slopes = Slopes::new(10f64.powf(log_slopes.0), 10f64.powf(log_slopes.1)).unwrap();
        let metal = half_space(1.0, 1e12, 290.0);
        let black = half_space(1.0, 0.0, 290.0);
        let mut go = GeometricOptics::new(slopes);
        let sky = |_: f64| 1.0;
        let e = go.integrals(&black, theta.to_radians(), azimuth, Sky::Symmetric(&sky)).emissivity;
        prop_assert!((e[0] - 1.0).abs() < 1e-4 && (e[1] - 1.0).abs() < 1e-4, "black {e:?}");
        for closure in [Closure::Single, Closure::ReEmit, Closure::SecondBounce] {
            go.closure = closure;
            let r = go.response(&metal, theta.to_radians(), azimuth, Sky::Symmetric(&sky));
            for p in 0..2 {
                prop_assert!(r.reflectivity[p] <= 1.0 + 1e-6, "{closure:?} {r:?}");
                prop_assert!(r.emissivity[p] >= -1e-6 && r.reflectivity[p] > 0.2, "{closure:?} {r:?}");
                prop_assert!(r.emissivity[p] + r.reflectivity[p] <= 1.0 + 1e-6, "{closure:?} {r:?}");
            }
        }
    }
}

#[test]
fn visible_facets_of_a_black_surface_have_emissivity_one() {
    let black = half_space(1.0, 0.0, 290.0);
    let sky = |_: f64| 0.0;
    let mut worst = 0.0f64;
    for (su, sc) in [(0.01, 0.01), (0.1, 0.1), (0.3, 0.3), (0.3, 0.05), (0.1, 0.6)] {
        let go = GeometricOptics::new(Slopes::new(su, sc).unwrap());
        for degrees in [0.0f64, 30.0, 60.0, 80.0, 85.0, 88.0, 89.0, 89.9] {
            for azimuth in [0.0, 0.4, 1.2, 2.0] {
                let e = go.integrals(&black, degrees.to_radians(), azimuth, Sky::Symmetric(&sky)).emissivity;
                worst = worst.max((e[0] - 1.0).abs()).max((e[1] - 1.0).abs());
                assert!(worst < 1e-4, "{su} {sc} {degrees} {azimuth}: {e:?}");
            }
        }
    }
    println!("black emissivity off by {worst:e}");
}

#[test]
fn gentle_slopes_tend_to_the_smooth_surface() {
    let stack = half_space(8.2, 13.9, 290.0);
    let sky = |_: f64| 0.0;
    let go = GeometricOptics::new(Slopes::isotropic(1e-3).unwrap());
    for degrees in [0.0f64, 30.0, 60.0, 80.0] {
        let theta = degrees.to_radians();
        let smooth = stack.reflection(theta).unwrap().powers();
        let rough = go.integrals(&stack, theta, 0.0, Sky::Symmetric(&sky)).reflectivity;
        for p in 0..2 {
            assert!((smooth[p] - rough[p]).abs() < 1e-4, "{degrees}: {smooth:?} {rough:?}");
        }
    }
}

#[test]
fn turning_the_surface_turns_the_answer() {
    let stack = half_space(8.2, 13.9, 290.0);
    let warm_south = |zenith: f64, azimuth: f64| 50.0 + 30.0 * azimuth.cos() * zenith.sin();
    let warm_east = |zenith: f64, azimuth: f64| 50.0 + 30.0 * (azimuth - 0.5 * PI).cos() * zenith.sin();
    for closure in [Closure::ReEmit, Closure::SecondBounce] {
        let mut a = GeometricOptics::new(Slopes::new(0.25, 0.1).unwrap());
        let mut b = GeometricOptics::new(Slopes::new(0.1, 0.25).unwrap());
        (a.closure, b.closure) = (closure, closure);
        let x = a.response(&stack, 0.9, 0.3, Sky::Full(&warm_south));
        let y = b.response(&stack, 0.9, 0.3 + 0.5 * PI, Sky::Full(&warm_east));
        for p in 0..2 {
            assert!((x.brightness_k()[p] - y.brightness_k()[p]).abs() < 1e-6, "{x:?} {y:?}");
        }
    }
    // An isotropic surface mirrors a one-sided sky towards the other side.
    let go = GeometricOptics::new(Slopes::isotropic(0.1).unwrap());
    let facing = go.response(&stack, 0.9, PI, Sky::Full(&warm_south));
    let away = go.response(&stack, 0.9, 0.0, Sky::Full(&warm_south));
    assert!(facing.scattered_sky_k[0] > away.scattered_sky_k[0] + 10.0);
}

#[test]
fn a_thick_top_layer_hides_what_is_below() {
    for coherent in [true, false] {
        let layer = |d| Layer { eps: Complex64::new(6.0, -2.0), thickness_m: d, temperature_k: 260.0 };
        let bottom = Layer { eps: Complex64::new(2.0, -0.1), thickness_m: f64::INFINITY, temperature_k: 300.0 };
        let stack = Stack::new(vec![layer(1.0), bottom], coherent, FREQ_HZ).unwrap();
        let bare = half_space(6.0, 2.0, 260.0);
        let (a, b) = (stack.emission_k(0.8).unwrap(), bare.emission_k(0.8).unwrap());
        for p in 0..2 {
            assert!((a[p] - b[p]).abs() < 1e-9, "{a:?} {b:?}");
        }
    }
}

#[test]
fn layered_rough_surfaces_lie_between_their_temperatures() {
    let stack = layered([250.0, 270.0, 300.0], true);
    let sky = |_: f64| 0.0;
    for text in ["smooth", "qh:0.2,0.5,1", "go:0.1,0.2", "go:0.1,0.2,second-bounce"] {
        let surface = SurfaceModel::new(stack.clone(), text.parse().unwrap());
        for degrees in [0.0f64, 50.0, 80.0] {
            let r = surface.response(degrees.to_radians(), 0.1, Sky::Symmetric(&sky)).unwrap();
            for p in 0..2 {
                let mean = r.emitted_k[p] / r.emissivity[p];
                assert!((250.0..300.0).contains(&mean), "{text} {degrees}: {mean}");
            }
        }
    }
}

#[test]
fn bad_angles_and_azimuths_are_refused() {
    let surface = SurfaceModel::new(half_space(4.0, 1.0, 290.0), "go:0.1,0.1".parse().unwrap());
    let sky = |_: f64| 0.0;
    for theta in [PI / 2.0, 2.0, -0.1, f64::NAN] {
        assert!(surface.response(theta, 0.0, Sky::Symmetric(&sky)).is_err());
        assert!(surface.reflection(theta).is_err());
    }
    let error = surface.response(0.5, f64::NAN, Sky::Symmetric(&sky)).unwrap_err();
    assert!(error.to_string().contains("azimuth"));
    let steep = SurfaceModel::new(half_space(4.0, 1.0, 290.0), "wegmuller:1mm".parse().unwrap());
    assert!(steep.reflection(1.3).unwrap_err().to_string().contains("70"));
    assert!(Stack::half_space(Complex64::new(4.0, 1.0), 290.0, 1e9).is_err());
    assert!(Stack::half_space(Complex64::new(4.0, -1.0), 0.0, 1e9).is_err());
    assert!(Stack::half_space(Complex64::new(4.0, -1.0), 290.0, -1.0).is_err());
    assert_eq!(Stack::new(vec![], true, 1e9).unwrap_err(), SurfaceError::NoLayers);
}
