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
        for key in ["psl_db", "bmaj_rad", "uv_fill", "redundancy", "cable_m", "longest_m", "half_power_equivalent_rad"] {
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
    assert!(ranking.windows(2).all(|w| number(w[0], "psl_db") <= number(w[1], "psl_db")), "{ranking:?}");
    assert_eq!((&found["best"], &found["ranked_by"]), (&found["ranking"][0], &Value::from("psl_db")));
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
    for layout in found["layouts"].as_array().unwrap() {
        let name = layout["name"].as_str().unwrap();
        for (kind, file) in [("dirty", "dirty.fits"), ("clean", "clean-image.fits"), ("mem", "mem-model.fits")] {
            let own = s.json(&format!("compare d/{name}/{file} d/scene.fits"));
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
    // The truth once, and for each layout elements, baselines, beam, ghosts, three images and three error maps.
    assert_eq!(page.matches("data:image/png").count(), 1 + 2 * 10);
    // A second comparison replaces the files of the first, and keeps those of others.
    s.write("d/notes.txt", "mine");
    s.fails(line, 1, &["d: it exists already", "--overwrite"]);
    s.ok("layout compare fermat.toml ring.toml --freq 94GHz -o d --overwrite");
    assert!(s.path("d/notes.txt").exists() && !s.path("d/ring/mem-model.fits").exists());
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
