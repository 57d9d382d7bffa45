//! The patch at a point, found in a tree of grids.

use super::patch::{Lies, Patch};

/// Cells along each side of a grid.
const CELLS: usize = 16;
/// Number of grids, one in a cell of the other, and the number of patches in a cell above which it gets a grid.
const DEPTH: usize = 3;
const FEW: usize = 1;

/// Patches sorted into cells. A cell lists the patches whose outline crosses it, the topmost first, down to the first that covers it whole.
#[derive(Debug, Clone, Default)]
pub(super) struct PatchIndex {
    patches: Vec<Patch>,
    root: Option<Grid>,
}

/// A square grid of cells.
#[derive(Debug, Clone)]
struct Grid {
    low: [f64; 2],
    per_m: [f64; 2],
    cells: Vec<Cell>,
}

#[derive(Debug, Clone)]
enum Cell {
    /// The patches to test, and the cover if a point lies in none of them.
    Leaf {
        across: Box<[u32]>,
        under: Option<u32>,
    },
    Finer(Box<Grid>),
}

impl Grid {
    /// A grid over a rectangle. `candidates` are the patches that may lie there, the topmost first.
    fn new(patches: &[Patch], candidates: &[u32], [low, high]: [[f64; 2]; 2], depth: usize) -> Self {
        let size = [0, 1].map(|k| (high[k] - low[k]).max(1e-9) / CELLS as f64);
        let cells = (0..CELLS * CELLS)
            .map(|k| {
                let corner = [low[0] + size[0] * (k % CELLS) as f64, low[1] + size[1] * (k / CELLS) as f64];
                // A little larger, so that rounding cannot move a point out of its cell.
                let bounds = [[0, 1].map(|k| corner[k] - 1e-6 * size[k]), [0, 1].map(|k| corner[k] + (1.0 + 1e-6) * size[k])];
                Cell::new(patches, candidates, bounds, depth)
            })
            .collect();
        Self { low, per_m: size.map(|s| 1.0 / s), cells }
    }
}

impl Cell {
    fn new(patches: &[Patch], candidates: &[u32], bounds: [[f64; 2]; 2], depth: usize) -> Self {
        let (mut across, mut under, mut here) = (Vec::new(), None, Vec::new());
        for &i in candidates {
            match patches[i as usize].lies(bounds[0], bounds[1]) {
                Lies::Outside => continue,
                Lies::Across => across.push(i),
                Lies::Inside => under = Some(patches[i as usize].cover()),
            }
            here.push(i);
            if under.is_some() {
                break;
            }
        }
        if across.len() > FEW && depth < DEPTH {
            return Self::Finer(Box::new(Grid::new(patches, &here, bounds, depth + 1)));
        }
        Self::Leaf { across: across.into(), under }
    }
}

impl PatchIndex {
    /// An index of patches, of which a later one covers an earlier one.
    pub(super) fn new(patches: Vec<Patch>) -> Self {
        if patches.is_empty() {
            return Self::default();
        }
        let corner = |k: usize, axis: usize| patches.iter().map(move |p| p.bounds()[k][axis]);
        let low = [0, 1].map(|axis| corner(0, axis).fold(f64::INFINITY, f64::min));
        let high = [0, 1].map(|axis| corner(1, axis).fold(f64::NEG_INFINITY, f64::max));
        let topmost: Vec<u32> = (0..patches.len() as u32).rev().collect();
        Self { root: Some(Grid::new(&patches, &topmost, [low, high], 1)), patches }
    }

    /// The cover of the topmost patch at a point.
    #[inline]
    pub(super) fn cover(&self, x: f64, y: f64) -> Option<u32> {
        let mut grid = self.root.as_ref()?;
        let limit = CELLS as f64 + 1e-3;
        loop {
            let (u, v) = ((x - grid.low[0]) * grid.per_m[0], (y - grid.low[1]) * grid.per_m[1]);
            if !(u >= -1e-3 && v >= -1e-3 && u <= limit && v <= limit) {
                return None;
            }
            let cell = (v.max(0.0) as usize).min(CELLS - 1) * CELLS + (u.max(0.0) as usize).min(CELLS - 1);
            match &grid.cells[cell] {
                Cell::Finer(finer) => grid = finer,
                Cell::Leaf { across, under } => {
                    let hit = across.iter().map(|i| &self.patches[*i as usize]).find(|p| p.contains(x, y));
                    return hit.map(Patch::cover).or(*under);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::patch::{Shape, strip};
    use super::*;

    #[test]
    fn the_index_agrees_with_a_search_of_all() {
        let mut patches: Vec<Patch> = (0..60)
            .map(|k| {
                let k = f64::from(k);
                Patch::new(Shape::Circle { center: [37.0 * k % 101.0, 53.0 * k % 89.0], radius: 3.0 + k % 7.0 }, k as u32)
            })
            .collect();
        let road = |k: f64| [[13.0 * k % 97.0, 29.0 * k % 83.0], [71.0 * k % 97.0, 7.0 * k % 83.0]];
        for k in 0..40_u32 {
            let strips = strip(&road(f64::from(k)), 0.2 + f64::from(k % 5));
            patches.extend(strips.into_iter().map(|s| Patch::new(Shape::Polygon(s), 100 + k)));
        }
        let l_shape = vec![[20.0, 20.0], [80.0, 20.0], [80.0, 30.0], [30.0, 30.0], [30.0, 70.0], [20.0, 70.0]];
        patches.insert(30, Patch::new(Shape::Polygon(l_shape), 999));
        let index = PatchIndex::new(patches.clone());
        for i in 0..40_000 {
            let (x, y) = (f64::from(i) * 0.717 % 130.0 - 15.0, f64::from(i) * 0.391_7 % 120.0 - 15.0);
            let direct = patches.iter().rev().find(|p| p.contains(x, y)).map(Patch::cover);
            assert_eq!(index.cover(x, y), direct, "{x} {y}");
        }
        assert_eq!(PatchIndex::new(Vec::new()).cover(0.0, 0.0), None);
    }
}
