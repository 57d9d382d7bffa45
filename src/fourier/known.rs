//! Results that are computed once in a process: each transform asks for the same few kernels and numbers of nodes, and finding them takes milliseconds.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

/// Most results that are kept.
const MOST: usize = 256;

/// The results of a function by its arguments.
pub(super) struct Known<K, V>(Mutex<BTreeMap<K, V>>);

impl<K: Ord, V: Clone> Known<K, V> {
    pub(super) const fn new() -> Self {
        Self(Mutex::new(BTreeMap::new()))
    }

    /// The result for `key`, which `make` computes where it is not known.
    pub(super) fn get(&self, key: K, make: impl FnOnce() -> V) -> V {
        let known = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(value) = known().get(&key) {
            return value.clone();
        }
        // Without the lock: others may look up their results, and at worst one is computed twice.
        let value = make();
        let mut all = known();
        if all.len() < MOST {
            all.insert(key, value.clone());
        }
        value
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_result_is_computed_once() {
        let known = Known::new();
        assert_eq!(known.get(3, || "three"), "three");
        assert_eq!(known.get(3, || "again"), "three");
        assert_eq!(known.get(4, || "four"), "four");
    }
}
