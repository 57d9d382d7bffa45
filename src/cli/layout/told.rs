//! What is told of a layout: JSON and lines of text that grow together.

use crate::cli::context::Outcome;
use serde_json::{Map, Value};
use std::fmt::Display;

/// The results as JSON and as lines of text.
#[derive(Debug, Default)]
pub(super) struct Told {
    json: Map<String, Value>,
    lines: Vec<String>,
}

impl Told {
    /// Add the keys of an object.
    pub(super) fn add(&mut self, json: Value) {
        if let Value::Object(more) = json {
            self.json.extend(more);
        }
    }

    /// Add a line that stands alone.
    pub(super) fn heading(&mut self, text: impl Display) {
        self.lines.push(text.to_string());
    }

    /// Add a line with its label; none where the label is that of the line before.
    pub(super) fn line(&mut self, label: &str, text: impl Display) {
        self.lines.push(format!("{label:12} {text}"));
    }

    pub(super) fn outcome(self) -> Outcome {
        Outcome::new(Value::Object(self.json), self.lines.join("\n"))
    }
}
