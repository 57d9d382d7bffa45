//! Answers to the page: JSON as text, and numbers as binary frames with a JSON header.

use serde_json::Value;
use std::sync::Arc;

/// Where answers go. It returns false once the tab is closed.
pub(super) type Send = Arc<dyn Fn(Answer) -> bool + std::marker::Send + Sync>;

/// One answer.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Answer {
    /// An object.
    Text(String),
    /// A header and numbers.
    Binary(Vec<u8>),
}

impl Answer {
    pub(super) fn json(value: &Value) -> Self {
        Self::Text(value.to_string())
    }

    /// Numbers in single precision with their header: the length of the header in bytes as u32, the header as JSON, filled up with spaces to a
    /// multiple of four, and the numbers. All are little-endian.
    pub(super) fn numbers(header: &Value, numbers: &[f32]) -> Self {
        let mut text = header.to_string();
        text.push_str(&" ".repeat(text.len().next_multiple_of(4) - text.len()));
        let mut bytes = Vec::with_capacity(4 + text.len() + 4 * numbers.len());
        bytes.extend((text.len() as u32).to_le_bytes());
        bytes.extend(text.as_bytes());
        numbers.iter().for_each(|v| bytes.extend(v.to_le_bytes()));
        Self::Binary(bytes)
    }
}
