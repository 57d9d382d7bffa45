//! Values of the tables: numbers as they were typed, shares and salinities, and their combinations.

use crate::cli::failure::{Failure, Result};
use cittert_arrays::quantity::{Angle, Frequency};
use std::str::FromStr;

/// Most rows of one table.
const MAX_ROWS: usize = 1_000_000;

/// A number freed of the rounding of its unit conversion: 15 digits are kept, so that 22.235 GHz is 22.235 again.
pub(super) fn exact(x: f64) -> f64 {
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

/// Refuse tables that nobody wants before their first row is made.
///
/// # Errors
/// More than a million combinations.
pub(super) fn check_rows(lengths: &[usize]) -> Result<()> {
    let rows = lengths.iter().try_fold(1_usize, |n, l| n.checked_mul((*l).max(1)));
    match rows {
        Some(n) if n <= MAX_ROWS => Ok(()),
        _ => Err(Failure::usage(format!("the lists combine to more than {MAX_ROWS} rows; give fewer values"))),
    }
}

/// Values for a list that may be left out: none at all stands for one absent value.
pub(super) fn or_absent<T: Copy>(values: &[T]) -> Vec<Option<T>> {
    if values.is_empty() { vec![None] } else { values.iter().copied().map(Some).collect() }
}

/// A fraction: `0.2` or `20%`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fraction(pub(super) f64);

impl FromStr for Fraction {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        number(text, &[("%", 100.0)]).map(Self).ok_or_else(|| format!("{text:?} is no fraction: write 0.2 or 20%"))
    }
}

/// A salinity in psu, parts per thousand: `35` or `35psu`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Salinity(pub(super) f64);

impl FromStr for Salinity {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        number(text, &[("psu", 1.0), ("g/kg", 1.0)])
            .map(Self)
            .ok_or_else(|| format!("{text:?} is no salinity: write parts per thousand, 35 or 35psu"))
    }
}

/// A finite number alone, or with a unit that divides it.
fn number(text: &str, units: &[(&str, f64)]) -> Option<f64> {
    let text = text.trim();
    let (digits, divisor) =
        units.iter().find_map(|(unit, divisor)| text.strip_suffix(unit).map(|d| (d.trim_end(), *divisor))).unwrap_or((text, 1.0));
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
        assert_eq!(or_absent::<f64>(&[]), [None]);
    }
}
