//! What makes a result doubtful, and what to do about it.

use serde::Serialize;
use std::borrow::Cow;

/// Something that makes an image or a set of gains doubtful.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// A short name, such as `chi_squared`.
    pub name: &'static str,
    /// What was seen, with its numbers.
    pub says: String,
    /// What to try next.
    pub next: Cow<'static, str>,
}

impl Finding {
    /// A finding.
    #[must_use]
    pub fn new(name: &'static str, says: impl Into<String>, next: impl Into<Cow<'static, str>>) -> Self {
        Self { name, says: says.into(), next: next.into() }
    }
}

/// The findings in one sentence; `good` is the sentence if there are none.
#[must_use]
pub fn sentence(findings: &[Finding], good: &str) -> String {
    match findings {
        [] => good.to_owned(),
        [one] => format!("doubtful: {}", one.says),
        [first, rest @ ..] => {
            let names: Vec<&str> = rest.iter().map(|f| f.name).collect();
            format!("doubtful: {} (also: {})", first.says, names.join(", "))
        }
    }
}
