//! What no page would send: the program answers with a clear word and goes on.

use super::{Designer, Tab, airport, ring};
use serde_json::{Value, json};
use std::io::Read;
use std::time::Duration;
use tungstenite::Message;

/// Messages of a usual run. `CITTERT_FUZZ=100000` is the long run.
const MESSAGES: usize = 3000;
/// The same messages are sent in so many rounds. Rendered scenes and tables of transforms are kept, up to a limit that is far above what this test
/// may use: only messages that come again show what is kept for no use.
const ROUNDS: usize = 4;
/// What the states of one round leave in memory is 46 MB. How much of it is there after two rounds depends on how many states were replaced
/// before they were computed.
const KEPT_KB: u64 = 60_000;

/// Numbers that are the same in every run (Steele, Lea and Flood 2014, SplitMix).
struct Chance(u64);

impl Chance {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    fn bytes(&mut self, most: usize) -> Vec<u8> {
        (0..self.below(most)).map(|_| self.next() as u8).collect()
    }
}

/// Messages that a page sends.
fn good() -> Vec<Value> {
    let mut state = airport(5, 16);
    state["corrupt"] = json!({ "phase-rms": "20deg", "dropout": 0.1 });
    state["clean"] = json!({ "niter": 10 });
    state["mem"] = json!({ "niter": 5 });
    let mut point = json!({ "layout": ring(4, 0.1), "simulate": { "freq": "94GHz", "bandwidth": "1GHz" }, "image": { "size": 16 } });
    point["selfcal"] = json!({ "solint": "inf" });
    vec![
        json!({ "do": "show", "seq": 1, "moving": false, "state": state }),
        json!({ "do": "show", "seq": 2, "moving": true, "state": state }),
        json!({ "do": "show", "seq": 3, "state": point }),
        json!({ "do": "make", "make": { "kind": "ring", "elements": 7, "aperture": "0.5m" } }),
        json!({ "do": "builtin", "name": "mm-y" }),
        json!({ "do": "save", "format": "toml", "layout": ring(3, 1.0) }),
        json!({ "do": "optimise", "layout": ring(5, 0.2), "design": { "objective": "psl" }, "attempts": 2, "keep_out": [[[0, 0], [0.1, 0], [0, 0.1]]] }),
        json!({ "do": "stop" }),
    ]
}

/// A value that does not belong where it is put.
fn odd(chance: &mut Chance) -> Value {
    match chance.below(14) {
        0 => Value::Null,
        1 => json!(-1),
        2 => json!(u64::MAX),
        3 => json!(1e308),
        4 => json!(-1e-320),
        5 => json!("NaN"),
        6 => json!("1e999GHz"),
        7 => json!([]),
        8 => json!({}),
        9 => json!(true),
        10 => json!("x".repeat(chance.below(20_000))),
        11 => json!(format!("{}\u{0}../../etc/passwd", chance.next())),
        12 => json!("-5GHz"),
        _ => json!(i64::MIN),
    }
}

/// Put an odd value somewhere into an object.
fn spoil(value: &mut Value, chance: &mut Chance) {
    let count = match value {
        Value::Object(map) => map.len(),
        Value::Array(list) => list.len(),
        _ => 0,
    };
    if count == 0 || chance.below(5) == 0 {
        *value = odd(chance);
        return;
    }
    let k = chance.below(count);
    match value {
        Value::Object(map) => {
            let key = map.keys().nth(k).unwrap().clone();
            match chance.below(12) {
                0 => drop(map.remove(&key)),
                1 => drop(map.insert(format!("{key}x"), odd(chance))),
                _ => spoil(&mut map[&key], chance),
            }
        }
        Value::Array(list) => spoil(&mut list[k], chance),
        _ => {}
    }
}

fn message(good: &[Value], chance: &mut Chance) -> Message {
    let mut value = good[chance.below(good.len())].clone();
    let text = value.to_string();
    match chance.below(10) {
        0 => Message::binary(chance.bytes(300)),
        1 => Message::text(String::from_utf8_lossy(&chance.bytes(300)).into_owned()),
        2 => Message::text(text.get(..chance.below(text.len())).unwrap_or_default()),
        3 => {
            let deep = 1 + chance.below(50_000);
            Message::text(format!("{}{}", text.trim_end_matches('}'), ",\"a\":".to_owned() + &"[{\"b\":".repeat(deep)))
        }
        4 => {
            let mut bytes = text.into_bytes();
            for _ in 0..1 + chance.below(4) {
                let k = chance.below(bytes.len());
                bytes[k] = chance.next() as u8 & 0x7f;
            }
            Message::text(String::from_utf8_lossy(&bytes).into_owned())
        }
        5 => Message::text(text.replacen(":\"", [":NaN,\"", ":1e999,\"", ":-0x1\"", ":[\""][chance.below(4)], 1 + chance.below(3))),
        6 => {
            let header = format!(
                r#"{{"kind":"{}","name":"{}"}}"#,
                ["scene", "layout", "x"][chance.below(3)],
                ["a.toml", "a.png", "../a", "b.csv", ""][chance.below(5)]
            );
            let start: &[u8] =
                [&b"SIMPLE  =   T"[..], b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", b"\x1f\x8b", b"name = \"a\"\n", b""][chance.below(5)];
            let length = if chance.below(4) == 0 { chance.next() as u32 } else { header.len() as u32 };
            Message::binary([&length.to_le_bytes(), header.as_bytes(), start, &chance.bytes(200)].concat())
        }
        _ => {
            spoil(&mut value, chance);
            Message::text(value.to_string())
        }
    }
}

#[test]
fn hostile_messages_end_no_tab_and_do_not_pile_up() {
    let count = std::env::var("CITTERT_FUZZ").ok().map_or(MESSAGES, |n| n.parse().unwrap());
    let d = Designer::start(&[]);
    let mut tab = d.tab();
    // The answers are read and thrown away, so that the program need not wait.
    let mut copy = tab.socket.get_ref().try_clone().unwrap();
    copy.set_read_timeout(None).unwrap();
    let reader = std::thread::spawn(move || while copy.read(&mut [0; 65_536]).is_ok_and(|n| n > 0) {});
    let (good, mut chance, mut warm) = (good(), Chance(1), 0);
    let round = count.div_ceil(ROUNDS);
    for k in 0..count {
        if k % round == 0 {
            chance = Chance(1);
        }
        if k == 2 * round {
            warm = d.memory_kb();
        }
        tab.send(message(&good, &mut chance));
    }
    let (end, mut other) = (d.memory_kb(), d.tab());
    let shown = other.show(&airport(5, 16), false);
    assert!(shown.contains_key("done") && shown.contains_key("dirty"), "{:?}", shown.keys());
    assert!(end < warm + KEPT_KB, "{warm} kB after two rounds of messages, {end} kB at the end");
    println!("{count} messages: {warm} kB after two rounds of them, {end} kB at the end");
    tab.socket.get_ref().shutdown(std::net::Shutdown::Both).unwrap();
    reader.join().unwrap();
}

#[test]
fn limits_are_refused_with_a_clear_word() {
    let d = Designer::start(&[]);
    let mut tab = d.tab();
    let mut refused = |change: &dyn Fn(&mut Value), words: &[&str]| {
        let mut state = airport(5, 16);
        change(&mut state);
        let text = tab.refused(&state);
        assert!(words.iter().all(|w| text.contains(w)), "{words:?} are not in {text:?}");
    };
    refused(&|s| s["layout"] = ring(10_001, 0.25), &["10001 antennas", "at most 10000"]);
    refused(&|s| s["layout"] = ring(1, 0.25), &["two antennas"]);
    refused(&|s| s["image"]["size"] = 4097.into(), &["4097 x 4097", "4096 x 4096"]);
    refused(&|s| s["scene"]["scene-size"] = 4097.into(), &["4097 x 4097"]);
    refused(
        &|s| {
            s["layout"] = ring(100, 0.25);
            s["simulate"]["channels"] = 20_000.into();
        },
        &["99000000 visibilities", "fewer"],
    );
    refused(&|s| s["simulate"]["channels"] = "many".into(), &["many", "expected usize"]);
    refused(&|s| s["simulate"] = json!({}), &["freq"]);
    refused(&|s| s["simulate"]["element-file"] = "/etc/passwd".into(), &["the page does not set element-file"]);
    refused(&|s| s["scene"]["file"] = "/etc/passwd".into(), &["there is no scene"]);
    refused(&|s| s["scene"]["file"] = "../airport.toml".into(), &["there is no scene"]);
    refused(&|s| s["seed"] = u64::MAX.into(), &["seed"]);
    refused(&|s| s["clean"] = json!({ "mask": "/etc/passwd" }), &["the page does not set mask"]);
    refused(&|s| s["simulate"]["hour-angle"] = "-1h,1h".into(), &["hour-angle"]);
    let text =
        tab.ask(&json!({ "do": "make", "make": { "kind": "ring", "elements": 10_001, "aperture": "1m" } }), "layout")["text"].to_string();
    assert!(text.contains("10001 elements"), "{text}");
    // Pictures that would be too large once they are unpacked.
    let mut png = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR".to_vec();
    png.extend([0, 0, 0x40, 0, 0, 0, 0x40, 0, 8, 0, 0, 0, 0]);
    tab.drop_file(&json!({ "kind": "scene", "name": "large.png" }), &png);
    let text = tab.until("scenes")["text"].to_string();
    assert!(text.contains("large.png") && text.contains("16384 x 16384"), "{text}");
    tab.drop_file(&json!({ "kind": "scene", "name": "s.fits.gz" }), &[0x1f, 0x8b, 8]);
    assert!(tab.until("scenes")["text"].to_string().contains("unpack it first"));
}

#[test]
fn messages_and_files_that_are_too_long_are_refused() {
    let d = Designer::start(&[]);
    let mut tab = d.tab();
    tab.send(Message::text(" ".repeat(9 << 20)));
    assert!(tab.until("none")["text"].as_str().unwrap().contains("too long"));
    tab.drop_file(&json!({ "kind": "scene", "name": "long.csv" }), &vec![b'x'; 100_000_001]);
    let text = tab.until("scenes")["text"].to_string();
    assert!(text.contains("long.csv") && text.contains("at most 100 MB"), "{text}");
    // Much more is not even read: the socket closes.
    let mut other = d.tab();
    other.socket.get_ref().set_write_timeout(Some(Duration::from_secs(20))).unwrap();
    let sent = other.socket.send(Message::binary(vec![0; 120_000_000]));
    let closed = sent.is_err() || (0..10).any(|_| other.socket.read().is_err());
    assert!(closed);
    assert!(tab.show(&airport(5, 16), false).contains_key("done"));
}

/// Tabs that do not read their answers stop only themselves.
#[test]
fn a_tab_that_does_not_read_keeps_nobody_waiting() {
    let d = Designer::start(&[]);
    let mut deaf: Vec<Tab> = (0..3).map(|_| d.tab()).collect();
    for tab in &mut deaf {
        for seq in 0..40 {
            let message = json!({ "do": "show", "seq": seq, "moving": true, "state": airport(5, 256) });
            tab.socket.get_ref().set_write_timeout(Some(Duration::from_millis(200))).unwrap();
            if tab.socket.send(Message::text(message.to_string())).is_err() {
                break;
            }
        }
    }
    let mut tab = d.tab();
    assert!(tab.show(&airport(5, 32), false).contains_key("done"));
}
