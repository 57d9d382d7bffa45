//! `enhance`: chains of steps from the command line and from files.

use crate::program::Scratch;
use serde_json::Value;

/// A scene in kelvin with a warm disc, and two noisy frames of it.
fn scratch() -> Scratch {
    let s = Scratch::new();
    let scene = "name = \"disc\"\nkind = \"analytic\"\n[background]\ntemperature_k = 280.0\n[[shape]]\ntype = \"ellipse\"\n\
                 center_deg = [0.3, -0.2]\nsize_deg = [1.2, 1.2]\ntemperature_k = 310.0\n";
    s.write("scene.toml", scene);
    s.ok("scene render scene.toml --scene-size 48 --scene-cell 1mrad -o truth.fits");
    s
}

fn number(v: &Value, key: &str) -> f64 {
    v[key].as_f64().unwrap_or_else(|| panic!("{key} is not a number in {v}"))
}

/// Change every pixel of a FITS image of `n` x `n` 32-bit values.
fn change(s: &Scratch, from: &str, to: &str, n: usize, of: impl Fn(usize, f32) -> f32) {
    let mut bytes = std::fs::read(s.path(from)).unwrap();
    let header = bytes.chunks(80).position(|card| card.starts_with(b"END     ")).unwrap() * 80;
    let start = (header / 2880 + 1) * 2880;
    for (k, value) in bytes[start..start + 4 * n * n].chunks_mut(4).enumerate() {
        let old = f32::from_be_bytes([value[0], value[1], value[2], value[3]]);
        value.copy_from_slice(&of(k, old).to_be_bytes());
    }
    s.write(to, bytes);
}

/// Numbers that look random, in [-1.7, 1.7) with a standard deviation of 1.
fn noise(k: usize, seed: u64) -> f32 {
    let mut x = (k as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ seed.wrapping_mul(0xD1B5_4A32_D192_ED03);
    x ^= x >> 31;
    x = x.wrapping_mul(0x7FB5_D329_728E_A185);
    x ^= x >> 27;
    ((x >> 40) as f32 / (1 << 23) as f32 - 1.0) * 3.0_f32.sqrt()
}

#[test]
fn frames_are_averaged_and_the_figures_say_what_was_gained() {
    let s = scratch();
    for seed in 0..4 {
        change(&s, "truth.fits", &format!("f{seed}.fits"), 48, |k, v| v + noise(k, seed));
    }
    let c = s.json("enhance f0.fits f1.fits f2.fits f3.fits --steps average,tv=0.5K --truth truth.fits --target 29,20.5,8 -o o.fits");
    let (before, after) = (&c["before"], &c["after"]);
    // A tenth of the pixels lie at the edge of the disc, which lifts the median by 13 %; the rest is the spread of 2116 pixels.
    assert!((0.9..1.25).contains(&number(before, "noise")), "{c}");
    assert!(number(after, "noise") < 0.3 && number(after, "snr") > 3.0 * number(before, "snr"), "{c}");
    assert!(number(after, "rms_difference") < 0.5 * number(before, "rms_difference"), "{c}");
    assert!(number(after, "ssim") > number(before, "ssim"), "{c}");
    // The target is 30 K above its background.
    assert!((number(after, "target_difference") - 30.0).abs() < 1.0, "{c}");
    assert!((number(after, "mean") - number(before, "mean")).abs() < 0.2, "{c}");
    assert_eq!((c["unit"].as_str(), c["n_frames"].as_u64()), (Some("K"), Some(4)));
    let info = s.json("info o.fits");
    assert_eq!(info["unit"], "K");
    assert!(std::fs::read(s.path("o.png")).unwrap().starts_with(b"\x89PNG"));
    let said = s.ok("enhance f0.fits --steps median --truth truth.fits --target 29,20.5,8 --no-png -o p.fits");
    for words in ["before", "noise", "target over clutter", "SSIM", " K"] {
        assert!(said.out.contains(words), "{words}: {}", said.out);
    }
    assert!(!s.path("p.png").exists());
}

#[test]
fn a_file_has_the_options_and_the_command_line_the_last_word() {
    let s = scratch();
    std::fs::create_dir(s.path("sub")).unwrap();
    s.write("sub/steps.toml", "steps = [\"median=5\", { step = \"bicubic\", factor = 2 }]\ntruth = \"../truth.fits\"\n");
    let c = s.json("enhance truth.fits --config sub/steps.toml -o a.fits --no-png");
    assert_eq!(c["steps"], serde_json::json!(["median=5", "bicubic=2"]));
    assert_eq!(c["size"], serde_json::json!([96, 96]));
    assert!((number(&c, "cell_rad") - 5e-4).abs() < 1e-12 && number(&c["after"], "ssim") > 0.9, "{c}");
    let c = s.json("enhance truth.fits --config sub/steps.toml --steps clahe -o b.fits --no-png");
    assert_eq!(c["steps"], serde_json::json!(["clahe"]));
    s.write("bad.toml", "steps = \"median\"\nsharpness = 3\n");
    s.fails("enhance truth.fits --config bad.toml -o c.fits", 1, &["bad.toml", "line 2", "sharpness"]);
    s.write("bad.toml", "target = \"1,2,3\"\nsteps = [\"median\", { step = \"tv\", wait = 3 }]\n");
    s.fails("enhance truth.fits --config bad.toml -o c.fits", 1, &["bad.toml", "line 2", "wait", "weight"]);
}

#[test]
fn the_bytes_of_the_data_do_not_depend_on_the_number_of_threads() {
    let s = scratch();
    change(&s, "truth.fits", "f.fits", 48, |k, v| v + noise(k, 7));
    let data = |threads: usize| {
        let name = format!("t{threads}.fits");
        s.ok(&format!("enhance f.fits --threads {threads} --steps nl-means=1K,fourier=2,clahe,sobel --no-png -o {name}"));
        let bytes = std::fs::read(s.path(&name)).unwrap();
        bytes[bytes.len() - 4 * 96 * 96..].to_vec()
    };
    assert!(data(1) == data(3));
}

#[test]
fn wrong_calls_have_one_clear_message_each() {
    let s = scratch();
    s.fails("enhance truth.fits -o o.fits", 2, &["--steps", "--config"]);
    s.fails("enhance truth.fits --steps sharpen -o o.fits", 2, &["sharpen", "the steps are", "unsharp"]);
    s.fails("enhance truth.fits --steps median=4 -o o.fits", 2, &["window", "odd number"]);
    s.fails("enhance truth.fits --steps bilinear=0 -o o.fits", 2, &["factor", "2 to 16"]);
    s.fails("enhance truth.fits --steps tv=0.5 -o o.fits", 2, &["tv=0.5", "0.5K"]);
    s.fails("enhance truth.fits --steps tv=5mJy -o o.fits", 2, &["5mJy", "temperature"]);
    s.fails("enhance truth.fits --steps bandpass=290K:280K -o o.fits", 2, &["290", "below the high"]);
    s.fails("enhance truth.fits --steps median --target 60,20,4 -o o.fits", 2, &["--target", "60,20,4", "48 x 48 pixels"]);
    s.fails("enhance truth.fits --steps median --target 60,20 -o o.fits", 2, &["X,Y,R"]);
    s.fails("enhance truth.fits truth.fits --steps median -o o.fits", 1, &["truth.fits", "2 frames", "average"]);
    s.fails("enhance truth.fits --steps median -o o.png", 2, &["o.png", "FITS"]);
    s.fails("enhance truth.fits --steps median -o truth.fits --overwrite", 2, &["truth.fits", "is the input"]);
    s.fails("enhance truth.fits --steps richardson-lucy -o o.fits", 2, &["--psf"]);
    s.fails("enhance truth.fits --steps median --psf truth.fits -o o.fits", 2, &["--psf", "no step"]);
    s.fails("enhance nowhere.fits --steps median -o o.fits", 1, &["nowhere.fits"]);
    change(&s, "truth.fits", "blank.fits", 48, |k, v| if k < 5 { f32::NAN } else { v });
    s.fails("enhance blank.fits --steps median -o o.fits", 1, &["blank.fits", "5 of 2304 pixels are blank"]);
    s.ok("scene render scene.toml --scene-size 16 --scene-cell 2mrad -o psf.fits");
    s.fails("enhance truth.fits --steps richardson-lucy --psf psf.fits -o o.fits", 1, &["the PSF has cells", "1.000000e-3"]);
    assert_eq!(s.names(), ["blank.fits", "psf.fits", "scene.toml", "truth.fits"]);
}

#[test]
fn the_help_lists_every_step() {
    let said = Scratch::new().ok("enhance --help");
    for kind in cittert::enhance::STEPS {
        assert!(said.out.contains(&kind.syntax()), "{}", kind.name);
    }
}
