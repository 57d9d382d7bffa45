//! One list from several that share items: every list keeps its own order in it.

use std::cmp::Ordering;
use std::collections::HashMap;
use std::hash::Hash;

/// A list that has an item where the order of the lists before it does not allow it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Crossed<K> {
    /// The list.
    pub(super) list: usize,
    /// The item.
    pub(super) item: K,
}

/// An order of items.
pub(super) type Order<'a, K> = &'a dyn Fn(&K, &K) -> Ordering;

/// All items of all lists, each once. Where every list is sorted by one of the `orders`, the result is sorted by the first such order, and does
/// not depend on how the items are shared out. Lists that are sorted by several orders, such as lists of one item, are taken to follow one another
/// by one of them. Otherwise the lists are woven into one another in turn, each in its own order.
///
/// # Errors
/// Two lists hold the same items in different orders.
pub(super) fn merge<K: Copy + Eq + Hash>(lists: &[Vec<K>], orders: &[Order<'_, K>]) -> Result<Vec<K>, Crossed<K>> {
    let Some(first) = lists.first() else { return Ok(Vec::new()) };
    if lists.iter().all(|list| list == first) {
        return Ok(first.clone());
    }
    let is_sorted = |order: Order<'_, K>, list: &[K]| list.windows(2).all(|pair| order(&pair[0], &pair[1]) == Ordering::Less);
    let possible: Vec<&Order<'_, K>> = orders.iter().filter(|order| lists.iter().all(|list| is_sorted(**order, list))).collect();
    let firsts: Vec<K> = lists.iter().filter_map(|list| list.first().copied()).collect();
    let follows = |order: &Order<'_, K>| firsts.windows(2).all(|pair| order(&pair[0], &pair[1]) != Ordering::Greater);
    if let Some(order) = possible.iter().find(|order| follows(order)).or(possible.first()) {
        let mut all = lists.concat();
        all.sort_by(**order);
        all.dedup();
        return Ok(all);
    }
    let mut all = first.clone();
    for (k, list) in lists.iter().enumerate().skip(1) {
        all = woven(&all, list).map_err(|item| Crossed { list: k, item })?;
    }
    Ok(all)
}

/// Put the items of `list` that `all` lacks before the next item that both have, or at the end. The error is an item of another order.
fn woven<K: Copy + Eq + Hash>(all: &[K], list: &[K]) -> Result<Vec<K>, K> {
    let place: HashMap<K, usize> = all.iter().enumerate().map(|(place, item)| (*item, place)).collect();
    let mut out = Vec::with_capacity(all.len() + list.len());
    let (mut next, mut new) = (0, Vec::new());
    for item in list {
        match place.get(item) {
            Some(&at) if at < next => return Err(*item),
            Some(&at) => {
                out.extend_from_slice(&all[next..at]);
                out.append(&mut new);
                out.push(*item);
                next = at + 1;
            }
            None => new.push(*item),
        }
    }
    out.extend_from_slice(&all[next..]);
    out.append(&mut new);
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sorted_lists_give_a_sorted_list_however_they_are_cut() {
        let (up, down) = (|a: &i32, b: &i32| a.cmp(b), |a: &i32, b: &i32| b.cmp(a));
        let orders: [Order<'_, i32>; 2] = [&up, &down];
        assert_eq!(merge(&[vec![4, 6], vec![1, 5, 6]], &orders), Ok(vec![1, 4, 5, 6]));
        assert_eq!(merge(&[vec![6, 4], vec![5, 1]], &orders), Ok(vec![6, 5, 4, 1]));
        assert_eq!(merge::<i32>(&[], &orders), Ok(vec![]));
        assert_eq!(merge(&[vec![6], vec![4], vec![1]], &orders), Ok(vec![6, 4, 1]), "single items that follow one another");
        assert_eq!(merge(&[vec![4], vec![6], vec![1]], &orders), Ok(vec![1, 4, 6]));
    }

    #[test]
    fn other_lists_are_woven_and_keep_their_order() {
        let up = |a: &i32, b: &i32| a.cmp(b);
        assert_eq!(merge(&[vec![3, 1, 2], vec![3, 9, 2, 8]], &[&up]), Ok(vec![3, 1, 9, 2, 8]));
        assert_eq!(merge(&[vec![3, 1], vec![7, 5]], &[&up]), Ok(vec![3, 1, 7, 5]));
        assert_eq!(merge(&[vec![3, 1, 2], vec![2, 3]], &[&up]), Err(Crossed { list: 1, item: 3 }));
    }
}
