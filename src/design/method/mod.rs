//! Ways to a good layout from a start. Each method is one file and one row of [`METHODS`].

mod annealing;
mod descent;
mod genetic;
mod kind;
mod swarm;

pub use kind::{Beginning, MethodKind, Work};

/// All methods for elements that move freely.
pub const METHODS: &[MethodKind] = &[
    MethodKind {
        name: "descent",
        about: "L-BFGS on analytic gradients; peak side lobes alone are then lowered together",
        gradient: true,
        run: descent::run,
    },
    MethodKind { name: "annealing", about: "simulated annealing, one element at a time", gradient: false, run: annealing::run },
    MethodKind { name: "swarm", about: "particle swarm", gradient: false, run: swarm::run },
    MethodKind { name: "genetic", about: "layouts that are cut along a line and joined", gradient: false, run: genetic::run },
];

#[cfg(test)]
mod tests;
