//! A block of rows as bytes, on its way from one process to another of the same program.

use crate::{ArrayError, Result, UvCoverage, VisibilityBlock};
use ndarray::{Array2, Array3};
use num_complex::Complex32;

impl VisibilityBlock {
    /// All that the block holds, as [`VisibilityBlock::from_bytes`] reads it.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let (c, (n, n_chan, n_pol)) = (&self.coverage, self.vis.dim());
        let mut out = Vec::with_capacity(24 + n * (50 + 17 * n_chan * n_pol));
        [n, n_chan, n_pol].iter().for_each(|n| out.extend((*n as u64).to_le_bytes()));
        c.uvw_m.iter().chain(&c.time_jd).chain(&c.integration_s).for_each(|x| out.extend(x.to_le_bytes()));
        c.ant1.iter().chain(&c.ant2).for_each(|a| out.extend(a.to_le_bytes()));
        c.phase_center.iter().for_each(|p| out.extend(p.to_le_bytes()));
        for v in &self.vis {
            out.extend(v.re.to_le_bytes());
            out.extend(v.im.to_le_bytes());
        }
        self.weights.iter().chain(&self.nsamples).for_each(|x| out.extend(x.to_le_bytes()));
        out.extend(self.flags.iter().map(|f| u8::from(*f)));
        out
    }

    /// The block of these bytes.
    ///
    /// # Errors
    /// Bytes that are cut short.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let mut rest = Rest(bytes);
        let [n, n_chan, n_pol] = [rest.next()?, rest.next()?, rest.next()?].map(|b| u64::from_le_bytes(b) as usize);
        let shape = (n, n_chan, n_pol);
        let samples = n.saturating_mul(n_chan).saturating_mul(n_pol);
        let uvw_m = Array2::from_shape_vec((n, 3), rest.values(3 * n, f64::from_le_bytes)?).map_err(|_| cut_short())?;
        let (time_jd, integration_s) = (rest.values(n, f64::from_le_bytes)?, rest.values(n, f64::from_le_bytes)?);
        let (ant1, ant2) = (rest.values(n, u32::from_le_bytes)?, rest.values(n, u32::from_le_bytes)?);
        let phase_center = rest.values(n, u16::from_le_bytes)?;
        let complex = |b: [u8; 8]| {
            let [re, im] = [[b[0], b[1], b[2], b[3]], [b[4], b[5], b[6], b[7]]].map(f32::from_le_bytes);
            Complex32::new(re, im)
        };
        let vis = cube(shape, rest.values(samples, complex)?)?;
        let weights = cube(shape, rest.values(samples, f32::from_le_bytes)?)?;
        let nsamples = cube(shape, rest.values(samples, f32::from_le_bytes)?)?;
        let flags = cube(shape, rest.values(samples, |[f]| f != 0)?)?;
        Self::new(UvCoverage::new(uvw_m, ant1, ant2, time_jd, integration_s, phase_center)?, vis, weights, flags, nsamples)
    }
}

/// Bytes that are not read yet.
struct Rest<'a>(&'a [u8]);

impl Rest<'_> {
    fn next<const N: usize>(&mut self) -> Result<[u8; N]> {
        let (next, rest) = self.0.split_first_chunk().ok_or_else(cut_short)?;
        self.0 = rest;
        Ok(*next)
    }

    fn values<T, const N: usize>(&mut self, n: usize, of: impl Fn([u8; N]) -> T) -> Result<Vec<T>> {
        let (own, rest) = self.0.split_at_checked(n.saturating_mul(N)).ok_or_else(cut_short)?;
        self.0 = rest;
        Ok(own.as_chunks::<N>().0.iter().map(|b| of(*b)).collect())
    }
}

fn cube<T>(shape: (usize, usize, usize), values: Vec<T>) -> Result<Array3<T>> {
    Array3::from_shape_vec(shape, values).map_err(|_| cut_short())
}

fn cut_short() -> ArrayError {
    ArrayError::Stream("a block of rows from another process is cut short".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_comes_back_from_its_bytes() {
        let coverage = UvCoverage::new(
            Array2::from_shape_fn((3, 3), |(r, k)| 0.1 + r as f64 - 3.0 * k as f64),
            vec![0, 1, 70_000],
            vec![5, 6, 7],
            vec![2_460_000.123_456_789, 1.0, f64::INFINITY],
            vec![10.0, 0.1, 1e-3],
            vec![0, 1, 40_000],
        );
        let mut block = VisibilityBlock::zeros(coverage.unwrap(), 2, 4);
        block.vis.indexed_iter_mut().for_each(|((r, c, p), v)| *v = Complex32::new(r as f32 + 0.1, c as f32 - p as f32 / 3.0));
        block.weights.indexed_iter_mut().for_each(|((r, c, p), w)| *w = (r * 8 + c * 4 + p) as f32);
        block.nsamples.fill(7.0);
        block.flags[(1, 1, 3)] = true;
        let bytes = block.to_bytes();
        assert_eq!(VisibilityBlock::from_bytes(&bytes).unwrap(), block);
        let empty = VisibilityBlock::zeros(UvCoverage::empty(), 2, 4);
        assert_eq!(VisibilityBlock::from_bytes(&empty.to_bytes()).unwrap(), empty);
        for cut in [0, 10, 24, bytes.len() - 1] {
            assert!(VisibilityBlock::from_bytes(&bytes[..cut]).is_err());
        }
    }
}
