//! The command line as people and checks call it.

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
