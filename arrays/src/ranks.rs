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

    /// Begin to give each process its letter, of at most 2^31 words. The letters travel while this process goes on. Each process takes as many, by [`Ranks::got`], in the order in
    /// which they were given.
    fn give(&self, letters: Letters) -> Box<dyn Underway> {
        for to in (0..self.size()).filter(|to| *to != self.rank()) {
            self.send(to, bytemuck::cast_slice(letters.of(to)));
        }
        Box::new(letters)
    }

    /// Take the next letter of every other process. That of this one is empty: it is among those that it gave.
    fn got(&self, inbox: &mut Letters) {
        let of = |from: usize| if from == self.rank() { Vec::new() } else { self.awaited(from) };
        let all: Vec<Vec<u8>> = (0..self.size()).map(of).collect();
        inbox.set_lengths(all.iter().map(|bytes| bytes.len() / size_of::<u64>()));
        for (bytes, words) in all.iter().zip(inbox.each_mut()) {
            let place: &mut [u8] = bytemuck::cast_slice_mut(words);
            place.copy_from_slice(&bytes[..place.len()]);
        }
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

/// A letter for each process, or of each, in the order of their numbers. The letters lie in memory that serves for others later.
#[derive(Debug, Default)]
pub struct Letters {
    words: Vec<u64>,
    /// Where each letter ends.
    ends: Vec<usize>,
}

impl Letters {
    /// Make these letters of so many words, whatever they say.
    pub fn set_lengths(&mut self, lengths: impl Iterator<Item = usize>) {
        self.ends.clear();
        self.ends.extend(lengths.scan(0, |end, n| {
            *end += n;
            Some(*end)
        }));
        let all = self.ends.last().copied().unwrap_or(0);
        if all > self.words.len() {
            // What the memory held is not needed. The next letters may be a little longer.
            self.words = Vec::new();
            self.words.resize(all + all / 16, 0);
        }
    }

    /// The letter for a process, or of it.
    #[must_use]
    pub fn of(&self, process: usize) -> &[u64] {
        let start = if process == 0 { 0 } else { self.ends[process - 1] };
        &self.words[start..self.ends[process]]
    }

    /// The letters, to be written.
    pub fn each_mut(&mut self) -> impl Iterator<Item = &mut [u64]> {
        let mut rest = &mut self.words[..];
        let mut start = 0;
        self.ends.iter().map(move |end| {
            let (letter, others) = std::mem::take(&mut rest).split_at_mut(end - start);
            (rest, start) = (others, *end);
            letter
        })
    }
}

/// Letters that are on their way.
pub trait Underway: Send + std::fmt::Debug {
    /// What they say.
    fn letters(&self) -> &Letters;

    /// Wait until they have left this process, and give their memory back.
    fn back(self: Box<Self>) -> Letters;
}

impl Underway for Letters {
    fn letters(&self) -> &Letters {
        self
    }

    fn back(self: Box<Self>) -> Letters {
        *self
    }
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
