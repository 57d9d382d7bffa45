//! The error of a command: what the command was doing, the chain of causes, and the exit code.

use cittert_arrays::BoxError;
use std::fmt;
use std::io::Write;

/// Result of a command.
pub type Result<T, E = Failure> = std::result::Result<T, E>;

/// A failed command.
#[derive(Debug)]
pub struct Failure {
    kind: Kind,
}

#[derive(Debug)]
enum Kind {
    /// The command line was wrong.
    Usage(String),
    /// clap refused the command line, or printed the help.
    Clap(clap::Error),
    /// The work failed. The outermost context comes first.
    Failed { contexts: Vec<String>, cause: Option<BoxError> },
}

impl Failure {
    /// A wrong command line: exit code 2.
    #[must_use]
    pub fn usage(message: impl Into<String>) -> Self {
        Self { kind: Kind::Usage(message.into()) }
    }

    /// The library has found an option that is wrong: exit code 2.
    #[must_use]
    pub fn call(error: crate::ChainError) -> Self {
        match error {
            crate::ChainError::BadOption { .. } => Self::usage(told(&error)),
            other => other.into(),
        }
    }

    /// A failure that is not an error of a library: exit code 1.
    #[must_use]
    pub fn message(message: impl Into<String>) -> Self {
        Self { kind: Kind::Failed { contexts: vec![message.into()], cause: None } }
    }

    /// 1 for a failure, 2 for a wrong command line, 0 for help.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        match &self.kind {
            Kind::Usage(_) => 2,
            Kind::Clap(e) => u8::try_from(e.exit_code()).unwrap_or(2),
            Kind::Failed { .. } => 1,
        }
    }

    /// Print to stderr (help goes to stdout).
    pub fn print(&self) {
        // Nothing can be done where stderr is closed.
        let _ = match &self.kind {
            Kind::Clap(e) => e.print(),
            _ => writeln!(std::io::stderr(), "error: {self}"),
        };
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.kind {
            Kind::Usage(m) => f.write_str(m),
            Kind::Clap(e) => write!(f, "{e}"),
            Kind::Failed { contexts, cause } => {
                let mut parts: Vec<String> = contexts.clone();
                let mut next: Option<&dyn std::error::Error> = cause.as_ref().map(|c| c.as_ref() as _);
                while let Some(e) = next {
                    let text = told(e);
                    // An error that only wraps another repeats its text.
                    if parts.last().is_none_or(|last| !last.ends_with(&text)) {
                        parts.push(text);
                    }
                    next = e.source();
                }
                for (i, part) in parts.iter().enumerate() {
                    let lead = if i == 0 { "" } else { "\n  caused by: " };
                    write!(f, "{lead}{}", part.trim_end())?;
                }
                Ok(())
            }
        }
    }
}

/// An error in the words of the command line: the library names fields, which are options here.
fn told(error: &(dyn std::error::Error + 'static)) -> String {
    match error.downcast_ref::<crate::ChainError>() {
        Some(crate::ChainError::BadOption { option, .. }) if !option.contains(' ') => {
            format!("--{}", error.to_string().replacen(option, &option.replace('_', "-"), 1))
        }
        _ => error.to_string(),
    }
}

impl std::error::Error for Failure {}

impl From<clap::Error> for Failure {
    fn from(e: clap::Error) -> Self {
        Self { kind: Kind::Clap(e) }
    }
}

macro_rules! from_error {
    ($($t:ty),* $(,)?) => {
        $(impl From<$t> for Failure {
            fn from(e: $t) -> Self {
                Self { kind: Kind::Failed { contexts: Vec::new(), cause: Some(Box::new(e)) } }
            }
        })*
    };
}

from_error!(
    crate::ChainError,
    cittert_arrays::ArrayError,
    cittert_formats::FormatError,
    cittert_formats::layouts::LayoutError,
    cittert_phenomenology::SceneError,
    cittert_phenomenology::geometry::GeometryError,
    cittert_phenomenology::atmosphere::PhysicsError,
    cittert_phenomenology::dielectrics::DielectricError,
    cittert_phenomenology::surfaces::SurfaceError,
    std::io::Error,
    serde_json::Error,
    toml::de::Error,
);

/// Add to an error what the program was doing.
pub trait Context<T> {
    /// Put a sentence before the error.
    ///
    /// # Errors
    /// The same error, with the sentence before it.
    fn context(self, what: impl fmt::Display) -> Result<T>;
}

impl<T, E: Into<Failure>> Context<T> for std::result::Result<T, E> {
    fn context(self, what: impl fmt::Display) -> Result<T> {
        self.map_err(|e| {
            let mut failure: Failure = e.into();
            if let Kind::Failed { contexts, .. } = &mut failure.kind {
                contexts.insert(0, what.to_string());
            }
            failure
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::ArrayError;

    #[test]
    fn the_chain_of_causes_is_printed_once_each() {
        let inner = ArrayError::Parse("line 3: what is this".into());
        let r: Result<()> = Err(crate::ChainError::from(inner)).context("reading x.toml");
        let failure = r.unwrap_err();
        assert_eq!(failure.exit_code(), 1);
        assert_eq!(failure.to_string(), "reading x.toml\n  caused by: line 3: what is this");
    }

    #[test]
    fn a_wrong_call_exits_with_2() {
        assert_eq!(Failure::usage("no").exit_code(), 2);
    }
}
