//! Laws that rays through weather must obey.

use super::*;
use crate::atmosphere::planck::{black_body_radiance, rayleigh_jeans_temperature_k};
use crate::atmosphere::{NEPER_PER_DECIBEL, PathEnds, PathExtent, PathTable, droplet_attenuation_liebe93};
use crate::camera::{Camera, View};
use crate::solids::SolidScene;
use cittert_arrays::SpectralWindow;

fn scene(text: &str) -> SolidScene {
    SolidScene::from_toml(text).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

fn rj(t: f64) -> f64 {
    rayleigh_jeans_temperature_k(94.0, black_body_radiance(94.0, t))
}

/// Temperature along one direction (azimuth and elevation in degrees) from a position, RJ, K.
fn look(scene: &SolidScene, position: [f64; 3], heading_deg: f64, pitch_deg: f64) -> f64 {
    let options = RenderOptions { antialias: 1, scale: Scale::RayleighJeans, highest_m: position[2], ..RenderOptions::default() };
    look_with(scene, &options, position, heading_deg, pitch_deg)
}

fn look_with(scene: &SolidScene, options: &RenderOptions, position_m: [f64; 3], heading_deg: f64, pitch_deg: f64) -> f64 {
    let tracer = Tracer::new(scene, &[94e9], options).unwrap();
    one(&tracer, position_m, heading_deg, pitch_deg)
}

fn one(tracer: &Tracer<'_>, position_m: [f64; 3], heading_deg: f64, pitch_deg: f64) -> f64 {
    let camera = Camera {
        position_m,
        look_at_m: None,
        heading_deg,
        pitch_deg,
        roll_deg: 0.0,
        fov_deg: 1e-4,
        size_px: [2, 2],
        projection: crate::camera::Projection::Sin,
    };
    let band = SpectralWindow::band(94e9, 1e9, 1).unwrap();
    tracer.picture(&View::of_camera(&camera).unwrap(), &band, None).unwrap().temperature.data[[0, 0, 1, 1]]
}

/// Black ground at 300 K, with other tables.
fn world(air: &str, rest: &str) -> String {
    format!(
        "kind = \"solids\"\nname = \"w\"\n[atmosphere]\n{air}\n[surface.black]\nlayer = [{{ eps = [1.0, 0.0], temperature_k = 300 }}]\n\
         [surface.metal]\nlayer = [{{ eps = [1.0, 1e13], temperature_k = 300 }}]\n{rest}\n"
    )
}

/// Banks of water, one over the other, that fill the air between the ground and a height over 4000 km.
fn banks(count: u32, top_m: f64, water: &str) -> String {
    (0..count)
        .map(|k| {
            let [low, high] = [k, k + 1].map(|k| top_m * f64::from(k) / f64::from(count));
            format!(
                "[[body]]\nname = \"b{k}\"\ntype = \"RPP\"\ndata = [-2e6, 2e6, -2e6, 2e6, {low}, {high}]\n\
                 [[weather]]\nname = \"w{k}\"\nis = \"+b{k}\"\n{water}\n"
            )
        })
        .collect()
}

#[test]
fn a_bank_that_fills_the_lower_air_is_the_fog_layer() {
    // Thin haze, heavy fog, a cloud that is opaque, and rain.
    for (layer, top_m, water) in [
        ("haze:0m-1000m:0.01g/m3", 1000.0, "haze_g_m3 = 0.01"),
        ("fog:0m-150m:0.3g/m3", 150.0, "liquid_g_m3 = 0.3"),
        ("cloud:0m-2000m:1g/m3", 2000.0, "liquid_g_m3 = 1.0"),
        ("rain:0m-3000m:10mm/h", 3000.0, "rain_mm_h = 10"),
    ] {
        for surface in ["black", "metal"] {
            let ground = format!("[ground]\nsurface = \"{surface}\"\n");
            let plane = scene(&world(&format!("layers = [\"{layer}\"]"), &ground));
            let within = scene(&world("", &format!("{ground}{}", banks(1, top_m, water))));
            let slices = scene(&world("", &format!("{ground}{}", banks(12, top_m, water))));
            let mut worst = 0.0_f64;
            // From the ground, inside the bank and above it; up and down.
            for height in [1e-3, 0.4 * top_m, top_m + 50.0] {
                let options = RenderOptions { antialias: 1, scale: Scale::RayleighJeans, highest_m: height, ..RenderOptions::default() };
                // A leg through a layer has pieces of one temperature. Pieces of 20 m are wrong by less than 0.07 K; those of the default
                // reach 0.23 K here. A bank needs no short pieces, because its source changes along each.
                let mut fine = options.clone();
                fine.tables.path_rise_km = 0.02;
                let p = Tracer::new(&plane, &[94e9], &fine).unwrap();
                let [w, s] = [&within, &slices].map(|scene| Tracer::new(scene, &[94e9], &options).unwrap());
                for pitch in [90.0, 60.0, 30.0, 10.0, 3.0, 0.5, -0.5, -3.0, -10.0, -40.0, -90.0] {
                    let [p, w, s] = [&p, &w, &s].map(|t| one(t, [0.0, 0.0, height], 40.0, pitch));
                    assert!((w - p).abs() < 0.1, "{layer} {surface} {height} m {pitch} deg: bank {w}, layer {p}");
                    assert!((s - w).abs() < 0.01, "{layer} {surface} {height} m {pitch} deg: slices {s}, bank {w}");
                    worst = worst.max((w - p).abs());
                }
            }
            println!("{layer} over {surface}: {worst:.4} K");
        }
    }
}

#[test]
fn a_world_of_one_temperature_stays_so_with_weather() {
    let sky = "[[body]]\nname = \"cloud\"\ntype = \"ELL\"\ndata = [-300, 500, 900, 300, 500, 900, 1000]\n\
        [[body]]\nname = \"cut\"\ntype = \"SPH\"\ndata = [0, 500, 1000, 300]\n\
        [[body]]\nname = \"shaft\"\ntype = \"RCC\"\ndata = [0, 500, -5, 0, 0, 900, 200]\n\
        [[weather]]\nname = \"drops\"\nis = \"+cloud -cut\"\nliquid_g_m3 = 0.5\n\
        [[weather]]\nname = \"snow\"\nis = \"+cut\"\nice_g_m3 = 0.5\ntemperature_k = 262\n\
        [[weather]]\nname = \"rain\"\nis = \"+shaft\"\nrain_mm_h = 20\n";
    let bank = banks(1, 30.0, "liquid_g_m3 = 0.2\ntemperature_k = 278");
    for surface in ["black", "metal"] {
        for air in ["", "vacuum = true"] {
            let own = if air.is_empty() { String::new() } else { "temperature_k = 281".into() };
            let weather = format!("{sky}{bank}").replace("liquid_g_m3 = 0.5", &format!("liquid_g_m3 = 0.5\n{own}"));
            let weather = weather.replace("rain_mm_h = 20", &format!("rain_mm_h = 20\n{own}"));
            let mixed = scene(&world(air, &format!("[ground]\nsurface = \"{surface}\"\n{weather}")));
            let cold = look(&mixed, [0.0, 0.0, 5.0], 0.0, 60.0);
            let still = mixed.isothermal(285.0).unwrap();
            let options = RenderOptions { antialias: 1, scale: Scale::RayleighJeans, ..RenderOptions::default() };
            let tracer = Tracer::new(&still, &[94e9], &options).unwrap();
            for pitch in [-80.0, -30.0, -4.0, 0.0, 2.0, 20.0, 45.0, 60.0, 75.0, 90.0] {
                let t = one(&tracer, [0.0, 0.0, 5.0], 0.0, pitch);
                assert!((t - rj(285.0)).abs() < 1e-9, "{surface} {air} {pitch} deg: {}", t - rj(285.0));
            }
            assert!((cold - rj(285.0)).abs() > 2.0, "the weather shows its own temperatures: {cold}");
        }
    }
}

#[test]
fn a_cloud_in_a_vacuum_obeys_the_law_of_absorption() {
    // A box of 100 m with a hole of 40 m, and a ball around half of it.
    let bodies = "[[body]]\nname = \"box\"\ntype = \"RPP\"\ndata = [-50, 50, 0, 100, -50, 50]\n\
        [[body]]\nname = \"hole\"\ntype = \"RPP\"\ndata = [-50, 50, 20, 60, -50, 50]\n\
        [[body]]\nname = \"ball\"\ntype = \"SPH\"\ndata = [0, 100, 0, 50]\n";
    let weather = "[[weather]]\nname = \"w\"\nis = \"+box -hole\"\nliquid_g_m3 = 2\ntemperature_k = 280\n\
        [[weather]]\nname = \"v\"\nis = \"+ball\"\nliquid_g_m3 = 1\ntemperature_k = 260\n\
        [[body]]\nname = \"far\"\ntype = \"SPH\"\ndata = [0, -900, 0, 1]\nsurface = \"black\"\n";
    let s = scene(&world("vacuum = true\nbackground_k = 10", &format!("{bodies}{weather}")));
    let per_m = |t: f64, g: f64| 1e-3 * NEPER_PER_DECIBEL * droplet_attenuation_liebe93(94.0, t, g).unwrap();
    let (a, b) = (per_m(280.0, 2.0), per_m(260.0, 1.0));
    // Along y from the south: 20 m of box, the hole to 60 m with the ball from 50 m, both to 100 m, the ball to 150 m.
    let parts = [(20.0, a, 0.0), (10.0, 0.0, b), (40.0, a, b), (50.0, 0.0, b)];
    let want = |parts: &[(f64, f64, f64)]| {
        let (mut sum, mut passed) = (0.0, 1.0);
        for (length, a, b) in parts {
            let tau = length * (a + b);
            let source = (a * rj(280.0) + b * rj(260.0)) / (a + b);
            sum += passed * (1.0 - (-tau).exp()) * source;
            passed *= (-tau).exp();
        }
        sum + passed * rj(10.0)
    };
    let north = look(&s, [0.0, -30.0, 0.0], 0.0, 0.0);
    assert!((north - want(&parts)).abs() < 1e-9, "{north} {}", want(&parts));
    let back: Vec<_> = parts.iter().rev().copied().collect();
    let south = look(&s, [0.0, 200.0, 0.0], 180.0, 0.0);
    // The ball behind the box hides the background.
    let mut behind = back.clone();
    behind.push((1e9, 1.0, 0.0));
    let hidden = want(&back) + (rj(300.0) - rj(10.0)) * back.iter().map(|(l, a, b)| -l * (a + b)).sum::<f64>().exp();
    assert!((south - hidden).abs() < 1e-9, "{south} {hidden}");
    // The camera in the middle of the last part sees the rest of it.
    let inside = look(&s, [0.0, 80.0, 0.0], 0.0, 0.0);
    let rest = want(&[(20.0, a, b), (50.0, 0.0, b)]);
    assert!((inside - rest).abs() < 1e-9, "{inside} {rest}");
    assert!((north - south).abs() > 5.0);
}

#[test]
fn a_bank_lies_between_the_clear_parts_of_a_leg() {
    // A horizontal ray: 2 km of air, 300 m of fog that is 25 K colder, 3 km of air, a black wall.
    let text = "[[body]]\nname = \"wall\"\ntype = \"RPP\"\ndata = [-50, 50, 5300, 5400, 0, 90]\nsurface = \"black\"\n\
        [[body]]\nname = \"bank\"\ntype = \"RPP\"\ndata = [-50, 50, 2000, 2300, 0, 90]\n\
        [[weather]]\nname = \"fog\"\nis = \"+bank\"\nliquid_g_m3 = 0.5\ntemperature_k = 270\n";
    let s = scene(&world("", text));
    let air = s.air.atmosphere.clone().unwrap();
    let table = PathTable::new(&air, &[94.0]).unwrap();
    let leg = |km: f64| table.radiation(0, &PathEnds::new(0.04, 0.04, PathExtent::LengthKm(km)).unwrap()).unwrap();
    let (near, within, far) = (leg(2.0), leg(0.3), leg(3.0));
    let water = 0.3 * NEPER_PER_DECIBEL * droplet_attenuation_liebe93(94.0, 270.0, 0.5).unwrap();
    let gas = within.tau_np;
    let own = within.emission / (1.0 - (-gas).exp());
    let source = (gas * own + water * black_body_radiance(94.0, 270.0)) / (gas + water);
    let passed = (-(gas + water)).exp();
    let behind = far.seen_before(black_body_radiance(94.0, 300.0));
    let want = rayleigh_jeans_temperature_k(94.0, near.seen_before((1.0 - passed) * source + passed * behind));
    let seen = look(&s, [0.0, 0.0, 40.0], 0.0, 0.0);
    assert!((seen - want).abs() < 1e-9, "{seen} {want}");
    let bare = look(&scene(&world("", &text.replace("[270.0]", "").replace("0.5", "1e-9"))), [0.0, 0.0, 40.0], 0.0, 0.0);
    assert!((bare - seen).abs() > 1.0);
}

#[test]
fn banks_that_overlap_add_their_absorption() {
    let ground = "[ground]\nsurface = \"black\"\n";
    let two = banks(1, 400.0, "liquid_g_m3 = 0.1\nrain_mm_h = 3")
        + &banks(1, 400.0, "liquid_g_m3 = 0.2").replace("\"b0\"", "\"c0\"").replace("\"w0\"", "\"v0\"").replace("+b0", "+c0");
    let one = banks(1, 400.0, "liquid_g_m3 = 0.3\nrain_mm_h = 3");
    for pitch in [5.0, 40.0, 90.0] {
        let [a, b] = [&two, &one].map(|w| look(&scene(&world("", &format!("{ground}{w}"))), [0.0, 0.0, 100.0], 0.0, pitch));
        assert!((a - b).abs() < 1e-9, "{pitch}: {a} {b}");
    }
}

#[test]
fn a_cloud_above_the_scene_is_seen_against_its_own_sky() {
    // A flat cloud from 1500 m to 1800 m, wide enough for a view of 60 degrees from the zenith: inside it the sky is that of a layer.
    let cloud = "[ground]\nsurface = \"metal\"\n[[body]]\nname = \"c\"\ntype = \"RCC\"\ndata = [0, 0, 1500, 0, 0, 300, 4000]\n\
        [[weather]]\nname = \"c\"\nis = \"+c\"\nliquid_g_m3 = 0.2\n";
    let patchy = scene(&world("", cloud));
    let ground = "[ground]\nsurface = \"metal\"\n";
    let overcast = scene(&world("layers = [\"cloud:1500m-1800m:0.2g/m3\"]", ground));
    let clear = scene(&world("", ground));
    for pitch in [90.0, 50.0, 30.0, -30.0, -75.0] {
        let [p, o, c] = [&patchy, &overcast, &clear].map(|s| look(s, [0.0, 0.0, 2.0], 70.0, pitch));
        assert!((p - o).abs() < 0.1 && (p - c).abs() > 5.0, "{pitch}: patchy {p}, overcast {o}, clear {c}");
    }
    // Lower rays pass below its rim.
    for pitch in [15.0, 5.0, -12.0] {
        let [p, c] = [&patchy, &clear].map(|s| look(s, [0.0, 0.0, 2.0], 70.0, pitch));
        assert!((p - c).abs() < 1e-9, "{pitch}: patchy {p}, clear {c}");
    }
}

#[test]
fn a_rough_sea_under_clouds_mirrors_them() {
    let sea = "[surface.sea]\nlayer = [{ material = \"sea-water\" }]\nroughness = \"sea:7\"\n[ground]\nsurface = \"sea\"\n";
    let cloud = "[[body]]\nname = \"c\"\ntype = \"RPP\"\ndata = [-2e6, 2e6, -2e6, 2e6, 800, 1000]\n\
        [[weather]]\nname = \"c\"\nis = \"+c\"\nliquid_g_m3 = 0.3\n";
    let overcast = scene(&world("layers = [\"cloud:800m-1000m:0.3g/m3\"]", sea));
    let patchy = scene(&world("", &format!("{sea}{cloud}")));
    let clear = scene(&world("", sea));
    let options = RenderOptions { antialias: 1, scale: Scale::RayleighJeans, highest_m: 30.0, ..RenderOptions::default() };
    let band = SpectralWindow::band(94e9, 1e9, 1).unwrap();
    let view = |s: &SolidScene| {
        let camera = Camera {
            position_m: [0.0, 0.0, 30.0],
            look_at_m: None,
            heading_deg: 20.0,
            pitch_deg: -50.0,
            roll_deg: 0.0,
            fov_deg: 2.0,
            size_px: [64, 64],
            projection: crate::camera::Projection::Sin,
        };
        let t = Tracer::new(s, &[94e9], &options).unwrap();
        t.picture(&View::of_camera(&camera).unwrap(), &band, None).unwrap().temperature.data
    };
    let [p, o, c] = [&patchy, &overcast, &clear].map(view);
    let n = p.len() as f64;
    let off = &p - &o;
    let mean = off.mean().unwrap();
    let error = (off.mapv(|d| (d - mean).powi(2)).sum() / (n * (n - 1.0))).sqrt();
    let change = (&o - &c).mean().unwrap();
    println!("cloud changes the sea by {change:.2} K; the facets are off by {mean:.3} +- {error:.3} K");
    // One facet a pixel: four standard errors, and the tables of facets (0.05 K).
    assert!(mean.abs() < 4.0 * error + 0.05 && change.abs() > 5.0, "{mean} {error} {change}");
}
