//! The hidden folder in which a run works, and its final name. Numbers and messages of a run name the final one.

use serde_json::Value;

/// Put the final folder in the place of the hidden one in every text of a result.
pub(super) fn renamed(value: Value, hidden: &str, last: &str) -> Value {
    match value {
        Value::String(text) => Value::String(text.replace(hidden, last)),
        Value::Array(all) => all.into_iter().map(|v| renamed(v, hidden, last)).collect(),
        Value::Object(map) => map.into_iter().map(|(key, v)| (key, renamed(v, hidden, last))).collect(),
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn every_text_names_the_final_folder() {
        let found = renamed(json!({ "a": [".x.partial/b", 1.5], "c": { "d": "see .x.partial/e" }, "f": null }), ".x.partial", "x");
        assert_eq!(found, json!({ "a": ["x/b", 1.5], "c": { "d": "see x/e" }, "f": null }));
    }
}
