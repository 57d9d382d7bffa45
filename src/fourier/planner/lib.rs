//! Plans of fast Fourier transforms in single and double precision.
//!
//! The generic code of rustfft for one precision is as large as an eighth of all code of cittert. A generic function is compiled in every crate
//! that uses it, so this crate, which names both precisions, saves compiling it again with every change of the library and of its tests.

use ndarray::Array2;
use ndrustfft::{FftHandler, Normalization, ndfft_inplace_par, ndifft_inplace_par};
use num_complex::Complex64;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

pub use rustfft::{Fft, FftDirection, FftNum, num_traits};

macro_rules! planned {
    ($(#[$doc:meta])* $name:ident, $t:ty) => {
        $(#[$doc])*
        #[must_use]
        pub fn $name(len: usize, direction: FftDirection) -> Arc<dyn Fft<$t>> {
            static PLANNER: OnceLock<Mutex<rustfft::FftPlanner<$t>>> = OnceLock::new();
            let planner = PLANNER.get_or_init(|| Mutex::new(rustfft::FftPlanner::new()));
            // A planner is a cache, which remains valid after a panic in another thread.
            planner.lock().unwrap_or_else(PoisonError::into_inner).plan_fft(len, direction)
        }
    };
}
planned! {
    /// A plan in single precision for a transform of this length. The process makes each plan once.
    single, f32
}
planned! {
    /// A plan in double precision for a transform of this length. The process makes each plan once.
    double, f64
}

/// Transform along an axis with exp(-2 pi i j k / n), or with the opposite sign if the direction is inverse. The result is not normalised.
pub fn along(values: &mut Array2<Complex64>, axis: usize, direction: FftDirection) {
    let handler = FftHandler::new(values.shape()[axis]).normalization(Normalization::None);
    match direction {
        FftDirection::Forward => ndfft_inplace_par(values, &handler, axis),
        FftDirection::Inverse => ndifft_inplace_par(values, &handler, axis),
    }
}
