//! How the illumination of the aperture falls towards its rim.

use crate::ensure;
use crate::values::by_text;
use std::fmt;
use std::str::FromStr;

/// One row of the table of tapers.
#[derive(Debug, Clone, Copy)]
pub struct TaperKind {
    /// Its name.
    pub name: &'static str,
    /// Its numbers, as they are written after the name.
    pub values: &'static str,
    /// How many numbers it has.
    pub count: usize,
    /// Amplitude at a radius, in units of the radius of the aperture.
    pub amplitude: fn(&[f64], f64) -> f64,
    /// What it is, with its source.
    pub about: &'static str,
}

/// All tapers.
pub const TAPERS: &[TaperKind] = &[
    TaperKind { name: "uniform", values: "", count: 0, amplitude: |_, _| 1.0, about: "the same everywhere" },
    TaperKind {
        name: "gaussian",
        values: "EDGE_DB",
        count: 1,
        amplitude: |v, r| edge(v[0]).powf(r * r),
        about: "Gaussian beam of a feed horn, with this edge taper of the power in dB (Goldsmith 1998, eq. 6.1)",
    },
    TaperKind {
        name: "parabola",
        values: "EDGE_DB:POWER",
        count: 2,
        amplitude: |v, r| edge(v[0]) + (1.0 - edge(v[0])) * (1.0 - r * r).max(0.0).powf(v[1]),
        about: "parabola to a power on a pedestal (Balanis 2016, eq. 12-63)",
    },
];

/// Amplitude at the rim of an edge taper in dB.
fn edge(db: f64) -> f64 {
    10.0_f64.powf(-db / 20.0)
}

/// A taper as it is written, such as `gaussian=10`.
#[derive(Debug, Clone)]
pub struct Taper {
    kind: &'static TaperKind,
    values: Vec<f64>,
}
by_text!(Taper, "string", "A taper with its numbers, such as \"gaussian=10\".");

impl Taper {
    /// Amplitude at a radius, in units of the radius of the aperture.
    #[must_use]
    pub fn amplitude(&self, radius: f64) -> f64 {
        (self.kind.amplitude)(&self.values, radius)
    }
}

impl Default for Taper {
    fn default() -> Self {
        Self { kind: &TAPERS[0], values: Vec::new() }
    }
}

impl PartialEq for Taper {
    fn eq(&self, other: &Self) -> bool {
        self.kind.name == other.kind.name && self.values == other.values
    }
}

impl fmt::Display for Taper {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.kind.name)?;
        for (k, value) in self.values.iter().enumerate() {
            write!(f, "{}{value}", if k == 0 { "=" } else { ":" })?;
        }
        Ok(())
    }
}

impl FromStr for Taper {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, values) = text.trim().split_once('=').unwrap_or((text.trim(), ""));
        let syntax = |kind: &TaperKind| if kind.count == 0 { kind.name.to_owned() } else { format!("{}={}", kind.name, kind.values) };
        let known = || TAPERS.iter().map(syntax).collect::<Vec<_>>().join(", ");
        let kind = TAPERS.iter().find(|t| t.name == name.trim());
        let kind = kind.ok_or_else(|| format!("there is no taper {:?}; the tapers are {}", name.trim(), known()))?;
        let numbers = values.split(':').filter(|v| !v.trim().is_empty()).map(|v| v.trim().parse::<f64>());
        let values: Vec<f64> = numbers.collect::<Result<_, _>>().map_err(|_| format!("{text:?} is not a taper, write {}", syntax(kind)))?;
        let good = values.len() == kind.count && values.iter().all(|v| (0.0..=100.0).contains(v));
        ensure!(good, format!("{text:?} is not a taper, write {} with numbers from 0 to 100", syntax(kind)));
        Ok(Self { kind, values })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_taper_is_1_on_the_axis_and_has_its_edge() {
        for (text, at_edge) in [("uniform", 1.0), ("gaussian=10", 0.1), ("parabola=20:2", 0.01)] {
            let taper: Taper = text.parse().unwrap();
            assert!((taper.amplitude(0.0) - 1.0).abs() < 1e-12 && (taper.amplitude(1.0).powi(2) - at_edge).abs() < 1e-12, "{text}");
            assert_eq!(taper.to_string().parse::<Taper>().unwrap(), taper);
        }
        for text in ["cosine", "gaussian", "gaussian=x", "gaussian=-3", "uniform=1", "parabola=10"] {
            let e = text.parse::<Taper>().unwrap_err();
            assert!(e.contains("gaussian=EDGE_DB") || e.contains("parabola=EDGE_DB:POWER") || e.contains("uniform"), "{e}");
        }
    }
}
