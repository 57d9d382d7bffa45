//! The table `[pattern]` of a layout file.
//!
//! ```toml
//! [pattern]
//! kind = "airy"                  # or gaussian, cos, sampled
//! diameter_m = 0.01              # parameters of the kind; the diameter of the antennas is the default
//! # kind = "sampled"
//! # file = "horn.csv"            # or theta_rad, power [freq][theta][phi], and freq_hz and phi_rad where there are several
//! ```

use super::airy::shared_diameter;
use super::element::ElementPattern;
use super::kinds::{PatternKind, SAMPLED};
use super::sampled::SampledPattern;
use crate::{Antenna, ArrayError, Result};
use ndarray::Array3;
use std::fmt::Write;
use toml::{Table, Value};

/// Frequency of a table that was sampled at one frequency only, Hz.
const ANY_HZ: f64 = 1e9;

/// The pattern of a table. `read` reads the file of a table of samples.
pub(crate) fn from_table(table: &Table, antennas: &[Antenna], read: &dyn Fn(&str) -> Result<ElementPattern>) -> Result<ElementPattern> {
    let kind = table.get("kind").and_then(Value::as_str).ok_or_else(|| ArrayError::Parse("[pattern] needs a kind, a text".into()))?;
    if kind == SAMPLED {
        return match table.get("file") {
            Some(Value::String(file)) if table.len() == 2 => read(file),
            Some(_) => Err(ArrayError::Parse("a sampled pattern with a file, which is a text, takes nothing else".into())),
            None => sampled(table),
        };
    }
    let kind = PatternKind::named(kind)?;
    let mut given = Vec::new();
    for (key, value) in table.iter().filter(|(key, _)| *key != "kind") {
        given.push((
            key.as_str(),
            number(value).ok_or_else(|| ArrayError::Parse(format!("{key} of [pattern] is {value}, expected a number")))?,
        ));
    }
    if kind.name == "airy" && !given.iter().any(|(key, _)| *key == "diameter_m") {
        let shared = shared_diameter(antennas.iter().map(|a| (a.name.as_str(), a.diameter_m)));
        given.push(("diameter_m", shared.map_err(|why| ArrayError::Parse(format!("{why}: give [pattern] a diameter_m")))?));
    }
    kind.pattern(&given)
}

fn number(value: &Value) -> Option<f64> {
    value.as_float().or(value.as_integer().map(|i| i as f64))
}

fn sampled(table: &Table) -> Result<ElementPattern> {
    if let Some(key) = table.keys().find(|k| !["kind", "freq_hz", "theta_rad", "phi_rad", "power"].contains(&k.as_str())) {
        return Err(ArrayError::Parse(format!(
            "a sampled pattern has no {key:?}: it takes file, or theta_rad, power, freq_hz and phi_rad"
        )));
    }
    let list = |key: &str, default: &[f64]| match table.get(key) {
        None if !default.is_empty() => Ok(default.to_vec()),
        Some(value) => numbers(value).ok_or_else(|| ArrayError::Parse(format!("{key} of [pattern] is not a list of numbers"))),
        None => Err(ArrayError::Parse(format!("a sampled pattern needs {key}, or a file"))),
    };
    let (freq, theta, phi, power) = (list("freq_hz", &[ANY_HZ])?, list("theta_rad", &[])?, list("phi_rad", &[0.0])?, list("power", &[])?);
    let (shape, found) = ((freq.len(), theta.len(), phi.len()), power.len());
    let power = Array3::from_shape_vec(shape, power).map_err(|_| {
        ArrayError::Parse(format!("power of [pattern] has {found} numbers, expected {} x {} x {}", shape.0, shape.1, shape.2))
    })?;
    Ok(ElementPattern::Sampled(SampledPattern::new(freq, theta, phi, power)?.into()))
}

/// The numbers of a list, or of lists in a list, in order.
fn numbers(value: &Value) -> Option<Vec<f64>> {
    match value {
        Value::Array(items) => items.iter().map(numbers).collect::<Option<Vec<_>>>().map(|v| v.concat()),
        one => number(one).map(|n| vec![n]),
    }
}

/// The table as text, empty where there is no pattern.
pub(crate) fn to_text(pattern: &ElementPattern) -> String {
    let mut text = String::new();
    // Writing to a String cannot fail.
    if let ElementPattern::Sampled(s) = pattern {
        let _ = writeln!(text, "\n[pattern]\nkind = {SAMPLED:?}\nfreq_hz = {:?}\ntheta_rad = {:?}", s.freq_hz(), s.theta_rad());
        let _ = writeln!(text, "phi_rad = {:?}\npower = {:?}", s.phi_rad(), s.samples().iter().collect::<Vec<_>>());
    } else if let Some((kind, parameters)) = pattern.parameters() {
        let _ = writeln!(text, "\n[pattern]\nkind = {:?}", kind.name);
        parameters.iter().for_each(|(name, value)| {
            let _ = writeln!(text, "{name} = {value:?}");
        });
    }
    text
}

#[cfg(test)]
mod tests {
    use crate::pattern::{Airy, PatternSample, SampledPattern};
    use crate::{ArrayLayout, ElementPattern};

    const LAYOUT: &str = "name = \"x\"\nframe = \"boresight\"\n[[antenna]]\nname = \"A\"\nposition_m = [0.0, 0.0, 0.0]\ndiameter_m = 0.02\n\
                          [[antenna]]\nname = \"B\"\nposition_m = [1.0, 0.0, 0.0]\ndiameter_m = 0.02\n";

    fn with(table: &str) -> crate::Result<ArrayLayout> {
        ArrayLayout::from_toml(&format!("{LAYOUT}[pattern]\n{table}\n"))
    }

    #[test]
    fn patterns_survive_writing_and_reading() {
        let diameter = with("kind = \"airy\"\nblockage = 0.1").unwrap();
        assert_eq!(diameter.pattern, ElementPattern::Airy(Airy { diameter_m: 0.02, blockage: 0.1 }));
        let mut samples = Vec::new();
        for (k, power) in [1.0, 1.02, 0.5, 0.4, 0.1, 0.2].into_iter().enumerate() {
            samples.push(PatternSample { freq_hz: 1e9, theta_rad: 0.1 * (k / 2) as f64, phi_rad: (k % 2) as f64, power });
        }
        let mut table = diameter.clone();
        table.pattern = ElementPattern::Sampled(SampledPattern::of_samples(&samples).unwrap().into());
        for layout in [diameter, table, with("kind = \"gaussian\"\nfwhm_deg = 9").unwrap(), with("kind = \"cos\"\nexponent = 3.5").unwrap()]
        {
            let text = layout.to_toml();
            assert_eq!(ArrayLayout::from_toml(&text).unwrap(), layout, "{text}");
        }
    }

    #[test]
    fn wrong_tables_are_named_with_their_line() {
        let say = |table: &str| with(table).unwrap_err().to_string();
        assert!(say("diameter_m = 1").contains("line 11, column 1"), "{}", say("diameter_m = 1"));
        assert!(say("kind = \"horn\"").contains("gaussian, airy, cos or sampled"));
        assert!(say("kind = \"airy\"\nwidth = 1").contains("width"));
        assert!(say("kind = \"airy\"\ndiameter_m = \"1m\"").contains("expected a number"));
        assert!(say("kind = \"sampled\"\nfile = \"x.csv\"").contains("x.csv"));
        assert!(say("kind = \"sampled\"\ntheta_rad = [0.0, 0.1]\npower = [1.0]").contains("1 numbers, expected 1 x 2 x 1"));
        let mixed = format!("{LAYOUT}[pattern]\nkind = \"airy\"\n").replacen("0.02", "0.03", 1);
        assert!(ArrayLayout::from_toml(&mixed).unwrap_err().to_string().contains("give [pattern] a diameter_m"));
    }
}
