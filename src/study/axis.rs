//! Axes of a study and the grid that they span.

use crate::Result;
use crate::values::{bad_value, need};

/// One value of an axis.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisValue {
    /// As it is written in the configuration, such as `20deg` or `vla-c`.
    pub text: String,
    /// The number in it, in the unit of the axis; `None` on axes of names.
    pub number: Option<f64>,
}

/// One parameter that is varied.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Name of the parameter.
    pub name: String,
    /// Unit of the numbers; empty for names and pure numbers.
    pub unit: String,
    /// The values, in order.
    pub values: Vec<AxisValue>,
}

impl Axis {
    /// An axis with the texts of its values. If all values are numbers with the same unit, the axis is numeric.
    ///
    /// # Errors
    /// There is no value, or the same value occurs twice.
    pub fn new(name: impl Into<String>, texts: &[String]) -> Result<Self> {
        let name = name.into();
        need("axis", &name, !texts.is_empty(), "at least one value")?;
        if let Some((_, twice)) = texts.iter().enumerate().find(|(k, t)| texts[..*k].contains(t)) {
            return bad_value("axis", format!("{twice} twice in {name}"), "each value once");
        }
        let parts: Vec<Option<(f64, &str)>> = texts.iter().map(|t| number_and_unit(t)).collect();
        let unit = parts[0].map(|p| p.1);
        let numeric = parts.iter().all(|p| p.is_some() && p.map(|p| p.1) == unit);
        let values =
            texts.iter().zip(&parts).map(|(t, p)| AxisValue { text: t.clone(), number: p.filter(|_| numeric).map(|p| p.0) }).collect();
        Ok(Self { name, unit: if numeric { unit.unwrap_or_default().to_owned() } else { String::new() }, values })
    }

    /// True where every value is a number.
    #[must_use]
    pub fn is_numeric(&self) -> bool {
        self.values.iter().all(|v| v.number.is_some())
    }

    /// Name with the unit, for the heading of a column: `errors.phase.rms_deg`.
    #[must_use]
    pub fn column(&self) -> String {
        if self.unit.is_empty() { self.name.clone() } else { format!("{}_{}", self.name, self.unit) }
    }
}

/// `20deg` as (20, "deg"); a finite number with nothing or a word of letters behind it.
fn number_and_unit(text: &str) -> Option<(f64, &str)> {
    let at = text.char_indices().rev().find(|(_, c)| c.is_ascii_digit() || *c == '.').map(|(i, c)| i + c.len_utf8())?;
    let (number, unit) = text.split_at(at);
    let number = number.trim().parse::<f64>().ok().filter(|n| n.is_finite())?;
    Some((number, unit.trim()))
}

/// All combinations of the values of the axes. The value of the last axis changes fastest.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Grid {
    /// The axes; none is one point.
    pub axes: Vec<Axis>,
}

/// Largest number of points of a grid. The tables of more points would not fit into the memory.
const MOST_POINTS: usize = 1_000_000;

impl Grid {
    /// The grid of some axes.
    ///
    /// # Errors
    /// An axis without values, two axes of one name, more than a million points.
    pub fn new(axes: Vec<Axis>) -> Result<Self> {
        if let Some((_, a)) = axes.iter().enumerate().find(|(k, a)| axes[..*k].iter().any(|b| b.name == a.name)) {
            return bad_value("axis", &a.name, "one axis for each parameter");
        }
        let points = axes.iter().try_fold(1_usize, |n, a| n.checked_mul(a.values.len())).unwrap_or(usize::MAX);
        need("points of the study", points, (1..=MOST_POINTS).contains(&points), format!("1 to {MOST_POINTS}"))?;
        Ok(Self { axes })
    }

    /// Number of points.
    #[must_use]
    pub fn n_points(&self) -> usize {
        self.axes.iter().map(|a| a.values.len()).product()
    }

    /// Indices of the values of a point \[axis\].
    #[must_use]
    pub fn indices(&self, point: usize) -> Vec<usize> {
        let (mut rest, mut out) = (point, vec![0; self.axes.len()]);
        for (index, axis) in out.iter_mut().zip(&self.axes).rev() {
            (*index, rest) = (rest % axis.values.len(), rest / axis.values.len());
        }
        out
    }

    /// The values of a point \[axis\].
    #[must_use]
    pub fn point(&self, index: usize) -> Vec<&AxisValue> {
        self.axes.iter().zip(self.indices(index)).map(|(a, k)| &a.values[k]).collect()
    }

    /// The values of a point as text, such as `corrupt.phase-rms = 20deg`, with commas between.
    #[must_use]
    pub fn place(&self, index: usize) -> String {
        let text = |(a, v): (&Axis, &AxisValue)| format!("{} = {}", a.name, v.text);
        self.axes.iter().zip(self.point(index)).map(text).collect::<Vec<_>>().join(", ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(t: &[&str]) -> Vec<String> {
        t.iter().map(|s| (*s).to_owned()).collect()
    }

    #[test]
    fn values_of_one_unit_are_numbers_and_others_are_names() {
        let a = Axis::new("errors.phase.rms", &texts(&["5deg", "1e1deg", "-2.5 deg"])).unwrap();
        assert_eq!(a.values.iter().map(|v| v.number.unwrap()).collect::<Vec<_>>(), [5.0, 10.0, -2.5]);
        assert_eq!(a.column(), "errors.phase.rms_deg");
        assert!(!Axis::new("t", &texts(&["5deg", "1rad"])).unwrap().is_numeric());
        assert!(!Axis::new("layout.name", &texts(&["vla-a", "vla-c"])).unwrap().is_numeric());
        assert!(!Axis::new("solint", &texts(&["10s", "inf"])).unwrap().is_numeric());
        assert_eq!(Axis::new("n", &texts(&["4", "8"])).unwrap().column(), "n");
        assert!(Axis::new("n", &texts(&["4", "4"])).is_err() && Axis::new("n", &[]).is_err());
    }

    #[test]
    fn points_run_over_all_combinations_with_the_last_axis_fastest() {
        let g = Grid::new(vec![Axis::new("a", &texts(&["1", "2"])).unwrap(), Axis::new("b", &texts(&["x", "y", "z"])).unwrap()]).unwrap();
        let all: Vec<String> = (0..g.n_points()).map(|k| g.point(k).iter().map(|v| v.text.as_str()).collect()).collect();
        assert_eq!(all, ["1x", "1y", "1z", "2x", "2y", "2z"]);
        assert_eq!(Grid::new(Vec::new()).unwrap().n_points(), 1);
        assert!(Grid::new(vec![g.axes[0].clone(), g.axes[0].clone()]).is_err());
    }
}
