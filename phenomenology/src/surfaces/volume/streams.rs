//! The directions in which the radiation in a stack of layers is computed.
//!
//! A stream keeps its invariant `s = n sin(theta)` through every plane interface (Snell). Streams are sorted by it. A medium of index `n` has
//! those with `s < n`, which are the first in the list. Between the indices of two media, the streams are the nodes of a Gauss-Legendre rule
//! in the cosine of the denser of the two. There the radiance of every medium is a smooth function, so the sums over streams converge fast.
//!
//! A cosine in one medium and that in another have `n1^2 mu1 dmu1 = n2^2 mu2 dmu2`. The weights obey this, so the flux through an interface
//! is the same on both sides.

use crate::surfaces::quadrature::gauss_legendre_on;

/// Two indices nearer than this are one: total reflection between the two changes nothing that can be measured.
const SAME_INDEX: f64 = 1e-4;

/// Number of streams.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StreamOptions {
    /// Streams in the air, between horizon and zenith.
    pub air: usize,
    /// Streams for each unit of the cosine in a medium where the air has none. At least two are used.
    pub inner: usize,
}

impl Default for StreamOptions {
    /// Twice as many change the brightness of the test cases by less than 0.05 K.
    fn default() -> Self {
        Self { air: 20, inner: 20 }
    }
}

/// The streams of a stack.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Streams {
    /// Invariants `n sin(theta)`, ascending.
    pub invariants: Vec<f64>,
    /// Weight of each in the flux: `mu dmu` of air, or `n^2 mu dmu` of any medium that has the stream.
    pub flux: Vec<f64>,
    /// Number of streams in the air.
    pub air: usize,
}

/// The streams of one medium.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct MediumStreams {
    /// Cosines.
    pub mu: Vec<f64>,
    /// Weights; the sum is 1.
    pub weight: Vec<f64>,
}

impl Streams {
    /// Streams of media with the given indices below air.
    pub(super) fn new(indices: &[f64], options: StreamOptions) -> Self {
        let mut edges: Vec<f64> = indices.iter().copied().filter(|n| *n > 1.0 + SAME_INDEX).collect();
        edges.sort_by(f64::total_cmp);
        edges.dedup_by(|b, a| *b - *a < SAME_INDEX);
        let mut nodes = Vec::new();
        let mut below = 0.0;
        for (k, n) in std::iter::once(1.0).chain(edges).enumerate() {
            let widest = (1.0 - (below / n).powi(2)).sqrt();
            let count = if k == 0 { options.air } else { ((options.inner as f64 * widest).ceil() as usize).max(2) };
            for (mu, weight) in gauss_legendre_on(count, 0.0, widest) {
                nodes.push((n * (1.0 - mu * mu).sqrt(), n * n * mu * weight));
            }
            below = n;
        }
        nodes.sort_by(|a: &(f64, f64), b| a.0.total_cmp(&b.0));
        let air = nodes.partition_point(|(s, _)| *s < 1.0);
        let (invariants, flux) = nodes.into_iter().unzip();
        Self { invariants, flux, air }
    }

    /// Number of streams of a medium.
    pub(super) fn count(&self, index: f64) -> usize {
        self.invariants.partition_point(|s| *s < index)
    }

    /// The streams of a medium.
    pub(super) fn of(&self, index: f64) -> MediumStreams {
        let count = self.count(index);
        let mu: Vec<f64> = self.invariants[..count].iter().map(|s| (1.0 - (s / index).powi(2)).sqrt()).collect();
        let weight = mu.iter().zip(&self.flux).map(|(mu, flux)| flux / (index * index * mu)).collect();
        MediumStreams { mu, weight }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_medium_has_a_full_hemisphere() {
        let indices = [1.0, 1.2, 1.27, 1.78];
        let streams = Streams::new(&indices, StreamOptions::default());
        for n in indices {
            let own = streams.of(n);
            let sum = |power: i32| own.mu.iter().zip(&own.weight).map(|(m, w)| w * m.powi(power)).sum::<f64>();
            for power in 0..6 {
                let exact = 1.0 / f64::from(power + 1);
                assert!((sum(power) - exact).abs() < 1e-8, "index {n}, power {power}: {}", sum(power) - exact);
            }
        }
        assert_eq!(streams.air, 20);
        assert!(streams.count(1.2) < streams.count(1.27));
    }
}
