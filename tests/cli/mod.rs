//! The command line as people and checks call it.

mod chain;
mod docs;
mod run;
mod study;
