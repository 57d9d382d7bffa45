//! Several processes that work on one set. Each reads its own rows, and sums over all rows come from all processes.
//!
//! The algorithms know only the few collective operations of [`Ranks`]. A source says which processes share it (`VisibilitySource::ranks`); for
//! every other source the process is alone, and a collective operation does nothing. All processes must call the same operations in the same
//! order, and all get the same bits, so that what follows from a sum is the same decision everywhere. Messages go from one process to another: work that
//! is handed out, and rows that one process writes for all.

/// The processes that share a set, as one of them sees them.
pub trait Ranks: Send + Sync {
    /// The number of this process, from 0.
    fn rank(&self) -> usize {
        0
    }

    /// How many processes there are.
    fn size(&self) -> usize {
        1
    }

    /// Replace each value by its sum over all processes.
    fn sum(&self, _values: &mut [f64]) {}

    /// Replace each value by the largest of all processes.
    fn largest(&self, _values: &mut [f64]) {}

    /// Wait until all processes are here.
    fn meet(&self) {}

    /// What each process gives, in the order of their numbers.
    fn exchange(&self, own: Vec<u8>) -> Vec<Vec<u8>> {
        vec![own]
    }

    /// Give each process its part of `own`, whose lengths are `lengths`, and get into `all` what every process gives to this one, in the order of
    /// their numbers. All processes state the same lengths.
    fn deal(&self, own: &[u8], _lengths: &[usize], all: &mut [u8]) {
        all.copy_from_slice(own);
    }

    /// Begin to give each process the words of its place in `gifts`, of which each has at most 2^31. They travel while this process goes on; [`Ranks::got`] ends the trade.
    /// Several trades that have begun end in the order in which they began.
    fn give(&self, mut gifts: Vec<Vec<u64>>) -> Gifts {
        let own = gifts.get_mut(self.rank()).map(std::mem::take).unwrap_or_default();
        for (to, words) in gifts.iter().enumerate().filter(|(to, _)| *to != self.rank()) {
            self.send(to, &words.iter().flat_map(|word| word.to_ne_bytes()).collect::<Vec<u8>>());
        }
        Gifts { own, underway: None }
    }

    /// End a trade: what every process gives to this one, in the order of their numbers.
    fn got(&self, mut gifts: Gifts) -> Vec<Vec<u64>> {
        let words = |bytes: Vec<u8>| bytes.as_chunks().0.iter().map(|word| u64::from_ne_bytes(*word)).collect();
        let of = |from: usize| if from == self.rank() { std::mem::take(&mut gifts.own) } else { words(self.awaited(from)) };
        (0..self.size()).map(of).collect()
    }

    /// Send a message to another process, which must take or await it. Messages between two processes keep their order.
    fn send(&self, _to: usize, _message: &[u8]) {}

    /// The next message of any process, with its sender, if one has come. It does not wait.
    fn take(&self) -> Option<(usize, Vec<u8>)> {
        None
    }

    /// Wait for the next message of a process.
    fn awaited(&self, _from: usize) -> Vec<u8> {
        Vec::new()
    }
}

/// What a process gives in a trade that has begun.
pub struct Gifts {
    /// What it keeps for itself.
    pub own: Vec<u64>,
    /// What is on its way to others.
    pub underway: Option<Box<dyn Underway>>,
}

impl std::fmt::Debug for Gifts {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Gifts").field("own", &self.own.len()).finish_non_exhaustive()
    }
}

/// Messages that are on their way.
pub trait Underway: Send {
    /// Wait until they have left this process.
    fn wait(self: Box<Self>);
}

/// Where the items of a process stand among those of all: the number of the first, and how many all processes have. `own` is how many this one has; the
/// processes follow each other in the order of their numbers.
pub fn place_among(ranks: &dyn Ranks, own: usize) -> (usize, usize) {
    let counts = ranks.exchange((own as u64).to_le_bytes().to_vec());
    let count = |bytes: &Vec<u8>| bytes.first_chunk().map_or(0, |bytes| u64::from_le_bytes(*bytes) as usize);
    let before = counts.iter().take(ranks.rank()).map(count).sum();
    (before, counts.iter().map(count).sum())
}

/// A process that shares its data with no other.
#[derive(Debug, Clone, Copy, Default)]
pub struct Alone;

impl Ranks for Alone {}
