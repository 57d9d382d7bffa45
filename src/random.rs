//! Random numbers that depend only on the seed, the purpose and the index: the source of the whole project.

pub use cittert_arrays::random::stream;
