//! Radiometric scene simulation at millimetre wavelengths.

pub mod dielectrics;
pub mod surfaces;
