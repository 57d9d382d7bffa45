//! Numbers of the tables: values as they were typed, combinations of lists, fractions and salinities.

use crate::cli::failure::{Failure, Result};
use cittert_arrays::quantity::{Angle, Frequency};
use std::path::Path;
use std::str::FromStr;

/// Largest number of rows of one table.
const MAX_ROWS: usize = 1_000_000;

/// A number without the rounding error of its unit conversion. 15 significant digits are kept, so that 22.235 GHz prints as 22.235 again.
pub(super) fn exact(x: f64) -> f64 {
    // A formatted number always parses.
    format!("{x:.14e}").parse().unwrap_or(x)
}

/// Frequencies in GHz, as typed.
pub(super) fn ghz(freqs: &[Frequency]) -> Vec<f64> {
    freqs.iter().map(|f| exact(f.si() / 1e9)).collect()
}

/// Angles in degrees, as typed.
pub(super) fn degrees(angles: &[Angle]) -> Vec<f64> {
    angles.iter().map(|a| exact(a.si().to_degrees())).collect()
}

/// Check the number of rows of a table before the first row is computed. A list that is left out counts as one value.
///
/// # Errors
/// More than a million combinations.
pub(super) fn check_rows(lengths: &[usize]) -> Result<()> {
    match lengths.iter().try_fold(1_usize, |n, l| n.checked_mul((*l).max(1))) {
        Some(n) if n <= MAX_ROWS => Ok(()),
        _ => Err(Failure::usage(format!("the lists combine to more than {MAX_ROWS} rows; give fewer values"))),
    }
}

/// Indices of every combination of lists of these lengths; the index of the last list changes fastest.
pub(super) fn combinations<const N: usize>(lengths: [usize; N]) -> impl Iterator<Item = [usize; N]> {
    (0..lengths.iter().product()).map(move |row: usize| {
        let (mut left, mut index) = (row, [0; N]);
        for (i, length) in index.iter_mut().zip(lengths).rev() {
            (*i, left) = (left % length, left / length);
        }
        index
    })
}

/// The text of an input file.
///
/// # Errors
/// A path that is no regular file, a file above `max_bytes`, a file that cannot be read as text. The message names `what`, such as "profile".
pub(super) fn read_text(path: &Path, what: &str, max_bytes: u64) -> Result<String> {
    let refuse = |why: String| Failure::message(format!("{}: {why}", path.display()));
    let facts = path.metadata().map_err(|e| refuse(e.to_string()))?;
    if !facts.is_file() || facts.len() > max_bytes {
        return Err(refuse(format!("this is no {what}; give a text file of at most {} MiB", max_bytes >> 20)));
    }
    std::fs::read_to_string(path).map_err(|e| refuse(e.to_string()))
}

/// A fraction: `0.2` or `20%`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fraction(pub(super) f64);

impl FromStr for Fraction {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        number(text, &[("%", 100.0)]).map(Self).ok_or_else(|| format!("{text:?} is not a fraction: write 0.2 or 20%"))
    }
}

/// A salinity in psu (practical salinity units, parts per thousand): `35` or `35psu`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Salinity(pub(super) f64);

impl FromStr for Salinity {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let value = number(text, &[("psu", 1.0), ("g/kg", 1.0)]);
        value.map(Self).ok_or_else(|| format!("{text:?} is not a salinity: write parts per thousand, 35 or 35psu"))
    }
}

/// A finite number, either alone or followed by a unit. Each unit comes with the number that divides the value.
fn number(text: &str, units: &[(&str, f64)]) -> Option<f64> {
    let text = text.trim();
    let with_unit = units.iter().find_map(|(unit, divisor)| Some((text.strip_suffix(unit)?.trim_end(), *divisor)));
    let (digits, divisor) = with_unit.unwrap_or((text, 1.0));
    digits.parse::<f64>().ok().filter(|x| x.is_finite()).map(|x| x / divisor)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_out_as_they_were_typed() {
        for text in ["22.235GHz", "94GHz", "183.31GHz", "0.118750343THz"] {
            let f: Frequency = text.parse().unwrap();
            let typed: f64 = if text.ends_with("THz") { 118.750343 } else { text[..text.len() - 3].parse().unwrap() };
            assert_eq!(ghz(&[f]), [typed], "{text}");
        }
        for z in [30.0, 55.7, 85.0, 89.9, 90.0] {
            assert_eq!(degrees(&[format!("{z}deg").parse().unwrap()]), [z]);
        }
    }

    #[test]
    fn fractions_and_salinities() {
        assert_eq!("20%".parse(), Ok(Fraction(0.2)));
        assert_eq!("0.2".parse(), Ok(Fraction(0.2)));
        assert_eq!("35 psu".parse(), Ok(Salinity(35.0)));
        assert!("wet".parse::<Fraction>().unwrap_err().contains("20%"));
        assert!("nan".parse::<Salinity>().is_err());
    }

    #[test]
    fn a_table_of_a_billion_rows_is_refused() {
        assert!(check_rows(&[1000, 1000]).is_ok());
        assert!(check_rows(&[1000, 1001]).is_err());
        assert!(check_rows(&[usize::MAX, 2]).is_err());
    }

    #[test]
    fn the_last_list_changes_fastest() {
        assert_eq!(combinations([2, 1, 2]).collect::<Vec<_>>(), [[0, 0, 0], [0, 0, 1], [1, 0, 0], [1, 0, 1]]);
        assert_eq!(combinations([3, 0]).count(), 0);
    }
}
