//! Tabs, files, searches and reports.

use super::{Designer, airport, program, ring};
use serde_json::{Value, json};
use std::time::{Duration, Instant};

#[test]
fn tabs_do_not_disturb_each_other_and_a_lost_one_ends() {
    let d = Designer::start(&[]);
    let (mut a, mut b) = (d.tab(), d.tab());
    // One tab is in the middle of long work when its line is lost.
    let mut long = airport(40, 512);
    long["mem"] = json!({ "niter": 100_000 });
    a.tell(&json!({ "do": "show", "seq": 1, "state": long }));
    a.tell(&json!({ "do": "optimise", "layout": ring(40, 0.2), "design": { "objective": "psl" }, "attempts": 100_000 }));
    let mut small = airport(6, 32);
    let first = b.show(&small, false);
    assert!(first["dirty"].numbers.len() == 32 * 32 && !first.contains_key("mem"));
    drop(a);
    small["image"]["size"] = 16.into();
    assert_eq!(b.show(&small, false)["dirty"].numbers.len(), 256);
    // The work of the lost tab stops, and its place is free again.
    let began = Instant::now();
    while busy_ms(&d) > 20 {
        assert!(began.elapsed() < Duration::from_secs(100), "a lost tab goes on working");
    }
    let more: Vec<_> = (0..7).map(|_| d.tab()).collect();
    let socket = d.socket(&d.token, &d.host(), &format!("http://{}", d.host())).unwrap();
    let mut one_too_many = super::Tab { socket, seq: 0 };
    assert!(one_too_many.answer().header["text"].as_str().unwrap().contains("tabs are open already"));
    drop(more);
    // A page that comes back begins anew.
    assert_eq!(b.show(&small, true)["dirty"].numbers.len(), 256);
}

/// Time of the processors that the program takes in half a second, ms.
fn busy_ms(d: &Designer) -> u64 {
    let ticks = || {
        let text = std::fs::read_to_string(format!("/proc/{}/stat", d.child.id())).unwrap();
        let fields: Vec<u64> = text.rsplit(')').next().unwrap().split_whitespace().skip(11).take(2).map(|t| t.parse().unwrap()).collect();
        fields[0] + fields[1]
    };
    let before = ticks();
    std::thread::sleep(Duration::from_millis(500));
    (ticks() - before) * 10
}

#[test]
fn the_newest_state_wins_and_each_state_is_answered() {
    let d = Designer::start(&[]);
    let mut tab = d.tab();
    let mut long = airport(24, 256);
    long["mem"] = json!({ "niter": 100_000, "noise": "1e-9Ksr" });
    tab.tell(&json!({ "do": "show", "seq": 1, "state": long }));
    // The long one has begun.
    while tab.answer().header["name"] != "dirty" {}
    let began = Instant::now();
    for seq in 2..=6 {
        tab.tell(&json!({ "do": "show", "seq": seq, "moving": true, "state": airport(6, 32) }));
    }
    let mut ended: Vec<(u64, bool)> = Vec::new();
    while ended.last().is_none_or(|l| l.0 != 6) {
        let header = tab.answer().header;
        assert_ne!(header["is"], "error", "{header}");
        if header["is"] == "done" {
            ended.push((header["seq"].as_u64().unwrap(), header["cancelled"].as_bool().unwrap()));
        }
    }
    assert_eq!((ended.first(), ended.last()), (Some(&(1, true)), Some(&(6, false))));
    assert!(began.elapsed() < Duration::from_secs(20), "{:?}", began.elapsed());
}

#[test]
fn layouts_are_read_and_written_in_every_format() {
    let d = Designer::start(&[]);
    let mut tab = d.tab();
    let hello = d.tab();
    drop(hello);
    let vla = tab.ask(&json!({ "do": "builtin", "name": "vla-d" }), "layout")["layout"].clone();
    let mut read = 0;
    let known = tab.ask(&json!({ "do": "save", "format": "?", "layout": vla }), "saved")["text"].as_str().unwrap().to_owned();
    let formats: Vec<&str> = known.rsplit("are ").next().unwrap().split(", ").collect();
    for format in &formats {
        let saved = tab.ask(&json!({ "do": "save", "format": format, "layout": vla }), "saved");
        assert!(saved["text"].as_str().unwrap().len() > 200, "{format}: {saved}");
        tab.drop_file(&json!({ "kind": "layout", "name": saved["name"] }), saved["text"].as_str().unwrap().as_bytes());
        let back = tab.until("layout");
        if back["is"] == "layout" {
            assert_eq!(back["layout"]["antenna"].as_array().unwrap().len(), vla["antenna"].as_array().unwrap().len(), "{format}");
            read += 1;
        } else {
            // Some formats hold no site, and are not for this program to read back alone.
            assert!(!back["text"].as_str().unwrap().contains("/tmp"), "{format}: {back}");
        }
    }
    assert!(formats.len() >= 4 && read >= 3, "{formats:?}, {read} are read");
    tab.drop_file(&json!({ "kind": "layout", "name": "bad.toml" }), b"antenna = 3");
    let text = tab.until("layout")["text"].as_str().unwrap().to_owned();
    assert!(text.contains("bad.toml") && !text.contains("/"), "{text}");
}

#[test]
fn a_search_gives_the_layout_of_the_command_and_can_be_stopped() {
    let d = Designer::start(&[]);
    let mut tab = d.tab();
    let zones = json!([[[-0.02, -0.02], [0.02, -0.02], [0.02, 0.02], [-0.02, 0.02]]]);
    let wanted =
        json!({ "do": "optimise", "layout": ring(8, 0.25), "design": { "objective": "psl", "seed": 4 }, "attempts": 3, "keep_out": zones });
    let begun = tab.ask(&wanted, "search");
    let mut best: Option<Value> = None;
    let mut attempts = 0;
    loop {
        let header = tab.answer().header;
        match header["is"].as_str().unwrap() {
            "attempt" => {
                attempts += 1;
                assert_eq!(header["search"], begun["search"]);
                best = if header["layout"].is_null() { best } else { Some(header["layout"].clone()) };
            }
            "search-ended" => {
                assert!(header["error"].is_null(), "{header}");
                break;
            }
            other => panic!("{other}: {header}"),
        }
    }
    assert_eq!(attempts, 3);
    let folder = tempfile::tempdir().unwrap();
    for need in begun["needs"].as_array().unwrap() {
        std::fs::write(folder.path().join(need["name"].as_str().unwrap()), need["text"].as_str().unwrap()).unwrap();
    }
    let line = begun["line"].as_str().unwrap();
    let said = program().args(line.split(' ').skip(1)).current_dir(folder.path()).output().unwrap();
    assert!(said.status.success(), "{line}\n{}", String::from_utf8_lossy(&said.stderr));
    let text = std::fs::read_to_string(folder.path().join("optimized.toml")).unwrap();
    let made: Value = serde_json::to_value(toml::from_str::<toml::Table>(&text).unwrap()).unwrap();
    let places = |layout: &Value| -> Vec<f64> {
        let all = layout["antenna"].as_array().unwrap().iter().flat_map(|a| a["position_m"].as_array().unwrap());
        all.map(|v| v.as_f64().unwrap()).collect()
    };
    let (best, made) = (places(&best.unwrap()), places(&made));
    assert_eq!(best.len(), made.len());
    // This reader of JSON may round the last bit.
    assert!(best.iter().zip(&made).all(|(a, b)| (a - b).abs() <= 1e-15), "{best:?}\n{made:?}");
    // A search that is stopped ends soon, and the next one is not taken for it.
    let mut long = wanted.clone();
    (long["attempts"], long["layout"]) = (100_000.into(), ring(30, 0.25));
    let first = tab.ask(&long, "search")["search"].clone();
    let second = tab.ask(&long, "search")["search"].clone();
    assert_ne!(first, second);
    tab.tell(&json!({ "do": "stop" }));
    let ended = tab.until("search-ended");
    assert!(ended["search"] == second && ended["error"].is_null(), "{ended}");
}

#[test]
fn dropped_scenes_are_seen_and_shipped_ones_are_not_replaced() {
    let d = Designer::start(&[]);
    let mut tab = d.tab();
    let mut state = airport(8, 32);
    let text = b"l_rad,m_rad,flux_jy\n0.01,0,2\n";
    for (name, kept) in [("mine.csv", "mine.csv"), ("../../up and away.csv", "up-and-away.csv"), ("points.csv", "scene-points.csv")] {
        tab.drop_file(&json!({ "kind": "scene", "name": name }), text);
        let scenes = tab.until("scenes");
        assert!(scenes["added"].as_str().unwrap().ends_with(kept) && !scenes["added"].as_str().unwrap().contains('/'), "{scenes}");
        state["scene"] = json!({ "file": scenes["added"] });
        assert!(tab.show(&state, false).contains_key("dirty"));
    }
    tab.drop_file(&json!({ "kind": "scene", "name": "noise.png" }), b"\x89PNG\r\n\x1a\n");
    let name = tab.until("scenes")["added"].clone();
    state["scene"] = json!({ "file": name, "scene-cell": "1mrad", "scene-min": "0K", "scene-max": "1K" });
    let text = tab.refused(&state);
    assert!(text.contains("noise.png") && !text.contains("/tmp") && !text.contains("design"), "{text}");
}

#[test]
fn two_layouts_are_compared_in_a_report() {
    let d = Designer::start(&[]);
    let mut tab = d.tab();
    let saved = tab.ask(&json!({ "do": "report", "a": ring(8, 0.25), "b": ring(9, 0.25), "options": { "freq": "94GHz" } }), "saved");
    let page = saved["text"].as_str().unwrap();
    assert!(page.starts_with("<!DOCTYPE html>") && page.contains("data:image/png"), "{}", &page[..200.min(page.len())]);
    assert!(!page.contains(d.folder.path().to_str().unwrap()));
    assert_eq!(tab.until("report-ended")["is"], "report-ended");
    let wrong =
        json!({ "do": "report", "a": ring(8, 0.25), "b": ring(9, 0.25), "options": { "freq": "94GHz", "scene": { "file": "none.csv" } } });
    assert!(tab.ask(&wrong, "saved")["text"].as_str().unwrap().contains("there is no scene"));
}
