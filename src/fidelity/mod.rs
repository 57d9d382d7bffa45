//! Measures of the quality of an image, alone and compared with a true image.

mod alignment;
mod compare;
mod convolve;
mod noise;
mod region;
mod regrid;
mod resolution;
mod scores;
mod shift;

pub use alignment::check_alignment;
pub use compare::{CompareOptions, Comparison, Dimmed, Field, compare};
pub use convolve::convolve;
pub use noise::robust_rms;
pub use region::Region;
pub use regrid::regrid;
pub use scores::{
    Fidelity, compare_planes, compare_planes_through, error_over_grey_card, fidelity_index, fidelity_of_pixel, peak_over_robust_rms, ssim,
};
pub use shift::{find_shift, shifted};
