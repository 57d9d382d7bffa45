//! The table of kinds of patterns, and patterns as one line of text: `airy diameter_m=0.01 blockage=0.2`.
//!
//! A line is short enough for one card of a FITS header. Tables of samples have no such line.

use super::airy::Airy;
use super::cos_power::CosPower;
use super::element::ElementPattern;
use super::gaussian::Gaussian;
use crate::{ArrayError, Result};
use std::f64::consts::PI;
use std::fmt;
use std::str::FromStr;

/// A parameter of a kind of pattern.
#[derive(Debug, Clone, Copy)]
pub struct Parameter {
    /// Name with its unit, as in files.
    pub name: &'static str,
    /// What it means.
    pub about: &'static str,
    /// True if it may be left out.
    pub optional: bool,
    /// Another name, and the factor from its unit.
    alias: Option<(&'static str, f64)>,
}

/// A kind of pattern.
#[derive(Debug, Clone, Copy)]
pub struct PatternKind {
    /// Name in files.
    pub name: &'static str,
    /// What it is.
    pub about: &'static str,
    /// What it takes.
    pub parameters: &'static [Parameter],
    make: fn(&[Option<f64>]) -> ElementPattern,
    values: fn(&ElementPattern) -> Option<Vec<Option<f64>>>,
}

const fn needed(name: &'static str, about: &'static str) -> Parameter {
    Parameter { name, about, optional: false, alias: None }
}

const fn optional(name: &'static str, about: &'static str) -> Parameter {
    Parameter { name, about, optional: true, alias: None }
}

/// All kinds that have parameters. A table of samples is read from a file.
pub static PATTERN_KINDS: &[PatternKind] = &[
    PatternKind {
        name: "gaussian",
        about: "a Gaussian of the angle",
        parameters: &[
            Parameter {
                alias: Some(("fwhm_deg", PI / 180.0)),
                ..needed("fwhm_rad", "full width at half maximum of the power (or fwhm_deg)")
            },
            Parameter {
                alias: Some(("ref_freq_ghz", 1e9)),
                ..optional("ref_freq_hz", "frequency of that width, which then scales with the wavelength (or ref_freq_ghz)")
            },
        ],
        make: |v| ElementPattern::Gaussian(Gaussian { fwhm_rad: v[0].unwrap_or(f64::NAN), ref_freq_hz: v[1] }),
        values: |p| if let ElementPattern::Gaussian(g) = p { Some(vec![Some(g.fwhm_rad), g.ref_freq_hz]) } else { None },
    },
    PatternKind {
        name: "airy",
        about: "a uniformly lit circular aperture",
        parameters: &[
            needed("diameter_m", "diameter; in a layout that of the antennas is the default"),
            optional("blockage", "diameter of the blocked centre over that of the aperture"),
        ],
        make: |v| ElementPattern::Airy(Airy { diameter_m: v[0].unwrap_or(f64::NAN), blockage: v[1].unwrap_or(0.0) }),
        values: |p| match p {
            ElementPattern::Airy(a) => Some(vec![Some(a.diameter_m), Some(a.blockage).filter(|b| *b != 0.0)]),
            _ => None,
        },
    },
    PatternKind {
        name: "cos",
        about: "a power of the cosine of the angle",
        parameters: &[needed("exponent", "exponent of the power pattern")],
        make: |v| ElementPattern::CosPower(CosPower { exponent: v[0].unwrap_or(f64::NAN) }),
        values: |p| if let ElementPattern::CosPower(c) = p { Some(vec![Some(c.exponent)]) } else { None },
    },
];

/// Name of the kind that is a table of samples.
pub(crate) const SAMPLED: &str = "sampled";

impl PatternKind {
    /// The kind of this name.
    ///
    /// # Errors
    /// There is no such kind; the message lists all.
    pub fn named(name: &str) -> Result<&'static Self> {
        PATTERN_KINDS.iter().find(|k| k.name == name).ok_or_else(|| {
            let names: Vec<&str> = PATTERN_KINDS.iter().map(|k| k.name).collect();
            ArrayError::Parse(format!("{name:?} is not a kind of element pattern: use {} or {SAMPLED}", names.join(", ")))
        })
    }

    /// The pattern of this kind with these parameters.
    ///
    /// # Errors
    /// A parameter that the kind does not take, one that is stated twice or missing, or one out of its range.
    pub fn pattern(&self, given: &[(&str, f64)]) -> Result<ElementPattern> {
        let mut values = vec![None; self.parameters.len()];
        for (name, value) in given {
            let named = |p: &Parameter| match p.alias {
                _ if p.name == *name => Some(1.0),
                Some((alias, factor)) if alias == *name => Some(factor),
                _ => None,
            };
            let found = self.parameters.iter().enumerate().find_map(|(k, p)| named(p).map(|factor| (k, factor)));
            let Some((k, factor)) = found else {
                let names: Vec<&str> = self.parameters.iter().map(|p| p.name).collect();
                return Err(ArrayError::Parse(format!("a pattern of kind {:?} has no {name:?}: it takes {}", self.name, names.join(", "))));
            };
            if values[k].replace(value * factor).is_some() {
                return Err(ArrayError::Parse(format!("{} of the pattern is stated twice", self.parameters[k].name)));
            }
        }
        if let Some((p, _)) = self.parameters.iter().zip(&values).find(|(p, v)| !p.optional && v.is_none()) {
            return Err(ArrayError::Parse(format!("a pattern of kind {:?} needs {} ({})", self.name, p.name, p.about)));
        }
        let pattern = (self.make)(&values);
        pattern.check()?;
        Ok(pattern)
    }
}

impl ElementPattern {
    /// The kind and the parameters that are not at their defaults. `None` for no pattern and for a table.
    #[must_use]
    pub fn parameters(&self) -> Option<(&'static PatternKind, Vec<(&'static str, f64)>)> {
        PATTERN_KINDS.iter().find_map(|kind| {
            let values = (kind.values)(self)?;
            Some((kind, kind.parameters.iter().zip(values).filter_map(|(p, v)| Some((p.name, v?))).collect()))
        })
    }
}

impl fmt::Display for ElementPattern {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self, self.parameters()) {
            (_, Some((kind, parameters))) => {
                f.write_str(kind.name)?;
                parameters.iter().try_for_each(|(name, value)| write!(f, " {name}={value:?}"))
            }
            (Self::None, None) => f.write_str("none"),
            (_, None) => f.write_str(SAMPLED),
        }
    }
}

impl FromStr for ElementPattern {
    type Err = ArrayError;

    /// A pattern from the text that it prints. A table cannot be read from its text.
    fn from_str(text: &str) -> Result<Self> {
        let mut words = text.split_whitespace();
        let name = words.next().unwrap_or("");
        if name == "none" {
            return Ok(Self::None);
        }
        let kind = PatternKind::named(name)?;
        let parameter = |word: &'_ str| -> Result<(String, f64)> {
            let (key, value) = word.split_once('=').unwrap_or((word, ""));
            let number =
                value.parse().map_err(|_| ArrayError::Parse(format!("{word:?} is not a parameter of a pattern: write NAME=NUMBER")))?;
            Ok((key.to_owned(), number))
        };
        let given = words.map(parameter).collect::<Result<Vec<_>>>()?;
        kind.pattern(&given.iter().map(|(k, v)| (k.as_str(), *v)).collect::<Vec<_>>())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_comes_back_from_its_line_which_fits_a_card() {
        let all = [
            ElementPattern::None,
            ElementPattern::Gaussian(Gaussian { fwhm_rad: 9.0_f64.to_radians(), ref_freq_hz: None }),
            ElementPattern::Gaussian(Gaussian { fwhm_rad: 1.0 / 3.0, ref_freq_hz: Some(94e9 / 3.0) }),
            ElementPattern::Airy(Airy { diameter_m: 0.01, blockage: 0.0 }),
            ElementPattern::Airy(Airy { diameter_m: 1.0 / 3.0, blockage: 1.0 / 7.0 }),
            ElementPattern::CosPower(CosPower { exponent: 2.5 }),
        ];
        for pattern in all {
            let text = pattern.to_string();
            assert_eq!(text.parse::<ElementPattern>().unwrap(), pattern, "{text}");
            assert!(text.len() <= 68, "{text}");
        }
    }

    #[test]
    fn wrong_lines_are_refused_with_what_is_right() {
        let say = |text: &str| text.parse::<ElementPattern>().unwrap_err().to_string();
        assert!(say("horn").contains("gaussian, airy, cos or sampled"));
        assert!(say("airy").contains("needs diameter_m"));
        assert!(say("airy width=3").contains("it takes diameter_m, blockage"));
        assert!(say("airy diameter_m=x").contains("NAME=NUMBER"));
        assert!(say("airy diameter_m=-1").contains("diameter of the element pattern"));
        assert!(say("airy diameter_m=1 blockage=1").contains("blockage"));
        assert!(say("gaussian fwhm_rad=1 fwhm_deg=1").contains("twice"));
        assert!(say("cos exponent=-1").contains("exponent"));
        let nine: ElementPattern = "gaussian fwhm_deg=9".parse().unwrap();
        assert!((nine.power(4.5_f64.to_radians().sin(), 0.0, 1e9) - 0.5).abs() < 1e-12);
    }
}
