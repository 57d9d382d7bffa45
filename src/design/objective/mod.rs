//! What a layout is optimised for. Each kind of objective is one file and one row of [`OBJECTIVES`].
//!
//! Every figure is a number without unit that is smaller for a better layout, so that a weighted sum of several makes sense.

mod cable;
mod coverage;
mod delta_t;
mod density;
mod fill;
mod kind;
mod psl;
mod redundancy;
mod residual;
mod rms;
mod robust;
mod scene;

pub use kind::{FigureFunction, LayoutFigure, Objective, ObjectiveKind, Setting};

/// All kinds.
pub const OBJECTIVES: &[ObjectiveKind] = &[
    ObjectiveKind { name: "psl", about: "peak side lobe over the main lobe", gradient: true, make: psl::make },
    ObjectiveKind { name: "rms", about: "rms side lobe over the main lobe", gradient: true, make: rms::make },
    ObjectiveKind { name: "fill", about: "share of the u-v disc that is not filled", gradient: false, make: fill::make },
    ObjectiveKind {
        name: "density",
        about: "rms difference of the beam from that of the density of baselines",
        gradient: true,
        make: density::make,
    },
    ObjectiveKind { name: "redundancy", about: "share of the baselines that repeat another", gradient: false, make: redundancy::make },
    ObjectiveKind { name: "cable", about: "length of the shortest tree of cables, in apertures", gradient: true, make: cable::make },
    ObjectiveKind { name: "delta-t", about: "noise in kelvin relative to an evenly filled disc", gradient: true, make: delta_t::make },
    ObjectiveKind { name: "robust", about: "peak side lobe after the loss of any one element", gradient: true, make: robust::make },
    ObjectiveKind {
        name: "coverage",
        about: "share of the u-v plane that a choice of sites on the Earth leaves empty over a track",
        gradient: false,
        make: coverage::make,
    },
    ObjectiveKind { name: "scene", about: "error of the image of a scene through the whole chain", gradient: false, make: scene::make },
];

#[cfg(test)]
mod tests;
