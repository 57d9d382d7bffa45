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

/// The patches that may lie at the points of a small part of the ground: those whose outline may cross it, the topmost first, and the cover under them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Few {
    across: Box<[u32]>,
    under: Option<u32>,
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

    /// The cover of all points of a rectangle; `None` if it may have several. It may reach beyond the grid of all patches only.
    fn only(&self, low: [f64; 2], high: [f64; 2]) -> Option<Option<u32>> {
        let last = CELLS as f64 - 1.0;
        // Cells that touch it, with a margin for rounding.
        let place = |k: usize, at: f64, more: f64| (at - self.low[k]) * self.per_m[k] + more;
        let [from, to] = [[0, 1].map(|k| place(k, low[k], -2e-3)), [0, 1].map(|k| place(k, high[k], 2e-3))];
        let beyond = (0..2).any(|k| to[k] < 0.0 || from[k] > last + 1.0);
        if beyond {
            return Some(None);
        }
        let inside = (0..2).all(|k| from[k] >= 0.0 && to[k] <= last + 1.0);
        let mut found = if inside { None } else { Some(None) };
        let [from, to] = [from, to].map(|p| p.map(|v| v.clamp(0.0, last) as usize));
        for (row, column) in (from[1]..=to[1]).flat_map(|r| (from[0]..=to[0]).map(move |c| (r, c))) {
            let here = match &self.cells[row * CELLS + column] {
                Cell::Leaf { across, under } if across.is_empty() => *under,
                Cell::Leaf { .. } => return None,
                Cell::Finer(finer) => {
                    let corner = [0, 1].map(|k| self.low[k] + [column, row][k] as f64 / self.per_m[k]);
                    let end = [0, 1].map(|k| corner[k] + 1.0 / self.per_m[k]);
                    finer.only([0, 1].map(|k| low[k].max(corner[k])), [0, 1].map(|k| high[k].min(end[k])))?
                }
            };
            if *found.get_or_insert(here) != here {
                return None;
            }
        }
        found
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

    /// The cover of all points of a rectangle, which is `None` where no patch lies. The outer `None` says that it may have several.
    pub(super) fn only(&self, low: [f64; 2], high: [f64; 2]) -> Option<Option<u32>> {
        let Some(root) = &self.root else { return Some(None) };
        root.only(low, high)
    }

    /// The patches that may lie at the points of a rectangle; `None` if they are more than `most`.
    pub(super) fn few(&self, low: [f64; 2], high: [f64; 2], most: usize) -> Option<Few> {
        let mut few = Few::default();
        let mut across = Vec::new();
        for (i, patch) in self.patches.iter().enumerate().rev() {
            match patch.lies(low, high) {
                Lies::Outside => {}
                Lies::Across if across.len() == most => return None,
                Lies::Across => across.push(i as u32),
                Lies::Inside => {
                    few.under = Some(patch.cover());
                    break;
                }
            }
        }
        few.across = across.into();
        Some(few)
    }

    /// As [`PatchIndex::cover`] at a point where only these patches may lie.
    #[inline]
    pub(super) fn cover_of(&self, few: &Few, x: f64, y: f64) -> Option<u32> {
        let hit = few.across.iter().map(|i| &self.patches[*i as usize]).find(|p| p.contains(x, y));
        hit.map(Patch::cover).or(few.under)
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
        // A rectangle of one cover has it at all of its points.
        let (mut found, mut many) = (0, 0);
        for i in 0..4000 {
            let (x, y) = (f64::from(i) * 0.717 % 130.0 - 15.0, f64::from(i) * 0.391_7 % 120.0 - 15.0);
            let size = f64::from(i % 7) * 0.4;
            if let Some(few) = index.few([x, y], [x + size, y + size], 4) {
                many += usize::from(few.across.len() > 1);
                for k in 0..100 {
                    let (u, v) = (x + size * f64::from(k % 10) / 9.0, y + size * f64::from(k / 10) / 9.0);
                    assert_eq!(index.cover_of(&few, u, v), index.cover(u, v), "{u} {v}");
                }
            }
            let Some(only) = index.only([x, y], [x + size, y + size]) else { continue };
            found += 1;
            for k in 0..100 {
                let (u, v) = (x + size * f64::from(k % 10) / 9.0, y + size * f64::from(k / 10) / 9.0);
                assert_eq!(index.cover(u, v), only, "{u} {v}");
            }
        }
        assert!(found > 1000 && many > 100, "{found} {many}");
        assert_eq!(PatchIndex::new(Vec::new()).only([0.0; 2], [1.0; 2]), Some(None));
        assert_eq!(PatchIndex::new(Vec::new()).cover(0.0, 0.0), None);
    }
}
