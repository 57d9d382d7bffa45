//! Integration tests of the whole workspace: one binary, a module for each kind of test.

mod cli;
mod hostile;
mod program;
mod tidy;
