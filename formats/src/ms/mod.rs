//! Measurement Sets.
mod ffi;
mod keywords;
mod table;
