//! Tests of the command line.

mod calibration;
mod chain;
mod docs;
mod mem;
mod options;
mod physics;
mod run;
mod scenes;
mod shell;
mod study;
