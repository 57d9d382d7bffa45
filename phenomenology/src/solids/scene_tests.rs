//! Reading, writing and refusing scenes.

use super::*;
use crate::geometry::probe::{PointRow, RayRow};
use std::error::Error;

const TANK: &str = r#"
kind = "solids"
name = "two tanks"
[camera]
position_m = [0, -30, 4]
look_at_m = [0, 0, 1]
[surface.steel]
layer = [{ material = "steel", temperature_k = 295 }]
[surface.soil]
layer = [{ material = "soil" }]
[ground]
surface = "soil"
[assembly.tank]
body = [
  { name = "hull", type = "RPP", data = [-3, 3, -1.5, 1.5, 0.4, 1.2], surface = "steel" },
  { name = "turret", type = "TRC", data = [0, 0, 1.2, 0, 0, 0.8, 1.2, 0.9] },
  { name = "hatch", type = "RCC", data = [0, 0, 1.8, 0, 0, 1, 0.3] },
]
region = [{ name = "top", is = "+turret -hatch", surface = "steel", face = [{ body = "hatch", temperature_k = 310 }] }]
[[instance]]
assembly = "tank"
position_m = [-5, 0, 0]
[[instance]]
assembly = "tank"
name = "second"
position_m = [5, 2, 0]
rotate_deg = [0, 0, 90]
"#;

fn fault(text: &str) -> String {
    let error = SolidScene::from_toml(text).err().unwrap_or_else(|| panic!("accepted:\n{text}"));
    let mut message = error.to_string();
    let mut source = error.source();
    while let Some(s) = source {
        message = format!("{message}: {s}");
        source = s.source();
    }
    message
}

fn row(ox: f64, oy: f64, oz: f64) -> RayRow {
    RayRow { ox, oy, oz, dx: 0.0, dy: 0.0, dz: -1.0 }
}

#[test]
fn a_yard_of_thousands_is_read_in_no_time() {
    let mut text = String::from("kind = \"solids\"\nname = \"yard\"\n[surface.s]\nlayer = [{ material = \"steel\" }]\n");
    for k in 0..20_000 {
        text += &format!("[[body]]\nname = \"b{k}\"\ntype = \"SPH\"\ndata = [{k}, 0, 0, 0.4]\nsurface = \"s\"\n");
    }
    let started = std::time::Instant::now();
    let scene = SolidScene::from_toml(&text).unwrap();
    assert_eq!(scene.geometry().bodies()[19_999].line, 5 + 5 * 19_999);
    // If the lines are counted again for every body, reading takes a hundred times as long.
    assert!(started.elapsed().as_secs() < 20);
}

#[test]
fn instances_stand_where_they_are_placed() {
    let scene = SolidScene::from_toml(TANK).unwrap();
    let answers = scene.probe_rays(None, &[row(-5.0, 0.0, 9.0), row(5.0, 4.5, 9.0), row(0.0, 0.0, 9.0), row(-5.0, 0.9, 9.0)]).unwrap();
    let name = |i: usize| answers[i].region.as_deref().unwrap();
    assert_eq!((name(0), answers[0].t, answers[0].body.as_deref()), ("tank_1.top", Some(7.2), Some("tank_1.hatch")));
    assert_eq!(name(1), "second.hull");
    assert!((answers[1].t.unwrap() - 7.8).abs() < 1e-12);
    assert_eq!((name(2), answers[2].t), ("ground", Some(9.0)));
    assert_eq!((name(3), answers[3].t), ("tank_1.top", Some(7.0)));
    // The rim of the hatch has its own temperature.
    let g = scene.geometry();
    let body = |n: &str| g.bodies().iter().position(|b| b.name == n).unwrap() as u32;
    let region = g.region_index("tank_1.top").unwrap() as u32;
    let cover = |b: &str, face: u8| &scene.covers.list()[scene.covers.of_face(region, body(b), face).unwrap() as usize];
    assert_eq!(cover("tank_1.hatch", 1).temperature_k, Some(310.0));
    assert_eq!(cover("tank_1.turret", 1).temperature_k, None);
}

#[test]
fn toml_and_text_round_trip() {
    let scene = SolidScene::from_toml(TANK).unwrap();
    let again = SolidScene::from_toml(&scene.to_toml().unwrap()).unwrap();
    assert_eq!(again.geometry().bodies().len(), 6);
    assert_eq!(again.to_text(), scene.to_text());
    let Probed::Bare(bare) = read_probe_with(&scene.to_text(), &|name| panic!("the text names no picture {name}")).unwrap() else {
        panic!("the text was not seen as text")
    };
    let p = PointRow { x: 5.0, y: 4.5, z: 1.0 };
    assert_eq!(bare.probe_points(None, &[p]).unwrap()[0].region.as_deref(), Some("second.hull"));
    let model = crate::geometry::read_text(&scene.to_text(), 1).unwrap();
    let rows = SceneFile::of_text("tanks", &model).to_toml().unwrap();
    assert_eq!(read_geometry(&rows).unwrap().regions().len(), 4);
}

#[test]
fn text_inside_toml_keeps_its_lines() {
    let text = "kind = \"solids\"\nname = \"t\"\nbodies_and_regions = \"\"\"\n1 SPH 0 0 1 1\nREGION a ; +1 ; steel\n\"\"\"\n\
        [surface.steel]\nlayer = [{ material = \"steel\" }]\n";
    assert_eq!(SolidScene::from_toml(text).unwrap().geometry().regions()[0].source.line, 5);
    assert!(fault(&text.replace("1 1\n", "1 0\n")).starts_with("line 4: body `1`: radius R of the SPH is 0 m"));
}

#[test]
fn every_fault_is_one_message_with_its_line() {
    let change = |from: &str, to: &str| {
        assert!(TANK.contains(from), "{from}");
        fault(&TANK.replace(from, to))
    };
    for (from, to, part) in [
        ("+turret -hatch", "+turret -hatsh", "line 19: region `tank_1.top` names unknown body `tank_1.hatsh`"),
        ("0.8, 1.2, 0.9]", "0.8, 0, 0]", "line 16: body `tank_1.turret`: radius R1 of the TRC is 0 m"),
        ("\"+turret -hatch\"", "\"\"", "line 19: region `tank_1.top` names no body"),
        (", surface = \"steel\", face", ", face", "line 19: region `tank_1.top` has no material"),
        ("surface = \"soil\"\n", "surface = \"sand\"\n", "line 11: the ground uses unknown surface `sand`; known surfaces: soil, steel"),
        ("material = \"soil\"", "material = \"soup\"", "surface `soil`: layer 1 (line 10): unknown material `soup`"),
        ("[0, -30, 4]", "[-5, 0, 1]", "line 4: the camera at [-5.0, 0.0, 1.0] m lies inside region `tank_1.hull`"),
        ("[0, -30, 4]", "[0, -30, -4]", "line 4: the camera at [0.0, -30.0, -4.0] m lies under the ground, which is at 0 m there"),
        ("assembly = \"tank\"\nname", "assembly = \"tonk\"\nname", "instance of unknown assembly `tonk`; known assemblies: tank"),
        ("rotate_deg", "rotation_deg", "line 27"),
        ("type = \"RPP\"", "type = \"CUBE\"", "line 15: body `tank_1.hull`: unknown body type `CUBE`"),
        ("look_at_m = [0, 0, 1]", "fov_deg = 0", "line 4: fov_deg of [camera] is 0"),
        ("name = \"second\"", "scale = 0", "line 23: instance of `tank`: scale is 0"),
        ("temperature_k = 310", "temperature_k = -3", "temperature_k of region `tank_1.top` is -3"),
        ("body = \"hatch\"", "body = \"hatch\", face = 7", "body `tank_1.hatch` has faces 1 to 3, not 7"),
    ] {
        let message = change(from, to);
        assert!(message.contains(part), "{message}\nwanted {part}");
    }
    assert!(fault("kind = \"solids\"\nname = \"x\"\n").contains("the scene is empty"));
    let text = "kind = \"solids\"\nname = \"t\"\n[surface.m]\nlayer = [{ material = \"steel\" }]\n\
        [[body]]\nname = \"b\"\ntype = \"BOX\"\ndata = [0,0,0, 1,0,0, 0,0,0, 0,0,1]\nsurface = \"m\"\n";
    assert!(fault(text).contains("line 5: body `b`: the BOX is singular: H2 has length 0 m"), "{}", fault(text));
    let nested = "kind = \"solids\"\nname = \"t\"\n[assembly.a]\ninstance = [{ assembly = \"a\" }]\n[[instance]]\nassembly = \"a\"\n";
    assert!(fault(nested).contains("does it hold itself"));
}

#[test]
fn maps_and_height_fields_are_read() {
    let text = "kind = \"solids\"\nname = \"hills\"\n[surface.soil]\nlayer = [{ material = \"soil\" }]\n[surface.water]\nlayer = [{ material = \"water\" }]\n\
        [ground]\nsurface = \"soil\"\nmap = { origin_m = [0, 0], cell_m = 5, rows = [\"w.\", \".w\"], legend = { w = \"water\" } }\n\
        height_field = { origin_m = [0, 0], cell_m = 5, rows_m = [[4, 4, 4], [2, 2, 2], [0, 0, 0]] }\n";
    let scene = SolidScene::from_toml(text).unwrap();
    let ground = scene.terrain.as_ref().unwrap();
    assert_eq!(ground.height_m(5.0, 7.5), 3.0);
    assert_eq!(scene.covers.name(ground.cover(1.0, 9.0)), "water");
    assert_eq!(scene.covers.name(ground.cover(9.0, 9.0)), "soil");
    assert!(fault(&text.replace("\"w.\"", "\"x.\"")).contains("the map has `x`"));
    assert!(fault(&text.replace("[2, 2, 2]", "[2, 2]")).contains("the height field needs"));
}

#[test]
fn the_scenes_that_ship_are_read_and_written() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes");
    let mut count = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let scene = SolidScene::from_toml(&std::fs::read_to_string(&path).unwrap()).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        assert!(scene.geometry().bodies().len() > 30 && scene.camera().is_ok(), "{}", path.display());
        assert!(crate::geometry::read_text(&scene.to_text(), 1).is_ok());
        count += 1;
    }
    assert!(count >= 10, "{count} scenes");
}

/// The box around the bodies whose names pass a test.
fn extent(scene: &SolidScene, wanted: impl Fn(&str) -> bool) -> crate::space::Bounds {
    let bodies = scene.geometry().bodies().iter().filter(|b| wanted(&b.name));
    bodies.fold(crate::space::Bounds::EMPTY, |all, b| all.union(b.body.solid.bounds()))
}

#[test]
fn the_vehicles_have_their_published_dimensions() {
    let read = |name: &str| {
        let path = format!("{}/scenes/{name}.toml", env!("CARGO_MANIFEST_DIR"));
        SolidScene::from_toml(&std::fs::read_to_string(path).unwrap()).unwrap()
    };
    let near = |what: &str, got: f64, want: f64| assert!((got - want).abs() < 0.03, "{what}: {got} m, published {want} m");
    // Wikipedia, "T-72": hull 6.95 m, 9.53 m with the gun forward, 3.59 m wide, clearance 0.49 m.
    let tank = read("t-72");
    let outside = ["drum", "log", "bracket"];
    let hull = extent(&tank, |n| n.starts_with("t72.hull.") && !outside.iter().any(|o| n.contains(o)));
    near("hull of the T-72", hull.size().x, 6.95);
    near("T-72 with its gun", extent(&tank, |n| n.ends_with(".barrel")).max.x - hull.min.x, 9.53);
    near("width of the T-72", hull.size().y, 3.59);
    near("clearance of the T-72", extent(&tank, |n| n.ends_with(".tub")).min.z, 0.49);
    assert_eq!(tank.geometry().bodies().iter().filter(|b| b.name.contains(".left.tyre_")).count(), 6);
    // Wikipedia, "BMP-1": 6.735 m long, 2.94 m wide, 1.881 m to the turret roof, 2.068 m in all, clearance 0.37 m.
    let bmp = read("bmp-1");
    let all = bmp.geometry().bounds();
    near("length of the BMP-1", all.size().x, 6.735);
    near("width of the BMP-1", all.size().y, 2.94);
    near("height of the BMP-1", all.max.z, 2.068);
    near("turret of the BMP-1", extent(&bmp, |n| n.ends_with("turret.roof")).max.z, 1.881);
    near("clearance of the BMP-1", extent(&bmp, |n| n.ends_with(".tub")).min.z, 0.37);
}

#[test]
fn the_example_of_the_book_is_a_scene() {
    let page = include_str!("../../../docs/formats/scene.md");
    let example = page.split("```toml\n").nth(1).unwrap().split("```").next().unwrap();
    assert_eq!(SolidScene::from_toml(example).unwrap().geometry().bodies().len(), 6);
}

mod hostile {
    use super::TANK;
    use crate::solids::{SolidScene, read_probe_with};
    use proptest::prelude::*;

    const WEATHER: &str = "kind = \"solids\"\nname = \"c\"\n[surface.s]\nlayer = [{ material = \"soil\" }]\n[ground]\nsurface = \"s\"\n\
        [[body]]\nname = \"a\"\ntype = \"ELL\"\ndata = [-50, 0, 800, 50, 0, 800, 140]\n[[body]]\nname = \"b\"\ntype = \"SPH\"\ndata = [40, 0, 810, 60]\n\
        [[weather]]\nname = \"w\"\nis = \"+a -b OR +b\"\nliquid_g_m3 = 0.3\nrain_mm_h = 2\ntemperature_k = 280\n";

    const TEXT: &str =
        "1 RPP 0 4 0 4 0 4\nRCC bore 2 2 -1 0 0 6 1\n3 ELL 0 0 0 1 0 0 3\nREGION body ; +1 -bore OR +3 ; steel\nREGION ball ; +3\n";

    proptest! {
        // Any damage to a file is read or refused, and never ends in a panic.
        #[test]
        fn damaged_files_are_read_or_refused(cuts in proptest::collection::vec((0usize..2000, "[ -~\n\u{e9}]{0,4}"), 1..4)) {
            for original in [TANK, TEXT, WEATHER] {
                let mut text = original.to_owned();
                for (at, put) in &cuts {
                    let at = at % text.len();
                    if text.is_char_boundary(at) && text.is_char_boundary((at + put.len()).min(text.len())) {
                        text.replace_range(at..(at + put.len()).min(text.len()), put);
                    }
                }
                if let Err(e) = read_probe_with(&text, &|_| Err("no pictures here".into())) {
                    prop_assert!(!e.to_string().is_empty());
                }
            }
        }

        #[test]
        fn wild_numbers_are_read_or_refused(n in prop_oneof![Just("nan"), Just("inf"), Just("-inf"), Just("1e308"), Just("-1e308"), Just("0"), Just("-1"), Just("1e-320")],
            which in 0usize..60, weather in proptest::bool::ANY) {
            // The number with this index is replaced.
            let mut seen = 0;
            let mut text = String::new();
            let original = if weather { WEATHER } else { TANK };
            for word in original.split_inclusive([' ', ',', '[', ']', '\n', '}']) {
                let bare = word.trim_end_matches([' ', ',', '[', ']', '\n', '}']);
                if bare.parse::<f64>().is_ok() {
                    text.push_str(if seen == which { n } else { bare });
                    text.push_str(&word[bare.len()..]);
                    seen += 1;
                } else {
                    text.push_str(word);
                }
            }
            if let Ok(scene) = SolidScene::from_toml(&text) {
                let ray = crate::geometry::probe::RayRow { ox: 0.0, oy: -30.0, oz: 4.0, dx: 0.1, dy: 1.0, dz: -0.1 };
                let answer = scene.probe_rays(None, &[ray]).unwrap();
                prop_assert!(answer[0].t.is_none_or(|t| t > 0.0));
            }
        }
    }
}
