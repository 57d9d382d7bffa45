//! What the optimiser may change: the positions of free elements, from which those of all elements follow.

use std::f64::consts::TAU;

/// Free elements, their copies under a rotational symmetry about the centre, and fixed elements.
#[derive(Debug, Clone, PartialEq)]
pub struct Freedom {
    /// Number of free elements, each with `symmetry` copies.
    pub free: usize,
    /// Order of the rotational symmetry; 1 for none.
    pub symmetry: usize,
    /// Elements that stay where they are.
    pub fixed: Vec<[f64; 2]>,
}

impl Freedom {
    /// All elements are free.
    #[must_use]
    pub fn all(elements: usize) -> Self {
        Self { free: elements, symmetry: 1, fixed: Vec::new() }
    }

    /// Number of variables: two for each free element.
    #[must_use]
    pub fn variables(&self) -> usize {
        2 * self.free
    }

    /// Number of elements.
    #[must_use]
    pub fn elements(&self) -> usize {
        self.free * self.symmetry + self.fixed.len()
    }

    fn turn(&self, copy: usize) -> (f64, f64) {
        if copy == 0 { (0.0, 1.0) } else { (TAU * copy as f64 / self.symmetry as f64).sin_cos() }
    }

    /// The positions of all elements: the copies of the first free element, of the second, ..., then the fixed ones.
    #[must_use]
    pub fn positions(&self, variables: &[f64]) -> Vec<[f64; 2]> {
        let mut out = Vec::with_capacity(self.elements());
        for p in variables.as_chunks::<2>().0 {
            out.extend((0..self.symmetry).map(|copy| {
                let (s, c) = self.turn(copy);
                [c * p[0] - s * p[1], s * p[0] + c * p[1]]
            }));
        }
        out.extend(&self.fixed);
        out
    }

    /// The gradient by the variables, given that by the positions.
    pub fn pull_back(&self, by_position: &[[f64; 2]], by_variable: &mut [f64]) {
        for (k, v) in by_variable.as_chunks_mut::<2>().0.iter_mut().enumerate() {
            *v = [0.0; 2];
            for copy in 0..self.symmetry {
                let ((s, c), g) = (self.turn(copy), by_position[k * self.symmetry + copy]);
                v[0] += c * g[0] + s * g[1];
                v[1] += c * g[1] - s * g[0];
            }
        }
    }

    /// The variables of positions that are listed as [`Freedom::positions`] does.
    #[must_use]
    pub fn variables_of(&self, xy: &[[f64; 2]]) -> Vec<f64> {
        (0..self.free).flat_map(|k| xy[k * self.symmetry]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies_and_gradients_follow_the_symmetry() {
        let freedom = Freedom { free: 2, symmetry: 3, fixed: vec![[0.1, 0.2]] };
        let x = [0.3, -0.1, 0.05, 0.4];
        let xy = freedom.positions(&x);
        assert_eq!(xy.len(), 7);
        assert_eq!(freedom.variables_of(&xy), x);
        let center = (0..3).fold([0.0; 2], |a, k| [a[0] + xy[k][0], a[1] + xy[k][1]]);
        assert!(center[0].abs() < 1e-15 && center[1].abs() < 1e-15);
        // The gradient of the sum of w . position by differences.
        let w: Vec<[f64; 2]> = (0..7).map(|k| [k as f64 - 2.0, 0.7 * k as f64]).collect();
        let f = |x: &[f64]| freedom.positions(x).iter().zip(&w).map(|(p, w)| p[0] * w[0] + p[1] * w[1]).sum::<f64>();
        let mut g = vec![0.0; 4];
        freedom.pull_back(&w, &mut g);
        for i in 0..4 {
            let (mut a, mut b) = (x, x);
            a[i] += 0.5;
            b[i] -= 0.5;
            assert!((f(&a) - f(&b) - g[i]).abs() < 1e-12);
        }
    }
}
