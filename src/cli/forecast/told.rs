//! What a command tells of its work.

use crate::cost::Forecast;
use serde_json::{Map, Value};

/// The forecast of a command, and the facts that it follows from.
#[derive(Debug)]
pub(in crate::cli) struct Told {
    /// Name of the command.
    pub(in crate::cli) command: &'static str,
    pub(in crate::cli) forecast: Forecast,
    /// What is said about the work, in order.
    pub(in crate::cli) facts: Map<String, Value>,
}
