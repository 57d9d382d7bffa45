//! A tree of bounding boxes.

use crate::space::Beam;
use crate::space::Bounds;
use crate::space::Ray;

/// Largest number of items of a leaf.
const LEAF: usize = 2;
/// Number of bins of the search for the best split.
const BINS: usize = 16;
/// Largest depth of the tree, which is the size of the search stack. Half of it is left to splits in the middle, which add at most 32 levels.
const STACK: usize = 64;

#[derive(Debug, Clone, Copy)]
struct Node {
    bounds: Bounds,
    /// First item of a leaf, or right child of a branch (the left one follows the node).
    link: u32,
    /// Items of a leaf; 0 for a branch.
    count: u16,
    /// Axis of the split.
    axis: u16,
}

/// The boxes of the two children of a branch, side by side: low and high along x, y and z. A ray is tested against both at once.
#[derive(Debug, Clone, Copy, Default)]
#[repr(align(16))]
struct Pair([[f64; 2]; 6]);

impl Pair {
    fn new(left: &Bounds, right: &Bounds) -> Self {
        let of = |b: &Bounds| [b.min.x, b.max.x, b.min.y, b.max.y, b.min.z, b.max.z];
        let (left, right) = (of(left), of(right));
        Self(std::array::from_fn(|k| [left[k], right[k]]))
    }

    /// As [`Bounds::entry`] for both: where the ray enters and leaves them.
    #[inline]
    fn entries(&self, ray: &Ray, t_max: f64) -> [[f64; 2]; 2] {
        let (o, i) = (ray.origin, ray.inverse);
        let at = |k: usize, o: f64, i: f64| [(self.0[k][0] - o) * i, (self.0[k][1] - o) * i];
        let (x1, x2) = (at(0, o.x, i.x), at(1, o.x, i.x));
        let (y1, y2) = (at(2, o.y, i.y), at(3, o.y, i.y));
        let (z1, z2) = (at(4, o.z, i.z), at(5, o.z, i.z));
        let near = larger(larger(smaller(x1, x2), smaller(y1, y2)), larger(smaller(z1, z2), [0.0; 2]));
        let far = smaller(smaller(larger(x1, x2), larger(y1, y2)), smaller(larger(z1, z2), [t_max; 2]));
        [near, far]
    }
}

#[inline]
fn smaller(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [if a[0] < b[0] { a[0] } else { b[0] }, if a[1] < b[1] { a[1] } else { b[1] }]
}

#[inline]
fn larger(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [if a[0] > b[0] { a[0] } else { b[0] }, if a[1] > b[1] { a[1] } else { b[1] }]
}

/// A bounding volume hierarchy over numbered items.
#[derive(Debug, Clone, Default)]
pub struct Bvh {
    nodes: Vec<Node>,
    /// The children of each branch. // [node]
    pairs: Vec<Pair>,
    items: Vec<u32>,
    /// Items without finite bounds. Every search tests them.
    endless: Vec<u32>,
}

impl Bvh {
    /// A tree over items with these bounds. Items with empty bounds are left out.
    ///
    /// The surface area heuristic, evaluated in bins, selects the splits.
    #[must_use]
    pub fn new(bounds: &[Bounds]) -> Self {
        let mut tree = Self::default();
        for (i, b) in bounds.iter().enumerate() {
            if !b.is_empty() {
                if b.is_finite() { &mut tree.items } else { &mut tree.endless }.push(i as u32);
            }
        }
        if !tree.items.is_empty() {
            let mut items = std::mem::take(&mut tree.items);
            tree.split(bounds, &mut items, 0, 0);
            tree.items = items;
        }
        let pair = |(at, node): (usize, &Node)| match node.count {
            0 => Pair::new(&tree.nodes[at + 1].bounds, &tree.nodes[node.link as usize].bounds),
            _ => Pair::default(),
        };
        tree.pairs = tree.nodes.iter().enumerate().map(pair).collect();
        tree
    }

    fn split(&mut self, bounds: &[Bounds], items: &mut [u32], first: usize, depth: usize) {
        let of = |items: &[u32]| items.iter().fold(Bounds::EMPTY, |b, i| b.union(bounds[*i as usize]));
        let all = of(items);
        let at = self.nodes.len();
        self.nodes.push(Node { bounds: all, link: first as u32, count: items.len() as u16, axis: 0 });
        if items.len() <= LEAF {
            return;
        }
        let centers = Bounds::of_points(items.iter().map(|i| bounds[*i as usize].center()));
        let size = centers.size();
        let axis = (0..3).max_by(|a, b| size[*a].total_cmp(&size[*b])).unwrap_or(0);
        let center = |i: u32| bounds[i as usize].center()[axis];
        let halves = |items: &mut [u32]| {
            let k = items.len() / 2;
            items.select_nth_unstable_by(k, |a, b| center(*a).total_cmp(&center(*b)));
            k
        };
        let middle = if size[axis] > 0.0 && size[axis].is_finite() && depth < STACK / 2 {
            let bin_of = |i: u32| (((center(i) - centers.min[axis]) / size[axis] * BINS as f64) as usize).min(BINS - 1);
            let best = best_bin(bounds, items, bin_of);
            let mut k = 0;
            for j in 0..items.len() {
                if bin_of(items[j]) < best {
                    items.swap(j, k);
                    k += 1;
                }
            }
            // Rounding may put all items on one side.
            if k == 0 || k == items.len() { halves(items) } else { k }
        } else {
            // All boxes have one centre, or the tree is unbalanced. Splits into halves limit its depth.
            halves(items)
        };
        let (left, right) = items.split_at_mut(middle);
        self.split(bounds, left, first, depth + 1);
        let link = self.nodes.len() as u32;
        self.split(bounds, right, first + middle, depth + 1);
        self.nodes[at] = Node { bounds: all, link, count: 0, axis: axis as u16 };
    }

    /// Finds the leaves of the tree that a beam may meet, as items with a distance before which no ray enters the leaf, m. Returns false if the
    /// items are more than `most`, or if one has no finite box.
    #[must_use]
    pub fn in_the_way(&self, beam: &Beam, most: usize, found: &mut Vec<(f64, u32)>) -> bool {
        found.clear();
        if !self.endless.is_empty() {
            return false;
        }
        let mut stack = [0_u32; STACK + 2];
        let mut depth = usize::from(!self.nodes.is_empty());
        while depth > 0 {
            depth -= 1;
            let at = stack[depth];
            let node = &self.nodes[at as usize];
            let Some(entry) = beam.entry(&node.bounds) else { continue };
            if node.count == 0 {
                stack[depth] = at + 1;
                stack[depth + 1] = node.link;
                depth += 2;
                continue;
            }
            let items = &self.items[node.link as usize..node.link as usize + usize::from(node.count)];
            if found.len() + items.len() > most {
                return false;
            }
            found.extend(items.iter().map(|item| (entry, *item)));
        }
        true
    }

    /// Visits the items whose boxes a ray meets before `t_max`, the nearest first. `visit` returns the new `t_max`.
    #[inline]
    pub fn visit(&self, ray: &Ray, mut t_max: f64, mut visit: impl FnMut(u32, f64) -> f64) {
        for &item in &self.endless {
            t_max = visit(item, t_max);
        }
        if self.nodes.is_empty() || self.nodes[0].bounds.entry(ray, t_max).is_none() {
            return;
        }
        // Nodes to visit, and where the ray enters them.
        let (mut later, mut entries) = ([0_u32; STACK], [0.0_f64; STACK]);
        let mut depth = 0;
        let mut at = 0_u32;
        loop {
            let node = &self.nodes[at as usize];
            if node.count > 0 {
                for &item in &self.items[node.link as usize..node.link as usize + usize::from(node.count)] {
                    t_max = visit(item, t_max);
                }
            } else {
                let (left, right) = (at + 1, node.link);
                let [[a, b], far] = self.pairs[at as usize].entries(ray, t_max);
                match (a <= far[0], b <= far[1]) {
                    (true, true) => {
                        let left_first = a < b || (a == b && ray.direction[usize::from(node.axis)] >= 0.0);
                        let (near, far, entry) = if left_first { (left, right, b) } else { (right, left, a) };
                        (later[depth], entries[depth]) = (far, entry);
                        depth += 1;
                        at = near;
                        continue;
                    }
                    (true, false) => {
                        at = left;
                        continue;
                    }
                    (false, true) => {
                        at = right;
                        continue;
                    }
                    (false, false) => {}
                }
            }
            loop {
                if depth == 0 {
                    return;
                }
                depth -= 1;
                if entries[depth] <= t_max {
                    at = later[depth];
                    break;
                }
            }
        }
    }
}

/// First bin of the right part of the split of least cost. Both parts hold at least one item.
fn best_bin(bounds: &[Bounds], items: &[u32], bin_of: impl Fn(u32) -> usize) -> usize {
    let mut bins = [(Bounds::EMPTY, 0_usize); BINS];
    for &i in items {
        let bin = &mut bins[bin_of(i)];
        bin.0 = bin.0.union(bounds[i as usize]);
        bin.1 += 1;
    }
    let mut right = [(0.0, 0_usize); BINS];
    let mut sum = (Bounds::EMPTY, 0);
    for k in (1..BINS).rev() {
        sum = (sum.0.union(bins[k].0), sum.1 + bins[k].1);
        right[k] = (sum.0.half_area(), sum.1);
    }
    let mut left = (Bounds::EMPTY, 0);
    let mut best = (f64::INFINITY, 1);
    for k in 1..BINS {
        left = (left.0.union(bins[k - 1].0), left.1 + bins[k - 1].1);
        if left.1 > 0 && right[k].1 > 0 {
            let cost = left.0.half_area() * left.1 as f64 + right[k].0 * right[k].1 as f64;
            if cost < best.0 {
                best = (cost, k);
            }
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::Vec3;

    fn boxes(n: usize) -> Vec<Bounds> {
        // A spread without pattern, from an integer hash.
        let number = |k: usize, salt: usize| ((k * 2_654_435_761 + salt * 40_503) % 100_003) as f64 / 1000.0;
        (0..n).map(|k| Bounds::around(Vec3::new(number(k, 1), number(k, 2), number(k, 3)), Vec3::new(0.5, 0.5, 0.5))).collect()
    }

    #[test]
    fn finds_what_a_search_of_all_finds() {
        let all = boxes(500);
        let tree = Bvh::new(&all);
        for k in 0..200 {
            let a = Vec3::new(-10.0, f64::from(k) * 0.5, 50.0);
            let ray = Ray::new(a, Vec3::new(1.0, 0.3 - f64::from(k) * 0.003, 0.1));
            let mut found: Vec<u32> = Vec::new();
            tree.visit(&ray, 1e9, |i, t| {
                if all[i as usize].entry(&ray, t).is_some() {
                    found.push(i);
                }
                t
            });
            found.sort_unstable();
            let mut way = Vec::new();
            let thin = Beam::new(Bounds::of_points([ray.origin]), Bounds::of_points([ray.direction]));
            assert!(tree.in_the_way(&thin, 500, &mut way) && found.iter().all(|i| way.iter().any(|w| w.1 == *i)));
            assert!(found.is_empty() || !tree.in_the_way(&thin, 0, &mut way));
            let direct: Vec<u32> = (0..500).filter(|i| all[*i as usize].entry(&ray, 1e9).is_some()).collect();
            assert_eq!(found, direct);
        }
    }

    #[test]
    fn boxes_on_one_spot_and_endless_ones_are_held() {
        let mut all = vec![Bounds::around(Vec3::ZERO, Vec3::new(1.0, 1.0, 1.0)); 300];
        all.push(Bounds::ALL);
        all.push(Bounds::EMPTY);
        let tree = Bvh::new(&all);
        let mut seen = 0;
        tree.visit(&Ray::new(Vec3::new(-5.0, 0.0, 0.0), Vec3::new(1.0, 0.0, 0.0)), 1e9, |_, t| {
            seen += 1;
            t
        });
        assert_eq!(seen, 301);
    }
}
