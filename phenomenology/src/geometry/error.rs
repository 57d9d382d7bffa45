//! What can be wrong with bodies and regions, with the line.

use crate::primitives::PrimitiveFault;
use std::fmt;
use thiserror::Error;

/// A line of a file, from 1; 0 where there is no file, and then nothing is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct At(pub usize);

impl fmt::Display for At {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0 > 0 { write!(f, "line {}: ", self.0) } else { Ok(()) }
    }
}

/// Bodies or regions that make no geometry.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum GeometryError {
    /// A line that cannot be read.
    #[error("{at}{message}")]
    Syntax {
        /// Where.
        at: At,
        /// What is wrong and what is expected.
        message: String,
    },
    /// A body that cannot be.
    #[error("{at}body `{name}`: {fault}")]
    Body {
        /// Where.
        at: At,
        /// Its name.
        name: String,
        /// Why.
        fault: PrimitiveFault,
    },
    /// Two bodies or two regions of one name.
    #[error("{at}{what} `{name}` was already given at line {first}; names must differ")]
    Duplicate {
        /// Where.
        at: At,
        /// Body or region.
        what: &'static str,
        /// Its name.
        name: String,
        /// Line of the first.
        first: usize,
    },
    /// A region that names a body that is not there.
    #[error("{at}region `{region}` names unknown body `{body}`; {known}")]
    UnknownBody {
        /// Where.
        at: At,
        /// The region.
        region: String,
        /// The body.
        body: String,
        /// What there is.
        known: String,
    },
    /// A region without any body.
    #[error("{at}region `{region}` names no body; give an expression such as `+1 -2 OR +3`")]
    NoBody {
        /// Where.
        at: At,
        /// The region.
        region: String,
    },
    /// A solid region that reaches to infinity.
    #[error("{at}region `{region}` has a term without a + body, so it has no end; add the body it lies in")]
    Unbounded {
        /// Where.
        at: At,
        /// The region.
        region: String,
    },
    /// Too many overlapping empty regions before a solid one.
    #[error("{at}region `{region}` is cut by so many empty regions listed before it that it falls into more than {limit} terms")]
    TooComplex {
        /// Where.
        at: At,
        /// The region.
        region: String,
        /// Most terms allowed.
        limit: usize,
    },
    /// No region of this name.
    #[error("there is no region `{name}`; {known}")]
    UnknownRegion {
        /// The name asked for.
        name: String,
        /// What there is.
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

/// A few of the known names, for messages.
pub(crate) fn some_names<'a>(what: &str, names: impl Iterator<Item = &'a str>) -> String {
    let all: Vec<&str> = names.collect();
    match all.len() {
        0 => format!("there are no {what}"),
        n if n <= 12 => format!("known {what}: {}", all.join(", ")),
        n => format!("known {what}: {}, ... ({n} in all)", all[..12].join(", ")),
    }
}
