//! A kind of layout: its row in the table, and the layout that follows from its points.

use super::options::GenerateOptions;
use super::shape::{Point, Shape, Takes};
use crate::{Antenna, ArrayError, ArrayLayout, LayoutFrame, Result, Sensitivity};

/// A kind of generated layout.
#[derive(Debug, Clone, Copy)]
pub struct LayoutKind {
    /// Name on the command line.
    pub name: &'static str,
    /// What it looks like.
    pub about: &'static str,
    /// Where it comes from.
    pub source: &'static str,
    takes: &'static [Takes],
    has: fn(&Shape) -> bool,
    points: fn(&Shape) -> Result<Vec<Point>>,
}

/// A row of the table: name, description, options with their defaults, source, which numbers of elements there are, and the points.
pub(super) const fn row(
    name: &'static str,
    about: &'static str,
    takes: &'static [Takes],
    source: &'static str,
    has: fn(&Shape) -> bool,
    points: fn(&Shape) -> Result<Vec<Point>>,
) -> LayoutKind {
    LayoutKind { name, about, source, takes, has, points }
}

impl LayoutKind {
    /// Names of the options that this kind takes beside those that all take.
    pub fn options(&self) -> impl Iterator<Item = &'static str> + '_ {
        self.takes.iter().map(|t| t.name())
    }

    /// The layout.
    ///
    /// # Errors
    /// An option out of its range or one that this kind does not take; a number of elements that it cannot have, with the nearest that it can;
    /// more elements than fit with the spacing.
    pub fn layout(&self, options: &GenerateOptions) -> Result<ArrayLayout> {
        let shape = Shape::of(self.name, self.takes, options)?;
        self.check_count(&shape)?;
        let mut points = (self.points)(&shape)?;
        let (shortest, longest) = extremes(&points);
        let scale = options.aperture.si() / longest;
        if shortest * scale < options.aperture.si() * shape.spacing * (1.0 - 1e-9) {
            let (option, value) = options.spacing.map_or(("diameter", options.diameter), |s| ("spacing", Some(s)));
            let expected = format!(
                "at most {:.3}, the least distance of {} elements in this aperture: fewer elements, or a longer aperture",
                crate::quantity::Length(shortest * scale),
                shape.elements
            );
            ArrayError::need(option, value.map_or(String::new(), |v| v.to_string()), false, expected)?;
        }
        place(&mut points, options, scale);
        self.built(&points, &shape, options)
    }

    fn check_count(&self, shape: &Shape) -> Result<()> {
        let has = |n: usize| n >= 2 && (self.has)(&Shape { elements: n, ..shape.clone() });
        if has(shape.elements) {
            return Ok(());
        }
        let below = (2..shape.elements).rev().find(|n| has(*n));
        let above = (shape.elements + 1..=(5 * shape.elements).max(100)).find(|n| has(*n));
        let nearest: Vec<String> = below.into_iter().chain(above).map(|n| n.to_string()).collect();
        let nearest = if nearest.is_empty() { "another number".to_owned() } else { nearest.join(" or ") };
        let with: Vec<String> = self.takes.iter().filter_map(|t| told(*t, shape)).collect();
        let with = if with.is_empty() { String::new() } else { format!(" with {}", with.join(", ")) };
        ArrayError::need("elements", shape.elements, false, format!("{nearest}, the nearest that the kind {:?} has{with}", self.name))
    }

    fn built(&self, points: &[Point], shape: &Shape, options: &GenerateOptions) -> Result<ArrayLayout> {
        let digits = points.len().to_string().len().max(2);
        let sensitivity = match (options.tsys, options.sefd) {
            (Some(t), Some(_)) => {
                ArrayError::need("tsys", t, false, "no system temperature beside an SEFD")?;
                None
            }
            (Some(t), None) => Some(Sensitivity::TsysK(t.si())),
            (None, sefd) => sefd.map(|s| Sensitivity::SefdJy(s.si())),
        };
        let antenna = |(i, p): (usize, &Point)| Antenna {
            diameter_m: options.diameter.map(|d| d.si()),
            sensitivity,
            ..Antenna::new(format!("E{:0digits$}", i + 1), i as u32, [p[0], p[1], 0.0])
        };
        let antennas = points.iter().enumerate().map(antenna).collect();
        let mut layout = ArrayLayout::new(format!("{} of {}", self.name, points.len()), LayoutFrame::Boresight, antennas)?;
        let mut parts = vec![format!("kind {}", self.name), format!("elements {}", points.len()), format!("aperture {}", options.aperture)];
        parts.extend(self.takes.iter().filter_map(|t| told(*t, shape)));
        parts.extend(options.spacing.or(options.diameter).map(|s| format!("spacing at least {s}")));
        parts.extend(options.rotation.map(|r| format!("rotation {r}")));
        parts.push(format!("seed {}", options.seed));
        layout.aperture_m = Some(options.aperture.si());
        layout.source = Some(format!("generated: {} ({})", parts.join(", "), self.source));
        Ok(layout)
    }
}

/// An option with its value; `None` where the number of elements decides it, and for the seed, which is told of every kind.
fn told(take: Takes, s: &Shape) -> Option<String> {
    match take {
        Takes::Arms(_) => Some(format!("arms {}", s.arms)),
        Takes::Exponent(_) => Some(format!("exponent {}", s.exponent)),
        Takes::Rings(_) => (s.rings > 0).then(|| format!("rings {}", s.rings)),
        Takes::Columns => s.columns.map(|c| format!("columns {c}")),
        Takes::Turns(_) => Some(format!("turns {}", s.turns)),
        Takes::Inner(_) => Some(format!("inner {}", s.inner)),
        Takes::Seed => None,
    }
}

/// Shortest and longest distance of two points.
fn extremes(points: &[Point]) -> (f64, f64) {
    let (mut shortest, mut longest) = (f64::INFINITY, 0.0_f64);
    for (i, a) in points.iter().enumerate() {
        for b in &points[i + 1..] {
            let d2 = (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]);
            (shortest, longest) = (shortest.min(d2), longest.max(d2));
        }
    }
    (libm::sqrt(shortest), libm::sqrt(longest))
}

/// Turn the points, move their mean to the origin, and scale them. What remains of a sum that ought to vanish becomes 0.
fn place(points: &mut [Point], options: &GenerateOptions, scale: f64) {
    let n = points.len() as f64;
    let mean = [0, 1].map(|k| points.iter().map(|p| p[k]).sum::<f64>() / n);
    let (sin, cos) = libm::sincos(options.rotation.map_or(0.0, |r| r.si()));
    for p in points {
        let [x, y] = [0, 1].map(|k| (p[k] - mean[k]) * scale);
        let turned = [x * cos + y * sin, y * cos - x * sin];
        *p = turned.map(|v| if v.abs() < 1e-14 * options.aperture.si() { 0.0 } else { v });
    }
}
