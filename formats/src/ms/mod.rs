//! Measurement Sets.
mod ffi;
mod table;
