//! Files on disk: written and read back, real ones against other programs, broken ones refused.

#[cfg(test)]
mod common;
#[cfg(test)]
mod conformance;
#[cfg(test)]
mod fits_images;
#[cfg(test)]
mod hostile;
#[cfg(test)]
mod in_place;
#[cfg(test)]
mod info;
#[cfg(test)]
mod kept;
#[cfg(test)]
mod overview;
#[cfg(test)]
mod patterns;
#[cfg(test)]
mod uvfits;
#[cfg(test)]
mod uvh5;
