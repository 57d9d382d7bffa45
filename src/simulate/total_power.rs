//! Total power: autocorrelations, which hold the zero spacing of the scene and what the receiver adds.

use super::{Pedestal, SimulateOptions};
use crate::Result;
use crate::values::need;
use cittert_arrays::{Polarization, UvCoverage, VisibilityHeader};
use ndarray::{Array3, Axis};
use num_complex::Complex64;

/// Check that autocorrelations can be simulated.
///
/// # Errors
/// A constant is to be subtracted from the scene.
pub(super) fn check(options: &SimulateOptions) -> Result<()> {
    if let Pedestal::Kelvin(t) = options.pedestal {
        need("pedestal", t, false, "none with autos, which measure the power of the whole scene")?;
    }
    Ok(())
}

/// Add the power of the receivers to the autocorrelations of a block \[row, chan, pol\]. The noise of two feeds of one antenna is independent, so
/// that it adds nothing to their product. The power of one feed is real.
pub(super) fn add_receivers(header: &VisibilityHeader, coverage: &UvCoverage, sum: &mut Array3<Complex64>) {
    let freq_hz = header.spectrum.freq_hz();
    let powered: Vec<bool> = header.polarizations.iter().map(|p| p.is_parallel_hand() || *p == Polarization::I).collect();
    let same = coverage.ant1.iter().zip(&coverage.ant2).enumerate().filter(|(_, (a, b))| a == b);
    for (row, (antenna, _)) in same {
        for (chan, mut products) in sum.index_axis_mut(Axis(0), row).outer_iter_mut().enumerate() {
            let power = header.layout.receiver_power(*antenna as usize, header.unit, freq_hz[chan]).unwrap_or(0.0);
            products.iter_mut().zip(&powered).filter(|(_, has)| **has).for_each(|(v, _)| *v = (v.re + power).into());
        }
    }
}
