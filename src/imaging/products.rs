//! The products of the antennas of a set, integration by integration: what the noise of an image is predicted from.

use super::pol::PolSelector;
use crate::memory::MemoryBudget;
use crate::values::need;
use crate::{ChainError, Result, ensure};
use cittert_arrays::{Polarization, VisibilityBlock, VisibilityHeader, VisibilitySource, for_each_block};
use ndarray::Array2;
use num_complex::{Complex32, Complex64};

/// Weights of autocorrelations within this part of those of Gaussian fields state the noise of scene and receivers together.
const ALIKE: f64 = 0.1;

/// One integration of a set.
#[derive(Debug, Clone)]
pub(super) struct Integration {
    /// First and last row, and one beyond.
    pub(super) rows: std::ops::Range<usize>,
    /// Length, s.
    pub(super) length_s: f64,
}

/// All rows of a set, reduced to one product.
#[derive(Debug, Clone)]
pub struct Products {
    pub(super) ant1: Vec<u32>,
    pub(super) ant2: Vec<u32>,
    pub(super) uvw_m: Array2<f64>,
    pub(super) integrations: Vec<Integration>,
    /// Visibilities and weights \[row x chan\].
    vis: Vec<Complex32>,
    weight: Vec<f32>,
    /// Independent samples of a channel in one second \[chan\].
    pub(super) samples_per_s: Vec<f64>,
}

/// Size in bytes of a datum.
const BYTES: usize = 12;

impl Products {
    /// Read a set.
    ///
    /// # Errors
    /// A set that does not fit into its share of the memory, a product that the set does not have, or a source that fails.
    pub fn read(source: &mut dyn VisibilitySource, product: Polarization, memory: MemoryBudget) -> Result<Self> {
        let header: VisibilityHeader = source.header().clone();
        let selector = PolSelector::new(product, &header.polarizations)?;
        let (n_rows, n_chan) = (source.n_rows(), header.spectrum.n_chan());
        let fits = n_rows.saturating_mul(n_chan).saturating_mul(BYTES) <= memory.kept_visibilities();
        let value = format!("a set of {n_rows} rows and {n_chan} channels");
        need("delta-t", value, fits, "a set that fits into the memory: give more (--memory), or fewer rows")?;
        // The mean of two hands averages twice the samples of one.
        let hands = if selector.terms() > 1 { 2.0 } else { 1.0 };
        let mut out = Self {
            ant1: Vec::new(),
            ant2: Vec::new(),
            uvw_m: Array2::zeros((0, 3)),
            integrations: Vec::new(),
            vis: vec![Complex32::default(); n_rows * n_chan],
            weight: vec![0.0; n_rows * n_chan],
            samples_per_s: header.spectrum.width_hz().iter().map(|w| w * hands).collect(),
        };
        let (mut uvw, mut last) = (Vec::with_capacity(3 * n_rows), f64::NAN);
        for_each_block(source, memory.block(), |first, block: VisibilityBlock| -> Result<()> {
            for row in 0..block.n_rows() {
                let at = (first + row) * n_chan..(first + row + 1) * n_chan;
                selector.combine(&block, (row, None), false, (&mut out.vis[at.clone()], &mut out.weight[at]));
                let (time, length_s) = (block.coverage.time_jd[row], block.coverage.integration_s[row]);
                match out.integrations.last_mut() {
                    Some(i) if time == last => i.rows.end = first + row + 1,
                    _ => out.integrations.push(Integration { rows: first + row..first + row + 1, length_s }),
                }
                last = time;
                uvw.extend(block.coverage.uvw_m.row(row));
            }
            out.ant1.extend(&block.coverage.ant1);
            out.ant2.extend(&block.coverage.ant2);
            Ok(())
        })?;
        out.uvw_m = Array2::from_shape_vec((uvw.len() / 3, 3), uvw).map_err(|e| ChainError::Internal(e.to_string()))?;
        ensure!(!out.integrations.is_empty(), ChainError::NoData("the set has no rows".into()));
        Ok(out)
    }

    pub(super) fn n_chan(&self) -> usize {
        self.samples_per_s.len()
    }

    pub(super) fn vis(&self, row: usize, chan: usize) -> Complex64 {
        let v = self.vis[row * self.n_chan() + chan];
        Complex64::new(v.re.into(), v.im.into())
    }

    pub(super) fn weight(&self, row: usize, chan: usize) -> f64 {
        f64::from(self.weight[row * self.n_chan() + chan])
    }

    /// True if autocorrelations of all antennas hold the whole power of each, and the weights are those of Gaussian fields of this power.
    #[must_use]
    pub fn are_of_fields(&self) -> bool {
        let mut ratios = Vec::new();
        for i in &self.integrations {
            let mut with_power = std::collections::HashSet::new();
            for row in i.rows.clone() {
                if self.ant1[row] != self.ant2[row] {
                    continue;
                }
                with_power.insert(self.ant1[row]);
                for (chan, per_s) in self.samples_per_s.iter().enumerate().filter(|(c, _)| self.weight(row, *c) > 0.0) {
                    ratios.push(self.weight(row, chan) * self.vis(row, chan).norm_sqr() / (per_s * i.length_s));
                }
            }
            let all = |a: &[u32]| a[i.rows.clone()].iter().all(|a| with_power.contains(a));
            if !(all(&self.ant1) && all(&self.ant2)) {
                return false;
            }
        }
        ratios.sort_by(f64::total_cmp);
        ratios.get(ratios.len() / 2).is_some_and(|r| (r - 1.0).abs() <= ALIKE)
    }
}
