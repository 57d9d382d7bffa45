//! The text of Zernike coefficients.

use super::zernike::LARGEST;
use crate::values::by_text;
use std::fmt;
use std::str::FromStr;

/// Zernike coefficients in waves rms by Noll index, as they are written: `4:0.1,7:-0.05`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ZernikeList(pub Vec<(usize, f64)>);
by_text!(ZernikeList, "string", "Zernike coefficients by Noll index in waves, such as \"4:0.1,7:-0.05\".");

impl FromStr for ZernikeList {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let one = |part: &str| {
            let (index, waves) = part.split_once(':')?;
            let pair = (index.trim().parse().ok()?, waves.trim().parse::<f64>().ok()?);
            ((1..=LARGEST).contains(&pair.0) && pair.1.abs() <= 100.0).then_some(pair)
        };
        let bad = |part: &str| format!("{part:?} is not INDEX:WAVES with a Noll index from 1 to {LARGEST} and at most 100 waves");
        let list: Vec<(usize, f64)> = text.split(',').map(|part| one(part).ok_or_else(|| bad(part))).collect::<Result<_, _>>()?;
        let twice = list.iter().enumerate().find(|(k, (index, _))| list[..*k].iter().any(|other| other.0 == *index));
        match twice {
            Some((_, (index, _))) => Err(format!("index {index} is given twice: write one coefficient for it")),
            None => Ok(Self(list)),
        }
    }
}

impl fmt::Display for ZernikeList {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (k, (index, waves)) in self.0.iter().enumerate() {
            write!(f, "{}{index}:{waves}", if k == 0 { "" } else { "," })?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coefficients_are_read_and_written() {
        let list: ZernikeList = "4:0.1, 7:-0.05".parse().unwrap();
        assert_eq!(list.0, [(4, 0.1), (7, -0.05)]);
        assert_eq!(list.to_string().parse::<ZernikeList>().unwrap(), list);
        for text in ["", "4", "0:1", "999:1", "4:x", "4:nan", "4:1e9"] {
            assert!(text.parse::<ZernikeList>().unwrap_err().contains("INDEX:WAVES"), "{text}");
        }
        assert!("4:0.1,5:0.2,4:0.3".parse::<ZernikeList>().unwrap_err().contains("4 is given twice"));
    }
}
