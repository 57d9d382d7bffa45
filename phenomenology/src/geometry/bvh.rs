//! A tree of bounding boxes.

use crate::space::Beam;
use crate::space::Bounds;
use crate::space::Ray;

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
}

/// The boxes of up to four descendants of a branch, side by side: low and high along x, y and z. A ray is tested against all at once, in single precision: the boxes are rounded
/// outwards, and so are the numbers of the ray, so that no box is missed.
#[derive(Debug, Clone)]
#[repr(align(16))]
struct Quad {
    bounds: [[f32; 4]; 6],
    /// Another quad, or items.
    links: [Link; 4],
    count: usize,
}

/// A quad, or an item.
#[derive(Debug, Clone, Copy, Default)]
struct Link(u32);

/// Marks an item.
const IS_ITEM: u32 = 1 << 31;

/// A number that is not below another one, and a little above it; its negative serves for the lower side.
#[inline]
fn above(x: f64) -> f32 {
    (x + (x.abs() * 1.3e-7 + 1e-30)) as f32
}

/// Relative error of a distance in single precision, with a margin.
const SLACK: f32 = 1e-6;

/// A ray in single precision.
struct Thin {
    /// Its origin, rounded up for lower planes, and down for upper ones.
    from: [[f32; 2]; 3],
    inverse: [f32; 3],
}

impl Thin {
    #[inline]
    fn new(ray: &Ray) -> Self {
        let (o, i) = (ray.origin, ray.inverse);
        Self { from: [o.x, o.y, o.z].map(|o| [above(o), -above(-o)]), inverse: [i.x as f32, i.y as f32, i.z as f32] }
    }
}

impl Quad {
    fn new(children: &[(Bounds, Link)]) -> Self {
        let mut quad = Self { bounds: [[0.0; 4]; 6], links: [Link::default(); 4], count: children.len() };
        for (k, (b, link)) in children.iter().enumerate() {
            for (axis, (low, high)) in [(b.min.x, b.max.x), (b.min.y, b.max.y), (b.min.z, b.max.z)].into_iter().enumerate() {
                quad.bounds[2 * axis][k] = -above(-low);
                quad.bounds[2 * axis + 1][k] = above(high);
            }
            quad.links[k] = *link;
        }
        quad
    }

    /// As [`Bounds::entry`] for all: where the ray enters and leaves them.
    #[inline(never)]
    fn entries(&self, ray: &Thin, t_max: f32) -> [[f32; 4]; 2] {
        let (mut near, mut far) = ([0.0; 4], [t_max; 4]);
        for axis in 0..3 {
            let ([low, high], inverse) = (ray.from[axis], ray.inverse[axis]);
            let a = self.bounds[2 * axis].map(|plane| (plane - low) * inverse);
            let b = self.bounds[2 * axis + 1].map(|plane| (plane - high) * inverse);
            near = larger(smaller(a, b), near);
            far = smaller(larger(a, b), far);
        }
        [near.map(|t| t * (1.0 - SLACK)), far.map(|t| t * (1.0 + SLACK))]
    }
}

#[inline]
fn smaller(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
    std::array::from_fn(|k| if a[k] < b[k] { a[k] } else { b[k] })
}

#[inline]
fn larger(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
    std::array::from_fn(|k| if a[k] > b[k] { a[k] } else { b[k] })
}

/// A bounding volume hierarchy over numbered items.
#[derive(Debug, Clone, Default)]
pub struct Bvh {
    nodes: Vec<Node>,
    /// The nodes for rays, the first one at the root.
    quads: Vec<Quad>,
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
        if !tree.nodes.is_empty() {
            tree.join(0);
        }
        tree
    }

    fn link(&mut self, at: usize) -> Link {
        match self.nodes[at] {
            Node { count: 0, .. } => self.join(at),
            Node { link, .. } => Link(IS_ITEM | self.items[link as usize]),
        }
    }

    /// Joins two levels of branches to quads, from a node down.
    fn join(&mut self, at: usize) -> Link {
        let of = |at: usize| match self.nodes[at] {
            Node { count: 0, link, .. } => vec![at + 1, link as usize],
            _ => vec![at],
        };
        let children: Vec<usize> = of(at).into_iter().flat_map(of).collect();
        let quad = self.quads.len();
        self.quads.push(Quad::new(&[]));
        let children: Vec<(Bounds, Link)> = children.into_iter().map(|child| (self.nodes[child].bounds, self.link(child))).collect();
        self.quads[quad] = Quad::new(&children);
        Link(quad as u32)
    }

    fn split(&mut self, bounds: &[Bounds], items: &mut [u32], first: usize, depth: usize) {
        let of = |items: &[u32]| items.iter().fold(Bounds::EMPTY, |b, i| b.union(bounds[*i as usize]));
        let all = of(items);
        let at = self.nodes.len();
        self.nodes.push(Node { bounds: all, link: first as u32, count: items.len() as u16 });
        if items.len() <= 1 {
            return;
        }
        let centers = Bounds::of_points(items.iter().map(|i| bounds[*i as usize].center()));
        let size = centers.size();
        let axis = (0..3).max_by(|a, b| size[*a].total_cmp(&size[*b])).unwrap_or(0);
        let center = |i: u32, axis: usize| bounds[i as usize].center()[axis];
        let halves = |items: &mut [u32]| {
            let k = items.len() / 2;
            items.select_nth_unstable_by(k, |a, b| center(*a, axis).total_cmp(&center(*b, axis)));
            k
        };
        let middle = if size[axis] > 0.0 && size[axis].is_finite() && depth < STACK / 2 {
            let bin_of = |axis: usize, i: u32| (((center(i, axis) - centers.min[axis]) / size[axis] * BINS as f64) as usize).min(BINS - 1);
            let splits = (0..3).filter(|axis| size[*axis] > 0.0).map(|axis| (best_bin(bounds, items, |i| bin_of(axis, i)), axis));
            let ((_, best), axis) = splits.min_by(|a, b| a.0.0.total_cmp(&b.0.0)).unwrap_or(((0.0, 1), axis));
            let bin_of = |i: u32| bin_of(axis, i);
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
        self.nodes[at] = Node { bounds: all, link, count: 0 };
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
        if self.quads.is_empty() {
            return;
        }
        let thin = Thin::new(ray);
        // Nodes to visit, and where the ray enters them.
        let mut later = [(0.0_f32, Link::default()); 3 * (STACK / 2) + 4];
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let (entry, link) = later[depth];
            let limit = t_max as f32 * (1.0 + SLACK);
            if entry > limit {
                continue;
            }
            if link.0 & IS_ITEM != 0 {
                t_max = visit(link.0 & !IS_ITEM, t_max);
                continue;
            }
            let quad = &self.quads[link.0 as usize];
            let [near, far] = quad.entries(&thin, limit);
            let first = depth;
            for k in 0..quad.count {
                if near[k] <= far[k] {
                    // The nearest last, so that it is visited first.
                    let mut place = depth;
                    while place > first && later[place - 1].0 < near[k] {
                        later[place] = later[place - 1];
                        place -= 1;
                    }
                    later[place] = (near[k], quad.links[k]);
                    depth += 1;
                }
            }
        }
    }
}

/// The least cost of a split, and the first bin of its right part. Both parts hold at least one item.
fn best_bin(bounds: &[Bounds], items: &[u32], bin_of: impl Fn(u32) -> usize) -> (f64, usize) {
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
    best
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
