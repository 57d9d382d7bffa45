//! Delays against the formulas of geodesy, and laws.

use crate::atmosphere::*;
use crate::constants::SPEED_OF_LIGHT_M_S;

fn dry(name: &str) -> Atmosphere {
    let profile = reference_profile(name).unwrap();
    let dry = |l: &Level| AirState::new(l.air.pressure_hpa(), l.air.temperature_k(), 0.0).unwrap();
    let levels = profile.levels().iter().map(|l| Level { z_km: l.z_km, air: dry(l) });
    Atmosphere::new(Profile::new(name, levels.collect()).unwrap(), gas_model("mpm89").unwrap()).unwrap()
}

fn zenith(air: &Atmosphere, freq_ghz: f64) -> PathDelay {
    air.delay(&[freq_ghz], &[0.0], Geometry::Plane).unwrap()[0].delay
}

// Saastamoinen 1972: 2.2768 mm for each hPa at the surface, divided by 1 - 0.00266 cos(2 latitude) for gravity.
#[test]
fn zenith_delay_of_dry_air_is_that_of_saastamoinen() {
    for (name, latitude) in [("ussa", 45.0f64), ("trl", 15.0), ("mls", 45.0), ("mlw", 45.0), ("sas", 60.0), ("saw", 60.0)] {
        let air = dry(name);
        let p = air.profile().surface().pressure_hpa();
        let want = 0.002_276_8 * p / (1.0 - 0.002_66 * (2.0 * latitude.to_radians()).cos());
        let got = zenith(&air, 0.0);
        println!("{name}: {:.4} m, Saastamoinen {want:.4} m", got.total_m());
        assert_eq!((got.wet_m, got.liquid_m, got.bending_m, got.dispersive_m), (0.0, 0.0, 0.0, 0.0));
        assert!((got.total_m() - want).abs() < 0.012 && (2.25..2.35).contains(&got.total_m()), "{name}: {got:?} {want}");
    }
}

// Askne & Nordius 1987, Bevis 1992: between 6 and 7.5 mm of wet delay for each kg/m2 of vapour, less in warm air.
#[test]
fn wet_delay_is_six_times_the_water() {
    let mut ratios = Vec::new();
    for entry in ATMOSPHERES {
        let air = Atmosphere::reference(entry.name, "mpm89").unwrap();
        let water = air.profile().precipitable_water_kg_m2().unwrap();
        let wet = zenith(&air, 0.0).wet_m;
        println!("{}: {:.1} mm for {water:.1} kg/m2, {:.2}", entry.name, wet * 1e3, wet * 1e3 / water);
        assert!((5.9..7.5).contains(&(wet * 1e3 / water)));
        ratios.push((entry.name, wet * 1e3 / water));
    }
    let of = |name: &str| ratios.iter().find(|r| r.0 == name).unwrap().1;
    assert!(of("trl") < of("mls") && of("mls") < of("mlw") && of("mlw") < of("saw"));
}

// Niell 1996, hydrostatic mapping at 45 degrees of latitude: excess over that of the zenith, bending included. Zenith angles are apparent, so
// the elevation of the source is lower by the refraction.
#[test]
fn slant_delay_follows_the_mapping_of_niell() {
    let air = dry("ussa");
    let overhead = zenith(&air, 0.0).total_m();
    for elevation in [5.2f64, 7.0, 10.0, 20.0, 45.0] {
        let row = air.delay(&[0.0], &[90.0 - elevation], Geometry::Spherical).unwrap()[0];
        let sin = (elevation - row.refraction_deg).to_radians().sin();
        let (a, b, c) = (1.268_323e-3, 2.915_23e-3, 62.837_4e-3);
        let want = (1.0 + a / (1.0 + b / (1.0 + c))) / (sin + a / (sin + b / (sin + c)));
        let got = row.delay.total_m() / overhead;
        println!(
            "{elevation} deg: {got:.4}, Niell {want:.4}, bending {:.4} m, refraction {:.4} deg",
            row.delay.bending_m, row.refraction_deg
        );
        assert!((got / want - 1.0).abs() < 3e-3, "{elevation}: {got} {want}");
    }
}

// Green 1985, Spherical Astronomy, section 4.2: `a (1 - b) tan z - a (b - a/2) tan^3 z`, `a` the refractivity at the surface and `b` the
// height of homogeneous air over the radius of the Earth.
#[test]
fn refraction_lifts_the_source_as_in_spherical_astronomy() {
    let air = dry("ussa");
    let surface = air.profile().surface();
    let a = 1e-6 * refractivity_thayer74(&surface);
    let b = 287.054 * surface.temperature_k() / 9.80665 / (1e3 * EARTH_RADIUS_KM);
    for elevation in [10.0f64, 15.0, 20.0, 45.0, 80.0] {
        let row = air.delay(&[0.0], &[90.0 - elevation], Geometry::Spherical).unwrap()[0];
        let tan = 1.0 / elevation.to_radians().tan();
        let want = (a * (1.0 - b) * tan - a * (b - 0.5 * a) * tan.powi(3)).to_degrees();
        println!("{elevation} deg: refraction {:.5} deg, series {want:.5} deg", row.refraction_deg);
        assert!((row.refraction_deg / want - 1.0).abs() < if elevation < 16.0 { 5e-3 } else { 1e-3 });
    }
}

#[test]
fn liquid_delays_by_its_water() {
    let clear = Atmosphere::reference("mls", "mpm89").unwrap();
    let wet = |texts: &[&str]| clear.clone().with_layers(texts.iter().map(|t| t.parse().unwrap()).collect()).unwrap();
    let cloudy = zenith(&wet(&["cloud:1km-2km:0.5g/m3"]), 0.0);
    // 1.5 ppm km m3/g, times 0.96 of (eps - 1)/(eps + 2).
    assert!((cloudy.liquid_m * 1e3 - 0.5 * 1.5 * 0.96).abs() < 0.01, "{cloudy:?}");
    assert_eq!(cloudy.dry_m, zenith(&clear, 0.0).dry_m);
    let rain = wet(&["rain:0km-3km:20mm/h"]);
    assert!(zenith(&rain, 10.0).liquid_m > 3e-3 && zenith(&rain, 300.0).liquid_m < 1e-4);
    let flood = wet(&["rain:0km-3km:200mm/h"]);
    assert!(flood.delay(&[10.0], &[0.0], Geometry::Plane).unwrap_err().to_string().contains("rain rate of a delay 200"));
}

// Below a line the gas delays more and above it less, and far from lines dispersion is small.
#[test]
fn dispersion_turns_at_lines_and_grows_with_frequency() {
    for model in GAS_MODELS {
        let air = Atmosphere::reference("mls", model.name).unwrap();
        let part = |freq: f64| zenith(&air, freq).dispersive_m;
        assert_eq!(part(0.0), 0.0);
        assert!(part(182.0) > part(184.5) && part(555.0) > part(559.0) && part(118.0) > part(119.5));
        println!(
            "{}: {:.3} mm at 10 GHz, {:.3} mm at 94 GHz, {:.3} mm at 340 GHz",
            model.name,
            part(10.0) * 1e3,
            part(94.0) * 1e3,
            part(340.0) * 1e3
        );
        assert!(part(10.0).abs() < 1e-3 && part(94.0).abs() < 3e-3);
    }
}

#[test]
fn phase_and_time_follow_from_the_length() {
    let d = zenith(&Atmosphere::reference("ussa", "mpm89").unwrap(), 94.0);
    assert!((d.phase_rad() * SPEED_OF_LIGHT_M_S / (std::f64::consts::TAU * 94e9) - d.total_m()).abs() < 1e-12);
    assert!((d.delay_s() * SPEED_OF_LIGHT_M_S / d.total_m() - 1.0).abs() < 1e-15);
    assert_eq!(zenith(&dry("ussa"), 0.0).phase_rad(), 0.0);
}

#[test]
fn paths_add_up_and_horizontal_ones_have_one_refractivity() {
    let air = Atmosphere::reference("trl", "mpm89").unwrap().with_layers(vec!["cloud:1km-2km:0.2g/m3".parse().unwrap()]).unwrap();
    let path = |a: f64, b: f64, extent| air.path_delay(&[94.0], &PathEnds::new(a, b, extent).unwrap()).unwrap()[0];
    let slant = PathExtent::ZenithDeg(60.0);
    let (low, high, whole) = (path(0.0, 1.0, slant), path(3.0, 1.0, slant), path(0.0, 3.0, slant));
    assert!((low.total_m() + high.total_m() - whole.total_m()).abs() < 1e-9);
    assert!((whole.liquid_m / 2.0 / path(0.0, 3.0, PathExtent::ZenithDeg(0.0)).liquid_m - 1.0).abs() < 1e-12);
    for z in [0.0, 12.345, 30.0] {
        let level = path(z, z, PathExtent::LengthKm(10.0));
        let n = air.gas().spectrum(&air.profile().air_at(z).unwrap()).refractivity(94.0);
        let want = 10.0 * 1e-3 * (n.dry_static + n.wet_static + n.dry.re + n.wet.re);
        assert!((level.total_m() / want - 1.0).abs() < 1e-6, "{z}: {level:?} {want}");
    }
}

#[test]
fn bad_delays_are_named() {
    let air = Atmosphere::reference("ussa", "mpm89").unwrap();
    let fault = |f: &[f64], z: &[f64]| air.delay(f, z, Geometry::Spherical).unwrap_err().to_string();
    assert!(fault(&[-1.0], &[0.0]).starts_with("frequency -1 GHz"));
    assert!(fault(&[1000.5], &[0.0]).starts_with("frequency 1000.5 GHz"));
    assert!(fault(&[94.0], &[90.0]).starts_with("zenith angle of a delay 90 deg"));
    assert!(fault(&[], &[0.0]).starts_with("no frequency given") && fault(&[1.0], &[]).starts_with("no zenith angle given"));
    assert!(air.delay_from(30.0, &[94.0], &[0.0], Geometry::Plane).is_err());
    let nearly_all = air.delay_from(29.9, &[94.0], &[0.0], Geometry::Plane).unwrap()[0].delay.total_m();
    assert!((0.02..0.03).contains(&nearly_all), "{nearly_all}");
}
