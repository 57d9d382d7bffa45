//! The command line as people and checks call it.

mod chain;
mod docs;
mod physics;
mod run;
