//! `layout compare`: layouts side by side.

use crate::program::Scratch;
use serde_json::Value;

/// Three layouts of one aperture.
fn made() -> Scratch {
    let s = Scratch::new();
    for kind in ["ring", "reuleaux", "fermat"] {
        s.ok(&format!("layout make {kind} --elements 15 --aperture 0.3m --diameter 10mm --tsys 600K -o {kind}.toml"));
    }
    s
}

fn read(s: &Scratch, file: &str) -> Value {
    serde_json::from_slice(&std::fs::read(s.path(file)).unwrap()).unwrap()
}

const SCENE: &str = "kind = \"analytic\"\nname = \"disc\"\nbackground = { temperature_k = 270.0 }\n[[shape]]\ntype = \"ellipse\"\ncenter_deg = [1.0, 0.5]\nsize_deg = [1.5, 1.0]\ntemperature_k = 120.0\n";

#[test]
fn the_figures_are_those_of_show_and_the_lowest_side_lobe_wins() {
    let s = made();
    let printed = s.json("layout compare ring.toml reuleaux.toml fermat.toml mm-y --freq 94GHz -o d");
    let found = read(&s, "d/comparison.json");
    assert_eq!(printed, found);
    let names: Vec<&str> = found["layouts"].as_array().unwrap().iter().map(|l| l["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["ring", "reuleaux", "fermat", "mm-y"]);
    // The u-v cell is common to all layouts: here the element of the widest one.
    let cell = found["layouts"][0]["uv_fill_cell_m"].as_f64().unwrap();
    for (layout, file) in found["layouts"].as_array().unwrap().iter().zip(["ring.toml", "reuleaux.toml", "fermat.toml", "mm-y"]) {
        let shown = s.json(&format!("layout show {file} --freq 94GHz --uv-cell {cell}m"));
        for key in ["psl_within_db", "bmaj_rad", "uv_fill", "redundancy", "cable_m", "longest_m", "half_power_equivalent_rad"] {
            assert_eq!(layout[key], shown[key], "{file}: {key}");
        }
    }
    // Ranked are those whose beam is at most 20 per cent wider than the narrowest, by their peak side lobe.
    let layout = |name: &str| found["layouts"].as_array().unwrap().iter().find(|l| l["name"] == name).unwrap();
    let number = |name: &str, key: &str| layout(name)[key].as_f64().unwrap();
    let ranking: Vec<&str> = found["ranking"].as_array().unwrap().iter().map(|n| n.as_str().unwrap()).collect();
    let narrowest = names.iter().map(|n| number(n, "half_power_equivalent_rad")).fold(f64::INFINITY, f64::min);
    for name in &names {
        assert_eq!(ranking.contains(name), number(name, "half_power_equivalent_rad") <= 1.2 * narrowest, "{name}");
    }
    assert!(ranking.windows(2).all(|w| number(w[0], "psl_within_db") <= number(w[1], "psl_within_db")), "{ranking:?}");
    assert_eq!((&found["best"], &found["ranked_by"]), (&found["ranking"][0], &Value::from("psl_within_db")));
    let page = std::fs::read_to_string(s.path("d/report.html")).unwrap();
    assert!(page.contains(found["reason"].as_str().unwrap()) && page.matches("data:image/png").count() == 16);
    for file in ["psf.fits", "psf.png", "uv.png", "layout.png", "layout.toml"] {
        assert!(s.path("d/ring").join(file).exists(), "{file}");
    }
}

#[test]
fn images_of_one_scene_are_judged_alike_and_their_errors_are_those_of_compare() {
    let s = made();
    s.write("s.toml", SCENE);
    let line = "layout compare fermat.toml ring.toml --freq 94GHz --bandwidth 4GHz --channels 2 --time 1s --noise --seed 5 --scene s.toml --scene-size 48 --scene-cell 4mrad -o d";
    let found = s.json(line);
    // All are compared at one resolution, 1.1 times the coarsest beam of all images.
    let resolution = found["resolution_rad"].as_f64().unwrap();
    let beam = |file: &str| s.json(&format!("info d/{file}"))["beam"][0].as_f64().unwrap();
    let coarsest = ["fermat/dirty.fits", "ring/dirty.fits", "fermat/clean-image.fits", "ring/clean-image.fits"]
        .map(beam)
        .into_iter()
        .fold(0.0, f64::max);
    assert!((resolution / coarsest - 1.1).abs() < 1e-5, "{resolution} {coarsest}");
    for layout in found["layouts"].as_array().unwrap() {
        let name = layout["name"].as_str().unwrap();
        for (kind, file) in [("dirty", "dirty.fits"), ("clean", "clean-image.fits"), ("mem", "mem-model.fits")] {
            let own = s.json(&format!("compare d/{name}/{file} d/scene.fits --resolution {resolution}rad"));
            assert_eq!(layout[kind]["rms_k"], own["rms_difference"], "{name}: {kind}");
            assert_eq!((&layout[kind]["nrmse"], &layout[kind]["unit"]), (&own["nrmse"], &Value::from("K")), "{name}: {kind}");
        }
        let size = |file: &str| s.json(&format!("info d/{name}/{file}"))["size"].clone();
        assert!(size("mem-model.fits") == found["size"] && size("dirty.fits") == found["size"], "{name}");
    }
    let error = |k: usize| found["layouts"][k]["mem"]["error_over_grey_card"].as_f64().unwrap();
    let best = if error(0) < error(1) { "fermat" } else { "ring" };
    assert_eq!((&found["best"], &found["ranked_by"]), (&Value::from(best), &Value::from("mem.error_over_grey_card")));
    assert!(error(0).min(error(1)) < 1.0, "{} {}", error(0), error(1));
    let page = std::fs::read_to_string(s.path("d/report.html")).unwrap();
    assert!(page.contains("Errors: images of maximum entropy") && page.contains("cittert mem d/ring/vis.uvh5"));
    // The truth and three curves once, and for each layout elements, baselines, beam, ghosts, three images and three error maps.
    assert_eq!(page.matches("data:image/png").count(), 4 + 2 * 10);
    quality_falls_with_fewer_elements(&s, &found);
    // A second comparison replaces the files of the first, and keeps those of others.
    s.write("d/notes.txt", "mine");
    s.fails(line, 1, &["d: it exists already", "--overwrite"]);
    s.ok("layout compare fermat.toml ring.toml --freq 94GHz -o d --overwrite");
    assert!(s.path("d/notes.txt").exists() && !s.path("d/ring/mem-model.fits").exists());
}

/// The curves of the comparison with 15 elements and two channels.
fn quality_falls_with_fewer_elements(s: &Scratch, found: &Value) {
    for layout in found["layouts"].as_array().unwrap() {
        let name = layout["name"].as_str().unwrap();
        let of = |what: &str, key: &str| -> Vec<f64> {
            layout["quality_against"][what].as_array().unwrap().iter().map(|p| p[key].as_f64().unwrap()).collect()
        };
        assert_eq!((of("elements", "x"), of("lost", "x")), (vec![4.0, 8.0, 11.0, 15.0], vec![0.0, 1.0, 2.0, 4.0]));
        let bandwidth = of("bandwidth", "x");
        assert!(bandwidth.len() == 2 && (bandwidth[0] - 2.0).abs() < 1e-9 && (bandwidth[1] - 4.0).abs() < 1e-9, "{bandwidth:?}");
        let whole = layout["mem"]["error_over_grey_card"].as_f64().unwrap();
        let elements = of("elements", "error_over_grey_card");
        assert!(elements[3] == whole && of("lost", "error_over_grey_card")[0] == whole && elements[0] > whole, "{name}: {elements:?}");
        // Lost is the element whose loss raises the side lobes most; the files of the parts stay.
        let ranking = s.json(&format!("layout show d/{name}/layout.toml --freq 94GHz --lost 1"));
        let names = |file: &str| s.json(&format!("layout show d/{name}/{file}.toml"))["antenna_names"].as_array().unwrap().clone();
        let (part, first) = (names("lost-1"), &ranking["lost_ranking"][0]["antenna"]);
        assert!(part.len() == 14 && !part.contains(first) && names("layout").contains(first), "{first}");
        let (few, more) = (names("elements-4"), names("elements-8"));
        assert!(few.len() == 4 && more.len() == 8 && few.iter().all(|a| more.contains(a)));
        assert!(!s.path(&format!("d/{name}/varied")).exists());
    }
}

#[test]
fn the_truth_is_dimmed_as_the_elements_dim_the_images() {
    let s = made();
    // A warm spot beside the centre, where the pattern is 0.24.
    s.write("s.toml", SCENE.replace("270.0", "3.0").replace("[1.0, 0.5]", "[3.0, 2.0]"));
    let line = "layout compare fermat.toml ring.toml --freq 94GHz --scene s.toml --scene-size 48 --scene-cell 4mrad --element gaussian --element-width 5deg -o d";
    let found = s.json(line);
    let resolution = found["resolution_rad"].as_f64().unwrap();
    assert!(found["compared_with"].as_str().unwrap().contains("the scene times the pattern of the elements"));
    let open = |file: &str| cittert_formats::open_image(&s.path(file)).unwrap();
    let (scene, seen) = (open("d/scene.fits"), open("d/ring/scene.fits"));
    let pedestal = open("d/ring/dirty.fits").pedestal_k.unwrap_or(0.0);
    for (row, column) in [(24, 24), (32, 36), (31, 37), (3, 10)] {
        let theta = scene.grid.l_at(column as f64).hypot(scene.grid.m_at(row as f64)).asin();
        let power = (-4.0 * std::f64::consts::LN_2 * (theta / 5.0_f64.to_radians()).powi(2)).exp();
        let (whole, dimmed) = (scene.plane(0, 0)[[row, column]], seen.plane(0, 0)[[row, column]]);
        assert!((dimmed - pedestal - (whole - pedestal) * power).abs() < 1e-4 * whole, "{dimmed} {whole} {power}");
    }
    let at = |truth: &str| {
        s.json(&format!("compare d/ring/mem-model.fits d/{truth} --resolution {resolution}rad"))["error_over_grey_card"].clone()
    };
    let ring = &found["layouts"][1]["mem"]["error_over_grey_card"];
    assert_eq!(ring, &at("ring/scene.fits"));
    // Maximum entropy shows the scene itself, which is multiplied by the pattern to be compared with what the elements see.
    assert!(ring.as_f64().unwrap() < 0.8 && at("scene.fits").as_f64().unwrap() < 0.8, "{ring} {}", at("scene.fits"));
    let dirty = |truth: &str| s.json(&format!("compare d/ring/dirty.fits d/{truth}"));
    assert_eq!((&dirty("scene.fits")["dimmed"], &dirty("ring/scene.fits")["dimmed"]), (&Value::from("truth"), &Value::Null));
    // The elements see half of the power on a circle of 2.5 degrees. The model of the scene itself says through which pattern it was seen.
    let cell = open("d/ring/dirty.fits").grid.cell_rad;
    let circle = std::f64::consts::PI * (2.5_f64.to_radians() / cell).powi(2);
    for file in ["dirty", "mem-model"] {
        let found = s.json(&format!("compare d/ring/{file}.fits d/scene.fits"));
        let pixels = found["field"]["n_compared"].as_f64().unwrap();
        assert!((pixels / circle - 1.0).abs() < 0.03 && found["n_compared"].as_f64().unwrap() > 4.0 * pixels, "{file}: {pixels} {circle}");
        assert!(found["field"]["nrmse"].as_f64().unwrap() > 0.0 && found["field"]["nrmse"] != found["nrmse"], "{file}");
    }
    assert!(s.json("compare d/scene.fits d/scene.fits")["field"].is_null());
    let told = s.ok("compare d/ring/mem-model.fits d/scene.fits").out;
    assert!(told.contains("Within half power of the elements (20 % of the pixels)"), "{told}");
    // One channel leaves no bandwidth to vary.
    assert!(found["layouts"][0]["quality_against"]["bandwidth"].is_null());
}

#[test]
fn files_of_one_name_get_names_of_their_folders() {
    let s = made();
    for (folder, from) in [("a", "ring"), ("b", "fermat")] {
        std::fs::create_dir(s.path(folder)).unwrap();
        std::fs::copy(s.path(&format!("{from}.toml")), s.path(&format!("{folder}/l.toml"))).unwrap();
    }
    let found = s.json("layout compare a/l.toml b/l.toml --freq 94GHz -o d");
    assert_eq!((&found["layouts"][0]["name"], &found["layouts"][1]["name"]), (&Value::from("a-l"), &Value::from("b-l")));
    assert!(s.path("d/a-l/psf.png").exists());
}

#[test]
fn layouts_of_the_ground_are_compared_towards_the_zenith() {
    let s = Scratch::new();
    let found = s.json("layout compare vla-a vla-d --freq 1.4GHz -o d");
    assert_eq!(found["ranking"], serde_json::json!(["vla-a"]));
    assert_eq!(found["not_ranked"], serde_json::json!(["vla-d"]));
}

#[test]
fn bad_calls_give_one_message_and_leave_nothing() {
    let s = made();
    s.write("text.toml", "no layout");
    let before = s.names();
    for (line, code, words) in [
        ("ring.toml -o d", 2, ["two layouts or more", "1 layout"]),
        ("ring.toml ring.toml -o d", 2, ["ring.toml is given twice", "each layout once"]),
        ("ring.toml ./ring.toml -o d", 2, ["ring.toml and ./ring.toml are one file", "each layout once"]),
        ("ring.toml none.toml -o d", 1, ["none.toml", "neither a layout file nor a built-in"]),
        ("ring.toml text.toml -o d", 1, ["text.toml", "expected"]),
        ("ring.toml fermat.toml -o ring.toml --overwrite", 2, ["ring.toml", "this output is the input"]),
        ("ring.toml fermat.toml -o . --overwrite", 2, ["a folder that holds the input", "choose another folder"]),
        ("ring.toml fermat.toml -o d --scene-size 64", 2, ["--scene-size", "needs --scene"]),
        ("ring.toml fermat.toml -o d --scene ring.toml --noise", 2, ["--noise", "--bandwidth"]),
        ("ring.toml fermat.toml -o d --scene none.toml --scene-size 32", 1, ["none.toml", "cannot open"]),
        ("ring.toml fermat.toml -o d --channels 4", 2, ["channels", "4"]),
    ] {
        s.fails(&format!("layout compare {line} --freq 94GHz"), code, &words);
        assert_eq!(s.names(), before, "{line}");
    }
}
