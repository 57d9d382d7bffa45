//! The verdict of a run in a few sentences: what was observed, how good the images are, what the injected errors did, and what
//! self-calibration won back.

use super::command::Done;
use super::config::Config;
use super::labels::digits;
use crate::cli::made::Origin;
use crate::plot::report::Finding;
use serde_json::Value;

/// The results of a run by the keys of its steps.
pub(super) struct Results<'a>(pub(super) &'a [Done]);

impl Results<'_> {
    fn step(&self, key: &str) -> Option<&Value> {
        self.0.iter().find(|d| d.step.key == key).map(|d| &d.json)
    }

    /// A finite number of a step.
    fn number(&self, step: &str, key: &str) -> Option<f64> {
        self.step(step)?.get(key)?.as_f64().filter(|v| v.is_finite())
    }

    fn text(&self, step: &str, key: &str) -> Option<&str> {
        self.step(step)?.get(key)?.as_str()
    }

    /// The error over grey card of each image of the data without injected errors, the best first, with the names of the images.
    fn scores(&self) -> Vec<(String, f64)> {
        let judged = self.0.iter().filter_map(|d| {
            let name = d.step.key.strip_prefix("compare.").filter(|n| !["corrupted", "selfcal", "gains"].contains(n))?;
            Some((name.to_owned(), d.json.get("error_over_grey_card")?.as_f64().filter(|v| v.is_finite())?))
        });
        let mut all: Vec<(String, f64)> = judged.collect();
        all.sort_by(|a, b| a.1.total_cmp(&b.1));
        all
    }

    /// Key of the image without injected errors that is the best by its score, or else by its dynamic range.
    pub(super) fn best(&self) -> Option<String> {
        let by_score = self.scores().into_iter().next().map(|(name, _)| name);
        let images = self.0.iter().filter(|d| d.step.key == "mem" || d.step.key.starts_with("clean.") && d.step.key != "clean.corrupted");
        let range = |d: &Done| d.json.get("dynamic_range").and_then(Value::as_f64).unwrap_or(f64::NEG_INFINITY);
        by_score.or_else(|| images.max_by(|a, b| range(a).total_cmp(&range(b))).map(|d| d.step.key.trim_start_matches("clean.").to_owned()))
    }
}

/// The name of a deconvolver as a reader knows it.
pub(super) fn image_name(key: &str) -> String {
    match key {
        "corrupted" => "with errors".into(),
        "selfcal" => "self-calibrated".into(),
        "mem" => "maximum entropy".into(),
        "hogbom" => "H\u{f6}gbom CLEAN".into(),
        "clark" => "Clark CLEAN".into(),
        "multiscale" => "multiscale CLEAN".into(),
        other => format!("CLEAN ({other})"),
    }
}

/// Key of the results of an image.
pub(super) fn step_of(key: &str) -> String {
    if key == "mem" { "mem".into() } else { format!("clean.{key}") }
}

/// The sentences, with the most important finding last.
pub(super) fn verdict(config: &Config, results: &Results<'_>, findings: &[Finding]) -> Vec<String> {
    let mut said = vec![observed(config, results)];
    said.extend(images(config, results));
    said.extend(errors(results));
    said.extend(calibration(results));
    if let Some(worst) = findings.first() {
        let more = match findings.len() {
            1 => String::new(),
            2 => " (one more finding below)".into(),
            n => format!(" ({} more findings below)", n - 1),
        };
        said.push(format!("Look at this first: {}{more}", worst.says));
    }
    said
}

fn observed(config: &Config, results: &Results<'_>) -> String {
    let layout = config.layout.origin().map(Origin::told).unwrap_or_default();
    let antennas = results.number("layout", "n_antennas").map(|n| format!("{n:.0} antennas ({layout})"));
    let file = config.scene.options.file.as_ref().and_then(|f| f.file_stem()).map(|s| s.to_string_lossy().into_owned());
    let scene = results.text("scene", "name").map(str::to_owned).or(file).unwrap_or_default();
    let band = &config.simulate.options.band;
    let channels = if band.channels > 1 { format!("{} channels", band.channels) } else { "one channel".into() };
    let noise = if is_noisy(config) { "with thermal noise" } else { "without noise" };
    let array = antennas.unwrap_or(layout);
    format!(
        "{array} observe the scene \u{201c}{scene}\u{201d} at {}, {channels} over {}, {noise}.",
        spaced(&band.freq.to_string()),
        spaced(&band.bandwidth.to_string())
    )
}

/// A quantity with a space before its unit: `94GHz` becomes "94 GHz".
fn spaced(quantity: &str) -> String {
    let number = quantity.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    format!("{number} {}", &quantity[number.len()..])
}

/// Thermal noise is on by itself, or by a system temperature or SEFD.
fn is_noisy(config: &Config) -> bool {
    let keys = &config.simulate.keys;
    config.simulate.options.how.noise || ["sefd", "tsys"].iter().any(|key| keys.contains_key(*key))
}

fn images(config: &Config, results: &Results<'_>) -> Option<String> {
    let best = results.best()?;
    let of = step_of(&best);
    let mut text = format!(
        "The best image{} is that of {}",
        if config.corrupt.is_some() { " of the data without errors" } else { "" },
        image_name(&best)
    );
    let scores = results.scores();
    if let Some(((_, score), others)) = scores.split_first() {
        text += &format!(": its error over grey card is {} (0 is perfect, 1 is no better than a flat grey card)", digits(*score));
        let told: Vec<String> = others.iter().map(|(name, s)| format!("{} has {}", image_name(name), digits(*s))).collect();
        if !told.is_empty() {
            text += &format!("; {}", told.join(", "));
        }
    }
    text += ".";
    let range = results.number(&of, "dynamic_range").map(|r| format!("its dynamic range is {}", digits(r)));
    let fit = results.number(&of, "chi2_per_datum").map(|chi2| {
        let remark = match chi2 {
            x if x > 1.3 => ", so the model does not fit the data to their noise",
            x if x < 0.7 => ", so the model also fits noise, or the weights are too small",
            _ => ", so the model fits the data to their noise",
        };
        format!("chi squared per datum is {}{remark}", digits(chi2))
    });
    let both: Vec<String> = range.into_iter().chain(fit).collect();
    if let Some(first) = both.first() {
        let capital = first.chars().next().map(|c| c.to_uppercase().to_string()).unwrap_or_default();
        text += &format!(" {capital}{}.", both.join(", and ").chars().skip(1).collect::<String>());
    }
    Some(text)
}

/// The score without errors, by the same deconvolver as the images of the corrupted data.
fn clean_score(results: &Results<'_>) -> Option<f64> {
    let first = results.0.iter().find(|d| d.step.key.starts_with("clean."))?;
    results.number(&first.step.key.replace("clean.", "compare."), "error_over_grey_card")
}

fn errors(results: &Results<'_>) -> Option<String> {
    results.step("corrupt")?;
    let phase = results
        .number("corrupt", "rms_phase_rad")
        .filter(|p| *p > 1e-9)
        .map(|p| format!("phase errors of {} deg rms", digits(p.to_degrees())));
    let amplitude = results.number("corrupt", "rms_amplitude").filter(|a| *a > 1e-9);
    let amplitude = amplitude.map(|a| format!("amplitude errors of {} per cent rms", digits(100.0 * a)));
    let put: Vec<String> = phase.into_iter().chain(amplitude).collect();
    let put = if put.is_empty() { "errors".to_owned() } else { put.join(" and ") };
    let effect = match results.number("compare.corrupted", "error_over_grey_card").zip(clean_score(results)) {
        Some((with, without)) => {
            format!("they raise the error over grey card of the CLEAN image from {} to {}", digits(without), digits(with))
        }
        None => {
            let first = results.0.iter().find(|d| d.step.key.starts_with("clean."))?;
            let (without, with) = (results.number(&first.step.key, "dynamic_range")?, results.number("clean.corrupted", "dynamic_range")?);
            format!("they change the dynamic range from {} to {}", digits(without), digits(with))
        }
    };
    Some(format!("The data then got {put}: {effect}."))
}

fn calibration(results: &Results<'_>) -> Option<String> {
    let step = results.step("selfcal")?;
    if step.get("accepted").and_then(Value::as_bool) == Some(false) {
        let why = results.text("selfcal", "verdict").unwrap_or("not accepted");
        return Some(format!("Self-calibration changed nothing. It was {}.", why.trim_end_matches('.')));
    }
    let judged = step.pointer("/judgement/judged").and_then(Value::as_bool).unwrap_or(true);
    let mut text = format!("Self-calibration was {}", if judged { "accepted" } else { "applied without a judgement" });
    if let Some(left) = results.number("compare.gains", "rms_phase_rad") {
        text += &format!(". It leaves phase errors of {} deg rms", digits(left.to_degrees()));
    }
    let after = results.number("compare.selfcal", "error_over_grey_card");
    if let Some(after) = after {
        text += &format!(" and an error over grey card of {}", digits(after));
        if let Some((with, without)) = results.number("compare.corrupted", "error_over_grey_card").zip(clean_score(results))
            && with > without * 1.02
        {
            let won = 100.0 * (with - after) / (with - without);
            text += &match won {
                x if x >= 100.0 => ", better than without errors".to_owned(),
                x if x > 0.0 => format!(", which wins back {x:.0} per cent of what the errors cost"),
                _ => ", which is worse than before self-calibration".to_owned(),
            };
        }
    } else if let Some((before, after)) = results.number("clean.corrupted", "dynamic_range").zip(results.number("selfcal", "dynamic_range"))
    {
        text += &format!(", and the dynamic range goes from {} to {}", digits(before), digits(after));
    }
    Some(text + ".")
}

#[cfg(test)]
mod tests {
    use super::super::command::Step;
    use super::*;
    use serde_json::json;

    const CONFIG: &str = "title = \"t\"\nlayout = { name = \"mm-y\" }\nscene = { file = \"s.toml\" }\n[simulate]\nfreq = \"94GHz\"\nbandwidth = \"8GHz\"\nchannels = 4\nnoise = true\n[corrupt]\nphase-rms = \"40deg\"\n";

    fn done(key: &str, json: Value) -> Done {
        Done { step: Step::new("s", key, key, "x"), command: String::new(), json, warnings: Vec::new(), seconds: 0.0 }
    }

    #[test]
    fn the_sentences_say_what_errors_cost_and_what_was_won_back() {
        let config: Config = toml::from_str(CONFIG).unwrap();
        let card = |x: f64| json!({ "error_over_grey_card": x });
        let mut all = vec![
            done("layout", json!({ "n_antennas": 30 })),
            done("clean.hogbom", json!({ "dynamic_range": 50.0, "chi2_per_datum": 1.7 })),
            done("compare.hogbom", card(0.5)),
            done("mem", json!({ "dynamic_range": 42.0, "chi2_per_datum": 1.0 })),
            done("compare.mem", card(0.4)),
            done("corrupt", json!({ "rms_phase_rad": 0.7, "rms_amplitude": 1e-17 })),
            done("compare.corrupted", card(0.9)),
            done("selfcal", json!({ "accepted": true })),
            done("compare.selfcal", card(0.6)),
            done("compare.gains", json!({ "rms_phase_rad": 0.1 })),
        ];
        let finding = Finding { step: "mem".into(), says: "The field is too small.".into(), next: String::new() };
        let told = verdict(&config, &Results(&all), &[finding]);
        assert_eq!(told.len(), 5, "{told:?}");
        assert!(
            told[0].starts_with("30 antennas (mm-y) observe") && told[0].contains("at 94 GHz, 4 channels over 8 GHz, with thermal noise"),
            "{}",
            told[0]
        );
        assert!(
            told[1].contains("maximum entropy") && told[1].contains("0.400") && told[1].contains("H\u{f6}gbom CLEAN has 0.500"),
            "{}",
            told[1]
        );
        assert!(
            told[1].ends_with("Its dynamic range is 42.0, and chi squared per datum is 1.00, so the model fits the data to their noise.")
        );
        assert!(
            told[2].contains("40.1 deg rms") && !told[2].contains("amplitude") && told[2].contains("from 0.500 to 0.900"),
            "{}",
            told[2]
        );
        assert!(told[3].contains("5.73 deg rms") && told[3].contains("75 per cent"), "{}", told[3]);
        assert!(told[4].contains("The field is too small."));
        all[7].json = json!({ "accepted": false, "verdict": "NOT accepted, the data are as they were" });
        let told = verdict(&config, &Results(&all), &[]);
        assert!(told[3].contains("changed nothing") && told[3].contains("the data are as they were"), "{}", told[3]);
    }
}
