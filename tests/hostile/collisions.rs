//! Outputs that are inputs, or other outputs, under any name: 200 random cases over all subcommands that write. Each is refused, and every input
//! stays as it is, bit for bit.

use crate::program::Scratch;
use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;
use std::path::Path;

const CASES: usize = 200;

/// A command line that reads `inputs`. `@` stands for an output. Where there is none, the files `made` are outputs by the rules of the command.
struct Line {
    words: &'static str,
    inputs: &'static [&'static str],
    made: &'static [&'static str],
}

const fn direct(words: &'static str, inputs: &'static [&'static str]) -> Line {
    Line { words, inputs, made: &[] }
}

const fn prefix(words: &'static str, inputs: &'static [&'static str], made: &'static [&'static str]) -> Line {
    Line { words, inputs, made }
}

const CLEAN: &[&str] = &["o-psf.fits", "o-dirty.fits", "o-model.fits", "o-residual.fits", "o-image.fits", "o-components.csv"];
const MEM: &[&str] = &["o-model.fits", "o-residual.fits", "o-image.fits", "o-uncertainty.fits"];
const SELFCAL: &[&str] =
    &["o.uvh5", "o.calh5", "o-rounds.jsonl", "o-components.csv", "o-psf.fits", "o-image.fits", "o-round0-image.fits", "o-round1.calh5"];

const LINES: &[Line] = &[
    prefix("clean v.uvh5 --mask d.fits -o o", &["v.uvh5", "d.fits"], CLEAN),
    direct("clean v.uvh5 --mask d.fits -o p --log @", &["v.uvh5", "d.fits"]),
    prefix("mem v.uvh5 --prior d.fits -o o", &["v.uvh5", "d.fits"], MEM),
    direct("mem v.uvh5 --mask d.fits -o p --log @", &["v.uvh5", "d.fits"]),
    prefix("mem v.uvh5 --terms vis -o o", &["v.uvh5"], &["o-model.fits", "o-image.fits", "o-spread.fits"]),
    prefix("selfcal v.uvh5 --model d.fits -o o", &["v.uvh5", "d.fits"], SELFCAL),
    direct("corrupt v.uvh5 --config e.toml -o @", &["v.uvh5", "e.toml"]),
    direct("corrupt v.uvh5 --config e.toml -o c.uvh5 --gains @", &["v.uvh5", "e.toml"]),
    prefix("corrupt v.uvh5 --phase-rms 1rad -o o.uvh5", &["v.uvh5"], &["o.calh5"]),
    direct("applycal v.uvh5 g.calh5 -o @", &["g.calh5"]),
    direct("focus v.uvh5 --range 10m -o @", &["v.uvh5"]),
    direct("focus v.uvh5 --range 10m -o f.uvh5 --map @", &["v.uvh5"]),
    direct("predict v.uvh5 --model s.csv -o @", &["v.uvh5", "s.csv"]),
    direct("predict v.uvh5 --model s.csv --into model -o @", &["s.csv"]),
    direct("simulate --layout l.toml --scene s.csv --freq 94GHz --bandwidth 1GHz -o @", &["l.toml", "s.csv"]),
    direct("grid v.uvh5 -o @", &["v.uvh5"]),
    direct("beam v.uvh5 -o @", &["v.uvh5"]),
    direct("dirty v.uvh5 -o @", &["v.uvh5"]),
    direct("closure v.uvh5 -o @", &["v.uvh5"]),
    direct("closure v.uvh5 --plot @", &["v.uvh5"]),
    direct("closure v.uvh5 --plot-amplitudes @", &["v.uvh5"]),
    direct("convert v.uvh5 @", &["v.uvh5"]),
    direct("convert g.calh5 @", &["g.calh5"]),
    direct("convert d.fits @", &["d.fits"]),
    prefix("compare d.fits t.fits --difference o.fits", &["d.fits", "t.fits"], &["o.fits"]),
    prefix("compare d.fits t.fits --fidelity o.fits", &["d.fits", "t.fits"], &["o.fits"]),
    direct("enhance d.fits --steps median --truth t.fits -o @", &["d.fits", "t.fits"]),
    prefix("enhance d.fits --steps median --truth t.fits -o o.fits", &["d.fits", "t.fits"], &["o.png"]),
    prefix(
        "sensor d.fits --aperture circle=1m --truth t.fits -o o",
        &["d.fits", "t.fits"],
        &["o-image.fits", "o-psf.fits", "o-mtf.csv", "o-report.html"],
    ),
    prefix(
        "sensor d.fits --aperture circle=1m --beside t.fits -o o",
        &["d.fits", "t.fits"],
        &["o-nedt.fits", "o-ensquared.csv", "o-psf.png"],
    ),
    prefix("plot d.fits --like t.fits -o o.png", &["d.fits", "t.fits"], &["o.png"]),
    prefix("plot g.calh5 --truth g.calh5 -o o.pdf", &["g.calh5"], &["o.pdf"]),
    prefix("plot v.uvh5 --what model --model s.csv -o o.png", &["v.uvh5", "s.csv"], &["o.png"]),
    direct("mask l.toml --freq 94GHz --bandwidth 1GHz --size 64 --cell 1mrad -o @", &["l.toml"]),
    prefix("mask l.toml --freq 94GHz --bandwidth 1GHz --size 64 --cell 1mrad -o o.fits", &["l.toml"], &["o.png"]),
    direct("layout show l.toml --png @", &["l.toml"]),
    direct("layout convert l.toml --to casa -o @", &["l.toml"]),
    direct("scene render b.toml --scene-size 32 --scene-cell 1mrad -o @", &["b.toml"]),
    direct("scene render b.toml --scene-size 32 --scene-cell 1mrad --range @ -o r.fits", &["b.toml"]),
    direct("scene convert b.toml @", &["b.toml"]),
    direct("scene sky --atmosphere a.csv --freq 94GHz --plot @", &["a.csv"]),
    direct("scene path --atmosphere a.csv --freq 94GHz --observer 1km --plot @", &["a.csv"]),
    direct("film f.toml --size 8 --frames 1 --sensor n.toml -o @", &["f.toml", "b.toml", "n.toml"]),
    prefix("film f.toml --size 24 --rates 5 --tsys 500K -o o.csv", &["f.toml", "b.toml"], &["o.csv", "o.png"]),
    direct("run c.toml -o @", &["c.toml", "s.csv", "l.toml"]),
    direct("study u.toml -o @", &["u.toml", "s.csv", "l.toml"]),
];

/// Command lines with two outputs that are one file, `@` and `&`.
const PAIRS: &[&str] = &[
    "corrupt v.uvh5 --phase-rms 1rad -o @ --gains &",
    "focus v.uvh5 --range 10m -o @ --map &",
    "closure v.uvh5 -o @ --plot &",
    "closure v.uvh5 --plot-amplitudes @ --plot &",
    "compare d.fits t.fits --difference @ --fidelity &",
    "scene render b.toml --scene-size 32 --scene-cell 1mrad -o @ --range &",
    "scene render b.toml --scene-size 32 --scene-cell 1mrad -o r.fits --range @ --incidence &",
];

const CONFIG: &str = "layout = { name = \"l.toml\" }\nscene = { file = \"s.csv\" }\n[simulate]\nfreq = \"94GHz\"\nbandwidth = \"1GHz\"\n";

fn scratch() -> Scratch {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0.01,0.005,1.0\n");
    s.ok("layout convert mm-y -o l.toml");
    s.ok("simulate --layout l.toml --scene s.csv --freq 94GHz --bandwidth 1GHz -o v.uvh5");
    s.ok("corrupt v.uvh5 --phase-rms 1rad -o k.uvh5 --gains g.calh5");
    s.ok("dirty v.uvh5 --size 64 --cell 1mrad -o d.fits");
    s.ok("dirty k.uvh5 --size 64 --cell 1mrad -o t.fits");
    s.write("e.toml", "[[error]]\nphase-rms = \"10deg\"\n");
    s.write("c.toml", format!("title = \"x\"\n{CONFIG}"));
    s.write("u.toml", format!("title = \"x\"\nseeds = 1\n{CONFIG}[image]\nsize = 64\ncell = \"1mrad\"\n"));
    s.write("a.csv", "z_km,p_hpa,t_k,e_hpa\n0,1013,288,10\n5,540,256,2\n10,265,223,0.1\n20,55,217,0.01\n");
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("phenomenology/scenes/airport.toml");
    s.write("b.toml", std::fs::read(scene).unwrap());
    s.write("n.toml", "[pupil]\naperture = \"circle=1m\"\n");
    let key = |t: usize| format!("[[key]]\ntime_s = {t}\nposition_m = [-180, -230, {}]\nlook_at_m = [0, 60, 0]\n", 110 - t);
    s.write("f.toml", format!("scene = \"b.toml\"\nframes_per_second = 5\n{}{}", key(0), key(1)));
    std::fs::create_dir(s.path("sub")).unwrap();
    s
}

fn bytes(s: &Scratch) -> BTreeMap<String, Vec<u8>> {
    let files = s.names().into_iter().filter(|n| n != "sub");
    files.map(|n| (n.clone(), std::fs::read(s.path(&n)).unwrap())).collect()
}

/// Another spelling of the path of a file in the folder.
fn spelled(s: &Scratch, file: &str, rng: &mut ChaCha8Rng) -> String {
    match rng.random_range(0..4) {
        0 => file.to_owned(),
        1 => format!("./{file}"),
        2 => format!("sub/../{file}"),
        _ => s.path(file).display().to_string(),
    }
}

/// Lead the name `link` to `file`, by a symbolic or a hard link.
fn link(s: &Scratch, file: &str, link: &str, rng: &mut ChaCha8Rng) {
    if rng.random_bool(0.5) {
        std::os::unix::fs::symlink(file, s.path(link)).unwrap();
    } else {
        std::fs::hard_link(s.path(file), s.path(link)).unwrap();
    }
}

fn refused(s: &Scratch, before: &BTreeMap<String, Vec<u8>>, line: &str, linked: Option<&str>, words: &str) {
    s.fails(&format!("{line} --overwrite"), 2, &[words]);
    if let Some(name) = linked {
        std::fs::remove_file(s.path(name)).unwrap();
    }
    assert!(bytes(s) == *before, "{line}: a file was changed, made or lost: {:?}", s.names());
}

#[test]
fn no_output_replaces_an_input_or_another_output_under_any_name() {
    let s = scratch();
    let before = bytes(&s);
    let mut rng = ChaCha8Rng::seed_from_u64(40);
    for case in 0..CASES {
        // Every line has its turn. How its output meets an input is drawn.
        let line = &LINES[case % LINES.len()];
        if case % 5 == 4 {
            let words = PAIRS.choose(&mut rng).unwrap();
            let (a, b) = (spelled(&s, "z.fits", &mut rng), spelled(&s, "z.fits", &mut rng));
            refused(&s, &before, &words.replace('@', &a).replace('&', &b), None, "two outputs cannot go into one file");
            continue;
        }
        let input = line.inputs.choose(&mut rng).unwrap();
        let said = "this output is the input";
        match line.made.choose(&mut rng) {
            Some(name) => {
                link(&s, input, name, &mut rng);
                refused(&s, &before, line.words, Some(name), said);
            }
            None if rng.random_bool(0.5) => {
                let name = format!("linked.{}", input.rsplit('.').next().unwrap());
                link(&s, input, &name, &mut rng);
                refused(&s, &before, &line.words.replace('@', &spelled(&s, &name, &mut rng)), Some(&name), said);
            }
            None => refused(&s, &before, &line.words.replace('@', &spelled(&s, input, &mut rng)), None, said),
        }
    }
}
