//! Scenes of solids by command: laws that anyone can check, the real-time mode, flights, conversions.

use crate::program::{Scratch, oracle};
use ndarray::Array2;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

fn shipped(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("phenomenology/scenes").join(format!("{name}.toml")).display().to_string()
}

/// A plane of a FITS image that the program wrote.
fn plane(path: &Path, chan: usize, pol: usize) -> Array2<f64> {
    cittert_formats::open_image(path).unwrap().plane(chan, pol).to_owned()
}

/// One number of the physics tables.
fn number(s: &Scratch, line: &str, column: &str) -> f64 {
    let out = s.ok(line).out;
    let row: BTreeMap<String, String> = csv::Reader::from_reader(out.as_bytes()).deserialize().next().unwrap().unwrap();
    row[column].parse().unwrap()
}

#[test]
fn every_scene_of_one_temperature_shows_it() {
    let s = Scratch::new();
    for name in ["airport", "runway-fog-4", "t-72", "ship", "security"] {
        let freq = if name == "ship" { "37GHz" } else { "94GHz" };
        let line = format!("scene render {} --freq {freq} --scene-size 40 --isothermal 283K -o {name}.fits", shipped(name));
        let said = s.json(&line);
        for key in ["min", "max"] {
            assert!((said[key].as_f64().unwrap() - 283.0).abs() < 1e-6, "{name} {key}: {said}");
        }
    }
}

#[test]
fn a_flat_sea_is_emissivity_and_sky_combined_by_hand() {
    let s = Scratch::new();
    // x B(T), x = h f / k: what adds up.
    let quantum_k = 6.626_070_15e-34 * 94e9 / 1.380_649e-23;
    let rj = |t: f64| quantum_k / ((quantum_k / t).exp() - 1.0);
    for angle in [0.0, 35.0, 53.1, 75.0, 88.0] {
        let toml = format!(
            "kind = \"solids\"\nname = \"sea\"\nground = {{ surface = \"sea\" }}\natmosphere = {{ profile = \"mls\" }}\n\
             camera = {{ position_m = [0, 0, 0.0001], pitch_deg = {}, fov_deg = 0.0001, size_px = [2, 2] }}\n\
             [surface.sea]\nlayer = [{{ material = \"sea-water\", temperature_k = 288.15 }}]\n",
            angle - 90.0
        );
        s.write("sea.toml", toml);
        s.ok("scene render sea.toml --freq 94GHz --pol XX,YY --scale rj -o sea.fits --overwrite");
        let sky = number(&s, &format!("scene sky --atmosphere mls --freq 94GHz --zenith {angle}deg"), "tb_rj_k");
        let surface = format!("scene emissivity --material sea-water --temperature 288.15K --freq 94GHz --angle {angle}deg");
        for (pol, name) in ["emissivity_h", "emissivity_v"].into_iter().enumerate() {
            let e = number(&s, &surface, name);
            let by_hand = e * rj(288.15) + (1.0 - e) * sky;
            let seen = plane(&s.path("sea.fits"), 0, pol)[[1, 1]];
            assert!((seen - by_hand).abs() < 0.01, "{angle} deg {name}: {seen} {by_hand}");
        }
    }
}

#[test]
fn a_mirror_shows_the_sky_of_the_reflected_angle() {
    let s = Scratch::new();
    // A metal plate is tilted by 25 degrees. Seen from the zenith, it shows the sky 50 degrees from the zenith.
    s.write(
        "mirror.toml",
        "kind = \"solids\"\nname = \"mirror\"\natmosphere = { profile = \"ussa\" }\n\
         camera = { position_m = [0, 0, 1], pitch_deg = -90, fov_deg = 0.01, size_px = [2, 2] }\n\
         [surface.metal]\nlayer = [{ eps = [1.0, 1e13], temperature_k = 290 }]\n\
         [assembly.plate]\nbody = [{ name = \"plate\", type = \"RPP\", data = [-1, 1, -1, 1, -0.1, 0], surface = \"metal\" }]\n\
         [[instance]]\nassembly = \"plate\"\nrotate_deg = [25, 0, 0]\n",
    );
    let seen = s.json("scene render mirror.toml -o mirror.fits");
    let sky = number(&s, "scene sky --atmosphere ussa --freq 94GHz --zenith 50deg", "tb_planck_k");
    assert!((seen["mean"].as_f64().unwrap() - sky).abs() < 0.05, "{seen} {sky}");
}

#[test]
fn a_dihedral_with_its_crease_at_45_degrees_swaps_h_and_v() {
    let s = Scratch::new();
    let scene = |crease: f64| {
        // Beside the crease, so that one ray meets both mirrors on its way to the roof, whose emission is polarised.
        let (sin, cos) = crease.to_radians().sin_cos();
        let (x, y) = (1.3 * cos - 2.0 * sin, 1.3 * sin + 2.0 * cos);
        format!(
            "kind = \"solids\"\nname = \"dihedral\"\natmosphere = {{ vacuum = true }}\n\
             camera = {{ position_m = [{x}, {y}, 20], pitch_deg = -90, size_px = [2, 2], fov_deg = 0.01 }}\n\
             [surface.mirror]\nlayer = [{{ eps = [1.0, 1e12], temperature_k = 1 }}]\n[surface.glow]\nlayer = [{{ eps = [4.0, 0.0], temperature_k = 300 }}]\n\
             [assembly.pair]\nbody = [\n\
             {{ name = \"a\", type = \"BOX\", data = [0, 0, 0, 5, 0, 5, 0, 4, 0, 1, 0, -1], surface = \"mirror\" }},\n\
             {{ name = \"b\", type = \"BOX\", data = [0, 0, 0, -5, 0, 5, 0, 4, 0, -1, 0, -1], surface = \"mirror\" }},\n]\n\
             [[instance]]\nassembly = \"pair\"\nrotate_deg = [0, 0, {crease}]\n\
             [[body]]\nname = \"roof\"\ntype = \"BOX\"\ndata = [-50, -3, 30, 100, 0, 0, 0, 60, 60, 0, -0.5, 0.5]\nsurface = \"glow\"\n"
        )
    };
    let seen = |crease: f64| {
        s.write("d.toml", scene(crease));
        s.ok("scene render d.toml --pol XX,YY --scale rj --antialias 1 -o d.fits --overwrite");
        [0, 1].map(|pol| plane(&s.path("d.fits"), 0, pol)[[1, 1]])
    };
    let (plain, turned) = (seen(0.0), seen(45.0));
    assert!((plain[0] - plain[1]).abs() > 5.0, "{plain:?}");
    assert!((turned[0] - plain[1]).abs() < 0.05 && (turned[1] - plain[0]).abs() < 0.05, "{plain:?} became {turned:?}");
}

#[test]
fn channels_and_stokes_planes_make_a_cube_and_simulate_takes_it() {
    let s = Scratch::new();
    // The models of concrete and glass end at 100 GHz.
    let scene = shipped("bmp-1");
    s.ok(&format!("scene render {scene} --scene-size 24 --bandwidth 18GHz --channels 3 --pol I,Q,U,V -o cube.fits"));
    let cube = cittert_formats::open_image(&s.path("cube.fits")).unwrap();
    assert_eq!(cube.data.shape(), [3, 4, 24, 24]);
    let mean = |c: usize| cube.plane(c, 0).mean().unwrap();
    // The temperature of a cold sky increases with frequency near 100 GHz and above.
    assert!(mean(2) > mean(0) + 0.5, "{} {}", mean(0), mean(2));
    assert!(cube.plane(1, 1).iter().any(|q| q.abs() > 5.0));
    let line =
        format!("simulate --layout mm-ring --scene {scene} --scene-size 24 --freq 94GHz --bandwidth 18GHz --channels 3 --epsilon 1e-4");
    s.ok(&format!("{line} --scene-channels -o own.uvh5"));
    s.ok(&format!("{line} -o one.uvh5"));
    s.ok("scene render {} -o x.fits".replace("{}", &format!("{scene} --scene-size 24 --bandwidth 18GHz --channels 3")).as_str());
    s.ok("simulate --layout mm-ring --scene x.fits --freq 94GHz --bandwidth 18GHz --channels 3 --epsilon 1e-4 -o cube.uvh5");
    let amplitude = |name: &str| s.json(&format!("info {name}"))["mean_abs_unflagged"]["I"].as_f64().unwrap();
    let (own, one, cube) = (amplitude("own.uvh5"), amplitude("one.uvh5"), amplitude("cube.uvh5"));
    assert!((own / cube - 1.0).abs() < 1e-3, "{own} {cube}");
    assert!((own / one - 1.0).abs() > 1e-3, "{own} {one}");
}

#[test]
fn the_picture_is_the_same_to_the_bit_for_any_number_of_threads() {
    let s = Scratch::new();
    for threads in [1, 2, 3] {
        s.ok(&format!("--threads {threads} scene render {} --scene-size 64 -o t{threads}.fits", shipped("airport")));
        s.ok(&format!("--threads {threads} scene render {} --scene-size 64 --mode realtime -o r{threads}.fits", shipped("airport")));
    }
    for kind in ["t", "r"] {
        let one = plane(&s.path(&format!("{kind}1.fits")), 0, 0);
        for threads in [2, 3] {
            let other = plane(&s.path(&format!("{kind}{threads}.fits")), 0, 0);
            assert!(one.iter().zip(&other).all(|(a, b)| a.to_bits() == b.to_bits()), "{kind}{threads}");
        }
    }
}

#[test]
fn the_real_time_mode_tells_its_error() {
    let s = Scratch::new();
    let line = format!("scene render {} --scene-size 192 --mode realtime --error-map e.fits -o f.fits", shipped("runway-fog-3"));
    let said = s.json(&line);
    let rms = said["error_rms_k"].as_f64().unwrap();
    assert!(rms > 0.0 && rms < 3.0, "{said}");
    assert!(said["table_error_k"].as_f64().unwrap() < 0.1);
    let map = plane(&s.path("e.fits"), 0, 0);
    assert!(((map.iter().map(|d| d * d).sum::<f64>() / map.len() as f64).sqrt() - rms).abs() < 1e-6);
    s.fails(&format!("scene render {} --error-map e.fits -o g.fits", shipped("t-72")), 1, &["exists already"]);
    s.fails(&format!("scene render {} --error-map n.fits -o g.fits", shipped("t-72")), 2, &["--mode realtime"]);
    s.fails(&format!("scene render {} --mode realtime --pol XX,YY -o g.fits", shipped("t-72")), 2, &["one plane"]);
}

#[test]
fn a_flight_leaves_frames_and_tells_their_rate() {
    let s = Scratch::new();
    s.write(
        "path.toml",
        "frames_per_second = 4\n[[key]]\ntime_s = 0\nposition_m = [12, -9, 5]\nlook_at_m = [0, 0, 1]\n\
         [[key]]\ntime_s = 0.5\nposition_m = [9, -12, 5]\nlook_at_m = [0, 0, 1]\n",
    );
    let said = s.json(&format!("scene fly path.toml --scene {} --size 48 --no-video -o frames", shipped("t-72")));
    assert_eq!(said["frames"], 3);
    assert!(said["frames_per_second"].as_f64().unwrap() > 0.5, "{said}");
    for name in ["frame-00000.png", "frame-00002.png", "flight.json"] {
        assert!(s.path("frames").join(name).is_file(), "{name}");
    }
    // Frames are made at once, in any number of threads, and come in order.
    for threads in [1, 3] {
        s.ok(&format!("--threads {threads} scene fly path.toml --scene {} --size 48 --no-video -o f{threads}", shipped("t-72")));
        for name in ["frame-00000.png", "frame-00001.png", "frame-00002.png"] {
            let read = |folder: &str| std::fs::read(s.path(folder).join(name)).unwrap();
            assert!(read("frames") == read(&format!("f{threads}")), "{threads} threads: {name}");
        }
    }
    assert_ne!(
        std::fs::read(s.path("frames").join("frame-00000.png")).unwrap(),
        std::fs::read(s.path("frames").join("frame-00002.png")).unwrap()
    );
    s.fails("scene fly path.toml -o other", 2, &["names no scene"]);
    let line = format!("scene fly path.toml --scene {} --size 48 -o frames", shipped("t-72"));
    s.fails(&line, 1, &["frames"]);
    let into = std::fs::read_to_string(s.path("path.toml")).unwrap().replace("[9, -12, 5]", "[0, 0.1, 1]");
    s.write("into.toml", into);
    s.fails(&format!("scene fly into.toml --scene {} -o other", shipped("t-72")), 1, &["frame 2", "inside region"]);
}

#[test]
fn solids_are_converted_both_ways() {
    let s = Scratch::new();
    let tank = shipped("t-72");
    s.ok(&format!("scene convert {tank} tank.txt"));
    s.ok("scene convert tank.txt again.toml");
    s.ok("scene convert again.toml again.txt");
    let read = |name: &str| std::fs::read_to_string(s.path(name)).unwrap();
    assert_eq!(read("tank.txt"), read("again.txt"));
    s.ok(&format!("scene convert {tank} copy.toml"));
    s.ok("scene render copy.toml --scene-size 32 -o copy.fits");
    s.ok(&format!("scene render {tank} --scene-size 32 -o tank.fits"));
    assert_eq!(plane(&s.path("copy.fits"), 0, 0), plane(&s.path("tank.fits"), 0, 0));
    let rays = "ox,oy,oz,dx,dy,dz\n10,-9,5,-1,0.9,-0.4\n0,0,20,0,0,-1\n0.5,-8,1,0,1,0\n";
    s.write("rays.csv", rays);
    let hits = |file: &str| s.ok(&format!("scene probe {file} --rays rays.csv")).out;
    assert_eq!(hits("tank.txt"), hits("again.toml"));
    s.fails("scene convert tank.txt again.toml", 1, &["exists already"]);
}

#[test]
fn the_schema_names_the_keys_and_is_the_stored_one() {
    let s = Scratch::new();
    let text = s.ok("scene schema").out;
    let schema: serde_json::Value = serde_json::from_str(&text).unwrap();
    for key in ["kind", "camera", "atmosphere", "ground", "surface", "body", "region", "assembly", "instance"] {
        assert!(schema["properties"][key].is_object(), "{key}");
    }
    let stored = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/formats/scene.schema.json");
    let stored = std::fs::read_to_string(stored).unwrap();
    assert_eq!(text.trim(), stored.trim(), "write it anew: cittert scene schema > docs/formats/scene.schema.json");
}

#[test]
fn terrain_takes_pictures_for_surfaces_and_heights() {
    let s = Scratch::new();
    // Left half black (water), right half white (soil); heights rise from 0 to 10 m towards the north.
    let png = |f: &dyn Fn(u32, u32) -> u8| {
        let picture = image::GrayImage::from_fn(20, 20, |x, y| image::Luma([f(x, y)]));
        let mut bytes = std::io::Cursor::new(Vec::new());
        picture.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
        bytes.into_inner()
    };
    s.write("kinds.png", png(&|x, _| if x < 10 { 0 } else { 255 }));
    s.write("heights.png", png(&|_, y| (255.0 * (19 - y) as f64 / 19.0).round() as u8));
    let scene = "kind = \"solids\"\nname = \"hill\"\ncamera = { position_m = [0, 0, 200], pitch_deg = -90, fov_deg = 5, size_px = [16, 16] }\n\
        [surface.soil]\nlayer = [{ material = \"soil\" }]\n[surface.water]\nlayer = [{ material = \"water\" }]\n\
        [ground]\nsurface = \"soil\"\nmap = { origin_m = [-10, -10], cell_m = 1, image = \"kinds.png\", grey = { 0 = \"water\" } }\n\
        height_field = { origin_m = [-10, -10], cell_m = 1, image = \"heights.png\", low_m = 0, high_m = 9.5 }\n";
    s.write("hill.toml", scene);
    s.ok("scene render hill.toml -o hill.fits --material kind.fits --range range.fits");
    let kind = plane(&s.path("kind.fits"), 0, 0);
    assert_eq!((kind[[8, 2]], kind[[8, 13]]), (2.0, 1.0));
    let range = plane(&s.path("range.fits"), 0, 0);
    assert!((range[[2, 8]] - range[[14, 8]] - 6.5).abs() < 0.6, "{} {}", range[[2, 8]], range[[14, 8]]);
    s.write("bad.toml", scene.replace("heights.png", "missing.png"));
    s.fails("scene render bad.toml -o x.fits", 1, &["bad.toml", "line 11", "missing.png"]);
}

#[test]
fn the_oracle_is_met_by_command() {
    let (bodies, rays) = (oracle("csg_bodies_regions.txt"), oracle("csg_rays_povray.csv"));
    // Each region separately, as in the oracle.
    let mut by_region: BTreeMap<String, Vec<csv::StringRecord>> = BTreeMap::new();
    let mut reader = csv::Reader::from_path(&rays).unwrap();
    let head = reader.headers().unwrap().clone();
    let column = |name: &str| head.iter().position(|h| h == name).unwrap();
    for row in reader.records().map(Result::unwrap) {
        by_region.entry(row[column("region")].to_owned()).or_default().push(row);
    }
    let s = Scratch::new();
    let (mut total, mut agree) = (0, 0);
    for (region, rows) in by_region.iter().take(3) {
        let path: PathBuf = s.path("rays.csv");
        let mut writer = csv::Writer::from_path(&path).unwrap();
        writer.write_record(&head).unwrap();
        rows.iter().for_each(|r| writer.write_record(r).unwrap());
        writer.flush().unwrap();
        let out = s.ok(&format!("scene probe {} --region {region} --rays rays.csv", bodies.display())).out;
        let answers: Vec<BTreeMap<String, String>> = csv::Reader::from_reader(out.as_bytes()).deserialize().map(Result::unwrap).collect();
        for (row, answer) in rows.iter().zip(&answers) {
            total += 1;
            agree += usize::from(row[column("hit")] == answer["hit"]);
            if answer["hit"] == "1" && &row[column("hit")] == "1" {
                let t: f64 = row[column("t")].parse().unwrap();
                assert!((answer["t"].parse::<f64>().unwrap() - t).abs() < 1e-6 * t.max(1.0), "{region} {row:?} {answer:?}");
            }
        }
    }
    assert!(total > 100 && agree as f64 >= 0.998 * total as f64, "{agree} of {total}");
}

#[test]
fn the_error_of_models_outside_their_range_is_named_mapped_and_drawn() {
    let s = Scratch::new();
    s.write(
        "road.toml",
        r#"
kind = "solids"
name = "road"
freq_hz = 94e9
extrapolate = true
camera = { position_m = [0, 0, 20], pitch_deg = -90, size_px = [16, 16], fov_deg = 10 }
atmosphere = { vacuum = true, background_k = 10 }
[surface.asphalt]
layer = [{ material = "asphalt", temperature_k = 300 }]
[ground]
surface = "asphalt"
"#,
    );
    let out = s.ok("scene render road.toml -o road.fits");
    assert!(
        out.err.contains("asphalt is used at 94GHz, outside the range of its model p2040") && out.err.contains("--model-error"),
        "{}",
        out.err
    );
    let json = s.json("scene render road.toml -o road.fits --overwrite --model-error error.fits");
    assert_eq!(json["model_error"][0]["material"], "asphalt");
    let rms = json["model_error_rms_k"].as_f64().unwrap();
    assert!((6.0..6.5).contains(&rms), "{rms}");
    assert!(s.path("error.png").exists());
    let info = s.json("info error.fits");
    assert!(info.to_string().contains("error by models of permittivity outside of their range"), "{info}");
    // Within the range there is nothing to tell.
    let out = s.ok("scene render road.toml --freq 30GHz -o low.fits --model-error none.fits");
    assert!(!out.err.contains("outside the range") && out.err.contains("described for 94GHz"), "{}", out.err);
    assert!(out.out.contains("models outside of their range: 0.000 K rms"), "{}", out.out);
    s.fails("scene render road.toml -o x.fits --mode realtime --model-error e.fits", 2, &["--mode full"]);
}

#[test]
fn a_scene_is_drawn_in_grey_and_by_cause() {
    let s = Scratch::new();
    let scene = shipped("bmp-1");
    s.ok(&format!("scene render {scene} --scene-size 48 -o t.fits --picture t.png --causes c.png"));
    let grey = image::open(s.path("t.png")).unwrap().into_luma8();
    assert_eq!(grey.dimensions(), (48, 48));
    let (dark, light) = (grey.pixels().filter(|p| p.0[0] < 64).count(), grey.pixels().filter(|p| p.0[0] > 192).count());
    assert!(dark > 100 && light > 100, "{dark} dark and {light} light pixels");
    // The row on top is sky, which is blue; the vehicle emits almost nothing itself, and the ground much.
    let colours = image::open(s.path("c.png")).unwrap().into_rgb8();
    assert!((0..48).all(|x| colours.get_pixel(x, 0).0[..2] == [0, 0] && colours.get_pixel(x, 0).0[2] > 0));
    assert!(colours.pixels().any(|p| p.0[0] > 200) && colours.pixels().any(|p| p.0[1] > 100 && p.0[0] < 60));
    s.ok(&format!("scene render {scene} --scene-size 48 --stretch rank -o r.fits --picture r.png"));
    assert!(image::open(s.path("r.png")).unwrap().into_luma8() != grey);
    s.fails(&format!("scene render {scene} --scene-size 48 -o u.fits --picture t.png"), 1, &["exists already"]);
    s.fails(&format!("scene render {scene} --scene-size 48 --mode realtime -o u.fits --causes u.png"), 2, &["drawings"]);
}
