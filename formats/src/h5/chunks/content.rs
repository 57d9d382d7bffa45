//! What an unpacked chunk holds, and the memory of chunks.
//!
//! Weights and flags are often the same in a whole chunk. One element of it is then kept, and a chunk that is stored as the same bytes is not unpacked.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

/// Elements that are contiguous both in a row of a chunk and in a row of the array. `to` and `from` count from the start of the chunk.
#[derive(Clone, Copy)]
pub(in crate::h5) struct Run {
    pub(super) to: usize,
    pub(super) from: usize,
    pub(super) n: usize,
}

/// Runs by the extent of a chunk on all axes but the first. Chunks at the end of an axis may be cut off.
pub(in crate::h5) type Runs = BTreeMap<Vec<usize>, Vec<Run>>;

/// The rows of an unpacked chunk from row `first` on, and their place within the rows of the array.
pub(in crate::h5) struct Unpacked<'r> {
    pub(super) first: usize,
    /// Number of rows.
    pub(super) rows: usize,
    pub(super) to: usize,
    pub(super) runs: &'r [Run],
    pub(super) content: Content,
}

impl Unpacked<'_> {
    /// The bytes of every element, if they are known to be the same.
    pub(in crate::h5) fn every(&self) -> Option<&[u8]> {
        match &self.content {
            Content::Every(element) => Some(element),
            Content::Each(_) => None,
        }
    }
}

/// The elements of a chunk.
#[derive(Clone)]
pub(super) enum Content {
    /// One after the other.
    Each(Vec<u8>),
    /// The one that all of them are.
    Every(Vec<u8>),
}

impl Content {
    /// Of elements with `size` bytes. The memory of elements that are all the same serves other chunks.
    pub(super) fn of(bytes: Vec<u8>, size: usize, spare: &Spare) -> Self {
        // The comparison ends at the first element that differs.
        if bytes.len() < size || bytes[size..] != bytes[..bytes.len() - size] {
            return Self::Each(bytes);
        }
        let element = bytes[..size].to_vec();
        spare.keep([bytes]);
        Self::Every(element)
    }
}

/// Memory of chunks that are done, for the next ones of the same dataset: the heap has one lock for all threads.
#[derive(Default)]
pub(in crate::h5) struct Spare(Mutex<Vec<Vec<u8>>>);

impl Spare {
    /// Memory without content for so many bytes; new if there is none.
    pub(super) fn take(&self, most: usize) -> Vec<u8> {
        let spare = self.0.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut bytes = spare.filter(|bytes| bytes.capacity() >= most).unwrap_or_else(|| Vec::with_capacity(most));
        bytes.clear();
        bytes
    }

    /// Keep the memory of chunks.
    pub(in crate::h5) fn give<'r>(&self, done: impl IntoIterator<Item = Unpacked<'r>>) {
        let memory = |unpacked: Unpacked<'r>| match unpacked.content {
            Content::Each(bytes) => Some(bytes),
            Content::Every(_) => None,
        };
        self.keep(done.into_iter().filter_map(memory));
    }

    fn keep(&self, memory: impl IntoIterator<Item = Vec<u8>>) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).extend(memory);
    }
}

/// A chunk with one value, as the file stores it: its bytes, and the filters that were not applied.
struct Alike {
    stored: (Vec<u8>, u32),
    element: Vec<u8>,
}

/// The last chunk of a dataset with one value.
#[derive(Default)]
pub(super) struct LastAlike(Mutex<Option<Arc<Alike>>>);

impl LastAlike {
    /// The content of a chunk that is stored like the last one.
    pub(super) fn content(&self, stored: &(Vec<u8>, u32)) -> Option<Content> {
        let last = self.0.lock().unwrap_or_else(PoisonError::into_inner).clone();
        last.filter(|last| last.stored == *stored).map(|last| Content::Every(last.element.clone()))
    }

    /// Note how a chunk is stored, if it has one value.
    pub(super) fn note(&self, stored: (Vec<u8>, u32), content: &Content) {
        if let Content::Every(element) = content {
            let alike = Alike { stored, element: element.clone() };
            *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(Arc::new(alike));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_that_are_the_same_are_kept_once() {
        let spare = Spare::default();
        let every = |bytes: &[u8], size| match Content::of(bytes.to_vec(), size, &spare) {
            Content::Every(element) => Some(element),
            Content::Each(all) => {
                assert_eq!(all, bytes);
                None
            }
        };
        assert_eq!(every(&[1, 2, 1, 2, 1, 2], 2), Some(vec![1, 2]));
        assert_eq!(every(&[1, 2, 1, 2, 1, 3], 2), None);
        assert_eq!(every(&[1, 1, 1, 2], 2), None);
        assert_eq!(every(&[7], 1), Some(vec![7]));
        // The memory of both chunks with one value is there for others.
        assert_eq!(spare.0.lock().unwrap().len(), 2);
    }

    #[test]
    fn only_a_chunk_that_is_stored_alike_has_the_same_content() {
        let (last, stored) = (LastAlike::default(), (vec![5, 6], 0));
        last.note(stored.clone(), &Content::Each(vec![1, 2]));
        assert!(last.content(&stored).is_none());
        last.note(stored.clone(), &Content::Every(vec![9]));
        assert!(matches!(last.content(&stored), Some(Content::Every(e)) if e == [9]));
        for other in [(vec![5, 6, 0], 0), (vec![5, 7], 0), (vec![5, 6], 1)] {
            assert!(last.content(&other).is_none());
        }
    }
}
