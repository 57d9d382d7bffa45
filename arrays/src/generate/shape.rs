//! What the generators work with: points of any scale, and the options of a kind with its defaults filled in.

use super::options::GenerateOptions;
use crate::{ArrayError, Result};
use std::f64::consts::{PI, TAU};

/// A place in the aperture plane. A generator may use any unit: the aperture scales its points.
pub type Point = [f64; 2];

/// The golden angle, pi (3 - sqrt 5): turning by it again and again never comes back to the same direction.
pub const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653_3;

/// An option that a kind takes, with the default that it has there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Takes {
    /// Number of arms or branches.
    Arms(usize),
    /// Power of the distances along an arm.
    Exponent(f64),
    /// Number of rings.
    Rings(usize),
    /// Number of columns of a grid. Its default is chosen from the number of elements.
    Columns,
    /// Turns of a spiral.
    Turns(f64),
    /// First over last distance of a spiral arm.
    Inner(f64),
    /// Random numbers.
    Seed,
}

impl Takes {
    /// The name of the option.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Arms(_) => "arms",
            Self::Exponent(_) => "exponent",
            Self::Rings(_) => "rings",
            Self::Columns => "columns",
            Self::Turns(_) => "turns",
            Self::Inner(_) => "inner",
            Self::Seed => "seed",
        }
    }
}

/// The options of a kind with its defaults.
#[derive(Debug, Clone, PartialEq)]
pub struct Shape {
    pub elements: usize,
    pub seed: u64,
    /// Least distance between two elements over the aperture.
    pub spacing: f64,
    pub arms: usize,
    pub exponent: f64,
    /// 0: chosen from the number of elements.
    pub rings: usize,
    pub columns: Option<usize>,
    pub turns: f64,
    pub inner: f64,
}

impl Shape {
    /// Take the options of a kind that is called `name`.
    ///
    /// # Errors
    /// An option out of its range, or one that the kind does not take.
    pub fn of(name: &str, takes: &[Takes], o: &GenerateOptions) -> Result<Self> {
        ArrayError::need("elements", o.elements, (2..=10_000).contains(&o.elements), "2 to 10,000")?;
        let length = o.aperture.si();
        ArrayError::need("aperture", o.aperture, length.is_finite() && length > 0.0, "a positive length")?;
        let spacing = o.spacing.or(o.diameter).map_or(0.0, |s| s.si());
        for (option, value) in [("spacing", o.spacing), ("diameter", o.diameter)] {
            if let Some(value) = value {
                ArrayError::need(option, value, value.si() > 0.0, "a positive length")?;
                let fits = value.si() <= length;
                ArrayError::need(option, value, fits, format!("at most the aperture, {}: two elements do not fit", o.aperture))?;
            }
        }
        let mut shape = Self {
            elements: o.elements,
            seed: o.seed,
            spacing: spacing / length,
            arms: 1,
            exponent: 1.0,
            rings: 1,
            columns: None,
            turns: 0.0,
            inner: 0.0,
        };
        for take in takes {
            match take {
                Takes::Arms(default) => shape.arms = o.arms.unwrap_or(*default),
                Takes::Exponent(default) => shape.exponent = o.exponent.unwrap_or(*default),
                Takes::Rings(default) => shape.rings = o.rings.unwrap_or(*default),
                Takes::Columns => shape.columns = o.columns,
                Takes::Turns(default) => shape.turns = o.turns.unwrap_or(*default),
                Takes::Inner(default) => shape.inner = o.inner.unwrap_or(*default),
                Takes::Seed => {}
            }
        }
        for (option, given) in [
            ("arms", o.arms.map(|v| v.to_string())),
            ("exponent", o.exponent.map(|v| v.to_string())),
            ("rings", o.rings.map(|v| v.to_string())),
            ("columns", o.columns.map(|v| v.to_string())),
            ("turns", o.turns.map(|v| v.to_string())),
            ("inner", o.inner.map(|v| v.to_string())),
        ] {
            let taken = given.is_none() || takes.iter().any(|t| t.name() == option);
            let known: Vec<&str> = takes.iter().map(|t| t.name()).filter(|n| *n != "seed").collect();
            let known = if known.is_empty() { "no such options".to_owned() } else { known.join(" and ") };
            ArrayError::need(
                option,
                given.unwrap_or_default(),
                taken,
                format!("no such option: a layout of the kind {name:?} takes {known}"),
            )?;
        }
        ArrayError::need("arms", shape.arms, (1..=100).contains(&shape.arms), "1 to 100")?;
        ArrayError::need("exponent", shape.exponent, (0.1..=10.0).contains(&shape.exponent), "a number from 0.1 to 10")?;
        let rings = o.rings.unwrap_or(1);
        ArrayError::need("rings", rings, (1..=1000).contains(&rings), "1 to 1000")?;
        ArrayError::need("turns", shape.turns, shape.turns.abs() <= 100.0, "a number from -100 to 100")?;
        ArrayError::need("inner", shape.inner, (0.0..1.0).contains(&shape.inner), "a number from 0 up to 1")?;
        let columns = shape.columns.unwrap_or(2);
        ArrayError::need("columns", columns, (2..=1000).contains(&columns), "2 to 1000")?;
        Ok(shape)
    }
}

/// The point at a distance from the centre, at an angle from +y towards +x.
///
/// The functions of libm give the same bits on every machine, those of the system do not.
pub fn polar(radius: f64, angle: f64) -> Point {
    let (sin, cos) = libm::sincos(angle);
    [radius * sin, radius * cos]
}

/// The angle of arm `i` of `n` arms, the first along +y.
pub fn arm_angle(i: usize, n: usize) -> f64 {
    TAU * i as f64 / n as f64
}

/// Whole marks along arms that share the mark 0 at the centre: one arm is a line along x, two arms are an L, and more arms are a star.
pub fn on_arms(marks: &[usize], arms: usize) -> Vec<Point> {
    let angle = |arm: usize| match arms {
        1 | 2 => PI / 2.0 * (1 + arm) as f64 - PI * arm as f64,
        _ => arm_angle(arm, arms),
    };
    let mut points = vec![[0.0; 2]];
    for arm in 0..arms {
        points.extend(marks.iter().filter(|m| **m > 0).map(|m| polar(*m as f64, angle(arm))));
    }
    points
}

/// Number of marks on each arm, the shared one included; `None` where the elements do not fill the arms evenly.
pub fn marks_per_arm(s: &Shape) -> Option<usize> {
    (s.elements > s.arms && (s.elements - 1).is_multiple_of(s.arms)).then(|| 1 + (s.elements - 1) / s.arms)
}

/// Refuse arms that lie opposite to each other: along their common line the baselines of one repeat those of the other.
///
/// # Errors
/// An even number of arms above 2.
pub fn no_opposite_arms(s: &Shape) -> Result<()> {
    ArrayError::need(
        "arms",
        s.arms,
        s.arms <= 2 || s.arms % 2 == 1,
        "1 (a line), 2 (an L) or an odd number: on opposite arms baselines repeat",
    )
}
