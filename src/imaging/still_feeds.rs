//! A set of turning feeds as feeds that keep their angle on the sky would have measured it.

use crate::{ChainError, Result};
use cittert_arrays::feeds::{Feeds, FourProducts, Jones, inverse, times};
use cittert_arrays::{ArrayError, VisibilityBlock, VisibilityHeader, VisibilitySource};
use ndarray::Array3;
use num_complex::Complex64;
use std::ops::Range;

/// Turns the four products of every row to feeds at the position angle 0, as they are read. Nothing is stored.
///
/// With P of the feeds in a row and P0 of feeds that keep their angle, V becomes (P0 P1^-1) V (P0 P2^-1)^H. The variance of a product is the sum of
/// those of the products that are in it, with the squares of their coefficients.
pub struct StillFeeds {
    source: Box<dyn VisibilitySource>,
    header: VisibilityHeader,
    feeds: Feeds,
    four: FourProducts,
}

impl StillFeeds {
    /// Turn the rows of a source.
    ///
    /// # Errors
    /// The feeds of the set do not turn, a mount is unknown, or one of the four products is missing.
    pub fn new(source: Box<dyn VisibilitySource>) -> Result<Self> {
        let mut header = source.header().clone();
        let feeds = Feeds::of(&header)?;
        if !feeds.turn() {
            return Err(ChainError::Incompatible(
                "the set does not say that its feeds turn on the sky: there is nothing to turn back".into(),
            ));
        }
        let four = FourProducts::of(&header.polarizations)
            .ok_or_else(|| ChainError::Incompatible("feeds are turned back in sets of all four products, such as XX,XY,YX,YY".into()))?;
        Feeds::unstate(&mut header);
        Ok(Self { source, header, feeds, four })
    }

    fn turn_back(&self, block: &mut VisibilityBlock) -> cittert_arrays::Result<()> {
        let still = self.feeds.matrix(0.0);
        for row in 0..block.n_rows() {
            let angles = self.feeds.angles(block.coverage.time_jd[row], block.coverage.phase_center[row])?;
            let of = |ant: u32| inverse(&self.feeds.matrix(angles[ant as usize])).map_or(still, |p| times(&still, &p));
            let (a, b) = (of(block.coverage.ant1[row]), of(block.coverage.ant2[row]));
            for chan in 0..block.vis.dim().1 {
                self.four.transform(block, (row, chan), (&a, &b));
                mix_weights(&mut block.weights, (row, chan), &self.four, (&a, &b));
            }
        }
        Ok(())
    }
}

/// Weights of the products A V B^H.
fn mix_weights(weights: &mut Array3<f32>, (row, chan): (usize, usize), four: &FourProducts, (a, b): (&Jones, &Jones)) {
    let old = four.0.map(|feeds| feeds.map(|p| f64::from(weights[(row, chan, p)])));
    let size = |m: &Jones| m.map(|r| r.map(|x: Complex64| if x.norm_sqr() < 1e-18 { 0.0 } else { x.norm_sqr() }));
    let (a, b) = (size(a), size(b));
    for (j, places) in four.0.iter().enumerate() {
        for (k, p) in places.iter().enumerate() {
            let mut variance = 0.0;
            for (m, row) in old.iter().enumerate() {
                for (n, w) in row.iter().enumerate() {
                    let part = a[j][m] * b[k][n];
                    variance += if part > 0.0 { part / w } else { 0.0 };
                }
            }
            weights[(row, chan, *p)] = if variance > 0.0 && variance.is_finite() { variance.recip() as f32 } else { 0.0 };
        }
    }
}

impl VisibilitySource for StillFeeds {
    fn header(&self) -> &VisibilityHeader {
        &self.header
    }

    fn n_rows(&self) -> usize {
        self.source.n_rows()
    }

    fn ranks(&self) -> std::sync::Arc<dyn cittert_arrays::Ranks> {
        self.source.ranks()
    }

    fn read_rows(&mut self, range: Range<usize>) -> cittert_arrays::Result<VisibilityBlock> {
        let mut block = self.source.read_rows(range)?;
        self.turn_back(&mut block).map_err(|e| ArrayError::Stream(Box::new(e)))?;
        Ok(block)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::Polarization;

    #[test]
    fn weights_mix_with_the_squares_of_the_coefficients() {
        let four = FourProducts::of(&[Polarization::XX, Polarization::XY, Polarization::YX, Polarization::YY]).unwrap();
        let mut weights = Array3::from_shape_vec((1, 1, 4), vec![1.0, 2.0, 2.0, 4.0]).unwrap();
        let feeds = cittert_arrays::feeds::feed_matrix(false, false, std::f64::consts::FRAC_PI_4);
        mix_weights(&mut weights, (0, 0), &four, (&feeds, &feeds));
        // Each of the four has a part of 1/4 of the variance.
        let expected = 1.0 / (0.25 * (1.0 + 0.5 + 0.5 + 0.25));
        assert!(weights.iter().all(|w| (f64::from(*w) - expected).abs() < 1e-6), "{weights}");
    }
}
