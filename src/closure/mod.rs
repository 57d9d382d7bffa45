//! Closure phases and closure amplitudes: combinations of visibilities that antenna gains cannot change.
//!
//! | file | what it does |
//! |---|---|
//! | `baselines` | indices of the pairs of antennas |
//! | `time` | averaging and solution intervals |
//! | `sets` | the triangles and quadrangles on which closure quantities are formed |
//! | `collect` | the samples of each averaging interval |
//! | `options` | options of closure quantities |
//! | `quantities` | closure phases and amplitudes with their errors |
//! | `tally` | sums over all quantities of one kind |

mod baselines;
mod collect;
mod options;
mod quantities;
mod sets;
mod tally;
#[cfg(test)]
pub(crate) mod testdata;
mod time;

pub(crate) use baselines::{n_pairs, pair_index, pairs_of};
pub use collect::ClosureKey;
pub use options::{ClosureChannels, ClosureOptions};
pub use quantities::{ClosureAmplitude, ClosurePhase, closure_amplitudes, closure_phases};
pub use sets::ClosureSet;
pub(crate) use sets::{Links, quadrangles, triangles};
pub use tally::{ClosurePoint, ClosureTally};
pub use time::SolutionInterval;
pub(crate) use time::{TimeBins, TimeSpan};
