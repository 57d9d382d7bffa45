//! Tests of the command line.

mod antennas;
mod calibration;
mod chain;
mod designer;
mod designs;
mod docs;
mod enhance;
mod film;
mod forecast;
mod layouts;
mod mem;
mod memory;
mod nearfield;
mod optimize;
mod options;
mod pages;
mod physics;
mod pictures;
mod refusals;
mod run;
mod scenes;
mod scores;
mod sensor;
mod sets;
mod shell;
mod study;
