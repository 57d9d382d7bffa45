//! Bad input gets one clear message, exit code 1 or 2, and loses nothing.

mod calibration;
mod collisions;
mod files;
mod imaging;
mod kept;
mod named;
mod numbers;
mod options;
mod physics;
mod scenes;
mod special;
