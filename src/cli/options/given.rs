//! Options of a file under those of the command line.

use crate::cli::failure::{Failure, Result};
use crate::cli::numbers;
use clap::parser::ValueSource;
use clap::{ArgMatches, Args, Command, FromArgMatches};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::collections::BTreeSet;
use std::path::Path;

/// Options, and which of them were typed: these replace the values of a file, and defaults do not.
#[derive(Debug, Clone)]
pub struct Given<T> {
    options: T,
    typed: BTreeSet<String>,
}

impl<T: Clone + Serialize + DeserializeOwned> Given<T> {
    /// The options alone, or those of a file with the typed ones in the place of its own. A table of the file is a group of options.
    ///
    /// # Errors
    /// A file that cannot be read, or that has something else than these options. The message names the place.
    pub fn over(&self, file: Option<&Path>) -> Result<T> {
        let Some(path) = file else { return Ok(self.options.clone()) };
        let text = cittert_formats::read_text(path)?;
        // The file alone is read first, as its errors have a line.
        numbers::read::<T>(&text, path)?;
        let lost = |e: &dyn std::fmt::Display| Failure::message(format!("{}: {e}", path.display()));
        let mut table: toml::Table = text.parse().map_err(|e: toml::de::Error| lost(&e))?;
        let own = toml::Table::try_from(&self.options).map_err(|e| lost(&e))?;
        self.replace(&mut table, own);
        table.try_into().map_err(|e: toml::de::Error| lost(&e))
    }

    /// True if this option was typed.
    #[must_use]
    pub fn has(&self, id: &str) -> bool {
        self.typed.contains(id)
    }

    fn replace(&self, table: &mut toml::Table, own: toml::Table) {
        for (key, value) in own {
            match value {
                toml::Value::Table(group) => {
                    if let toml::Value::Table(inner) = table.entry(key).or_insert_with(|| toml::Value::Table(toml::Table::new())) {
                        self.replace(inner, group);
                    }
                }
                value if self.typed.contains(&key.replace('-', "_")) => drop(table.insert(key, value)),
                _ => {}
            }
        }
    }

    fn typed(matches: &ArgMatches) -> BTreeSet<String> {
        let typed = |id: &&clap::Id| matches.value_source(id.as_str()) == Some(ValueSource::CommandLine);
        matches.ids().filter(typed).map(|id| id.as_str().to_owned()).collect()
    }
}

impl<T: FromArgMatches + Clone + Serialize + DeserializeOwned> FromArgMatches for Given<T> {
    fn from_arg_matches(matches: &ArgMatches) -> std::result::Result<Self, clap::Error> {
        Ok(Self { typed: Self::typed(matches), options: T::from_arg_matches(matches)? })
    }

    fn from_arg_matches_mut(matches: &mut ArgMatches) -> std::result::Result<Self, clap::Error> {
        // Reading takes the values out.
        let typed = Self::typed(matches);
        Ok(Self { typed, options: T::from_arg_matches_mut(matches)? })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> std::result::Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

impl<T: Args + Clone + Serialize + DeserializeOwned> Args for Given<T> {
    fn augment_args(command: Command) -> Command {
        T::augment_args(command)
    }

    fn augment_args_for_update(command: Command) -> Command {
        T::augment_args_for_update(command)
    }
}
