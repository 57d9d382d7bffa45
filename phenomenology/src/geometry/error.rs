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
    /// A line that cannot be read.
    #[error("{at}{message}")]
    Syntax {
        /// Line of the file.
        at: At,
        /// What is wrong and what is expected.
        message: String,
    },
    /// A body with wrong parameters.
    #[error("{at}body `{name}`: {fault}")]
    Body {
        /// Line of the file.
        at: At,
        /// Its name.
        name: String,
        /// The fault.
        fault: PrimitiveFault,
    },
    /// Two bodies or two regions of one name.
    #[error("{at}{what} `{name}` was already given at line {first}; names must differ")]
    Duplicate {
        /// Line of the file.
        at: At,
        /// Body or region.
        what: &'static str,
        /// Its name.
        name: String,
        /// Line of the first.
        first: usize,
    },
    /// A region that names an unknown body.
    #[error("{at}region `{region}` names unknown body `{body}`; {known}")]
    UnknownBody {
        /// Line of the file.
        at: At,
        /// The region.
        region: String,
        /// The body.
        body: String,
        /// The known names.
        known: String,
    },
    /// A region without bodies.
    #[error("{at}region `{region}` names no body; give an expression such as `+1 -2 OR +3`")]
    NoBody {
        /// Line of the file.
        at: At,
        /// The region.
        region: String,
    },
    /// A solid region of infinite size.
    #[error("{at}region `{region}` has a term without a + body, so it is infinite; add a + body that contains it")]
    Unbounded {
        /// Line of the file.
        at: At,
        /// The region.
        region: String,
    },
    /// A solid region that overlaps with too many empty regions listed before it.
    #[error("{at}region `{region}` has more than {limit} terms after the empty regions listed before it are cut away")]
    TooComplex {
        /// Line of the file.
        at: At,
        /// The region.
        region: String,
        /// Largest number of terms.
        limit: usize,
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

/// The first of the known names, for messages.
pub(crate) fn some_names<'a>(what: &str, names: impl Iterator<Item = &'a str>) -> String {
    let all: Vec<&str> = names.collect();
    match all.len() {
        0 => format!("there are no {what}"),
        n if n <= 12 => format!("known {what}: {}", all.join(", ")),
        n => format!("known {what}: {}, ... ({n} in all)", all[..12].join(", ")),
    }
}
