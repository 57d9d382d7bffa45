//! A chain of steps: its text, its values, and its work on frames.

use super::step::{Given, Setting, Step, StepKind};
use super::table::STEPS;
use crate::values::Level;
use crate::{ChainError, Result, ensure};
use cittert_arrays::{BrightnessUnit, VisUnit};
use ndarray::Array2;
use serde::de::{Error as _, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;
use std::str::FromStr;

/// The value of a parameter: a number, or a brightness with its unit.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Value {
    Number(f64),
    Level(Level),
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => number.fmt(f),
            Self::Level(level) => level.fmt(f),
        }
    }
}

/// A step and the values of its parameters, where they are given.
#[derive(Clone)]
struct Asked {
    kind: &'static StepKind,
    values: Vec<Option<Value>>,
}

/// A chain of steps as it is written: `median=5,clahe,unsharp=1.5:0.8`, or a list of such texts and of tables with named parameters in a file.
#[derive(Clone, PartialEq)]
pub struct StepList(Vec<Asked>);

/// Steps that are made for one image.
#[derive(Debug)]
pub struct Chain {
    steps: Vec<(&'static str, Box<dyn Step>)>,
}

impl Asked {
    fn new(name: &str) -> Result<Self, String> {
        let known = || STEPS.iter().map(|s| s.name).collect::<Vec<_>>().join(", ");
        let kind = STEPS.iter().find(|s| s.name == name).ok_or_else(|| format!("there is no step {name:?}; the steps are {}", known()))?;
        Ok(Self { kind, values: vec![None; kind.parameters.len()] })
    }

    fn set(&mut self, k: usize, text: &str) -> Result<(), String> {
        let (name, parameter) = (self.kind.name, &self.kind.parameters[k]);
        let bad = |text: &str| format!("{name}: {} is {text:?}, expected {}", parameter.name, parameter.range);
        let value = match text.parse::<f64>() {
            Ok(number) => Value::Number(number),
            Err(_) if parameter.range.is_level() => Value::Level(text.parse().map_err(|_| bad(text))?),
            Err(_) => return Err(bad(text)),
        };
        let number = match value {
            Value::Number(number) => number,
            Value::Level(Level::Jy(flux)) => flux.si(),
            Value::Level(Level::Kelvin(temperature)) => temperature.si(),
        };
        ensure!(parameter.range.holds(number), bad(text));
        self.values[k] = Some(value);
        Ok(())
    }

    /// The step with all values that it must have.
    fn complete(self) -> Result<Self, String> {
        let missing = self.kind.parameters.iter().zip(&self.values).find(|(p, v)| p.default.is_none() && v.is_none());
        match missing {
            Some((parameter, _)) => {
                let (name, syntax) = (self.kind.name, self.kind.syntax());
                Err(format!("{name}: its {} is missing ({}), write {syntax}", parameter.name, parameter.about))
            }
            None => Ok(self),
        }
    }

    /// Numbers in the unit of the image.
    fn resolved(&self, unit: BrightnessUnit) -> Result<Vec<Option<f64>>> {
        let one = |(parameter, value): (&super::step::Parameter, &Option<Value>)| match value {
            Some(Value::Number(number)) if parameter.range.is_level() && unit_of(unit).is_some() => {
                let example = if unit == BrightnessUnit::Kelvin { format!("{number}K") } else { format!("{number}Jy") };
                Err(ChainError::bad_option(
                    "steps",
                    self,
                    format!("a unit with the {} of {}, such as {example}", parameter.name, self.kind.name),
                ))
            }
            Some(Value::Number(number)) => Ok(Some(*number)),
            Some(Value::Level(level)) => match unit_of(unit) {
                Some(unit) => level.in_unit("steps", unit).map(Some),
                None => Err(ChainError::bad_option("steps", self, "numbers without unit, as the image has none that is known")),
            },
            None => Ok(parameter.default.and_then(|text| text.parse().ok())),
        };
        self.kind.parameters.iter().zip(&self.values).map(one).collect()
    }
}

/// The unit of data whose images have this unit.
fn unit_of(unit: BrightnessUnit) -> Option<VisUnit> {
    match unit {
        BrightnessUnit::Kelvin => Some(VisUnit::KelvinSr),
        BrightnessUnit::JyPerBeam | BrightnessUnit::JyPerPixel => Some(VisUnit::Jy),
        _ => None,
    }
}

impl PartialEq for Asked {
    fn eq(&self, other: &Self) -> bool {
        self.kind.name == other.kind.name && self.values == other.values
    }
}

impl fmt::Debug for Asked {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl fmt::Debug for StepList {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "StepList({self})")
    }
}

impl fmt::Display for Asked {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.kind.name)?;
        let given = self.values.iter().rposition(Option::is_some).map_or(0, |last| last + 1);
        for (k, (value, parameter)) in self.values[..given].iter().zip(self.kind.parameters).enumerate() {
            f.write_str(if k == 0 { "=" } else { ":" })?;
            match value {
                Some(value) => value.fmt(f)?,
                None => f.write_str(parameter.default.unwrap_or_default())?,
            }
        }
        Ok(())
    }
}

impl fmt::Display for StepList {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (k, asked) in self.0.iter().enumerate() {
            write!(f, "{}{asked}", if k == 0 { "" } else { "," })?;
        }
        Ok(())
    }
}

impl FromStr for Asked {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, values) = text.trim().split_once('=').map_or((text.trim(), None), |(name, values)| (name.trim(), Some(values)));
        let mut asked = Self::new(name)?;
        let syntax = asked.kind.syntax();
        for (k, value) in values.into_iter().flat_map(|v| v.split(':')).enumerate() {
            ensure!(k < asked.values.len(), format!("{name} has at most {} values, write {syntax}", asked.values.len()));
            // An empty place takes the default.
            if !value.trim().is_empty() {
                asked.set(k, value.trim())?;
            }
        }
        asked.complete()
    }
}

impl FromStr for StepList {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        ensure!(!text.trim().is_empty(), "there is no step; write steps with commas between, such as median=5,clahe".to_owned());
        text.split(',').map(str::parse).collect::<Result<_, _>>().map(Self)
    }
}

impl Serialize for StepList {
    fn serialize<S: Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
        s.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for StepList {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        d.deserialize_any(ListVisitor)
    }
}

struct ListVisitor;

impl<'de> Visitor<'de> for ListVisitor {
    type Value = StepList;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a text such as \"median=5,clahe\", or a list of such texts and of tables such as { step = \"median\", window = 5 }")
    }

    fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<StepList, E> {
        text.parse().map_err(E::custom)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<StepList, A::Error> {
        let mut steps = Vec::new();
        while let Some(InFile(asked)) = seq.next_element()? {
            steps.push(asked);
        }
        if steps.is_empty() { Err(A::Error::custom("there is no step")) } else { Ok(StepList(steps)) }
    }
}

/// A step in a list of a file.
struct InFile(Asked);

impl<'de> Deserialize<'de> for InFile {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        d.deserialize_any(StepVisitor).map(Self)
    }
}

struct StepVisitor;

impl<'de> Visitor<'de> for StepVisitor {
    type Value = Asked;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a text such as \"median=5\", or a table such as { step = \"median\", window = 5 }")
    }

    fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<Asked, E> {
        text.parse().map_err(E::custom)
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Asked, A::Error> {
        let mut given: Vec<(String, String)> = Vec::new();
        while let Some((key, Scalar(value))) = map.next_entry()? {
            given.push((key, value));
        }
        let name = given
            .iter()
            .find(|(key, _)| key == "step")
            .ok_or_else(|| A::Error::custom("this step has no name: write step = \"median\""))?;
        let mut asked = Asked::new(&name.1).map_err(A::Error::custom)?;
        for (key, value) in given.iter().filter(|(key, _)| key != "step") {
            let names: Vec<&str> = asked.kind.parameters.iter().map(|p| p.name).collect();
            let k = names.iter().position(|n| n == key);
            let k = k.ok_or_else(|| A::Error::custom(format!("{} has no parameter {key:?}; it has {}", name.1, names.join(", "))))?;
            asked.set(k, value).map_err(A::Error::custom)?;
        }
        asked.complete().map_err(A::Error::custom)
    }
}

/// A number or a text in a file, as text.
struct Scalar(String);

impl<'de> Deserialize<'de> for Scalar {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        d.deserialize_any(crate::values::TextVisitor::<String>(std::marker::PhantomData)).map(Self)
    }
}

impl StepList {
    /// True if a step needs the PSF of the sensor.
    #[must_use]
    pub fn needs_psf(&self) -> bool {
        self.0.iter().any(|asked| asked.kind.needs_psf)
    }

    /// The texts of the steps.
    pub fn texts(&self) -> impl Iterator<Item = String> + '_ {
        self.0.iter().map(ToString::to_string)
    }

    /// The steps made for an image.
    ///
    /// # Errors
    /// A level in another unit than the image, a PSF that is missing or has another cell, or values that do not go together.
    pub fn chain(&self, setting: &Setting<'_>) -> Result<Chain> {
        let mut setting = setting.clone();
        let mut steps = Vec::new();
        for asked in &self.0 {
            let given = Given { values: asked.resolved(setting.unit)?, setting: setting.clone() };
            let step = (asked.kind.make)(&given)?;
            setting.cell_rad /= step.factor() as f64;
            steps.push((asked.kind.name, step));
        }
        Ok(Chain { steps })
    }
}

impl Chain {
    /// The number of pixels after all steps for each pixel before, along each axis.
    #[must_use]
    pub fn factor(&self) -> usize {
        self.steps.iter().map(|(_, step)| step.factor()).product()
    }

    /// One frame \[m, l\] from frames of one size. The result has the same bytes with any number of threads.
    ///
    /// # Errors
    /// No frame, frames of several sizes, a frame with blank pixels, several frames that no step averages, or the error of a step with its name.
    pub fn apply(&self, frames: Vec<Array2<f64>>) -> Result<Array2<f64>> {
        let dims: Vec<_> = frames.iter().map(Array2::dim).collect();
        let same = dims.iter().all(|d| Some(d) == dims.first() && d.0 > 0 && d.1 > 0);
        ensure!(same && !dims.is_empty(), ChainError::Incompatible(format!("the frames have sizes of {dims:?} pixels, expected one size")));
        for frame in &frames {
            let blank = frame.iter().filter(|v| !v.is_finite()).count();
            ensure!(
                blank == 0,
                ChainError::NoData(format!(
                    "{blank} of {} pixels are blank (NaN or infinite), and the steps need the values of all",
                    frame.len()
                ))
            );
        }
        let mut frames = frames;
        for (name, step) in &self.steps {
            frames = step.frames(frames).map_err(|e| match e {
                ChainError::Incompatible(what) => ChainError::Incompatible(format!("step {name}: {what}")),
                other => other,
            })?;
        }
        let left = frames.len();
        ensure!(left == 1, ChainError::Incompatible(format!("{left} frames are left after the steps: add the step average")));
        frames.pop().ok_or_else(|| ChainError::Internal("a chain without a result".into()))
    }
}
