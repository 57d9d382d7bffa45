//! The error of a command: what the command was doing, the chain of causes, and the exit code.

pub(crate) use crate::ensure;
use cittert_arrays::{ArrayError, BoxError};
use std::fmt;
use std::io::Write;

/// Result of a command.
pub type Result<T, E = Failure> = std::result::Result<T, E>;

/// A failed command.
#[derive(Debug)]
pub struct Failure {
    /// What the command was doing, the outermost first.
    contexts: Vec<String>,
    cause: Option<BoxError>,
    /// The command line was wrong.
    usage: bool,
    /// What the command will take is not known before.
    unforeseen: bool,
}

impl Failure {
    /// A wrong command line: exit code 2.
    #[must_use]
    pub fn usage(message: impl Into<String>) -> Self {
        Self { usage: true, ..Self::message(message) }
    }

    /// There is no forecast of what was asked for: exit code 2.
    #[must_use]
    pub fn unforeseen(message: impl Into<String>) -> Self {
        Self { unforeseen: true, ..Self::usage(message) }
    }

    /// Whether only the forecast is missing, and the command itself would work.
    #[must_use]
    pub fn is_unforeseen(&self) -> bool {
        self.unforeseen
    }

    /// The library has found an option that is wrong: exit code 2.
    #[must_use]
    pub fn call(error: crate::ChainError) -> Self {
        match error {
            crate::ChainError::BadOption { .. } | crate::ChainError::Array(ArrayError::BadOption { .. }) => Self::usage(told(&error)),
            other => other.into(),
        }
    }

    /// A failure that is not an error of a library: exit code 1.
    #[must_use]
    pub fn message(message: impl Into<String>) -> Self {
        Self { contexts: vec![message.into()], cause: None, usage: false, unforeseen: false }
    }

    /// The same failure with another name for a file, where it has one that the user does not know.
    #[must_use]
    pub fn renamed(self, hidden: &str, last: &str) -> Self {
        let text = self.to_string();
        if self.of_clap().is_some() || !text.contains(hidden) {
            return self;
        }
        Self { usage: self.usage, unforeseen: self.unforeseen, ..Self::message(text.replace(hidden, last)) }
    }

    /// clap refused the command line, or printed the help.
    fn of_clap(&self) -> Option<&clap::Error> {
        self.cause.as_ref()?.downcast_ref()
    }

    /// 1 for a failure, 2 for a wrong command line, 0 for help.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        let other = if self.usage { 2 } else { 1 };
        self.of_clap().map_or(other, |e| u8::try_from(e.exit_code()).unwrap_or(2))
    }

    /// Print to stderr (help goes to stdout).
    pub fn print(&self) {
        // Nothing can be done where stderr is closed.
        let _ = match self.of_clap() {
            Some(e) => e.print(),
            // One write for the whole line: what mpirun or another process prints meanwhile cannot come between its parts.
            None => std::io::stderr().write_all(format!("error: {self}\n").as_bytes()),
        };
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut parts: Vec<String> = self.contexts.clone();
        let mut next: Option<&dyn std::error::Error> = self.cause.as_ref().map(|c| c.as_ref() as _);
        while let Some(e) = next {
            let text = told(e);
            // An error that only wraps another repeats its text.
            if parts.last().is_none_or(|last| !last.ends_with(&text)) {
                parts.push(text);
            }
            next = e.source();
        }
        let parts: Vec<&str> = parts.iter().map(|p| p.trim_end()).collect();
        f.write_str(&parts.join("\n  caused by: "))
    }
}

/// An error in the words of the command line: the library names fields, which are options here.
fn told(error: &(dyn std::error::Error + 'static)) -> String {
    let chain = error.downcast_ref::<crate::ChainError>();
    let arrays = match chain {
        Some(crate::ChainError::Array(inner)) => Some(inner),
        _ => error.downcast_ref::<ArrayError>(),
    };
    let option = match (chain, arrays) {
        (Some(crate::ChainError::BadOption { option, .. }), _) | (_, Some(ArrayError::BadOption { option, .. })) => Some(option),
        _ => None,
    };
    if let Some(option) = option.filter(|o| !o.contains(' ')) {
        return format!("--{}", error.to_string().replacen(option, &option.replace('_', "-"), 1));
    }
    match chain {
        Some(crate::ChainError::FarGains(_)) => format!("{error}, or --force"),
        _ => error.to_string(),
    }
}

impl<E: std::error::Error + Send + Sync + 'static> From<E> for Failure {
    fn from(e: E) -> Self {
        Self { contexts: Vec::new(), cause: Some(Box::new(e)), usage: false, unforeseen: false }
    }
}

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
            if !failure.usage && failure.of_clap().is_none() {
                failure.contexts.insert(0, what.to_string());
            }
            failure
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_chain_of_causes_is_printed_once_each() {
        let inner = ArrayError::Parse("line 3: what is this".into());
        let r: Result<()> = Err(crate::ChainError::from(inner)).context("reading x.toml");
        let failure = r.unwrap_err();
        assert_eq!(failure.exit_code(), 1);
        assert_eq!(failure.to_string(), "reading x.toml\n  caused by: line 3: what is this");
    }

    #[test]
    fn a_hidden_name_is_replaced_in_the_whole_chain() {
        let r: Result<()> = Err(crate::ChainError::from(ArrayError::Parse("in .x.partial/a".into()))).context("reading .x.partial/b");
        assert_eq!(r.unwrap_err().renamed(".x.partial", "x").to_string(), "reading x/b\n  caused by: in x/a");
    }

    #[test]
    fn a_wrong_call_exits_with_2() {
        assert_eq!(Failure::usage("no").exit_code(), 2);
        // A field of a struct of options is a flag here, whichever crate has the struct.
        let wrong = ArrayError::need("uv_cell", 0, false, "a length").unwrap_err();
        assert_eq!(
            Failure::from(ArrayError::need("uv_cell", 0, false, "a length").unwrap_err()).to_string(),
            "--uv-cell is 0, expected a length"
        );
        let failure = Failure::call(wrong.into());
        assert_eq!((failure.exit_code(), failure.to_string().as_str()), (2, "--uv-cell is 0, expected a length"));
    }
}
