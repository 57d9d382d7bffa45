//! `film`: films of a flight in all formats, and the study of the frame rate.

use crate::program::Scratch;
use std::io::Cursor;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

/// A flight around the tank: 2 s at 10 frames per second.
fn scratch() -> Scratch {
    let s = Scratch::new();
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("phenomenology/scenes/t-72.toml");
    s.write(
        "path.toml",
        format!(
            "scene = {:?}\nframes_per_second = 10\n[[key]]\ntime_s = 1\nposition_m = [12, -9, 5]\nlook_at_m = [0, 0, 1]\n\
             [[key]]\ntime_s = 3\nposition_m = [9, -12, 5]\nlook_at_m = [0, 0, 1]\n",
            scene.display().to_string()
        ),
    );
    s
}

/// A folder with a program ffmpeg that does this.
fn with_ffmpeg(s: &Scratch, script: &str) -> String {
    let folder = s.path("bin");
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("ffmpeg");
    std::fs::write(&path, format!("#!/bin/sh\nfor last; do :; done\n{script}\n")).unwrap();
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
    format!("{}:/usr/bin:/bin", folder.display())
}

fn command(s: &Scratch, line: &str, path: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_cittert"));
    command.current_dir(s.path("")).args(line.split_whitespace()).env("PATH", path);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

fn err(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Names in the folder without that of the program.
fn files(s: &Scratch) -> Vec<String> {
    s.names().into_iter().filter(|n| n != "bin").collect()
}

/// The frames of an animated PNG as levels, and the time of a frame as a fraction of a second.
fn frames(path: &Path) -> (Vec<Vec<u8>>, (u16, u16)) {
    let mut decoder = png::Decoder::new(Cursor::new(std::fs::read(path).unwrap()));
    decoder.set_transformations(png::Transformations::IDENTITY);
    let mut reader = decoder.read_info().unwrap();
    let count = reader.info().animation_control.unwrap().num_frames;
    let mut out = Vec::new();
    let mut delay = (0, 0);
    for _ in 0..count {
        let mut levels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut levels).unwrap();
        let control = reader.info().frame_control.unwrap();
        delay = (control.delay_num, control.delay_den);
        out.push(levels);
    }
    (out, delay)
}

/// Delays of the frames of a GIF, hundredths of a second, by a walk over its blocks.
fn gif_delays(bytes: &[u8]) -> Vec<u16> {
    assert_eq!(&bytes[..6], b"GIF89a");
    let mut at = 13 + 768;
    let mut delays = Vec::new();
    let skip = |mut at: usize| {
        while bytes[at] != 0 {
            at += 1 + usize::from(bytes[at]);
        }
        at + 1
    };
    let mut images = 0;
    loop {
        match bytes[at] {
            0x21 => {
                if bytes[at + 1] == 0xf9 {
                    delays.push(u16::from_le_bytes([bytes[at + 4], bytes[at + 5]]));
                }
                at = skip(at + 2);
            }
            0x2c => {
                images += 1;
                at = skip(at + 11);
            }
            0x3b => break,
            other => panic!("a block of kind {other:#x}"),
        }
    }
    assert_eq!((at + 1, images), (bytes.len(), delays.len()));
    delays
}

#[test]
fn an_animated_png_holds_the_frames_at_their_rate_with_their_noise() {
    let s = scratch();
    let said = s.json("film path.toml --size 48 --tsys 5000K --bandwidth 1GHz --detectors 48 --black 100K --white 300K -o f.png");
    assert_eq!((said["frames"].as_u64(), said["rate_hz"].as_f64()), (Some(21), Some(10.0)), "{said}");
    // 48 receivers look at 48 pixels each in 0.1 s.
    let nedt = 5000.0 / (1e9_f64 * 0.1 / 48.0).sqrt();
    assert!((said["nedt_k"].as_f64().unwrap() / nedt - 1.0).abs() < 1e-9, "{said}");
    let (noisy, delay) = frames(&s.path("f.png"));
    assert_eq!((noisy.len(), noisy[0].len(), delay), (21, 48 * 48, (1, 10)));
    s.ok("film path.toml --size 48 --black 100K --white 300K --frames 3 -o clean.png");
    let (clean, _) = frames(&s.path("clean.png"));
    assert_eq!(clean.len(), 3);
    let rms = |a: &[u8], b: &[u8]| {
        // Levels that are clipped tell nothing of the noise.
        let inner: Vec<f64> = a.iter().zip(b).filter(|(_, b)| (20..235).contains(*b)).map(|(a, b)| f64::from(*a) - f64::from(*b)).collect();
        (inner.iter().map(|d| d * d).sum::<f64>() / inner.len() as f64).sqrt() * 200.0 / 255.0
    };
    for k in 0..3 {
        // Rounding to levels adds 0.5 %; the pixels that are not clipped are 2000, which leaves 1.6 %.
        let found = rms(&noisy[k], &clean[k]);
        assert!((found / nedt - 1.0).abs() < 0.06, "frame {k}: {found} K and not {nedt} K");
        assert!(clean[k] != clean[(k + 1) % 3]);
    }
    s.fails("film path.toml --size 48 -o f.png", 1, &["f.png", "exists already"]);
}

#[test]
fn a_film_does_not_depend_on_threads_and_its_seed_changes_the_noise() {
    let s = scratch();
    let noise = "[noise]\ntsys = \"800K\"\nknee = \"10Hz\"\ngain-drift = 0.01\n";
    s.write("sensor.toml", format!("[pupil]\naperture = \"circle=0.3m\"\n[scan]\nscan = \"raster\"\nbeams = 4\n{noise}"));
    let line = "film path.toml --size 32 --frames 7 --exposures 3 --steps median=3,clahe --show truth,filled";
    for camera in ["--tsys 800K --detectors 16", "--sensor sensor.toml"] {
        for (name, more) in [("a", "--threads 1"), ("b", "--threads 3"), ("c", "--seed 2")] {
            s.ok(&format!("{line} {camera} {more} --overwrite -o {name}.png"));
        }
        let of = |name: &str| frames(&s.path(name)).0;
        assert!(of("a.png") == of("b.png") && of("a.png") != of("c.png"), "{camera}");
    }
}

#[test]
fn a_gif_keeps_the_length_of_the_film() {
    let s = scratch();
    s.ok("film path.toml --size 24 --rate 7 -o f.gif");
    let delays = gif_delays(&std::fs::read(s.path("f.gif")).unwrap());
    // 15 frames from 1 s to 3 s; 100 / 7 hundredths are no whole number.
    assert_eq!((delays.len(), delays.iter().map(|d| u32::from(*d)).sum::<u32>()), (15, 214));
    s.fails("film path.toml --size 24 --rate 60 -o g.gif", 2, &["rate is 60", "at most 50"]);
}

#[test]
fn the_panels_of_truth_camera_and_interferometer_stand_side_by_side() {
    let s = scratch();
    s.write("sensor.toml", "[pupil]\naperture = \"circle=0.5m\"\n[noise]\ntsys = \"500K\"\n");
    s.ok("layout make y --elements 21 --aperture 0.3m -o y.toml");
    let line =
        "film path.toml --size 64 --frames 3 --show truth,filled,array --layout y.toml --bandwidth 4GHz --array-without-noise --every 2";
    let said = s.json(&format!("{line} --sensor sensor.toml --steps richardson-lucy=3 -o side.png"));
    assert_eq!(said["size"], serde_json::json!([3 * 64 + 8, 64 + 26]));
    assert_eq!(said["panels"], serde_json::json!(["truth", "filled aperture", "interferometer"]));
    assert!(said["dwell_s"] == 0.1 && said["nedt_k"].as_f64().unwrap() > 0.0, "{said}");
    let (all, _) = frames(&s.path("side.png"));
    let panel = |k: usize, n: usize| -> Vec<u8> { all[k].chunks(200).skip(26).flat_map(|row| row[68 * n..68 * n + 64].to_vec()).collect() };
    // The interferometer holds its image for two frames; the others move.
    assert!(panel(0, 2) == panel(1, 2) && panel(1, 2) != panel(2, 2));
    assert!(panel(0, 0) != panel(1, 0) && panel(0, 1) != panel(1, 1) && panel(0, 0) != panel(0, 1));
    s.fails("film path.toml --show filled,array -o n.png", 2, &["--layout"]);
    s.fails("film path.toml --layout mm-y -o n.png", 2, &["--layout", "--show"]);
    s.fails("film path.toml --size 32 --show array --layout vla-d -o n.png", 1, &["boresight"]);
}

#[test]
fn frames_go_through_a_pipe_to_ffmpeg_and_its_file_gets_its_name_at_the_end() {
    let s = scratch();
    let path = with_ffmpeg(&s, "echo \"$@\" > words; cat > \"$last\"");
    for (name, pixels) in [("f.mp4", 1), ("f.webm --colors inferno", 3)] {
        let out = command(&s, &format!("film path.toml --size 32 --frames 6 -o {name}"), &path).output().unwrap();
        assert!(out.status.success(), "{}", err(&out));
        let name = name.split(' ').next().unwrap();
        assert_eq!(std::fs::metadata(s.path(name)).unwrap().len(), 6 * 32 * 32 * pixels);
        let words = std::fs::read_to_string(s.path("words")).unwrap();
        assert!(words.contains("-framerate 10/1") && words.contains("-video_size 32x32"), "{words}");
    }
    assert_eq!(files(&s), ["f.mp4", "f.webm", "path.toml", "words"]);
}

#[test]
fn a_missing_and_a_failing_ffmpeg_are_told_and_leave_nothing() {
    let s = scratch();
    let line = "film path.toml --size 32 -o f.mp4";
    let out = command(&s, line, "/nowhere").output().unwrap();
    assert_eq!(out.status.code(), Some(1));
    for word in ["f.mp4", "install the package ffmpeg", "animated PNG"] {
        assert!(err(&out).contains(word), "{word}: {}", err(&out));
    }
    // One that fails at once, and one that dies while it gets frames.
    for script in ["echo first >&2; echo 'No space left' >&2; exit 3", "head -c 2000 > \"$last\"; echo 'No space left' >&2; kill -9 $$"] {
        let path = with_ffmpeg(&s, script);
        let out = command(&s, line, &path).output().unwrap();
        assert_eq!(out.status.code(), Some(1), "{}", err(&out));
        assert!(
            err(&out).contains("ffmpeg failed") && err(&out).contains("No space left") && !err(&out).contains("first"),
            "{}",
            err(&out)
        );
    }
    assert_eq!(files(&s), ["path.toml"]);
}

/// Wait until a condition holds.
fn wait(what: &str, holds: impl Fn() -> bool) {
    let begun = Instant::now();
    while !holds() {
        assert!(begun.elapsed() < Duration::from_secs(60), "{what}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn a_film_that_is_ended_leaves_no_file_under_its_name_and_no_child() {
    let s = scratch();
    let path = with_ffmpeg(&s, "echo $$ > pid; exec cat > \"$last\"");
    let line = "film path.toml --size 64 --rate 1000 -o f.mp4";
    for signal in ["TERM", "INT", "KILL"] {
        let mut child = command(&s, line, &path).spawn().unwrap();
        wait("the encoder starts", || std::fs::read_to_string(s.path("pid")).is_ok_and(|t| t.ends_with('\n')));
        let pid = std::fs::read_to_string(s.path("pid")).unwrap().trim().to_owned();
        std::thread::sleep(Duration::from_millis(50));
        assert!(child.try_wait().unwrap().is_none(), "the film was made before it was ended");
        assert!(Command::new("kill").args([format!("-{signal}"), child.id().to_string()]).status().unwrap().success());
        assert!(!child.wait().unwrap().success());
        // A process that nobody has waited for yet has ended too.
        let state = || std::fs::read_to_string(Path::new("/proc").join(&pid).join("stat")).unwrap_or_default();
        wait("the encoder ends", || state().is_empty() || state().contains(") Z"));
        std::fs::remove_file(s.path("pid")).unwrap();
        assert!(!s.path("f.mp4").exists(), "{signal}");
        if signal != "KILL" {
            assert_eq!(files(&s), ["path.toml"], "{signal}");
        }
    }
    // What a killed run has left is removed by the next one of that name.
    let out = command(&s, "film path.toml --size 32 --frames 2 -o f.mp4", &path).output().unwrap();
    assert!(out.status.success(), "{}", err(&out));
    assert_eq!(files(&s), ["f.mp4", "path.toml", "pid"]);
}

#[test]
fn the_study_of_the_frame_rate_follows_its_laws() {
    let s = scratch();
    let line = "film path.toml --size 64 --tsys 1500K --bandwidth 1GHz --detectors 64 --rates 100,1,25,4 --target 32,32,9 --seeds 4";
    let said = s.json(&format!("{line} -o study.csv"));
    let rows = said["rates"].as_array().unwrap();
    let of = |k: usize, key: &str| rows[k][key].as_f64().unwrap_or_else(|| panic!("{key} of row {k}: {said}"));
    let rates: Vec<f64> = (0..4).map(|k| of(k, "rate_hz")).collect();
    assert_eq!(rates, [1.0, 4.0, 25.0, 100.0]);
    for (k, rate) in rates.iter().enumerate() {
        let nedt = 1500.0 / (1e9 / 64.0 / rate).sqrt();
        assert!((of(k, "nedt_k") / nedt - 1.0).abs() < 1e-9 && (of(k, "noise_k") / nedt - 1.0).abs() < 0.03, "{said}");
        assert!((of(k, "blur_px") * rate / of(0, "blur_px") - 1.0).abs() < 1e-9);
    }
    // From 25 to 100 per second nothing is blurred any more, so the signal to noise falls with the root of the rate.
    assert!((of(2, "snr") / of(3, "snr") - 2.0).abs() < 0.1, "{said}");
    assert!(rates.contains(&said["best_rate_hz"].as_f64().unwrap()) && said["best_by"] == "contrast of the target", "{said}");
    let csv = std::fs::read_to_string(s.path("study.csv")).unwrap();
    assert!(csv.starts_with("rate_hz,dwell_s,nedt_k,noise_k,snr,blur_px,") && csv.lines().count() == 5, "{csv}");
    assert!(std::fs::read(s.path("study.png")).unwrap().starts_with(b"\x89PNG"));
    let rubber = s.json("film path.toml --size 64 --tsys 1500K --rates 5,25 --target-surface rubber --mode full -o rubber.csv");
    assert!(rubber["rates"][0]["target_difference_k"].as_f64().unwrap().abs() > 1.0, "{rubber}");
    s.ok("layout make y --elements 21 --aperture 0.3m --diameter 10mm --tsys 600K -o y.toml");
    let array =
        s.json("film path.toml --size 48 --bandwidth 4GHz --rates 10,40 --target 24,24,7 --show array --layout y.toml -o array.csv");
    let (slow, fast) = (&array["rates"][0], &array["rates"][1]);
    let ratio = |key: &str| fast[key].as_f64().unwrap() / slow[key].as_f64().unwrap();
    assert!(array["studied"] == "interferometer" && slow["dwell_s"] == 0.1, "{array}");
    // A dirty image is linear, and the scatter over 8 frames of some hundred beams is known to some percent.
    assert!((ratio("nedt_k") - 2.0).abs() < 1e-9 && (ratio("noise_k") - 2.0).abs() < 0.15, "{array}");
    let again = s.json(&format!("{line} --threads 1 -o again.csv"));
    assert_eq!(again["rates"], said["rates"]);
}

#[test]
fn wrong_calls_are_refused_with_the_reason() {
    let s = scratch();
    let fails = |options: &str, code: i32, words: &[&str]| {
        s.fails(&format!("film path.toml --size 32 {options}"), code, words);
    };
    fails("-o f.avi", 2, &["f.avi", ".png, .apng, .gif, .mp4 or .webm"]);
    fails("-o f", 2, &[".webm"]);
    fails("--rate 0 -o f.png", 2, &["--rate is 0"]);
    fails("--rate 5000 -o f.png", 2, &["--rate is 5000", "0.001 to 1000"]);
    fails("--frames 0 -o f.png", 2, &["--frames"]);
    fails("--every 0 -o f.png", 2, &["--every"]);
    fails("--exposures 0 -o f.png", 2, &["--exposures"]);
    fails("--show truth,truth -o f.png", 2, &["--show", "each panel once"]);
    fails("--show sky -o f.png", 2, &["sky", "truth"]);
    s.fails("film path.toml --size 20000 --frames 1 -o f.png", 2, &["20000 x 20000 pixels", "16384"]);
    s.fails("film path.toml --size 300000 -o f.png", 1, &["300000"]);
    fails("--steps lanczos=16,lanczos=16,bilinear=4 --frames 1 -o f.png", 2, &["32768"]);
    fails("--tsys 500 -o f.png", 2, &["500", "K"]);
    fails("--tsys 0K -o f.png", 2, &["--tsys"]);
    fails("--detectors 0 -o f.png", 2, &["--detectors"]);
    fails("--black 300K --white 200K -o f.png", 2, &["white is 200", "300"]);
    fails("--steps sharpen -o f.png", 2, &["sharpen", "unsharp"]);
    fails("--steps richardson-lucy -o f.png", 2, &["--psf", "--sensor"]);
    fails("--seeds 3 -o f.png", 2, &["--rates"]);
    fails("--target 3,3,1 -o f.png", 2, &["--rates"]);
    fails("--pol XX,YY -o f.png", 2, &["one plane"]);
    // Studies.
    fails("--rates 1,2 --tsys 500K -o f.png", 2, &["f.png", ".csv"]);
    fails("--rates 1,2 -o f.csv", 2, &["--tsys"]);
    fails("--rates 1,-2 --tsys 500K -o f.csv", 2, &["rates is -2"]);
    fails("--rates 1,x --tsys 500K -o f.csv", 2, &["number"]);
    fails("--rates 1 --seeds 1 --tsys 500K -o f.csv", 2, &["--seeds is 1"]);
    fails("--rates 1 --show truth --tsys 500K -o f.csv", 2, &["--show", "--rates"]);
    fails("--rates 1 --show filled,array --tsys 500K -o f.csv", 2, &["--show", "--rates"]);
    fails("--rates 1 --show array --tsys 500K -o f.csv", 2, &["--layout"]);
    fails("--rates 1 --layout mm-y --tsys 500K -o f.csv", 2, &["--layout", "--show"]);
    fails("--rates 1 --array-image mem --tsys 500K -o f.csv", 2, &["--array-image", "--show array"]);
    fails("--rates 1 --show array --layout mm-y --steps median=3 -o f.csv", 2, &["--steps", "--show array"]);
    fails("--rates 1 --show array --layout mm-y --array-without-noise -o f.csv", 2, &["--array-without-noise"]);
    fails("--rates 1 --rate 5 --tsys 500K -o f.csv", 2, &["--rate", "--rates"]);
    fails("--rates 1 --at 9s --tsys 500K -o f.csv", 2, &["--at is 9 s", "1 s to 3 s"]);
    fails("--rates 1 --target-surface chalk --tsys 500K -o f.csv", 2, &["chalk", "expected a surface of the scene", "rubber"]);
    fails("--rates 1 --target-surface rubber --target 3,3,1 --tsys 500K -o f.csv", 1, &["--target-surface rubber", "no pixel shows"]);
    fails("--rates 1 --target 40,3,5 --tsys 500K -o f.csv", 2, &["--target", "32 x 32 pixels"]);
    // Files.
    s.write("sensor.toml", "[pupil]\naperture = \"circle=0.5m\"\n[scan]\nspeed = 3\n");
    fails("--sensor sensor.toml -o f.png", 1, &["sensor.toml", "line 4", "speed"]);
    s.write("sensor.toml", "[pupil]\naperture = \"circle=0.5m\"\n");
    fails("--sensor sensor.toml --tsys 500K -o f.png", 2, &["--tsys", "--sensor"]);
    fails("--sensor nowhere.toml -o f.png", 1, &["nowhere.toml"]);
    s.write("sensor.toml", "[noise]\ntsys = \"500K\"\n");
    fails("--sensor sensor.toml -o f.png", 1, &["sensor.toml", "aperture"]);
    s.fails("film nowhere.toml -o f.png", 1, &["nowhere.toml"]);
    s.write("half.toml", "frames_per_second = 10\n[[key]]\ntime_s = 0\n");
    s.fails("film half.toml -o f.png", 1, &["half.toml"]);
    assert_eq!(s.names(), ["half.toml", "path.toml", "sensor.toml"]);
}
