//! Surfaces.
