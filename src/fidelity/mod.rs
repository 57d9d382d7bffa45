//! Measures of the quality of an image, alone and compared with a true image.

mod compare;
mod noise;
mod shift;

pub use compare::{
    CompareOptions, Fidelity, Region, check_alignment, compare, compare_planes, convolve, dynamic_range, fidelity_index,
    off_source_dynamic_range, ssim,
};
pub use noise::robust_rms;
pub use shift::{find_shift, register, shifted};
