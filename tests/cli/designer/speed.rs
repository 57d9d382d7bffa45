//! The time from a drag to its images, by hand: `cargo test --release --test integration designer::speed -- --ignored --nocapture`.

use super::{Designer, airport};
use serde_json::json;
use std::time::{Duration, Instant};

const DRAGS: usize = 200;

fn median(mut all: Vec<Duration>) -> Duration {
    all.sort();
    all[all.len() / 2]
}

#[test]
#[ignore = "needs a quiet machine with two processors"]
fn a_drag_of_64_antennas_is_seen_at_once() {
    let d = Designer::start(&[]);
    let mut tab = d.tab();
    let mut state = airport(64, 256);
    state["simulate"]["channels"] = 4.into();
    tab.show(&state, false);
    let mut times: [Vec<Duration>; 3] = Default::default();
    for drag in 0..DRAGS {
        state["layout"]["antenna"][7]["position_m"][0] = json!(0.1 + 1e-4 * drag as f64);
        let seq = 1000 + drag;
        let began = Instant::now();
        tab.tell(&json!({ "do": "show", "seq": seq, "moving": true, "state": state }));
        loop {
            let header = tab.answer().header;
            match (header["is"].as_str(), header["name"].as_str()) {
                (Some("coverage"), _) => times[0].push(began.elapsed()),
                (_, Some("psf")) => times[1].push(began.elapsed()),
                (_, Some("dirty")) => times[2].push(began.elapsed()),
                (Some("done"), _) => break,
                _ => {}
            }
        }
    }
    let [coverage, psf, dirty] = times.map(median);
    println!("medians of {DRAGS} drags: coverage {coverage:?}, beam {psf:?}, dirty image {dirty:?}");
    assert!(psf < Duration::from_millis(50) && dirty < Duration::from_millis(150));
}

#[test]
#[ignore = "needs a quiet machine with two processors"]
fn the_airport_is_imaged_by_maximum_entropy_in_two_seconds() {
    let d = Designer::start(&[]);
    let mut tab = d.tab();
    let mut state = airport(64, 256);
    state["simulate"]["channels"] = 4.into();
    tab.show(&state, true);
    state["mem"] = json!({});
    let began = Instant::now();
    let mut seen = Vec::new();
    tab.tell(&json!({ "do": "show", "seq": 1000, "state": state }));
    loop {
        let header = tab.answer().header;
        seen.push(format!("{} {} {:?}", header["is"], header["name"], began.elapsed()));
        if header["is"] == "done" || header["is"] == "error" {
            break;
        }
    }
    println!("{}", seen.join("\n"));
    assert!(began.elapsed() < Duration::from_secs(2));
}
