//! `study`: Monte-Carlo over seeds and parameters, resumed after a kill.

use crate::program::Scratch;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const CONFIG: &str = r#"
title = "a small study"
seeds = 3
layout = { name = "mm-y", antennas = 12, choose = "random" }
scene = { points = [{ flux = "1Jy" }] }
[simulate]
freq = "94GHz"
bandwidth = "1GHz"
method = "dft"
[image]
size = 64
cell = "1mrad"
no-w = true
[clean]
niter = 1
gain = 1.0
[corrupt]
phase-rms = "5deg"
sefd = "1kJy"
[selfcal]
rounds = 1
start = "point"
solint = "inf"
[[axis]]
parameter = "corrupt.phase-rms"
values = ["5deg", "40deg"]
[[axis]]
parameter = "layout.antennas"
values = [12, 14]
"#;

fn scratch(config: &str) -> Scratch {
    let s = Scratch::new();
    s.write("c.toml", config);
    s
}

fn read(s: &Scratch, name: &str) -> String {
    std::fs::read_to_string(s.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// Values of a column of a table.
fn column(table: &str, name: &str) -> Vec<f64> {
    let mut lines = table.lines();
    let at = lines.next().unwrap().split(',').position(|h| h == name).unwrap_or_else(|| panic!("no column {name}"));
    lines.map(|l| l.split(',').nth(at).unwrap().parse().unwrap()).collect()
}

#[test]
fn tables_do_not_depend_on_threads_or_on_a_torn_journal() {
    let s = scratch(CONFIG);
    let json = s.json("--threads 1 study c.toml -o one");
    assert_eq!((json["trials"].as_u64(), json["failed"].as_u64(), json["resumed"].as_u64()), (Some(12), Some(0), Some(0)), "{json}");
    let said = s.ok("--threads 2 study c.toml -o two");
    assert!(said.err.contains("of 12 trials done, about"), "{}", said.err);
    for name in ["trials.csv", "summary.csv", "metrics.json", "study.h5", "report.html", "dynamic_range.png", "phase_rms_rad.png"] {
        assert!(s.path("one").join(name).exists(), "{name}");
    }
    let wanted = (read(&s, "one/trials.csv"), read(&s, "one/summary.csv"));
    assert_eq!(wanted, (read(&s, "two/trials.csv"), read(&s, "two/summary.csv")));
    let trials = &wanted.0;
    assert_eq!(column(trials, "corrupt.phase-rms_deg")[..7], [5.0, 5.0, 5.0, 5.0, 5.0, 5.0, 40.0]);
    assert_eq!(column(trials, "layout.antennas")[..4], [12.0, 12.0, 12.0, 14.0]);
    assert_eq!(column(trials, "seed")[..4], [1.0, 2.0, 3.0, 1.0]);
    let (before, after) = (column(trials, "nrmse_before"), column(trials, "nrmse_after"));
    assert!((6..12).all(|k| after[k] < 0.5 * before[k]), "{before:?} {after:?}");
    assert!(column(trials, "accepted").iter().all(|a| *a == 1.0) && column(&wanted.1, "accepted_fraction") == [1.0; 4]);

    // If a journal is cut in the middle of a line, the complete lines are kept and the other trials run again.
    let journal = read(&s, "two/journal.jsonl");
    let keep: usize = journal.split_inclusive('\n').take(6).map(str::len).sum();
    s.write("two/journal.jsonl", &journal[..keep + 40]);
    let json = s.json("study c.toml -o two");
    assert_eq!(json["resumed"], 5, "{json}");
    assert_eq!(wanted, (read(&s, "two/trials.csv"), read(&s, "two/summary.csv")));
    assert_eq!(s.json("study c.toml -o two")["resumed"], 12);

    s.write("c.toml", CONFIG.replace("1kJy", "2kJy"));
    s.fails("study c.toml -o two", 1, &["another configuration", "--overwrite"]);
    assert_eq!(s.json("study c.toml -o two --overwrite")["resumed"], 0);
    std::fs::create_dir(s.path("full")).unwrap();
    s.write("full/mine.txt", "x");
    s.fails("study c.toml -o full --overwrite", 1, &["full", "another folder"]);

    // What is left of a study that was killed before it had a journal.
    for left in [".journal.jsonl.0123456789ab.partial", "..cittert-files.0123456789ab.partial"] {
        std::fs::create_dir_all(s.path(&format!("begun/{left}"))).unwrap();
    }
    s.write("begun/journal.lock", "");
    assert_eq!(s.json("study c.toml -o begun")["resumed"], 0);
}

#[test]
fn a_killed_study_goes_on_where_it_stopped() {
    let s = scratch(&CONFIG.replace("seeds = 3", "seeds = 4"));
    let mut child = Command::new(assert_cmd::cargo::cargo_bin("cittert"))
        .args(["--threads", "1", "study", "c.toml", "-o", "out"])
        .current_dir(s.path(""))
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let lines = || std::fs::read_to_string(s.path("out/journal.jsonl")).map_or(0, |t| t.lines().count());
    let started = Instant::now();
    while lines() < 6 && started.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(2));
    }
    s.fails("study c.toml -o out", 1, &["another process", "out"]);
    // With SIGKILL the program cannot run any more code.
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(lines() >= 6 && !s.path("out/trials.csv").exists());
    let json = s.json("--threads 2 study c.toml -o out");
    assert!(json["resumed"].as_u64().unwrap() >= 4 && json["resumed"].as_u64().unwrap() < 16, "{json}");
    s.ok("--threads 2 study c.toml -o through");
    assert_eq!(read(&s, "out/trials.csv"), read(&s, "through/trials.csv"));
}

#[test]
fn what_is_wrong_is_said_with_its_place() {
    for (from, to, words) in [
        ("phase-rms = \"5deg\"", "phase-rms = \"5\"", vec!["c.toml", "line 18", "unit"]),
        ("phase-rms = \"5deg\"", "fase-rms = \"5deg\"", vec!["fase-rms", "`phase-rms`"]),
        ("niter = 1", "iterations = 1", vec!["c.toml", "iterations", "line"]),
        ("values = [12, 14]", "values = [12, 100]", vec!["layout.antennas = 100", "2 to the"]),
        ("values = [12, 14]", "", vec!["axis layout.antennas", "values"]),
        ("name = \"mm-y\"", "name = \"nowhere\"", vec!["nowhere"]),
        ("rounds = 1", "rounds = 0", vec!["selfcal", "rounds"]),
        ("seeds = 3", "seeds = 0", vec!["seeds"]),
    ] {
        let config = CONFIG.replace(from, to);
        // The first axis would replace a bad value by a good one.
        let config = if from.starts_with("phase-rms") { config.split("[[axis]]").next().unwrap().to_owned() } else { config };
        let s = scratch(&config);
        s.fails("study c.toml -o out", 1, &words);
        assert!(!s.path("out").exists());
    }
}

/// A question about the phases, over one other axis.
fn question() -> String {
    let asked =
        "[question]\nkeep = \"nrmse\"\nat-most = 0.3\nparameter = \"corrupt.phase-rms\"\nfrom = \"1deg\"\nto = \"60deg\"\nlog = true\n";
    let axes = CONFIG.split("[[axis]]").nth(2).unwrap();
    format!("{}{asked}[[axis]]{axes}", CONFIG.split("[[axis]]").next().unwrap())
}

#[test]
fn a_question_is_answered_in_a_sentence_with_the_same_bytes_after_a_kill() {
    let s = scratch(&question());
    let json = s.json("--threads 1 study c.toml -o one");
    let (answers, trials) = (json["answers"].as_array().unwrap(), json["trials"].as_u64().unwrap());
    assert_eq!((answers.len(), json["points"].as_u64()), (2, Some(10)));
    let summary = read(&s, "one/summary.csv");
    let [values, antennas, medians] =
        ["corrupt.phase-rms_deg", "layout.antennas", "nrmse_before_median"].map(|name| column(&summary, name));
    for (answer, place) in answers.iter().zip(["layout.antennas = 12", "layout.antennas = 14"]) {
        let (before, sentence) = (&answer["before"], answer["sentence"].as_str().unwrap());
        let number = |key: &str| before[key].as_f64().unwrap();
        assert!(number("low") <= number("value") && number("value") <= number("high"), "{answer}");
        // With three seeds the median of the trials keeps the score up to the median of the thresholds.
        let row = |k: usize| [&values[k], &antennas[k], &medians[k]].map(|x| *x);
        for [value, _, median] in (0..10).map(row).filter(|r| place.ends_with(&r[1].to_string())) {
            assert_eq!(median <= 0.3, value <= number("value"), "{value} {median} {answer}");
        }
        assert!(sentence.starts_with(&format!("At {place}, phase errors up to ")), "{sentence}");
        assert!(
            sentence.contains(" deg keep an NRMSE of at most 0.3 in half of the trials; with self-calibration up to 60 deg (the end"),
            "{sentence}"
        );
        assert_eq!((&answer["after"]["value"], &answer["after"]["outside"]), (&60.0.into(), &"above".into()));
    }
    assert!(trials > 30 && read(&s, "one/report.html").contains(answers[0]["sentence"].as_str().unwrap()));
    let names = ["trials.csv", "summary.csv", "question.csv", "metrics.json"];
    let bytes = |folder: &str| names.map(|n| read(&s, &format!("{folder}/{n}")));
    s.ok("--threads 2 study c.toml -o two");
    assert_eq!(bytes("one"), bytes("two"));
    // A journal that ends among the trials of the question, and inside a line.
    let journal = read(&s, "two/journal.jsonl");
    let keep: usize = journal.split_inclusive('\n').take(36).map(str::len).sum();
    s.write("two/journal.jsonl", &journal[..keep + 25]);
    let json = s.json("study c.toml -o two");
    assert_eq!((json["resumed"].as_u64(), json["trials"].as_u64()), (Some(35), Some(trials)));
    assert_eq!(bytes("one"), bytes("two"));
    // The quality is no part of what the study is: it can be stated afterwards.
    s.write("c.toml", question() + "[quality]\n\"answers.0.before.value\" = { at-most = 1 }\n");
    s.fails("study c.toml -o two", 1, &["answers.0.before.value is", "at most 1 is wanted"]);
    assert!(read(&s, "two/metrics.json").contains("\"met\": false"));
}

#[test]
fn wrong_questions_and_antennas_are_said_with_their_place() {
    for (from, to, words) in [
        ("at-most = 0.3", "", vec!["question", "at-least or at-most"]),
        ("keep = \"nrmse\"", "keep = \"beauty\"", vec!["beauty", "nrmse"]),
        ("to = \"60deg\"", "to = \"1rad\"", vec!["corrupt.phase-rms", "same unit"]),
        ("to = \"60deg\"", "to = \"0.5deg\"", vec!["question", "from"]),
        ("log = true", "fraction = 0.9", vec!["seeds is 3", "at least 9"]),
        ("[question]", "[failures]\nscore = \"nrmse\"\n[question]", vec!["failures", "random"]),
    ] {
        let s = scratch(&question().replace(from, to));
        s.fails("study c.toml -o out", 1, &words);
        assert!(!s.path("out").exists());
    }
}

#[test]
fn antennas_are_ranked_by_what_their_failure_costs() {
    let config =
        CONFIG.split("[[axis]]").next().unwrap().replace("\"mm-y\", antennas = 12, choose = \"random\"", "\"mm-golden\", antennas = 12");
    let s = scratch(&format!("{config}[failures]\nscore = \"nrmse\"\nantennas = \"each\"\n"));
    let json = s.json("study c.toml -o out");
    assert_eq!(json["trials"].as_u64(), Some(3 + 3 * 12));
    let (table, sentence) = (read(&s, "out/failures.csv"), json["failures"]["sentences"][0].as_str().unwrap().to_owned());
    let costs = column(&table, "nrmse_cost_after");
    assert!(costs.len() == 12 && costs.windows(2).all(|w| w[0] >= w[1]), "{costs:?}");
    assert_eq!(column(&table, "rank")[..3], [1.0, 2.0, 3.0]);
    let worst = table.lines().nth(1).unwrap().split(',').nth(1).unwrap();
    assert!(sentence.starts_with(&format!("Losing {worst} costs ")) && sentence.contains("of 12 antennas cost less than"), "{sentence}");
    s.write("c.toml", config.clone() + "[failures]\nscore = \"nrmse\"\nantennas = [\"E1\", \"nobody\"]\n");
    s.fails("study c.toml -o no", 1, &["failures", "antenna"]);
}

/// A scene that fills the frame, imaged by maximum entropy: where noise hides the scene, the image is flat and scores 1. Data without noise give an image.
#[test]
fn maximum_entropy_scores_1_where_the_noise_hides_the_scene() {
    let s = Scratch::new();
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/examples/apron.toml");
    let config = |corrupt: &str| {
        format!(
            "title = \"t\"\nseeds = 1\nlayout = {{ name = \"mm-golden\" }}\n[scene]\nfile = \"{}\"\nscene-size = 128\nscene-cell = \"2mrad\"\n\
             [simulate]\nfreq = \"94GHz\"\nbandwidth = \"8GHz\"\nchannels = 2\n[image]\nsize = 128\ncell = \"2mrad\"\n\
             [clean]\nalgorithm = \"mem\"\n[corrupt]\n{corrupt}\n",
            scene.display()
        )
    };
    let score = |corrupt: &str, folder: &str| {
        s.write("c.toml", config(corrupt));
        s.ok(&format!("study c.toml -o {folder}"));
        column(&read(&s, &format!("{folder}/trials.csv")), "error_over_grey_card_before")[0]
    };
    let flat = score("tsys = \"1e6K\"", "flat");
    assert!((flat - 1.0).abs() < 0.01, "{flat}");
    let (noisy, clear) = (score("tsys = \"100K\"", "noisy"), score("phase-rms = \"0.1deg\"", "clear"));
    assert!(noisy < 0.6 && clear < 0.6, "{noisy} {clear}");
}

#[test]
fn axes_vary_the_options_of_a_made_layout() {
    let made = "make = { kind = \"ring\", elements = 12, aperture = \"0.5m\", seed = 3 }";
    let config = CONFIG.replace("name = \"mm-y\", antennas = 12, choose = \"random\"", made);
    let axes = config.replace("layout.antennas", "layout.make.elements")
        + "[[axis]]\nparameter = \"layout.make.kind\"\nvalues = [\"ring\", \"random\"]\n";
    let s = scratch(&axes);
    let json = s.json("study c.toml -o swept");
    assert_eq!((json["trials"].as_u64(), json["failed"].as_u64()), (Some(24), Some(0)), "{json}");
    // Each point is that of the file that `layout make` writes.
    let swept = read(&s, "swept/trials.csv");
    let scores = column(&swept, "dynamic_range_before");
    s.ok("layout make random --elements 14 --aperture 0.5m --seed 3 -o random.toml");
    let alone = config
        .replace(made, "name = \"random.toml\"")
        .replace("layout.antennas", "corrupt.sefd")
        .replace("values = [12, 14]", "values = [\"1kJy\"]");
    s.write("alone.toml", alone);
    s.ok("study alone.toml -o alone");
    let point: Vec<f64> = column(&read(&s, "alone/trials.csv"), "dynamic_range_before")[..3].to_vec();
    // The last axis changes fastest: 5 deg with 12 elements of either kind, then with 14.
    assert_eq!(scores[9..12], point[..], "{swept}");
    assert!(scores[6..9] != point[..]);
    s.write("c.toml", axes.replace("\"random\"]", "\"circle\"]"));
    s.fails("study c.toml -o no", 1, &["layout.make.kind = circle", "reuleaux"]);
    s.write("c.toml", axes.replace("values = [12, 14]", "values = [12, 1]"));
    s.fails("study c.toml -o no", 1, &["layout.make.elements = 1", "elements is 1"]);
}

/// The study of the tutorial with fewer values, seeds and pixels, and what the tutorial says of it.
#[test]
fn the_tutorial_holds_in_small() {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    let example = std::fs::read_to_string(docs.join("examples/phase-study.toml")).unwrap();
    let s = scratch(&example);
    assert!(s.ok("study c.toml --check").out.contains("9 points x 15 seeds = 135 trials, and those that the question needs"));
    let page = std::fs::read_to_string(docs.join("user/phase-tutorial.md")).unwrap();
    assert!(page.contains("cittert study docs/examples/phase-study.toml -o phase-study"));
    let small = example
        .replace("seeds = 15", "seeds = 5")
        .replace("size = 128", "size = 96")
        .replace("niter = 100", "niter = 1\ngain = 1.0")
        .replace("count = 9", "count = 3")
        .replace("from = \"1deg\"", "from = \"3deg\"")
        .replace("to = \"90deg\"", "to = \"12deg\"");
    let small = small.split("[quality]").next().unwrap();
    s.write("c.toml", small);
    let json = s.json("study c.toml -o out");
    let summary = read(&s, "out/summary.csv");
    let (before, after) =
        (column(&summary, "off_source_dynamic_range_before_median"), column(&summary, "off_source_dynamic_range_after_median"));
    // N / (sqrt(2) phi) within a quarter for five seeds; four times the error costs four times the dynamic range (beyond about 20
    // degrees the peak itself falls, by exp(-phi^2 / 2), and it costs more).
    let law = 27.0 / (2.0_f64.sqrt() * 3.0_f64.to_radians());
    assert!((before[0] / law - 1.0).abs() < 0.25, "{before:?} {law}");
    assert!((before[0] / before[2] / 4.0 - 1.0).abs() < 0.25, "{before:?}");
    // After self-calibration the result does not depend on the size of the error.
    assert!((after[0] / after[2] - 1.0).abs() < 0.1 && after[2] > 5.0 * before[2], "{before:?} {after:?}");
    assert!(column(&summary, "phase_rms_rad_after_median").iter().all(|p| *p < 0.01));
    // The law turned round gives the answer for a dynamic range of 300.
    let answer = &json["answers"][0];
    let wanted = (27.0 / (2.0_f64.sqrt() * 300.0)).to_degrees();
    assert!((answer["before"]["value"].as_f64().unwrap() / wanted - 1.0).abs() < 0.25, "{answer}");
    assert_eq!(answer["after"]["outside"], "above");
}

/// A study in shards: run in any order, one of them killed and run again, merged to the same tables.
#[test]
fn shards_in_any_order_give_the_tables_of_one_process() {
    let s = scratch(&CONFIG.replace("seeds = 3", "seeds = 10"));
    s.ok("study c.toml -o one");
    s.fails("study c.toml -o out --merge", 1, &["out", "no trials of shards"]);
    for wrong in ["0/4", "5/4", "1", "x/4"] {
        s.fails(&format!("study c.toml -o out --shard {wrong}"), 2, &["--shard"]);
    }
    s.fails("study c.toml -o out --shard 1/4 --merge", 2, &["--merge"]);
    let json = s.json("study c.toml -o out --shard 3/4");
    assert_eq!((json["shard"].as_str(), json["trials"].as_u64()), (Some("3/4"), Some(10)), "{json}");
    // A shard that is killed while it writes its journal.
    let mut child = Command::new(assert_cmd::cargo::cargo_bin("cittert"))
        .args(["--threads", "1", "study", "c.toml", "-o", "out", "--shard", "2/4"])
        .current_dir(s.path(""))
        .stderr(Stdio::null())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let lines = || std::fs::read_to_string(s.path("out/shards/2-of-4/journal.jsonl")).map_or(0, |t| t.lines().count());
    let started = Instant::now();
    while lines() < 3 && started.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    s.ok("study c.toml -o out --shard 4/4");
    let said = s.fails("study c.toml -o out --merge", 1, &["out", "are missing", "1/4"]);
    assert!(!said.contains("3/4") && !said.contains("4/4") && !s.path("out/trials.csv").exists(), "{said}");
    s.ok("study c.toml -o out --shard 1/4");
    let json = s.json("study c.toml -o out --shard 2/4");
    assert!(json["resumed"].as_u64().unwrap() >= 1 && json["trials"] == 10, "{json}");
    let json = s.json("study c.toml -o out --merge");
    assert_eq!((json["trials"].as_u64(), json["resumed"].as_u64()), (Some(40), Some(40)), "{json}");
    for name in ["trials.csv", "summary.csv", "metrics.json", "study.h5", "dynamic_range.png"] {
        assert!(std::fs::read(s.path("one").join(name)).unwrap() == std::fs::read(s.path("out").join(name)).unwrap(), "{name}");
    }
    // Merged again, and with shards of another division.
    s.ok("study c.toml -o out --merge");
    s.ok("study c.toml -o both --shard 1/2");
    s.ok("study c.toml -o both --shard 2/4");
    s.fails("study c.toml -o both --merge", 1, &["10 trials are missing", "--shard 4/4"]);
    s.ok("study c.toml -o both --shard 4/4");
    s.ok("study c.toml -o both --merge");
    assert_eq!(read(&s, "one/trials.csv"), read(&s, "both/trials.csv"));
    // Shards of another configuration are refused.
    s.write("c.toml", CONFIG.replace("1kJy", "2kJy"));
    s.fails("study c.toml -o both --shard 1/2", 1, &["another configuration"]);
    s.fails("study c.toml -o new --merge", 1, &["no trials of shards"]);
    std::fs::create_dir_all(s.path("new")).unwrap();
    std::fs::rename(s.path("both/shards"), s.path("new/shards")).unwrap();
    s.fails("study c.toml -o new --merge", 1, &["1-of-2", "another configuration"]);
}

/// The scripts for Slurm, read by a shell that has no Slurm: `srun` is a function, and each task runs in turn.
#[test]
fn scripts_for_slurm_run_the_study() {
    let s = scratch(CONFIG);
    let json = s.json("study c.toml -o out --slurm --shards 3 --slurm-cpus 2 --slurm-option --partition=all");
    assert_eq!((json["shards"].as_u64(), json["trials"].as_u64(), json["cpus"].as_u64()), (Some(3), Some(12), Some(2)), "{json}");
    assert!(json["time_s"].as_f64().unwrap() >= 120.0 && json["memory_bytes"].as_u64().unwrap() > 1 << 28, "{json}");
    let script = read(&s, "out.sbatch");
    for line in ["#SBATCH --array=1-3", "#SBATCH --cpus-per-task=2", "#SBATCH --partition=all", "#SBATCH --job-name=cittert-study"] {
        assert!(script.lines().any(|l| l == line), "{line}\n{script}");
    }
    assert!(script.contains("--threads 2 ") && script.contains("study c.toml -o out --shard $SLURM_ARRAY_TASK_ID/3"), "{script}");
    assert!(!s.path("out").exists());
    let shell = |name: &str, task: usize| {
        let text = read(&s, name).replace("\nset -euo pipefail\n", "\nset -euo pipefail\nsrun() { shift 2; \"$@\"; }\n");
        s.write("shell.sh", text);
        let run =
            Command::new("bash").arg("shell.sh").env("SLURM_ARRAY_TASK_ID", task.to_string()).current_dir(s.path("")).output().unwrap();
        assert!(run.status.success(), "{name}\n{}", String::from_utf8_lossy(&run.stderr));
    };
    [2, 3, 1].into_iter().for_each(|task| shell("out.sbatch", task));
    shell("out-merge.sbatch", 0);
    s.ok("study c.toml -o one");
    assert_eq!(read(&s, "one/trials.csv"), read(&s, "out/trials.csv"));
    s.fails("study c.toml -o out --slurm", 1, &["out.sbatch", "exists already"]);
    s.fails("study c.toml -o x --slurm-cpus 2", 2, &["--slurm"]);
    s.fails("study c.toml -o x --slurm --shard 1/2", 2, &["--slurm"]);
    s.fails("study c.toml -o x --slurm --slurm-option nodes", 2, &["--slurm-option"]);
    // What is not told follows from a forecast, which reads the set.
    s.fails("clean v.uvh5 -o x --slurm --slurm-time 1h", 1, &["v.uvh5"]);
    s.ok("clean v.uvh5 -o x --niter 10 --slurm --slurm-time 90min --slurm-memory 4GB");
    let script = read(&s, "x.sbatch");
    for words in ["--memory 2000000000B --threads 1", "#SBATCH --time=0-01:30:00", "#SBATCH --mem=3815M", "clean v.uvh5 -o x --niter 10\n"]
    {
        let words: Vec<&str> = words.split(" --threads 1").collect();
        assert!(words.iter().all(|w| script.contains(w)), "{words:?}\n{script}");
    }
    s.write("run.toml", "title = \"x\"\n");
    s.fails("run run.toml -o y --slurm --slurm-time 1h --slurm-memory 4GB", 1, &["run.toml"]);
}
