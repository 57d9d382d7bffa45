//! Numbers that no option can use: NaN, infinity, and anything beyond 1e30. The command line and the files of `run`, `study` and `corrupt`
//! refuse them here, so that no option needs to check for them.

use super::failure::{Failure, Result};
use clap::{Arg, Command};
use serde::de::DeserializeOwned;
use std::any::TypeId;
use std::path::Path;

/// The largest number of an option. Quantities with a unit have the same limit.
const LARGEST: f64 = 1e30;

pub(super) fn usable(number: f64) -> bool {
    number.abs() <= LARGEST
}

/// A number of the command line.
fn number(text: &str) -> std::result::Result<f64, String> {
    match text.trim().parse() {
        Ok(number) if usable(number) => Ok(number),
        Ok(_) => Err("expected a finite number of at most 1e30".into()),
        Err(_) => Err("expected a number".into()),
    }
}

/// The command with every option that takes a number limited to usable ones.
pub(super) fn limited(command: Command) -> Command {
    let limit = |arg: Arg| if arg.get_value_parser().type_id() == TypeId::of::<f64>() { arg.value_parser(number) } else { arg };
    command.mut_args(limit).mut_subcommands(limited)
}

/// Read a file of options.
///
/// # Errors
/// The text is not TOML, does not have the form of `T`, or has a number that no option can use. The message names the file and the place.
pub(super) fn read<T: DeserializeOwned>(text: &str, path: &Path) -> Result<T> {
    check(text).map_err(|e| Failure::message(format!("{}: {e}", path.display())))?;
    toml::from_str(text).map_err(|e| Failure::message(format!("{}: {e}", path.display())))
}

/// Refuse a text with a number that no option can use. A text that is not TOML passes: its reader has the better message.
fn check(text: &str) -> std::result::Result<(), String> {
    let Ok(table) = text.parse::<toml::Table>() else { return Ok(()) };
    match unusable(&toml::Value::Table(table), "") {
        Some((key, number)) => Err(format!("{key} is {number}, expected a finite number of at most 1e30")),
        None => Ok(()),
    }
}

/// The first number that no option can use, with its place.
fn unusable(value: &toml::Value, key: &str) -> Option<(String, f64)> {
    match value {
        toml::Value::Float(number) => (!usable(*number)).then(|| (key.to_owned(), *number)),
        toml::Value::Array(list) => list.iter().find_map(|v| unusable(v, key)),
        toml::Value::Table(table) => {
            table.iter().find_map(|(k, v)| unusable(v, &if key.is_empty() { k.clone() } else { format!("{key}.{k}") }))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_of_the_command_line_is_finite_and_not_huge() {
        let parse = |word: &str| {
            let number = format!("--nsigma={word}");
            limited(super::super::command()).try_get_matches_from(["cittert", "clean", "a", "-o", "b", &number])
        };
        assert!(parse("3").is_ok() && parse("-1e30").is_ok());
        for word in ["nan", "inf", "-inf", "1e300", "x", ""] {
            let e = parse(word).unwrap_err().to_string();
            assert!(e.contains("expected a") && e.contains("--nsigma"), "{e}");
        }
    }

    #[test]
    fn a_file_names_the_place_of_a_number_that_no_option_can_use() {
        assert!(check("a = 1e30\n[b]\nc = [1.0, -2]\n").is_ok());
        for (text, place) in
            [("[[clean]]\nnsigma = inf\n", "clean.nsigma is inf"), ("[b]\nc = [1.0, nan]\n", "b.c is NaN"), ("d = -1e300", "d is -")]
        {
            let e = check(text).unwrap_err();
            assert!(e.contains(place), "{e}");
        }
    }
}
