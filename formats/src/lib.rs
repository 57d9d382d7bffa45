//! Everything cittert keeps on disk.

pub mod layouts;
