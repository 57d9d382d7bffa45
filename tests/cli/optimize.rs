//! `layout optimize`: the layout that it writes, its journal, and its messages.

use crate::program::Scratch;
use std::time::{Duration, Instant};

/// The positions in a layout file, as they are written.
fn positions(toml: &str) -> Vec<&str> {
    toml.lines().filter(|l| l.starts_with("position_m")).collect()
}

#[test]
fn an_optimised_layout_is_a_layout_file_with_its_history() {
    let s = Scratch::new();
    let line = "layout optimize --elements 10 --aperture 0.3m --spacing 20mm --within 6 --restarts 4 --seed 3";
    let json = s.json(&format!("{line} -o a.toml --page a.html"));
    assert_eq!(s.names(), ["a.html", "a.toml"], "the journal is removed");
    assert!(json["psl"].as_f64().unwrap() < 0.3 && json["attempts"] == 4 && json["violated"] == 0.0, "{json}");
    assert!(json["beam_largest"].as_f64().unwrap() <= 1.2, "{json}");
    let toml = std::fs::read_to_string(s.path("a.toml")).unwrap();
    assert!(toml.contains("--seed 3") && toml.contains("after 4 attempts"), "{toml}");
    let page = std::fs::read_to_string(s.path("a.html")).unwrap();
    assert!(page.contains("10 elements in 30cm") && page.matches("data:image/png").count() == 3);
    let shown = s.json("layout show a.toml --freq 94GHz");
    assert_eq!(shown["n_antennas"], 10);
    assert!(shown["shortest_m"].as_f64().unwrap() >= 0.02 && shown["longest_m"].as_f64().unwrap() <= 0.3 + 1e-9, "{shown}");
    // The same seed gives the same layout with another number of threads.
    s.ok(&format!("--threads 1 {line} -o b.toml"));
    assert_eq!(positions(&toml), positions(&std::fs::read_to_string(s.path("b.toml")).unwrap()));
}

#[test]
fn a_killed_search_continues_and_ends_with_the_same_layout() {
    let s = Scratch::new();
    let line = "layout optimize --elements 20 --aperture 1m --within 12 --restarts 20 --seed 7";
    s.ok(&format!("{line} -o whole.toml"));
    let words: Vec<String> = format!("{line} -o killed.toml").split_whitespace().map(String::from).collect();
    let mut child = std::process::Command::new(assert_cmd::cargo::cargo_bin("cittert"))
        .current_dir(s.path(""))
        .args(&words)
        .stderr(std::process::Stdio::null())
        .stdout(std::process::Stdio::null())
        .spawn()
        .unwrap();
    // Some attempts are in the journal, and the search has not ended.
    let journal = s.path("killed.toml.journal");
    let began = Instant::now();
    while std::fs::read_to_string(&journal).unwrap_or_default().lines().count() < 4 {
        assert!(child.try_wait().unwrap().is_none() && began.elapsed() < Duration::from_secs(120), "the search ended before it was killed");
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(!s.path("killed.toml").exists());
    // A killed process may have written half of a line.
    let text = std::fs::read_to_string(&journal).unwrap();
    std::fs::write(&journal, &text[..text.len() - 7]).unwrap();
    let message = s.fails("layout optimize --elements 21 --aperture 1m --restarts 1 -o killed.toml", 1, &["journal", "--overwrite"]);
    assert!(message.contains("killed.toml.journal"), "{message}");
    let json = s.json(&format!("{line} -o killed.toml"));
    assert!(json["resumed"].as_u64().unwrap() >= 2, "{json}");
    let read = |name: &str| std::fs::read_to_string(s.path(name)).unwrap();
    assert_eq!(positions(&read("whole.toml")), positions(&read("killed.toml")));
    assert!(!journal.exists());
}

#[test]
fn pads_keep_their_names_and_places() {
    let s = Scratch::new();
    let json = s.json("layout optimize --pads mm-ring --choose 12 --objective redundancy --freq 94GHz --restarts 2 -o c.toml");
    assert_eq!(json["n_antennas"], 12);
    s.ok("layout convert mm-ring -o pads.toml");
    let pads = std::fs::read_to_string(s.path("pads.toml")).unwrap();
    let chosen = std::fs::read_to_string(s.path("c.toml")).unwrap();
    for position in positions(&chosen) {
        assert!(pads.contains(position), "{position} is no pad");
    }
    assert_eq!(positions(&chosen).len(), 12);
}

#[test]
fn a_front_holds_layouts_that_none_beats_in_both_objectives() {
    let s = Scratch::new();
    let json = s.json("layout optimize --elements 8 --aperture 1m --within 5 --objective psl,cable=0.05 --pareto 3 --restarts 2 -o f.toml");
    let front = json["front"].as_array().unwrap();
    assert!(!front.is_empty() && front.len() + json["beaten"].as_u64().unwrap() as usize == 3, "{json}");
    for pair in front.windows(2) {
        let of = |k: usize, name: &str| pair[k][name].as_f64().unwrap();
        assert!(of(0, "psl") < of(1, "psl") && of(0, "cable") > of(1, "cable"), "{json}");
    }
    let names = s.names();
    assert!(names.contains(&"f-front.png".to_owned()) && names.len() == front.len() + 1, "{names:?}");
    s.fails("layout optimize --elements 8 --aperture 1m --pareto 3 --restarts 2 -o g.toml", 2, &["--objective", "two objectives"]);
}

#[test]
fn bad_calls_get_one_clear_message() {
    let s = Scratch::new();
    s.write("bow.txt", "0,0\n1,1\n1,0\n0,1\n");
    s.write("words.txt", "a,b\n");
    s.write("all.txt", "-9,-9\n9,-9\n9,9\n-9,9\n");
    for (options, code, words) in [
        ("--aperture 1m", 2, &["--elements", "missing"] as &[&str]),
        ("--elements 5", 2, &["--aperture", "missing"]),
        ("--elements 50 --aperture 1m --spacing 0.5m", 2, &["--elements", "do not fit"]),
        ("--elements 5 --aperture 1m --objective beauty", 2, &["beauty", "psl", "cable"]),
        ("--elements 5 --aperture 1m --objective fill --method descent", 2, &["--method", "fill"]),
        ("--elements 5 --aperture 1m --beam 0.3", 2, &["--beam", "narrower"]),
        ("--elements 5 --aperture 1m --inside bow.txt", 1, &["crosses itself", "bow.txt"]),
        ("--elements 5 --aperture 1m --inside words.txt", 1, &["line 1", "x,y"]),
        ("--elements 5 --aperture 1m --keep-out all.txt", 1, &["no ground"]),
        ("--elements 5 --aperture 1m --objective scene", 2, &["--scene"]),
        ("--pads mm-ring --choose 500", 2, &["--choose"]),
        ("--pads nowhere.toml --choose 5", 1, &["nowhere.toml"]),
    ] {
        s.fails(&format!("layout optimize {options} --restarts 1 -o x.toml"), code, words);
    }
    s.fails("layout optimize --elements 5 --aperture 1m --restarts 1 -o x.cfg", 2, &[".toml"]);
}

#[test]
fn the_peak_side_lobe_is_that_of_layout_show() {
    let s = Scratch::new();
    for (more, same) in [("", ""), ("--freq 94GHz --bandwidth 8GHz --channels 3", "--bandwidth 8GHz --channels 3")] {
        let found = s.json(&format!("layout optimize --elements 12 --aperture 1m --within 8 --restarts 1 {more} -o a.toml --overwrite"));
        let shown = s.json(&format!("layout show a.toml --freq 94GHz --within 8 {same}"));
        let psl = |json: &serde_json::Value| json["psl_within_db"].as_f64().unwrap();
        assert!((psl(&found) - psl(&shown)).abs() < 1e-6, "{found} {shown}");
        assert!(found["psl"].as_f64().unwrap() >= found["psl_searched"].as_f64().unwrap() - 1e-6, "{found}");
        // Both count to 8 lambda / D of the disc, although the longest baseline is shorter.
        assert_eq!((&shown["within"], &shown["aperture_m"], &shown["aperture_from"]), (&8.0.into(), &1.0.into(), &"layout".into()));
        let within_rad = 8.0 * 299_792_458.0 / 94e9;
        assert!((shown["within_rad"].as_f64().unwrap() / within_rad - 1.0).abs() < 1e-12 && found["searched_to"] == 8.0, "{shown}");
        assert!(shown["longest_m"].as_f64().unwrap() < 0.99, "{shown}");
    }
}

#[test]
fn stations_are_chosen_among_sites_on_the_earth() {
    let s = Scratch::new();
    let line =
        "layout optimize --pads gmva-86ghz --choose 8 --objective coverage --declination 12.4deg --track 24h --moments 48 --restarts 2";
    let json = s.json(&format!("{line} -o chosen.toml"));
    let empty = json["figures"]["coverage"].as_f64().unwrap();
    assert!(empty > 0.5 && empty < 0.95 && json.get("psl").is_none(), "{json}");
    let (toml, all) = (std::fs::read_to_string(s.path("chosen.toml")).unwrap(), s.json("layout show gmva-86ghz").to_string());
    let names: Vec<&str> = toml.lines().filter_map(|l| l.strip_prefix("name = ")).skip(1).collect();
    assert!(names.len() == 8 && names.iter().all(|n| all.contains(n)), "{names:?}");
    // The beam of a plane says nothing about stations on a sphere.
    let other = "layout optimize --pads gmva-86ghz --choose 8 -o x.toml";
    s.fails(other, 1, &["--objective coverage"]);
    let limited = "layout optimize --pads mm-ring --choose 8 --declination 5deg --latitude 1deg --elevation-limit 5deg -o x.toml";
    s.fails(limited, 2, &["--elevation-limit"]);
    s.fails(&format!("{line} -o x.toml --page x.html"), 2, &["--page"]);
    s.fails("layout optimize --pads vla-d --choose 8 --objective coverage -o x.toml", 2, &["--declination"]);
    s.fails("layout optimize --elements 8 --aperture 1m --objective coverage -o x.toml", 2, &["choice among sites"]);
}

#[test]
fn new_elements_have_the_diameter_and_noise_that_are_given_or_those_of_the_fixed_ones() {
    let s = Scratch::new();
    s.ok("layout optimize --elements 6 --aperture 0.3m --within 4 --restarts 1 --diameter 10mm --tsys 600K -o old.toml");
    let count = |file: &str, line: &str| std::fs::read_to_string(s.path(file)).unwrap().matches(line).count();
    assert_eq!((count("old.toml", "diameter_m = 0.01\n"), count("old.toml", "tsys_k = 600.0\n")), (6, 6));
    s.ok("layout optimize --elements 9 --fixed old.toml --aperture 0.3m --within 4 --restarts 1 -o new.toml");
    assert_eq!((count("new.toml", "diameter_m = 0.01\n"), count("new.toml", "tsys_k = 600.0\n")), (9, 9));
    // An option of the objective scene has no effect on another objective.
    s.fails("layout optimize --elements 6 --aperture 0.3m --element gaussian -o x.toml", 2, &["--scene"]);
}
