//! `layout make` and `layout show`: generated layouts and their figures of merit.

use crate::program::Scratch;

#[test]
fn a_made_layout_is_a_layout_with_its_history() {
    let s = Scratch::new();
    s.ok("layout make poisson-disc --elements 40 --aperture 0.7m --seed 7 --diameter 10mm --tsys 600K -o a.toml");
    s.ok("layout generate poisson-disc --elements 40 --aperture 0.7m --seed 7 --diameter 10mm --tsys 600K -o b.toml");
    let text = std::fs::read_to_string(s.path("a.toml")).unwrap();
    assert_eq!(text, std::fs::read_to_string(s.path("b.toml")).unwrap(), "the same seed, the same layout");
    for words in ["kind poisson-disc", "elements 40", "aperture 0.7m", "seed 7", "Bridson 2007", "tsys_k = 600.0"] {
        assert!(text.contains(words), "{words}");
    }
    let shown = s.json("layout show a.toml --freq 94GHz --within 20 --bandwidth 1GHz --time 1s");
    assert_eq!(shown["n_antennas"], 40);
    assert!((shown["longest_m"].as_f64().unwrap() - 0.7).abs() < 1e-12);
    for key in
        ["psl_db", "psl_within_db", "within", "delta_t_k", "cable_m", "smallest_spacing_m", "largest_hole_m", "half_power_equivalent_rad"]
    {
        assert!(shown[key].is_f64(), "{key}: {}", shown[key]);
    }
    // 600 K over sqrt(40 x 39 x 1 GHz x 1 s) and the ratio of the element's solid angle to the beam's.
    let wavelength: f64 = 299_792_458.0 / 94e9;
    let beam = std::f64::consts::PI / (4.0 * 2_f64.ln()) * shown["bmaj_rad"].as_f64().unwrap() * shown["bmin_rad"].as_f64().unwrap();
    let element = wavelength * wavelength / (std::f64::consts::PI / 4.0 * 1e-4);
    let expected = 600.0 / (40.0 * 39.0 * 1e9_f64).sqrt() * element / beam;
    assert!((shown["delta_t_k"].as_f64().unwrap() / expected - 1.0).abs() < 1e-9);
    assert!(s.json("layout show a.toml --freq 94GHz")["delta_t_k"].is_null(), "no bandwidth, no noise");
}

#[test]
fn every_kind_is_in_the_help() {
    let s = Scratch::new();
    let help = s.ok("layout make --help").out;
    for kind in cittert_arrays::LAYOUT_KINDS {
        assert!(help.contains(&format!("- {}:", kind.name)) && help.contains(&kind.about[..20]), "{}", kind.name);
    }
}

#[test]
fn lost_elements_hubs_and_shadows_are_told() {
    let s = Scratch::new();
    s.ok("layout make fermat --elements 16 --aperture 0.3m -o f.toml");
    let lost = s.json("layout show f.toml --freq 94GHz --lost 2");
    assert_eq!(lost["lost_ranking"].as_array().unwrap().len(), 16);
    let psl = |key: &str, which: &str| lost[key][which]["psl_within_db"].as_f64().unwrap();
    assert!(psl("lost_two", "worst") >= psl("lost_one", "worst") && psl("lost_one", "worst") >= psl("lost_one", "mean"));
    assert_eq!(lost["lost_none"]["psl_within_db"], lost["psl_within_db"]);
    assert_eq!(lost["lost_two"]["worst_for_psl"].as_array().unwrap().len(), 2);
    // The VLA at its smallest sees shadows at low elevations.
    let track = "--phase-center 299.87deg,-20deg --start 2025-06-01T00:00:00 --hour-angle -4h,4h --integration 10min";
    let shown = s.json(&format!("layout show vla-d --hub 0m,0m {track}"));
    assert!((0.005..0.5).contains(&shown["shadowed_fraction"].as_f64().unwrap()), "{}", shown["shadowed_fraction"]);
    let figures = s.json(&format!("layout show vla-d --freq 1.4GHz {track}"));
    let snapshot = s.json("layout show vla-d --freq 1.4GHz");
    let number = |json: &serde_json::Value, key: &str| json[key].as_f64().unwrap();
    assert!(number(&figures, "uv_fill") > 1.5 * number(&snapshot, "uv_fill") && number(&figures, "psl_db") < number(&snapshot, "psl_db"));
    assert!((number(&figures, "time_s") - 600.0 * number(&figures, "n_integrations")).abs() < 1e-6);
    assert_eq!(figures["shadowed_fraction"], shown["shadowed_fraction"]);
    assert!(shown["cable_to_hub_m"].as_f64().unwrap() > shown["cable_m"].as_f64().unwrap());
}

#[test]
fn the_map_of_ghosts_shows_those_of_a_grid() {
    let s = Scratch::new();
    s.ok("layout make rectangular --elements 36 --columns 6 --aperture 0.5m -o grid.toml");
    let told = s.json("layout show grid.toml --freq 94GHz --ghosts g.fits --ghost-level -1");
    let spacing = told["shortest_m"].as_f64().unwrap();
    let ghost = 299_792_458.0 / 94e9 / spacing;
    let map = &told["ghost_map"];
    let lobes = map["lobes"].as_array().unwrap();
    let first = [lobes[0]["l"].as_f64().unwrap(), lobes[0]["m"].as_f64().unwrap()];
    assert!((first[0].hypot(first[1]) / ghost - 1.0).abs() < 1e-6 && lobes[0]["level_db"].as_f64().unwrap().abs() < 1e-6, "{lobes:?}");
    assert!(map["radius"].as_f64().unwrap() > 2.0 * ghost);
    // The image has the source in the middle, and a ghost as bright one wavelength over the spacing beside it.
    let image = cittert_formats::open_image(&s.path("g.fits")).unwrap();
    let plane = image.plane(0, 0);
    let at = |l: f64| plane[[image.grid.row_of(0.0).round() as usize, image.grid.column_of(l).round() as usize]];
    assert!((at(0.0) - 1.0).abs() < 1e-6 && at(ghost) > 0.8 && at(0.5 * ghost) < 0.1, "{} {}", at(ghost), at(0.5 * ghost));
    s.fails("layout show grid.toml --freq 94GHz --ghosts g.fits", 1, &["exists already"]);
    let told = s.ok("layout show grid.toml --freq 94GHz --ghosts g.png").out;
    assert!(told.contains("lobes of -6 dB or more and as many opposite") && s.path("g.png").exists(), "{told}");
}

#[test]
fn bad_calls_are_refused_in_the_words_of_the_command_line() {
    let s = Scratch::new();
    s.ok("layout make ring --elements 9 --aperture 1m -o r.toml");
    for (line, words) in [
        ("layout make y --elements 29 --aperture 1m -o x.toml", vec!["--elements is 29", "28 or 30"]),
        ("layout make ring --elements 9 --aperture 1m --arms 3 -o x.toml", vec!["--arms is 3", "no such option"]),
        ("layout make random --elements 900 --aperture 1m --spacing 10cm -o x.toml", vec!["--elements is 900", "at most 110"]),
        ("layout make ring --elements 90 --aperture 1m --spacing 10cm -o x.toml", vec!["--spacing is 10cm", "at most 3.49"]),
        ("layout make circle --elements 9 --aperture 1m -o x.toml", vec!["circle", "reuleaux"]),
        ("layout make ring --elements 9 --aperture 1 -o x.toml", vec!["no unit"]),
        ("layout make ring --elements 9 --aperture 1m -o x.cfg", vec!["x.cfg", ".toml"]),
        ("layout show r.toml --within 10", vec!["--freq"]),
        ("layout show r.toml --lost 1", vec!["--freq"]),
        ("layout show r.toml --freq 94GHz --uv-cell 0m", vec!["--uv-cell is 0m"]),
        ("layout show r.toml --freq 94GHz --channels 4", vec!["--channels is 4", "bandwidth"]),
        ("layout show r.toml --ghosts g.png", vec!["--ghosts needs --freq"]),
        ("layout show r.toml --freq 94GHz --ghosts g.jpg", vec!["g.jpg", ".png or .fits"]),
        ("layout show r.toml --freq 94GHz --ghosts g.png --ghost-level 3", vec!["--ghost-level is 3", "below 0 dB"]),
        ("layout show r.toml --freq 94GHz --ghost-level -9", vec!["--ghost-level needs --ghosts"]),
        ("layout show r.toml --hub nowhere", vec!["--hub is \"nowhere\""]),
        ("layout show r.toml --phase-center 10deg,40deg", vec!["boresight"]),
    ] {
        s.fails(line, 2, &words);
    }
    assert!(!s.path("x.toml").exists());
    s.fails("layout make ring --elements 9 --aperture 1m -o r.toml", 1, &["exists already"]);
}
