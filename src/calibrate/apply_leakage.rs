//! Leakages onto or out of the data: V = D1^-1 V_leaked D2^-H.

use super::lookup::interval_of;
use crate::{ChainError, Result};
use cittert_arrays::feeds::{FourProducts, Jones, inverse, leakage_matrix};
use cittert_arrays::{GainTable, VisibilityBlock, VisibilityHeader};
use ndarray::Array4;
use num_complex::Complex64;

/// The leakages of a table matched to a set of four products.
#[derive(Debug, Clone)]
pub(super) struct LeakageApplier<'a> {
    table: &'a GainTable,
    leakages: &'a Array4<Complex64>,
    four: FourProducts,
}

impl<'a> LeakageApplier<'a> {
    /// The leakages of a table; none where it has none.
    ///
    /// # Errors
    /// The set lacks one of the four products.
    pub(super) fn new(table: &'a GainTable, header: &VisibilityHeader) -> Result<Option<Self>> {
        let Some(leakages) = &table.leakages else { return Ok(None) };
        let four = FourProducts::of(&header.polarizations).ok_or_else(|| {
            let names: Vec<&str> = header.polarizations.iter().map(|p| p.name()).collect();
            ChainError::Incompatible(format!(
                "the gain table has leakages, which mix the four products of two feeds, but the set has {}",
                names.join(", ")
            ))
        })?;
        Ok(Some(Self { table, leakages, four }))
    }

    /// Change all channels of a row. The antennas are places in the table, and `channel` gives its channel for each of the set. Returns the number
    /// of samples that were flagged because a leakage is unknown. The leakages are taken out if `calibrate` is true, otherwise put in.
    pub(super) fn apply(
        &self,
        block: &mut VisibilityBlock,
        row: usize,
        (antennas, channel): ([Option<usize>; 2], &[usize]),
        (calibrate, flag_unsolved): (bool, bool),
    ) -> u64 {
        let interval = interval_of(self.table, block.coverage.time_jd[row]);
        let mut flagged = 0;
        for (chan, from) in channel.iter().enumerate() {
            let matrix = |antenna: Option<usize>| -> Option<Jones> {
                let at = |feed| (interval, antenna.unwrap_or(0), *from, feed);
                antenna.filter(|_| !self.table.flags[at(0)] && !self.table.flags[at(1)])?;
                let d = leakage_matrix([self.leakages[at(0)], self.leakages[at(1)]]);
                if calibrate { inverse(&d) } else { Some(d) }
            };
            match (matrix(antennas[0]), matrix(antennas[1])) {
                (Some(a), Some(b)) => self.four.transform(block, (row, chan), (&a, &b)),
                _ if flag_unsolved => {
                    self.four.0.iter().flatten().for_each(|p| block.flags[(row, chan, *p)] = true);
                    flagged += 4;
                }
                _ => {}
            }
        }
        flagged
    }
}
