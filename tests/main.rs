//! Integration tests of the whole workspace: one binary, a module for each kind of test.

#[cfg(test)]
mod cli;
#[cfg(test)]
mod hostile;
#[cfg(test)]
mod program;
