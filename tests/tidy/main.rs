//! Checks of the source code itself: the order of its modules, the owners of external packages, and the names of files.

#[cfg(test)]
mod circles;
#[cfg(test)]
mod files;
#[cfg(test)]
mod floors;
#[cfg(test)]
mod lexer;
#[cfg(test)]
mod owners;
#[cfg(test)]
mod page;
#[cfg(test)]
mod parser;
#[cfg(test)]
mod project;
#[cfg(test)]
mod resolve;
#[cfg(test)]
mod ties;
