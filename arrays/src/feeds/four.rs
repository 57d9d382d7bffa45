//! The four products of two feeds as one matrix.

use super::jones::{Jones, adjoint, times};
use crate::{Polarization, VisibilityBlock};
use num_complex::{Complex, Complex64};

/// Where a set has each of the four products: \[feed of antenna 1\]\[feed of antenna 2\].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FourProducts(pub [[usize; 2]; 2]);

impl FourProducts {
    /// The places in a list of products; `None` where one is missing.
    #[must_use]
    pub fn of(products: &[Polarization]) -> Option<Self> {
        let find = |feeds: (usize, usize)| products.iter().position(|p| p.feeds() == Some(feeds));
        Some(Self([[find((0, 0))?, find((0, 1))?], [find((1, 0))?, find((1, 1))?]]))
    }

    /// The visibilities of a row and channel.
    #[must_use]
    pub fn get(&self, vis: &ndarray::Array3<Complex<f32>>, (row, chan): (usize, usize)) -> Jones {
        self.0.map(|feeds| feeds.map(|p| vis[(row, chan, p)]).map(|v| Complex64::new(v.re.into(), v.im.into())))
    }

    /// Put a matrix before the visibilities of a row and channel and another behind: V becomes A V B^H. A visibility that cannot be used makes all
    /// four unusable.
    pub fn transform(&self, block: &mut VisibilityBlock, at: (usize, usize), (a, b): (&Jones, &Jones)) {
        let all = || self.0.iter().flatten().map(|p| (at.0, at.1, *p));
        if all().any(|i| block.flags[i]) {
            all().for_each(|i| block.flags[i] = true);
        }
        let out = times(&times(a, &self.get(&block.vis, at)), &adjoint(b));
        for (places, values) in self.0.iter().zip(out) {
            for (p, v) in places.iter().zip(values) {
                block.vis[(at.0, at.1, *p)] = Complex::new(v.re as f32, v.im as f32);
            }
        }
    }
}

/// The matrix of leakages: each feed receives its own field, and d times that of the other.
#[must_use]
pub fn leakage_matrix(d: [Complex64; 2]) -> Jones {
    let one = Complex64::new(1.0, 0.0);
    [[one, d[0]], [d[1], one]]
}
