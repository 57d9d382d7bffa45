//! Lines of equal value through the cells of a plane, by marching squares.

use ndarray::ArrayView2;
use std::collections::HashMap;

/// An edge between two neighbouring cells: the cell with the lower row and column, and whether the other one is above it.
type Edge = (usize, usize, bool);

/// The lines at `level`, as points (column, row) in fractions of cells; cell (0, 0) has its middle at (0, 0). Closed lines end where they
/// begin. Squares with a cell that is not finite have no line.
pub(super) fn contours(plane: ArrayView2<'_, f64>, level: f64) -> Vec<Vec<(f64, f64)>> {
    let mut next: HashMap<Edge, Vec<Edge>> = HashMap::new();
    let (rows, columns) = plane.dim();
    for r in 0..rows.saturating_sub(1) {
        for c in 0..columns.saturating_sub(1) {
            for (a, b) in square(plane, level, (r, c)).into_iter().flatten() {
                next.entry(a).or_default().push(b);
                next.entry(b).or_default().push(a);
            }
        }
    }
    let mut order: Vec<Edge> = next.keys().copied().collect();
    // Open lines begin at their ends, so they come first.
    order.sort_by_key(|e| (next[e].len() != 1, *e));
    let mut lines = Vec::new();
    for start in order {
        let mut line = vec![start];
        while let Some(to) = line.last().and_then(|at| next.get_mut(at)).and_then(Vec::pop) {
            if let Some((from, back)) = line.last().zip(next.get_mut(&to))
                && let Some(k) = back.iter().position(|e| e == from)
            {
                back.swap_remove(k);
            }
            line.push(to);
        }
        if line.len() > 1 {
            lines.push(line.into_iter().map(|edge| crossing(plane, level, edge)).collect());
        }
    }
    lines
}

/// The pieces of line in the square whose lower left cell is (r, c): pairs of edges that the line crosses.
fn square(plane: ArrayView2<'_, f64>, level: f64, (r, c): (usize, usize)) -> [Option<(Edge, Edge)>; 2] {
    let corner = [plane[[r, c]], plane[[r, c + 1]], plane[[r + 1, c + 1]], plane[[r + 1, c]]];
    if corner.iter().any(|v| !v.is_finite()) {
        return [None; 2];
    }
    let above = corner.map(|v| v >= level);
    let (low, right, high, left): (Edge, Edge, Edge, Edge) = ((r, c, false), (r, c + 1, true), (r + 1, c, false), (r, c, true));
    let crossed: Vec<Edge> =
        [low, right, high, left].into_iter().enumerate().filter(|(k, _)| above[*k] != above[(k + 1) % 4]).map(|(_, e)| e).collect();
    match crossed.as_slice() {
        [a, b] => [Some((*a, *b)), None],
        [_, _, _, _] => {
            // A saddle: the mean decides which corners are joined.
            let joined = (corner.iter().sum::<f64>() / 4.0 >= level) == above[0];
            if joined { [Some((low, right)), Some((high, left))] } else { [Some((low, left)), Some((right, high))] }
        }
        _ => [None; 2],
    }
}

/// Where the level lies on an edge, by linear interpolation.
fn crossing(plane: ArrayView2<'_, f64>, level: f64, (r, c, up): Edge) -> (f64, f64) {
    let from = plane[[r, c]];
    let to = if up { plane[[r + 1, c]] } else { plane[[r, c + 1]] };
    let part = ((level - from) / (to - from)).clamp(0.0, 1.0);
    if up { (c as f64, r as f64 + part) } else { (c as f64 + part, r as f64) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::{Array2, array};

    #[test]
    fn a_cone_has_one_closed_circle_at_each_level() {
        let cone = Array2::from_shape_fn((41, 41), |(r, c)| 20.0 - (r as f64 - 20.0).hypot(c as f64 - 20.0));
        let found = contours(cone.view(), 10.0);
        assert_eq!(found.len(), 1);
        let line = &found[0];
        assert!(line.len() > 60 && line.first() == line.last());
        for (x, y) in line {
            // The cone is not linear between cells: at a distance of 10 the radius is wrong by at most 1 / (8 * 10).
            assert!(((x - 20.0).hypot(y - 20.0) - 10.0).abs() < 0.0125, "{x} {y}");
        }
        assert!(contours(cone.view(), 30.0).is_empty());
    }

    #[test]
    fn a_line_to_the_edge_is_open_and_cells_without_a_value_end_it() {
        let ramp = Array2::from_shape_fn((5, 4), |(_, c)| c as f64);
        let found = contours(ramp.view(), 1.5);
        assert_eq!(found.len(), 1);
        assert_eq!((found[0].len(), found[0][0].0), (5, 1.5));
        let mut hole = ramp;
        hole[[2, 1]] = f64::NAN;
        assert!(contours(hole.view(), 1.5).iter().map(Vec::len).sum::<usize>() == 4);
        // A saddle has two lines.
        assert_eq!(contours(array![[1.0, 0.0], [0.0, 1.0]].view(), 0.5).len(), 2);
    }
}
