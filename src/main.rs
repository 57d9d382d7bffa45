//! The `cittert` program.
fn main() {}
