//! The bands of the receivers. A channel of a set is the integral of H_p conj(H_q) V over the frequency, with the complex responses H of the two
//! receivers. Off the phase centre V turns with the frequency, and the fringe washes out as the shapes of the bands tell.

mod nodes;
mod receiver;
mod shape;
#[cfg(test)]
mod tests;

pub(super) use nodes::{BandNodes, largest_delay_s};
pub use receiver::{Receiver, Receivers};
pub use shape::BandShape;
