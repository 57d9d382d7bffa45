//! Errors are injected and removed again: corrupt, selfcal, applycal, closure, compare, identify and predict.

use crate::program::Scratch;
use serde_json::Value;

fn number(v: &Value, key: &str) -> f64 {
    v[key].as_f64().unwrap_or_else(|| panic!("{key} is not a number in {v}"))
}

const SIMULATE: &str = "simulate --layout vla-d --freq 1.4GHz --bandwidth 64MHz --channels 2 --phase-center 13h31m08s,+30d30m33s \
                        --start 2025-06-01T01:30:00 --duration 4min --integration 60s --method dft";

/// A point at the phase centre, observed by the VLA for four minutes.
fn point(extra: &str) -> Scratch {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0.0,0.0,1.0\n");
    s.ok(&format!("{SIMULATE} --scene s.csv {extra} -o v.uvh5"));
    s
}

#[test]
fn injected_phases_come_back() {
    let s = point("");
    let put = s.json("corrupt v.uvh5 -o c.uvh5 --gains t.calh5 --seed 5 --phase-rms 40deg --variation integration");
    assert!((number(&put, "rms_phase_rad") - 0.698).abs() < 0.15, "{put}");
    let run = s.json("selfcal c.uvh5 -o sc --start point --solint int --rounds 1 --size 64 --cell 15arcsec --niter 300 --refant W01");
    assert_eq!(run["refant"], "W01");
    assert!(run["stop_reason"].is_string() && number(&run, "dynamic_range") > 1e3, "{run}");
    for part in [
        ".uvh5",
        ".calh5",
        "-psf.fits",
        "-dirty.fits",
        "-model.fits",
        "-residual.fits",
        "-image.fits",
        "-round1.calh5",
        "-round1-image.fits",
    ] {
        assert!(s.path(&format!("sc{part}")).exists(), "{part}");
    }
    let c = s.json("compare sc.calh5 t.calh5");
    assert!(number(&c, "max_abs_phase_rad") < 1e-6 && number(&c, "rms_amplitude") < 1e-9, "{c}");
    assert_eq!(c["n_flagged"], 0);
    // The calibrated set equals the set before the errors. A common phase in each interval may differ, because no baseline measures it.
    let r = s.json("predict sc.uvh5 --model s.csv --residual -o r.uvh5");
    assert!(number(&r, "rms") < 1e-5, "{r}");
}

#[test]
fn every_round_is_recorded_and_the_best_one_kept() {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0.0,0.0,1.0\n0.0008727,0.0004363,0.5\n");
    s.ok(&format!("{SIMULATE} --scene s.csv --sefd 20Jy -o v.uvh5"));
    s.ok("corrupt v.uvh5 -o c.uvh5 --gains t.calh5 --phase-rms 30deg --variation integration --amp-rms 0.1");
    let run =
        s.json("selfcal c.uvh5 -o sc --mode amp-phase --solint int --rounds 3 --size 128 --cell 15arcsec --niter 200 --algorithm clark");
    let rounds: Vec<Value> =
        std::fs::read_to_string(s.path("sc-rounds.jsonl")).unwrap().lines().map(|l| serde_json::from_str(l).unwrap()).collect();
    assert_eq!(rounds.len() as f64, number(&run, "n_rounds"));
    assert_eq!(rounds.last().unwrap()["mode"], "amp-phase");
    // The last two rounds use all baselines. The image and the gains are those of the last.
    assert_eq!(number(&run, "best_round"), number(&run, "n_rounds"));
    assert_eq!((&run["accepted"], &rounds.last().unwrap()["held_out_misfit"]), (&Value::Bool(true), &Value::Null));
    let best = number(rounds.last().unwrap(), "dynamic_range");
    assert!(best > 5.0 * number(&run["before"], "dynamic_range"), "{run}");
    assert!(s.path("sc-round0-image.fits").exists());
    let c = s.json("compare sc.calh5 t.calh5 --gradient --flux-scale");
    assert!(number(&c, "rms_phase_rad") < 0.05 && number(&c, "rms_amplitude") < 0.05 && c["shift_l_rad"].is_number(), "{c}");
}

#[test]
fn fewer_rounds_leave_none_of_an_earlier_run() {
    let s = point("--sefd 420Jy");
    let line = "selfcal v.uvh5 -o sc --start point --solint int --improvement 0 --patience 9 --size 64 --cell 15arcsec --niter 50";
    s.ok(&format!("{line} --rounds 3"));
    // Two more rounds add the baselines that were held out.
    assert!(s.path("sc-round5.calh5").exists());
    s.fails(&format!("{line} --rounds 1"), 1, &["--overwrite"]);
    s.ok(&format!("{line} --rounds 1 --overwrite"));
    let rounds: Vec<String> = s.names().into_iter().filter(|n| n.starts_with("sc-round")).collect();
    let expected = (1..=3).flat_map(|k| [format!("sc-round{k}-image.fits"), format!("sc-round{k}.calh5")]);
    assert_eq!(rounds, expected.chain(["sc-rounds.jsonl".to_owned()]).collect::<Vec<_>>());
}

#[test]
fn gains_applied_and_put_back_leave_the_data() {
    let s = point("");
    s.ok("corrupt v.uvh5 -o c.uvh5 --seed 2 --phase-rms 1rad --amp-rms 0.2 --delay-rms 2ns --variation walk:2min --bandpass-ripple 0.1");
    // If no name is given, the true gains are written beside the output.
    s.ok("applycal c.uvh5 c.calh5 -o back.uvh5");
    let r = s.json("predict back.uvh5 --model s.csv --residual -o r.uvh5");
    assert!(number(&r, "rms") < 1e-6, "{r}");
    s.ok("applycal back.uvh5 c.calh5 --invert -o again.uvh5");
    let rms = |name: &str| number(&s.json(&format!("predict {name} --model s.csv --residual --overwrite -o r.uvh5")), "rms");
    assert!((rms("again.uvh5") - rms("c.uvh5")).abs() < 1e-6 && rms("c.uvh5") > 0.1);
}

#[test]
fn antenna_errors_do_not_touch_closures() {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0.0,0.0,1.0\n0.0008,0.0004,0.5\n");
    s.ok(&format!("{SIMULATE} --scene s.csv -o v.uvh5"));
    s.ok("corrupt v.uvh5 -o c.uvh5 --phase-rms 2rad --amp-rms 0.3 --variation integration");
    let mut tables = Vec::new();
    for name in ["v", "c"] {
        let j = s.json(&format!("closure {name}.uvh5 -o {name}.csv --plot {name}.png"));
        // 27 antennas: (N - 1)(N - 2)/2 phases and N(N - 3)/2 amplitudes in each of four integrations.
        assert_eq!((number(&j["phases"], "count"), number(&j["log_amplitudes"], "count")), (4.0 * 325.0, 4.0 * 324.0));
        assert!(s.path(&format!("{name}.png")).exists());
        let text = std::fs::read_to_string(s.path(&format!("{name}.csv"))).unwrap();
        let column = text.lines().next().unwrap().split(',').position(|c| c == "value").unwrap();
        tables.push(text.lines().skip(1).map(|l| l.split(',').nth(column).unwrap().parse::<f64>().unwrap()).collect::<Vec<_>>());
    }
    let far = tables[0].iter().zip(&tables[1]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(tables[0].len() == tables[1].len() && far < 1e-5, "{far}");
}

#[test]
fn a_config_says_what_the_options_say() {
    let s = point("");
    s.write("e.toml", "seed = 9\n[[error]]\nphase-rms = \"0.5rad\"\nvariation = \"coherent:2min\"\n");
    s.ok("corrupt v.uvh5 -o a.uvh5 --config e.toml");
    s.ok("corrupt v.uvh5 -o b.uvh5 --seed 9 --phase-rms 0.5rad --variation coherent:2min");
    assert!(number(&s.json("compare a.calh5 b.calh5"), "max_abs_phase_rad") < 1e-12);
    s.ok("corrupt v.uvh5 -o c.uvh5 --seed 10 --phase-rms 0.5rad --variation coherent:2min");
    assert!(number(&s.json("compare a.calh5 c.calh5"), "rms_phase_rad") > 0.1);
}

#[test]
fn images_of_an_earlier_run_are_gone_whatever_made_their_names_twice() {
    let s = point("--sefd 420Jy");
    for k in 1..=12 {
        s.write(&format!("sc-round{k}-image.fits"), "of an earlier run");
    }
    let run = s.json("selfcal v.uvh5 -o sc --start point --solint int --size 64 --cell 15arcsec --niter 50 --overwrite");
    let n = number(&run, "n_rounds") as usize;
    assert!(n < 10, "{n}");
    (n + 1..=12).for_each(|k| assert!(!s.path(&format!("sc-round{k}-image.fits")).exists(), "{k} of {n}"));
}

#[test]
fn noise_alone_is_told_from_a_source() {
    let s = Scratch::new();
    s.write("faint.csv", "l_rad,m_rad,flux_jy\n0.0,0.0,1e-9\n");
    s.write("bright.csv", "l_rad,m_rad,flux_jy\n0.0,0.0,1.0\n");
    for (scene, warns) in [("faint", true), ("bright", false)] {
        s.ok(&format!("{SIMULATE} --scene {scene}.csv --sefd 420Jy -o {scene}-good.uvh5"));
        s.ok(&format!("corrupt {scene}-good.uvh5 -o {scene}.uvh5 --phase-rms 30deg --seed 3"));
        let line = format!(
            "--json selfcal {scene}.uvh5 -o {scene}-sc --start point --solint 120s --rounds 1 --size 64 --cell 15arcsec --niter 20"
        );
        let said = s.ok(&line);
        let json: Value = serde_json::from_str(&said.out).unwrap();
        assert_eq!(said.err.contains("closure phases do not support the model"), warns, "{scene}: {}", said.err);
        assert_eq!(json["closure_supports_model"], !warns);
        assert_eq!(json["accepted"], !warns, "{}", json["verdict"]);
        assert_eq!(!json["warnings"].as_array().unwrap().is_empty(), warns);
    }
}

#[test]
fn what_cannot_be_known_has_a_name() {
    let s = Scratch::new();
    let known = s.json("identify vla-d --mode phase --model known");
    assert_eq!((number(&known, "null_dimensions"), &known["modes"][0]["name"]), (1.0, &Value::from("common phase")));
    let point = s.json("identify vla-d --mode phase --model point");
    assert!(number(&point, "null_dimensions") > 1.0);
    assert_eq!((number(&point, "closure_phases"), number(&point, "closure_amplitudes")), (325.0, 324.0));
    assert!(s.ok("identify vla-d --mode delay --model known").out.contains("null space"));
}

#[test]
fn a_shift_of_the_image_is_found() {
    let s = Scratch::new();
    for (name, l) in [("a", 0.0), ("b", 0.00021)] {
        s.write(&format!("{name}.csv"), format!("l_rad,m_rad,flux_jy\n{l},0.0,1.0\n"));
        s.ok(&format!("{SIMULATE} --scene {name}.csv -o {name}.uvh5"));
        s.ok(&format!("clean {name}.uvh5 --size 128 --cell 15arcsec --niter 200 -o {name}"));
    }
    let apart = s.json("compare b-image.fits a-image.fits");
    let over = s.json("compare b-image.fits a-image.fits --shift");
    assert!((number(&over, "shift_l_rad") + 0.00021).abs() < 1.5e-5 && number(&over, "shift_m_rad").abs() < 1.5e-5, "{over}");
    assert!(number(&over, "nrmse") < 0.3 * number(&apart, "nrmse"), "{apart} {over}");
}
