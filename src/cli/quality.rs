//! The numbers that a `run` or a `study` must reach, and whether it did.

use super::text::number;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// The limits of a number.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct Limits {
    /// Smallest value that is good enough.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) at_least: Option<f64>,
    /// Largest value that is good enough.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) at_most: Option<f64>,
}

impl Limits {
    /// True if a number is within both limits. NaN is not.
    fn hold(&self, x: f64) -> bool {
        self.at_least.is_none_or(|l| x >= l) && self.at_most.is_none_or(|l| x <= l) && !x.is_nan()
    }

    /// As in `at least 800`.
    fn text(&self) -> String {
        let part = |word: &str, limit: Option<f64>| limit.map(|l| format!("{word} {}", number(l)));
        [part("at least", self.at_least), part("at most", self.at_most)].into_iter().flatten().collect::<Vec<_>>().join(" and ")
    }
}

/// What was wanted and what was found.
#[derive(Debug)]
pub(super) struct Verdict {
    /// One entry for each number.
    pub(super) json: Value,
    /// One line for each number.
    pub(super) text: String,
    /// The misses, as one message.
    pub(super) failed: Option<String>,
}

/// Refuse limits that say nothing.
pub(super) fn check(wanted: &BTreeMap<String, Limits>) -> Result<(), String> {
    for (key, limits) in wanted {
        let finite = [limits.at_least, limits.at_most].into_iter().flatten().all(f64::is_finite);
        if limits.at_least.or(limits.at_most).is_none() || !finite {
            return Err(format!("quality: {key:?} needs at-least or at-most with a finite number"));
        }
    }
    Ok(())
}

/// The number at a path such as `clean.hogbom.dynamic_range` or `answers.0.value`.
fn lookup<'a>(metrics: &'a Value, path: &str) -> Option<&'a Value> {
    path.split('.').try_fold(metrics, |at, key| match at {
        Value::Array(list) => key.parse::<usize>().ok().and_then(|k| list.get(k)),
        other => other.get(key),
    })
}

/// Compare the numbers of `metrics` with the limits.
pub(super) fn judge(wanted: &BTreeMap<String, Limits>, metrics: &Value) -> Verdict {
    let (mut all, mut lines, mut misses) = (serde_json::Map::new(), Vec::new(), Vec::new());
    for (key, limits) in wanted {
        // true and false count as 1 and 0.
        let found = lookup(metrics, key).and_then(|v| v.as_f64().or_else(|| v.as_bool().map(|b| f64::from(u8::from(b)))));
        let met = found.is_some_and(|x| limits.hold(x));
        let shown = found.map_or_else(|| "no number".to_owned(), number);
        lines.push(format!("quality: {key} is {shown}, {} is wanted: {}", limits.text(), if met { "met" } else { "MISSED" }));
        if !met {
            misses.push(format!("{key} is {shown}, {} is wanted", limits.text()));
        }
        let mut entry = json!(limits);
        entry["found"] = json!(found);
        entry["met"] = json!(met);
        all.insert(key.clone(), entry);
    }
    let message = |m: &[String]| format!("the results do not reach the quality that the configuration states: {}", m.join("; "));
    let failed = (!misses.is_empty()).then(|| message(&misses));
    Verdict { json: Value::Object(all), text: lines.join("\n"), failed }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn limits(at_least: Option<f64>, at_most: Option<f64>) -> Limits {
        Limits { at_least, at_most }
    }

    #[test]
    fn numbers_are_found_by_their_path_and_compared_with_both_limits() {
        let metrics = json!({ "clean": { "hogbom": { "dynamic_range": 900.0 } }, "answers": [{ "value": 4.0, "none": null }], "ok": true });
        let good = BTreeMap::from([
            ("clean.hogbom.dynamic_range".to_owned(), limits(Some(800.0), Some(1000.0))),
            ("answers.0.value".to_owned(), limits(None, Some(4.0))),
            ("ok".to_owned(), limits(Some(1.0), None)),
        ]);
        let v = judge(&good, &metrics);
        assert!(v.failed.is_none() && v.text.lines().count() == 3, "{v:?}");
        assert_eq!(v.json["answers.0.value"]["met"], true);
        for (key, limit) in [
            ("clean.hogbom.dynamic_range", limits(Some(901.0), None)),
            ("answers.0.value", limits(None, Some(3.9))),
            ("answers.1.value", limits(None, Some(9.0))),
            ("answers.0.none", limits(None, Some(9.0))),
            ("clean.hogbom", limits(None, Some(9.0))),
        ] {
            let v = judge(&BTreeMap::from([(key.to_owned(), limit)]), &metrics);
            assert!(v.failed.is_some_and(|f| f.contains(key)) && v.json[key]["met"] == false);
        }
        assert!(check(&good).is_ok());
        assert!(check(&BTreeMap::from([("a".to_owned(), limits(None, None))])).is_err());
        assert!(check(&BTreeMap::from([("a".to_owned(), limits(None, Some(f64::NAN)))])).is_err());
    }
}
