//! Lengths of cable that connect all antennas.

use crate::ArrayLayout;

impl ArrayLayout {
    /// Length of the shortest network of straight cables from antenna to antenna that connects all, m: the minimum spanning tree.
    ///
    /// # Reference
    /// Prim 1957, Bell Syst. Tech. J. 36, 1389.
    #[must_use]
    pub fn cable_m(&self) -> f64 {
        let mut rest: Vec<([f64; 3], f64)> = self.antennas().iter().map(|a| (a.position_m, f64::INFINITY)).collect();
        let Some((mut last, _)) = rest.pop() else { return 0.0 };
        let mut total = 0.0;
        // Each step connects the antenna that is nearest to those connected so far.
        while !rest.is_empty() {
            for (position, nearest) in &mut rest {
                *nearest = nearest.min(distance(*position, last));
            }
            let next = (0..rest.len()).min_by(|a, b| rest[*a].1.total_cmp(&rest[*b].1)).unwrap_or(0);
            let (position, length) = rest.swap_remove(next);
            total += length;
            last = position;
        }
        total
    }

    /// Length of straight cables from each antenna to a hub, m. The hub is in the frame of the layout.
    #[must_use]
    pub fn cable_to_m(&self, hub_m: [f64; 3]) -> f64 {
        self.antennas().iter().map(|a| distance(a.position_m, hub_m)).sum()
    }
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use crate::{Antenna, ArrayLayout, LayoutFrame};

    #[test]
    fn a_star_and_a_tree_of_known_lengths() {
        let at = |i: u32, x, y| Antenna::new(format!("A{i}"), i, [x, y, 0.0]);
        let square = vec![at(0, 0.0, 0.0), at(1, 1.0, 0.0), at(2, 0.0, 1.0), at(3, 1.0, 1.0), at(4, 3.0, 1.0)];
        let l = ArrayLayout::new("t", LayoutFrame::Boresight, square).unwrap();
        // Three sides of the square and the way to the antenna beside it.
        assert!((l.cable_m() - 5.0).abs() < 1e-15, "{}", l.cable_m());
        let star = 4.0 * 0.5_f64.sqrt() + 2.5_f64.hypot(0.5);
        assert!((l.cable_to_m([0.5, 0.5, 0.0]) - star).abs() < 1e-15);
    }
}
