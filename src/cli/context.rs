//! Parts that all subcommands share: the options of the whole program, and the form of a result.

use super::ahead::Ahead;
use super::console::Console;
use super::failure::Result;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// The result of a command: JSON for programs, text for people.
#[derive(Debug, Default)]
pub struct Outcome {
    /// One JSON object. Numbers are in SI units, with the unit in the key.
    pub json: serde_json::Value,
    /// The same as text.
    pub text: String,
    /// Files that were written, in order.
    pub written: Vec<PathBuf>,
    /// Why the command failed although it has results (exit code 1).
    pub failed: Option<String>,
}

impl Outcome {
    /// A result as JSON and as text.
    #[must_use]
    pub fn new(json: serde_json::Value, text: impl Into<String>) -> Self {
        Self { json, text: text.into(), written: Vec::new(), failed: None }
    }

    /// Add a file that was written.
    #[must_use]
    pub fn wrote(mut self, path: impl AsRef<Path>) -> Self {
        self.written.push(path.as_ref().to_path_buf());
        self
    }
}

/// Options of the whole program, and the console.
#[derive(Debug)]
pub struct Context {
    /// The command line as it was typed.
    pub command_line: String,
    /// Progress and notes on stderr.
    pub console: Console,
    /// How `run` starts the subcommands of its steps.
    pub subcommands: Subcommands,
    /// Sets that the commands of a forecast would have written.
    pub(super) ahead: Ahead,
}

/// Access to the other subcommands. A subcommand must not use the table of subcommands, so `run` receives it as two functions.
#[derive(Debug, Clone, Copy)]
pub struct Subcommands {
    /// Check the words of a command line without running them.
    pub check: fn(&[OsString]) -> Result<()>,
    /// Run the words of a command line.
    pub run: fn(&[OsString], &Context) -> Result<Outcome>,
}

impl Context {
    /// The line that every output has in its history.
    #[must_use]
    pub fn history(&self) -> String {
        format!("cittert {}: {}", env!("CARGO_PKG_VERSION"), self.command_line)
    }
}

/// An enum of subcommands, one row each: what it does, its arguments, and the function that runs it.
macro_rules! subcommands {
    ($(#[$meta:meta])* $name:ident { $($(#[$about:meta])+ $variant:ident($args:ty) => $run:expr;)+ }) => {
        $(#[$meta])*
        #[derive(Debug, clap::Subcommand)]
        pub(crate) enum $name {
            $($(#[$about])+ $variant($args),)+
        }

        impl $name {
            /// Run the subcommand.
            pub(super) fn run(&self, context: &Context) -> Result<Outcome> {
                match self {
                    $(Self::$variant(args) => ($run)(args, context),)+
                }
            }
        }
    };
}
pub(super) use subcommands;

/// Quote a word for a shell where it needs quotes.
#[must_use]
pub fn shell_word(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=+:,@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) { word.to_owned() } else { format!("'{}'", word.replace('\'', "'\\''")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_quoted_only_where_needed() {
        assert_eq!(shell_word("-o"), "-o");
        assert_eq!(shell_word("a b"), "'a b'");
        assert_eq!(shell_word("it's"), "'it'\\''s'");
        assert_eq!(shell_word(""), "''");
    }
}
