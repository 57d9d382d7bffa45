//! Elements at random places of a disc, each at a least distance from those before it.

use super::shape::{Point, Shape};
use super::spaced::{Spaced, most_points};
use crate::random::{stream, uniform};
use crate::{ArrayError, Result};

/// A place is looked for so many times before the disc counts as full.
const TRIES: usize = 20_000;

pub fn has(_: &Shape) -> bool {
    true
}

pub fn points(s: &Shape) -> Result<Vec<Point>> {
    check_room(s)?;
    let mut rng = stream(s.seed, "random layout", 0);
    let mut placed = Spaced::new(s.spacing);
    while placed.points.len() < s.elements {
        let found = (0..TRIES).map(|_| [uniform(&mut rng) - 0.5, uniform(&mut rng) - 0.5]).find(|p| placed.fits(*p));
        let Some(point) = found else {
            let n = placed.points.len();
            let expected = format!("at most {n} at random with this spacing: fewer, a smaller spacing, or a grid, which packs more");
            ArrayError::need("elements", s.elements, false, expected)?;
            break;
        };
        placed.push(point);
    }
    Ok(placed.points)
}

/// Refuse at once what no arrangement can hold.
///
/// # Errors
/// More elements than fit into the disc with the spacing.
pub fn check_room(s: &Shape) -> Result<()> {
    let most = if s.spacing > 0.0 { most_points(s.spacing) } else { f64::INFINITY };
    let expected = format!("at most {most:.0}, the most that fit into the aperture with this spacing");
    ArrayError::need("elements", s.elements, s.elements as f64 <= most, expected)
}
