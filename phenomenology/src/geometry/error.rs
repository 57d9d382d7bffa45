//! Errors of bodies and regions, with the line of the file.

use crate::primitives::PrimitiveFault;
use std::fmt;
use thiserror::Error;

/// Number of a line of a file, from 1. It is 0, and is not shown, if there is no file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct At(pub usize);

impl fmt::Display for At {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0 > 0 { write!(f, "line {}: ", self.0) } else { Ok(()) }
    }
}

/// An error of bodies or regions.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum GeometryError {
    /// A fault at a line.
    #[error("{at}{message}")]
    At {
        /// Line of the file.
        at: At,
        /// What is wrong and what is expected.
        message: String,
    },
    /// No region of this name.
    #[error("there is no region `{name}`; {known}")]
    UnknownRegion {
        /// The name asked for.
        name: String,
        /// The known names.
        known: String,
    },
    /// A row of rays or points that cannot be used.
    #[error("row {row}: {message}")]
    Row {
        /// Number of the row, the header not counted, from 1.
        row: usize,
        /// What is wrong.
        message: String,
    },
}

impl GeometryError {
    /// A fault at a line.
    pub(crate) fn at(line: usize, message: impl Into<String>) -> Self {
        Self::At { at: At(line), message: message.into() }
    }

    /// A body with wrong parameters.
    pub(crate) fn body(line: usize, name: &str, fault: PrimitiveFault) -> Self {
        Self::at(line, format!("body `{name}`: {fault}"))
    }

    /// A region without bodies.
    pub(crate) fn no_body(line: usize, region: &str) -> Self {
        Self::at(line, format!("region `{region}` names no body; give an expression such as `+1 -2 OR +3`"))
    }
}

/// The first of the known names, for messages.
pub(crate) fn some_names<'a>(what: &str, names: impl Iterator<Item = &'a str>) -> String {
    let all: Vec<&str> = names.collect();
    match all.len() {
        0 => format!("there are no {what}"),
        n if n <= 12 => format!("known {what}: {}", all.join(", ")),
        n => format!("known {what}: {}, ... ({n} in all)", all[..12].join(", ")),
    }
}
