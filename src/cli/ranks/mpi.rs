//! The collective operations by MPI.

use crate::cli::failure::{Failure, Result};
use cittert_arrays::Ranks;
use mpi::Threading;
use mpi::collective::SystemOperation;
use mpi::environment::Universe;
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator, CommunicatorCollectives, Root};
use std::sync::{Arc, Mutex};

/// Values of one message. MPI counts them in 32 bits.
const PART: usize = 1 << 20;

/// MPI, from the first call to the last.
static UNIVERSE: Mutex<Option<Universe>> = Mutex::new(None);

/// All processes that were started together.
struct World;

fn world() -> SimpleCommunicator {
    SimpleCommunicator::world()
}

impl World {
    /// Process 0 reduces and gives the result to all, so that all have the same bits.
    fn reduce(values: &mut [f64], operation: SystemOperation) {
        let world = world();
        let root = world.process_at_rank(0);
        for part in values.chunks_mut(PART) {
            if world.rank() == 0 {
                let own = part.to_vec();
                root.reduce_into_root(&own[..], part, operation);
            } else {
                root.reduce_into(&*part, operation);
            }
            root.broadcast_into(part);
        }
    }
}

impl Ranks for World {
    fn rank(&self) -> usize {
        world().rank().unsigned_abs() as usize
    }

    fn size(&self) -> usize {
        world().size().unsigned_abs() as usize
    }

    fn sum(&self, values: &mut [f64]) {
        Self::reduce(values, SystemOperation::sum());
    }

    fn largest(&self, values: &mut [f64]) {
        Self::reduce(values, SystemOperation::max());
    }

    fn meet(&self) {
        world().barrier();
    }
}

/// Begin with MPI. One thread at a time calls it.
pub(super) fn join() -> Result<Arc<dyn Ranks>> {
    let Some((universe, threading)) = mpi::initialize_with_threading(Threading::Serialized) else {
        return Err(Failure::message("MPI cannot be initialised"));
    };
    if let Ok(mut kept) = UNIVERSE.lock() {
        *kept = Some(universe);
    }
    if threading < Threading::Serialized {
        return Err(Failure::message("this MPI allows no threads, which cittert needs"));
    }
    Ok(Arc::new(World))
}

/// End with MPI. All processes must do so.
pub(super) fn leave() {
    if let Ok(mut kept) = UNIVERSE.lock() {
        drop(kept.take());
    }
}

/// End all processes.
pub(super) fn abort(code: u8) {
    world().abort(code.into());
}
