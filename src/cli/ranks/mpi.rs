//! The collective operations by MPI.

use crate::cli::failure::{Failure, Result};
use cittert_arrays::{Letters, Ranks, Underway};
use mpi::collective::SystemOperation;
use mpi::datatype::{Equivalence, Partition, PartitionMut};
use mpi::environment::Universe;
use mpi::point_to_point::{MatchedReceiveVec, Message, Status};
use mpi::request::{Request, StaticScope};
use mpi::topology::{Rank, SimpleCommunicator};
use mpi::traits::{Communicator, CommunicatorCollectives, Destination, Root, Source};
use mpi::{Count, Threading};
use std::mem::ManuallyDrop;
use std::sync::{Arc, Mutex};

/// Values of one message. MPI counts them in 32 bits.
const PART: usize = 1 << 20;
/// Bytes of one message.
const BYTES: usize = 1 << 26;
/// A place in memory for no bytes.
static NO_BYTES: [u8; 1] = [0];
/// Tags of the last part of a message, and of all others.
const LAST: i32 = 1;
const MORE: i32 = 2;
/// Tag of a letter.
const LETTER: i32 = 3;

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

    /// A message whose first part is at hand.
    fn rest_of((message, status): (Message, Status)) -> (usize, Vec<u8>) {
        let from = status.source_rank();
        let (mut all, mut last) = (message, status).matched_receive_vec::<u8>();
        while last.tag() == MORE {
            let (part, status) = world().process_at_rank(from).receive_vec::<u8>();
            all.extend(part);
            last = status;
        }
        (from.unsigned_abs() as usize, all)
    }
}

fn number(process: usize) -> Rank {
    Rank::try_from(process).unwrap_or(Rank::MAX)
}

/// Letters on their way to all processes. They stay in memory until they have left, even if nobody waits for that.
struct Post {
    letters: ManuallyDrop<Letters>,
    requests: Vec<ManuallyDrop<Request<'static, [u64]>>>,
}

impl Post {
    fn new(letters: Letters) -> Self {
        let (world, letters) = (world(), ManuallyDrop::new(letters));
        let send = |to: Rank| {
            let words: *const [u64] = letters.of(to.unsigned_abs() as usize);
            // SAFETY: the words keep their place and their content until `back` has waited for all requests.
            let words = unsafe { &*words };
            ManuallyDrop::new(world.process_at_rank(to).immediate_send_with_tag(StaticScope, words, LETTER))
        };
        let requests = (0..world.size()).filter(|to| *to != world.rank()).map(send).collect();
        Self { letters, requests }
    }
}

// SAFETY: `join` has asked for an MPI that any thread may call, one at a time, and that is how the program calls it.
unsafe impl Send for Post {}

impl std::fmt::Debug for Post {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Post").field("requests", &self.requests.len()).finish_non_exhaustive()
    }
}

impl Underway for Post {
    fn letters(&self) -> &Letters {
        &self.letters
    }

    fn back(self: Box<Self>) -> Letters {
        for request in self.requests {
            ManuallyDrop::into_inner(request).wait_without_status();
        }
        ManuallyDrop::into_inner(self.letters)
    }
}

/// The lengths of parts that follow one another, and where they start, as MPI counts them.
fn counted(lengths: impl Iterator<Item = usize>) -> (Vec<Count>, Vec<Count>) {
    let of = |n: usize| Count::try_from(n).unwrap_or(Count::MAX);
    lengths.scan(0, |at, n| Some((of(n), of(std::mem::replace(at, *at + n))))).unzip()
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

    fn exchange(&self, own: Vec<u8>) -> Vec<Vec<u8>> {
        let world = world();
        let mut own = Some(own);
        let of = |root: Rank| {
            let mut bytes = if root == world.rank() { own.take().unwrap_or_default() } else { Vec::new() };
            let mut n = bytes.len() as u64;
            let process = world.process_at_rank(root);
            process.broadcast_into(&mut n);
            bytes.resize(n as usize, 0);
            bytes.chunks_mut(BYTES).for_each(|part| process.broadcast_into(part));
            bytes
        };
        (0..world.size()).map(of).collect()
    }

    fn deal(&self, own: &[u8], lengths: &[usize], all: &mut [u8]) {
        // No bytes lie at address 1, which MPI takes for its sign that the buffer of what is got has what is given too.
        let own = if own.is_empty() { &NO_BYTES[..0] } else { own };
        let mine = lengths.get(self.rank()).copied().unwrap_or(0);
        let ((counts, starts), (from_each, places)) = (counted(lengths.iter().copied()), counted(lengths.iter().map(|_| mine)));
        world().all_to_all_varcount_into(&Partition::new(own, counts, starts), &mut PartitionMut::new(all, from_each, places));
    }

    fn give(&self, letters: Letters) -> Box<dyn Underway> {
        Box::new(Post::new(letters))
    }

    fn got(&self, inbox: &mut Letters) {
        let world = world();
        let next = |from: Rank| (from != world.rank()).then(|| world.process_at_rank(from).matched_probe_with_tag(LETTER));
        let found: Vec<_> = (0..world.size()).map(next).collect();
        let words = |status: &Status| status.count(u64::equivalent_datatype()).unsigned_abs() as usize;
        inbox.set_lengths(found.iter().map(|letter| letter.as_ref().map_or(0, |(_, status)| words(status))));
        for (letter, words) in found.into_iter().zip(inbox.each_mut()) {
            if let Some((message, _)) = letter {
                message.matched_receive_into(words);
            }
        }
    }

    fn send(&self, to: usize, message: &[u8]) {
        let world = world();
        let process = world.process_at_rank(number(to));
        let (mut rest, mut part) = (message, &message[..message.len().min(BYTES)]);
        loop {
            rest = &rest[part.len()..];
            process.send_with_tag(part, if rest.is_empty() { LAST } else { MORE });
            if rest.is_empty() {
                return;
            }
            part = &rest[..rest.len().min(BYTES)];
        }
    }

    fn take(&self) -> Option<(usize, Vec<u8>)> {
        world().any_process().immediate_matched_probe().map(Self::rest_of)
    }

    fn awaited(&self, from: usize) -> Vec<u8> {
        Self::rest_of(world().process_at_rank(number(from)).matched_probe()).1
    }
}

/// All processes are on this machine: Open MPI need not look for a network, which takes a quarter of a second. The user's own choice stays.
pub(super) fn need_no_network() {
    const CHOICES: [&str; 2] = ["OMPI_MCA_pml", "OMPI_MCA_mtl"];
    if CHOICES.iter().all(|name| std::env::var_os(name).is_none()) {
        // SAFETY: the program calls this before it starts a thread that reads variables of the environment.
        unsafe { std::env::set_var(CHOICES[0], "ob1") };
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
